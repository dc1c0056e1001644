//! The tables, their version, and what is refused.

use super::{StoreError, latest, series};
use rusqlite::Connection;

/// Marks the file as ours: "slip".
const APPLICATION: i32 = 0x736c_6970;

/// One step for each version: `MIGRATIONS[n]` leads from version n to n + 1.
const MIGRATIONS: [&str; 8] = ["
    CREATE TABLE series (
        id INTEGER PRIMARY KEY,
        -- 0: a covariate; 1: readings of a benchmark
        is_reading INTEGER NOT NULL,
        name TEXT NOT NULL,
        unit TEXT,
        -- nanoseconds of the mean, of velocities
        averaging INTEGER
    ) STRICT;
    -- What the monitor was told, in the order in which it was: the truth from which everything else follows.
    CREATE TABLE step (
        seq INTEGER PRIMARY KEY,
        -- data time, nanoseconds since 1970; null: that of the value
        now INTEGER,
        -- with a series: a value of it
        series INTEGER REFERENCES series (id),
        time INTEGER,
        value REAL,
        sigma REAL,
        -- without: what else it was told, MessagePack; null: that time went by
        body BLOB
    ) STRICT;
    CREATE INDEX value_at ON step (series, time) WHERE series IS NOT NULL;
    CREATE TABLE event (
        seq INTEGER PRIMARY KEY,
        step INTEGER NOT NULL,
        time INTEGER NOT NULL,
        kind TEXT NOT NULL,
        benchmark TEXT,
        body TEXT NOT NULL
    ) STRICT;
    CREATE INDEX event_of ON event (kind, seq) WHERE kind != 'refit';
    -- The newest event of each kind at each benchmark.
    CREATE TABLE latest (
        benchmark TEXT NOT NULL,
        kind TEXT NOT NULL,
        body TEXT NOT NULL,
        PRIMARY KEY (benchmark, kind)
    ) STRICT;
    -- How far each file has been read, as of the last step.
    CREATE TABLE position (
        name TEXT PRIMARY KEY,
        body BLOB NOT NULL
    ) STRICT;
    -- A memory of the monitor as of one step: a cache of what the steps up to it lead to.
    CREATE TABLE memory (
        name TEXT PRIMARY KEY,
        body BLOB NOT NULL
    ) STRICT;
    CREATE TABLE outbox (
        id INTEGER PRIMARY KEY,
        key TEXT NOT NULL,
        level TEXT NOT NULL,
        state TEXT NOT NULL,
        hook TEXT NOT NULL,
        -- waiting, delivered, over, dead, closed, acknowledged
        status TEXT NOT NULL,
        attempts INTEGER NOT NULL DEFAULT 0,
        -- of the alert
        time INTEGER NOT NULL,
        body BLOB NOT NULL,
        UNIQUE (key, level, state, hook)
    ) STRICT;
    CREATE INDEX outbox_waiting ON outbox (id) WHERE status = 'waiting';
    -- The day, since 1970, of each benchmark's last refit that was kept where older ones are thinned.
    CREATE TABLE thinned (
        benchmark TEXT PRIMARY KEY,
        day INTEGER NOT NULL
    ) STRICT, WITHOUT ROWID;
    -- What people asked for beside the daemon; it takes them as steps.
    CREATE TABLE command (
        id INTEGER PRIMARY KEY,
        body TEXT NOT NULL
    ) STRICT;
    CREATE TABLE meta (
        name TEXT PRIMARY KEY,
        value INTEGER NOT NULL
    ) STRICT;
",
// Of all other columns; null in rows of the version before.
"
    ALTER TABLE step ADD COLUMN sum INTEGER;
    ALTER TABLE event ADD COLUMN sum INTEGER;
",
// What was said of a benchmark at a moment is looked up, however many events there are.
"
    CREATE INDEX event_at ON event (benchmark, kind, time);
",
// Of how a delivery stands: its status and attempts; null in rows of the version before.
"
    ALTER TABLE outbox ADD COLUMN sum INTEGER;
",
// When it was noted, nanoseconds since 1970 by the host's clock: what an escalation is counted from; null in rows of the
// version before.
"
    ALTER TABLE outbox ADD COLUMN noted INTEGER;
",
// Links that somebody has acknowledged an alert by, each until it would have expired, nanoseconds since 1970.
"
    CREATE TABLE used_link (
        link TEXT PRIMARY KEY,
        until INTEGER NOT NULL
    ) STRICT, WITHOUT ROWID;
",
// Of all other columns; what stands there by then is taken for what was written.
"
    ALTER TABLE series ADD COLUMN sum INTEGER;
    ALTER TABLE latest ADD COLUMN sum INTEGER;
",
// As whom the session with the broker of each source is held: it stays the same where the site is renamed.
"
    CREATE TABLE broker_session (
        source TEXT PRIMARY KEY,
        client TEXT NOT NULL
    ) STRICT, WITHOUT ROWID;
"];

/// From this version on each series, and each of the newest events, has a sum.
const SEALED: usize = 7;

/// The version that this program writes.
pub(super) const VERSION: usize = MIGRATIONS.len();

/// Brings the tables to [`VERSION`], or says why that cannot be.
pub(super) fn migrate(connection: &mut Connection) -> Result<(), StoreError> {
    let found = version(connection)?;
    if found == VERSION {
        return Ok(());
    }
    let transaction =
        connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
    for step in &MIGRATIONS[found..] {
        transaction.execute_batch(step)?;
    }
    if found < SEALED {
        series::seal_all(&transaction)?;
        latest::seal_all(&transaction)?;
    }
    transaction.pragma_update(None, "application_id", APPLICATION)?;
    let version = i64::try_from(VERSION).unwrap_or(i64::MAX);
    transaction.pragma_update(None, "user_version", version)?;
    transaction.commit()?;
    if found > 0 {
        tracing::info!(
            from = found,
            to = VERSION,
            "the state was brought to this version"
        );
    }
    Ok(())
}

/// The tables' version, 0 where there are none yet.
pub(super) fn version(connection: &Connection) -> Result<usize, StoreError> {
    let pragma = |name| connection.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
    let (application, version) = (pragma("application_id")?, pragma("user_version")?);
    let tables: i64 =
        connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
    if application != APPLICATION && tables > 0 {
        return Err(StoreError::Foreign);
    }
    let version = usize::try_from(version).unwrap_or(usize::MAX);
    if version > VERSION {
        return Err(StoreError::Newer { version });
    }
    Ok(version)
}
