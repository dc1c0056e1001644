//! Rows of a table whose columns are understood: cells in, readings and covariates out.

use super::columns::{Column, Layout, SigmaColumn};
use super::vector::{self, Vector};
use super::{IngestError, Item, ReadOptions};
use crate::reading::{BenchmarkId, Reading, Sample, Timestamp, Unit, after_days};
use ::csv::StringRecord;
use std::path::{Path, PathBuf};

/// Reads the rows under one header.
#[derive(Debug)]
pub(super) struct TableRows {
    file: PathBuf,
    layout: Layout,
    vectors: Vec<Vector>,
    options: ReadOptions,
    filled: Vec<bool>,
}

impl TableRows {
    pub(super) fn new(file: &Path, mut layout: Layout, options: &ReadOptions) -> Self {
        Self {
            file: file.into(),
            filled: vec![false; layout.names.len()],
            vectors: vector::claim(&mut layout, &options.vectors),
            layout,
            options: options.clone(),
        }
    }

    /// The columns' names, in their order.
    pub(super) fn names(&self) -> &[String] {
        &self.layout.names
    }

    /// What one row holds; `line` is its number in the file.
    pub(super) fn items(
        &mut self,
        line: u64,
        cells: &StringRecord,
    ) -> Result<Vec<Item>, IngestError> {
        let expected = self.layout.names.len();
        if cells.len() != expected {
            return Err(IngestError::Line {
                file: self.file.clone(),
                line,
                found: format!("{} fields", cells.len()),
                expected,
            });
        }
        let row = Row {
            rows: self,
            cells,
            line,
        };
        let items = row.items()?;
        for (filled, cell) in self.filled.iter_mut().zip(cells) {
            *filled |= !cell.is_empty();
        }
        Ok(items)
    }

    /// Whether no row has held anything so far.
    pub(super) fn is_empty(&self) -> bool {
        !self.filled.contains(&true)
    }

    /// The first column that has held nothing so far.
    pub(super) fn unfilled(&self) -> Option<&String> {
        let mut columns = self.layout.names.iter().zip(&self.filled);
        columns.find_map(|(name, filled)| (!filled).then_some(name))
    }
}

/// What stands in a cell.
enum Cell {
    Empty,
    /// A mark that the sensor gave no value.
    Missing,
    Number(f64),
}

struct Row<'a> {
    rows: &'a TableRows,
    cells: &'a StringRecord,
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
                } => items.extend(self.reading(time, index, benchmark, (*unit, *sigma))?),
                Column::Channel { unit } => {
                    if let Cell::Number(value) = self.cell(index)? {
                        items.push(Item::Sample {
                            channel: layout.names[index].clone(),
                            unit: unit.clone(),
                            sample: Sample { time, value },
                        });
                    }
                }
                Column::Time | Column::Days | Column::Sigma | Column::Ignored => {}
            }
        }
        for vector in &self.rows.vectors {
            items.extend(self.vector(time, vector)?);
        }
        Ok(items)
    }

    /// The projection of a vector; with a component missing it is missing as a whole.
    fn vector(&self, time: Timestamp, vector: &Vector) -> Result<Option<Item>, IngestError> {
        let names = &self.rows.layout.names;
        let missing = |what| {
            Some(Item::Missing {
                benchmark: vector.benchmark.clone(),
                time,
                what,
            })
        };
        let (mut value, mut absent) = (0.0, Vec::new());
        for &(index, part) in &vector.components {
            match self.cell(index)? {
                Cell::Number(component) => value += part * component,
                Cell::Empty => absent.push(&names[index]),
                Cell::Missing => {
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
        if !value.is_finite() {
            let (index, _) = vector.components[0];
            return Err(self.fail(index, "components whose sum is a finite number"));
        }
        let (unit, sigma) = (vector.unit, None);
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
        (unit, sigma): (Unit, Option<SigmaColumn>),
    ) -> Result<Option<Item>, IngestError> {
        let sigma = sigma.map_or(Ok(None), |sigma| self.sigma(sigma, unit))?;
        Ok(match self.cell(index)? {
            Cell::Empty => None,
            Cell::Missing => Some(Item::Missing {
                benchmark: benchmark.clone(),
                time,
                what: self.cells[index].to_owned(),
            }),
            Cell::Number(value) => Some(Item::Reading {
                benchmark: benchmark.clone(),
                unit,
                averaging: self.rows.options.averaging_of(unit, None),
                reading: Reading { time, value, sigma },
            }),
        })
    }

    fn time(&self) -> Result<Timestamp, IngestError> {
        let (layout, options) = (&self.rows.layout, &self.rows.options);
        let index = layout.time;
        if layout.columns[index] == Column::Days {
            let days = match self.cell(index)? {
                Cell::Number(days) => after_days(options.epoch, days),
                Cell::Empty | Cell::Missing => None,
            };
            return days.ok_or_else(|| self.fail(index, "a number of days within the calendar"));
        }
        let clock = &options.conventions.clock;
        clock
            .instant(&self.cells[index])
            .map_err(|fault| self.fail(index, fault.expected()))
    }

    fn cell(&self, index: usize) -> Result<Cell, IngestError> {
        let cell = &self.cells[index];
        if cell.is_empty() {
            return Ok(Cell::Empty);
        }
        let marks = &self.rows.options.conventions.missing;
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() && marks.has_number(value) => Ok(Cell::Missing),
            Ok(value) if value.is_finite() => Ok(Cell::Number(value)),
            _ if marks.has(cell) => Ok(Cell::Missing),
            _ => Err(self.fail(
                index,
                "a finite number, or an empty cell where it is missing",
            )),
        }
    }

    /// The standard error in the reading's own unit.
    fn sigma(&self, column: SigmaColumn, unit: Unit) -> Result<Option<f64>, IngestError> {
        let Cell::Number(sigma) = self.cell(column.index)? else {
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
