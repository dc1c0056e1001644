//! What was known at a moment: the values taken and the events said until then.

use super::{Store, StoreError, nanoseconds, timestamp};
use crate::reading::{BenchmarkId, Quantity, Reading, Series, TimeSpan, Timestamp, Unit};
use jiff::SignedDuration;
use rusqlite::{Row, params};

/// The earliest time that the state can hold.
pub const EARLIEST: Timestamp = Timestamp::constant(-9_000_000_000, 0);
/// The latest time that the state can hold.
pub const LATEST: Timestamp = Timestamp::constant(9_000_000_000, 0);

/// Values of one series that a page or a report reads at most, the newest.
pub const MOST_SHOWN: usize = 200_000;

/// A stretch of one benchmark's or covariate's values, as it was known at a moment.
#[derive(Debug, Clone, Copy)]
pub struct Values<'a> {
    /// The benchmark's or the covariate's name.
    pub name: &'a str,
    /// A benchmark's readings; a covariate's samples else.
    pub is_reading: bool,
    /// Measured at or after this.
    pub from: Timestamp,
    /// Measured at or before this.
    pub to: Timestamp,
    /// Taken at or before this, data time.
    pub known: Timestamp,
    /// At most so many, the newest.
    pub most: usize,
}

/// One value with what its series says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    /// When it was measured.
    pub time: Timestamp,
    /// In mm or mm/day for a reading, as it came for a covariate.
    pub value: f64,
    /// Its standard error, in the unit of `value`, where it was given.
    pub sigma: Option<f64>,
    /// What a reading measures; `None` for a covariate.
    pub quantity: Option<Quantity>,
    /// The span over which a velocity is the mean.
    pub averaging: Option<SignedDuration>,
}

/// How far the state has grown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Heads {
    /// The number of the last step.
    pub step: i64,
    /// The number of the last event.
    pub event: i64,
}

