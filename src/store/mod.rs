//! The site's memory on disk: SQLite, one transaction for each batch.
//!
//! The steps are the truth: every input that the monitor was given, in its order. Events, the monitor's memory and
//! the outbox follow from them and are written with them, and so is how far each file has been read: nothing is
//! acknowledged before it, and a restart goes on exactly where the last commit left off.

mod access;
mod again;
mod batch;
mod broker;
mod checkpoint;
mod evidence;
mod known;
mod latest;
mod link;
mod outbox;
mod past;
mod read;
mod retention;
mod schema;
mod sealed;
mod series;
mod sum;
mod verify;

pub use batch::{Batch, Position};
pub use evidence::{DeliveryRow, PlacedEvent};
pub use known::Presence;
pub use outbox::{AlertIdentity, Delivery, DeliveryOutcome};
pub use past::{EARLIEST, Heads, LATEST, MOST_SHOWN, Value, Values};
pub use read::{LeftOrder, Recorded, StepRow};
pub use verify::Verified;

use crate::reading::Timestamp;
use rusqlite::{Connection, ErrorCode, OpenFlags, Params, Row, ffi};
use series::Catalogue;
use std::fs::{File, Metadata, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// In the table `meta` of a copy.
const COPY: &str = "is_copy";

/// The database in the state folder.
const FILE: &str = "slipwatch.db";
/// A reader, or a command from beside, may hold the file for so long.
const BUSY_TIMEOUT: Duration = Duration::from_secs(10);
/// How often, and after what waits, the folder's lock is tried.
const LOCK_ATTEMPTS: usize = 10;
const LOCK_WAIT: Duration = Duration::from_millis(50);

/// Why the state cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// There is no state in the folder.
    #[error("state folder {}: nothing there yet; `slipwatch run` makes it", .folder.display())]
    Missing {
        /// The folder.
        folder: PathBuf,
    },
    /// This user may not use it.
    #[error(
        "{} cannot be {what} by user {us}: run this as {owner}, whose the state folder is (sudo -u {owner} slipwatch ...), or let this user read and write there",
        .path.display()
    )]
    Denied {
        /// The file or folder.
        path: PathBuf,
        /// What is not allowed.
        what: &'static str,
        /// Who we are.
        us: String,
        /// Whom the folder belongs to.
        owner: String,
    },
    /// Nobody may write there.
    #[error(
        "{} is on a read-only file system, and a state is opened for writing even where it is only looked at: mount it for writing, or copy the state folder and give the copy as state_dir",
        .path.display()
    )]
    ReadOnlyDisk {
        /// The file or folder.
        path: PathBuf,
    },
    /// Another daemon works on it.
    #[error("another slipwatch is at work on it")]
    InUse,
    /// Written by a later version.
    #[error(
        "the state has schema {version}, from a later slipwatch: this one knows {}; install that version, or restore a backup",
        schema::VERSION
    )]
    Newer {
        /// Its version.
        version: usize,
    },
    /// A database, but not ours.
    #[error("{FILE} is another program's database: move it away, or set another state_dir")]
    Foreign,
    /// What is in the file contradicts itself.
    #[error(
        "the state is damaged ({detail}): restore a backup of {FILE}, or move it away and let the files be read again"
    )]
    Damaged {
        /// What was found.
        detail: String,
    },
    /// What was written may not be on the disk, and trying again would not show it.
    #[error(
        "the disk failed to sync ({detail}): nothing more is written; look at the disk, then start again: that goes on from the last good commit"
    )]
    Unsynced {
        /// What the database said.
        detail: String,
    },
    /// The database failed.
    #[error("{0}")]
    Sqlite(#[source] rusqlite::Error),
    /// The folder cannot be used.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Something kept cannot be read back.
    #[error("the state holds what this version cannot read: {0}")]
    Unreadable(String),
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        let extended = error.sqlite_error().map(|error| error.extended_code);
        if matches!(
            extended,
            Some(ffi::SQLITE_IOERR_FSYNC | ffi::SQLITE_IOERR_DIR_FSYNC)
        ) {
            let detail = error.to_string();
            return Self::Unsynced { detail };
        }
        match error.sqlite_error_code() {
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => {
                let detail = error.to_string();
                Self::Damaged { detail }
            }
            Some(_) | None => Self::Sqlite(error),
        }
    }
}

