//! A column beside the times that gives the zone of each row.

use super::clock;
use super::dialect::Written;
use super::times::word;
use crate::config::value;
use crate::reading::{Dialect, LocalClock, SummerTime, TimeFormat};
use crate::runtime::ingest::Survey;
use jiff::tz::TimeZone;
use std::collections::BTreeSet;

/// Of the cells of such a column so many in a hundred are filled.
const FILLED_PERCENT: usize = 90;
/// Of the rows so many in a hundred may have another zone than is stated: a clock that is put back a row late.
const OTHER_PERCENT: usize = 1;
/// Zones that are shown.
const SHOWN: usize = 3;
/// Words in the name of a column that has zones.
const OF_ZONES: [&str; 9] = [
    "tz", "zone", "timezone", "zeitzone", "utc", "gmt", "fuso", "fuseau", "huso",
];
/// The same of one that may have them as bare numbers of hours.
const OF_HOURS: [&str; 4] = ["tz", "timezone", "utc", "gmt"];
/// What is a zone in a column of any name.
const CLEAR: [&str; 6] = ["UTC", "GMT", "CET", "CEST", "MEZ", "MESZ"];
/// How a time of RFC 3339 without its offset is written.
const WITHOUT_OFFSET: [&str; 6] = [
    "%Y-%m-%d %H:%M:%S",
    "%Y-%m-%d %H:%M:%S%.f",
    "%Y-%m-%d %H:%M",
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%dT%H:%M:%S%.f",
    "%Y-%m-%dT%H:%M",
];
/// And an offset behind it.
const OFFSETS: [&str; 2] = [" %:z", " %z"];

/// Reads the times of a table by a column of zones, where it has one: by the one zone that it has, or by an offset that stands in each row. What
/// `stated` says counts; gives what is doubtful then, as a question.
///
/// # Errors
/// Which flag says the zone, where the column has several that are no offsets.
pub(super) fn follow(
    survey: &Survey,
    written: &mut Written,
    stated: Option<&TimeZone>,
) -> Result<Option<String>, String> {
    let Some(zones) = RowZones::of(survey, &written.dialect).filter(|_| written.needs_zone) else {
        return Ok(None);
    };
    if let Some(stated) = stated {
        return Ok(zones.differ_from(stated, &written.dialect));
    }
    if let Some(by_name) = &written.zone {
        return zones
            .differ_from(by_name, &written.dialect)
            .map_or(Ok(None), Err);
    }
    written.zone = zones.one_for_all();
    if written.zone.is_none() {
        written.dialect = zones.with_offsets(&written.dialect)?;
        written.needs_zone = false;
    }
    Ok(None)
}

/// The zones of a table's rows.
struct RowZones<'a> {
    /// The name of their column.
    name: &'a str,
    cells: &'a [String],
    /// The times as they are read, by row.
    times: Vec<String>,
    /// The names of their columns.
    time_columns: Vec<String>,
}

impl<'a> RowZones<'a> {
    fn of(survey: &'a Survey, dialect: &Dialect) -> Option<Self> {
        let usual = |name: &&String| name.eq_ignore_ascii_case("time");
        let time_columns = match &dialect.time_columns[..] {
            [] => vec![survey.names.iter().find(usual)?.clone()],
            stated => stated.to_vec(),
        };
        let columns = || survey.names.iter().zip(&survey.columns);
        let others = columns().filter(|(name, _)| !time_columns.contains(name));
        let (name, cells) = others
            .into_iter()
            .find(|(name, cells)| are_zones(name, cells))?;
        let place = |name: &String| survey.names.iter().position(|one| one == name);
        let places: Vec<usize> = time_columns.iter().filter_map(place).collect();
        let row = |row: usize| {
            let parts = places.iter().map(|at| survey.columns[*at][row].as_str());
            parts.collect::<Vec<&str>>().join(" ")
        };
        Some(Self {
            times: (0..cells.len()).map(row).collect(),
            name,
            cells,
            time_columns,
        })
    }

