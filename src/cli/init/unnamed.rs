//! What is said of a file without readings.

use crate::reading::{CovariateKind, Unit, bracketed};
use crate::runtime::ingest::{FileSurvey, IngestError, Meaning, unit_in_name};
use std::collections::BTreeSet;
use std::path::Path;

/// Parts of the names of columns that may have what was added since the reading before.
const OF_EACH_READING: [&str; 5] = [
    "increment",
    "inkrement",
    "zuwachs",
    "since last",
    "since previous",
];

/// What is wrong with a file of which nothing can be watched.
#[derive(Debug)]
pub(super) struct UnusableFile {
    pub(super) problem: String,
    /// Whether a flag may mend it.
    pub(super) has_a_flag: bool,
}

/// What is said of a file without columns of readings.
const NOT_NAMED: &str =
    "no column is named as readings are ([ID_]displacement_UNIT or [ID_]velocity_UNIT)";

/// Which flag names the readings of a file where no column does; where one does, what is wrong with its rows.
pub(super) fn without_readings(
    file: &Path,
    looked: &FileSurvey,
    covariates: &[(String, CovariateKind)],
) -> UnusableFile {
    let is_named = |(_, meaning): &(String, Meaning)| {
        matches!(meaning, Meaning::Reading { .. } | Meaning::Component { .. })
    };
    if let Some(fault) = &looked.fault
        && (looked.columns.is_empty() || looked.columns.iter().any(is_named))
    {
        return UnusableFile {
            problem: format!("{fault}; no row of the file can be used"),
            has_a_flag: fault.names_a_flag(),
        };
    }
    if looked.columns.iter().any(is_named) {
        return UnusableFile {
            problem: format!(
                "{}: its columns of readings hold no number so far; run init again once they do, or give a former file of it and then write this \
                 one's path into the config",
                file.display()
            ),
            has_a_flag: false,
        };
    }
    let numbers = looked.columns.iter().filter_map(|(name, meaning)| {
        matches!(meaning, Meaning::Covariate { .. }).then_some(name.as_str())
    });
    let numbers: Vec<&str> = numbers.collect();
    if numbers.is_empty() {
        return without_numbers(file, looked);
    }
    let of_points = looked.columns.iter().filter(|(name, meaning)| {
        numbers.contains(&name.as_str()) && !is_covariate(name, meaning, covariates)
    });
    let first = of_points.map(|(name, _)| name.as_str()).next();
    let first = first.unwrap_or("NAME");
    let stated = looked.units_line.get(first);
    let in_line = stated.and_then(|stated| Unit::parse(stated).ok());
    let in_which = stated.filter(|_| in_line.is_none());
    let in_which = in_which.map_or_else(String::new, |stated| {
        format!(" (the units line has {stated:?} for {first:?}, which is no unit that can be read)")
    });
    let (quantity, unit) = match in_line.or_else(|| unit_at_end(first)) {
        Some(unit) => (unit.quantity().name(), unit.column_suffix()),
        // The name says nothing of a unit, or one that is not known.
        None if stated.is_some_and(|stated| stated.contains('/')) => {
            ("velocity", "UNIT".to_owned())
        }
        None if stated.is_none() && (first.contains("_per_") || first.contains('/')) => {
            ("velocity", "UNIT".to_owned())
        }
        None => ("displacement", "UNIT".to_owned()),
    };
    let example = format!("{first}=P1:{quantity}:{unit}");
    let problem = format!(
        "{}: {NOT_NAMED}; its columns of numbers are \
         {}: say which of them has the readings of which point, in which unit{in_which}, as in --column {example:?}; a UNIT is um, mm, cm, \
         m, in or ft, or one of these per min, h, day or yr (mm_per_day): what is in another one must be converted first; a column of rain, of a lake or the like is named by --covariate {:?}{}",
        file.display(),
        numbers.join(", "),
        format!("{first}=level"),
        coordinates(&numbers).map_or_else(String::new, |columns| by_hand(&columns)),
    );
    UnusableFile {
        problem,
        has_a_flag: true,
    }
}

