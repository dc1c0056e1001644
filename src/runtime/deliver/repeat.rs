//! Sends again what is in force, to receivers that keep it in memory alone: Alertmanager forgets an alert when it is restarted.

use super::{Dispatcher, locked};
use crate::runtime::clock::Stopwatch;
use crate::runtime::hook::Alert;
use crate::runtime::ways_out::WAYS_OUT;
use std::cmp::Reverse;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;

/// How often: as Prometheus itself sends its alerts to Alertmanager.
const EACH: Duration = Duration::from_secs(60);
/// Alerts that are sent again at most, the most severe of them.
const MOST: usize = 1000;

/// When that was done last, and what of it is still under way.
#[derive(Debug)]
pub(super) struct Repetition {
    since: Stopwatch,
    under_way: JoinSet<()>,
}

impl Repetition {
    pub(super) fn new() -> Self {
        Self {
            since: Stopwatch::start(),
            under_way: JoinSet::new(),
        }
    }

    fn is_due(&mut self) -> bool {
        while self.under_way.try_join_next().is_some() {}
        let is_due = self.since.elapsed() >= EACH && self.under_way.is_empty();
        if is_due {
            self.since = Stopwatch::start();
        }
        is_due
    }
}

impl Dispatcher {
    /// Once a minute: has what is `in_force` sent again to those that forget it and have taken it before.
    pub fn repeat<'a>(&mut self, in_force: impl Fn() -> Box<dyn Iterator<Item = &'a Alert> + 'a>) {
        let forgets = |way: &&super::HookQueue| way.hook.to.as_ref().is_some_and(|to| to.forgets());
        if !self.hooks.iter().any(|way| forgets(&way)) || !self.repetition.is_due() {
            return;
        }
        for way in self.hooks.iter().filter(forgets) {
            let Some(repeat) = (WAYS_OUT.iter())
                .find(|one| one.table == way.hook.table())
                .and_then(|one| one.repeat)
            else {
                continue;
            };
            let name = way.hook.name();
            let delivered = locked(&self.delivered);
            let mut alerts: Vec<Alert> = in_force()
                .filter(|one| way.hook.asks_for(one) && delivered.was_notified(one, &name))
                .cloned()
                .collect();
            drop(delivered);
            alerts.sort_by_key(|one| Reverse(one.level));
            alerts.truncate(MOST);
            if !alerts.is_empty() {
                self.repetition
                    .under_way
                    .spawn(repeat(Arc::clone(&way.hook), alerts));
            }
        }
    }
}
