//! What the columns of a CSV file mean, by their names alone.

use super::column_map::Measure;
use super::{IngestError, ReadOptions, Remark};
use crate::reading::{BenchmarkId, Dialect, Unit};
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

/// What a column's name says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Name<'a> {
    Time,
    Days,
    /// The ID, where the name has one.
    Measure(Option<&'a str>, Measure),
    Channel(Option<&'a str>),
    /// `displacement` and the like, with no known unit.
    WithoutUnit,
}

/// Words by which a column is one of readings.
const KEYWORDS: [&str; 3] = ["displacement", "velocity", "sigma"];

/// Reads a column's name.
pub(super) fn name_of(column: &str) -> Name<'_> {
    let plain = column.to_ascii_lowercase();
    match plain.as_str() {
        "time" => return Name::Time,
        "t_days" => return Name::Days,
        _ => {}
    }
    for keyword in KEYWORDS {
        for (at, _) in plain.rmatch_indices(keyword) {
            if let Some(measure) = measure_at(&plain, at, keyword) {
                match column[..at].strip_suffix('_') {
                    None if at == 0 => return Name::Measure(None, measure),
                    Some(id) if !id.is_empty() => return Name::Measure(Some(id), measure),
                    _ => {}
                }
            }
        }
    }
    if lacks_a_unit(&plain) {
        return Name::WithoutUnit;
    }
    Name::Channel(channel_unit(column))
}

/// The unit in the name of a column of readings.
pub fn unit_in_name(column: &str) -> Option<Unit> {
    if let Name::Measure(_, Measure::Reading(unit)) = name_of(column) {
        Some(unit)
    } else {
        None
    }
}

fn measure_at(plain: &str, at: usize, keyword: &str) -> Option<Measure> {
    let rest = &plain[at + keyword.len()..];
    let unit = rest.strip_prefix('_').or_else(|| in_brackets(rest))?;
    let unit = Unit::parse(unit).ok()?;
    match keyword {
        "sigma" => Some(Measure::Sigma(unit)),
        _ if unit.quantity().name() == keyword => Some(Measure::Reading(unit)),
        _ => None,
    }
}

/// `mm/d` of ` [mm/d]` or `(mm/d)`.
fn in_brackets(rest: &str) -> Option<&str> {
    let rest = rest.trim();
    let inner = |open, close| rest.strip_prefix(open)?.strip_suffix(close);
    inner('[', ']').or_else(|| inner('(', ')')).map(str::trim)
}

/// What stands in brackets at the end of a name: `mm/h` of `E [mm/h]`.
pub fn bracketed(name: &str) -> Option<&str> {
    in_brackets(&name[name.rfind(['[', '('])?..])
}

/// Words of units of length and of velocity.
const WORDS_OF_UNITS: [&str; 21] = [
    "um", "mm", "cm", "dm", "m", "km", "in", "inch", "ft", "per", "s", "sec", "min", "h", "hr",
    "hour", "d", "day", "month", "yr", "year",
];

/// Whether a text is a unit of length or of velocity, whether it can be read or not: `m_per_s`, `km`.
fn is_unit_of_motion(text: &str) -> bool {
    !text.is_empty()
        && text
            .split(['_', '/'])
            .all(|word| WORDS_OF_UNITS.contains(&word))
}

/// What to know of a covariate that is named as readings are: `P1_displacement_mm/d` or `P1 displacement mm`.
fn like_a_reading(name: &str) -> Option<Remark> {
    let plain = name.to_ascii_lowercase();
    let (quantity, unit) = ["displacement", "velocity"]
        .into_iter()
        .find_map(|keyword| {
            let (_, rest) = plain.rsplit_once(keyword)?;
            let unit = rest.strip_prefix('_').or_else(|| in_brackets(rest));
            let is_one = rest.is_empty()
                || unit.is_some_and(is_unit_of_motion)
                || channel_unit(name).is_none();
            is_one.then_some((keyword, unit))
        })?;
    let unit = unit.and_then(|unit| Unit::parse(unit).ok());
    let unit = unit.filter(|unit| unit.quantity().name() == quantity);
    let unit = unit.map_or_else(|| "UNIT".to_owned(), Unit::column_suffix);
    Some(Remark {
        about: format!("column {name:?}"),
        text: format!(
            "named like a reading, and taken as a covariate; expected [ID_]displacement_UNIT with mm, cm, m, in or ft, \
             or [ID_]velocity_UNIT with one of these per h, day or yr (what is in another unit must be converted first); \
             or say it with [[benchmark]] column = {name:?} and unit (--column {name:?}=ID:{quantity}:{unit})"
        ),
    })
}

/// `velocity_kmh` is a reading in a unit that is not known; `displacement_sensor_voltage_v` is a
/// covariate.
fn lacks_a_unit(plain: &str) -> bool {
    KEYWORDS
        .iter()
        .filter_map(|keyword| plain.strip_prefix(keyword))
        .any(|rest| match rest.strip_prefix('_') {
            None => rest.is_empty(),
            Some(unit) => !unit.replacen("_per_", "/", 1).contains('_'),
        })
}

