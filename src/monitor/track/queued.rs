//! Readings of a queue: the newest is judged when it ends, and one in an evacuation time at least.

use super::unknown::Reason;
use super::{PastReview, Prepared, StepContext, Track};
use crate::alert::Policy;
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

    /// Whether a reading of a queue is judged later: not where the first that was not lies an evacuation time back.
    pub(super) fn waits(&mut self, policy: &Policy, time: Timestamp) -> bool {
        self.queued_since.get_or_insert(time);
        !self.is_long_queued(policy, time)
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
