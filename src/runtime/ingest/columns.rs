//! What the columns of a CSV file mean, by their names alone.

use super::column_map::{ColumnMap, Measure};
use super::names::{Name, channel_unit, in_unit_of, is_unit_of_motion, name_of};
use super::{IngestError, ReadOptions, Remark};
use crate::reading::{BenchmarkId, Dialect, Unit, in_brackets};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::Path;

/// One column, as the row parser uses it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Column {
    Time,
    Days,
    Reading {
        benchmark: BenchmarkId,
        unit: Unit,
        sigma: Option<SigmaColumn>,
    },
    /// Read together with the reading it belongs to.
    Sigma,
    Channel {
        unit: Option<String>,
    },
    /// Read together with the others of its vector.
    Component {
        benchmark: BenchmarkId,
        unit: Unit,
    },
    /// Neither: a logger's record number.
    Ignored,
    /// The header has no name for it: its cells must be empty.
    Nameless,
}

/// What a column is taken for, for a person to see.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize)]
#[serde(tag = "is", rename_all = "kebab-case")]
pub enum Meaning {
    /// When a row was measured, or a part of that.
    Time,
    /// Readings.
    Reading {
        /// Whose.
        benchmark: BenchmarkId,
        /// In which unit.
        unit: String,
    },
    /// Standard errors of readings.
    Sigma,
    /// One component of a benchmark that moves in space.
    Component {
        /// Whose.
        benchmark: BenchmarkId,
        /// In which unit.
        unit: String,
    },
    /// A covariate.
    Covariate {
        /// In which unit, where its name says that.
        unit: Option<String>,
    },
    /// It holds text.
    Text,
    /// It has held nothing so far.
    Empty,
    /// It is not used.
    Unused,
}

impl Column {
    pub(super) fn meaning(&self) -> Meaning {
        match self {
            Self::Time | Self::Days => Meaning::Time,
            Self::Reading {
                benchmark, unit, ..
            } => Meaning::Reading {
                benchmark: benchmark.clone(),
                unit: unit.to_string(),
            },
            Self::Sigma => Meaning::Sigma,
            Self::Component { benchmark, unit } => Meaning::Component {
                benchmark: benchmark.clone(),
                unit: unit.to_string(),
            },
            Self::Channel { unit } => Meaning::Covariate { unit: unit.clone() },
            Self::Ignored | Self::Nameless => Meaning::Unused,
        }
    }
}

/// Where a reading's standard error stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SigmaColumn {
    pub(super) index: usize,
    pub(super) unit: Unit,
}

/// What to know of a covariate that is named as readings are: `P1_displacement_mm/d` or `P1 displacement mm`.
fn like_a_reading(name: &str) -> Option<Remark> {
    let plain = name.to_ascii_lowercase();
    let (quantity, unit) = ["displacement", "velocity"]
        .into_iter()
        .find_map(|keyword| {
            let (_, rest) = plain.rsplit_once(keyword)?;
            let unit = rest
                .strip_prefix(['_', ' '])
                .filter(|unit| !unit.starts_with(['[', '(']));
            let unit = unit.or_else(|| in_brackets(rest));
            let is_one = rest.is_empty()
                || unit.is_some_and(is_unit_of_motion)
                || channel_unit(name).is_none();
            is_one.then_some((keyword, unit))
        })?;
    let unit = unit.and_then(|unit| Unit::parse(unit).ok());
    let unit = unit.filter(|unit| unit.quantity().name() == quantity);
    let unit = unit.map_or_else(|| "UNIT".to_owned(), Unit::column_suffix);
    Some(Remark::new(
        format!("column {name:?}"),
        format!(
            "named like a reading, and taken as a covariate; expected [ID_]displacement_UNIT with um, mm, cm, m, in or ft, \
             or [ID_]velocity_UNIT with one of these per min, h, day or yr (what is in another unit must be converted first); \
             or say it with [[benchmark]] column = {name:?} and unit (--column {name:?}=ID:{quantity}:{unit})"
        ),
    ))
}