/// A name that stands more than once among these.
fn twin<'a>(names: &[&'a str]) -> Option<&'a str> {
    let mut met = BTreeSet::new();
    names.iter().copied().find(|name| !met.insert(*name))
}

/// What is said of a file without a column of numbers.
fn without_numbers(file: &Path, looked: &FileSurvey) -> UnusableFile {
    let columns = looked.columns.iter().map(|(name, _)| name.as_str());
    let columns: Vec<&str> = columns.collect();
    let file = file.display();
    let problem = match (&columns[..], &looked.fault) {
        ([], _) => {
            format!("{file}: found no message and no row with a reading; give a file that has some")
        }
        (_, Some(fault)) => {
            format!("{file}: {NOT_NAMED}, and no row could be used; the first that cannot: {fault}")
        }
        (columns, None) if twin(columns).is_some() => format!(
            "{file}: the name {:?} stands more than once in its header, and none of these columns is used: let the logger give each sensor a name \
             of its own, or write the header so",
            twin(columns).unwrap_or_default()
        ),
        (columns, None) => format!(
            "{file}: {NOT_NAMED}, and none of its columns ({}) holds numbers; give a file that has some; where a title stands \
             above its header, --skip-lines says how many lines that has",
            columns.join(", ")
        ),
    };
    UnusableFile {
        problem,
        has_a_flag: looked.fault.as_ref().is_some_and(IngestError::names_a_flag),
    }
}

/// What is said of a column whose name says that its displacements count from the reading before.
pub(super) fn not_a_total(name: &str) -> Option<String> {
    let plain = name.to_lowercase();
    let is_one = OF_EACH_READING.iter().any(|part| plain.contains(part));
    is_one.then(|| {
        format!(
            "column {name:?}: displacements are read as totals since the first reading; where this one has what was added since the reading \
             before, its values must be summed first"
        )
    })
}

/// What is wrong with a benchmark of which most readings cannot be used.
pub(super) fn mostly_refused(file: &Path, looked: &FileSurvey) -> Option<UnusableFile> {
    let mut counts = looked.counts.iter();
    let (benchmark, (taken, refused)) = counts.find(|(_, (taken, refused))| refused > taken)?;
    let fault = looked.fault.as_ref()?;
    let problem = format!(
        "{}: {refused} of {} readings of benchmark {:?} cannot be used; the first row that cannot: {fault}",
        file.display(),
        taken + refused,
        benchmark.as_str()
    );
    Some(UnusableFile {
        problem,
        has_a_flag: fault.names_a_flag(),
    })
}

/// The covariates of a file, where it has numbers and each column of them is named as no reading is.
pub(super) fn covariates_alone(
    looked: &FileSurvey,
    covariates: &[(String, CovariateKind)],
) -> Option<Vec<String>> {
    let numbers = looked
        .columns
        .iter()
        .filter(|(_, meaning)| matches!(meaning, Meaning::Covariate { .. }));
    let numbers: Vec<&(String, Meaning)> = numbers.collect();
    let are_all = numbers
        .iter()
        .all(|(name, meaning)| is_covariate(name, meaning, covariates));
    let names = numbers.iter().map(|(name, _)| name.clone());
    (are_all && !numbers.is_empty()).then(|| names.collect())
}

/// Parts of the names of what acts on a slope, or on its instruments, in lower case.
const OF_COVARIATES: [&str; 37] = [
    "rain",
    "regen",
    "niederschlag",
    "precip",
    "pioggia",
    "pluie",
    "lluvia",
    "snow",
    "schnee",
    "temp",
    "level",
    "pegel",
    "water",
    "wasser",
    "pore",
    "piezo",
    "press",
    "druck",
    "baro",
    "batt",
    "volt",
    "akku",
    "humid",
    "feucht",
    "discharge",
    "abfluss",
    "inflow",
    "lake",
    "lago",
    "stausee",
    "reservoir",
    "embalse",
    "stage",
    "river",
    "fluss",
    "luft",
    "melt",
];

