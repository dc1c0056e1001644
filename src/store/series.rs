//! The series that values belong to, by number.

use super::StoreError;
use super::sum::{self, is_whole, sum};
use crate::monitor::Measured;
use crate::reading::{BenchmarkId, Unit};
use jiff::SignedDuration;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row, params};
use std::collections::BTreeMap;
use std::ops::Range;

/// Rows after a number, so many, each with its sum behind its values.
pub(super) const ROWS: &str = "SELECT id, is_reading, name, unit, averaging, sum FROM series
     WHERE id > ?1 ORDER BY id LIMIT ?2";
/// The columns of [`ROWS`] whose values the sum is over.
const SUMMED: Range<usize> = 0..5;

/// What values of one series have in common.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum StoredSeries {
    /// A covariate: its name and unit.
    Channel(String, Option<String>),
    /// A benchmark's readings: unit and averaging.
    Benchmark(BenchmarkId, Unit, Option<SignedDuration>),
}

/// All series that have been seen, both ways.
#[derive(Debug, Default)]
pub(super) struct Catalogue {
    series: BTreeMap<i64, StoredSeries>,
    /// By name.
    benchmarks: BTreeMap<String, Vec<i64>>,
    channels: BTreeMap<String, Vec<i64>>,
}

impl StoredSeries {
    pub(super) fn of(measured: &Measured<'_>) -> Self {
        match *measured {
            Measured::Reading {
                benchmark,
                unit,
                averaging,
                ..
            } => Self::Benchmark(benchmark.clone(), unit, averaging),
            Measured::Sample { channel, unit, .. } => {
                Self::Channel(channel.to_owned(), unit.map(str::to_owned))
            }
        }
    }
}

impl StoredSeries {
    /// Whether this is the series of a value.
    pub(super) fn is_of(&self, measured: &Measured<'_>) -> bool {
        match (self, measured) {
            (
                Self::Channel(name, unit),
                Measured::Sample {
                    channel, unit: own, ..
                },
            ) => name == channel && unit.as_deref() == *own,
            (
                Self::Benchmark(id, unit, averaging),
                Measured::Reading {
                    benchmark,
                    unit: own,
                    averaging: mean,
                    ..
                },
            ) => id == *benchmark && unit == own && averaging == mean,
            (Self::Channel(..) | Self::Benchmark(..), _) => false,
        }
    }
}

impl Catalogue {
    pub(super) fn load(connection: &Connection) -> Result<Self, StoreError> {
        let mut catalogue = Self::default();
        let mut query = connection.prepare(ROWS)?;
        let mut rows = query.query([0, i64::MAX])?;
        while let Some(row) = rows.next()? {
            // Its values would go to another benchmark, or count for another length.
            if !is_as_written(row)? {
                let number = row.get_ref(0)?;
                let detail = format!("row {number:?} of the table series is not what was written");
                return Err(StoreError::Damaged { detail });
            }
            let (name, unit): (String, Option<String>) = (row.get(2)?, row.get(3)?);
            let series = if row.get(1)? {
                let unit = Unit::parse(unit.as_deref().unwrap_or_default())
                    .map_err(|error| StoreError::Unreadable(error.to_string()))?;
                let averaging = row
                    .get::<_, Option<i64>>(4)?
                    .map(SignedDuration::from_nanos);
                StoredSeries::Benchmark(BenchmarkId::new(name), unit, averaging)
            } else {
                StoredSeries::Channel(name, unit)
            };
            catalogue.note(row.get(0)?, series);
        }
        Ok(catalogue)
    }

    pub(super) fn note(&mut self, number: i64, series: StoredSeries) {
        let (names, name) = match &series {
            StoredSeries::Channel(name, _) => (&mut self.channels, name.as_str()),
            StoredSeries::Benchmark(benchmark, ..) => (&mut self.benchmarks, benchmark.as_str()),
        };
        names.entry(name.to_owned()).or_default().push(number);
        self.series.insert(number, series);
    }

    pub(super) fn get(&self, number: i64) -> Option<&StoredSeries> {
        self.series.get(&number)
    }

    /// The number of the series of a value; every step asks for one.
    pub(super) fn number_of(&self, measured: &Measured<'_>) -> Option<i64> {
        let is_it = |number: &&i64| {
            self.series
                .get(number)
                .is_some_and(|one| one.is_of(measured))
        };
        self.named(measured).iter().find(is_it).copied()
    }

    /// All numbers of series of the name that a value's has.
    fn named(&self, measured: &Measured<'_>) -> &[i64] {
        let numbers = match measured {
            Measured::Sample { channel, .. } => self.channels.get(*channel),
            Measured::Reading { benchmark, .. } => self.benchmarks.get(benchmark.as_str()),
        };
        numbers.map_or(&[][..], Vec::as_slice)
    }

    /// Adds those of another catalogue.
    pub(super) fn append(&mut self, other: Self) {
        for (number, series) in other.series {
            self.note(number, series);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.series.len()
    }

    /// The numbers of series that measure the same, with the factor to a common unit.
    pub(super) fn alike(&self, measured: &Measured<'_>) -> Vec<(i64, f64)> {
        let factor = |number: &i64| match (measured, self.series.get(number)?) {
            (Measured::Sample { .. }, StoredSeries::Channel(..)) => Some((*number, 1.0)),
            (Measured::Reading { unit, .. }, StoredSeries::Benchmark(_, own, _)) => {
                (unit.quantity() == own.quantity()).then_some((*number, own.factor()))
            }
            (Measured::Sample { .. } | Measured::Reading { .. }, _) => None,
        };
        self.named(measured).iter().filter_map(factor).collect()
    }

    /// The number after the last.
    pub(super) fn next(&self) -> i64 {
        self.series.last_key_value().map_or(1, |(last, _)| last + 1)
    }
}

/// Whether a row of [`ROWS`] is what was written.
pub(super) fn is_as_written(row: &Row<'_>) -> rusqlite::Result<bool> {
    is_whole(row, SUMMED)
}

/// Gives each row its sum, taken for what was written.
pub(super) fn seal_all(connection: &Connection) -> Result<(), StoreError> {
    let update = "UPDATE series SET sum = ?2 WHERE id = ?1";
    sum::seal_all(connection, ROWS, &SUMMED, update)
}

pub(super) fn insert(
    connection: &Connection,
    number: i64,
    series: &StoredSeries,
) -> Result<(), StoreError> {
    let (is_reading, name, unit, averaging) = match series {
        StoredSeries::Channel(name, unit) => (false, name.as_str(), unit.clone(), None),
        StoredSeries::Benchmark(benchmark, unit, averaging) => {
            let averaging = averaging.and_then(|span| i64::try_from(span.as_nanos()).ok());
            (true, benchmark.as_str(), Some(unit.to_string()), averaging)
        }
    };
    let own = unit.as_deref().map(str::as_bytes);
    let sum = sum(&[
        ValueRef::Integer(number),
        ValueRef::Integer(is_reading.into()),
        ValueRef::Text(name.as_bytes()),
        own.map_or(ValueRef::Null, ValueRef::Text),
        averaging.map_or(ValueRef::Null, ValueRef::Integer),
    ]);
    connection
        .prepare_cached(
            "INSERT INTO series (id, is_reading, name, unit, averaging, sum) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
        )?
        .execute(params![number, is_reading, name, unit, averaging, sum])?;
    Ok(())
}