impl Store {
    /// How far the state has grown, whoever writes to it.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn heads(&self) -> Result<Heads, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT (SELECT coalesce(max(seq), 0) FROM step), (SELECT coalesce(max(seq), 0) FROM event)",
        )?;
        Ok(query.query_row([], |row| {
            Ok(Heads {
                step: row.get(0)?,
                event: row.get(1)?,
            })
        })?)
    }

    /// Data time of the last step; `None` before the first.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn newest_step(&self) -> Result<Option<Timestamp>, StoreError> {
        let inner = self.inner();
        let mut query = inner
            .connection
            .prepare_cached("SELECT coalesce(now, time) FROM step ORDER BY seq DESC LIMIT 1")?;
        let mut rows = query.query([])?;
        let Some(row) = rows.next()? else {
            return Ok(None);
        };
        row.get::<_, Option<i64>>(0)?.map(timestamp).transpose()
    }

    /// The first and the last time at which anything was measured, of the whole site or of one benchmark.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn span(&self, benchmark: Option<&str>) -> Result<Option<TimeSpan>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT min(first), max(last) FROM (SELECT
                 (SELECT min(time) FROM step WHERE series = series.id) AS first,
                 (SELECT max(time) FROM step WHERE series = series.id) AS last
             FROM series WHERE is_reading AND (?1 IS NULL OR name = ?1))",
        )?;
        let (first, last): (Option<i64>, Option<i64>) =
            query.query_row([benchmark], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(match (first, last) {
            (Some(first), Some(last)) => Some(TimeSpan::new(timestamp(first)?, timestamp(last)?)),
            (Some(_) | None, _) => None,
        })
    }

    /// The names of all covariates.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn channels(&self) -> Result<Vec<(String, Option<String>)>, StoreError> {
        let query =
            "SELECT name, min(unit) FROM series WHERE NOT is_reading GROUP BY name ORDER BY name";
        self.rows(query, [], |row| Ok((row.get(0)?, row.get(1)?)))
    }

    /// When the newest reading of a benchmark was measured, of those measured at or before `until`.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn newest_reading(
        &self,
        benchmark: &str,
        until: Timestamp,
    ) -> Result<Option<Timestamp>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT max((SELECT max(time) FROM step WHERE series = series.id AND time <= ?2))
             FROM series WHERE is_reading AND name = ?1",
        )?;
        let newest: Option<i64> =
            query.query_row(params![benchmark, nanoseconds(until)?], |row| row.get(0))?;
        newest.map(timestamp).transpose()
    }

    /// The values of a stretch, oldest first; where one was corrected, the last that was known then.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn values(&self, wanted: &Values<'_>) -> Result<Vec<Value>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT step.time, value, sigma, unit, averaging FROM step JOIN series ON series.id = step.series
             WHERE series IN (SELECT id FROM series WHERE is_reading = ?1 AND name = ?2)
             AND step.time BETWEEN ?3 AND ?4 AND coalesce(now, step.time) <= ?5
             ORDER BY step.time DESC, seq DESC LIMIT ?6",
        )?;
        let most = i64::try_from(wanted.most).unwrap_or(i64::MAX);
        let mut rows = query.query(params![
            wanted.is_reading,
            wanted.name,
            nanoseconds(wanted.from)?,
            nanoseconds(wanted.to)?,
            nanoseconds(wanted.known)?,
            most
        ])?;
        let mut values: Vec<Value> = Vec::new();
        while let Some(row) = rows.next()? {
            let value = value(row, wanted.is_reading)?;
            let of_its_time = values.iter().rev();
            let mut of_its_time = of_its_time.take_while(|later| later.time == value.time);
            let is_corrected = of_its_time.any(|later| later.quantity == value.quantity);
            if !is_corrected {
                values.push(value);
            }
        }
        values.reverse();
        Ok(values)
    }

    /// A stretch of a benchmark's readings in mm or mm/day; of two quantities the displacement. In mm where there are none.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn series(&self, wanted: &Values<'_>) -> Result<Series, StoreError> {
        let values = self.values(wanted)?;
        let is_displacement = |value: &Value| value.quantity == Some(Quantity::Displacement);
        let has_displacement = values.iter().any(is_displacement);
        let ours = (values.iter()).filter(|value| is_displacement(value) == has_displacement);
        Ok(Series {
            benchmark: BenchmarkId::new(wanted.name),
            unit: if has_displacement || values.is_empty() {
                Unit::MM
            } else {
                Unit::MM_PER_DAY
            },
            averaging: ours.clone().find_map(|value| value.averaging),
            readings: ours
                .map(|value| Reading {
                    time: value.time,
                    value: value.value,
                    sigma: value.sigma,
                })
                .collect(),
        })
    }

    /// The JSON of the newest event of `kind` at a benchmark that was said at or before `until`.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn event_at(
        &self,
        benchmark: &str,
        kind: &str,
        until: Timestamp,
    ) -> Result<Option<String>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT body FROM event WHERE benchmark = ?1 AND kind = ?2 AND time <= ?3
             ORDER BY time DESC, seq DESC LIMIT 1",
        )?;
        let mut rows = query.query(params![benchmark, kind, nanoseconds(until)?])?;
        Ok(rows.next()?.map(|row| row.get(0)).transpose()?)
    }

    /// The JSON of the newest events of `kind`, anywhere, that were said at or before `until`: newest first.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn newest_events(
        &self,
        kind: &str,
        until: Timestamp,
        most: usize,
    ) -> Result<Vec<String>, StoreError> {
        // The second condition lets SQLite use the index of all events but refits.
        let query = "SELECT body FROM event WHERE kind = ?1 AND kind != 'refit' AND time <= ?2
             ORDER BY seq DESC LIMIT ?3";
        let most = i64::try_from(most).unwrap_or(i64::MAX);
        self.rows(query, params![kind, nanoseconds(until)?, most], |row| {
            row.get(0)
        })
    }

    /// Hands the JSON of every event of `kind` at a benchmark in a span of data time to `each`, oldest first.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn events_within(
        &self,
        benchmark: &str,
        kind: &str,
        span: TimeSpan,
        each: &mut dyn FnMut(&str),
    ) -> Result<(), StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT body FROM event WHERE benchmark = ?1 AND kind = ?2 AND time BETWEEN ?3 AND ?4
             ORDER BY time, seq",
        )?;
        let mut rows = query.query(params![
            benchmark,
            kind,
            nanoseconds(span.from)?,
            nanoseconds(span.to)?
        ])?;
        while let Some(row) = rows.next()? {
            let body = row.get_ref(0)?.as_str();
            each(body.map_err(|error| StoreError::Unreadable(error.to_string()))?);
        }
        Ok(())
    }
}

