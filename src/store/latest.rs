//! The newest event of each kind at each benchmark: what is asked for without going through all events.

use super::sum::{self, is_whole, sum};
use super::{Store, StoreError};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row, params};
use std::ops::Range;

/// Rows after a number, so many, each with its sum behind its values.
pub(super) const ROWS: &str = "SELECT rowid, benchmark, kind, body, sum FROM latest
     WHERE rowid > ?1 ORDER BY rowid LIMIT ?2";
/// The columns of [`ROWS`] whose values the sum is over.
const SUMMED: Range<usize> = 1..4;

impl Store {
    /// The JSON of the newest event of `kind` at each benchmark.
    ///
    /// # Errors
    /// [`StoreError`]; where one is not what was written, [`StoreError::Damaged`].
    pub fn latest(&self, kind: &str) -> Result<Vec<String>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT rowid, benchmark, kind, body, sum FROM latest WHERE kind = ?1 ORDER BY benchmark",
        )?;
        let mut rows = query.query([kind])?;
        let mut bodies = Vec::new();
        while let Some(row) = rows.next()? {
            if !is_as_written(row)? {
                let number = row.get_ref(0)?;
                let detail = format!("row {number:?} of the table latest is not what was written");
                return Err(StoreError::Damaged { detail });
            }
            bodies.push(row.get(3)?);
        }
        Ok(bodies)
    }
}

/// Whether a row of [`ROWS`] is what was written. Its number changes with each newer event, and is not in the sum.
pub(super) fn is_as_written(row: &Row<'_>) -> rusqlite::Result<bool> {
    is_whole(row, SUMMED)
}

/// Gives each row its sum, taken for what was written.
pub(super) fn seal_all(connection: &Connection) -> Result<(), StoreError> {
    let update = "UPDATE latest SET sum = ?2 WHERE rowid = ?1";
    sum::seal_all(connection, ROWS, &SUMMED, update)
}

/// Keeps the newest event of a kind at a benchmark.
pub(super) fn keep(
    connection: &Connection,
    benchmark: &str,
    kind: &str,
    body: &str,
) -> Result<(), StoreError> {
    let sum = sum(&[benchmark, kind, body].map(|text| ValueRef::Text(text.as_bytes())));
    connection
        .prepare_cached(
            "INSERT OR REPLACE INTO latest (benchmark, kind, body, sum) VALUES (?1, ?2, ?3, ?4)",
        )?
        .execute(params![benchmark, kind, body, sum])?;
    Ok(())
}
