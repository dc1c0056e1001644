//! A reading that lies far ahead of all others waits until another one confirms it: with one wrong time stamp all that
//! comes before that time would be late.

use super::BenchmarkRecord;
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::reading::{Reading, Timestamp, Unit, days_of};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// So many readings of the time before it, one after the other, say that it was wrong.
const CONTRADICTED: u32 = 3;

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
}

impl HeldReading {
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
        self.ahead = Some(HeldReading {
            unit: source.unit,
            averaging: source.averaging,
            reading: *reading,
            before: 0,
            was_first: false,
        });
        self.fault(now, "leaps-ahead", text)
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
            unit: source.unit,
            averaging: source.averaging,
            reading,
            before: 0,
            was_first: true,
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
            let has_come = !ahead.was_first && now >= ahead.reading.time;
            time >= ahead.reading.time || has_come
        })?;
        let source = MeasuredAs {
            unit: ahead.unit,
            averaging: ahead.averaging,
        };
        Some((source, ahead.reading))
    }

    /// A reading of `time` has come, before the one that waits: that one waits on, or was wrong.
    pub(in crate::monitor::track) fn contradict_ahead(&mut self, time: Timestamp) -> Option<Event> {
        let is_newer = self.newest.is_some_and(|newest| time > newest);
        let ahead = self.ahead.as_mut()?;
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
