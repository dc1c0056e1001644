//! Sends again what is in force, to receivers that keep it in memory alone: Alertmanager forgets an alert when it is restarted.
//!
//! A repetition that is under way when its alert ends may arrive after the end, and would revive the alert there: what has ended of late is
//! sent again with its end.

use super::{Dispatcher, locked};
use crate::runtime::clock::Stopwatch;
use crate::runtime::hook::{Alert, HookOutcome, MessageState};
use std::cmp::Reverse;
use std::collections::VecDeque;
use std::time::Duration;
use tokio::task::JoinSet;

/// How often: as Prometheus itself sends its alerts to Alertmanager.
const EACH: Duration = Duration::from_secs(60);
/// Alerts that are sent again at most, the most severe of them.
const MOST: usize = 1000;
/// For so long what has ended is sent again: a repetition may take as long as a webhook's timeout.
const ENDED_OF_LATE: Duration = Duration::from_secs(180);

/// When that was done last, and what of it is still under way.
#[derive(Debug)]
pub(super) struct Repetition {
    since: Stopwatch,
    under_way: JoinSet<HookOutcome>,
    /// Ends of late, the oldest first.
    ended: VecDeque<(Stopwatch, Alert)>,
}

impl Repetition {
    pub(super) fn new() -> Self {
        Self {
            since: Stopwatch::start(),
            under_way: JoinSet::new(),
            ended: VecDeque::new(),
        }
    }

    /// Keeps the end of an alert for some time.
    pub(super) fn note(&mut self, alert: &Alert) {
        let is_noted = |(_, one): &(Stopwatch, Alert)| one.key == alert.key;
        if alert.state == MessageState::Resolved && !self.ended.iter().any(is_noted) {
            self.ended.push_back((Stopwatch::start(), alert.clone()));
            let excess = self.ended.len().saturating_sub(MOST);
            self.ended.drain(..excess);
        }
    }

    fn ended_of_late(&mut self) -> Vec<Alert> {
        let is_late = |(since, _): &(Stopwatch, Alert)| since.elapsed() < ENDED_OF_LATE;
        self.ended.retain(is_late);
        self.ended.iter().map(|(_, alert)| alert.clone()).collect()
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
    pub fn repeat<'a>(&self, in_force: impl Fn() -> Box<dyn Iterator<Item = &'a Alert> + 'a>) {
        let forgets = |way: &&super::HookQueue| way.hook.to.as_ref().is_some_and(|to| to.forgets());
        let mut repetition = locked(&self.repetition);
        if !self.hooks.iter().any(|way| forgets(&way)) || !repetition.is_due() {
            return;
        }
        let ended = repetition.ended_of_late();
        for way in self.hooks.iter().filter(forgets) {
            let name = way.hook.name();
            let delivered = locked(&self.delivered);
            let has_taken =
                |one: &&Alert| way.hook.asks_for(one) && delivered.was_notified(one, &name);
            let mut alerts: Vec<Alert> = in_force().filter(has_taken).cloned().collect();
            alerts.extend(ended.iter().filter(has_taken).cloned());
            drop(delivered);
            alerts.sort_by_key(|one| Reverse(one.level));
            alerts.truncate(MOST);
            if alerts.is_empty() {
                continue;
            }
            if let Some(run) = self.runner.repeat(&way.hook, alerts) {
                repetition.under_way.spawn(run);
            }
        }
    }
}