impl StoreError {
    /// Whether there was no room, or the write failed before anything was acknowledged: the same commit may be
    /// tried again later. A failed sync is something else: what the system has thrown away it would not report
    /// twice, so that is never retried.
    pub fn is_full(&self) -> bool {
        let Self::Sqlite(error) = self else {
            return false;
        };
        error.sqlite_error().is_some_and(|error| {
            error.code == ErrorCode::DiskFull
                || error.code == ErrorCode::DatabaseBusy
                || error.extended_code == ffi::SQLITE_IOERR_WRITE
                || error.extended_code == ffi::SQLITE_IOERR_SHMSIZE
        })
    }
}

/// The open state of a site.
#[derive(Debug)]
pub struct Store {
    inner: Mutex<Inner>,
    /// Held as long as the daemon runs, after the connection: to close the database's file would undo the locks that
    /// the database itself holds on it.
    lock: Option<Lock>,
}

/// The folder and the database for ourselves.
#[derive(Debug)]
struct Lock {
    /// Held for programs of an earlier version, which look at nothing else.
    _folder: File,
    database: File,
    path: PathBuf,
}

#[derive(Debug)]
struct Inner {
    connection: Connection,
    catalogue: Catalogue,
    /// The number of the last step.
    steps: i64,
    /// The number of the last event.
    events: i64,
    log: checkpoint::Log,
    written: known::WrittenValues,
}

