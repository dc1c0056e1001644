//! What a restart, a replay of the stored input, and people who ask read back.

use super::sealed::unseal;
use super::series::{Catalogue, StoredSeries};
use super::{Store, StoreError, access, timestamp};
use crate::monitor::{Input, MemoryPart, Notice, Order, SearchFinding, Settings, from_bytes};
use crate::reading::{BenchmarkId, Reading, Sample, Timestamp};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row, params};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Steps read at once.
const CHUNK: i64 = 4096;

/// How the names of counts of what could not be used begin.
const QUARANTINED: &str = "quarantined/";

/// One step as it stands in the state.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRow {
    /// Its number.
    pub seq: i64,
    /// Data time.
    pub now: Timestamp,
    /// What the monitor was given.
    pub input: Input,
}

/// What a restart goes on from.
#[derive(Debug, Default)]
pub struct Recorded {
    /// The monitor's memory; empty where there is none.
    pub parts: Vec<MemoryPart>,
    /// As of which step.
    pub step: i64,
}

/// An order that has been left in the state.
#[derive(Debug, Clone)]
pub struct LeftOrder {
    /// Its number; 0 of one that came by another way.
    pub number: i64,
    /// What people ask for.
    pub order: Order,
    /// The number of the newest event when it was given; `None` of a link, which names its alert, and where an older version
    /// left it.
    pub last_event: Option<i64>,
}

/// What stands beside an order that has been left.
#[derive(Deserialize)]
struct OrderPlace {
    #[serde(default)]
    last_event: Option<i64>,
}

/// A step that is no value.
#[derive(Serialize, Deserialize)]
enum StoredInput {
    Settings(Box<Settings>),
    Found(Box<SearchFinding>),
    Order(Order),
    Missing(BenchmarkId, Timestamp, String),
    Trouble(String, String),
    Notice(Notice),
}

/// `None` where only time has passed.
pub(super) fn encode(input: &Input) -> Result<Option<Vec<u8>>, StoreError> {
    let stored = match input {
        Input::Settings(settings) => StoredInput::Settings(settings.clone()),
        Input::Found(finding) => StoredInput::Found(Box::new(finding.clone())),
        Input::Order(order) => StoredInput::Order(order.clone()),
        Input::Missing {
            benchmark,
            time,
            what,
        } => StoredInput::Missing(benchmark.clone(), *time, what.clone()),
        Input::Trouble { kind, text } => StoredInput::Trouble(kind.clone(), text.clone()),
        Input::Notice(notice) => StoredInput::Notice(notice.clone()),
        Input::Tick | Input::Reading { .. } | Input::Sample { .. } => return Ok(None),
    };
    let body = rmp_serde::to_vec_named(&stored);
    body.map(Some)
        .map_err(|error| StoreError::Unreadable(error.to_string()))
}

pub(super) fn decode(body: Option<Vec<u8>>) -> Result<Input, StoreError> {
    let Some(body) = body else {
        return Ok(Input::Tick);
    };
    let stored = from_bytes(&body);
    Ok(
        match stored.map_err(|error| StoreError::Unreadable(error.to_string()))? {
            StoredInput::Settings(settings) => Input::Settings(settings),
            StoredInput::Found(finding) => Input::Found(*finding),
            StoredInput::Order(order) => Input::Order(order),
            StoredInput::Missing(benchmark, time, what) => Input::Missing {
                benchmark,
                time,
                what,
            },
            StoredInput::Trouble(kind, text) => Input::Trouble { kind, text },
            StoredInput::Notice(notice) => Input::Notice(notice),
        },
    )
}

