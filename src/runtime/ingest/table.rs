//! Rows of a table whose columns are understood: cells in, readings and covariates out.

use super::columns::{Column, Layout, Meaning, SigmaColumn};
use super::message::WITHIN_REACH;
use super::vector::{self, VectorColumns};
use super::{IngestError, Item, ReadOptions, Remark};
use crate::reading::{BenchmarkId, DecimalMark, Reading, Sample, Timestamp, Unit, after_days};
use ::csv::StringRecord;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Characters of a text that are shown of it.
const SHOWN: usize = 40;
/// So many rows one after the other that lack as many cells at their end have been written so: a logger leaves out the last ones where they are
/// empty. A row that was torn is one alone.
const WRITTEN_SHORT: u32 = 3;
/// A time and a value.
const FEWEST_CELLS: usize = 2;

/// Rows one after the other that lack cells at their end.
#[derive(Debug, Clone, Copy, Default)]
struct ShortRows {
    cells: usize,
    count: u32,
}

/// Reads the rows under one header.
#[derive(Debug)]
pub(super) struct TableRows {
    file: PathBuf,
    layout: Layout,
    vectors: Vec<VectorColumns>,
    options: ReadOptions,
    filled: Vec<bool>,
    /// Columns that have held a number: what is no number in one of them is a fault, in others text.
    numeric: Vec<bool>,
    short: ShortRows,
    /// What has been found out and not been reported.
    remarks: Vec<Remark>,
    /// What of the last row could not be used, where the rest could.
    fault: Option<IngestError>,
}

impl TableRows {
    pub(super) fn new(file: &Path, mut layout: Layout, options: &ReadOptions) -> Self {
        Self {
            file: file.into(),
            filled: vec![false; layout.names.len()],
            numeric: vec![false; layout.names.len()],
            short: ShortRows::default(),
            remarks: std::mem::take(&mut layout.remarks),
            fault: None,
            vectors: vector::claim(&mut layout, &options.vectors),
            layout,
            options: options.clone(),
        }
    }

    /// The columns' names, in their order.
    pub(super) fn names(&self) -> &[String] {
        &self.layout.names
    }

    /// What has been found out about the columns from elsewhere.
    pub(super) fn add_remarks(&mut self, remarks: Vec<Remark>) {
        self.remarks.extend(remarks);
    }

    /// What one row holds; `line` is its number in the file. A cell that is no number costs its own value alone: what is wrong with
    /// it is to be asked with [`TableRows::take_fault`].
    pub(super) fn items(
        &mut self,
        line: u64,
        cells: &StringRecord,
    ) -> Result<Vec<Item>, IngestError> {
        let cells = &*self.as_wide_as_the_header(line, cells)?;
        let row = TableRow {
            rows: self,
            cells,
            line,
        };
        let Met {
            items,
            numbers,
            texts,
            fault,
            ..
        } = row.items()?;
        self.fault = fault;
        for index in numbers {
            self.numeric[index] = true;
        }
        for index in texts {
            if !self.is_text(index) {
                self.remarks.push(self.text_column(index, &cells[index]));
            }
        }
        for (filled, cell) in self.filled.iter_mut().zip(cells) {
            *filled |= !cell.is_empty();
        }
        Ok(items)
    }

