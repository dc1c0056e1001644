//! Tables with one row a point, in which a column names the points.

use crate::reading::Dialect;
use crate::runtime::ingest::{Survey, unit_in_name};
use std::collections::{BTreeMap, BTreeSet};

/// A point is named at least so often.
const FEWEST_OF_A_POINT: usize = 2;
/// Of the cells of a column of names so many in a hundred are filled.
const FILLED_PERCENT: usize = 90;
/// Names that are shown.
const SHOWN: usize = 3;
/// Words that a column of names may begin with, one of the words in its name.
const OF_POINTS: [&str; 22] = [
    "benchmark",
    "node",
    "device",
    "channel",
    "kanal",
    "canal",
    "capteur",
    "sonde",
    "sonda",
    "messstelle",
    "extenso",
    "point",
    "punkt",
    "punto",
    "messpunkt",
    "prism",
    "target",
    "station",
    "sensor",
    "marker",
    "instrument",
    "gauge",
];
/// The same as whole words.
const POINT_WORDS: [&str; 5] = ["id", "name", "no", "nr", "pt"];
/// Of the rows of points that are read in turn, in a hundred so many have the name of the row one round before.
const IN_ROUNDS_PERCENT: usize = 80;
/// Parts of the names of columns that say something of a point.
const OF_THEIR_STATE: [&str; 9] = [
    "status", "state", "flag", "quality", "remark", "comment", "type", "unit", "zustand",
];

/// What is wrong with a table that has one row a point; `is_mapped`: the column's readings are named.
pub(super) fn names_of_points(
    survey: &Survey,
    dialect: &Dialect,
    is_mapped: &dyn Fn(&str) -> bool,
) -> Option<String> {
    let is_time = |name: &str| {
        let stated = &dialect.time_columns;
        let usual = ["time", "t_days"].iter();
        stated.iter().any(|one| one == name) || {
            let mut usual = usual.filter(|_| stated.is_empty());
            usual.any(|one| name.eq_ignore_ascii_case(one))
        }
    };
    let columns = || survey.names.iter().zip(&survey.columns);
    let times = columns().filter(|(name, _)| is_time(name));
    let times: Vec<&Vec<String>> = times.map(|(_, cells)| cells).collect();
    let mut others = columns().filter(|(name, _)| {
        !name.is_empty() && !is_time(name) && !is_mapped(name) && unit_in_name(name).is_none()
    });
    let (name, cells) = others.find(|(name, cells)| are_names(name, cells, &times, dialect))?;
    let distinct: BTreeSet<&str> = cells.iter().map(String::as_str).collect();
    let points: Vec<&str> = distinct.into_iter().filter(|one| !one.is_empty()).collect();
    let mut shown = points
        .iter()
        .take(SHOWN)
        .copied()
        .collect::<Vec<_>>()
        .join(", ");
    if points.len() > SHOWN {
        shown.push_str(", ...");
    }
    Some(format!(
        "column {name:?} looks like the names of points, one row a point ({shown}): expected one row a time with a column for \
         each point; split the file into one for each point, or write its rows as messages of NDJSON, which name their benchmark: \
         {{\"benchmark\": {:?}, \"time\": ..., \"value\": ..., \"unit\": \"mm\"}}",
        points.first().unwrap_or(&"P1")
    ))
}

/// Whether the cells of a column name points: few names that repeat, and several of them at one time, or one after another; where the
/// column's name says so also one below the other.
fn are_names(name: &str, cells: &[String], times: &[&Vec<String>], dialect: &Dialect) -> bool {
    let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
    let distinct: BTreeSet<&String> = cells.iter().filter(|cell| !cell.is_empty()).collect();
    if 100 * filled < FILLED_PERCENT * cells.len()
        || distinct.len() < 2
        || filled < FEWEST_OF_A_POINT * distinct.len()
    {
        return false;
    }
    let is_text = distinct.iter().all(|cell| dialect.number(cell).is_none());
    let is_counted = distinct.iter().all(|cell| cell.parse::<i64>().is_ok());
    let is_named = is_of_points(name);
    let together = 2 * at_one_time(cells, times) >= cells.len();
    let changes = cells.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let in_turn = 2 * changes + 1 >= cells.len();
    // Readings in whole millimetres change from row to row too, and not in rounds.
    let after_a_round = cells.iter().zip(cells.iter().skip(distinct.len()));
    let same = after_a_round.filter(|(one, next)| one == next).count();
    let in_rounds = 100 * same >= IN_ROUNDS_PERCENT * cells.len().saturating_sub(distinct.len());
    let one_below_the_other = || begins_anew(cells, times);
    (is_text
        && (together || in_turn && !is_of_their_state(name) || is_named && one_below_the_other()))
        || (is_counted && (together || is_named && in_turn && in_rounds))
}

/// Whether the times go back wherever another name begins, and it is so once at least.
fn begins_anew(cells: &[String], times: &[&Vec<String>]) -> bool {
    let time = |row: usize| -> Vec<&String> {
        let each = times.iter().filter_map(|column| column.get(row));
        each.collect()
    };
    let mut changes = (1..cells.len())
        .filter(|row| cells[*row] != cells[row - 1])
        .peekable();
    changes.peek().is_some() && changes.all(|row| time(row) < time(row - 1))
}

fn is_of_their_state(name: &str) -> bool {
    let plain = name.to_lowercase();
    OF_THEIR_STATE.iter().any(|part| plain.contains(part))
}

fn is_of_points(name: &str) -> bool {
    let plain = name.trim().to_lowercase();
    if is_of_their_state(&plain) {
        return false;
    }
    let mut words = plain.split(|letter: char| !letter.is_alphanumeric());
    words.any(|word| {
        POINT_WORDS.contains(&word) || OF_POINTS.iter().any(|point| word.starts_with(point))
    })
}

/// How many rows have the time of another row that has another name.
fn at_one_time(cells: &[String], times: &[&Vec<String>]) -> usize {
    let mut by_time: BTreeMap<Vec<&str>, (usize, BTreeSet<&str>)> = BTreeMap::new();
    for (row, cell) in cells.iter().enumerate() {
        let time = times.iter().filter_map(|column| column.get(row));
        let time = time.map(String::as_str).collect();
        let (rows, names) = by_time.entry(time).or_default();
        *rows += 1;
        names.insert(cell);
    }
    let shared = by_time.values().filter(|(_, names)| names.len() > 1);
    shared.map(|(rows, _)| rows).sum()
}
