//! What the monitor does with the answer of a search, and how it hands out what is to be searched for.

use super::Monitor;
use super::event::Event;
use super::search::{SearchFinding, SearchJob};
use super::track::{Phase, StepContext, Track};
use crate::alert::Policy;
use crate::reading::{BenchmarkId, Timestamp};

impl Monitor {
    pub(super) fn found(&mut self, now: Timestamp, finding: &SearchFinding) -> Vec<Event> {
        let Some((track, policy, context)) = self.track_at(&finding.benchmark, now) else {
            return Vec::new();
        };
        let critical = policy.critical_velocity_mm_per_day;
        let events = track.found(critical, now, finding, &context);
        self.benchmarks.note_changed(&finding.benchmark);
        events
    }

    /// How the monitor stands at this step of a benchmark.
    pub(super) fn phase(&self, benchmark: &BenchmarkId, now: Timestamp) -> Phase {
        Phase {
            explain: self.settings.explain,
            now,
            in_batches: self.batches.are_in_use(),
            is_past: self.past.is_open_of(benchmark),
            is_queue: self.batches.is_queue(),
            holds_scale: self.settings.holds_scale,
        }
    }

    /// A benchmark that has given readings, its policy, and what lies beside its readings.
    pub(super) fn track_at(
        &mut self,
        benchmark: &BenchmarkId,
        now: Timestamp,
    ) -> Option<(&mut Track, &Policy, StepContext<'_>)> {
        let context = StepContext {
            phase: self.phase(benchmark, now),
            covariates: &self.covariates,
        };
        let policy = self.settings.policy(benchmark);
        Some((self.benchmarks.get_mut(benchmark)?, policy, context))
    }

    /// The searches asked for since the last call, one a benchmark at most; each is to be answered by an
    /// [`Input::Found`](super::Input::Found), and the benchmark asks for no other one until then.
    pub fn searches(&mut self) -> Vec<SearchJob> {
        std::mem::take(&mut self.searches)
    }
}
