//! Runs the hooks of a drill as the daemon runs them, and notes when the first began and which have taken it.

use crate::config::HookConfig;
use crate::monitor::EventKind;
use crate::runtime::clock::Stopwatch;
use crate::runtime::deliver::{Processes, Run, Runner};
use crate::runtime::hook::{Alert, HookOutcome, MessageState};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What has been seen so far.
#[derive(Debug, Default)]
pub(super) struct DrillProgress {
    /// Since the readings were appended that lead to the alert.
    pub(super) appended: Option<Stopwatch>,
    /// How long after that the first hook began; zero where it began before.
    pub(super) latency: Option<Duration>,
    /// Since the first hook began.
    pub(super) begun: Option<Stopwatch>,
    /// How each hook's newest run for the alert ended.
    pub(super) outcomes: BTreeMap<String, HookOutcome>,
    /// Hooks that have taken the end of the drill.
    pub(super) ended: usize,
}

/// The runner of one drill.
#[derive(Debug, Clone, Default)]
pub(super) struct DrillObserver(Arc<Mutex<DrillProgress>>);

impl DrillObserver {
    pub(super) fn seen(&self) -> MutexGuard<'_, DrillProgress> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Runner for DrillObserver {
    fn run(&self, hook: Arc<HookConfig>, mut alert: Alert, attempt: u32) -> Run {
        // Whoever reads this line alone is to know.
        if let EventKind::Alert { text, .. } = &mut alert.event.kind {
            text.insert_str(0, "EXERCISE, nothing has happened: ");
        }
        let mut seen = self.seen();
        if seen.begun.is_none() {
            let latency = seen.appended.map(Stopwatch::elapsed);
            seen.latency = Some(latency.unwrap_or_default());
            seen.begun = Some(Stopwatch::start());
        }
        drop(seen);
        let watched = self.clone();
        Box::pin(async move {
            let (name, is_end) = (hook.name(), alert.state == MessageState::Resolved);
            let outcome = Processes.run(hook, alert, attempt).await;
            let mut seen = watched.seen();
            if is_end {
                seen.ended += usize::from(outcome == HookOutcome::Done);
            } else {
                seen.outcomes.insert(name, outcome.clone());
            }
            outcome
        })
    }
}
