//! Campbell TOA5 tables, one line at a time: four lines of header, then the rows of a logger.
//!
//! A column is what its name says by the rules of CSV; where the name has no unit, the units line
//! gives it (`5_displacement` in `mm` is `5_displacement_mm`, `Rain_Tot` in `mm` is `Rain_Tot_mm`). Record
//! numbers and the times of extremes are not read. A logger that starts again writes its header
//! again, in the middle of the file.

use super::again::HeaderReadings;
use super::column_map::{ColumnMap, Measure};
use super::columns::{Column, Layout, Meaning};
use super::names::{Name, channel_unit, name_of, with_unit_of_motion};
use super::remark::Remark;
use super::split::Splitter;
use super::table::TableRows;
use super::table_write::write_toa5;
use super::taken::LineResult;
use super::text_format::{LineReader, TextFormat};
use super::{IngestError, Item, ReadOptions};
use crate::reading::{Delimiter, Dialect, Unit};
use ::csv::StringRecord;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What stands in the place of a unit of the times.
const UNITS_OF_TIME: &str = "TS";
/// Lines of a header: environment, names, units, processing.
const HEADER_LINES: usize = 4;
/// How an environment line begins.
const MARK: &str = "\"TOA5\"";
/// The same without quotes.
const BARE_MARK: &str = "TOA5,";
/// What a column of times of extremes says of its processing.
const TIMES_OF_EXTREMES: [&str; 2] = ["TMx", "TMn"];

/// A Campbell logger's table.
pub static TOA5: TextFormat = TextFormat {
    name: "toa5",
    extensions: &["dat"],
    begins: |text| text.starts_with(MARK.as_bytes()) || text.starts_with(BARE_MARK.as_bytes()),
    reader: |file, options| Box::new(Toa5Rows::new(file, options)),
    write: |recording, out| write_toa5(recording, out),
    states_averaging: false,
};

impl LineReader for Toa5Rows {
    fn take(&mut self, line: u64, text: &str) -> LineResult {
        self.row(line, text).into()
    }

    fn take_remarks(&mut self) -> Vec<Remark> {
        (self.table.as_mut()).map_or_else(Vec::new, TableRows::take_remarks)
    }

    fn take_fault(&mut self) -> Option<IngestError> {
        self.table.as_mut()?.take_fault()
    }

    fn meanings(&self) -> Vec<(String, Meaning)> {
        (self.table.as_ref()).map_or_else(Vec::new, TableRows::meanings)
    }

    /// Whether the file began with something else than a header.
    fn is_lost(&self) -> bool {
        self.is_new && self.header.is_empty()
    }

    /// The four lines in force; none before they have come.
    fn header(&self) -> &[String] {
        match self.table {
            Some(_) => &self.header,
            None => &[],
        }
    }

    fn units_line(&self) -> BTreeMap<String, String> {
        self.units_line.clone()
    }

    fn columns(&self) -> Vec<String> {
        self.readings.names().to_vec()
    }
}

/// Reads one file line by line.
#[derive(Debug)]
struct Toa5Rows {
    file: PathBuf,
    options: ReadOptions,
    /// The header in force, or as much of it as has come.
    header: Vec<String>,
    table: Option<TableRows>,
    readings: HeaderReadings,
    /// By column its unit as the header has it, where that is none that can be read.
    units_line: BTreeMap<String, String>,
    /// Before the first header that is understood.
    is_new: bool,
    splitter: Splitter,
    cells: StringRecord,
}

impl Toa5Rows {
    fn new(file: &Path, options: &ReadOptions) -> Self {
        let conventions = options.conventions.clone().of_a_logger();
        Self {
            file: file.into(),
            options: ReadOptions {
                conventions,
                // A logger writes them all alike.
                dialect: Dialect::default(),
                ..options.clone()
            },
            header: Vec::new(),
            table: None,
            readings: HeaderReadings::default(),
            units_line: BTreeMap::new(),
            is_new: true,
            splitter: Splitter::new(Delimiter::Comma),
            cells: StringRecord::new(),
        }
    }

