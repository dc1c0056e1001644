//! A reading that lies far ahead of all others, or that others of the time before it overtake, waits until another one confirms it: with one
//! wrong time stamp all that comes before that time would be late, and nothing would be judged by it.

use super::BenchmarkRecord;
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::reading::{Reading, Timestamp, Unit, days_of};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// So many readings of the time before it, one after the other, say that it was wrong.
const CONTRADICTED: u32 = 3;
/// The newest reading waits where it lies further than this after the last of as many that have come since; a little out of order is usual.
const OVERTAKEN: SignedDuration = SignedDuration::from_mins(10);
/// It is taken after all where its value lies among so many of the newest and the one after it, or off them by this share of what the former range over.
const LIKE: usize = 8;
const OFF: f64 = 0.25;

/// The reading that waits.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in crate::monitor::track) struct HeldReading {
    unit: Unit,
    averaging: Option<SignedDuration>,
    reading: Reading,
    /// Readings of the time before it since it came.
    before: u32,
    /// Whether it was the very first of its benchmark: data time went by it, and says nothing of it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    was_first: bool,
    /// Whether it was taken as the newest before others of the time before it came.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    was_newest: bool,
}

/// The readings that have come since the newest one, each after the one before it, all between that and the one which was the newest before it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::monitor::track) struct LateRun {
    /// When the newest but one was.
    before: Option<Timestamp>,
    last: Option<Timestamp>,
    count: u32,
}

impl LateRun {
    /// Nothing has come since the newest reading, before which that of `before` was the newest.
    pub(super) fn after(before: Option<Timestamp>) -> Self {
        Self {
            before,
            ..Self::default()
        }
    }

    /// A reading of `time` has come late.
    fn note(&mut self, time: Timestamp) {
        if self.before.is_none_or(|before| time <= before) {
            return;
        }
        let goes_on = self.last.is_none_or(|last| time > last);
        self.count = if goes_on { self.count + 1 } else { 1 };
        self.last = Some(time);
    }
}

impl HeldReading {
    /// One that waits since now.
    fn new(source: MeasuredAs, reading: Reading) -> Self {
        Self {
            unit: source.unit,
            averaging: source.averaging,
            reading,
            before: 0,
            was_first: false,
            was_newest: false,
        }
    }

    fn source(&self) -> MeasuredAs {
        MeasuredAs {
            unit: self.unit,
            averaging: self.averaging,
        }
    }

    /// Whether a reading of `time` goes on where this one stands.
    pub(super) fn precedes(&self, time: Timestamp, within: SignedDuration) -> bool {
        let since = time.duration_since(self.reading.time);
        (SignedDuration::ZERO..=within).contains(&since)
    }
}

impl BenchmarkRecord {
    /// Keeps a reading of a time that has not come yet, as far as anybody knows.
    pub(in crate::monitor::track) fn put_aside(
        &mut self,
        now: Timestamp,
        source: MeasuredAs,
        reading: &Reading,
    ) -> Event {
        let text = format!(
            "benchmark {}: the reading of {} lies {:.1} days after all others: it counts once another one confirms it",
            self.benchmark,
            reading.time,
            self.newest
                .map_or(0.0, |newest| days_of(reading.time.duration_since(newest)))
        );
        self.ahead = Some(HeldReading::new(source, *reading));
        self.fault(now, "leaps-ahead", text)
    }

    /// After a reading of `time` that came late: where several have come so, one after the other, the newest one waits from now on.
    pub(in crate::monitor::track) fn put_overtaken_aside(
        &mut self,
        time: Timestamp,
    ) -> Option<Event> {
        self.late_run.note(time);
        let newest = self.newest?;
        let is_overtaken = self.late_run.count >= CONTRADICTED
            && newest.duration_since(time) > OVERTAKEN
            && self.ahead.is_none();
        // A sensor's repeats are not in the record.
        if !is_overtaken || self.history.newest() != Some(newest) {
            return None;
        }
        let source = self.source();
        let reading = self.history.take_out_newest()?;
        let text = format!(
            "benchmark {}: the reading of {newest} waits: {CONTRADICTED} of the time before it have come since, one after the other; it counts \
             once a later one confirms it",
            self.benchmark,
        );
        self.ahead = Some(HeldReading {
            was_newest: true,
            ..HeldReading::new(source, reading)
        });
        self.late_run = LateRun::default();
        // Data time does not go back: what follows from readings of before it has its time until one comes after it.
        Some(self.fault(newest, "leaps-ahead", text))
    }