/// Units at the end of a covariate's name, as loggers and surveys write them.
const CHANNEL_UNITS: [&str; 41] = [
    "mm", "cm", "m", "in", "ft", "km", "c", "f", "k", "degc", "degf", "deg_c", "deg_f", "deg",
    "m3_s", "m3_per_s", "l_s", "l_per_s", "cfs", "m_s", "m_per_s", "km_h", "km_per_h", "pa", "hpa",
    "kpa", "mpa", "bar", "mbar", "psi", "kn", "percent", "pct", "v", "mv", "ma", "hz", "s", "w_m2",
    "g", "ppm",
];

/// The longest known unit at a name's end: `mm_per_day` of `rain_mm_per_day`.
pub(super) fn channel_unit(name: &str) -> Option<&str> {
    let is_known = |unit: &&str| {
        let plain = unit.to_ascii_lowercase();
        CHANNEL_UNITS.contains(&plain.as_str()) || Unit::parse(&plain).is_ok()
    };
    let bracketed = name
        .find(['[', '('])
        .and_then(|at| in_brackets(&name[at..]));
    let suffixes = name.match_indices('_').map(|(at, _)| &name[at + 1..]);
    bracketed
        .filter(is_known)
        .or_else(|| suffixes.into_iter().find(is_known))
}

/// What a column of readings should have.
const A_UNIT: &str = "a unit at its end: mm, cm, m, in or ft, a velocity per h, day or yr, such as displacement_mm or velocity_mm_per_h";

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
        let (mut columns, mut sigmas, mut remarks) = (Vec::new(), Vec::new(), Vec::new());
        for (index, name) in names.iter().enumerate() {
            Self::name_is_right(name, &names[..index])
                .map_err(|(problem, expected)| fail(name, problem, expected))?;
            let map = options.columns.iter().find(|map| map.column == *name);
            let measured = match map {
                Some(map) => Ok((Some(map.benchmark.clone()), map.measure)),
                None => Self::by_name(name, &options.dialect)
                    .map_err(|(problem, expected)| fail(name, problem, expected))?,
            };
            let (benchmark, measure) = match measured {
                Ok((benchmark, measure)) => (benchmark.unwrap_or_else(|| stem.clone()), measure),
                Err(other) => {
                    let is_covariate = matches!(other, Column::Channel { .. });
                    remarks.extend(is_covariate.then(|| like_a_reading(name)).flatten());
                    columns.push(other);
                    continue;
                }
            };
            columns.push(match measure {
                Measure::Reading(_) if map.is_none() && options.reserves(&benchmark) => {
                    Column::Ignored
                }
                Measure::Reading(unit) => Column::Reading {
                    benchmark,
                    unit,
                    sigma: None,
                },
                Measure::Sigma(unit) => {
                    sigmas.push(Sigma {
                        index,
                        benchmark,
                        unit,
                    });
                    Column::Sigma
                }
            });
        }
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
            Err(("the name stands twice", "every name once"))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_benchmark_quantity_and_unit() {
        let per_hour = Unit::parse("mm/h").unwrap();
        let cases = [
            ("displacement_mm", None, Measure::Reading(Unit::MM)),
            ("velocity_mm_per_h", None, Measure::Reading(per_hour)),
            (
                "31-1930_displacement_mm",
                Some("31-1930"),
                Measure::Reading(Unit::MM),
            ),
            (
                "a_b_velocity_mm_per_d",
                Some("a_b"),
                Measure::Reading(Unit::MM_PER_DAY),
            ),
            ("blkm_sigma_mm", Some("blkm"), Measure::Sigma(Unit::MM)),
            ("A_Displacement_MM", Some("A"), Measure::Reading(Unit::MM)),
        ];
        for (name, id, measure) in cases {
            assert_eq!(name_of(name), Name::Measure(id, measure), "{name}");
        }
    }

    #[test]
    fn every_other_name_is_a_channel_with_its_longest_unit() {
        let cases = [
            ("lake_level_m", Some("m")),
            ("rain_mm_per_day", Some("mm_per_day")),
            ("river_flow_cfs", Some("cfs")),
            ("inflow_m3_s", Some("m3_s")),
            ("air_temperature_max_f", Some("f")),
            ("wind_velocity_m_per_s", Some("m_per_s")),
            ("displacement_sensor_voltage_v", Some("v")),
            ("humidity_percent", Some("percent")),
            ("quality", None),
            ("m", None),
        ];
        for (name, unit) in cases {
            assert_eq!(name_of(name), Name::Channel(unit), "{name}");
        }
    }

    #[test]
    fn a_reading_in_no_known_unit_is_refused_rather_than_taken_for_a_covariate() {
        for name in ["displacement", "velocity_kmh", "velocity_m_per_s", "sigma"] {
            assert_eq!(name_of(name), Name::WithoutUnit, "{name}");
        }
    }
}