impl Store {
    /// The memory last saved.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn memory(&self) -> Result<Recorded, StoreError> {
        let inner = self.inner();
        let mut query = inner
            .connection
            .prepare("SELECT name, body FROM memory ORDER BY name")?;
        let mut rows = query.query([])?;
        let mut parts = Vec::new();
        while let Some(row) = rows.next()? {
            let (name, body) = named(row)?;
            if body.is_none() {
                tracing::warn!(
                    name,
                    "this part of the saved state is damaged: it is computed again"
                );
                return Ok(Recorded::default());
            }
            parts.push(MemoryPart { name, body });
        }
        let step = meta(&inner.connection, "memory_step")?.unwrap_or(0);
        Ok(Recorded { parts, step })
    }

    /// The positions of the files.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn positions(&self) -> Result<Vec<(String, Vec<u8>)>, StoreError> {
        let inner = self.inner();
        let mut query = inner
            .connection
            .prepare("SELECT name, body FROM position")?;
        let mut rows = query.query([])?;
        let mut positions = Vec::new();
        while let Some(row) = rows.next()? {
            match named(row)? {
                (name, Some(body)) => positions.push((name, body)),
                (name, None) => {
                    tracing::warn!(
                        name,
                        "how far it was read is not what was written: from its start again"
                    );
                }
            }
        }
        Ok(positions)
    }

    /// The next few steps after number `after`, in their order; none at the end.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn steps(&self, after: i64) -> Result<Vec<StepRow>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT seq, now, series, time, value, sigma, body FROM step WHERE seq > ?1 ORDER BY seq LIMIT ?2",
        )?;
        let mut rows = query.query(params![after, CHUNK])?;
        let mut steps = Vec::new();
        // Whoever looks on while a daemon writes meets series that it has added since.
        let mut newer: Option<Catalogue> = None;
        while let Some(row) = rows.next()? {
            let (seq, now): (i64, Option<i64>) = (row.get(0)?, row.get(1)?);
            let (now, input) = match row.get::<_, Option<i64>>(2)? {
                None => {
                    let now = now.ok_or_else(|| lost(seq))?;
                    (timestamp(now)?, decode(row.get(6)?)?)
                }
                Some(number) => {
                    if inner.catalogue.get(number).is_none() && newer.is_none() {
                        newer = Some(Catalogue::load(&inner.connection)?);
                    }
                    let added = || newer.as_ref()?.get(number);
                    let series = inner.catalogue.get(number).or_else(added);
                    let series = series.ok_or_else(|| lost(seq))?;
                    let time = timestamp(row.get(3)?)?;
                    let input = input(series, time, row.get(4)?, row.get(5)?);
                    (now.map_or(Ok(time), timestamp)?, input)
                }
            };
            steps.push(StepRow { seq, now, input });
        }
        Ok(steps)
    }

    /// Every benchmark that has given readings, with the time of its newest one.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn benchmarks(&self) -> Result<BTreeMap<BenchmarkId, Timestamp>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT name, (SELECT max(time) FROM step WHERE series = series.id) FROM series WHERE is_reading",
        )?;
        let mut rows = query.query([])?;
        let mut newest = BTreeMap::new();
        while let Some(row) = rows.next()? {
            let (name, time): (String, Option<i64>) = (row.get(0)?, row.get(1)?);
            if let Some(time) = time.map(timestamp).transpose()? {
                let known = newest.entry(BenchmarkId::new(name)).or_insert(time);
                *known = time.max(*known);
            }
        }
        Ok(newest)
    }

    /// How many readings it holds of every benchmark.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn counts_of_readings(&self) -> Result<BTreeMap<BenchmarkId, u64>, StoreError> {
        let query = "SELECT name, (SELECT count(*) FROM step WHERE series = series.id) FROM series
             WHERE is_reading";
        let mut counts = BTreeMap::new();
        for (name, count) in self.rows(query, [], name_and_count)? {
            *counts.entry(BenchmarkId::new(name)).or_default() += u64::try_from(count).unwrap_or(0);
        }
        Ok(counts)
    }

    /// The next few of what people have asked for and the daemon has not taken yet, but what cannot be read of it.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn orders(&self) -> Result<Vec<LeftOrder>, StoreError> {
        let left = self.commands()?.into_iter();
        Ok(left
            .filter_map(|(number, body)| left_order(number, &body).ok())
            .collect())
    }

    /// Deletes what cannot be read of those orders, so that others come within the next few: whoever gave it must not end the daemon by it, at
    /// each start anew.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn delete_unreadable_orders(&self) -> Result<(), StoreError> {
        for (number, body) in self.commands()? {
            if let Err(error) = left_order(number, &body) {
                tracing::error!(%error, order = body, "an order that cannot be read is left out");
                let delete = "DELETE FROM command WHERE id = ?1";
                self.inner().connection.execute(delete, [number])?;
            }
        }
        Ok(())
    }

    /// The number and the JSON of the next few orders.
    fn commands(&self) -> Result<Vec<(i64, String)>, StoreError> {
        let query = "SELECT id, body FROM command ORDER BY id LIMIT ?1";
        self.rows(query, [CHUNK], |row| Ok((row.get(0)?, row.get(1)?)))
    }

    /// Leaves an order for the daemon, which takes it within a second, or at its next start, with how far the events have got, or had when
    /// whoever gives it looked: number `seen`. What is called after that, they have not seen.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn ask(&self, order: &Order, seen: Option<i64>) -> Result<(), StoreError> {
        let body = serde_json::to_string(order);
        let body = body.map_err(|error| StoreError::Unreadable(error.to_string()))?;
        let inner = self.inner();
        let connection = &inner.connection;
        let written = connection.execute(
            "INSERT INTO command (body) VALUES
             (json_insert(?1, '$.last_event', min(?2, (SELECT coalesce(max(seq), 0) FROM event))))",
            params![body, seen.unwrap_or(i64::MAX)],
        );
        let folder = connection.path().map(Path::new).and_then(Path::parent);
        match (written, folder) {
            (Ok(_), _) => Ok(()),
            (Err(error), Some(folder)) => Err(access::explained(error.into(), folder)),
            (Err(error), None) => Err(error.into()),
        }
    }

    /// Lines, records and files that could not be used, a source, since the state began.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn quarantined(&self) -> Result<BTreeMap<String, u64>, StoreError> {
        let query = "SELECT name, value FROM meta WHERE name LIKE ?1 || '%'";
        let mut counts = BTreeMap::new();
        for (name, count) in self.rows(query, [QUARANTINED], name_and_count)? {
            let source = name.strip_prefix(QUARANTINED).unwrap_or(&name).to_owned();
            counts.insert(source, u64::try_from(count).unwrap_or(0));
        }
        Ok(counts)
    }

    /// Notes how many there are by now.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn note_quarantined(&self, counts: &BTreeMap<String, u64>) -> Result<(), StoreError> {
        let inner = self.inner();
        for (source, count) in counts {
            let count = i64::try_from(*count).unwrap_or(i64::MAX);
            inner.connection.execute(
                "INSERT OR REPLACE INTO meta (name, value) VALUES (?1, ?2)",
                params![format!("{QUARANTINED}{source}"), count],
            )?;
        }
        Ok(())
    }

    /// The number of the last step.
    pub fn last_step(&self) -> i64 {
        self.inner().steps
    }

    /// The number of the newest event that is written by now.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn newest_event(&self) -> Result<i64, StoreError> {
        let query = "SELECT coalesce(max(seq), 0) FROM event";
        Ok(self
            .inner()
            .connection
            .query_row(query, [], |row| row.get(0))?)
    }

    /// The number of the last event.
    pub fn last_event(&self) -> i64 {
        self.inner().events
    }

    /// Events after number `after`, of `kind` and `benchmark` where these are given, as (number, JSON): the next few.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn events(
        &self,
        after: i64,
        kind: Option<&str>,
        benchmark: Option<&str>,
    ) -> Result<Vec<(i64, String)>, StoreError> {
        let query = "SELECT seq, body FROM event WHERE seq > ?1 AND (?2 IS NULL OR kind = ?2)
             AND (?3 IS NULL OR benchmark = ?3) ORDER BY seq LIMIT ?4";
        self.rows(query, params![after, kind, benchmark, CHUNK], |row| {
            Ok((row.get(0)?, row.get(1)?))
        })
    }
}

