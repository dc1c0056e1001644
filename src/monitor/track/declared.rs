//! What people declare, as it acts on one benchmark.

use super::unknown::Reason;
use super::{StepContext, Track};
use crate::alert::Policy;
use crate::monitor::declared::Declarations;
use crate::monitor::event::{Event, RESET_FOUND, RESET_RETURNED};
use crate::monitor::history::MeasuredAs;
use crate::reading::{Reading, Suspicion, Timestamp};

impl Track {
    /// What takes effect with the reading of `time`.
    pub(super) fn declared_with(&mut self, time: Timestamp) -> Vec<Event> {
        let before = self.silence.newest();
        let reported = self.declared.take(before, time);
        let now = self.newest.map_or(time, |newest| newest.max(time));
        reported
            .iter()
            .map(|one| one.event(now, &self.benchmark, None))
            .collect()
    }

    /// Keeps a reading that is not to count: one during maintenance, or a velocity that is a mean over a reset.
    pub(super) fn leave_out(&mut self, source: MeasuredAs, reading: &Reading) -> Vec<Event> {
        if !self.history.set_aside(source, reading) {
            return Vec::new();
        }
        if self.declared.is_maintained(reading.time) {
            self.silence.continues(reading.time);
            return Vec::new();
        }
        let now = self
            .newest
            .map_or(reading.time, |newest| newest.max(reading.time));
        let (from, to) = self.history.span(reading.time);
        let reported = self.declared.take_resets(from, to);
        let mut events: Vec<Event> = reported
            .iter()
            .map(|one| one.event(now, &self.benchmark, None))
            .collect();
        events.extend(self.reads_again(now, reading.time));
        events
    }

    /// Takes what the readings jump by at declared resets off them.
    pub(super) fn reset(&mut self, now: Timestamp) -> Vec<Event> {
        let mut events = Vec::new();
        for (time, jump) in self.history.reset(&self.declared) {
            let reported = self.declared.take_resets(time, time);
            let reported = reported
                .iter()
                .map(|one| one.event(now, &self.benchmark, Some(jump)));
            events.extend(reported);
        }
        events
    }

    /// Takes off a fall that no slope makes and that the newest readings confirm: a reset that nobody declared. Where they come
    /// back it is put on again.
    pub(super) fn find_reset(&mut self, now: Timestamp) -> Option<Event> {
        if self.accepted.contains(&Suspicion::Fall) {
            return None;
        }
        if let Some(found) = self.declared.newest_found()
            && self.history.has_come_back(found)
        {
            self.declared.forget_found();
            self.history.sort_out(&self.declared);
            let text = format!(
                "benchmark {}: its readings came back by what they had fallen at {}: an offset that has passed, no reset",
                self.benchmark, found.0
            );
            return Some(self.fault(now, RESET_RETURNED, text));
        }
        let (time, jump) = self.history.fallen_back()?;
        self.declared.find_reset(time, jump);
        self.history.reset(&self.declared);
        let text = format!(
            "benchmark {}: its readings fell by {:.3} mm at {time} and went on from there; no slope does that, so it is taken \
             for a reset of the instrument and is no motion. Declare it with [[event]] kind = \"reset\"; if the slope did fall, \
             set accept = [\"fall\"] for this benchmark",
            self.benchmark, -jump
        );
        Some(self.fault(now, RESET_FOUND, text))
    }

    /// The end of a silence, where the reading of `time` is one.
    pub(super) fn reads_again(&mut self, now: Timestamp, time: Timestamp) -> Option<Event> {
        let maintained = (self.silence.newest())
            .is_some_and(|newest| self.declared.is_maintained_between(newest, time));
        let since = if maintained {
            self.silence.broken_after_maintenance_by(time)
        } else {
            self.silence.broken_by(time)
        }?;
        let text = format!("benchmark {} reads again", self.benchmark);
        self.ends_unknown((now, since), Reason::NoData, text)
    }

    /// Goes by other declarations from here on, and looks again at the readings that it has where they concern some.
    pub(in crate::monitor) fn redeclare(
        &mut self,
        policy: &Policy,
        declared: Declarations,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        if self.declared.replace(declared).is_none() {
            return Vec::new();
        }
        let is_sorted_out = self.history.sort_out(&self.declared);
        let Some(time) = self.newest else {
            return Vec::new();
        };
        let mut events = self.reset(time);
        if !is_sorted_out && events.is_empty() || self.unknown.has(Reason::Stuck) {
            return events;
        }
        if let Some(forecast) = self.forecast(policy.critical_velocity_mm_per_day, context) {
            events.extend(self.refit(policy, time, &forecast));
            self.decide(policy, time, Some(forecast), &mut events);
        }
        events
    }
}