    /// The reading that others overtook, where `reading` comes after it and its value is none of that time: it is left out.
    pub(in crate::monitor::track) fn leave_out_overtaken(
        &mut self,
        source: MeasuredAs,
        reading: &Reading,
    ) -> Option<Event> {
        let is_over = |ahead: &&HeldReading| ahead.was_newest && reading.time >= ahead.reading.time;
        let ahead = self.ahead.as_ref().filter(is_over)?;
        let value = self.history.value_of(ahead.source(), &ahead.reading);
        let recent = self.history.values_as_read(ahead.unit, LIKE);
        let newest = self.history.value_of(source, reading);
        let bounds = |(low, high): (f64, f64), value: &f64| (low.min(*value), high.max(*value));
        let (low, high) = recent
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), bounds);
        let off = OFF * (high - low);
        let is_like = (low.min(newest) - off..=high.max(newest) + off).contains(&value);
        let wrong = self.ahead.take_if(|_| !is_like)?;
        let text = format!(
            "benchmark {}: the reading of {} is left out: others of the time before it came after it, and its value is not theirs",
            self.benchmark, wrong.reading.time
        );
        Some(self.fault(reading.time, "leapt-ahead", text))
    }

    /// When the only reading that there is was measured, where one of `time`, which comes after it, lies as far before it as one lies
    /// after all others that waits for another one.
    pub(in crate::monitor::track) fn first_ahead_of(&self, time: Timestamp) -> Option<Timestamp> {
        let newest = self.newest?;
        let is_alone = self.history.is_single() && self.ahead.is_none();
        (is_alone && newest.duration_since(time) > super::LEAST_LEAP).then_some(newest)
    }

    /// The only reading that there is waits from now on, and the record begins with one of `time`, which comes next.
    pub(in crate::monitor::track) fn put_first_aside(
        &mut self,
        now: Timestamp,
        time: Timestamp,
    ) -> Option<Event> {
        self.first_ahead_of(time)?;
        let source = self.source();
        let reading = self.history.begin_again(source, time)?;
        let text = format!(
            "benchmark {}: the reading of {}, its first, lies {:.1} days after the next one: it counts once another one confirms it",
            self.benchmark,
            reading.time,
            days_of(reading.time.duration_since(time))
        );
        self.ahead = Some(HeldReading {
            was_first: true,
            ..HeldReading::new(source, reading)
        });
        self.newest = None;
        self.silence.begin_again();
        Some(self.fault(now, "leaps-ahead", text))
    }

    /// The reading that waits, where it waits no longer: one of `time` has come at `now`, and either is not before it.
    pub(in crate::monitor::track) fn take_confirmed(
        &mut self,
        time: Timestamp,
        now: Timestamp,
    ) -> Option<(MeasuredAs, Reading)> {
        let ahead = (self.ahead).take_if(|ahead| {
            let moved_data_time = ahead.was_first || ahead.was_newest;
            let has_come = !moved_data_time && now >= ahead.reading.time;
            time >= ahead.reading.time || has_come
        })?;
        Some((ahead.source(), ahead.reading))
    }

    /// A reading of `time` has come, before the one that waits: that one waits on, or was wrong.
    pub(in crate::monitor::track) fn contradict_ahead(&mut self, time: Timestamp) -> Option<Event> {
        let is_newer = self.newest.is_some_and(|newest| time > newest);
        let ahead = self.ahead.as_mut().filter(|ahead| !ahead.was_newest)?;
        ahead.before += u32::from(is_newer);
        let wrong = self.ahead.take_if(|ahead| ahead.before >= CONTRADICTED)?;
        let text = format!(
            "benchmark {}: the reading of {} is left out: others of the time before it have come since",
            self.benchmark, wrong.reading.time
        );
        Some(self.fault(time, "leapt-ahead", text))
    }
}

#[cfg(test)]
mod tests {
    use crate::monitor::track::fixture::{DISPLACEMENT, at, reading, record};
    use crate::monitor::track::record::BenchmarkRecord;

    /// Readings each hour, one of hour 20 among them, and then as many of the time before it.
    fn overtaken(values: [f64; 3]) -> BenchmarkRecord {
        let mut record = record([0.0, 1.0, 2.0]);
        record.take(DISPLACEMENT, &reading(20, 2.5));
        record.note_newest(at(20));
        let said: Vec<bool> = (3..)
            .zip(values)
            .map(|(hour, value)| {
                record.take(DISPLACEMENT, &reading(hour, value));
                record.put_overtaken_aside(at(hour)).is_some()
            })
            .collect();
        assert_eq!(said, [false, false, true]);
        record
    }

