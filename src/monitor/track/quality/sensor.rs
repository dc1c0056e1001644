//! Whether a benchmark's readings can be motion: a sensor that repeats one value, or whose readings jump back and forth from
//! one to the next, says nothing, and least of all that the slope has slowed down.

use super::DataQuality;
use super::unknown::Reason;
use crate::alert::{Level, Policy};
use crate::monitor::event::Event;
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::{Timestamp, days_of, figure};

/// Readings of a second quantity in a row that are reported, where the first quantity has hardly been read.
const FEW_OTHERS: u32 = 3;
/// And where it has.
const MANY_OTHERS: u32 = 24;
/// For so much of an evacuation time a slope at the critical velocity must show.
const SHOWS_WITHIN: i32 = 4;
/// A benchmark with fewer readings has hardly been read.
const HARDLY_READ: usize = 3;

impl DataQuality {
    /// After the newest reading, of `time`, at which `level` is in force: whether the sensor is stuck, or its readings are
    /// spoilt.
    pub(in crate::monitor::track) fn judge_sensor(
        &mut self,
        record: &mut BenchmarkRecord,
        policy: &Policy,
        level: Level,
        time: Timestamp,
    ) -> Vec<Event> {
        let mut events = Vec::new();
        if let Some((count, since)) = record.history().stuck() {
            let what = "are the same, as this sensor never gave them before: it is stuck";
            events.extend(self.sticks(record, time, count, since, what));
        } else if level >= Level::Orange
            && let Some((count, since, around)) = record.history().stands_at_the_end()
        {
            record.note_range_end(Some(around));
            let what = "only jitter where a fast motion ended at once: the sensor is stuck, or at the end of its range";
            events.extend(self.sticks(record, time, count, since, what));
        }
        let before = self.spoilt_by;
        let shows_within = days_of(policy.evacuation_time / SHOWS_WITHIN);
        let critical = policy.critical_velocity_mm_per_day;
        let history = record.history();
        self.spoilt_by = history
            .spoilt(before)
            .or_else(|| history.noise_that_hides(critical, shows_within));
        if let (None, Some(by)) = (before, self.spoilt_by) {
            let text = format!(
                "benchmark {}: many of the latest readings jump back and forth by about {} {} from one reading to the next; \
                 no slope reverses by that much, so they are not its motion",
                record.benchmark(),
                figure(by, 3),
                record.unit()
            );
            events.push(record.fault(time, "spoilt-readings", text.clone()));
            events.extend(self.begins_unknown(record, time, time, Reason::Spoilt, text));
        } else if before.is_some() && self.spoilt_by.is_none() {
            let text = format!(
                "benchmark {}: its readings no longer jump back and forth",
                record.benchmark()
            );
            events.extend(self.ends_unknown(record, time, time, Reason::Spoilt, text));
        }
        events
    }

    /// So many readings since a time say nothing, as it turns out at `time`.
    fn sticks(
        &mut self,
        record: &mut BenchmarkRecord,
        time: Timestamp,
        count: usize,
        since: Timestamp,
        what: &str,
    ) -> Vec<Event> {
        record.forget_repeats(count);
        let text = format!(
            "benchmark {}: {count} readings in a row {what}",
            record.benchmark()
        );
        let mut events = vec![record.fault(time, "stuck-sensor", text.clone())];
        events.extend(self.begins_unknown(record, time, since, Reason::Stuck, text));
        events
    }

    /// The stuck sensor gives another value, at `time`.
    pub(in crate::monitor::track) fn unstick(
        &mut self,
        record: &mut BenchmarkRecord,
        time: Timestamp,
    ) -> Vec<Event> {
        if !self.is_stuck() {
            return Vec::new();
        }
        record.note_range_end(None);
        let text = format!(
            "benchmark {}: its readings change again",
            record.benchmark()
        );
        self.ends_unknown(record, time, time, Reason::Stuck, text)
    }

    /// One more reading of a second quantity.
    pub(in crate::monitor::track) fn count_other(
        &mut self,
        record: &BenchmarkRecord,
        time: Timestamp,
    ) -> Option<Event> {
        self.others = self.others.saturating_add(1);
        let observations = record.observations();
        let most = if observations.values.len() < HARDLY_READ {
            FEW_OTHERS
        } else {
            MANY_OTHERS
        };
        if self.others != most {
            return None;
        }
        let text = format!(
            "benchmark {}: gives no {} any more, which is what is monitored, but another quantity",
            record.benchmark(),
            observations.quantity.name()
        );
        self.begins_unknown(record, time, time, Reason::SecondQuantity, text)
    }

