//! One commit: the steps, what follows from them, and how far the files have been read.

use super::outbox::{DeliveryOutcome, WAITING};
use super::sealed::seal;
use super::series::{self, StoredSeries};
use super::sum::sum;
use super::{Inner, Store, StoreError, nanoseconds};
use crate::monitor::{Event, Input, MemoryPart};
use crate::reading::Timestamp;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, params};
use std::collections::BTreeMap;

/// How far one file has been read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Position {
    /// The source and the file.
    pub name: String,
    /// What its reader goes on from; `None`: it is gone.
    pub body: Option<Vec<u8>>,
}

/// What is written together.
#[derive(Debug, Default)]
pub struct Batch {
    /// Data time and what the monitor was given.
    steps: Vec<(Timestamp, Input)>,
    /// Each with the number of its step in this batch.
    events: Vec<(usize, Event)>,
    /// The values of the steps: what is known although it is not written yet.
    values: BTreeMap<(StoredSeries, Timestamp), f64>,
    /// Values that were corrected within this batch.
    former: BTreeMap<(StoredSeries, Timestamp), Vec<f64>>,
    positions: BTreeMap<String, Option<Vec<u8>>>,
    memory: Option<Vec<MemoryPart>>,
    outbox: Vec<super::Delivery>,
    /// What another alert reports to a hook too.
    reported_by_another: Vec<super::Delivery>,
    commands: Vec<i64>,
}

impl Batch {
    /// Notes a step and the events that followed from it.
    pub fn step(&mut self, now: Timestamp, input: &Input, events: &[Event]) {
        if let Some(measured) = input.measured() {
            let place = (StoredSeries::of(&measured), measured.time());
            if let Some(former) = self.values.insert(place.clone(), measured.value()) {
                self.former.entry(place).or_default().push(former);
            }
        }
        self.steps.push((now, input.clone()));
        let step = self.steps.len() - 1;
        self.events
            .extend(events.iter().map(|event| (step, event.clone())));
    }

    /// Notes how far a file has been read.
    pub fn position(&mut self, position: Position) {
        self.positions.insert(position.name, position.body);
    }

    /// Notes the monitor's memory as of the last step, where it is to be saved.
    pub fn memory(&mut self, parts: Option<Vec<MemoryPart>>) {
        self.memory = parts;
    }

    /// Everything is written: the next one begins.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Notes of what a hook is to be notified.
    pub fn deliver(&mut self, delivery: super::Delivery) {
        self.outbox.push(delivery);
    }

    /// Notes that another alert reports this to a hook too.
    pub fn tell_together(&mut self, delivery: super::Delivery) {
        self.reported_by_another.push(delivery);
    }

    /// Notes that a command has been taken.
    pub fn taken(&mut self, command: i64) {
        self.commands.push(command);
    }

    /// How many steps are in it.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Whether there is nothing to write.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
            && self.events.is_empty()
            && self.positions.is_empty()
            && self.memory.is_none()
            && self.outbox.is_empty()
            && self.reported_by_another.is_empty()
            && self.commands.is_empty()
    }

    /// The values that this batch has for the same series and time, the newest first.
    fn known(&self, series: &StoredSeries, time: Timestamp) -> Vec<f64> {
        let place = (series.clone(), time);
        let former = self.former.get(&place).into_iter().flatten().rev();
        let newest = self.values.get(&place).into_iter();
        newest.chain(former).copied().collect()
    }
}

/// Whether a value is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presence {
    /// It has not been taken.
    No,
    /// It has, and another one of its time was taken after it: either a file is read again, or it was corrected back.
    Corrected,
    /// It has, and is the last of its time.
    Yes,
}

impl Store {
    /// Writes the batch, all of it or nothing, and returns when it is on the disk.
    ///
    /// # Errors
    /// [`StoreError`]; where [`StoreError::is_full`], the same batch may be tried again.
    pub fn commit(&self, batch: &Batch) -> Result<(), StoreError> {
        let mut inner = self.inner();
        inner.trusted()?;
        if batch.is_empty() {
            return Ok(());
        }
        let written = inner.write(batch);
        inner.committed(batch.steps.len() + batch.events.len(), written)
    }