/// That a column's readings are taken in the unit that is stated of their benchmark.
fn in_stated_unit(name: &str, named: Unit, benchmark: &BenchmarkId, unit: Unit) -> Remark {
    Remark::new(
        format!("column {name:?}"),
        format!(
            "it is named as one in {named}, and taken in {unit}, as unit of [[benchmark]] {:?} says: is that right?",
            benchmark.as_str()
        ),
    )
}

/// What a column of readings should have.
const A_UNIT: &str = "a unit at its end: um, mm, cm, m, in or ft, a velocity per min, h, day or yr, such as displacement_mm or velocity_mm_per_h; or its unit stated, --column NAME=ID:QUANTITY:UNIT";

/// What a header should have.
const ONE_NAME_EACH: &str = "each name of a time or of readings once: let the logger give each sensor a name of its own, or write the header so";

/// A header, understood.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) names: Vec<String>,
    pub(super) columns: Vec<Column>,
    /// Where the time stands, or its parts in their order.
    pub(super) time: Vec<usize>,
    /// What a person should know of the names.
    pub(super) remarks: Vec<Remark>,
}

/// A reading or standard error and whose, or another kind of column.
type ByName = Result<(Option<BenchmarkId>, Measure), Column>;

struct Sigma {
    index: usize,
    benchmark: BenchmarkId,
    unit: Unit,
}

/// The columns of a header, one after another.
#[derive(Default)]
struct NamedColumns {
    columns: Vec<Column>,
    sigmas: Vec<Sigma>,
    remarks: Vec<Remark>,
    /// Benchmarks whose unit is not the one that their column's name has: that one, and theirs.
    restated: Vec<(BenchmarkId, Unit, Unit)>,
    /// Columns that are stated by their names and are not there under these.
    absent: Vec<ColumnMap>,
}

fn absent(names: &[String], options: &ReadOptions) -> Vec<ColumnMap> {
    let stated = options.columns.iter();
    stated
        .filter(|map| !names.contains(&map.column))
        .cloned()
        .collect()
}

/// What is said of a name of covariates or of text that stands twice.
fn not_used_as_twins(name: &str) -> Remark {
    Remark::new(
        format!("column {name:?}"),
        "its name stands more than once in the header: none of these columns is used; give each its own name to have them".to_owned(),
    )
}

impl NamedColumns {
    /// Whether a column of this name has neither readings nor times, and nothing is stated of it.
    fn is_idle(&self, name: &str, options: &ReadOptions) -> bool {
        let mut vectors = options.vectors.iter();
        let is_stated = options.columns.iter().any(|map| map.column == *name)
            || vectors.any(|vector| vector.components.iter().any(|(one, _)| one == name))
            || self
                .absent
                .iter()
                .any(|map| in_unit_of(name, map).is_some());
        let by_name = Layout::by_name(name, &options.dialect);
        !is_stated && matches!(by_name, Ok(Err(Column::Channel { .. } | Column::Ignored)))
    }