impl Store {
    /// Opens the state in `folder` to work on it, and makes it where there is none.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        Self::open_at(folder).map_err(|error| access::explained(error, folder))
    }

    fn open_at(folder: &Path) -> Result<Self, StoreError> {
        std::fs::create_dir_all(folder)?;
        let lock = lock(folder)?;
        let mut connection = Connection::open(folder.join(FILE))?;
        connection.busy_timeout(BUSY_TIMEOUT)?;
        schema::version(&connection)?;
        sound(&connection)?;
        logs_ahead(&connection)?;
        connection.pragma_update(None, "synchronous", "FULL")?;
        schema::migrate(&mut connection)?;
        // Makes the file's own name durable.
        File::open(folder)?.sync_all()?;
        let store = Self::of(connection, Some(lock))?;
        let mut verified = Verified::default();
        while !store.verify(&mut verified)? {}
        Ok(store)
    }

    /// Opens the state in `folder` to look at it, beside a daemon or without one.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn look(folder: &Path) -> Result<Self, StoreError> {
        Self::look_at(folder).map_err(|error| access::explained(error, folder))
    }

    fn look_at(folder: &Path) -> Result<Self, StoreError> {
        let file = folder.join(FILE);
        if !file.try_exists()? {
            let folder = folder.to_owned();
            return Err(StoreError::Missing { folder });
        }
        // Not read-only: a log that a crash has left behind must be judged first.
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(file, flags)?;
        connection.busy_timeout(BUSY_TIMEOUT)?;
        if schema::version(&connection)? < schema::VERSION {
            return Err(StoreError::Unreadable(
                "an older version's tables; `slipwatch run` brings them up".to_owned(),
            ));
        }
        Self::of(connection, None)
    }

    fn of(connection: Connection, lock: Option<Lock>) -> Result<Self, StoreError> {
        let last = |table: &str| {
            let query = format!("SELECT coalesce(max(seq), 0) FROM {table}");
            connection.query_row(&query, [], |row| row.get(0))
        };
        connection.pragma_update(None, "wal_autocheckpoint", 0)?;
        let (steps, events) = (last("step")?, last("event")?);
        let catalogue = Catalogue::load(&connection)?;
        let inner = Inner {
            connection,
            catalogue,
            steps,
            events,
            log: checkpoint::Log::default(),
            written: known::WrittenValues::default(),
        };
        Ok(Self {
            inner: Mutex::new(inner),
            lock,
        })
    }

    /// Writes a copy of the whole state to `file`, while a daemon works on it or not.
    ///
    /// # Errors
    /// [`StoreError`], also where `file` exists already.
    pub fn backup(&self, file: &Path) -> Result<(), StoreError> {
        if file.exists() {
            let exists =
                io::Error::new(io::ErrorKind::AlreadyExists, "there is a file of that name");
            return Err(exists.into());
        }
        let path = file.to_string_lossy();
        self.inner()
            .connection
            .execute("VACUUM INTO ?1", [path.as_ref()])?;
        let copy = Connection::open(file)?;
        copy.execute(
            "INSERT OR REPLACE INTO meta (name, value) VALUES (?1, 1)",
            [COPY],
        )?;
        copy.close().map_err(|(_, error)| error)?;
        File::open(file)?.sync_all()?;
        Ok(())
    }

    /// Whether this is a copy by [`Store::backup`] that was put in the place of a state and on which no daemon has worked.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn is_copy(&self) -> Result<bool, StoreError> {
        Ok(read::meta(&self.inner().connection, COPY)?.is_some())
    }

    /// A daemon works on it: it is a copy no longer.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn clear_copy_mark(&self) -> Result<(), StoreError> {
        let delete = "DELETE FROM meta WHERE name = ?1";
        self.inner().connection.execute(delete, [COPY])?;
        Ok(())
    }

    /// Bytes of the database.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn bytes(&self) -> Result<u64, StoreError> {
        let inner = self.inner();
        let pragma = |name| {
            inner
                .connection
                .pragma_query_value(None, name, |row| row.get::<_, i64>(0))
        };
        let bytes = pragma("page_count")? * pragma("page_size")?;
        Ok(u64::try_from(bytes).unwrap_or(0))
    }

    /// A number that is this state's alone, drawn when it was first asked for.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn instance(&self) -> Result<i64, StoreError> {
        let inner = self.inner();
        if let Some(known) = read::meta(&inner.connection, "instance")? {
            return Ok(known);
        }
        inner.connection.execute(
            "INSERT INTO meta (name, value) VALUES ('instance', random())",
            [],
        )?;
        Ok(read::meta(&inner.connection, "instance")?.unwrap_or_default())
    }

    /// Whether the database is still the file under its name: where it was removed, what is written is lost.
    pub fn is_in_place(&self) -> bool {
        let Some(lock) = &self.lock else { return true };
        let identity = |metadata: io::Result<Metadata>| metadata.map(|one| (one.dev(), one.ino()));
        match (
            identity(lock.database.metadata()),
            identity(std::fs::metadata(&lock.path)),
        ) {
            (Ok(ours), Ok(there)) => ours == there,
            (Err(_), _) | (_, Err(_)) => false,
        }
    }

    /// What `of` makes of each row that a query finds.
    fn rows<T>(
        &self,
        query: &str,
        given: impl Params,
        of: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(query)?;
        let rows = query.query_map(given, of)?;
        Ok(rows.collect::<Result<_, _>>()?)
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The folder for ourselves. A daemon that has just ended may hold it for a moment more: a hook that it was starting
/// has its files until the hook's own program begins.
impl Store {
    /// The database of the state in `folder`.
    pub fn file(folder: &Path) -> PathBuf {
        folder.join(FILE)
    }

    /// Whether a daemon holds the state in `folder`.
    pub fn is_held(folder: &Path) -> bool {
        // Only for a moment: a daemon that starts tries several times.
        let lock = File::open(folder.join("lock"));
        lock.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

fn lock(folder: &Path) -> Result<Lock, StoreError> {
    let path = folder.join(FILE);
    let mut options = File::options();
    options.read(true).write(true).create(true).truncate(false);
    Ok(Lock {
        _folder: locked(File::create(folder.join("lock"))?)?,
        // The database too: whoever removes the other file lets nobody in.
        database: locked(options.open(&path)?)?,
        path,
    })
}

fn locked(file: File) -> Result<File, StoreError> {
    for attempt in 0..LOCK_ATTEMPTS {
        if attempt > 0 {
            std::thread::sleep(LOCK_WAIT);
        }
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::WouldBlock) => {}
            Err(TryLockError::Error(error)) => return Err(error.into()),
        }
    }
    Err(StoreError::InUse)
}

/// Writes to a log from here on. Where that fails, SQLite keeps to its old ways and says no more than their name.
fn logs_ahead(connection: &Connection) -> Result<(), StoreError> {
    let mode: String = connection.query_row("PRAGMA journal_mode = WAL", [], |row| row.get(0))?;
    if mode == "wal" {
        Ok(())
    } else {
        let detail = format!("no write-ahead log could be begun, the mode stays {mode}");
        Err(StoreError::Unsynced { detail })
    }
}

/// Whether the file is whole, as far as its own structure shows.
fn sound(connection: &Connection) -> Result<(), StoreError> {
    let said: String = connection.pragma_query_value(None, "quick_check", |row| row.get(0))?;
    if said == "ok" {
        Ok(())
    } else {
        Err(StoreError::Damaged { detail: said })
    }
}

/// As the tables hold a time: nanoseconds since 1970, from 1678 to 2261.
///
/// # Errors
/// [`StoreError::Unreadable`] outside of that.
fn nanoseconds(time: Timestamp) -> Result<i64, StoreError> {
    i64::try_from(time.as_nanosecond()).map_err(|_| {
        StoreError::Unreadable(format!("the time {time}: from 1678 to 2261 can be kept"))
    })
}

fn timestamp(nanoseconds: i64) -> Result<Timestamp, StoreError> {
    Timestamp::from_nanosecond(i128::from(nanoseconds))
        .map_err(|error| StoreError::Unreadable(error.to_string()))
}