fn name_and_count(row: &Row<'_>) -> rusqlite::Result<(String, i64)> {
    Ok((row.get(0)?, row.get(1)?))
}

/// A name and what is kept under it; `None` where that is not what was written.
fn named(row: &Row<'_>) -> Result<(String, Option<Vec<u8>>), StoreError> {
    let name: String = row.get(0)?;
    let sealed: Vec<u8> = row.get(1)?;
    let body = unseal(&[ValueRef::Text(name.as_bytes())], &sealed).map(<[u8]>::to_vec);
    Ok((name, body))
}

fn lost(seq: i64) -> StoreError {
    StoreError::Damaged {
        detail: format!("step {seq} is incomplete"),
    }
}

fn input(series: &StoredSeries, time: Timestamp, value: f64, sigma: Option<f64>) -> Input {
    match series {
        StoredSeries::Channel(channel, unit) => Input::Sample {
            channel: channel.clone(),
            unit: unit.clone(),
            sample: Sample { time, value },
        },
        StoredSeries::Benchmark(benchmark, unit, averaging) => Input::Reading {
            benchmark: benchmark.clone(),
            unit: *unit,
            averaging: *averaging,
            reading: Reading { time, value, sigma },
        },
    }
}

pub(super) fn meta(connection: &Connection, name: &str) -> Result<Option<i64>, StoreError> {
    let mut query = connection.prepare_cached("SELECT value FROM meta WHERE name = ?1")?;
    let mut rows = query.query([name])?;
    Ok(rows.next()?.map(|row| row.get(0)).transpose()?)
}

fn left_order(number: i64, body: &str) -> Result<LeftOrder, serde_json::Error> {
    let place: OrderPlace = serde_json::from_str(body)?;
    Ok(LeftOrder {
        number,
        order: serde_json::from_str(body)?,
        last_event: place.last_event,
    })
}
