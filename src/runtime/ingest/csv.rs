//! CSV files: a row parser for whole files and for files still being written, and a writer.
//!
//! A cell is empty where there is no reading; a standard error without a reading is passed over.
//! Every other cell holds one finite number. Times are kept as instants: the offset in which they
//! were written is not.
//!
//! The writer makes one table over the union of all times. CSV has no place for the averaging of
//! velocities nor for provenance: these are not written, and must be given again on reading.

use super::collect::Collector;
use super::columns::{Column, Layout, Measure, Name, SigmaColumn, name_of};
use super::split::Splitter;
use super::{IngestError, Item, ReadOptions};
use crate::reading::{Disorder, Reading, Recording, Sample, Timestamp, Unit, after_days};
use ::csv::StringRecord;
use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Reads the rows of one file, one at a time; what the columns are is decided by the header alone.
#[derive(Debug)]
pub struct CsvRows {
    file: PathBuf,
    layout: Layout,
    options: ReadOptions,
    filled: Vec<bool>,
    splitter: Splitter,
    cells: StringRecord,
}

impl CsvRows {
    /// Understands a header. The file's stem is the benchmark of columns that name none.
    ///
    /// # Errors
    /// [`IngestError::Header`], [`IngestError::BadHeader`] or [`IngestError::Empty`] says what is wrong
    /// with the header.
    pub fn new(file: &Path, header: &str, options: &ReadOptions) -> Result<Self, IngestError> {
        let header = header.strip_prefix('\u{feff}').unwrap_or(header);
        let mut splitter = Splitter::new();
        let mut cells = StringRecord::new();
        splitter
            .split(header, &mut cells)
            .map_err(|found| IngestError::BadHeader {
                file: file.into(),
                found,
            })?;
        if cells.iter().all(str::is_empty) {
            return Err(IngestError::Empty {
                file: file.into(),
                missing: "header",
            });
        }
        let names = cells.iter().map(str::to_owned).collect();
        let layout = Layout::new(file, names, &options.columns)?;
        Ok(Self {
            file: file.into(),
            filled: vec![false; layout.names.len()],
            layout,
            options: options.clone(),
            splitter,
            cells,
        })
    }

    /// The columns' names, in their order.
    pub fn columns(&self) -> &[String] {
        &self.layout.names
    }

    /// What one row holds, nothing if it is blank; `line` is its number in the file, the header
    /// being 1.
    ///
    /// # Errors
    /// [`IngestError::Line`] or [`IngestError::Field`] names the place; the parser is unharmed
    /// and takes the next row.
    pub fn row(&mut self, line: u64, text: &str) -> Result<Vec<Item>, IngestError> {
        let expected = self.layout.names.len();
        let fail = |found| IngestError::Line {
            file: self.file.clone(),
            line,
            found,
            expected,
        };
        self.splitter.split(text, &mut self.cells).map_err(fail)?;
        if self.cells.is_empty() {
            return Ok(Vec::new());
        }
        if self.cells.len() != expected {
            return Err(fail(format!("{} fields", self.cells.len())));
        }
        let items = Row { rows: self, line }.items()?;
        for (filled, cell) in self.filled.iter_mut().zip(&self.cells) {
            *filled |= !cell.is_empty();
        }
        Ok(items)
    }

    /// The first column that has held nothing so far.
    fn unfilled(&self) -> Option<&String> {
        let mut columns = self.layout.names.iter().zip(&self.filled);
        columns.find_map(|(name, filled)| (!filled).then_some(name))
    }
}

struct Row<'a> {
    rows: &'a CsvRows,
    line: u64,
}

