//! What the tests of a track's parts begin with: a record of displacements, one an hour.

use super::record::BenchmarkRecord;
use crate::monitor::declared::Declarations;
use crate::monitor::history::MeasuredAs;
use crate::reading::{BenchmarkId, Reading, Timestamp, Unit};
use jiff::ToSpan;

pub(super) const DISPLACEMENT: MeasuredAs = MeasuredAs {
    unit: Unit::MM,
    averaging: None,
};

pub(super) fn at(hour: i64) -> Timestamp {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    start + hour.hours()
}

pub(super) fn reading(hour: i64, value: f64) -> Reading {
    Reading {
        time: at(hour),
        value,
        sigma: None,
    }
}

/// A record of these displacements, mm, one an hour.
pub(super) fn record(values: impl IntoIterator<Item = f64>) -> BenchmarkRecord {
    record_each(1, values)
}

/// The same, so many hours apart.
pub(super) fn record_each(hours: i64, values: impl IntoIterator<Item = f64>) -> BenchmarkRecord {
    let (id, declared) = (BenchmarkId::new("a"), Declarations::default());
    let mut record = BenchmarkRecord::new(id, DISPLACEMENT, at(0), declared, 0);
    for (index, value) in (0..).zip(values) {
        let hour = index * hours;
        record.take(DISPLACEMENT, &reading(hour, value));
        record.note_newest(at(hour));
        record.break_silence(at(hour));
    }
    record
}
