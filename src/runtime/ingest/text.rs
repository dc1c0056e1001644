//! Text files of every format, line by line behind one door, and whole.

use super::bytes::read_bytes;
use super::collect::Collector;
use super::csv::CsvRows;
use super::ndjson::NdjsonRows;
use super::toa5::Toa5Rows;
use super::{IngestError, Item, ReadOptions};
use crate::reading::{Disorder, Recording};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How a text file is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextFormat {
    /// A header and comma-separated rows.
    Csv,
    /// A JSON object a line.
    Ndjson,
    /// A Campbell logger's table.
    Toa5,
}

/// What came of one line.
#[derive(Debug, Default)]
pub struct Taken {
    /// What it holds.
    pub items: Vec<Item>,
    /// What of it cannot be used, and why.
    pub fault: Option<IngestError>,
}

impl From<Result<Vec<Item>, IngestError>> for Taken {
    fn from(taken: Result<Vec<Item>, IngestError>) -> Self {
        match taken {
            Ok(items) => Self { items, fault: None },
            Err(fault) => Self {
                items: Vec::new(),
                fault: Some(fault),
            },
        }
    }
}

/// Takes the lines of one file, headers included.
#[derive(Debug)]
pub struct TextRows {
    file: PathBuf,
    options: ReadOptions,
    rows: Rows,
}

#[derive(Debug)]
enum Rows {
    /// Before its header.
    NewCsv,
    Csv(Box<CsvRows>),
    Ndjson(Box<NdjsonRows>),
    Toa5(Box<Toa5Rows>),
}

impl TextRows {
    /// Before the first line of `file`, which need not exist: its stem is the benchmark of columns
    /// that name none.
    pub fn new(format: TextFormat, file: &Path, options: &ReadOptions) -> Self {
        let rows = match format {
            TextFormat::Csv => Rows::NewCsv,
            TextFormat::Ndjson => Rows::Ndjson(Box::new(NdjsonRows::new(file, options))),
            TextFormat::Toa5 => Rows::Toa5(Box::new(Toa5Rows::new(file, options))),
        };
        Self {
            file: file.into(),
            options: options.clone(),
            rows,
        }
    }

    /// Takes one line; `line` is its number in the file, from 1. A fault is that line's alone, unless
    /// [`TextRows::is_lost`] afterwards.
    pub fn take(&mut self, line: u64, text: &str) -> Taken {
        match &mut self.rows {
            Rows::NewCsv => match CsvRows::new(&self.file, text, &self.options) {
                Ok(rows) => {
                    self.rows = Rows::Csv(Box::new(rows));
                    Taken::default()
                }
                Err(error) => Err(error).into(),
            },
            Rows::Csv(rows) => rows.row(line, text).into(),
            Rows::Ndjson(rows) => rows.row(line, text),
            Rows::Toa5(rows) => rows.row(line, text).into(),
        }
    }

    /// Whether the file does not begin as its format does, so that nothing of it can be read.
    pub fn is_lost(&self) -> bool {
        match &self.rows {
            Rows::NewCsv => true,
            Rows::Toa5(rows) => rows.is_lost(),
            Rows::Csv(_) | Rows::Ndjson(_) => false,
        }
    }

    /// The lines of the header in force; a new `TextRows` that takes them first goes on from any
    /// later line of the file.
    pub fn header(&self) -> &[String] {
        match &self.rows {
            Rows::NewCsv | Rows::Ndjson(_) => &[],
            Rows::Csv(rows) => rows.header(),
            Rows::Toa5(rows) => rows.header(),
        }
    }

    fn columns(&self) -> &[String] {
        match &self.rows {
            Rows::NewCsv | Rows::Ndjson(_) => &[],
            Rows::Csv(rows) => rows.columns(),
            Rows::Toa5(rows) => rows.columns(),
        }
    }

    fn finish(&self) -> Result<(), IngestError> {
        match &self.rows {
            Rows::Csv(rows) => rows.finish(),
            Rows::NewCsv | Rows::Ndjson(_) | Rows::Toa5(_) => Ok(()),
        }
    }
}

/// A whole file, settled.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) recording: Recording,
    pub(super) disorder: Disorder,
    /// None for NDJSON, where each line has its own.
    pub(super) columns: Vec<String>,
}

/// Reads a whole file; the first fault is an error.
pub(super) fn read_text(
    format: TextFormat,
    file: &Path,
    options: &ReadOptions,
) -> Result<Table, IngestError> {
    let bytes = read_bytes(file)?;
    let name = super::bytes::unpacked_name(file);
    let mut rows = TextRows::new(format, &file.with_file_name(name), options);
    let mut collected = Collector::default();
    for (text, line) in bytes.split(|byte| *byte == b'\n').zip(1..) {
        let taken = rows.take(line, decode(file, line, text)?);
        if let Some(fault) = taken.fault {
            return Err(fault);
        }
        for item in taken.items {
            collected
                .add(item)
                .map_err(|odd| IngestError::Inconsistent {
                    file: file.into(),
                    line,
                    found: odd.found,
                    expected: odd.expected,
                })?;
        }
    }
    rows.finish()?;
    let columns = rows.columns().to_vec();
    let (recording, disorder) = collected.finish(BTreeMap::new());
    if recording.series.is_empty() && recording.channels.is_empty() && disorder.missing == 0 {
        return Err(IngestError::Empty {
            file: file.into(),
            missing: "row",
        });
    }
    Ok(Table {
        recording,
        disorder,
        columns,
    })
}

fn decode<'a>(file: &Path, line: u64, text: &'a [u8]) -> Result<&'a str, IngestError> {
    std::str::from_utf8(text).map_err(|_| IngestError::Field {
        file: file.into(),
        line,
        column: "(any)".to_owned(),
        value: String::from_utf8_lossy(text).into_owned(),
        expected: "text in UTF-8",
    })
}
