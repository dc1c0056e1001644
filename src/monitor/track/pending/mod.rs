//! What is still to be done at one benchmark: readings that have not been judged, those to look back on, and the past.

mod lookback;

use crate::alert::Policy;
use crate::monitor::event::Event;
use crate::reading::Timestamp;
use serde::{Deserialize, Serialize};

pub(super) use lookback::Lookback;

/// What is still to be done.
#[derive(Debug, Default, Serialize)]
pub(super) struct Pending {
    /// What came late and is to be looked back on with the next newest reading.
    lookback: Option<Lookback>,
    /// Something came late, or was corrected, and has not been judged.
    #[serde(rename = "owes")]
    has_unjudged_late: bool,
    /// The first reading of a queue that has not been judged, nor has one after it.
    queued_since: Option<Timestamp>,
    /// Whether its past has been judged.
    #[serde(rename = "record")]
    past: PastReview,
}

/// Whether the readings from before a first start have been judged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum PastReview {
    #[default]
    Known,
    Owed,
}

impl Pending {
    pub(super) fn from_saved(
        lookback: Option<Lookback>,
        has_unjudged_late: bool,
        queued_since: Option<Timestamp>,
        past: PastReview,
    ) -> Self {
        Self {
            lookback,
            has_unjudged_late,
            queued_since,
            past,
        }
    }

    /// Something came late that is judged when all that came with it has been taken.
    pub(super) fn note_unjudged_late(&mut self) {
        self.has_unjudged_late = true;
    }

    /// Whether something came late that has not been judged.
    pub(super) fn has_unjudged_late(&self) -> bool {
        self.has_unjudged_late
    }

    /// A reading of `time` is judged later, with those of a queue.
    pub(super) fn queue(&mut self, time: Timestamp) {
        self.queued_since.get_or_insert(time);
    }

    /// As if the reading of `time` were the first that has not been judged: those before it could call nothing.
    pub(super) fn queue_anew(&mut self, time: Timestamp) {
        self.queued_since = Some(time);
    }

    /// Whether a reading of a queue is still to be judged.
    pub(super) fn is_queued(&self) -> bool {
        self.queued_since.is_some()
    }

    /// Whether the first reading that was not judged lies an evacuation time before `time`.
    pub(super) fn is_long_queued(&self, policy: &Policy, time: Timestamp) -> bool {
        self.queued_since
            .is_some_and(|since| time.duration_since(since) >= policy.evacuation_time)
    }

    /// Whether there is a reading that has not been judged.
    pub(super) fn has_unjudged(&self) -> bool {
        self.has_unjudged_late || self.is_queued()
    }

    /// All readings have been judged.
    pub(super) fn mark_judged(&mut self) {
        (self.has_unjudged_late, self.queued_since) = (false, None);
    }

    /// The readings from before a first start are to be judged.
    pub(super) fn begin_past(&mut self) {
        self.past = PastReview::Owed;
    }

    /// They have been judged.
    pub(super) fn end_past(&mut self) {
        self.past = PastReview::Known;
    }

    /// Takes out what only who has judged the past can say, until that has been done.
    pub(super) fn hold_back(&self, events: &mut Vec<Event>) {
        if self.past == PastReview::Owed {
            events.retain(|event| !event.kind.is_of_the_record());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::at;

    #[test]
    fn a_queue_is_counted_from_its_first_reading_until_all_are_judged() {
        let policy = Policy {
            evacuation_time: jiff::SignedDuration::from_hours(3),
            ..Policy::default()
        };
        let mut pending = Pending::default();
        assert!(!pending.has_unjudged() && !pending.is_long_queued(&policy, at(9)));
        pending.queue(at(1));
        pending.queue(at(2));
        assert!(!pending.is_long_queued(&policy, at(3)) && pending.is_long_queued(&policy, at(4)));
        pending.queue_anew(at(2));
        assert!(!pending.is_long_queued(&policy, at(4)) && pending.has_unjudged());
        pending.mark_judged();
        assert!(!pending.has_unjudged());
        pending.note_unjudged_late();
        assert!(pending.has_unjudged() && !pending.is_queued());
    }
}
