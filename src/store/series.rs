//! The series that values belong to, by number.

use super::StoreError;
use crate::monitor::Measured;
use crate::reading::{BenchmarkId, Unit};
use jiff::SignedDuration;
use rusqlite::{Connection, params};
use std::collections::BTreeMap;

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
    numbers: BTreeMap<StoredSeries, i64>,
    series: BTreeMap<i64, StoredSeries>,
    /// By whether it is a benchmark's, and name.
    names: BTreeMap<(bool, String), Vec<i64>>,
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
    fn name(&self) -> (bool, String) {
        match self {
            Self::Channel(name, _) => (false, name.clone()),
            Self::Benchmark(benchmark, ..) => (true, benchmark.as_str().to_owned()),
        }
    }
}

impl Catalogue {
    pub(super) fn load(connection: &Connection) -> Result<Self, StoreError> {
        let mut catalogue = Self::default();
        let mut query =
            connection.prepare("SELECT id, is_reading, name, unit, averaging FROM series")?;
        let mut rows = query.query([])?;
        while let Some(row) = rows.next()? {
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
        let name = series.name();
        self.names.entry(name).or_default().push(number);
        self.numbers.insert(series.clone(), number);
        self.series.insert(number, series);
    }

    pub(super) fn get(&self, number: i64) -> Option<&StoredSeries> {
        self.series.get(&number)
    }

    pub(super) fn number(&self, series: &StoredSeries) -> Option<i64> {
        self.numbers.get(series).copied()
    }

    /// The numbers of series that measure the same, with the factor to a common unit.
    pub(super) fn alike(&self, series: &StoredSeries) -> Vec<(i64, f64)> {
        let numbers = self
            .names
            .get(&series.name())
            .map_or(&[][..], Vec::as_slice);
        let factor = |number: &i64| match (series, self.series.get(number)?) {
            (StoredSeries::Channel(..), StoredSeries::Channel(..)) => Some((*number, 1.0)),
            (StoredSeries::Benchmark(_, unit, _), StoredSeries::Benchmark(_, own, _)) => {
                (unit.quantity() == own.quantity()).then_some((*number, own.factor()))
            }
            (StoredSeries::Channel(..) | StoredSeries::Benchmark(..), _) => None,
        };
        numbers.iter().filter_map(factor).collect()
    }

    /// The number after the last.
    pub(super) fn next(&self) -> i64 {
        self.series.last_key_value().map_or(1, |(last, _)| last + 1)
    }
}

pub(super) fn insert(
    connection: &Connection,
    number: i64,
    series: &StoredSeries,
) -> Result<(), StoreError> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO series (id, is_reading, name, unit, averaging) VALUES (?1, ?2, ?3, ?4, ?5)",
    )?;
    match series {
        StoredSeries::Channel(name, unit) => {
            insert.execute(params![number, false, name, unit, None::<i64>])?;
        }
        StoredSeries::Benchmark(benchmark, unit, averaging) => {
            let averaging = averaging.and_then(|span| i64::try_from(span.as_nanos()).ok());
            insert.execute(params![
                number,
                true,
                benchmark.as_str(),
                unit.to_string(),
                averaging
            ])?;
        }
    }
    Ok(())
}
