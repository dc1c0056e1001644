//! Which alerts have reached which hook: an append-only NDJSON file, synced before it counts.

use super::hook::{Alert, state_name};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use super::backlog::{Backlog, Worth};
use super::journal::Journal;

/// One alert that a hook has taken.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
struct Receipt {
    key: String,
    level: String,
    state: String,
    hook: String,
}

impl Receipt {
    fn of(alert: &Alert, hook: &str) -> Self {
        Self {
            key: alert.key.clone(),
            level: alert.level.name().to_owned(),
            state: state_name(alert.state).to_owned(),
            hook: hook.to_owned(),
        }
    }
}

/// The receipts of all hooks, as they stand in a file or, for a replay, only in memory.
#[derive(Debug, Default)]
pub struct Delivered {
    receipts: BTreeSet<Receipt>,
    pending: Backlog,
    journal: Option<Journal>,
}

impl Delivered {
    /// Reads the receipts in `file`, which need not exist yet.
    ///
    /// # Errors
    /// When the file cannot be read or opened for appending.
    pub fn open(file: &Path) -> io::Result<Self> {
        let mut receipts = BTreeSet::new();
        let journal = Journal::open(file, |line| match serde_json::from_str::<Receipt>(line) {
            Ok(receipt) => {
                receipts.insert(receipt);
            }
            Err(error) => {
                tracing::warn!(file = %file.display(), line, %error, "unreadable receipt");
            }
        })?;
        Ok(Self {
            receipts,
            pending: Backlog::default(),
            journal: Some(journal),
        })
    }

    /// Whether `hook` has taken this alert.
    pub fn has(&self, alert: &Alert, hook: &str) -> bool {
        self.receipts.contains(&Receipt::of(alert, hook))
    }

    /// Notes that `hook` has taken this alert: in any case until the daemon stops, and on a full
    /// disk no longer than that unless [`Delivered::commit`] finds room.
    ///
    /// # Errors
    /// When the receipt cannot be made durable; the alert may then be sent once more, after a
    /// restart, with the same key.
    pub fn note(&mut self, alert: &Alert, hook: &str) -> io::Result<()> {
        let receipt = Receipt::of(alert, hook);
        let line = serde_json::to_string(&receipt)?;
        self.receipts.insert(receipt);
        if self.journal.is_some() {
            self.pending.add(Worth::Much, line);
        }
        self.commit()
    }

    /// Makes durable what found no room before.
    ///
    /// # Errors
    /// When that fails for another reason than a full disk.
    pub fn commit(&mut self) -> io::Result<()> {
        match &mut self.journal {
            Some(journal) => self.pending.append_to(journal, "receipts").map(drop),
            None => Ok(()),
        }
    }
}
