//! What the tests of single histories begin with.

use super::history::{History, MeasuredAs};
use crate::reading::{Reading, Timestamp, Unit};
use jiff::ToSpan;

/// Displacements, mm, one an hour.
pub(super) fn history(values: impl IntoIterator<Item = f64>) -> History {
    history_of(Unit::MM, values)
}

/// Values in `unit`, one an hour.
pub(super) fn history_of(unit: Unit, values: impl IntoIterator<Item = f64>) -> History {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let source = MeasuredAs {
        unit,
        averaging: None,
    };
    let mut history = History::new(source, start);
    for (hour, value) in (0..).zip(values) {
        let reading = Reading {
            time: start + i64::from(hour).hours(),
            value,
            sigma: None,
        };
        history.take(source, &reading);
    }
    history
}

/// Between 0 and 1, the same each time.
pub(super) fn noise(seed: u32) -> f64 {
    let mixed = seed.wrapping_mul(2_654_435_761) ^ 0x9e37_79b9;
    f64::from(mixed.wrapping_mul(2_246_822_519) >> 8) / f64::from(1_u32 << 24)
}