    /// A row with as many cells as the header has names: what it has more is empty, and what it lacks is, where the rows before lack as much.
    fn as_wide_as_the_header<'a>(
        &mut self,
        line: u64,
        cells: &'a StringRecord,
    ) -> Result<Cow<'a, StringRecord>, IngestError> {
        let expected = self.layout.names.len();
        let found = cells.len();
        if found >= expected - self.layout.nameless_at_end() {
            self.short = ShortRows::default();
            if cells.iter().skip(expected).all(str::is_empty) {
                return Ok(Cow::Borrowed(cells));
            }
        } else if found >= FEWEST_CELLS {
            let goes_on = self.short.cells == found;
            self.short = ShortRows {
                cells: found,
                count: if goes_on {
                    self.short.count.saturating_add(1)
                } else {
                    1
                },
            };
            if self.short.count == WRITTEN_SHORT {
                self.remarks.push(self.written_short(line));
            }
            if self.short.count >= WRITTEN_SHORT {
                let mut whole = cells.clone();
                (found..expected).for_each(|_| whole.push_field(""));
                return Ok(Cow::Owned(whole));
            }
        }
        Err(IngestError::Line {
            file: self.file.clone(),
            line,
            found: format!("{found} fields"),
            expected,
        })
    }

    fn written_short(&self, line: u64) -> Remark {
        let missing = self.layout.names[self.short.cells..].join(", ");
        Remark::new(
            format!("line {line}"),
            format!(
                "it has {} fields as those before it, {} less than the header: nothing is taken for {missing}",
                self.short.cells,
                self.layout.names.len() - self.short.cells
            ),
        )
    }

    /// Whether no row has held anything so far.
    pub(super) fn is_empty(&self) -> bool {
        !self.filled.contains(&true)
    }

    /// Whether the column has held text and no number.
    fn is_text(&self, index: usize) -> bool {
        let is_channel = matches!(self.layout.columns[index], Column::Channel { .. });
        is_channel && self.filled[index] && !self.numeric[index]
    }

    fn text_column(&self, index: usize, found: &str) -> Remark {
        let shown: String = found.chars().take(SHOWN).collect();
        let comma = self.options.dialect.decimal == DecimalMark::Point
            && found.replacen(',', ".", 1).parse::<f64>().is_ok();
        let cure = if comma {
            "if it is a number, set decimal (--decimal) to comma"
        } else {
            "if it is a covariate's mark for no value, add it to missing (--missing)"
        };
        Remark::new(
            format!("column {:?}", self.layout.names[index]),
            format!("found {shown:?}, which is no number: no covariate, and not used; {cure}"),
        )
    }

    /// What of the last row could not be used.
    pub(super) fn take_fault(&mut self) -> Option<IngestError> {
        self.fault.take()
    }

    /// What has been found out since it was last asked.
    pub(super) fn take_remarks(&mut self) -> Vec<Remark> {
        std::mem::take(&mut self.remarks)
    }

    /// What each column is taken for.
    pub(super) fn meanings(&self) -> Vec<(String, Meaning)> {
        let columns = self.layout.names.iter().zip(&self.layout.columns);
        let has_name = |(_, (name, _)): &(usize, (&String, &Column))| !name.is_empty();
        let meaning = |(index, (name, column)): (usize, (&String, &Column))| {
            let is_channel = matches!(column, Column::Channel { .. });
            let meaning = match (self.filled[index], self.numeric[index]) {
                (false, _) if is_channel => Meaning::Empty,
                (true, false) if is_channel => Meaning::Text,
                (true | false, _) => column.meaning(),
            };
            (name.clone(), meaning)
        };
        columns.enumerate().filter(has_name).map(meaning).collect()
    }

    /// The first column that should hold readings, or their times, and has held nothing so far.
    pub(super) fn unfilled(&self) -> Option<&String> {
        let columns = self.layout.columns.iter().zip(&self.filled);
        let is_needed = |column: &Column| {
            !matches!(
                column,
                Column::Channel { .. } | Column::Ignored | Column::Nameless
            )
        };
        let mut empty = columns.zip(&self.layout.names);
        empty.find_map(|((column, filled), name)| (!filled && is_needed(column)).then_some(name))
    }
}

/// What a row holds, and which columns have shown what they are.
#[derive(Default)]
struct Met {
    items: Vec<Item>,
    /// Columns of covariates with their first number.
    numbers: Vec<usize>,
    /// Columns of covariates with text.
    texts: Vec<usize>,
    /// Benchmarks whose reading is no number, and what stands there.
    unread: Vec<(BenchmarkId, String)>,
    /// The first of the cells that are wrong.
    fault: Option<IngestError>,
}

impl Met {
    /// Sets a cell aside.
    fn set_aside(&mut self, fault: IngestError) {
        self.fault = self.fault.take().or(Some(fault));
    }
}

