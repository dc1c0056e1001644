//! Hooks that a reload changes, adds or removes, beside those that run: no alert waits for the end of a run.

use super::{Dispatcher, HookQueue};
use crate::config::HookConfig;
use std::sync::Arc;
use std::time::Duration;

impl Dispatcher {
    /// Goes by `hooks` from here on. A hook that is in the config already goes on, with what it runs and what waits for it, by what it says now:
    /// known by its name, as receipts are. A hook that is left out ends what it runs, within `limit`, and nothing else. Where `is_reread`, files that hooks take when they are set up have changed, and each is set up anew.
    pub(in crate::runtime) fn change_hooks(
        &mut self,
        hooks: &[HookConfig],
        is_reread: bool,
        limit: Duration,
    ) {
        while self.workers.try_join_next().is_some() {}
        let mut former = std::mem::take(&mut self.hooks);
        let mut take = |is_it: &dyn Fn(&HookQueue) -> bool| {
            let place = former.iter().position(is_it);
            place.map(|place| former.remove(place))
        };
        let same = hooks.iter().map(|hook| take(&|way| *way.hook == *hook));
        let same: Vec<Option<HookQueue>> = same.collect();
        let known = hooks.iter().zip(same).map(|(hook, same)| {
            let is_same = same.is_some() && !is_reread;
            let way = same.or_else(|| take(&|way| way.hook.name() == hook.name()));
            way.map(|way| if is_same { way } else { way.changed(hook) })
        });
        let known: Vec<Option<HookQueue>> = known.collect();
        for way in former {
            self.stop_worker(way, limit);
        }
        for (hook, known) in hooks.iter().zip(known) {
            let way = known.unwrap_or_else(|| {
                // People would be notified twice by both.
                let former = self.leaving.remove(&hook.name());
                self.begin(hook, former)
            });
            self.hooks.push(way);
        }
    }

    /// Nothing more comes for this hook.
    fn stop_worker(&mut self, way: HookQueue, limit: Duration) {
        let name = way.hook.name();
        way.changes.send_replace(None);
        self.leaving.insert(name.clone(), way.ended);
        let worker = way.worker;
        tokio::spawn(async move {
            tokio::time::sleep(limit).await;
            if !worker.is_finished() {
                tracing::error!(
                    hook = name,
                    "not in the config any more, and stopped half-way"
                );
                worker.abort();
            }
        });
    }
}

impl HookQueue {
    /// The same worker, by what `hook` says.
    fn changed(self, hook: &HookConfig) -> Self {
        let hook = Arc::new(hook.clone());
        self.changes.send_replace(Some(Arc::clone(&hook)));
        Self { hook, ..self }
    }
}
