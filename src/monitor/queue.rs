//! Readings that come faster than they can be judged: each is taken as it comes, thresholds act at each, and a benchmark is
//! judged for the newest of those that have come together.

use super::Monitor;
use super::event::{Event, EventKind};
use super::track::Track;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Refits that one [`super::Notice::BatchEnd`] makes at most of what queued.
const MOST_REFITS: usize = 16;

/// The queue, as far as it has been taken.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Queue {
    is_open: bool,
    /// Benchmarks whose newest reading is still to be judged.
    waiting: BTreeSet<BenchmarkId>,
}

impl Queue {
    pub(super) fn is_open(&self) -> bool {
        self.is_open
    }

    pub(super) fn open(&mut self) {
        self.is_open = true;
    }

    /// A reading of this benchmark has been taken.
    pub(super) fn note(&mut self, benchmark: &BenchmarkId, track: &Track) {
        if self.is_open && track.is_queued() {
            self.waiting.insert(benchmark.clone());
        }
    }

    /// The benchmarks that are judged next.
    pub(super) fn next(&self) -> impl Iterator<Item = &BenchmarkId> {
        self.waiting.iter().take(MOST_REFITS)
    }

    pub(super) fn forget(&mut self, benchmark: &BenchmarkId) {
        self.waiting.remove(benchmark);
    }
}

impl Monitor {
    /// Whether readings are judged only at [`super::Notice::BatchEnd`].
    pub fn queues(&self) -> bool {
        self.queue.is_open
    }

    /// Judges the newest reading of the next benchmarks of the queue; when it was the last one, readings are judged as
    /// they come again.
    pub(super) fn judge_queued(&mut self, now: Timestamp) -> Vec<Event> {
        let (mut events, mut refits) = (Vec::new(), 0);
        while refits < MOST_REFITS
            && let Some(id) = self.queue.waiting.pop_first()
        {
            let Some((track, policy, context)) = self.track_at(&id, now) else {
                continue;
            };
            let judged = track.judge_batch(policy, &context);
            let search = track.search(policy.critical_velocity_mm_per_day, &context);
            let is_refit = |event: &&Event| matches!(event.kind, EventKind::Refit { .. });
            refits += judged.iter().filter(is_refit).count();
            events.extend(judged);
            self.searches.extend(search);
            self.note_changed(&id);
        }
        if self.queue.waiting.is_empty() {
            self.queue.is_open = false;
        }
        events
    }
}
