//! Where a restart goes on in a file, as it is kept.

use super::records::Channels;
use super::text::{RefusedRows, SavedText};
use crate::reading::BenchmarkId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::Arc;

/// Which file it is, as the file system counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(in crate::runtime) struct FileId {
    device: u64,
    inode: u64,
}

impl FileId {
    pub(super) fn of(metadata: &Metadata) -> Self {
        Self {
            device: metadata.dev(),
            inode: metadata.ino(),
        }
    }
}

/// What a restart goes on from: everything before has been handed out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Saved {
    pub(super) at: u64,
    pub(super) place: Option<FileId>,
    pub(super) mark: Vec<u8>,
    /// FNV-1a of more of what stands before; none where an older version has written this, whose hash a compiler might change.
    #[serde(default, rename = "earlier_sum")]
    pub(super) earlier: Option<u64>,
    pub(super) content: SavedContent,
    /// The newest lines, where all of them could not be used; none where an older version has written this.
    #[serde(default)]
    pub(super) refused_rows: RefusedRows,
    /// The name under which it was found first, where it was renamed since.
    #[serde(default)]
    pub(super) origin: Option<PathBuf>,
    /// What decided which numbers the readings of each benchmark were; none where an older version has written this.
    #[serde(default)]
    pub(super) read_as: Option<Arc<BTreeMap<BenchmarkId, String>>>,
}

/// What of a file's content a restart needs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum SavedContent {
    Text(SavedText),
    Mcap(Channels),
    Complete,
    /// From its start.
    #[default]
    Anew,
}
