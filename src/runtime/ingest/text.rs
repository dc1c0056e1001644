//! Text files of every format, line by line through one interface, and whole.

use super::bytes::read_bytes;
use super::collect::Collector;
use super::columns::Meaning;
use super::encoding::{Transcoder, latin1};
use super::remark::Remark;
use super::taken::{BadRows, LineResult};
use super::text_format::{LineReader, TextFormat};
use super::units::FileUnits;
use super::{IngestError, Item, ReadOptions};
use crate::reading::{BenchmarkId, Disorder, Recording, Unit};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

impl Remark {
    /// One by which no reading is missing.
    pub(super) fn new(about: String, text: String) -> Self {
        Self {
            about,
            text,
            is_loss: false,
        }
    }

    /// That a table is taken as Latin-1 from this line on.
    pub fn latin1(line: u64) -> Self {
        Self::new(
            "encoding".to_owned(),
            format!("line {line} is not in UTF-8: such lines are taken as Latin-1 (ISO 8859-1)"),
        )
    }

    /// That a file is in UTF-16.
    pub fn utf16() -> Self {
        Self::new(
            "encoding".to_owned(),
            "the file is in UTF-16, as its first bytes say, and is read as such".to_owned(),
        )
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.about, self.text)
    }
}

/// Takes the lines of one file, headers included, by the reader of its format.
#[derive(Debug)]
pub struct TextRows(Box<dyn LineReader>);

impl TextRows {
    /// Before the first line of `file`, which need not exist: its stem is the benchmark of columns
    /// that name none.
    pub fn new(format: &TextFormat, file: &Path, options: &ReadOptions) -> Self {
        Self((format.reader)(file, options))
    }

    /// As [`LineReader::take`], with what it has found out about the file.
    pub fn take(&mut self, line: u64, text: &str) -> LineResult {
        let mut taken = self.0.take(line, text);
        taken.remarks.extend(self.0.take_remarks());
        let of_a_cell = self.0.take_fault();
        taken.fault = taken.fault.or(of_a_cell);
        taken
    }

    /// As [`LineReader::meanings`].
    pub fn meanings(&self) -> Vec<(String, Meaning)> {
        self.0.meanings()
    }

    /// As [`LineReader::takes_latin1`].
    pub fn takes_latin1(&self) -> bool {
        self.0.takes_latin1()
    }

    /// As [`LineReader::is_lost`].
    pub fn is_lost(&self) -> bool {
        self.0.is_lost()
    }

    /// As [`LineReader::units_line`].
    fn units_line(&self) -> BTreeMap<String, String> {
        self.0.units_line()
    }

    /// As [`LineReader::header`].
    pub fn header(&self) -> &[String] {
        self.0.header()
    }
}

/// It is said how far a file has been read each time after so many lines.
const LINES_A_LOOK: u64 = 256;

/// A whole file, read.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) recording: Recording,
    pub(super) disorder: Disorder,
    /// None for NDJSON, where each line has its own.
    pub(super) columns: Vec<String>,
    /// What a person should know of the file.
    pub(super) remarks: Vec<Remark>,
}

/// Reads a whole file; what cannot be used of it meets `bad`.
pub(super) fn read_text(
    format: &TextFormat,
    file: &Path,
    options: &ReadOptions,
    bad: &mut BadRows<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<Table, IngestError> {
    let bytes = read_bytes(file)?;
    let bytes = Transcoder::default().feed(&bytes);
    let mut done = 0;
    let mut rows = TextRows::new(format, &super::bytes::shown_name(file), options);
    let (mut collected, mut units) = (Collector::default(), FileUnits::default());
    let mut remarks = Vec::new();
    for (text, line) in bytes.split(|byte| *byte == b'\n').zip(1..) {
        done += text.len() + 1;
        if line % LINES_A_LOOK == 0 {
            progress(done as f64 / bytes.len() as f64);
        }
        let text = match std::str::from_utf8(text) {
            Ok(text) => Ok(Cow::Borrowed(text)),
            Err(_) => not_utf8(&rows, file, line, text, &mut remarks).map(Cow::Owned),
        };
        let taken = match text {
            Ok(text) => rows.take(line, &text),
            Err(fault) => Err(fault).into(),
        };
        remarks.extend(taken.remarks);
        if let Some(fault) = taken.fault {
            if rows.is_lost() {
                return Err(fault);
            }
            bad.meet(fault)?;
        }
        for item in taken.items {
            let item = units.convert(item);
            if let Err(odd) = collected.add(item) {
                bad.meet(IngestError::Inconsistent {
                    file: file.into(),
                    line,
                    found: odd.found,
                    expected: odd.expected,
                })?;
            }
        }
    }
    if !bad.are_set_aside() {
        rows.0.finish()?;
    }
    let columns = rows.0.columns();
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
        remarks,
    })
}

