//! What goes with time: older refits but for the first of each day and those on which alerts rest, and the deliveries of alerts that are over.

use super::{Store, StoreError, nanoseconds, read};
use crate::reading::Timestamp;
use rusqlite::{Connection, OptionalExtension, TransactionBehavior, params};
use std::collections::BTreeMap;

/// Rows that go in one commit at most.
const PIECE: i64 = 5000;
const DAY_NS: i64 = 86_400_000_000_000;
/// The number of the last refit that was looked at.
const THINNED_TO: &str = "thinned_to";
/// The day up to which the outbox was looked through.
const OUTBOX_TO: &str = "outbox_thinned_to";

/// A refit that is looked at.
#[derive(Debug)]
struct Refit {
    seq: i64,
    day: i64,
    benchmark: String,
}

impl Store {
    /// Of the refits before `before` (data time) keeps the first of each UTC day and benchmark and those on which an alert rests, and drops deliveries
    /// that are done of alerts that ended before it: a piece in one commit. Returns whether there may be more. It goes
    /// on where it was, after a restart too. Steps and all other events stay.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn thin(&self, before: Timestamp) -> Result<bool, StoreError> {
        // Before the first value, data time is at the beginning of all that can be kept.
        let Ok(before) = nanoseconds(before) else {
            return Ok(false);
        };
        let mut inner = self.inner();
        let newest = inner.events;
        let refits = old_refits(&inner.connection, before, newest)?;
        let Some(last) = refits.last().map(|refit| refit.seq) else {
            return thin_outbox(&inner.connection, before);
        };
        let is_full_piece = i64::try_from(refits.len()).unwrap_or(PIECE) >= PIECE;
        let transaction =
            (inner.connection).transaction_with_behavior(TransactionBehavior::Immediate)?;
        let mut kept = kept_days(&transaction)?;
        let mut fresh = BTreeMap::new();
        for Refit {
            seq,
            day,
            benchmark,
        } in refits
        {
            let is_kept = kept.get(&benchmark) == Some(&day);
            if is_kept && !carries_an_alert(&transaction, seq, &benchmark)? {
                transaction
                    .prepare_cached("DELETE FROM event WHERE seq = ?1")?
                    .execute([seq])?;
            } else if !is_kept {
                kept.insert(benchmark.clone(), day);
                fresh.insert(benchmark, day);
            }
        }
        for (benchmark, day) in fresh {
            transaction
                .prepare_cached("INSERT OR REPLACE INTO thinned (benchmark, day) VALUES (?1, ?2)")?
                .execute(params![benchmark, day])?;
        }
        note(&transaction, THINNED_TO, last)?;
        transaction.commit()?;
        Ok(is_full_piece)
    }
}

/// The next refits that are old enough. Never the newest event: its number is not to be given twice.
fn old_refits(connection: &Connection, before: i64, newest: i64) -> Result<Vec<Refit>, StoreError> {
    let after = read::meta(connection, THINNED_TO)?.unwrap_or(0);
    let mut query = connection.prepare_cached(
        "SELECT seq, time, benchmark FROM event WHERE seq > ?1 AND seq < ?2 AND kind = 'refit' ORDER BY seq LIMIT ?3",
    )?;
    let mut rows = query.query([after, newest, PIECE])?;
    let mut refits = Vec::new();
    while let Some(row) = rows.next()? {
        let time: i64 = row.get(1)?;
        if time >= before {
            break;
        }
        refits.push(Refit {
            seq: row.get(0)?,
            day: time.div_euclid(DAY_NS),
            benchmark: row.get::<_, Option<String>>(2)?.unwrap_or_default(),
        });
    }
    Ok(refits)
}

/// Whether an alert of the benchmark rests on this refit: it comes before the next one.
fn carries_an_alert(
    connection: &Connection,
    seq: i64,
    benchmark: &str,
) -> Result<bool, StoreError> {
    // In the order of their numbers: an index of the benchmark would have all of its refits sorted.
    let mut query = connection.prepare_cached(
        "SELECT kind FROM event NOT INDEXED WHERE seq > ?1 AND benchmark = ?2 AND kind IN ('refit', 'alert') ORDER BY seq LIMIT 1",
    )?;
    let next: Option<String> =
        (query.query_row(params![seq, benchmark], |row| row.get(0))).optional()?;
    Ok(next.is_some_and(|kind| kind == "alert"))
}

/// A benchmark's refits come in the order of their times: its last day is all there is to know.
fn kept_days(connection: &Connection) -> Result<BTreeMap<String, i64>, StoreError> {
    let mut query = connection.prepare_cached("SELECT benchmark, day FROM thinned")?;
    let rows = query.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// Once for each day of data time. An alert that has not ended stays, however old: whether a hook has been notified of it
/// is asked at every start; so does one of which a hook waits or was given up.
fn thin_outbox(connection: &Connection, before: i64) -> Result<bool, StoreError> {
    let day = before.div_euclid(DAY_NS);
    if read::meta(connection, OUTBOX_TO)?.is_some_and(|to| to >= day) {
        return Ok(false);
    }
    let gone = connection.execute(
        "DELETE FROM outbox WHERE id IN (
             SELECT id FROM outbox AS own WHERE time < ?1
             AND EXISTS (SELECT 1 FROM outbox WHERE key = own.key AND state = 'resolved' AND time < ?1)
             AND NOT EXISTS (SELECT 1 FROM outbox WHERE key = own.key AND status NOT IN ('delivered', 'over', 'closed', 'acknowledged', 'silenced'))
             LIMIT ?2)",
        [before, PIECE],
    )?;
    let is_full_piece = i64::try_from(gone).unwrap_or(PIECE) >= PIECE;
    if !is_full_piece {
        note(connection, OUTBOX_TO, day)?;
    }
    Ok(is_full_piece)
}

fn note(connection: &Connection, name: &str, value: i64) -> Result<(), StoreError> {
    connection
        .prepare_cached("INSERT OR REPLACE INTO meta (name, value) VALUES (?1, ?2)")?
        .execute(params![name, value])?;
    Ok(())
}
