//! CSV files, one line at a time, for whole files and for files still being written.
//!
//! A cell is empty where there is no reading; a standard error without a reading is passed over.
//! Every other cell holds one finite number, or a mark that the sensor gave none. Times are kept as
//! instants: the offset in which they were written is not.

use super::again::HeaderReadings;
use super::columns::{Layout, Meaning};
use super::remark::Remark;
use super::split::Splitter;
use super::table::TableRows;
use super::table_write::write_csv;
use super::taken::LineResult;
use super::text_format::{LineReader, TextFormat};
use super::units_row;
use super::{IngestError, Item, ReadOptions};
use crate::reading::{Delimiter, Dialect};
use ::csv::StringRecord;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A header and separated rows.
pub static CSV: TextFormat = TextFormat {
    name: "csv",
    extensions: &["csv", "tsv", "txt"],
    begins: |_| true,
    reader: |file, options| Box::new(CsvReader::new(file, options)),
    write: |recording, out| write_csv(recording, out),
    states_averaging: false,
};

/// Reads one file line by line: the first line is a header, but for remarks and what the dialect passes over.
#[derive(Debug)]
struct CsvReader {
    file: PathBuf,
    options: ReadOptions,
    /// None before a header that is understood.
    rows: Option<CsvRows>,
}

impl CsvReader {
    fn new(file: &Path, options: &ReadOptions) -> Self {
        Self {
            file: file.into(),
            options: options.clone(),
            rows: None,
        }
    }

    fn table(&self) -> Option<&TableRows> {
        self.rows.as_ref()?.table.as_ref()
    }
}

/// What a line of remarks begins with.
const COMMENT: char = '#';

/// What a spreadsheet writes in the first line to say what parts the cells.
const STATED_DELIMITER: &str = "sep=";

/// Whether a line before the header is none: one of those that the config passes over, a remark, a first one such as `sep=;`, or a blank
/// one after these. What
/// begins as a remark and has the columns of the time that the config names is the header.
pub(super) fn stands_before_header(line: u64, text: &str, dialect: &Dialect) -> bool {
    if line <= dialect.skip_lines {
        return true;
    }
    let text = text.trim_start_matches('\u{feff}').trim();
    let has_times = !dialect.time_columns.is_empty()
        && dialect.time_columns.iter().all(|one| text.contains(one));
    let states_delimiter = line == 1
        && (text.strip_prefix(STATED_DELIMITER)).is_some_and(|rest| rest.chars().count() <= 1);
    text.starts_with(COMMENT) && !has_times || text.is_empty() && line > 1 || states_delimiter
}

impl LineReader for CsvReader {
    fn take(&mut self, line: u64, text: &str) -> LineResult {
        if let Some(rows) = &mut self.rows {
            return rows.row(line, text).into();
        }
        if stands_before_header(line, text, &self.options.dialect) {
            return LineResult::default();
        }
        let rows = CsvRows::at_line(line, text, &self.file, &self.options);
        rows.map(|rows| {
            self.rows = Some(rows);
            Vec::new()
        })
        .into()
    }

    fn take_remarks(&mut self) -> Vec<Remark> {
        let table = self.rows.as_mut().and_then(|rows| rows.table.as_mut());
        table.map_or_else(Vec::new, TableRows::take_remarks)
    }

    fn take_fault(&mut self) -> Option<IngestError> {
        self.rows.as_mut()?.take_fault()
    }

    fn meanings(&self) -> Vec<(String, Meaning)> {
        self.table().map_or_else(Vec::new, TableRows::meanings)
    }

    fn takes_latin1(&self) -> bool {
        true
    }

    fn is_lost(&self) -> bool {
        self.rows.is_none()
    }

    fn header(&self) -> &[String] {
        self.rows.as_ref().map_or(&[], |rows| &rows.header)
    }

    fn units_line(&self) -> BTreeMap<String, String> {
        let rows = self.rows.as_ref();
        rows.map_or_else(BTreeMap::new, |rows| rows.units.clone())
    }

    fn columns(&self) -> Vec<String> {
        let rows = self.rows.as_ref();
        rows.map_or_else(Vec::new, |rows| rows.readings.names().to_vec())
    }

    fn finish(&self) -> Result<(), IngestError> {
        self.rows.as_ref().map_or(Ok(()), CsvRows::finish)
    }
}

