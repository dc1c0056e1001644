//! Hooks that a reload changes, adds or removes, beside those that run: no alert waits for the end of a run.

use super::{Dispatcher, HookQueue};
use crate::config::HookConfig;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;
use tokio::task::AbortHandle;

/// A worker of a hook that is not in the config any more, until it has ended.
#[derive(Debug)]
pub(super) struct LeavingWorker {
    name: String,
    /// Closed when it has ended.
    ended: oneshot::Receiver<()>,
}

/// What is known of a worker that runs.
#[derive(Debug)]
pub(super) struct WorkerHandle {
    pub(super) abort: AbortHandle,
    /// Closed when it has ended.
    pub(super) ended: oneshot::Receiver<()>,
}

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
            self.part_with(way, limit);
        }
        for (hook, known) in hooks.iter().zip(known) {
            let way = known.unwrap_or_else(|| {
                let former = self.leaving(&hook.name());
                self.begin(hook, former)
            });
            self.hooks.push(way);
        }
    }

    /// The worker of a hook of this name that is at work still: a new one waits for its end, or people would be notified twice.
    fn leaving(&mut self, name: &str) -> Option<oneshot::Receiver<()>> {
        let place = self.leaving.iter().position(|one| one.name == name);
        place.map(|place| self.leaving.swap_remove(place).ended)
    }

    /// Nothing more comes for this hook.
    fn part_with(&mut self, way: HookQueue, limit: Duration) {
        let HookQueue {
            hook,
            changes,
            worker,
            ..
        } = way;
        changes.send_replace(None);
        let WorkerHandle { abort, ended } = worker;
        let name = hook.name();
        let text = name.clone();
        tokio::spawn(async move {
            tokio::time::sleep(limit).await;
            if !abort.is_finished() {
                tracing::error!(
                    hook = text,
                    "not in the config any more, and stopped half-way"
                );
                abort.abort();
            }
        });
        self.leaving.retain_mut(LeavingWorker::is_at_work);
        self.leaving.push(LeavingWorker { name, ended });
    }
}

impl LeavingWorker {
    fn is_at_work(&mut self) -> bool {
        self.ended.try_recv() == Err(oneshot::error::TryRecvError::Empty)
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