impl Row<'_> {
    fn items(&self) -> Result<Vec<Item>, IngestError> {
        let layout = &self.rows.layout;
        let time = self.time()?;
        let mut items = Vec::new();
        for (index, column) in layout.columns.iter().enumerate() {
            match column {
                Column::Reading {
                    benchmark,
                    unit,
                    sigma,
                } => {
                    let sigma = sigma.map_or(Ok(None), |sigma| self.sigma(sigma, *unit))?;
                    if let Some(value) = self.number(index)? {
                        items.push(Item::Reading {
                            benchmark: benchmark.clone(),
                            unit: *unit,
                            averaging: self.rows.options.averaging_of(*unit, None),
                            reading: Reading { time, value, sigma },
                        });
                    }
                }
                Column::Channel { unit } => {
                    if let Some(value) = self.number(index)? {
                        items.push(Item::Sample {
                            channel: layout.names[index].clone(),
                            unit: unit.clone(),
                            sample: Sample { time, value },
                        });
                    }
                }
                Column::Time | Column::Days | Column::Sigma => {}
            }
        }
        Ok(items)
    }

    fn time(&self) -> Result<Timestamp, IngestError> {
        let layout = &self.rows.layout;
        let index = layout.time;
        if layout.columns[index] == Column::Days {
            let expected = "a number of days within the calendar";
            let days = self.number(index)?;
            return days
                .and_then(|days| after_days(self.rows.options.epoch, days))
                .ok_or_else(|| self.fail(index, expected));
        }
        let expected = "an RFC 3339 time with its offset, such as 2013-11-20T20:31:19+10:00";
        self.rows.cells[index]
            .parse()
            .map_err(|_| self.fail(index, expected))
    }

    fn number(&self, index: usize) -> Result<Option<f64>, IngestError> {
        let cell = &self.rows.cells[index];
        if cell.is_empty() {
            return Ok(None);
        }
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.fail(
                index,
                "a finite number, or an empty cell where it is missing",
            )),
        }
    }

    /// The standard error in the reading's own unit.
    fn sigma(&self, column: SigmaColumn, unit: Unit) -> Result<Option<f64>, IngestError> {
        let Some(sigma) = self.number(column.index)? else {
            return Ok(None);
        };
        let converted = if column.unit == unit {
            sigma
        } else {
            sigma * (column.unit.factor() / unit.factor())
        };
        if converted > 0.0 && converted.is_finite() {
            Ok(Some(converted))
        } else {
            Err(self.fail(column.index, "a positive standard error, or an empty cell"))
        }
    }

    fn fail(&self, index: usize, expected: &'static str) -> IngestError {
        IngestError::Field {
            file: self.rows.file.clone(),
            line: self.line,
            column: self.rows.layout.names[index].clone(),
            value: self.rows.cells[index].to_owned(),
            expected,
        }
    }
}

/// A whole file, settled.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) recording: Recording,
    pub(super) disorder: Disorder,
    pub(super) columns: Vec<String>,
}

