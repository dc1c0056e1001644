//! A file that holds one word which only those who are meant to know it may read.

use std::path::{Path, PathBuf};

/// What such a file holds.
#[derive(Debug)]
pub(super) struct WordKind {
    /// What the word is.
    pub(super) name: &'static str,
    /// What it must be, and how to make one.
    pub(super) expected: &'static str,
}

/// A file that holds no usable word.
#[derive(Debug, thiserror::Error)]
pub enum WordFileError {
    /// It cannot be read.
    #[error("cannot read the {kind} file {}: {source}", .file.display())]
    Unreadable {
        /// What it should hold.
        kind: &'static str,
        /// The file.
        file: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// What it holds cannot be meant.
    #[error("the {kind} file {} must hold {expected}", .file.display())]
    Unusable {
        /// What it should hold.
        kind: &'static str,
        /// The file.
        file: PathBuf,
        /// What that must be.
        expected: &'static str,
    },
}

/// What `usable` makes of the word in `file`; `None` from it where the word cannot be used.
///
/// # Errors
/// [`WordFileError`].
pub(super) fn read<T>(
    file: &Path,
    kind: &WordKind,
    usable: impl FnOnce(&str) -> Option<T>,
) -> Result<T, WordFileError> {
    let text = std::fs::read_to_string(file).map_err(|source| WordFileError::Unreadable {
        kind: kind.name,
        file: file.to_owned(),
        source,
    })?;
    usable(text.trim()).ok_or_else(|| WordFileError::Unusable {
        kind: kind.name,
        file: file.to_owned(),
        expected: kind.expected,
    })
}