    /// Adds the column of this name, or says what is wrong with it and what was expected; `stem` is the benchmark of columns that
    /// name none.
    fn take(
        &mut self,
        name: &str,
        stem: &BenchmarkId,
        options: &ReadOptions,
    ) -> Result<(), (&'static str, &'static str)> {
        let mut stated = options.columns.iter();
        let map = stated.find(|map| map.column == *name).cloned();
        // A header that comes again says in which unit its readings are from there on.
        let map = map.or_else(|| self.absent.iter().find_map(|one| in_unit_of(name, one)));
        let measured = match &map {
            Some(map) => Ok((Some(map.benchmark.clone()), map.measure)),
            None => Layout::by_name(name, &options.dialect)?,
        };
        let (benchmark, measure) = match measured {
            Ok((benchmark, measure)) => (benchmark.unwrap_or_else(|| stem.clone()), measure),
            Err(other) => {
                let is_covariate = matches!(other, Column::Channel { .. });
                let remark = is_covariate.then(|| like_a_reading(name)).flatten();
                self.remarks.extend(remark);
                self.columns.push(other);
                return Ok(());
            }
        };
        let column = match measure {
            Measure::Reading(_) if map.is_none() && options.reserves(&benchmark) => Column::Ignored,
            Measure::Reading(named) => {
                let beside = options.unit_beside(&benchmark, named);
                let beside = beside.filter(|_| map.is_none());
                if let Some(unit) = beside {
                    self.remarks
                        .push(in_stated_unit(name, named, &benchmark, unit));
                    self.restated.push((benchmark.clone(), named, unit));
                }
                Column::Reading {
                    benchmark,
                    unit: beside.unwrap_or(named),
                    sigma: None,
                }
            }
            Measure::Sigma(unit) => {
                self.sigmas.push(Sigma {
                    index: self.columns.len(),
                    benchmark,
                    unit,
                });
                Column::Sigma
            }
        };
        self.columns.push(column);
        Ok(())
    }

    /// Where readings are in another unit than their name says, standard errors in that unit are too.
    fn finish(mut self) -> Self {
        for sigma in &mut self.sigmas {
            let of_it = |(id, named, _): &&(BenchmarkId, Unit, Unit)| {
                *id == sigma.benchmark && *named == sigma.unit
            };
            if let Some((.., unit)) = self.restated.iter().find(of_it) {
                sigma.unit = *unit;
            }
        }
        self
    }
}

impl Layout {
    /// `line` is the header's.
    pub(super) fn new(
        file: &Path,
        line: u64,
        names: Vec<String>,
        options: &ReadOptions,
    ) -> Result<Self, IngestError> {
        let fail = |column: &str, problem, expected| IngestError::Header {
            file: file.into(),
            line,
            column: column.to_owned(),
            problem,
            expected,
        };
        let stem = BenchmarkId::new(file.file_stem().unwrap_or_default().to_string_lossy());
        let mut named = NamedColumns {
            absent: absent(&names, options),
            ..NamedColumns::default()
        };
        for (index, name) in names.iter().enumerate() {
            let is_twin = !name.is_empty() && names.iter().filter(|one| *one == name).count() > 1;
            if is_twin && named.is_idle(name, options) {
                if !names[..index].contains(name) {
                    named.remarks.push(not_used_as_twins(name));
                }
                named.columns.push(Column::Ignored);
                continue;
            }
            Self::name_is_right(name, &names[..index])
                .and_then(|()| named.take(name, &stem, options))
                .map_err(|(problem, expected)| fail(name, problem, expected))?;
        }
        let NamedColumns {
            columns,
            sigmas,
            remarks,
            ..
        } = named.finish();
        let time = match &options.dialect.time_columns[..] {
            [] => vec![Self::time_column(&columns, &names, fail)?],
            stated => Self::stated_time(stated, &names, fail)?,
        };
        let mut layout = Self {
            names,
            columns,
            time,
            remarks,
        };
        layout.refuse_twins(fail)?;
        layout.pair(sigmas, fail)?;
        Ok(layout)
    }

    /// What the name of a column says: a benchmark's reading or its standard error, else what it is instead.
    fn by_name(name: &str, dialect: &Dialect) -> Result<ByName, (&'static str, &'static str)> {
        let stated = &dialect.time_columns;
        Ok(match name_of(name) {
            _ if name.is_empty() => Err(Column::Nameless),
            _ if stated.iter().any(|one| one == name) => Err(Column::Time),
            Name::Measure(id, measure) => Ok((id.map(BenchmarkId::new), measure)),
            Name::WithoutUnit => return Err(("a reading without a known unit", A_UNIT)),
            Name::Time | Name::Days if !stated.is_empty() => Err(Column::Ignored),
            Name::Time => Err(Column::Time),
            Name::Days => Err(Column::Days),
            Name::Channel(unit) => Err(Column::Channel {
                unit: unit.map(str::to_owned),
            }),
        })
    }

