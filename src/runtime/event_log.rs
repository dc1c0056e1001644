//! The site's events as NDJSON: appended once each, durable before any hook is told, unless the
//! disk is full: then they wait, and the hooks are told all the same.

use super::backlog::{Backlog, Worth};
use super::journal::Journal;
use crate::monitor::{Event, EventKind};
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::Path;

/// Every event said so far, in a file or, for a replay, nowhere.
///
/// A restart reads the files from their start and the monitor says everything again; what stands
/// in the log already is not written a second time.
#[derive(Debug, Default)]
pub struct EventLog {
    known: BTreeSet<u64>,
    pending: Backlog,
    journal: Option<Journal>,
}

impl EventLog {
    /// Reads the events in `file`, which need not exist yet.
    ///
    /// # Errors
    /// When the file cannot be read or opened for appending.
    pub fn open(file: &Path) -> io::Result<Self> {
        let mut known = BTreeSet::new();
        let journal = Journal::open(file, |line| {
            known.insert(fingerprint(line));
        })?;
        Ok(Self {
            known,
            pending: Backlog::default(),
            journal: Some(journal),
        })
    }

    pub(super) fn add(&mut self, event: &Event) {
        if self.journal.is_none() {
            return;
        }
        match serde_json::to_string(event) {
            Ok(line) => {
                if self.known.insert(fingerprint(&line)) {
                    let is_refit = matches!(event.kind, EventKind::Refit { .. });
                    let worth = if is_refit { Worth::Little } else { Worth::Much };
                    self.pending.add(worth, line);
                }
            }
            Err(error) => tracing::error!(?event, %error, "event lost: no JSON"),
        }
    }

    /// Makes the events durable, or on a full disk keeps them until the next time.
    pub(super) fn commit(&mut self) -> io::Result<()> {
        match &mut self.journal {
            Some(journal) => self.pending.append_to(journal, "events").map(drop),
            None => Ok(()),
        }
    }

    /// Events dropped because the disk was full for too long; a restart says them again.
    pub(super) fn dropped(&self) -> u64 {
        self.pending.dropped()
    }
}

fn fingerprint(line: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    line.hash(&mut hasher);
    hasher.finish()
}
