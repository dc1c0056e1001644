//! Each row of what was taken in, said and is to be delivered is compared with its sum, piece by piece.

use super::sum::is_whole;
use super::{Store, StoreError, latest, outbox, series};
use rusqlite::{Connection, Row};

/// Rows that are looked at in one go.
const PIECE: i64 = 2000;

/// Whether a row is what was written.
type IsWhole = fn(&Row<'_>) -> Result<bool, StoreError>;

/// The rows of each table, and how they are looked at.
const TABLES: [(&str, &str, IsWhole); 5] = [
    ("series", series::ROWS, |row| {
        Ok(series::is_as_written(row)?)
    }),
    ("latest", latest::ROWS, |row| {
        Ok(latest::is_as_written(row)?)
    }),
    (
        "step",
        "SELECT seq, now, series, time, value, sigma, body, sum FROM step
         WHERE seq > ?1 AND sum IS NOT NULL ORDER BY seq LIMIT ?2",
        |row| Ok(is_whole(row, 0..7)?),
    ),
    (
        "event",
        "SELECT seq, step, time, kind, benchmark, body, sum FROM event
         WHERE seq > ?1 AND sum IS NOT NULL ORDER BY seq LIMIT ?2",
        |row| Ok(is_whole(row, 0..6)?),
    ),
    (
        "outbox",
        "SELECT id, key, level, state, hook, time, body, status, attempts, sum FROM outbox
         WHERE id > ?1 ORDER BY id LIMIT ?2",
        |row| Ok(outbox::body(row)?.is_some() && outbox::stands_as_written(row)?),
    ),
];

/// How far the rows have been looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Verified {
    table: usize,
    after: i64,
}

impl Store {
    /// Looks at the next rows, from the beginning again where it came to the end; whether it did.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] where a row is not what was written.
    pub fn verify(&self, verified: &mut Verified) -> Result<bool, StoreError> {
        let inner = self.inner();
        if let Some(after) = piece(&inner.connection, *verified)? {
            verified.after = after;
            return Ok(false);
        }
        let is_last = verified.table + 1 == TABLES.len();
        *verified = Verified {
            table: if is_last { 0 } else { verified.table + 1 },
            after: 0,
        };
        Ok(is_last)
    }
}

/// The number of the last row of the next piece; `None` where there are no more behind it, but those that come meanwhile.
fn piece(connection: &Connection, verified: Verified) -> Result<Option<i64>, StoreError> {
    let (table, query, is_whole) = TABLES[verified.table];
    let mut query = connection.prepare_cached(query)?;
    let mut rows = query.query([verified.after, PIECE])?;
    let (mut last, mut count) = (None, 0);
    while let Some(row) = rows.next()? {
        let number = row.get_ref(0)?;
        if !is_whole(row)? {
            let detail = format!("row {number:?} of the table {table} is not what was written");
            return Err(StoreError::Damaged { detail });
        }
        last = Some(row.get(0)?);
        count += 1;
    }
    Ok(last.filter(|_| count == PIECE))
}