    /// A reading of the quantity that is monitored.
    pub(in crate::monitor::track) fn count_own(
        &mut self,
        record: &BenchmarkRecord,
        time: Timestamp,
    ) -> Vec<Event> {
        self.others = 0;
        if !self.unknown.has(Reason::SecondQuantity) {
            return Vec::new();
        }
        let text = format!(
            "benchmark {} gives what is monitored again",
            record.benchmark()
        );
        self.ends_unknown(record, time, time, Reason::SecondQuantity, text)
    }

    /// Data time has come to `now`, when silence is due; `fault` is what the sensor gives instead, and `level` what is in
    /// force.
    pub(in crate::monitor::track) fn fall_silent(
        &mut self,
        record: &mut BenchmarkRecord,
        now: Timestamp,
        fault: Option<&str>,
        level: Level,
    ) -> Vec<Event> {
        let Some(newest) = record.begin_silence() else {
            return Vec::new();
        };
        let latched = match level {
            Level::Green | Level::Unknown => String::new(),
            Level::Yellow | Level::Orange | Level::Red => {
                format!("; {level}, which was called before, does not end by it")
            }
        };
        let fault = fault.map_or_else(String::new, |what| format!("; the sensor gives {what}"));
        let text = format!(
            "benchmark {}: no reading since {newest}{fault}{latched}",
            record.benchmark()
        );
        let mut events = vec![record.fault(now, "no-data", text.clone())];
        events.extend(self.begins_unknown(record, now, newest, Reason::NoData, text));
        events
    }

    /// The end of a silence, where the reading of `time` is one.
    pub(in crate::monitor::track) fn read_again(
        &mut self,
        record: &mut BenchmarkRecord,
        now: Timestamp,
        time: Timestamp,
    ) -> Vec<Event> {
        let since = record.break_silence(time);
        since.map_or_else(Vec::new, |since| self.ends_silence(record, now, since))
    }

    /// The end of a silence, where the reading of `time`, which waits for earlier ones, is one at `until`.
    pub(in crate::monitor::track) fn note_waiting(
        &mut self,
        record: &mut BenchmarkRecord,
        now: Timestamp,
        (time, until): (Timestamp, Timestamp),
    ) -> Vec<Event> {
        let since = record.note_waiting(time, until);
        since.map_or_else(Vec::new, |since| self.ends_silence(record, now, since))
    }

    fn ends_silence(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        since: Timestamp,
    ) -> Vec<Event> {
        let text = format!("benchmark {} gives readings again", record.benchmark());
        self.ends_unknown(record, now, since, Reason::NoData, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::{at, record};

    fn is_fault(event: &Event, of: &str) -> bool {
        matches!(&event.kind, crate::monitor::EventKind::Fault { kind, .. } if kind == of)
    }

    #[test]
    fn a_sensor_that_repeats_a_value_is_stuck_until_it_gives_another() {
        let moving = (0..20).map(|hour| f64::from(hour * hour));
        let mut record = record(moving.chain([400.0; 8]));
        let mut quality = DataQuality::default();
        let events = quality.judge_sensor(&mut record, &Policy::default(), Level::Green, at(27));
        assert!(is_fault(&events[0], "stuck-sensor") && events.len() == 2);
        assert!(quality.is_stuck() && quality.shows_motion());
        assert_eq!(record.observations().values.len(), 21);
        assert_eq!(quality.unstick(&mut record, at(28)).len(), 1);
        assert!(!quality.is_unknown());
    }

    #[test]
    fn three_readings_of_another_quantity_are_enough_where_the_first_was_hardly_read() {
        let mut quality = DataQuality::default();
        let hardly = record([0.0]);
        let said = (0..4).map(|hour| quality.count_other(&hardly, at(hour)).is_some());
        assert_eq!(said.collect::<Vec<bool>>(), [false, false, true, false]);
        assert_eq!(quality.count_own(&hardly, at(5)).len(), 1);
        let read = record((0..9).map(f64::from));
        let said = (0..24).filter(|hour| quality.count_other(&read, at(*hour)).is_some());
        assert_eq!(said.collect::<Vec<i64>>(), [23]);
    }

    #[test]
    fn a_silence_ends_with_the_first_reading_after_it() {
        let mut record = record((0..9).map(f64::from));
        let mut quality = DataQuality::default();
        let events = quality.fall_silent(&mut record, at(20), Some("NAN"), Level::Red);
        assert!(is_fault(&events[0], "no-data") && events.len() == 2);
        assert!(quality.is_unknown() && record.is_silent());
        assert_eq!(quality.read_again(&mut record, at(21), at(21)).len(), 1);
        assert!(!quality.is_unknown() && !record.is_silent());
    }
}