    fn row(&mut self, line: u64, text: &str) -> Result<Vec<Item>, IngestError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let plain = text.trim_start();
        if plain.starts_with(MARK) || plain.starts_with(BARE_MARK) {
            self.table = None;
            self.header = vec![plain.to_owned()];
            return Ok(Vec::new());
        }
        if let Some(at) = text.find(MARK) {
            // The power failed within a row, and the logger began again behind it.
            self.table = None;
            self.header = vec![text[at..].to_owned()];
            return Err(self.line_fault(line, "a header within the line".to_owned()));
        }
        if self.table.is_none() && !self.header.is_empty() {
            self.header.push(text.to_owned());
            if self.header.len() == HEADER_LINES {
                self.read_header(line)?;
            }
            return Ok(Vec::new());
        }
        if text.trim().is_empty() {
            return Ok(Vec::new());
        }
        let Some(table) = &mut self.table else {
            return Err(IngestError::NoHeader {
                file: self.file.clone(),
                line,
            });
        };
        match self.splitter.split(text, &mut self.cells) {
            Ok(()) => table.items(line, &self.cells),
            Err(found) => Err(self.line_fault(line, found)),
        }
    }

    fn line_fault(&self, line: u64, found: String) -> IngestError {
        IngestError::Line {
            file: self.file.clone(),
            line,
            found,
            expected: self.table.as_ref().map_or(0, |table| table.names().len()),
        }
    }

    /// Takes the header that has just become complete at `line`; none is in force where it is bad.
    fn read_header(&mut self, line: u64) -> Result<(), IngestError> {
        let understood = self.layout(line);
        match understood {
            Ok(mut layout) => {
                self.readings.follow(line - 2, &mut layout);
                self.is_new = false;
                self.table = Some(TableRows::new(&self.file, layout, &self.options));
                Ok(())
            }
            Err(error) => {
                self.header.clear();
                Err(error)
            }
        }
    }

    fn layout(&mut self, line: u64) -> Result<Layout, IngestError> {
        let [names, units, processing] = [1, 2, 3].map(|row: usize| {
            let split = self.splitter.split(&self.header[row], &mut self.cells);
            split.map(|()| self.cells.clone())
        });
        let bad = |found: String| IngestError::BadHeader {
            file: self.file.clone(),
            line: line - 2,
            found,
        };
        let (names, units) = (names.map_err(bad)?, units.map_err(bad)?);
        let processing = processing.map_err(bad)?;
        if names.len() != units.len() || names.len() != processing.len() {
            let counts = [names.len(), units.len(), processing.len()];
            return Err(bad(format!(
                "{counts:?} names, units and kinds of processing"
            )));
        }
        if names.get(0) != Some("TIMESTAMP") {
            return Err(bad(format!("{:?} and no TIMESTAMP", names.get(0))));
        }
        let mut restated = Vec::new();
        let columns = names.iter().zip(&units);
        let meant = columns.map(|(name, unit)| {
            if let Some(map) = self.map_in_another_unit(name, unit) {
                let column = map.column.clone();
                restated.push(map);
                return Ok(column);
            }
            self.full_name(line - 2, name, unit)
        });
        let meant = meant.collect::<Result<Vec<String>, IngestError>>()?;
        let options = self.options.with_columns(restated);
        let stated = meant.iter().zip(&units);
        let unread = stated.filter(|(_, unit)| {
            let is_known = Unit::parse(unit).is_ok() || known_suffix(unit).is_some();
            !unit.trim().is_empty() && !is_known && *unit != UNITS_OF_TIME && *unit != "RN"
        });
        self.units_line = unread
            .map(|(name, unit)| (name.clone(), unit.to_owned()))
            .collect();
        let mut layout = Layout::new(&self.file, line - 2, meant, &options)?;
        layout.remarks.extend(self.doubtful_units());
        for (column, (name, kind)) in layout.columns.iter_mut().zip(names.iter().zip(&processing)) {
            if name == "RECORD" || TIMES_OF_EXTREMES.contains(&kind) {
                *column = Column::Ignored;
            }
        }
        Ok(layout)
    }

    /// Columns of readings in the unit that is stated of them, for which the header has one that cannot be read.
    fn doubtful_units(&self) -> impl Iterator<Item = Remark> {
        self.options.columns.iter().filter_map(|map| {
            let named = self.units_line.get(&map.column)?;
            let (Measure::Reading(unit) | Measure::Sigma(unit)) = map.measure;
            Some(Remark::new(format!("column {:?}", map.column), format!(
                    "the units line has {named:?} for it, which is no unit that can be read, and it is taken in {unit}: is that right?"
                )))
        })
    }

    /// What the config maps to a column, in the unit that a header which comes again gives it: what stands below it is in that one.
    fn map_in_another_unit(&self, name: &str, unit: &str) -> Option<ColumnMap> {
        let stated = Unit::parse(unit).ok().filter(|_| !self.is_new)?;
        let mut maps = self.options.columns.iter();
        maps.find_map(|map| {
            let (Measure::Reading(meant) | Measure::Sigma(meant)) = map.measure;
            let is_it =
                map.column == name || map.column == format!("{name}_{}", meant.column_suffix());
            let measure = match map.measure {
                Measure::Reading(_) => Measure::Reading(stated),
                Measure::Sigma(_) => Measure::Sigma(stated),
            };
            let is_other = meant != stated && meant.quantity() == stated.quantity();
            (is_it && is_other).then(|| ColumnMap {
                measure,
                ..map.clone()
            })
        })
    }

    /// The name with its unit, as a CSV file would have it.
    fn full_name(&self, line: u64, name: &str, unit: &str) -> Result<String, IngestError> {
        let stated = Unit::parse(unit).ok();
        let map = |map: &&ColumnMap| map.column == name;
        let (full, meant) = match (self.options.columns.iter().find(map), name_of(name)) {
            _ if name == "TIMESTAMP" => return Ok("time".to_owned()),
            (Some(map), _) => (name.to_owned(), Some(map.measure)),
            (None, Name::Measure(_, measure)) => (name.to_owned(), Some(measure)),
            (None, _) => {
                let full = with_unit(name, unit, stated);
                let mut maps = self.options.columns.iter();
                let map = maps.find(|map| map.column == full);
                (full, map.map(|map| map.measure))
            }
        };
        let meant = meant.map(|(Measure::Reading(unit) | Measure::Sigma(unit))| unit);
        match (meant, stated) {
            (Some(meant), Some(stated)) if meant != stated => Err(IngestError::Header {
                file: self.file.clone(),
                line,
                column: name.to_owned(),
                problem: "the units line gives it another unit",
                expected: "one unit, in the name or the config and in the units line",
            }),
            _ => Ok(full),
        }
    }
}

/// The name of a column whose own has no unit, with that of the units line where it is a known one.
fn with_unit(name: &str, unit: &str, stated: Option<Unit>) -> String {
    if let Some(full) = stated.and_then(|stated| with_unit_of_motion(name, stated)) {
        return full;
    }
    match known_suffix(unit) {
        Some(suffix) if channel_unit(name).is_none() => format!("{name}_{suffix}"),
        Some(_) | None => name.to_owned(),
    }
}

/// A unit as the name of a covariate has it at its end, where it is a known one.
fn known_suffix(unit: &str) -> Option<String> {
    let suffix = unit.trim().to_ascii_lowercase();
    let suffix = suffix
        .replace('/', "_per_")
        .replace(' ', "_")
        .replace('%', "percent");
    channel_unit(&format!("_{suffix}"))
        .is_some()
        .then_some(suffix)
}