/// Reads the rows of one file, one at a time; what the columns are is decided by the header alone.
#[derive(Debug)]
pub struct CsvRows {
    file: PathBuf,
    options: ReadOptions,
    /// The line in force, behind as many as are passed over; none where the latest one was not understood.
    header: Vec<String>,
    table: Option<TableRows>,
    /// The names in the latest header, as they stand there.
    names: Vec<String>,
    readings: HeaderReadings,
    /// By column what the latest line of units below a header says.
    units: BTreeMap<String, String>,
    /// No row has come below the header, which such a line may follow.
    is_below_header: bool,
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
        Self::at_line(1, header, file, options)
    }

    /// The same of a header on a later line.
    fn at_line(
        line: u64,
        header: &str,
        file: &Path,
        options: &ReadOptions,
    ) -> Result<Self, IngestError> {
        let header = header.strip_prefix('\u{feff}').unwrap_or(header);
        let stated = options.dialect.delimiter;
        let delimiter = stated.unwrap_or_else(|| Delimiter::of_header(header));
        let mut rows = Self {
            file: file.into(),
            options: options.clone(),
            header: Vec::new(),
            table: None,
            names: Vec::new(),
            readings: HeaderReadings::default(),
            units: BTreeMap::new(),
            is_below_header: false,
            splitter: Splitter::new(delimiter),
            cells: StringRecord::new(),
        };
        rows.splitter
            .split(header, &mut rows.cells)
            .map_err(|found| IngestError::BadHeader {
                file: file.into(),
                line,
                found,
            })?;
        if rows.cells.iter().all(str::is_empty) {
            return Err(IngestError::Empty {
                file: file.into(),
                missing: "header",
            });
        }
        rows.read_header(line, header)?;
        Ok(rows)
    }

    /// The columns' names, in their order.
    pub fn columns(&self) -> &[String] {
        self.table.as_ref().map_or(&[], TableRows::names)
    }

    /// What one row holds, nothing if it is blank or a header again, whose columns then hold for what
    /// follows; `line` is its number in the file, the header being 1.
    ///
    /// # Errors
    /// [`IngestError::Line`] or [`IngestError::Field`] names the place; the parser is unharmed and takes
    /// the next row. [`IngestError::Header`] for a header that is not understood: no row is taken
    /// before one that is. A cell that is no number costs its own value alone: see
    /// [`CsvRows::take_fault`].
    pub fn row(&mut self, line: u64, text: &str) -> Result<Vec<Item>, IngestError> {
        // A logger that opens its file again may begin with it again.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let expected = self.columns().len();
        self.splitter
            .split(text, &mut self.cells)
            .map_err(|found| IngestError::Line {
                file: self.file.clone(),
                line,
                found,
                expected,
            })?;
        if self.cells.is_empty() {
            return Ok(Vec::new());
        }
        if self.is_header() {
            self.header.clear();
            self.table = None;
            return self.read_header(line, text).map(|()| Vec::new());
        }
        if std::mem::take(&mut self.is_below_header) && self.is_of_units(line, text)? {
            return Ok(Vec::new());
        }
        match &mut self.table {
            Some(table) => table.items(line, &self.cells),
            None => Err(IngestError::NoHeader {
                file: self.file.clone(),
                line,
            }),
        }
    }

    /// What of the last row could not be used, where the rest of it could.
    pub fn take_fault(&mut self) -> Option<IngestError> {
        self.table.as_mut()?.take_fault()
    }

    /// A logger that starts again writes its header again; no other row has the name of a time for a time. So is a row without any
    /// number that has the names of most columns: what the others are called is then another matter, and is not understood.
    fn is_header(&self) -> bool {
        let dialect = &self.options.dialect;
        if !self.cells.iter().any(|cell| dialect.number(cell).is_some()) {
            let names_again = self.cells.iter().filter(|cell| {
                let mut names = self.columns().iter();
                !cell.is_empty() && names.any(|name| name == cell)
            });
            if 2 * names_again.count() > self.cells.len() {
                return true;
            }
        }
        let stated = &dialect.time_columns;
        if !stated.is_empty() {
            return stated
                .iter()
                .all(|name| self.cells.iter().any(|cell| cell == name));
        }
        let is_name = |cell: &str| {
            ["time", "t_days"]
                .iter()
                .any(|name| cell.eq_ignore_ascii_case(name))
        };
        self.cells.iter().any(is_name)
    }

    /// Takes a line of units below the header, where this is one: columns that are readings with their unit become such.
    fn is_of_units(&mut self, line: u64, text: &str) -> Result<bool, IngestError> {
        let Some(table) = &mut self.table else {
            return Ok(false);
        };
        let (names, maps) = (&self.names, &self.options.columns);
        let Some(units) = units_row::units_of(&self.cells, names, &self.options.dialect) else {
            return Ok(false);
        };
        let contradictions = units_row::contradictions(names, &units, maps);
        let full = units_row::with_units(names, &units, maps);
        self.units = units;
        if full == table.names() {
            table.add_remarks(contradictions);
        } else {
            let mut layout = Layout::new(&self.file, line, full, &self.options)?;
            self.readings.follow(line, &mut layout);
            layout.remarks.extend(contradictions);
            self.table = Some(TableRows::new(&self.file, layout, &self.options));
        }
        self.header.push(text.to_owned());
        Ok(true)
    }

    fn read_header(&mut self, line: u64, text: &str) -> Result<(), IngestError> {
        self.names = self.cells.iter().map(str::to_owned).collect();
        // A header that comes again has the units below it again.
        let names = units_row::with_units(&self.names, &self.units, &self.options.columns);
        let mut layout = Layout::new(&self.file, line, names, &self.options)?;
        self.is_below_header = true;
        self.readings.follow(line, &mut layout);
        self.table = Some(TableRows::new(&self.file, layout, &self.options));
        // A reader that goes on from a later line takes them as the file's first: blank ones pass for those before the header.
        let skipped = (0..self.options.dialect.skip_lines).map(|_| String::new());
        self.header = skipped.chain([text.to_owned()]).collect();
        Ok(())
    }

    fn finish(&self) -> Result<(), IngestError> {
        let Some(table) = &self.table else {
            return Ok(());
        };
        if table.is_empty() {
            return Err(IngestError::Empty {
                file: self.file.clone(),
                missing: "row",
            });
        }
        match table.unfilled() {
            None => Ok(()),
            Some(column) => Err(IngestError::EmptyColumn {
                file: self.file.clone(),
                column: column.clone(),
            }),
        }
    }
}