/// What stands in a cell.
enum TableCell {
    Empty,
    /// A mark that the sensor gave no value.
    Missing,
    Number(f64),
}

struct TableRow<'a> {
    rows: &'a TableRows,
    cells: &'a StringRecord,
    line: u64,
}

impl TableRow<'_> {
    fn items(&self) -> Result<Met, IngestError> {
        let layout = &self.rows.layout;
        let time = self.time()?;
        let mut met = Met::default();
        for (index, column) in layout.columns.iter().enumerate() {
            match column {
                Column::Reading {
                    benchmark,
                    unit,
                    sigma,
                } => {
                    let sigma = sigma.map_or(Ok(None), |sigma| self.sigma(sigma, *unit));
                    let sigma = sigma.unwrap_or_else(|fault| {
                        met.set_aside(fault);
                        None
                    });
                    match self.reading(time, index, benchmark, *unit, sigma) {
                        Ok(item) => met.items.extend(item),
                        Err(fault) => {
                            let what = self.cells[index].to_owned();
                            met.unread.push((benchmark.clone(), what));
                            met.set_aside(fault);
                        }
                    }
                }
                Column::Channel { unit } => match self.cell(index) {
                    Ok(TableCell::Number(value)) => {
                        met.numbers
                            .extend((!self.rows.numeric[index]).then_some(index));
                        met.items.push(Item::Sample {
                            channel: layout.names[index].clone(),
                            unit: unit.clone(),
                            sample: Sample { time, value },
                        });
                    }
                    Ok(TableCell::Empty | TableCell::Missing) => {}
                    Err(fault) if self.rows.numeric[index] => met.set_aside(fault),
                    Err(_) => met.texts.push(index),
                },
                Column::Nameless => self.nothing(index)?,
                Column::Time
                | Column::Days
                | Column::Sigma
                | Column::Component { .. }
                | Column::Ignored => {}
            }
        }
        for vector in &self.rows.vectors {
            match self.vector(time, vector) {
                Ok(item) => met.items.extend(item),
                Err(fault) => {
                    let what = "a component that cannot be used".to_owned();
                    met.unread.push((vector.benchmark.clone(), what));
                    met.set_aside(fault);
                }
            }
        }
        // A row of which nothing can be used may be torn, and says nothing of its sensors.
        if !met.items.is_empty() {
            let unread = std::mem::take(&mut met.unread).into_iter();
            met.items
                .extend(unread.map(|(benchmark, what)| Item::Missing {
                    benchmark,
                    time,
                    what: what.chars().take(SHOWN).collect(),
                }));
        }
        Ok(met)
    }

    /// Whether a column that has no name holds nothing.
    fn nothing(&self, index: usize) -> Result<(), IngestError> {
        match self.cells.get(index) {
            None | Some("") => Ok(()),
            Some(_) => Err(self.fail(
                index,
                "an empty cell, or a name for this column in the header",
            )),
        }
    }

    /// The projection of a vector; with a component missing it is missing as a whole.
    fn vector(&self, time: Timestamp, vector: &VectorColumns) -> Result<Option<Item>, IngestError> {
        let names = &self.rows.layout.names;
        let missing = |what| {
            Some(Item::Missing {
                benchmark: vector.benchmark.clone(),
                time,
                what,
            })
        };
        let (mut value, mut absent, mut numbers) = (0.0, Vec::new(), Vec::new());
        for &(index, part) in &vector.components {
            match self.cell(index)? {
                TableCell::Number(component) => {
                    value += part * component;
                    numbers.push((index, component));
                }
                TableCell::Empty => absent.push(&names[index]),
                TableCell::Missing => {
                    let what = format!("{} in {}", &self.cells[index], names[index]);
                    return Ok(missing(what));
                }
            }
        }
        if absent.len() == vector.components.len() {
            return Ok(None);
        }
        if let Some(name) = absent.first() {
            return Ok(missing(format!("nothing in {name}")));
        }
        let (unit, sigma) = (vector.unit, None);
        if let Some((index, _)) = numbers
            .iter()
            .find(|(_, value)| !unit.is_within_reach(*value))
        {
            return Err(self.fail(*index, WITHIN_REACH));
        }
        if !unit.is_within_reach(value) {
            let largest = numbers
                .iter()
                .max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()));
            let index = largest.map_or(vector.components[0].0, |(index, _)| *index);
            return Err(self.fail(index, "components whose sum along the direction is 1e11 mm (100,000 km), or 1e9 mm/day, at most"));
        }
        Ok(Some(Item::Reading {
            benchmark: vector.benchmark.clone(),
            unit,
            averaging: self.rows.options.averaging_of(unit, None),
            reading: Reading { time, value, sigma },
        }))
    }

    fn reading(
        &self,
        time: Timestamp,
        index: usize,
        benchmark: &BenchmarkId,
        unit: Unit,
        sigma: Option<f64>,
    ) -> Result<Option<Item>, IngestError> {
        Ok(match self.cell(index)? {
            TableCell::Empty => None,
            TableCell::Missing => Some(Item::Missing {
                benchmark: benchmark.clone(),
                time,
                what: self.cells[index].to_owned(),
            }),
            TableCell::Number(value) if !unit.is_within_reach(value) => {
                return Err(self.fail(index, WITHIN_REACH));
            }
            TableCell::Number(value) => Some(Item::Reading {
                benchmark: benchmark.clone(),
                unit,
                averaging: self.rows.options.averaging_of(unit, None),
                reading: Reading { time, value, sigma },
            }),
        })
    }

    fn time(&self) -> Result<Timestamp, IngestError> {
        let (layout, options) = (&self.rows.layout, &self.rows.options);
        let index = layout.time[0];
        if layout.columns[index] == Column::Days {
            let days = match self.cell(index)? {
                TableCell::Number(days) => after_days(options.epoch, days),
                TableCell::Empty | TableCell::Missing => None,
            };
            return days.ok_or_else(|| self.fail(index, "a number of days within the calendar"));
        }
        let text = match &layout.time[..] {
            [only] => Cow::Borrowed(&self.cells[*only]),
            parts => {
                let parts: Vec<&str> = parts.iter().map(|part| &self.cells[*part]).collect();
                Cow::Owned(parts.join(" "))
            }
        };
        let clock = &options.conventions.clock;
        let instant = options.dialect.instant(&text, clock);
        instant.map_err(|fault| IngestError::Field {
            file: self.rows.file.clone(),
            line: self.line,
            column: layout.names[index].clone(),
            value: text.into_owned(),
            expected: fault.expected(),
        })
    }

    fn cell(&self, index: usize) -> Result<TableCell, IngestError> {
        let cell = &self.cells[index];
        if cell.is_empty() {
            return Ok(TableCell::Empty);
        }
        let marks = &self.rows.options.conventions.missing;
        match self.rows.options.dialect.number(cell) {
            Some(value) if value.is_finite() && marks.has_number(value) => Ok(TableCell::Missing),
            Some(value) if value.is_finite() => Ok(TableCell::Number(value)),
            _ if marks.has(cell) => Ok(TableCell::Missing),
            _ => Err(self.fail(index, self.a_number())),
        }
    }

    /// What should stand in a cell.
    fn a_number(&self) -> &'static str {
        match self.rows.options.dialect.decimal {
            DecimalMark::Point => {
                "a finite number, or an empty cell where it is missing; for a decimal comma set decimal (--decimal) to comma, for marks between thousands thousands (--thousands), for another mark of no value missing (--missing)"
            }
            DecimalMark::Comma => {
                "a finite number with a decimal comma, or an empty cell where it is missing; for marks between thousands set thousands (--thousands)"
            }
        }
    }

    /// The standard error in the reading's own unit.
    fn sigma(&self, column: SigmaColumn, unit: Unit) -> Result<Option<f64>, IngestError> {
        let TableCell::Number(sigma) = self.cell(column.index)? else {
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
            value: self.cells[index].to_owned(),
            expected,
        }
    }
}