    /// Where the columns stand that the config names for the time.
    fn stated_time(
        stated: &[String],
        names: &[String],
        fail: impl Fn(&str, &'static str, &'static str) -> IngestError,
    ) -> Result<Vec<usize>, IngestError> {
        let place = |wanted: &String| {
            let place = names.iter().position(|name| name == wanted);
            place.ok_or_else(|| {
                fail(
                    wanted,
                    "there is no such column",
                    "in the header every column that time_column (--time-column) names",
                )
            })
        };
        stated.iter().map(place).collect()
    }

    /// What is wrong with a name after those `before` it, and what was expected.
    fn name_is_right(name: &String, before: &[String]) -> Result<(), (&'static str, &'static str)> {
        if !name.is_empty() && before.contains(name) {
            Err(("the name stands twice", ONE_NAME_EACH))
        } else {
            Ok(())
        }
    }

    fn time_column(
        columns: &[Column],
        names: &[String],
        fail: impl Fn(&str, &'static str, &'static str) -> IngestError,
    ) -> Result<usize, IngestError> {
        let is_time = |column: &&Column| matches!(column, Column::Time | Column::Days);
        let expected = "one column named time (RFC 3339) or t_days, or time_column (--time-column) with the name of the one that gives the time; comma-separated fields, or semicolons or tabs in the header too; where other lines stand before the header, skip_lines (--skip-lines) with their number";
        let Some(time) = columns.iter().position(|column| is_time(&column)) else {
            return Err(fail("time", "there is no such column", expected));
        };
        if columns.iter().filter(is_time).count() > 1 {
            return Err(fail(
                &names[time],
                "a second column gives the time",
                expected,
            ));
        }
        let has_name = |column: &&Column| !matches!(column, Column::Nameless);
        if columns.iter().filter(has_name).count() == 1 {
            let expected =
                "a column named [ID_]displacement_UNIT or [ID_]velocity_UNIT, or a covariate";
            return Err(fail(&names[time], "it is the only column", expected));
        }
        Ok(time)
    }

    fn refuse_twins(
        &self,
        fail: impl Fn(&str, &'static str, &'static str) -> IngestError,
    ) -> Result<(), IngestError> {
        let mut met = std::collections::BTreeSet::new();
        for (name, column) in self.names.iter().zip(&self.columns) {
            if let Column::Reading {
                benchmark, unit, ..
            } = column
                && !met.insert((benchmark, unit.quantity()))
            {
                let expected = "one column for each quantity of a benchmark";
                return Err(fail(
                    name,
                    "the benchmark has another such column",
                    expected,
                ));
            }
        }
        Ok(())
    }

    /// How many columns without a name stand at the end, behind a last mark between cells.
    pub(super) fn nameless_at_end(&self) -> usize {
        let from_end = self.columns.iter().rev();
        from_end
            .take_while(|column| matches!(column, Column::Nameless))
            .count()
    }

    /// Gives every standard error to the reading of its benchmark that has its kind of unit.
    fn pair(
        &mut self,
        sigmas: Vec<Sigma>,
        fail: impl Fn(&str, &'static str, &'static str) -> IngestError,
    ) -> Result<(), IngestError> {
        for given in sigmas {
            let place = self.columns.iter_mut().find_map(|column| {
                if let Column::Reading {
                    benchmark,
                    unit,
                    sigma,
                } = column
                    && *benchmark == given.benchmark
                    && unit.quantity() == given.unit.quantity()
                {
                    Some(sigma)
                } else {
                    None
                }
            });
            let name = &self.names[given.index];
            let expected = "one standard error for each column of readings, of the same benchmark and kind of unit";
            match place {
                None => return Err(fail(name, "there are no readings it belongs to", expected)),
                Some(Some(_)) => return Err(fail(name, "the readings have another", expected)),
                Some(place) => {
                    *place = Some(SigmaColumn {
                        index: given.index,
                        unit: given.unit,
                    });
                }
            }
        }
        Ok(())
    }
}
