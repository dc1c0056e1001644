//! A reading that lies far ahead of all others waits until another one confirms it: with one wrong time stamp all that
//! comes before that time would be late.

use super::BenchmarkRecord;
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::monitor::track::days;
use crate::reading::{Reading, Timestamp, Unit};
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
                .map_or(0.0, |newest| days(reading.time.duration_since(newest)))
        );
        self.ahead = Some(HeldReading {
            unit: source.unit,
            averaging: source.averaging,
            reading: *reading,
            before: 0,
        });
        self.fault(now, "leaps-ahead", text)
    }

    /// The reading that waits, where it waits no longer: one of `time` has come at `now`, and either is not before it.
    pub(in crate::monitor::track) fn take_confirmed(
        &mut self,
        time: Timestamp,
        now: Timestamp,
    ) -> Option<(MeasuredAs, Reading)> {
        let ahead = (self.ahead)
            .take_if(|ahead| time >= ahead.reading.time || now >= ahead.reading.time)?;
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
