//! Which values have been taken: files are read again after a restart, a truncation, a replacement.

use super::tail::Arrival;
use crate::monitor::Input;
use crate::reading::{Quantity, Timestamp};
use std::collections::BTreeMap;

/// Values remembered of one series; older ones than all of these count as taken.
const REMEMBERED: usize = 500_000;

/// Whether a value says anything new.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Novelty {
    /// Another time, or another value for the time.
    New,
    /// This time, this value: taken before, or from before what is remembered.
    Repeated,
}

/// A series' name, and its quantity where it is a benchmark's.
type Name = (String, Option<Quantity>);

#[derive(Debug, Default)]
struct Memory {
    values: BTreeMap<Timestamp, u64>,
    /// Everything up to here has been forgotten.
    forgotten: Option<Timestamp>,
}

/// The values of all series.
#[derive(Debug, Default)]
pub(super) struct Seen(BTreeMap<Name, Memory>);

impl Seen {
    /// Remembers the value.
    pub(super) fn look(&mut self, arrival: &Arrival) -> Novelty {
        let (name, value) = match &arrival.input {
            Input::Reading {
                benchmark,
                unit,
                reading,
                ..
            } => (
                (benchmark.as_str().to_owned(), Some(unit.quantity())),
                reading.value * unit.factor(),
            ),
            Input::Sample {
                channel, sample, ..
            } => ((channel.clone(), None), sample.value),
            // Beside the readings: a value that comes for the same time later is none of these.
            Input::Missing { benchmark, .. } => ((format!("missing at {benchmark}"), None), 0.0),
            Input::Found(_) | Input::Tick => return Novelty::New,
        };
        self.0
            .entry(name)
            .or_default()
            .look(arrival.time, value.to_bits())
    }
}

impl Memory {
    fn look(&mut self, time: Timestamp, value: u64) -> Novelty {
        if self.forgotten.is_some_and(|forgotten| time <= forgotten) {
            return Novelty::Repeated;
        }
        if self.values.insert(time, value) == Some(value) {
            return Novelty::Repeated;
        }
        if self.values.len() > REMEMBERED {
            self.forgotten = self.values.pop_first().map(|(time, _)| time);
        }
        Novelty::New
    }
}
