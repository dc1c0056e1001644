//! Moves what the log holds into the database, and never tries a failed sync again.
//!
//! SQLite would do so by itself, but says nothing when the sync of the database fails. A disk that fails is to be
//! reported, and not to be worked on.

use super::{Inner, StoreError};

/// After so many rows the log is moved: a page that many commits change is then written once for all of them,
const ROWS: usize = 8_000;
/// or after so many commits.
const COMMITS: usize = 500;

/// How much the log holds, and whether the disk can still be trusted.
#[derive(Debug, Default)]
pub(super) struct Log {
    rows: usize,
    commits: usize,
    /// What a sync failed with.
    unsynced: Option<String>,
}

impl Inner {
    /// # Errors
    /// When a sync has failed before: nothing is written any more.
    pub(super) fn trusted(&self) -> Result<(), StoreError> {
        match self.log.unsynced.clone() {
            Some(detail) => Err(StoreError::Unsynced { detail }),
            None => Ok(()),
        }
    }

    /// A commit of `rows` rows came to `written`: moves the log where it is time to, and remembers a sync that failed.
    pub(super) fn committed(
        &mut self,
        rows: usize,
        written: Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let moved = written.and_then(|()| self.move_log(rows));
        if let Err(StoreError::Unsynced { detail }) = &moved {
            self.log.unsynced = Some(detail.clone());
        }
        moved
    }

    fn move_log(&mut self, rows: usize) -> Result<(), StoreError> {
        self.log.rows += rows;
        self.log.commits += 1;
        if self.log.rows < ROWS && self.log.commits < COMMITS {
            return Ok(());
        }
        let moved = self
            .connection
            .query_row("PRAGMA wal_checkpoint(PASSIVE)", [], |_| Ok(()))
            .map_err(StoreError::from);
        match moved {
            // The log keeps it all until there is room in the database.
            Err(error) if error.is_full() => Ok(()),
            Err(error) => Err(error),
            Ok(()) => {
                (self.log.rows, self.log.commits) = (0, 0);
                Ok(())
            }
        }
    }
}
