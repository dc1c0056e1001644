//! A logger whose clock is set back: its readings from before lie ahead of those that it gives from then on, until time has passed them. They would be the
//! newest all that time, and what moves would be late.

use super::BenchmarkRecord;
use crate::monitor::event::Event;
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// A clock has been set back where readings have come late in so many batches, each after the one before it, and none that is newer. What fills a
/// gap comes all at once, or between readings that are newer.
const BATCHES: u32 = 3;
/// And where so many of the readings that are usual in that time are known already, by half at least: a gap has none.
const READ_ALREADY: i32 = 2;

/// The readings that have come late since the newest one, each after the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SetBackRun {
    first: Timestamp,
    last: Timestamp,
    readings: u32,
    /// In which at least one came.
    batches: u32,
    /// Whether one has come in the batch that is being taken.
    has_grown: bool,
}

impl SetBackRun {
    /// After a reading of `time` that comes late, where `before` is how those before it came.
    pub(super) fn after(before: Option<Self>, time: Timestamp) -> Self {
        let alone = Self {
            first: time,
            last: time,
            readings: 1,
            batches: 0,
            has_grown: true,
        };
        let goes_on = before.filter(|before| time > before.last);
        goes_on.map_or(alone, |before| Self {
            last: time,
            readings: before.readings.saturating_add(1),
            has_grown: true,
            ..before
        })
    }
}

impl BenchmarkRecord {
    /// A batch has been taken. Where the clock of the logger has been set back, the readings from before it are left out as far as their times have
    /// not come: nobody knows when they were measured.
    pub(in crate::monitor::track) fn end_late_batch(&mut self) -> Option<Event> {
        let run = self
            .late_run
            .set_back
            .as_mut()
            .filter(|run| run.has_grown)?;
        run.batches = run.batches.saturating_add(1);
        run.has_grown = false;
        let run = *run;
        if run.batches < BATCHES || !self.has_read_already(&run) {
            return None;
        }
        let newest = self.history.newest()?;
        let mut count = 0;
        while self
            .history
            .newest()
            .is_some_and(|newest| newest > run.last)
        {
            self.history.take_out_newest()?;
            count += 1;
        }
        self.late_run.set_back = None;
        let text = format!(
            "benchmark {}: readings between {} and {newest} are left out ({count}): the clock of their logger has been set back since, as the {} that came \
             last are of the time before them",
            self.benchmark, run.last, run.readings
        );
        (count > 0).then(|| self.fault(self.data_time(newest), "clock-set-back", text))
    }

    /// Whether the time of the run and after it had been read before it came.
    fn has_read_already(&self, run: &SetBackRun) -> bool {
        let usual = self
            .silence
            .median()
            .filter(|usual| *usual > SignedDuration::ZERO);
        let (Some(newest), Some(usual)) = (self.history.newest(), usual) else {
            return false;
        };
        let known = self.history.count_since(run.first);
        let others = known.saturating_sub(usize::try_from(run.readings).unwrap_or(usize::MAX));
        let expected = newest.duration_since(run.first).as_secs_f64() / usual.as_secs_f64();
        newest > run.last && f64::from(READ_ALREADY) * others as f64 >= expected
    }
}

#[cfg(test)]
mod tests {
    use crate::monitor::track::fixture::{DISPLACEMENT, at, record};
    use crate::reading::{Reading, Timestamp};
    use jiff::SignedDuration;

    fn minute(minute: i64) -> Timestamp {
        at(0) + SignedDuration::from_mins(minute)
    }

    /// Readings each 10 minutes until `until`, but for those of `gap`; then late ones of these minutes, so many to a batch: in which batches readings were
    /// left out, and when the newest is that is left.
    fn late(
        until: i64,
        gap: std::ops::Range<i64>,
        (minutes, together): (std::ops::Range<i64>, usize),
    ) -> (Vec<bool>, Timestamp) {
        let mut record = record([]);
        let of = |minutes: i64, value: f64| Reading {
            time: minute(minutes),
            value,
            sigma: None,
        };
        for minutes in (0..=until)
            .step_by(10)
            .filter(|minute| !gap.contains(minute))
        {
            record.take(DISPLACEMENT, &of(minutes, 2.0));
            record.note_newest(minute(minutes));
            record.break_silence(minute(minutes));
        }
        let late: Vec<i64> = minutes.step_by(10).collect();
        let said = late.chunks(together).map(|batch| {
            for minutes in batch {
                record.take(DISPLACEMENT, &of(*minutes, 90.0));
                record.put_overtaken_aside(minute(*minutes));
            }
            record.end_late_batch().is_some()
        });
        (said.collect(), record.history().newest().unwrap())
    }

    #[test]
    fn readings_from_before_a_clock_was_set_back_are_left_out_from_the_third_batch_on() {
        let set_back = late(600, 0..0, (485..525, 1));
        assert_eq!(set_back, (vec![false, false, true, false], minute(515)));
    }

    #[test]
    fn what_fills_a_gap_or_comes_at_once_leaves_nothing_out() {
        let gap = late(600, 450..590, (450..590, 1));
        assert_eq!(gap, (vec![false; 14], minute(600)));
        let at_once = late(600, 0..0, (485..595, 11));
        assert_eq!(at_once, (vec![false], minute(600)));
    }
}