    /// Whether the value has been taken before: in `batch`, or in what is written.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn has(&self, batch: &Batch, input: &Input) -> Result<Presence, StoreError> {
        let Some(measured) = input.measured() else {
            return Ok(Presence::No);
        };
        let series = StoredSeries::of(&measured);
        let (time, value) = (measured.time(), measured.value());
        let in_batch = batch.known(&series, time);
        if (in_batch.first()).is_some_and(|known| known.to_bits() == value.to_bits()) {
            return Ok(Presence::Yes);
        }
        let inner = self.inner();
        let factor = match &series {
            StoredSeries::Benchmark(_, unit, _) => unit.factor(),
            StoredSeries::Channel(..) => 1.0,
        };
        let mut written: Vec<(i64, f64)> = Vec::new();
        for (number, own) in inner.catalogue.alike(&series) {
            let mut query = inner
                .connection
                .prepare_cached("SELECT seq, value FROM step WHERE series = ?1 AND time = ?2")?;
            let mut rows = query.query(params![number, nanoseconds(time)?])?;
            while let Some(row) = rows.next()? {
                let value: f64 = row.get(1)?;
                written.push((row.get(0)?, value * own));
            }
        }
        written.sort_by_key(|(seq, _)| std::cmp::Reverse(*seq));
        let in_batch = in_batch.into_iter().map(|known| known * factor);
        let mut all = in_batch.chain(written.into_iter().map(|(_, known)| known));
        let is_it = |known: f64| known.to_bits() == (value * factor).to_bits();
        Ok(match all.position(is_it) {
            None => Presence::No,
            Some(0) => Presence::Yes,
            Some(_) => Presence::Corrected,
        })
    }
}

impl Inner {
    /// All of the batch in one transaction.
    fn write(&mut self, batch: &Batch) -> Result<(), StoreError> {
        let Self {
            connection,
            catalogue,
            steps,
            events,
            ..
        } = self;
        let transaction =
            connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
        let mut fresh: BTreeMap<StoredSeries, i64> = BTreeMap::new();
        for series in batch
            .steps
            .iter()
            .filter_map(|(_, input)| input.measured())
            .map(|measured| StoredSeries::of(&measured))
        {
            if catalogue.number(&series).is_none() && !fresh.contains_key(&series) {
                let number = catalogue.next() + i64::try_from(fresh.len()).unwrap_or(i64::MAX);
                series::insert(&transaction, number, &series)?;
                fresh.insert(series, number);
            }
        }
        let number = |series: &StoredSeries| {
            catalogue
                .number(series)
                .or_else(|| fresh.get(series).copied())
        };
        let (mut last_step, mut last_event) = (*steps, *events);
        for (now, input) in &batch.steps {
            last_step += 1;
            insert_step(&transaction, last_step, *now, input, &number)?;
        }
        let mut latest = BTreeMap::new();
        for (step, event) in &batch.events {
            last_event += 1;
            let is_past = batch.steps[*step].1.makes_up(event);
            let step = *steps + 1 + i64::try_from(*step).unwrap_or(0);
            let body = insert_event(&transaction, (last_event, step), event)?;
            if let Some(benchmark) = &event.benchmark
                && !is_past
            {
                latest.insert((benchmark, event.kind.name()), body);
            }
        }
        for ((benchmark, kind), body) in latest {
            keep_latest(&transaction, (benchmark.as_str(), kind), &body)?;
        }
        for (name, body) in &batch.positions {
            keep(&transaction, "position", name, body.as_deref())?;
        }
        if let Some(parts) = &batch.memory {
            write_memory(&transaction, parts, last_step)?;
        }
        for delivery in &batch.outbox {
            delivery.insert(&transaction, WAITING)?;
        }
        for delivery in &batch.reported_by_another {
            delivery.insert(&transaction, DeliveryOutcome::Over.name())?;
        }
        for command in &batch.commands {
            transaction.execute("DELETE FROM command WHERE id = ?1", [command])?;
        }
        transaction.commit()?;
        (*steps, *events) = (last_step, last_event);
        for (series, number) in fresh {
            catalogue.note(number, series);
        }
        Ok(())
    }
}

