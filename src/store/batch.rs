//! One commit: the steps, what follows from them, and how far the files have been read.

use super::outbox::{DeliveryOutcome, WAITING};
use super::sealed::seal;
use super::series::{self, Catalogue, StoredSeries};
use super::sum::sum;
use super::{Inner, Store, StoreError, latest, nanoseconds};
use crate::monitor::{Event, Input, Measured, MemoryPart};
use crate::reading::{BenchmarkId, Timestamp};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Statement, params};
use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

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
    /// Of each step the one before it with a value of the same name and time.
    before: Vec<Option<usize>>,
    /// The last step with a value of a name and time, by their hash: what is known although it is not written yet.
    latest: HashMap<u64, usize>,
    /// From which step on values of these benchmarks are known.
    forgotten: BTreeMap<BenchmarkId, usize>,
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
        let step = self.steps.len();
        let before = input
            .measured()
            .and_then(|measured| self.latest.insert(place(&measured), step));
        self.before.push(before);
        self.steps.push((now, input.clone()));
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
    pub fn deliver_together(&mut self, delivery: super::Delivery) {
        self.reported_by_another.push(delivery);
    }

    /// Notes that a command has been taken.
    pub fn taken(&mut self, command: i64) {
        self.commands.push(command);
    }

    /// Whether that command has been taken.
    pub fn has_taken(&self, command: i64) -> bool {
        self.commands.contains(&command)
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

    /// What this batch has of the benchmark so far is not known any more: its readings come again, and count again.
    pub fn forget(&mut self, benchmark: &BenchmarkId) {
        self.forgotten.insert(benchmark.clone(), self.steps.len());
    }

    /// The values that this batch has for the same series and time, the newest first.
    pub(super) fn known(&self, measured: &Measured<'_>) -> Vec<f64> {
        let from = match measured {
            Measured::Reading { benchmark, .. } => self.forgotten.get(*benchmark).copied(),
            Measured::Sample { .. } => None,
        };
        let (series, from) = (StoredSeries::of(measured), from.unwrap_or(0));
        let mut values = Vec::new();
        let mut next = self.latest.get(&place(measured)).copied();
        while let Some(step) = next.filter(|step| *step >= from) {
            // Others may have the same hash.
            let own = self.steps[step].1.measured();
            let own = own.filter(|own| own.time() == measured.time() && series.is_of(own));
            values.extend(own.map(|own| own.value()));
            next = self.before[step];
        }
        values
    }
}

/// Of a value's name and time.
fn place(measured: &Measured<'_>) -> u64 {
    let mut hasher = DefaultHasher::new();
    match measured {
        Measured::Reading { benchmark, .. } => benchmark.hash(&mut hasher),
        Measured::Sample { channel, .. } => channel.hash(&mut hasher),
    }
    measured.time().hash(&mut hasher);
    hasher.finish()
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

    /// Keeps all of the monitor's memory as of an earlier `step`, in place of what was kept.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn replace_memory(&self, parts: &[MemoryPart], step: i64) -> Result<(), StoreError> {
        let mut inner = self.inner();
        let immediate = rusqlite::TransactionBehavior::Immediate;
        let transaction = inner.connection.transaction_with_behavior(immediate)?;
        transaction.execute("DELETE FROM memory", [])?;
        write_memory(&transaction, parts, step)?;
        transaction.commit()?;
        Ok(())
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
        let mut fresh = Catalogue::default();
        let last_step = insert_steps(&transaction, *steps, batch, catalogue, &mut fresh)?;
        let mut last_event = *events;
        let mut newest = BTreeMap::new();
        for (step, event) in &batch.events {
            last_event += 1;
            let is_past = batch.steps[*step].1.makes_up(event);
            let step = *steps + 1 + i64::try_from(*step).unwrap_or(0);
            let body = insert_event(&transaction, last_event, step, event)?;
            if let Some(benchmark) = &event.benchmark
                && !is_past
            {
                newest.insert((benchmark, event.kind.name()), body);
            }
        }
        for ((benchmark, kind), body) in newest {
            latest::keep(&transaction, benchmark.as_str(), kind, &body)?;
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
        catalogue.append(fresh);
        Ok(())
    }
}

/// Writes the steps of `batch` behind number `last`, with the series that are not in `catalogue` yet: these into `fresh`
/// too. The number of the last.
fn insert_steps(
    connection: &Connection,
    mut last: i64,
    batch: &Batch,
    catalogue: &Catalogue,
    fresh: &mut Catalogue,
) -> Result<i64, StoreError> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO step (seq, now, series, time, value, sigma, body, sum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
    )?;
    for (now, input) in &batch.steps {
        let number = match input.measured() {
            None => None,
            Some(measured) => {
                let known = catalogue.number_of(&measured);
                Some(match known.or_else(|| fresh.number_of(&measured)) {
                    Some(number) => number,
                    None => add_series(connection, &measured, catalogue, fresh)?,
                })
            }
        };
        last += 1;
        insert_step(&mut insert, last, *now, input, number)?;
    }
    Ok(last)
}

/// Writes the series of a value, which is not known yet; its number.
fn add_series(
    connection: &Connection,
    measured: &Measured<'_>,
    catalogue: &Catalogue,
    fresh: &mut Catalogue,
) -> Result<i64, StoreError> {
    let number = catalogue.next() + i64::try_from(fresh.len()).unwrap_or(i64::MAX);
    let series = StoredSeries::of(measured);
    series::insert(connection, number, &series)?;
    fresh.note(number, series);
    Ok(number)
}

fn insert_step(
    insert: &mut Statement<'_>,
    seq: i64,
    now: Timestamp,
    input: &Input,
    number: Option<i64>,
) -> Result<(), StoreError> {
    let (own, time, value, sigma, body) = if let Some(measured) = input.measured() {
        let own = (now != measured.time())
            .then(|| nanoseconds(now))
            .transpose()?;
        let time = nanoseconds(measured.time())?;
        let value = Some(measured.value());
        (own, Some(time), value, measured.sigma(), None)
    } else {
        let body = super::read::encode(input)?;
        (Some(nanoseconds(now)?), None, None, None, body)
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
    seq: i64,
    step: i64,
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
