//! Whether a benchmark's readings can be what a slope does: a sensor that stands still, or that jumps to and fro, says
//! nothing, and least of all that the slope has slowed down.

use super::unknown::Reason;
use super::{Track, days};
use crate::alert::Level;
use crate::monitor::event::Event;
use crate::reading::{Suspicion, Timestamp};
use jiff::SignedDuration;

/// Readings of a second quantity in a row that are reported, where the first quantity has hardly been read.
const FEW_OTHERS: u32 = 3;
/// And where it has.
const MANY_OTHERS: u32 = 24;
/// A benchmark with fewer readings has hardly been read.
const HARDLY_READ: usize = 3;
/// A reading leaps ahead in time when it lies further than this after the one before,
const LEAST_LEAP: SignedDuration = SignedDuration::from_hours(48);
/// and than so many times the usual spacing.
const LEAP_SPACINGS: i32 = 20;

impl Track {
    /// Whether a reading of `time` lies so far after the newest one that the logger's clock may have jumped. Without a
    /// usual spacing nobody knows.
    pub(in crate::monitor) fn leaps(&self, time: Timestamp) -> bool {
        let (Some(newest), Some(usual)) = (self.newest, self.silence.usual()) else {
            return false;
        };
        let least = usual
            .checked_mul(LEAP_SPACINGS)
            .unwrap_or(SignedDuration::MAX)
            .max(LEAST_LEAP);
        let continues = self
            .ahead
            .as_ref()
            .is_some_and(|ahead| ahead.precedes(time, least));
        !continues && time.duration_since(newest) > least
    }

    /// After the newest reading, of `time`: whether the sensor is stuck, or its readings are spoilt.
    pub(super) fn judge_sensor(&mut self, time: Timestamp) -> Vec<Event> {
        let mut events = Vec::new();
        if let Some((count, since)) = self.history.stuck() {
            let what = "are the same, as this sensor never gave them before: it is stuck";
            events.extend(self.sticks(time, count, since, what));
        } else if self.latch.level() >= Level::Orange
            && let Some((count, since, around)) = self.history.stands_at_the_end()
        {
            self.history.range_end = Some(around);
            let what = "only jitter where a fast motion ended at once: the sensor is stuck, or at the end of its range";
            events.extend(self.sticks(time, count, since, what));
        }
        let was_spoilt = self.spoilt_by.is_some();
        self.spoilt_by = self.history.spoilt(self.spoilt_by);
        let is_spoilt = self.spoilt_by.is_some();
        if is_spoilt && !was_spoilt {
            let text = format!(
                "benchmark {}: many of the latest readings jump to and fro: they cannot be true",
                self.benchmark
            );
            events.push(self.fault(time, "spoilt-readings", text.clone()));
            events.extend(self.begins_unknown((time, time), Reason::Spoilt, text));
        } else if was_spoilt && !is_spoilt {
            let text = format!("benchmark {} reads as a slope does again", self.benchmark);
            events.extend(self.ends_unknown((time, time), Reason::Spoilt, text));
        }
        events
    }

    /// So many readings since a time say nothing, as it turns out at `time`.
    fn sticks(
        &mut self,
        time: Timestamp,
        count: usize,
        since: Timestamp,
        what: &str,
    ) -> Vec<Event> {
        self.history.forget_repeats(count);
        let text = format!(
            "benchmark {}: {count} readings in a row {what}",
            self.benchmark
        );
        let mut events = vec![self.fault(time, "stuck-sensor", text.clone())];
        events.extend(self.begins_unknown((time, since), Reason::Stuck, text));
        events
    }

    /// The stuck sensor gives another value, at `time`.
    pub(super) fn unstick(&mut self, time: Timestamp) -> Option<Event> {
        if !self.unknown.has(Reason::Stuck) {
            return None;
        }
        self.history.range_end = None;
        let text = format!("benchmark {}: its readings change again", self.benchmark);
        self.ends_unknown((time, time), Reason::Stuck, text)
    }

    /// One more reading of a second quantity.
    pub(super) fn count_other(&mut self, time: Timestamp) -> Option<Event> {
        self.others = self.others.saturating_add(1);
        let read = self.history.observations.values.len();
        let most = if read < HARDLY_READ {
            FEW_OTHERS
        } else {
            MANY_OTHERS
        };
        if self.others != most {
            return None;
        }
        let text = format!(
            "benchmark {}: gives no {} any more, which is what is monitored, but another quantity",
            self.benchmark,
            self.history.observations.quantity.name()
        );
        self.begins_unknown((time, time), Reason::SecondQuantity, text)
    }

    /// A reading of the quantity that is monitored.
    pub(super) fn count_own(&mut self, time: Timestamp) -> Option<Event> {
        self.others = 0;
        if !self.unknown.has(Reason::SecondQuantity) {
            return None;
        }
        let text = format!("benchmark {} gives what is monitored again", self.benchmark);
        self.ends_unknown((time, time), Reason::SecondQuantity, text)
    }

    /// Readings at the beginning of the record that a logger gave before its clock was set are left out.
    pub(super) fn leave_out_clockless(&mut self, now: Timestamp) -> Option<Event> {
        let (from, to, count) = self.history.forget_clockless()?;
        self.silence.forget_gap();
        let text = format!(
            "benchmark {}: {count} readings of {from} to {to}, as by a logger whose clock is not set, lie {:.0} days \
             before all others: left out",
            self.benchmark,
            days(self.history.first()?.duration_since(to)),
        );
        Some(self.fault(now, "clock-not-set", text))
    }

    /// Whether the level in force may fall: not on readings that say nothing.
    pub(super) fn may_fall(&self) -> bool {
        let says_nothing = [
            Reason::Spoilt,
            Reason::Suspect(Suspicion::Mark),
            Reason::Suspect(Suspicion::Fall),
        ];
        let is_sound = |reason: Reason| !self.unknown.has(reason);
        says_nothing.into_iter().all(is_sound) || self.latch.level() == Level::Green
    }
}