/// A line that is no UTF-8, as Latin-1 where that can do no harm; which is reported once.
fn not_utf8(
    rows: &TextRows,
    file: &Path,
    line: u64,
    text: &[u8],
    remarks: &mut Vec<Remark>,
) -> Result<String, IngestError> {
    let read = latin1(text).filter(|_| rows.takes_latin1());
    let remark = Remark::latin1(line);
    if read.is_some() && remarks.iter().all(|one| one.about != remark.about) {
        remarks.push(remark);
    }
    read.ok_or_else(|| IngestError::Field {
        file: file.into(),
        line,
        column: "(any)".to_owned(),
        value: String::from_utf8_lossy(text).into_owned(),
        expected: "text in UTF-8, or a table in Latin-1",
    })
}

/// What a file holds, whatever is wrong with some of its rows.
#[derive(Debug, Default)]
pub struct FileSurvey {
    /// What its columns are taken for; none for messages.
    pub columns: Vec<(String, Meaning)>,
    /// The names of its columns, of every header that it has had.
    pub names: Vec<String>,
    /// Whose readings it has, in which units.
    pub readings: BTreeSet<(BenchmarkId, Unit)>,
    /// What is wrong with the first row that cannot be used.
    pub fault: Option<IngestError>,
    /// How many readings of each benchmark can be used, and how many cannot as something is wrong with their rows.
    pub counts: BTreeMap<BenchmarkId, (usize, usize)>,
    /// By column what a line of units below the header says of it, where its name does not have that.
    pub units_line: BTreeMap<String, String>,
}

impl FileSurvey {
    /// Counts the readings of one row.
    fn count(&mut self, items: &[Item], is_faulty: bool) {
        for item in items {
            match item {
                Item::Reading { benchmark, .. } => {
                    self.counts.entry(benchmark.clone()).or_default().0 += 1;
                }
                Item::Missing { benchmark, .. } if is_faulty => {
                    self.counts.entry(benchmark.clone()).or_default().1 += 1;
                }
                Item::Missing { .. } | Item::Sample { .. } => {}
            }
        }
    }
}

/// Looks through a text file.
///
/// # Errors
/// [`IngestError`] where it cannot be read or does not begin as its format does.
pub fn look_through(
    format: &TextFormat,
    file: &Path,
    options: &ReadOptions,
) -> Result<FileSurvey, IngestError> {
    let bytes = read_bytes(file)?;
    let bytes = Transcoder::default().feed(&bytes);
    let mut rows = TextRows::new(format, &super::bytes::shown_name(file), options);
    let mut looked = FileSurvey::default();
    let mut units = FileUnits::default();
    for (text, line) in bytes.split(|byte| *byte == b'\n').zip(1..) {
        let text = match std::str::from_utf8(text) {
            Ok(text) => text.to_owned(),
            Err(_) => latin1(text).unwrap_or_default(),
        };
        let taken = rows.take(line, &text);
        let is_faulty = taken.fault.is_some();
        match taken.fault {
            Some(fault) if rows.is_lost() => return Err(fault),
            fault => looked.fault = looked.fault.or(fault),
        }
        looked.count(&taken.items, is_faulty);
        for item in taken.items {
            if let Item::Reading {
                benchmark, unit, ..
            } = units.convert(item)
            {
                looked.readings.insert((benchmark, unit));
            }
        }
    }
    looked.columns = rows.meanings();
    looked.names = rows.0.columns();
    looked.units_line = rows.units_line();
    Ok(looked)
}