    #[test]
    fn the_newest_reading_waits_where_others_overtake_it_and_is_taken_where_it_goes_on_from_them() {
        let mut first_sent = overtaken([2.1, 2.2, 2.3]);
        assert_eq!(first_sent.history().newest(), Some(at(5)));
        assert_eq!(first_sent.data_time(at(6)), at(20));
        assert!(first_sent.contradict_ahead(at(6)).is_none());
        assert!(first_sent.take_confirmed(at(6), at(20)).is_none());
        let last = reading(21, 2.6);
        assert!(
            first_sent
                .leave_out_overtaken(DISPLACEMENT, &last)
                .is_none()
        );
        let (_, taken) = first_sent.take_confirmed(at(21), at(21)).unwrap();
        assert_eq!(taken, reading(20, 2.5));

        let mut wrong = overtaken([50.0, 60.0, 70.0]);
        for hour in 6..14 {
            wrong.take(DISPLACEMENT, &reading(hour, 20.0 + 10.0 * hour as f64));
            wrong.note_newest(at(hour));
        }
        let before = reading(14, 400.0);
        assert!(wrong.leave_out_overtaken(DISPLACEMENT, &before).is_none());
        let last = reading(21, 500.0);
        assert!(wrong.leave_out_overtaken(DISPLACEMENT, &last).is_some());
        assert!(wrong.take_confirmed(at(21), at(21)).is_none());
    }

    #[test]
    fn what_comes_out_of_order_overtakes_nothing() {
        let mut record = record([0.0, 1.0, 2.0]);
        record.take(DISPLACEMENT, &reading(20, 2.5));
        record.note_newest(at(20));
        // A file written backwards, and what fills a gap of long before.
        for hour in [19, 18, 17, 16, 1, 2] {
            assert!(record.put_overtaken_aside(at(hour)).is_none(), "{hour}");
        }
    }

    #[test]
    fn a_first_reading_far_ahead_waits_as_any_other_does() {
        let ahead = || {
            let mut record = record([9.0]);
            assert_eq!(record.first_ahead_of(at(-48)), None);
            assert_eq!(record.first_ahead_of(at(-49)), Some(at(0)));
            assert!(record.put_first_aside(at(0), at(-100)).is_some());
            assert_eq!(record.observations().values.len(), 0);
            record.take(DISPLACEMENT, &reading(-100, 1.0));
            record.note_newest(at(-100));
            record
        };
        // Data time went by it.
        let mut wrong = ahead();
        assert!(wrong.take_confirmed(at(-99), at(0)).is_none());
        let said: Vec<bool> = (-99..-95)
            .map(|hour| {
                let event = wrong.contradict_ahead(at(hour));
                wrong.note_newest(at(hour));
                event.is_some()
            })
            .collect();
        assert_eq!(said, [false, false, true, false]);
        let (_, taken) = ahead().take_confirmed(at(1), at(1)).unwrap();
        assert_eq!(taken, reading(0, 9.0));
        assert!(
            record([9.0, 9.5])
                .put_first_aside(at(1), at(-100))
                .is_none()
        );
    }

    #[test]
    fn a_reading_far_ahead_is_taken_when_its_time_has_come_and_dropped_after_three_before_it() {
        let mut confirmed = record([0.0, 1.0, 2.0]);
        confirmed.put_aside(at(2), DISPLACEMENT, &reading(200, 9.0));
        assert!(confirmed.take_confirmed(at(3), at(3)).is_none());
        let (_, taken) = confirmed.take_confirmed(at(201), at(201)).unwrap();
        assert_eq!(taken, reading(200, 9.0));
        assert!(confirmed.take_confirmed(at(202), at(202)).is_none());

        let mut wrong = record([0.0, 1.0, 2.0]);
        wrong.put_aside(at(2), DISPLACEMENT, &reading(200, 9.0));
        let said: Vec<bool> = (3..7)
            .map(|hour| {
                let event = wrong.contradict_ahead(at(hour));
                wrong.note_newest(at(hour));
                event.is_some()
            })
            .collect();
        assert_eq!(said, [false, false, true, false]);
    }
}
