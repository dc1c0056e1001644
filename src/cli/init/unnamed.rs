//! What is said of a file without readings.

use crate::reading::Unit;
use crate::runtime::ingest::{FileSurvey, Meaning, unit_in_name};
use std::path::Path;

/// Which flag names the readings of a file where no column does; where one does, what is wrong with its rows.
pub(super) fn without_readings(file: &Path, looked: &FileSurvey) -> String {
    let is_named = |(_, meaning): &(String, Meaning)| {
        matches!(meaning, Meaning::Reading { .. } | Meaning::Component { .. })
    };
    if let Some(fault) = &looked.fault
        && (looked.columns.is_empty() || looked.columns.iter().any(is_named))
    {
        return format!("{fault}; no row of the file can be used");
    }
    let numbers = looked.columns.iter().filter_map(|(name, meaning)| {
        matches!(meaning, Meaning::Covariate { .. }).then_some(name.as_str())
    });
    let numbers: Vec<&str> = numbers.collect();
    let named = "no column is named as readings are ([ID_]displacement_UNIT or [ID_]velocity_UNIT)";
    let Some(first) = numbers.first() else {
        let columns: Vec<&str> = looked
            .columns
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        return match &columns[..] {
            [] => format!(
                "{}: found no message and no row with a reading; give a file that has some",
                file.display()
            ),
            columns => format!(
                "{}: {named}, and none of its columns ({}) holds numbers; give a file that has some",
                file.display(),
                columns.join(", ")
            ),
        };
    };
    let (quantity, unit) = match unit_at_end(first) {
        Some(unit) => (unit.quantity().name(), unit.column_suffix()),
        // The name says nothing of a unit, or one that is not known.
        None if first.contains("_per_") => ("velocity", "UNIT".to_owned()),
        None if first.contains('_') => ("displacement", "UNIT".to_owned()),
        None => ("displacement", "mm".to_owned()),
    };
    let example = format!("{first}=P1:{quantity}:{unit}");
    format!(
        "{}: {named}; its columns of numbers are \
         {}: say which of them has the readings of which point, in which unit, as in --column {example:?}; a UNIT is mm, cm, m, \
         in or ft, or one of these per h, day or yr (mm_per_day): what is in another one must be converted first",
        file.display(),
        numbers.join(", ")
    )
}

/// The unit that a column's name ends with, after a `_`.
fn unit_at_end(column: &str) -> Option<Unit> {
    let ends = column.match_indices('_').map(|(at, _)| &column[at + 1..]);
    unit_in_name(column).or_else(|| ends.into_iter().find_map(|end| Unit::parse(end).ok()))
}
