//! Which columns of a table give the time, and how it is written there.

use crate::cli::args::DialectArgs;
use crate::reading::{DecimalMark, Dialect, LocalClock, SummerTime, TimeFormat, Timestamp};
use crate::runtime::ingest::Survey;
use jiff::tz::TimeZone;
use std::collections::BTreeSet;

/// Ways to write a date that are tried.
const DATES: [&str; 15] = [
    "%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%m-%d-%Y",
    "%d.%m.%y", "%d/%m/%y", "%m/%d/%y", "%d-%m-%y", "%m-%d-%y", "%d-%b-%Y", "%d %b %Y",
];
/// And a time of day after it.
const TIMES: [&str; 6] = [
    "",
    " %H:%M",
    " %H:%M:%S",
    " %H:%M:%S%.f",
    " %I:%M %p",
    " %I:%M:%S %p",
];
/// The first cells, which exclude most candidates.
const FIRST_CELLS: usize = 200;
/// Parts of names of columns whose numbers may be times.
const NAMES_OF_TIMES: [&str; 8] = [
    "time", "date", "stamp", "datum", "zeit", "heure", "fecha", "data",
];
/// Cells that are no date, in a column of dates: a repeated header, a line of totals.
const MOST_ODD: usize = 20;
/// Earlier than any recording: a year of two digits read as one of four.
const EARLIEST: Timestamp = Timestamp::constant(-2_524_608_000, 0);

/// The time of a table.
#[derive(Debug, Clone)]
pub(super) struct FoundTimes {
    /// None for one that is named `time` or `t_days`.
    pub(super) columns: Vec<String>,
    pub(super) format: TimeFormat,
    pub(super) needs_zone: bool,
}

/// Finds the time, or says which flag names it.
pub(super) fn find(
    survey: &Survey,
    stated: &DialectArgs,
    decimal: DecimalMark,
) -> Result<FoundTimes, String> {
    let columns = match &stated.time_columns[..] {
        [] => match columns(survey, decimal)? {
            TimeColumns::Days => {
                return Ok(FoundTimes {
                    columns: Vec::new(),
                    format: TimeFormat::Rfc3339,
                    needs_zone: false,
                });
            }
            TimeColumns::Times(columns) => columns,
        },
        stated => (stated.iter().map(|name| place(survey, name)))
            .collect::<Result<Vec<usize>, String>>()?,
    };
    let cells = joined(survey, &columns);
    let format = match &stated.time_format {
        Some(format) => format.clone(),
        None => format_of(&cells, decimal).map_err(|problem| {
            let names: Vec<&str> = columns
                .iter()
                .map(|at| survey.names[*at].as_str())
                .collect();
            format!("column {:?}: {problem}", names.join(" and "))
        })?,
    };
    let names = columns.iter().map(|at| survey.names[*at].clone());
    let is_usual = |name: &String| name.eq_ignore_ascii_case("time");
    let names: Vec<String> = names.collect();
    Ok(FoundTimes {
        needs_zone: needs_zone(&cells, &format, decimal),
        columns: match &names[..] {
            [only] if is_usual(only) => Vec::new(),
            _ => names,
        },
        format,
    })
}

enum TimeColumns {
    /// A column `t_days`.
    Days,
    Times(Vec<usize>),
}

fn place(survey: &Survey, name: &str) -> Result<usize, String> {
    let place = survey.names.iter().position(|one| one == name);
    place.ok_or_else(|| {
        format!(
            "there is no column {name:?} for --time-column; the header has {:?}",
            survey.names
        )
    })
}