fn insert_step(
    connection: &Connection,
    seq: i64,
    now: Timestamp,
    input: &Input,
    number: &dyn Fn(&StoredSeries) -> Option<i64>,
) -> Result<(), StoreError> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO step (seq, now, series, time, value, sigma, body, sum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
    )?;
    let (own, number, time, value, sigma, body) = if let Some(measured) = input.measured() {
        let own = (now != measured.time())
            .then(|| nanoseconds(now))
            .transpose()?;
        let time = nanoseconds(measured.time())?;
        let number = number(&StoredSeries::of(&measured));
        let value = Some(measured.value());
        (own, number, Some(time), value, measured.sigma(), None)
    } else {
        let body = super::read::encode(input)?;
        (Some(nanoseconds(now)?), None, None, None, None, body)
    };
    let integer = |value: Option<i64>| value.map_or(ValueRef::Null, ValueRef::Integer);
    let real = |value: Option<f64>| value.map_or(ValueRef::Null, ValueRef::Real);
    let sum = sum(&[
        ValueRef::Integer(seq),
        integer(own),
        integer(number),
        integer(time),
        real(value),
        real(sigma),
        body.as_deref().map_or(ValueRef::Null, ValueRef::Blob),
    ]);
    insert.execute(params![seq, own, number, time, value, sigma, body, sum])?;
    Ok(())
}

/// Returns the event's JSON.
fn insert_event(
    connection: &Connection,
    (seq, step): (i64, i64),
    event: &Event,
) -> Result<String, StoreError> {
    let body =
        serde_json::to_string(event).map_err(|error| StoreError::Unreadable(error.to_string()))?;
    let benchmark = event.benchmark.as_ref().map(ToString::to_string);
    let (time, kind) = (nanoseconds(event.time)?, event.kind.name());
    let named = benchmark.as_deref().map(str::as_bytes);
    let sum = sum(&[
        ValueRef::Integer(seq),
        ValueRef::Integer(step),
        ValueRef::Integer(time),
        ValueRef::Text(kind.as_bytes()),
        named.map_or(ValueRef::Null, ValueRef::Text),
        ValueRef::Text(body.as_bytes()),
    ]);
    connection
        .prepare_cached(
            "INSERT INTO event (seq, step, time, kind, benchmark, body, sum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
        )?
        .execute(params![seq, step, time, kind, benchmark, body, sum])?;
    Ok(body)
}

fn keep_latest(
    connection: &Connection,
    (benchmark, kind): (&str, &str),
    body: &str,
) -> Result<(), StoreError> {
    connection
        .prepare_cached(
            "INSERT OR REPLACE INTO latest (benchmark, kind, body) VALUES (?1, ?2, ?3)",
        )?
        .execute(params![benchmark, kind, body])?;
    Ok(())
}

fn write_memory(
    connection: &Connection,
    parts: &[MemoryPart],
    step: i64,
) -> Result<(), StoreError> {
    for MemoryPart { name, body } in parts {
        keep(connection, "memory", name, body.as_deref())?;
    }
    connection.execute(
        "INSERT OR REPLACE INTO meta (name, value) VALUES ('memory_step', ?1)",
        [step],
    )?;
    Ok(())
}

/// Keeps `body` under its name in `table`, or nothing.
fn keep(
    connection: &Connection,
    table: &str,
    name: &str,
    body: Option<&[u8]>,
) -> Result<(), StoreError> {
    let insert = format!("INSERT OR REPLACE INTO {table} (name, body) VALUES (?1, ?2)");
    let delete = format!("DELETE FROM {table} WHERE name = ?1");
    match body {
        Some(body) => connection.prepare_cached(&insert)?.execute(params![
            name,
            seal(&[ValueRef::Text(name.as_bytes())], body)
        ])?,
        None => connection.prepare_cached(&delete)?.execute([name])?,
    };
    Ok(())
}