/// Reads a whole file through [`CsvRows`].
pub(super) fn read_csv(file: &Path, options: &ReadOptions) -> Result<Table, IngestError> {
    let bytes = std::fs::read(file).map_err(|source| IngestError::Read {
        file: file.into(),
        source,
    })?;
    let empty = |missing| IngestError::Empty {
        file: file.into(),
        missing,
    };
    let mut lines = bytes.split(|byte| *byte == b'\n').zip(1..);
    let header = match lines.next() {
        Some((header, line)) if !bytes.is_empty() => decode(file, line, header)?,
        _ => return Err(empty("header")),
    };
    let mut rows = CsvRows::new(file, header, options)?;
    let mut collected = Collector::default();
    for (text, line) in lines {
        for item in rows.row(line, decode(file, line, text)?)? {
            // A CSV column has one unit by construction, so nothing can be inconsistent.
            let added = collected.add(item);
            debug_assert_eq!(added, Ok(()));
        }
    }
    if !rows.filled.contains(&true) {
        return Err(empty("row"));
    }
    if let Some(column) = rows.unfilled() {
        return Err(IngestError::EmptyColumn {
            file: file.into(),
            column: column.clone(),
        });
    }
    let (recording, disorder) = collected.finish(std::collections::BTreeMap::new());
    Ok(Table {
        recording,
        disorder,
        columns: rows.layout.names,
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

/// One column on its way out: its rows, of which those before `next` are written.
struct Outgoing<'a> {
    name: String,
    rows: Vec<(Timestamp, Reading)>,
    sigma: Option<String>,
    next: usize,
    title: &'a str,
}

/// Writes one table over the union of all times, in UTC, every number so that it reads back bit
/// for bit. The averaging of velocities and the provenance have no place in it.
///
/// # Errors
/// [`IngestError::Unwritable`] for a name that would be read back as something else, for a value
/// that is not finite and for rows out of order; [`IngestError::Write`] when `out` fails.
pub fn write_csv(recording: &Recording, out: impl Write) -> Result<(), IngestError> {
    let mut columns = outgoing(recording);
    refuse_unreadable(recording, &columns)?;
    let fail = |error: ::csv::Error| IngestError::Write {
        file: "the CSV output".into(),
        source: io::Error::other(error),
    };
    let mut writer = ::csv::Writer::from_writer(out);
    let mut header = vec!["time".to_owned()];
    for column in &columns {
        header.push(column.name.clone());
        header.extend(column.sigma.clone());
    }
    writer.write_record(&header).map_err(fail)?;
    let times: BTreeSet<Timestamp> = columns
        .iter()
        .flat_map(|column| column.rows.iter().map(|row| row.0))
        .collect();
    for time in times {
        let mut cells = vec![time.to_string()];
        for column in &mut columns {
            let row = column.rows.get(column.next).filter(|row| row.0 == time);
            column.next += usize::from(row.is_some());
            // Debug, unlike Display, writes large and small numbers with an exponent.
            cells.push(row.map_or_else(String::new, |row| format!("{:?}", row.1.value)));
            if column.sigma.is_some() {
                let sigma = row.and_then(|row| row.1.sigma);
                cells.push(sigma.map_or_else(String::new, |sigma| format!("{sigma:?}")));
            }
        }
        writer.write_record(&cells).map_err(fail)?;
    }
    writer.flush().map_err(|error| fail(error.into()))
}

fn outgoing(recording: &Recording) -> Vec<Outgoing<'_>> {
    let series = recording.series.iter().map(|series| {
        let suffix = series.unit.column_suffix();
        let id = &series.benchmark;
        let has_sigma = series.readings.iter().any(|row| row.sigma.is_some());
        Outgoing {
            name: format!("{id}_{}_{suffix}", series.quantity()),
            rows: series.readings.iter().map(|row| (row.time, *row)).collect(),
            sigma: has_sigma.then(|| format!("{id}_sigma_{suffix}")),
            next: 0,
            title: id.as_str(),
        }
    });
    let channels = recording.channels.iter().map(|channel| {
        let as_reading = |sample: &Sample| Reading {
            time: sample.time,
            value: sample.value,
            sigma: None,
        };
        let samples = channel.samples.iter();
        Outgoing {
            name: channel.name.clone(),
            rows: samples.map(|row| (row.time, as_reading(row))).collect(),
            sigma: None,
            next: 0,
            title: &channel.name,
        }
    });
    let columns = series.chain(channels);
    columns.filter(|column| !column.rows.is_empty()).collect()
}

fn refuse_unreadable(recording: &Recording, columns: &[Outgoing<'_>]) -> Result<(), IngestError> {
    let fail = |name: &str, problem, expected| IngestError::Unwritable {
        name: name.to_owned(),
        problem,
        expected,
    };
    for series in &recording.series {
        let id = series.benchmark.as_str();
        let name = format!("{id}_displacement_mm");
        let read = name_of(&name);
        if read != Name::Measure(Some(id), Measure::Reading(Unit::MM)) || id.trim() != id {
            return Err(fail(
                id,
                "no CSV column can have this benchmark's name",
                "another name",
            ));
        }
    }
    for channel in &recording.channels {
        let name = channel.name.as_str();
        if !matches!(name_of(name), Name::Channel(_)) || name.is_empty() || name.trim() != name {
            let problem = "a CSV column of this name would not be read as a covariate";
            return Err(fail(name, problem, "another name"));
        }
    }
    let mut names = BTreeSet::new();
    for column in columns {
        if !names.insert(&column.name) || name_breaks_lines(&column.name) {
            return Err(fail(
                &column.name,
                "the name stands twice or has a line break",
                "every name once, on one line",
            ));
        }
        if !column.rows.is_sorted_by(|a, b| a.0 < b.0) {
            return Err(fail(
                column.title,
                "rows out of order",
                "strictly increasing times",
            ));
        }
        if !column.rows.iter().all(|row| row.1.is_sound()) {
            let expected = "finite values, and standard errors above zero";
            return Err(fail(column.title, "a value that is not finite", expected));
        }
    }
    Ok(())
}

fn name_breaks_lines(name: &str) -> bool {
    name.contains(['\n', '\r'])
}
