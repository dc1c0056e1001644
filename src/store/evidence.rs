//! What one alert rests on: the step that called it, the settings in force then, who got it, and the state up to it.

use super::read::decode;
use super::{Store, StoreError, timestamp};
use crate::monitor::{Input, Settings};
use crate::reading::Timestamp;
use rusqlite::Connection;
use schemars::JsonSchema;
use serde::Serialize;
use std::fs::File;
use std::path::Path;

/// An event with its place in the state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlacedEvent {
    /// Its number.
    pub seq: i64,
    /// The number of the step that it followed from.
    pub step: i64,
    /// Its JSON.
    pub body: String,
}

/// How far one hook has got with one change of an alert.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
pub struct DeliveryRow {
    /// The hook's or webhook's name.
    pub hook: String,
    /// The level that was reported.
    pub level: String,
    /// `firing`, `resolved` or `correction`.
    pub state: String,
    /// `waiting`, `delivered`, `over`, `dead`, `closed`, `acknowledged` or `silenced`.
    pub status: String,
    /// Attempts that have ended.
    pub attempts: u32,
}

impl Store {
    /// Every event of `kind` but refits, oldest first, with its place.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn placed_events(&self, kind: &str) -> Result<Vec<PlacedEvent>, StoreError> {
        // The second condition lets SQLite use the index of all events but refits.
        let query =
            "SELECT seq, step, body FROM event WHERE kind = ?1 AND kind != 'refit' ORDER BY seq";
        self.rows(query, [kind], |row| {
            Ok(PlacedEvent {
                seq: row.get(0)?,
                step: row.get(1)?,
                body: row.get(2)?,
            })
        })
    }

    /// The settings that were in force at a step; `None` where none had been given yet.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn settings_at(&self, step: i64) -> Result<Option<Settings>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT body FROM step WHERE seq <= ?1 AND body IS NOT NULL ORDER BY seq DESC",
        )?;
        let mut rows = query.query([step])?;
        while let Some(row) = rows.next()? {
            if let Input::Settings(settings) = decode(row.get(0)?)? {
                return Ok(Some(*settings));
            }
        }
        Ok(None)
    }

    /// The deliveries that were closed because nothing would have made them, as (hook, key, level, state), the
    /// oldest first.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn closed_deliveries(&self) -> Result<Vec<[String; 4]>, StoreError> {
        let query =
            "SELECT hook, key, level, state FROM outbox WHERE status = 'closed' ORDER BY id";
        self.rows(query, [], |row| {
            Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?])
        })
    }

    /// How many deliveries wait, and when the oldest of their alerts was called; of those to the hooks of `later`, which wait on purpose, only where
    /// one has been tried.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn outbox(&self, later: &[String]) -> Result<(usize, Option<Timestamp>), StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT hook, attempts > 0, count(*), min(time) FROM outbox WHERE status = 'waiting' GROUP BY 1, 2",
        )?;
        let rows = query.query_map([], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))
        })?;
        let (mut total, mut oldest) = (0, None);
        for row in rows {
            let (hook, is_tried, count, time): (String, bool, i64, i64) = row?;
            total += count;
            if is_tried || !later.contains(&hook) {
                oldest = Some(oldest.map_or(time, |before: i64| before.min(time)));
            }
        }
        let oldest = oldest.map(timestamp).transpose()?;
        Ok((usize::try_from(total).unwrap_or(0), oldest))
    }

    /// Who is to get an alert, and how far that has come, in the order in which it was noted.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn deliveries_of(&self, key: &str) -> Result<Vec<DeliveryRow>, StoreError> {
        let query =
            "SELECT hook, level, state, status, attempts FROM outbox WHERE key = ?1 ORDER BY id";
        self.rows(query, [key], |row| {
            Ok(DeliveryRow {
                hook: row.get(0)?,
                level: row.get(1)?,
                state: row.get(2)?,
                status: row.get(3)?,
                attempts: row.get(4)?,
            })
        })
    }

    /// Writes to `file`, which is not there yet, a state that holds the steps up to number `step` and nothing else: what a replay
    /// of the state needs to come to the same events.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn copy_steps(&self, step: i64, file: &Path) -> Result<(), StoreError> {
        self.backup(file)?;
        let copy = Connection::open(file)?;
        copy.execute("DELETE FROM step WHERE seq > ?1", [step])?;
        copy.execute_batch(
            "DELETE FROM event; DELETE FROM latest; DELETE FROM position; DELETE FROM memory;
             DELETE FROM outbox; DELETE FROM thinned; DELETE FROM command; DELETE FROM meta;
             DELETE FROM used_link; DELETE FROM broker_session;
             VACUUM;",
        )?;
        drop(copy);
        File::open(file)?.sync_all()?;
        Ok(())
    }
}
