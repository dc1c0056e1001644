//! What can be wrong with a file of readings, with the place where it is.

use super::{MessageError, Remark};
use crate::reading::MergeError;
use std::io;
use std::path::PathBuf;

/// A file that cannot be read or written, or holds what it should not.
#[derive(Debug, thiserror::Error)]
pub enum IngestError {
    /// The file cannot be opened or read.
    #[error("cannot read {}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file cannot be written.
    #[error("cannot write {}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The extension is none that is known.
    #[error("{}: unknown kind of file, expected a name that ends in .csv, .tsv, .txt, .ndjson, .jsonl, .dat (TOA5), one of these with .gz, or .mcap", file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
    /// A workbook of a spreadsheet program.
    #[error(
        "{}: found a workbook, expected text; save the sheet as \"CSV UTF-8\" in the program that made it, and give that file",
        file.display()
    )]
    Workbook {
        /// The file.
        file: PathBuf,
    },
    /// A column of the header cannot be what it is.
    #[error("{}, line {line}, column {column:?}: {problem}, expected {expected}", file.display())]
    Header {
        /// The file.
        file: PathBuf,
        /// The header's line.
        line: u64,
        /// The column's name.
        column: String,
        /// What is wrong with it.
        problem: &'static str,
        /// What would be right.
        expected: &'static str,
    },
    /// The header cannot be split into names.
    #[error("{}, line {line}: found {found}, expected a header of comma-separated names", file.display())]
    BadHeader {
        /// The file.
        file: PathBuf,
        /// The header's line.
        line: u64,
        /// What stands there.
        found: String,
    },
    /// A row with no header above it that is understood.
    #[error("{}, line {line}: found a row under no header, expected a header that is understood", file.display())]
    NoHeader {
        /// The file.
        file: PathBuf,
        /// The line.
        line: u64,
    },
    /// A piece of a line that is no JSON object.
    #[error("{}, line {line}: found {}, expected one JSON object on each line", file.display(), beginning(found))]
    Torn {
        /// The file.
        file: PathBuf,
        /// The line.
        line: u64,
        /// The piece.
        found: String,
    },
    /// A message of NDJSON that cannot be a reading.
    #[error("{}, line {line}: {problem}", file.display())]
    Record {
        /// The file.
        file: PathBuf,
        /// The line.
        line: u64,
        /// What is wrong with it.
        problem: Box<MessageError>,
    },
    /// A value in another unit, or of another averaging, than those before it.
    #[error("{}, line {line}: found {found}, expected {expected}", file.display())]
    Inconsistent {
        /// The file.
        file: PathBuf,
        /// The line.
        line: u64,
        /// What stands there.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A line has more or fewer fields than the header, or cannot be split.
    #[error("{}, line {line}: found {found}, expected {expected} fields as in the header", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// The line, the header being 1.
        line: u64,
        /// What stands there.
        found: String,
        /// The number of columns in the header.
        expected: usize,
    },
    /// A cell holds what cannot stand there.
    #[error("{}, line {line}, column {column:?}: found {}, expected {expected}", file.display(), beginning(value))]
    Field {
        /// The file.
        file: PathBuf,
        /// The line, the header being 1.
        line: u64,
        /// The column's name.
        column: String,
        /// What stands there.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A column without a single value.
    #[error("{}, column {column:?}: found no value in any row, expected at least one number", file.display())]
    EmptyColumn {
        /// The file.
        file: PathBuf,
        /// The column's name.
        column: String,
    },
    /// A header with nothing below it, or nothing at all.
    #[error("{}: found no {missing}, expected a header line and at least one row", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
        /// What is not there.
        missing: &'static str,
    },
    /// A column given by name that no file has.
    #[error("no file has a column {column:?}: expected one of {available:?}")]
    NoSuchColumn {
        /// The name that was given.
        column: String,
        /// The columns that there are.
        available: Vec<String>,
    },
    /// A covariate given by name that no file has.
    #[error("no file has a covariate {name:?}: expected one of {available:?}")]
    NoSuchCovariate {
        /// The name that was given.
        name: String,
        /// The covariates that there are.
        available: Vec<String>,
    },
    /// A file of covariates that holds none.
    #[error("{}: found benchmarks only, expected at least one covariate channel", file.display())]
    NoChannels {
        /// The file.
        file: PathBuf,
    },
    /// An MCAP file that ends before its first reading, fails a checksum or breaks the format.
    #[error("{}: the file is damaged or incomplete, nothing of it is used", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What the MCAP reader met.
        source: mcap::McapError,
    },
    /// An MCAP file whose summary counts other messages than the file holds.
    #[error("{}: found {found} messages, expected {expected} as its statistics say", file.display())]
    MessageCount {
        /// The file.
        file: PathBuf,
        /// The messages that are there.
        found: u64,
        /// The messages that should be there.
        expected: u64,
    },
    /// An MCAP file with nothing for us.
    #[error(
        "{}: found topics {topics:?}, expected /benchmarks/ID/displacement, /benchmarks/ID/velocity or /channels/NAME with messages",
        file.display()
    )]
    NoTopics {
        /// The file.
        file: PathBuf,
        /// The topics that there are.
        topics: Vec<String>,
    },
    /// A message that cannot be a reading.
    #[error("{}, message {number}: {problem}", file.display())]
    Message {
        /// The file.
        file: PathBuf,
        /// Which message of the whole file, the first being 1.
        number: u64,
        /// What is wrong with it.
        problem: Box<MessageError>,
    },
    /// Readings that the format of the output cannot hold.
    #[error("{name}: {problem}, expected {expected}")]
    Unwritable {
        /// The series or channel.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
        /// What would be right.
        expected: &'static str,
    },
    /// Files that cannot be joined.
    #[error(transparent)]
    Merge(#[from] MergeError),
}

/// As much of a value as a person reads.
fn beginning(value: &str) -> String {
    const SHOWN: usize = 60;
    match value.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{:?} and more", &value[..end]),
        None => format!("{value:?}"),
    }
}

impl IngestError {
    /// Whether what was expected can be had by a flag: whatever stands in the file is left out of account.
    pub fn names_a_flag(&self) -> bool {
        let expected = if let Self::Header { expected, .. }
        | Self::Field { expected, .. }
        | Self::Inconsistent { expected, .. } = self
        {
            *expected
        } else if let Self::Record { problem, .. } = self {
            problem.expected
        } else {
            return false;
        };
        expected.contains("(--") || expected.contains(", --")
    }

    /// What to say of a file that is left out for it where others have readings; `None` where it is to be refused.
    pub fn left_out(&self) -> Option<Remark> {
        let Self::NoTopics { topics, .. } = self else {
            return None;
        };
        Some(Remark::new(
            "left out".to_owned(),
            format!("it has no readings, but topics {topics:?}"),
        ))
    }

    /// Whether the system failed us, rather than the data being bad.
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Read { .. } | Self::Write { .. })
    }
}