    fn filled(&self) -> impl Iterator<Item = &'a str> {
        let cells = self.cells.iter().map(String::as_str);
        cells.filter(|cell| !cell.is_empty())
    }

    fn zone(&self, cell: &str) -> Option<TimeZone> {
        zone_of(self.name, cell)
    }

    /// The zone of all rows, where it is one that later rows do not change: what is CET or +01:00 in winter is another one in summer.
    fn one_for_all(&self) -> Option<TimeZone> {
        let first = self.filled().next()?;
        let is_lasting = ["UTC", "GMT", "Z"].contains(&first) || first.contains('/');
        (is_lasting && self.filled().all(|cell| cell == first)).then(|| self.zone(first))?
    }

    /// The zones, each once, the first of them.
    fn shown(&self) -> String {
        let distinct: BTreeSet<&str> = self.filled().collect();
        let first = distinct.iter().take(SHOWN).copied();
        let more = if distinct.len() > SHOWN { ", ..." } else { "" };
        format!("{}{more}", first.collect::<Vec<&str>>().join(", "))
    }

    /// What is said where the rows' zones are others than this one.
    fn differ_from(&self, stated: &TimeZone, dialect: &Dialect) -> Option<String> {
        let by = |zone: &TimeZone, summer_time, text: &str| {
            let clock = LocalClock {
                zone: Some(zone.clone()),
                summer_time,
            };
            dialect.instant(text, &clock).ok()
        };
        let is_other = |(text, cell): &(&String, &String)| {
            let here = self
                .zone(cell)
                .and_then(|zone| by(&zone, SummerTime::Earlier, text));
            let stated = [SummerTime::Earlier, SummerTime::Later].map(|one| by(stated, one, text));
            here.is_some() && !stated.contains(&here)
        };
        let others = self.times.iter().zip(self.cells).filter(is_other).count();
        (100 * others > OTHER_PERCENT * self.cells.len()).then(|| {
            format!(
                "column {:?} gives the zone of each row ({}), and {others} of {} rows have another offset there than by {}, which counts: is that \
                 right?",
                self.name,
                self.shown(),
                self.cells.len(),
                stated.iana_name().unwrap_or("the one that is stated")
            )
        })
    }

    /// The dialect with the offset as the last part of a time.
    fn with_offsets(&self, dialect: &Dialect) -> Result<Dialect, String> {
        let own = word(&dialect.time_format);
        let patterns = match &dialect.time_format {
            TimeFormat::Rfc3339 => &WITHOUT_OFFSET[..],
            TimeFormat::Pattern(_) => &[own],
            TimeFormat::UnixSeconds
            | TimeFormat::UnixMilliseconds
            | TimeFormat::ExcelDays
            | TimeFormat::JulianDays => &[],
        };
        let formats = patterns.iter().flat_map(|pattern| {
            OFFSETS.map(|offset| TimeFormat::Pattern(format!("{pattern}{offset}")))
        });
        let mut dialects = formats.map(|time_format| Dialect {
            time_format,
            time_columns: [&self.time_columns[..], &[self.name.to_owned()]].concat(),
            ..dialect.clone()
        });
        let rows = || self.times.iter().zip(self.cells);
        let nowhere = LocalClock::default();
        let reads_all = |dialect: &Dialect| {
            let filled = rows().filter(|(text, cell)| !text.trim().is_empty() && !cell.is_empty());
            let mut texts = filled.map(|(text, cell)| format!("{text} {cell}"));
            texts.all(|text| dialect.instant(&text, &nowhere).is_ok())
        };
        dialects.find(reads_all).ok_or_else(|| {
            format!(
                "column {:?} gives the zone of each row ({}): give --time-zone with the zone of the logger's clock, such as Europe/Rome, or +01:00 \
                 where it is never changed",
                self.name,
                self.shown()
            )
        })
    }
}

/// Whether nearly all cells are zones, by themselves or as the column's name says.
fn are_zones(name: &str, cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    let count = filled.clone().count();
    filled.peek().is_some()
        && 100 * count >= FILLED_PERCENT * cells.len()
        && filled.all(|cell| zone_of(name, cell).is_some() || is_offset(cell))
}

/// Whether it is an offset such as +02:00.
fn is_offset(cell: &str) -> bool {
    let rest = cell.strip_prefix(['+', '-']).unwrap_or_default();
    let parts = rest.split_once(':');
    let is_of_two = |part: &str| part.len() == 2 && part.bytes().all(|one| one.is_ascii_digit());
    parts.is_some_and(|(hours, minutes)| is_of_two(hours) && is_of_two(minutes))
}

/// The zone that a cell means in a column of this name.
fn zone_of(name: &str, cell: &str) -> Option<TimeZone> {
    if CLEAR.contains(&cell) || is_offset(cell) {
        return clock::of_letters(cell).or_else(|| value::time_zone(cell).ok());
    }
    let plain = name.to_lowercase();
    let has = |words: &[&str]| {
        let mut parts = plain.split(|one: char| !one.is_alphanumeric());
        parts.any(|part| words.contains(&part))
    };
    if !has(&OF_ZONES) {
        return None;
    }
    if cell == "Z" {
        return Some(TimeZone::UTC);
    }
    if let Ok(hours) = cell.trim_start_matches('+').parse::<i8>() {
        let is_one = has(&OF_HOURS) && (-12..=14).contains(&hours);
        return clock::of_hours(hours).filter(|_| is_one);
    }
    clock::of_letters(cell).or_else(|| value::time_zone(cell).ok())
}