/// Whether a column's name, or the unit in it, says that it holds no readings, or it is one of these `covariates`.
fn is_covariate(name: &str, meaning: &Meaning, covariates: &[(String, CovariateKind)]) -> bool {
    if covariates.iter().any(|(column, _)| column == name) {
        return true;
    }
    let plain = name.to_lowercase();
    let is_levelling = plain.contains("levelling") || plain.contains("leveling");
    let of_covariates = OF_COVARIATES.iter().any(|part| plain.contains(part));
    let unit = if let Meaning::Covariate { unit } = meaning {
        unit.as_deref()
    } else {
        None
    };
    (of_covariates && !is_levelling) || unit.is_some_and(|unit| Unit::parse(unit).is_err())
}

/// Names of coordinates, in lower case, by the axis.
const OF_COORDINATES: [&[&str]; 3] = [
    &["e", "east", "easting", "x", "ost", "rechtswert"],
    &["n", "north", "northing", "y", "nord", "hochwert"],
    &["h", "u", "up", "z", "height", "elevation", "hoehe", "quota"],
];

/// The columns that are named as the coordinates of a point in two or three axes, with a unit behind the name or without one.
fn coordinates<'a>(columns: &[&'a str]) -> Option<Vec<&'a str>> {
    let is_of = |column: &&&str, names: &&[&str]| {
        let plain = column.to_lowercase();
        let word = plain.split(|one: char| !one.is_alphanumeric()).next();
        word.is_some_and(|word| names.contains(&word))
    };
    let each = OF_COORDINATES
        .iter()
        .filter_map(|names| columns.iter().find(|column| is_of(column, names)));
    let each: Vec<&str> = each.copied().collect();
    (each.len() >= 2).then_some(each)
}

/// How columns that are coordinates are watched.
fn by_hand(columns: &[&str]) -> String {
    format!(
        "; where {} are coordinates of one point, its config is written by hand: [[benchmark]] with components = {columns:?}, unit and direction \
         (config/example.toml)",
        columns.join(", ")
    )
}

/// The unit that a column's name ends with, after a `_` or a blank or in brackets.
fn unit_at_end(column: &str) -> Option<Unit> {
    let ends = column
        .match_indices(['_', ' '])
        .map(|(at, _)| &column[at + 1..]);
    let ends = ends.chain(bracketed(column));
    unit_in_name(column).or_else(|| ends.into_iter().find_map(|end| Unit::parse(end).ok()))
}

/// What is said of a column whose name has another unit than is stated of it.
pub(super) fn other_unit(column: &str, stated: Unit) -> Option<String> {
    let named = match unit_at_end(column) {
        Some(named) if named == stated => return None,
        Some(named) => named.to_string(),
        None => {
            let named = bracketed(column).filter(|named| !named.is_empty())?;
            format!("{named:?}, which is no unit that can be read,")
        }
    };
    Some(format!(
        "column {column:?} has the unit {named} in its name, and {stated} by --column: it is read in {stated}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_are_named_as_coordinates_are_recognised() {
        assert_eq!(coordinates(&["E", "N", "H"]), Some(vec!["E", "N", "H"]));
        assert_eq!(
            coordinates(&["temp", "Easting [m]", "Northing (m)"]),
            Some(vec!["Easting [m]", "Northing (m)"])
        );
        assert_eq!(coordinates(&["crack_1", "x"]), None);
    }

    #[test]
    fn a_unit_in_a_columns_name_that_is_not_the_stated_one_is_said() {
        for (column, named) in [
            ("P1 displacement cm", Some("cm")),
            ("P1 displacement [\u{b5}m]", Some("um")),
            ("P1 [furlong]", Some("\"furlong\"")),
            ("P1 displacement mm", None),
            ("P1", None),
        ] {
            let said = other_unit(column, Unit::MM);
            let is_right = match (&said, named) {
                (None, None) => true,
                (Some(said), Some(named)) => said.contains(named),
                _ => false,
            };
            assert!(is_right, "{column}: {said:?}");
        }
    }
}
