//! What has happened at a benchmark of late that calls for attention, and whether more of the kind is usual there.
//!
//! A wire that sticks and slips flips its regime at each slip, and a crackmeter in the sun does so each day. Such a slope would be
//! yellow for good, and yellow would say nothing. What has happened again and again without a higher level is usual: it is
//! reported as an event, and counts for the site's own rules, but calls no level.

use crate::alert::{AlertCause, Policy};
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// So many earlier ones make one more of the kind usual, of the last so many outlooks (90 days by default); what follows another
/// within a day belongs to it. One in a month is then usual, and one in two months calls yellow each time.
const USUAL: usize = 2;
const OUTLOOKS: i32 = 3;
const APART: SignedDuration = SignedDuration::from_hours(24);

/// What has happened of late.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Occurrences {
    kinds: Vec<OfOneCause>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct OfOneCause {
    cause: AlertCause,
    /// When, the oldest first; no more than [`USUAL`].
    newest: VecDeque<Timestamp>,
    /// Until when it calls at least yellow, if it does.
    calls_until: Option<Timestamp>,
}

impl Occurrences {
    /// Something happened at `time`; where that is not usual it calls yellow for an evacuation time. After that the level falls as
    /// any other does.
    pub(super) fn note(&mut self, policy: &Policy, time: Timestamp, cause: AlertCause) {
        if !self.kinds.iter().any(|kind| kind.cause == cause) {
            self.kinds.push(OfOneCause {
                cause,
                newest: VecDeque::new(),
                calls_until: None,
            });
        }
        for kind in self.kinds.iter_mut().filter(|kind| kind.cause == cause) {
            kind.note(policy, time);
        }
    }

    /// What was noted has gone on until `time`, however long ago the reading before was: it calls yellow for longer, if it did.
    pub(super) fn goes_on(&mut self, policy: &Policy, time: Timestamp, cause: AlertCause) {
        let kinds = self.kinds.iter_mut();
        for kind in kinds.filter(|kind| kind.cause == cause && kind.calls_until.is_some()) {
            kind.call(policy, time);
        }
    }

    /// What calls at least yellow at `time`: of several the one that does so longest.
    pub(super) fn calling(&self, time: Timestamp) -> Option<AlertCause> {
        let calling = self.kinds.iter().filter(|kind| kind.calls(time));
        let longest = calling.max_by_key(|kind| kind.calls_until)?;
        Some(longest.cause)
    }

    /// Nothing calls any more.
    pub(super) fn end(&mut self) {
        for kind in &mut self.kinds {
            kind.calls_until = None;
        }
    }

    /// More came of it than yellow: what happens next is not usual.
    pub(super) fn led_to_more(&mut self) {
        for kind in &mut self.kinds {
            kind.newest.clear();
        }
    }
}

impl OfOneCause {
    fn note(&mut self, policy: &Policy, time: Timestamp) {
        if !self.is_usual(policy, time) {
            self.call(policy, time);
        } else if !self.calls(time) {
            self.calls_until = None;
        }
        let last = self.newest.back();
        if last.is_none_or(|last| is_apart(*last, time)) {
            self.newest.push_back(time);
        }
        if self.newest.len() > USUAL {
            self.newest.pop_front();
        }
    }

    fn is_usual(&self, policy: &Policy, time: Timestamp) -> bool {
        let span = policy.outlook.saturating_mul(OUTLOOKS);
        let is_counted =
            |at: &&Timestamp| is_apart(**at, time) && time.duration_since(**at) <= span;
        self.newest.iter().filter(is_counted).count() >= USUAL
    }

    fn call(&mut self, policy: &Policy, time: Timestamp) {
        self.calls_until = time.checked_add(policy.evacuation_time).ok();
    }

    fn calls(&self, time: Timestamp) -> bool {
        self.calls_until.is_some_and(|until| time < until)
    }
}

fn is_apart(earlier: Timestamp, later: Timestamp) -> bool {
    later.duration_since(earlier) >= APART
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::ToSpan;

    const CAUSE: AlertCause = AlertCause::RegimeFlip;

    fn day(day: i64) -> Timestamp {
        let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
        start + (24 * day).hours()
    }

    /// Whether a cause noted on each of these days called.
    fn calling(days: &[i64]) -> Vec<bool> {
        let (policy, mut occurrences) = (Policy::default(), Occurrences::default());
        let each = days.iter().map(|at| {
            occurrences.end();
            occurrences.note(&policy, day(*at), CAUSE);
            occurrences.calling(day(*at)).is_some()
        });
        each.collect()
    }

    #[test]
    fn what_happens_again_and_again_is_usual_until_it_has_been_quiet_for_long() {
        assert_eq!(
            calling(&[0, 5, 9, 20, 40]),
            [true, true, false, false, false]
        );
        assert_eq!(calling(&[0, 60, 120, 180]), [true; 4]);
        assert_eq!(calling(&[0, 5, 9, 200]), [true, true, false, true]);
    }

    #[test]
    fn what_led_to_a_higher_level_is_not_usual_and_other_causes_count_for_themselves() {
        let (policy, mut occurrences) = (Policy::default(), Occurrences::default());
        for at in [0, 5] {
            occurrences.note(&policy, day(at), CAUSE);
        }
        let other = AlertCause::UnexplainedResidual;
        occurrences.note(&policy, day(9), CAUSE);
        assert_eq!(occurrences.calling(day(9)), None);
        occurrences.note(&policy, day(9), other);
        assert_eq!(occurrences.calling(day(9)), Some(other));
        occurrences.end();
        occurrences.led_to_more();
        occurrences.note(&policy, day(10), CAUSE);
        assert_eq!(occurrences.calling(day(10)), Some(CAUSE));
    }

    #[test]
    fn a_call_lasts_for_an_evacuation_time_and_while_what_called_goes_on() {
        let (policy, mut occurrences) = (Policy::default(), Occurrences::default());
        let cause = AlertCause::MovesBackwards;
        occurrences.note(&policy, day(0), cause);
        let hour = |hours: i64| day(0) + hours.hours();
        assert!(occurrences.calling(hour(23)).is_some());
        assert!(occurrences.calling(hour(24)).is_none());
        for hours in 1..100 {
            occurrences.goes_on(&policy, hour(hours), cause);
        }
        assert!(occurrences.calling(hour(120)).is_some());
        // Read once a week, it goes on all the same.
        occurrences.goes_on(&policy, hour(288), cause);
        assert!(occurrences.calling(hour(288)).is_some());
        occurrences.end();
        occurrences.goes_on(&policy, hour(289), cause);
        assert!(occurrences.calling(hour(289)).is_none());
    }

    #[test]
    fn what_is_usual_calls_nothing_while_it_goes_on() {
        let (policy, mut occurrences) = (Policy::default(), Occurrences::default());
        let cause = AlertCause::MovesBackwards;
        for at in [0, 5, 9] {
            occurrences.note(&policy, day(at), cause);
        }
        occurrences.goes_on(&policy, day(10), cause);
        assert!(occurrences.calling(day(10)).is_none());
    }
}
