//! Readings that have been read and wait for earlier ones of their source: a benchmark that gives some is not silent.

use super::Site;
use crate::monitor::{Event, Input, Notice};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::tail::WaitingReading;
use std::collections::{BTreeMap, BTreeSet};

/// When those of each benchmark were measured.
#[derive(Debug, Default)]
pub(super) struct WaitingReadings(BTreeMap<BenchmarkId, BTreeSet<Timestamp>>);

impl WaitingReadings {
    /// One of `time` waits no more, nor do earlier ones.
    pub(super) fn remove_up_to(&mut self, benchmark: &BenchmarkId, time: Timestamp) {
        if let Some(times) = self.0.get_mut(benchmark) {
            times.retain(|one| *one > time);
            if times.is_empty() {
                self.0.remove(benchmark);
            }
        }
    }

    /// The newest of a benchmark by `until`.
    fn newest(&self, benchmark: &BenchmarkId, until: Timestamp) -> Option<Timestamp> {
        let times = self.0.get(benchmark)?;
        times.range(..=until).next_back().copied()
    }

    /// What is read again from here on, or belongs to no source any more, does not wait.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl Site {
    /// These have been read, and wait for earlier ones.
    pub fn note_waiting(&mut self, readings: Vec<WaitingReading>) {
        for WaitingReading {
            benchmark,
            quantity,
            time,
        } in readings
        {
            if self.monitor.watches(&benchmark, quantity) {
                let times = self.waiting.0.entry(benchmark).or_default();
                times.insert(time);
            }
        }
    }

    /// Counts from the newest reading that waits, of the benchmarks that would be silent by `until`, or red without a reading; `now` is
    /// data time.
    pub(super) fn count_from_waiting(&mut self, now: Timestamp, until: Timestamp) -> Vec<Event> {
        if self.waiting.0.is_empty() {
            return Vec::new();
        }
        let due = self.monitor.due_by(until);
        self.count_each_from_waiting(due, now, until)
    }

    /// Ends the silences of the benchmarks of which readings wait.
    pub(super) fn end_silences(&mut self, until: Timestamp) -> Vec<Event> {
        let waiting = self.waiting.0.keys();
        let silent: BTreeSet<BenchmarkId> = waiting
            .filter(|id| self.monitor.is_silent(id))
            .cloned()
            .collect();
        self.count_each_from_waiting(silent, self.data_now(), until)
    }

    fn count_each_from_waiting(
        &mut self,
        benchmarks: BTreeSet<BenchmarkId>,
        now: Timestamp,
        until: Timestamp,
    ) -> Vec<Event> {
        let mut events = Vec::new();
        for benchmark in benchmarks {
            let counted = self.monitor.counted_from(&benchmark);
            let newest = self.waiting.newest(&benchmark, until);
            if let Some(time) = newest.filter(|time| Some(*time) > counted) {
                // Nothing ends before the reading that ends it.
                let now = if self.monitor.is_silent(&benchmark) {
                    now.max(time)
                } else {
                    now
                };
                let waits = Notice::Waits {
                    benchmark,
                    time,
                    until,
                };
                events.extend(self.step(now, &Input::Notice(waits)));
            }
        }
        events
    }
}
