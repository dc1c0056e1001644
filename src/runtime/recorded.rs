//! How a daemon's record stands, kept in the state folder over restarts.

use crate::reading::Timestamp;
use crate::runtime::kept;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;

/// In the state folder.
const FILE: &str = "record.json";

/// How far the steps and events of the state have been recorded, where, and why not further.
#[derive(Debug, Clone, Default, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[schemars(rename = "Record")]
pub struct RecordStanding {
    /// The file that was last written.
    pub file: Option<String>,
    /// The number of the last step in it.
    pub step: i64,
    /// The number of the last event in it.
    pub event: i64,
    /// Why nothing can be written; `None` where all is well.
    pub failure: Option<String>,
    /// Since when, by the host's clock.
    pub failing_since: Option<Timestamp>,
}

impl RecordStanding {
    /// As it stands in a state folder; `None` where there is none, or none that can be read.
    pub fn read(state_dir: &Path) -> Option<Self> {
        kept::read(&state_dir.join(FILE))
    }

    pub(super) fn write(&self, state_dir: &Path) -> io::Result<()> {
        kept::write(state_dir, FILE, self)
    }
}
