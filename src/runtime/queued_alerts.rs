//! The alerts that a hook's worker has: neither taken by the hook nor given up.

use super::hook::{Alert, MessageState, state_name};
use crate::alert::Level;
use crate::reading::BenchmarkId;
use std::collections::BTreeMap;

/// What distinguishes an alert from every other.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct QueuedKey {
    key: String,
    level: Level,
    state: &'static str,
}

#[derive(Debug)]
struct Entry {
    benchmark: Option<BenchmarkId>,
    state: MessageState,
    /// The alert itself where it reports many benchmarks at once: no other one reports what it reports.
    of_many: Option<Box<Alert>>,
    /// A hook's run for it has begun.
    is_tried: bool,
    /// Superseded, or resolved: not worth another attempt.
    is_over: bool,
    /// Silenced or shelved: no attempt is made for now.
    is_muted: bool,
}

/// The alerts of one worker, the one that it tries included.
#[derive(Debug, Default)]
pub(super) struct QueuedAlerts(BTreeMap<QueuedKey, Entry>);

impl QueuedAlerts {
    /// Queues `alert`, for no attempt while `is_muted`; `false` when it is there already.
    pub(super) fn take(&mut self, alert: &Alert, is_muted: bool) -> bool {
        let token = token(alert);
        if self.0.contains_key(&token) {
            return false;
        }
        let entry = Entry {
            benchmark: alert.event.benchmark.clone(),
            state: alert.state,
            of_many: alert.is_flood().then(|| Box::new(alert.clone())),
            is_tried: false,
            is_over: false,
            is_muted,
        };
        self.0.insert(token, entry);
        true
    }

    /// Whether a run for it has begun.
    pub(super) fn was_tried(&self, alert: &Alert) -> bool {
        self.0
            .get(&token(alert))
            .is_some_and(|entry| entry.is_tried)
    }

    /// Notes of each alert whether it is silenced or shelved, by its place and level.
    pub(super) fn mute(&mut self, is_muted: &dyn Fn(Option<&BenchmarkId>, Level) -> bool) {
        for (QueuedKey { level, .. }, entry) in &mut self.0 {
            entry.is_muted = is_muted(entry.benchmark.as_ref(), *level);
        }
    }

    /// Whether no attempt is made for it for now.
    pub(super) fn is_muted(&self, alert: &Alert) -> bool {
        let entry = self.0.get(&token(alert));
        entry.is_some_and(|entry| entry.is_muted)
    }

    /// The alerts that report many benchmarks at once.
    pub(super) fn of_many(&self) -> Vec<Alert> {
        let of_many = self.0.values().filter_map(|entry| entry.of_many.as_deref());
        of_many.cloned().collect()
    }

    /// A run for it begins.
    pub(super) fn note_tried(&mut self, alert: &Alert) {
        if let Some(entry) = self.0.get_mut(&token(alert)) {
            entry.is_tried = true;
        }
    }

    /// Whether `alert` is the end of an `unknown` that has not been reported: neither of them is then.
    pub(super) fn cancels(&mut self, alert: &Alert) -> bool {
        if alert.level != Level::Unknown
            || alert.state != MessageState::Resolved
            || alert.is_flood()
        {
            return false;
        }
        let firing = QueuedKey {
            state: state_name(MessageState::Firing),
            ..token(alert)
        };
        match self.0.get_mut(&firing) {
            Some(entry) if !entry.is_tried => {
                entry.is_over = true;
                true
            }
            Some(_) | None => false,
        }
    }

    pub(super) fn release(&mut self, alert: &Alert) {
        self.0.remove(&token(alert));
    }

    /// It is not worth another attempt.
    pub(super) fn end(&mut self, alert: &Alert) {
        if let Some(entry) = self.0.get_mut(&token(alert)) {
            entry.is_over = true;
        }
    }

    pub(super) fn is_over(&self, alert: &Alert) -> bool {
        self.0.get(&token(alert)).is_some_and(|entry| entry.is_over)
    }

    /// `alert` has come: what it supersedes or resolves at its benchmark is over. A level ends
    /// itself and the lower ones; `unknown` stands for itself, and so does a correction, which is of the past. `keeps_ends`: the ends of
    /// other alerts are sent all the same.
    pub(super) fn supersede(&mut self, alert: &Alert, keeps_ends: bool) {
        let own = token(alert);
        if alert.is_flood() || alert.is_correction() {
            return;
        }
        for (token, entry) in self
            .0
            .iter_mut()
            .filter(|(_, entry)| entry.of_many.is_none() && entry.state != MessageState::Correction)
        {
            let same_place = entry.benchmark == alert.event.benchmark
                && (token.level == Level::Unknown) == (alert.level == Level::Unknown);
            // An end does not make an earlier end untrue; a new beginning does.
            let is_touched = entry.state == MessageState::Firing
                || alert.state == MessageState::Firing && (!keeps_ends || token.key == own.key);
            if same_place && is_touched && token.level <= alert.level && *token != own {
                entry.is_over = true;
            }
        }
    }
}

fn token(alert: &Alert) -> QueuedKey {
    QueuedKey {
        key: alert.key.clone(),
        level: alert.level,
        state: state_name(alert.state),
    }
}
