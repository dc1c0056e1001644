//! What a format of text files is: what the rest of the program asks of it.

use super::columns::Meaning;
use super::remark::Remark;
use super::taken::LineResult;
use super::{IngestError, ReadOptions};
use crate::reading::Recording;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::io::Write;
use std::path::Path;

/// A format of text files; each stands in the file of its reader, and has a row in
/// [`TEXT_FORMATS`](super::TEXT_FORMATS).
#[derive(Debug)]
pub struct TextFormat {
    /// Its word in the config.
    pub name: &'static str,
    /// The endings of its files, in lower case.
    pub extensions: &'static [&'static str],
    /// Whether a text whose name is not known begins as its files do, after white space.
    pub begins: fn(&[u8]) -> bool,
    /// The reader of one file, before its first line. The file need not exist: its stem is the benchmark of columns
    /// that name none.
    pub reader: fn(&Path, &ReadOptions) -> Box<dyn LineReader>,
    /// Writes a whole recording.
    pub write: fn(&Recording, &mut dyn Write) -> Result<(), IngestError>,
    /// Whether it has a place for the span over which velocities are means.
    pub states_averaging: bool,
}

/// Takes the lines of one file, headers included.
pub trait LineReader: Debug + Send {
    /// Takes one line; `line` is its number in the file, from 1. A fault is that line's alone, unless
    /// [`LineReader::is_lost`] afterwards.
    fn take(&mut self, line: u64, text: &str) -> LineResult;

    /// What has been found out about the file since the last call.
    fn take_remarks(&mut self) -> Vec<Remark> {
        Vec::new()
    }

    /// What of the last line could not be used, where the rest of it could.
    fn take_fault(&mut self) -> Option<IngestError> {
        None
    }

    /// What the columns are taken for, by what has been read so far; none for messages, each of which says it.
    fn meanings(&self) -> Vec<(String, Meaning)> {
        Vec::new()
    }

    /// By column what a line of units below the header says of it, where its name does not have that.
    fn units_line(&self) -> BTreeMap<String, String> {
        BTreeMap::new()
    }

    /// Whether a line that is not UTF-8 may be taken as Latin-1: in a table only column names and text could
    /// differ by it, never a number.
    fn takes_latin1(&self) -> bool {
        false
    }

    /// Whether the file does not begin as its format does, so that nothing of it can be read.
    fn is_lost(&self) -> bool {
        false
    }

    /// The lines of the header in force; a new reader that takes them first goes on from any later line of the file.
    fn header(&self) -> &[String] {
        &[]
    }

    /// The names of the columns, of every header that the file has had.
    fn columns(&self) -> Vec<String> {
        Vec::new()
    }

    /// What a whole file must have held.
    ///
    /// # Errors
    /// [`IngestError`] for what it lacks.
    fn finish(&self) -> Result<(), IngestError> {
        Ok(())
    }
}
