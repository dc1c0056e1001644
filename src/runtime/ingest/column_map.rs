//! Columns whose meaning is given rather than named.

use crate::reading::{BenchmarkId, Unit};
use std::str::FromStr;

/// What a mapped column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Readings in this unit.
    Reading(Unit),
    /// Standard errors of the readings, in this unit.
    Sigma(Unit),
}

/// A column whose meaning is given rather than named: `NAME=ID:QUANTITY:UNIT`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnMap {
    /// The column's name in the header.
    pub column: String,
    /// The benchmark whose readings it holds.
    pub benchmark: BenchmarkId,
    /// What it holds of it.
    pub measure: Measure,
}

/// A column map that cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{given:?}: {problem}, expected NAME=ID:QUANTITY:UNIT with displacement, velocity or sigma as QUANTITY, such as prism4=31-1930:displacement:mm"
)]
pub struct ColumnMapError {
    /// The text that was given.
    pub given: String,
    /// What is wrong with it.
    pub problem: String,
}

impl FromStr for ColumnMap {
    type Err = ColumnMapError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let fail = |problem: String| ColumnMapError {
            given: text.to_owned(),
            problem,
        };
        let (column, meaning) = text
            .split_once('=')
            .ok_or_else(|| fail("no '=' in it".to_owned()))?;
        let mut parts = meaning.rsplitn(3, ':').map(str::trim);
        let (Some(unit), Some(quantity), Some(benchmark)) =
            (parts.next(), parts.next(), parts.next())
        else {
            return Err(fail("not three parts after the '='".to_owned()));
        };
        if column.trim().is_empty() || benchmark.is_empty() {
            return Err(fail("no name of the column or the benchmark".to_owned()));
        }
        let unit = Unit::parse(unit).map_err(|error| fail(error.to_string()))?;
        let measure = match quantity.to_ascii_lowercase().as_str() {
            "sigma" => Measure::Sigma(unit),
            name if name == unit.quantity().name() => Measure::Reading(unit),
            "displacement" | "velocity" => {
                return Err(fail(format!("{unit} is no unit of {quantity}")));
            }
            _ => return Err(fail(format!("unknown quantity {quantity:?}"))),
        };
        Ok(Self {
            column: column.trim().to_owned(),
            benchmark: BenchmarkId::new(benchmark),
            measure,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_map_says_what_a_name_does_not() {
        let map: ColumnMap = "Prism 4=31:1930:displacement:mm".parse().unwrap();
        assert_eq!(map.column, "Prism 4");
        assert_eq!(map.benchmark.as_str(), "31:1930");
        assert_eq!(map.measure, Measure::Reading(Unit::MM));
    }

    #[test]
    fn the_error_of_a_bad_column_map_names_what_is_wrong() {
        let cases = [
            ("abc", "no '='"),
            ("a=b:displacement", "three parts"),
            ("a=b:displacement:mm/d", "mm/day is no unit of displacement"),
            ("a=b:speed:mm/d", "unknown quantity \"speed\""),
            ("a=b:displacement:furlong", "furlong"),
            ("=b:displacement:mm", "no name"),
        ];
        for (text, problem) in cases {
            let error = text.parse::<ColumnMap>().unwrap_err().to_string();
            assert!(error.contains(problem) && error.contains(text), "{error}");
        }
    }
}
