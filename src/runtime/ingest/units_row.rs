//! A line of units below the header of a CSV file, as some loggers write it.

use super::Remark;
use super::column_map::{ColumnMap, Measure};
use super::names::{Name, name_of, unit_in_name, with_unit_of_motion};
use crate::reading::{Dialect, LocalClock, SummerTime, Unit, in_brackets};
use ::csv::StringRecord;
use jiff::tz::TimeZone;
use std::collections::BTreeMap;

/// A unit has so many characters at most.
const LONGEST: usize = 16;

/// What the line says of each column, brackets left out; `None` where the row is no line of units: it has a number or a time, or no unit of
/// length or velocity.
pub(super) fn units_of(
    cells: &StringRecord,
    names: &[String],
    dialect: &Dialect,
) -> Option<BTreeMap<String, String>> {
    let is_time = |name: &str| {
        dialect.time_columns.iter().any(|one| one == name)
            || dialect.time_columns.is_empty() && matches!(name_of(name), Name::Time | Name::Days)
    };
    let plain = |cell: &str| in_brackets(cell).unwrap_or(cell).trim().to_owned();
    let anywhere = LocalClock {
        zone: Some(TimeZone::UTC),
        summer_time: SummerTime::Earlier,
    };
    let is_value =
        |cell: &str| dialect.number(cell).is_some() || dialect.instant(cell, &anywhere).is_ok();
    if cells.len() > names.len() || cells.iter().any(is_value) {
        return None;
    }
    let columns = names.iter().zip(cells);
    let stated = columns.filter(|(name, cell)| !is_time(name) && !cell.is_empty());
    let units: BTreeMap<String, String> = stated
        .map(|(name, cell)| (name.clone(), plain(cell)))
        .collect();
    let are_short = units.values().all(|unit| unit.chars().count() <= LONGEST);
    let has_one = units.values().any(|unit| Unit::parse(unit).is_ok());
    (are_short && has_one).then_some(units)
}

/// The names of columns with the unit that the line has for them, where they are readings by that: `P1_displacement_mm` of
/// `P1_displacement` in mm. What the config maps keeps its name.
pub(super) fn with_units(
    names: &[String],
    units: &BTreeMap<String, String>,
    maps: &[ColumnMap],
) -> Vec<String> {
    let full = |name: &String| {
        let unit = units.get(name).and_then(|unit| Unit::parse(unit).ok());
        let is_mapped = maps.iter().any(|map| map.column == *name);
        let is_measure = matches!(name_of(name), Name::Measure(..));
        let unit = unit.filter(|_| !is_mapped && !is_measure);
        let full = unit.and_then(|unit| with_unit_of_motion(name, unit));
        full.unwrap_or_else(|| name.clone())
    };
    names.iter().map(full).collect()
}

/// Columns of readings that are taken in another unit than the line of units has for them.
pub(super) fn contradictions(
    names: &[String],
    units: &BTreeMap<String, String>,
    maps: &[ColumnMap],
) -> Vec<Remark> {
    let contradiction = |name: &String| {
        let named = units.get(name)?;
        let map = maps.iter().find(|map| map.column == *name);
        let map = map.map(|map| {
            let (Measure::Reading(unit) | Measure::Sigma(unit)) = map.measure;
            unit
        });
        let taken = map.or_else(|| unit_in_name(name))?;
        let is_same = Unit::parse(named).is_ok_and(|unit| unit == taken);
        (!is_same).then(|| {
            Remark::new(
                format!("column {name:?}"),
                format!(
                    "the line of units below the header has {named:?} for it, and it is taken in {taken}: is that right?"
                ),
            )
        })
    };
    names.iter().filter_map(contradiction).collect()
}
