//! Files of one instrument whose names differ by their dates alone, as of a logger that begins one each day.

use super::PlannedBenchmark;
use std::collections::BTreeMap;

/// What is wrong with benchmarks that are named after such files: each day would be a benchmark of its own.
pub(super) fn days_of_one(benchmarks: &BTreeMap<String, PlannedBenchmark>) -> Option<String> {
    let mut days: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for id in benchmarks.keys() {
        if let Some(name) = without_date(id) {
            days.entry(name).or_default().push(id);
        }
    }
    let (name, ids) = days.into_iter().find(|(_, ids)| ids.len() > 1)?;
    let id = name.replace('*', "");
    let id = id.trim_matches(|one: char| "-_. ".contains(one));
    Some(format!(
        "{} and {} would be benchmarks of their own, as their columns name none and the names of their files differ by the date alone: if they \
         are days of one benchmark, name one of the files, with --column NAME={}:QUANTITY:UNIT, and then write its path with a * for the others, \
         as in path = \"{name}.csv\"; a file that begins each day is then followed too",
        ids[0],
        ids[1],
        if id.is_empty() { "ID" } else { id },
    ))
}

/// What a source's file is called whose benchmark is named after it, with a * for the date in it: a logger that begins a file each day gives the
/// next one another name.
pub(super) fn of_one_day(path: &str, benchmarks: &[PlannedBenchmark]) -> Option<String> {
    let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
    let is_its_name = |one: &PlannedBenchmark| {
        let id = one.id.as_str();
        name.starts_with(id) && without_date(id).is_some()
    };
    let pattern = without_date(name).filter(|_| benchmarks.iter().any(is_its_name))?;
    Some(match folder {
        "" => pattern,
        folder => format!("{folder}/{pattern}"),
    })
}

/// The name with a * for its date, such as 20261128 or 2026-11-28; `None` where it has none.
fn without_date(name: &str) -> Option<String> {
    let starts = name.char_indices().map(|(at, _)| at);
    let mut dates = starts.filter_map(|at| Some((at, date_length(&name[at..])?)));
    let (at, length) = dates.next()?;
    Some(format!("{}*{}", &name[..at], &name[at + length..]))
}

/// How long the date is that `text` begins with, bytes.
fn date_length(text: &str) -> Option<usize> {
    let separator = text.chars().nth(4).filter(|one| "-_.".contains(*one));
    let format = separator.map_or_else(
        || "%Y%m%d".to_owned(),
        |separator| format!("%Y{separator}%m{separator}%d"),
    );
    let length = if separator.is_some() { 10 } else { 8 };
    let date = text.get(..length)?;
    let digits = date.bytes().filter(u8::is_ascii_digit).count();
    let date = jiff::civil::Date::strptime(&format, date).ok()?;
    (digits == 8 && (1900..2100).contains(&date.year())).then_some(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_in_a_name_is_found_and_other_figures_are_none() {
        for (name, expected) in [
            ("slope-20261128", Some("slope-*")),
            ("2026-11-28_ext7", Some("*_ext7")),
            ("ext7.2026.11.28", Some("ext7.*")),
            ("ext7", None),
            ("ext-1", None),
            ("12345678", None),
            ("preonzo_2012", None),
            ("Hang-\u{fc}ber", None),
        ] {
            assert_eq!(without_date(name).as_deref(), expected, "{name}");
        }
    }
}