fn columns(survey: &Survey, decimal: DecimalMark) -> Result<TimeColumns, String> {
    let named = |name: &str| {
        survey
            .names
            .iter()
            .position(|one| one.eq_ignore_ascii_case(name))
    };
    if let Some(at) = named("time") {
        let is_a_part = survey.columns[at].iter().all(|cell| is_time_of_day(cell));
        if !is_a_part {
            return Ok(TimeColumns::Times(vec![at]));
        }
    }
    if named("t_days").is_some() {
        return Ok(TimeColumns::Days);
    }
    let all: Vec<usize> = (0..survey.names.len()).collect();
    let of_day: Vec<usize> = all
        .iter()
        .copied()
        .filter(|at| is_all_times_of_day(&survey.columns[*at]))
        .collect();
    let dated = all
        .iter()
        .copied()
        .filter(|at| is_dated(survey, *at, decimal));
    let dated: Vec<usize> = dated.collect();
    match (&dated[..], &of_day[..]) {
        ([date], []) => Ok(TimeColumns::Times(vec![*date])),
        ([date], [time]) => Ok(TimeColumns::Times(vec![*date, *time])),
        ([], _) => Err(format!(
            "no column gives a time that is known; the header has {:?}: give --time-column NAME (twice where date and \
             time stand in two), and --time-format, such as \"%d.%m.%Y %H:%M\"; where other lines stand before the header, \
             --skip-lines COUNT",
            survey.names
        )),
        (several, of_day) => {
            let names = several
                .iter()
                .chain(of_day)
                .map(|at| survey.names[*at].as_str());
            Err(format!(
                "several columns give times ({}): give --time-column NAME with the one that says when a row was measured",
                names.collect::<Vec<&str>>().join(", ")
            ))
        }
    }
}

fn is_time_of_day(cell: &str) -> bool {
    let parts: Vec<&str> = cell.split(':').collect();
    let is_part =
        |part: &&str| (1..=2).contains(&part.len()) && part.bytes().all(|c| c.is_ascii_digit());
    (2..=3).contains(&parts.len()) && parts.iter().all(is_part)
}

fn is_all_times_of_day(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some() && filled.all(|cell| is_time_of_day(cell))
}

/// Whether a column holds dates: numbers only where its name says that too.
fn is_dated(survey: &Survey, at: usize, decimal: DecimalMark) -> bool {
    let cells = joined(survey, &[at]);
    let name = survey.names[at].to_lowercase();
    let may_be_numbers = NAMES_OF_TIMES.iter().any(|part| name.contains(part));
    let is_number = |cell: &String| reader(decimal, TimeFormat::Rfc3339).number(cell).is_some();
    if cells.iter().take(FIRST_CELLS).any(is_number) {
        return may_be_numbers && of_numbers(&cells, decimal).is_some();
    }
    !matching(&cells, decimal).is_empty()
}

/// The times as they are read: parts joined by a blank, empty ones left out.
fn joined(survey: &Survey, columns: &[usize]) -> Vec<String> {
    let rows = survey.columns.first().map_or(0, Vec::len);
    let row = |row: usize| {
        let parts: Vec<&str> = columns
            .iter()
            .map(|at| survey.columns[*at][row].as_str())
            .collect();
        parts.join(" ")
    };
    (0..rows)
        .map(row)
        .filter(|cell| !cell.trim().is_empty())
        .collect()
}

/// The one way in which these are written.
fn format_of(cells: &[String], decimal: DecimalMark) -> Result<TimeFormat, String> {
    if let Some(format) = of_numbers(cells, decimal) {
        return Ok(format);
    }
    let formats = matching(cells, decimal);
    match &formats[..] {
        [only] => Ok(only.clone()),
        [] => Err(format!(
            "times like {:?} are in no form that is known; give --time-format, such as \"%d.%m.%Y %H:%M\"",
            cells.first().map_or("", String::as_str)
        )),
        several => {
            let flags = several
                .iter()
                .map(|format| format!("--time-format {:?}", word(format)));
            Err(format!(
                "dates like {:?} can be read in several ways, and no row decides; give {}",
                cells.first().map_or("", String::as_str),
                flags.collect::<Vec<String>>().join(" or ")
            ))
        }
    }
}

