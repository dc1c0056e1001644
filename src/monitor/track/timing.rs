//! What the time that it is has to do with a benchmark: readings ahead of it, a backlog, silence.

use super::Track;
use crate::alert::{Level, Policy};
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::reading::{Quantity, Reading, Timestamp};

impl Track {
    /// Keeps a reading of a time that has not come yet, as far as anybody knows.
    pub(in crate::monitor) fn put_aside(
        &mut self,
        now: Timestamp,
        source: MeasuredAs,
        reading: &Reading,
    ) -> Vec<Event> {
        vec![self.record.put_aside(now, source, reading)]
    }

    /// When the only reading was measured, where one of `time`, which comes after it, lies far before it and nothing rests on it.
    pub(in crate::monitor) fn first_ahead_of(&self, time: Timestamp) -> Option<Timestamp> {
        let is_green = self.level() == Level::Green;
        self.record.first_ahead_of(time).filter(|_| is_green)
    }

    /// The only reading waits from now on: the next one is of `time`, far before it.
    pub(in crate::monitor) fn put_first_aside(
        &mut self,
        now: Timestamp,
        time: Timestamp,
    ) -> Option<Event> {
        self.record.put_first_aside(now, time)
    }

    /// Red at `now` where, by `until`, a collapse that was forecast calls it without a reading.
    pub(in crate::monitor) fn judge_overdue(
        &mut self,
        policy: &Policy,
        (now, until): (Timestamp, Timestamp),
    ) -> Option<Event> {
        (self.alarm).judge_overdue(&self.record, policy, (now, until))
    }

    /// Unknown at `now` where, by `until`, no reading has come for too long; `fault` is what the sensor gives instead.
    pub(in crate::monitor) fn pass(
        &mut self,
        (now, until): (Timestamp, Timestamp),
        fault: Option<&str>,
    ) -> Vec<Event> {
        if !self.is_silent_by(until) {
            return Vec::new();
        }
        let level = self.level();
        (self.quality).fall_silent(&mut self.record, now, fault, level)
    }

    /// Whether it falls silent by `until`, if no reading comes.
    pub(in crate::monitor) fn is_silent_by(&self, until: Timestamp) -> bool {
        self.record.silent_at().is_some_and(|due| due <= until)
    }

    /// A reading of `time` has been read by `until`, and waits for earlier ones.
    pub(in crate::monitor) fn note_waiting(
        &mut self,
        now: Timestamp,
        time: Timestamp,
        until: Timestamp,
    ) -> Vec<Event> {
        (self.quality).note_waiting(&mut self.record, now, (time, until))
    }

    /// What of it is watched.
    pub(in crate::monitor) fn quantity(&self) -> Quantity {
        self.record.source().unit.quantity()
    }

    /// When the newest reading was from which its silence counts.
    pub(in crate::monitor) fn counted_from(&self) -> Option<Timestamp> {
        self.record.counted_from()
    }

    /// The newest reading, of `time`, came while the clock said `clock`.
    pub(in crate::monitor) fn suspect_ahead(
        &mut self,
        now: Timestamp,
        time: Timestamp,
        clock: Timestamp,
    ) -> Vec<Event> {
        (self.quality).suspect_ahead(&self.record, now, time, clock)
    }

    /// The clock of its logger has been set back: what is of after `time` is left out.
    pub(in crate::monitor) fn leave_out_after(&mut self, time: Timestamp) -> Option<Event> {
        self.record.leave_out_after(time)
    }

    /// What comes now was measured long before `time`, which it is by the clock.
    pub(in crate::monitor) fn fall_behind(&mut self, time: Timestamp) {
        self.record.fall_behind(time);
    }

    /// What time it was when one came that was measured long before.
    pub(in crate::monitor) fn behind(&self) -> Option<Timestamp> {
        self.record.behind()
    }

    /// When it becomes silent, or red without a reading.
    pub(in crate::monitor) fn deadline(&self) -> Option<Timestamp> {
        let each = [self.record.silent_at(), self.alarm.overdue_at(&self.record)];
        each.into_iter().flatten().min()
    }

    /// Whether it gives no readings.
    pub(in crate::monitor) fn is_silent(&self) -> bool {
        self.record.is_silent()
    }

    /// Whether its readings come many together, long after they were measured.
    pub(in crate::monitor) fn comes_in_batches(&self) -> bool {
        self.record.comes_in_batches()
    }

    /// Whether its times lie ahead of the clock.
    pub(in crate::monitor) fn is_ahead(&self) -> bool {
        self.quality.is_ahead()
    }

    /// Whether a reading of `time` lies so far after the newest one that the logger's clock may have jumped.
    pub(in crate::monitor) fn leaps(&self, time: Timestamp) -> bool {
        self.record.leaps(time)
    }
}
