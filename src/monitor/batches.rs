//! Readings that are judged together: what of a batch came late, and, where they come faster than they can be judged, for each
//! benchmark the newest of those that have come; each is taken as it comes, and thresholds act at each.

use super::Monitor;
use super::event::{Event, EventKind};
use super::track::{StepContext, Track};
use crate::alert::Policy;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Refits that one [`super::Notice::BatchEnd`] makes at most of what queued.
const MOST_REFITS: usize = 16;

/// How a benchmark of a queue is judged.
type JudgeTrack = fn(&mut Track, &Policy, &StepContext<'_>) -> Vec<Event>;

/// What waits for the end of a batch, or for time to look back.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Batches {
    /// Whether [`super::Notice::BatchEnd`] says when what came late is judged.
    #[serde(default, rename = "settles")]
    is_in_use: bool,
    /// Benchmarks with late readings that are to be looked back on.
    #[serde(default)]
    late: BTreeSet<BenchmarkId>,
    #[serde(default)]
    queue: Queue,
}

/// The queue, as far as it has been taken.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Queue {
    is_open: bool,
    /// Benchmarks whose newest reading is still to be judged.
    waiting: BTreeSet<BenchmarkId>,
}

impl Batches {
    /// From here on what comes late is judged at the end of its batch.
    pub(super) fn begin(&mut self) {
        self.is_in_use = true;
    }

    pub(super) fn are_in_use(&self) -> bool {
        self.is_in_use
    }

    /// From here on readings queue.
    pub(super) fn open_queue(&mut self) {
        self.queue.is_open = true;
    }

    pub(super) fn is_queue(&self) -> bool {
        self.queue.is_open
    }

    /// A reading of this benchmark has been taken.
    pub(super) fn note(&mut self, benchmark: &BenchmarkId, track: &Track) {
        if self.is_in_use && track.has_look_back() {
            self.late.insert(benchmark.clone());
        }
        if self.queue.is_open && track.is_queued() {
            self.queue.waiting.insert(benchmark.clone());
        }
    }

    /// The benchmarks that are judged next.
    pub(super) fn next(&self) -> impl Iterator<Item = &BenchmarkId> {
        self.queue.waiting.iter().take(MOST_REFITS)
    }

    pub(super) fn forget(&mut self, benchmark: &BenchmarkId) {
        self.late.remove(benchmark);
        self.queue.waiting.remove(benchmark);
    }
}

/// How many of these are refits.
pub(super) fn count_refits(events: &[Event]) -> usize {
    let is_refit = |event: &&Event| matches!(event.kind, EventKind::Refit { .. });
    events.iter().filter(is_refit).count()
}

impl Monitor {
    /// Whether readings are judged only at [`super::Notice::BatchEnd`].
    pub fn queues(&self) -> bool {
        self.batches.is_queue()
    }

    /// Judges a benchmark by `how`, and has what explains it searched for where that is due. None without the benchmark.
    pub(super) fn judged(
        &mut self,
        id: &BenchmarkId,
        now: Timestamp,
        how: impl FnOnce(&mut Track, &Policy, &StepContext<'_>) -> Vec<Event>,
    ) -> Vec<Event> {
        let Some((track, policy, context)) = self.track_at(id, now) else {
            return Vec::new();
        };
        let events = how(track, policy, &context);
        let search = track.search(policy.critical_velocity_mm_per_day, &context);
        self.searches.extend(search);
        self.benchmarks.note_changed(id);
        events
    }

    /// Judges the newest reading of the next benchmarks of the queue; when it was the last one, readings are judged as
    /// they come again.
    fn judge_queued(&mut self, now: Timestamp, how: JudgeTrack) -> Vec<Event> {
        let (mut events, mut refits) = (Vec::new(), 0);
        while refits < MOST_REFITS
            && let Some(id) = self.batches.queue.waiting.pop_first()
        {
            let judged = self.judged(&id, now, how);
            refits += count_refits(&judged);
            events.extend(judged);
        }
        let queue = &mut self.batches.queue;
        queue.is_open &= !queue.waiting.is_empty();
        events
    }

    /// Everything that came together has been taken: judges what of it came late, and the next of what queued.
    pub(super) fn end_batch(&mut self, now: Timestamp) -> Vec<Event> {
        let mut events = Vec::new();
        if self.past.is_open() {
            return events;
        }
        for id in self.batches.late.clone() {
            if let Some((track, policy, context)) = self.track_at(&id, now) {
                events.extend(track.judge_batch(policy, &context));
                self.benchmarks.note_changed(&id);
            }
        }
        events.extend(self.judge_queued(now, Track::judge_batch));
        events
    }

    /// As [`Monitor::end_batch`] while more of what came together is to be read: nothing is judged of which a part may be corrected.
    pub(super) fn go_on_with_batch(&mut self, now: Timestamp) -> Vec<Event> {
        if self.past.is_open() {
            return Vec::new();
        }
        self.judge_queued(now, Track::judge_within_batch)
    }

    /// Looks into whether late readings of this benchmark would have called another level.
    pub(super) fn look_back(&mut self, now: Timestamp, benchmark: &BenchmarkId) -> Vec<Event> {
        self.batches.late.remove(benchmark);
        let policy = self.settings.policy(benchmark);
        let Some(track) = self.benchmarks.get_mut(benchmark) else {
            return Vec::new();
        };
        let events = track.look_back(policy, now).into_iter().collect();
        self.benchmarks.note_changed(benchmark);
        events
    }

    /// A benchmark whose late readings are to be looked back on: [`super::Notice::LookBack`] does it.
    pub fn late(&self) -> Option<&BenchmarkId> {
        self.batches.late.first()
    }

    /// Whether what comes late is judged only at [`super::Notice::BatchEnd`].
    pub fn takes_batches(&self) -> bool {
        self.batches.are_in_use()
    }
}