/// The word or pattern of the config.
pub(super) fn word(format: &TimeFormat) -> &str {
    match format {
        TimeFormat::Rfc3339 => "rfc3339",
        TimeFormat::Pattern(pattern) => pattern,
        TimeFormat::UnixSeconds => "unix",
        TimeFormat::UnixMilliseconds => "unix_ms",
        TimeFormat::ExcelDays => "excel",
    }
}

fn of_numbers(cells: &[String], decimal: DecimalMark) -> Option<TimeFormat> {
    let dialect = reader(decimal, TimeFormat::Rfc3339);
    let numbers: Option<Vec<f64>> = cells.iter().map(|cell| dialect.number(cell)).collect();
    let numbers = numbers.filter(|numbers| !numbers.is_empty())?;
    let all = |low: f64, high: f64| numbers.iter().all(|number| (low..high).contains(number));
    if all(20_000.0, 80_000.0) {
        Some(TimeFormat::ExcelDays)
    } else if all(1e8, 1e10) {
        Some(TimeFormat::UnixSeconds)
    } else if all(1e11, 1e13) {
        Some(TimeFormat::UnixMilliseconds)
    } else {
        None
    }
}

/// Every way of writing a date in which all cells can be read, one time of day each. Where there is none, a few cells that are no
/// date in any way are left out: the daemon sets such lines aside too, and goes on.
fn matching(cells: &[String], decimal: DecimalMark) -> Vec<TimeFormat> {
    let all = reading_all(cells, decimal);
    if !all.is_empty() {
        return all;
    }
    let is_date = |cell: &&String| !reading_all(std::slice::from_ref(*cell), decimal).is_empty();
    let (mut odd, mut dates) = (0, Vec::new());
    for cell in cells {
        if is_date(&cell) {
            dates.push(cell.clone());
        } else {
            odd += 1;
        }
        if odd > MOST_ODD {
            return all;
        }
    }
    if odd < dates.len() {
        reading_all(&dates, decimal)
    } else {
        all
    }
}

fn reading_all(cells: &[String], decimal: DecimalMark) -> Vec<TimeFormat> {
    let reads = |format: &TimeFormat, cells: &[String]| {
        let dialect = reader(decimal, format.clone());
        let read = |cell: &String| {
            let instant = dialect.instant(cell, &anywhere());
            instant.is_ok_and(|time| time > EARLIEST)
        };
        !cells.is_empty() && cells.iter().all(read)
    };
    let few = &cells[..cells.len().min(FIRST_CELLS)];
    let fits = |format: &TimeFormat| reads(format, few) && reads(format, cells);
    if fits(&TimeFormat::Rfc3339) {
        return vec![TimeFormat::Rfc3339];
    }
    let of_date = |date: &&str| {
        let formats = TIMES
            .iter()
            .map(|time| TimeFormat::Pattern(format!("{date}{time}")));
        formats.into_iter().find(&fits)
    };
    DATES.iter().filter_map(of_date).collect()
}

fn reader(decimal: DecimalMark, time_format: TimeFormat) -> Dialect {
    Dialect {
        decimal,
        time_format,
        ..Dialect::default()
    }
}

/// A clock that shows every local time once.
fn anywhere() -> LocalClock {
    LocalClock {
        zone: Some(TimeZone::UTC),
        summer_time: SummerTime::Earlier,
    }
}

/// Whether some of the times say nothing of their zone.
fn needs_zone(cells: &[String], format: &TimeFormat, decimal: DecimalMark) -> bool {
    let dialect = reader(decimal, format.clone());
    let here = LocalClock::default();
    let distinct: BTreeSet<&String> = cells.iter().take(FIRST_CELLS).collect();
    distinct.into_iter().any(|cell| {
        dialect.instant(cell, &here).is_err() && dialect.instant(cell, &anywhere()).is_ok()
    })
}
