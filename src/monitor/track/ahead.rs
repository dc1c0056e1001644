//! A reading that lies far ahead of all others waits until another one confirms it: with one wrong time stamp all that
//! comes before that time would be late.

use super::{StepContext, Track};
use crate::alert::Policy;
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::reading::{Reading, Timestamp, Unit};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// So many readings of the time before it, one after the other, say that it was wrong.
const CONTRADICTED: u32 = 3;

/// The reading that waits.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct HeldReading {
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

impl Track {
    /// Keeps a reading of a time that has not come yet, as far as anybody knows.
    pub(in crate::monitor) fn put_aside(
        &mut self,
        now: Timestamp,
        source: MeasuredAs,
        reading: &Reading,
    ) -> Vec<Event> {
        let text = format!(
            "benchmark {}: the reading of {} lies {:.1} days after all others: it counts once another one confirms it",
            self.benchmark,
            reading.time,
            self.newest.map_or(0.0, |newest| super::days(
                reading.time.duration_since(newest)
            ))
        );
        self.ahead = Some(HeldReading {
            unit: source.unit,
            averaging: source.averaging,
            reading: *reading,
            before: 0,
        });
        vec![self.fault(now, "leaps-ahead", text)]
    }

    /// A reading of `time` has come, at `now`: the one that waits is taken before it, waits on, or was wrong.
    pub(super) fn judge_ahead(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let Some(mut ahead) = self.ahead.take() else {
            return Vec::new();
        };
        if time >= ahead.reading.time || context.phase.now >= ahead.reading.time {
            let source = MeasuredAs {
                unit: ahead.unit,
                averaging: ahead.averaging,
            };
            return self.take_one(policy, source, &ahead.reading, context);
        }
        if self.newest.is_some_and(|newest| time > newest) {
            ahead.before += 1;
        }
        if ahead.before >= CONTRADICTED {
            let text = format!(
                "benchmark {}: the reading of {} is left out: others of the time before it have come since",
                self.benchmark, ahead.reading.time
            );
            return vec![self.fault(time, "leapt-ahead", text)];
        }
        self.ahead = Some(ahead);
        Vec::new()
    }
}
