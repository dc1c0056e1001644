//! The site's events as NDJSON: appended once each, durable before any hook is told.

use super::journal::Journal;
use crate::monitor::Event;
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
    pending: Vec<String>,
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
            pending: Vec::new(),
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
                    self.pending.push(line);
                }
            }
            Err(error) => tracing::error!(?event, %error, "event lost: no JSON"),
        }
    }

    pub(super) fn commit(&mut self) -> io::Result<()> {
        let lines = std::mem::take(&mut self.pending);
        match &mut self.journal {
            Some(journal) => journal.append(&lines),
            None => Ok(()),
        }
    }
}

fn fingerprint(line: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    line.hash(&mut hasher);
    hasher.finish()
}