fn value(row: &Row<'_>, is_reading: bool) -> Result<Value, StoreError> {
    let unreadable = |error: crate::reading::UnitError| StoreError::Unreadable(error.to_string());
    let (number, sigma): (f64, Option<f64>) = (row.get(1)?, row.get(2)?);
    let unit = row.get::<_, Option<String>>(3)?.filter(|_| is_reading);
    let unit = unit
        .map(|unit| Unit::parse(&unit).map_err(unreadable))
        .transpose()?;
    let factor = unit.map_or(1.0, Unit::factor);
    Ok(Value {
        time: timestamp(row.get(0)?)?,
        value: number * factor,
        sigma: sigma.map(|sigma| sigma * factor),
        quantity: unit.map(Unit::quantity),
        averaging: row
            .get::<_, Option<i64>>(4)?
            .map(SignedDuration::from_nanos),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Input;
    use crate::store::Batch;

    fn at(second: i64) -> Timestamp {
        Timestamp::from_second(second).unwrap()
    }

    fn reading(second: i64, value: f64) -> Input {
        Input::Reading {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::parse("m").unwrap(),
            averaging: None,
            reading: Reading {
                time: at(second),
                value,
                sigma: None,
            },
        }
    }

    #[test]
    fn who_looks_on_while_a_daemon_writes_reads_benchmarks_that_have_come_since() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let beside = Store::look(folder.path()).unwrap();
        let mut batch = Batch::default();
        batch.step(at(100), &reading(100, 1.0), &[]);
        store.commit(&batch).unwrap();
        let steps = beside.steps(0).unwrap();
        assert_eq!(steps.len(), 1);
        assert_eq!(steps[0].input, reading(100, 1.0));
    }

    #[test]
    fn what_came_late_or_was_corrected_is_known_only_from_then_on() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let mut batch = Batch::default();
        batch.step(at(100), &reading(100, 1.0), &[]);
        batch.step(at(200), &reading(200, 2.0), &[]);
        // Measured between them, and come after both; then the first is corrected.
        batch.step(at(200), &reading(150, 1.5), &[]);
        batch.step(at(300), &reading(100, 1.1), &[]);
        store.commit(&batch).unwrap();
        let known = |second: i64| -> Vec<(i64, f64)> {
            let wanted = Values {
                name: "5",
                is_reading: true,
                from: at(0),
                to: at(1000),
                known: at(second),
                most: 10,
            };
            let values = store.values(&wanted).unwrap();
            let value = |one: &Value| (one.time.as_second(), one.value.round());
            values.iter().map(value).collect()
        };
        assert_eq!(known(199), [(100, 1000.0)]);
        assert_eq!(
            known(200),
            [(100, 1000.0), (150, 1500.0), (200, 2000.0)],
            "in mm"
        );
        assert_eq!(known(300), [(100, 1100.0), (150, 1500.0), (200, 2000.0)]);
        assert_eq!(store.newest_reading("5", at(160)).unwrap(), Some(at(150)));
    }
}
