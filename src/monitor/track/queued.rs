//! Readings of a queue: the newest is judged when it ends, and one in an evacuation time at least where orange is possible.

use super::unknown::Reason;
use super::{PastReview, Prepared, StepContext, Track, days};
use crate::alert::{Level, Policy, to_the_next_reading};
use crate::fit::Observations;
use crate::forecast::Indicators;
use crate::monitor::event::Event;
use crate::reading::Timestamp;

impl Track {
    /// Everything that came together has been taken: judges what of it came late, or queued.
    pub(in crate::monitor) fn judge_batch(
        &mut self,
        policy: &Policy,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let is_owed = self.owes || self.is_queued();
        let Some(time) = self.newest.filter(|_| is_owed) else {
            return Vec::new();
        };
        if self.unknown.has(Reason::Stuck) {
            (self.owes, self.queued_since) = (false, None);
            return Vec::new();
        }
        let mut events = self.judge(policy, time, context);
        self.prepared = Prepared::default();
        if self.record == PastReview::Owed {
            events.retain(|event| !event.kind.is_of_the_record());
        }
        events
    }

    /// Whether a reading of a queue is judged later: not where the first that was not lies an evacuation time back, unless
    /// what moved since then can call nothing that people act on.
    pub(super) fn waits(&mut self, policy: &Policy, time: Timestamp) -> bool {
        self.queued_since.get_or_insert(time);
        if !self.is_long_queued(policy, time) {
            return true;
        }
        let is_quiet = self.is_quiet(policy, &self.history.observations);
        if is_quiet {
            self.queued_since = Some(time);
        }
        is_quiet
    }

    /// Whether no level is in force and a forecast after `observations` could call neither orange nor red, whatever it
    /// expects.
    pub(super) fn is_quiet(&self, policy: &Policy, observations: &Observations) -> bool {
        if self.latch.level() > Level::Green || self.adopted.is_some() || !policy.rules.is_empty() {
            return false;
        }
        Indicators::of(observations).is_some_and(|shown| {
            let red = to_the_next_reading(policy.red_within(), shown.interval_days());
            !shown.may_reach(days(red), policy.red_chance)
                && !shown.may_reach(days(policy.outlook), policy.orange_chance)
        })
    }

    /// Whether the first reading that was not judged lies an evacuation time before `time`.
    pub(super) fn is_long_queued(&self, policy: &Policy, time: Timestamp) -> bool {
        self.queued_since
            .is_some_and(|since| time.duration_since(since) >= policy.evacuation_time)
    }

    /// Whether a reading of a queue is still to be judged.
    pub(in crate::monitor) fn is_queued(&self) -> bool {
        self.queued_since.is_some()
    }
}
