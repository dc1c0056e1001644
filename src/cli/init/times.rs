//! Which columns of a table give the time, and how it is written there.

use super::clock;
use super::numbers::{of_days, of_numbers};
use super::unreadable;
use crate::cli::args::DialectArgs;
use crate::reading::{DecimalMark, Dialect, LocalClock, SummerTime, TimeFormat, Timestamp};
use crate::runtime::ingest::Survey;
use jiff::SignedDuration;
use jiff::tz::TimeZone;
use std::collections::{BTreeMap, BTreeSet};

/// Ways to write a date that are tried.
const DATES: [&str; 18] = [
    "%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%m-%d-%Y",
    "%d.%m.%y", "%d/%m/%y", "%m/%d/%y", "%d-%m-%y", "%m-%d-%y", "%y.%m.%d", "%y/%m/%d", "%y-%m-%d",
    "%d-%b-%Y", "%d %b %Y",
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
/// The same without colons, after a year of four digits: behind two of them a blank need not stand, and `2017` would be a year and an hour.
const TIMES_WITHOUT_COLONS: [&str; 5] = [" %H", " %H%M", " %H%M%S", " %H.%M", " %Hh%M"];
/// Parts of names of columns whose numbers may be times of day.
const NAMES_OF_TIMES_OF_DAY: [&str; 9] = [
    "time", "zeit", "uhr", "stunde", "ora", "heure", "hora", "hour", "hhmm",
];
/// The first cells, which exclude most candidates.
const FIRST_CELLS: usize = 200;
/// Parts of names of columns whose numbers may be times.
const NAMES_OF_TIMES: [&str; 8] = [
    "time", "date", "stamp", "datum", "zeit", "heure", "fecha", "data",
];
/// The same, of counts of days or seconds.
const NAMES_OF_COUNTS: [&str; 4] = ["epoch", "unix", "mjd", "julian"];
/// Columns of the header that an error shows with their first cell.
const MOST_SHOWN: usize = 8;
/// Cells that are no date, in a column of dates: a repeated header, a line of totals.
const MOST_ODD: usize = 20;
/// Steps of the times that are larger and go both ways show that they are in no order.
const DISORDER: SignedDuration = SignedDuration::from_hours(36);
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
    let format = if let Some(format) = &stated.time_format {
        format.clone()
    } else {
        let names: Vec<String> = columns.iter().map(|at| survey.names[*at].clone()).collect();
        let found = format_of(&cells, decimal);
        let found = found.map_err(|problem| unreadable::times(&names).unwrap_or(problem));
        let names = names.join(" and ");
        let found = found.and_then(|format| {
            let newest = instants(&cells, &format, decimal).into_iter().max();
            of_days(&names, first_of(&cells), format, newest)
        });
        let found = found.and_then(|format| with_all_hours(&cells, format, decimal));
        found.map_err(|problem| format!("column {names:?}: {problem}"))?
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

/// The format itself, unless the times are those of a clock of 12 hours.
fn with_all_hours(
    cells: &[String],
    format: TimeFormat,
    decimal: DecimalMark,
) -> Result<TimeFormat, String> {
    let pattern = match &format {
        TimeFormat::Rfc3339 => "rfc3339",
        TimeFormat::Pattern(pattern) if pattern.contains("%H") => pattern,
        TimeFormat::Pattern(_)
        | TimeFormat::UnixSeconds
        | TimeFormat::UnixMilliseconds
        | TimeFormat::ExcelDays
        | TimeFormat::JulianDays => return Ok(format),
    };
    let times = instants(cells, &format, decimal);
    match clock::of_twelve_hours(&times, pattern) {
        Some(problem) => Err(problem),
        None => Ok(format),
    }
}

/// The times on the logger's clock, taken as UTC.
fn instants(cells: &[String], format: &TimeFormat, decimal: DecimalMark) -> Vec<Timestamp> {
    let dialect = reader(decimal, format.clone());
    let times = cells.iter();
    times
        .filter_map(|cell| dialect.instant(cell, &anywhere()).ok())
        .collect()
}

/// The column that says of each row whether it is before or after noon.
fn half_of_day(survey: &Survey) -> Option<usize> {
    survey.columns.iter().position(|cells| {
        let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
        let is_half =
            |cell: &String| cell.eq_ignore_ascii_case("AM") || cell.eq_ignore_ascii_case("PM");
        filled.peek().is_some() && filled.all(is_half)
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
    if let Some(at) = named("time")
        && !is_all_times_of_day(survey, at)
    {
        let half = half_of_day(survey);
        return Ok(TimeColumns::Times([at].into_iter().chain(half).collect()));
    }
    if named("t_days").is_some() {
        return Ok(TimeColumns::Days);
    }
    let all: Vec<usize> = (0..survey.names.len()).collect();
    let of_day: Vec<usize> = all
        .iter()
        .copied()
        .filter(|at| is_all_times_of_day(survey, *at))
        .collect();
    let dated = all
        .iter()
        .copied()
        .filter(|at| is_dated(survey, *at, decimal));
    let mut dated: Vec<usize> = dated.collect();
    // A count beside a date, of epochs say, is not what says when a row was measured.
    let is_count = |at: &usize| {
        let name = survey.names[*at].to_lowercase();
        NAMES_OF_COUNTS.iter().any(|part| name.contains(part))
    };
    if !dated.iter().all(is_count) {
        dated.retain(|at| !is_count(at));
    }
    let half = half_of_day(survey);
    match (&dated[..], &of_day[..]) {
        ([date], []) => match days_alone(survey, *date, decimal) {
            Some(problem) => Err(problem),
            None => Ok(TimeColumns::Times(
                [*date].into_iter().chain(half).collect(),
            )),
        },
        ([date], [time]) => Ok(TimeColumns::Times(
            [*date, *time].into_iter().chain(half).collect(),
        )),
        ([], _) => Err(no_times(survey)),
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

/// What is said of a table without times.
fn no_times(survey: &Survey) -> String {
    let columns = with_first_cells(survey);
    if let Some(counted) = unreadable::times(&survey.names) {
        return format!(
            "no column gives a time that is known; the header has {columns}: {counted}"
        );
    }
    format!(
        "no column gives a time that is known; the header has {columns}: give --time-column NAME (once for each column where date and \
         time stand in several), and --time-format, such as \"%d.%m.%Y %H:%M\", in which a word such as CET stands as it does in the cells, with \
         --time-zone; where other lines stand before the header, --skip-lines COUNT; what no format can write, such as weeks of GPS time, days \
         with a fraction or hours since a start, must be converted to days in a column t_days, with --epoch for day 0"
    )
}

/// The names of the columns, each with its first cell that holds something.
fn with_first_cells(survey: &Survey) -> String {
    let shown = survey.names.iter().zip(&survey.columns).take(MOST_SHOWN);
    let shown = shown.map(|(name, cells)| {
        let first = cells.iter().find(|cell| !cell.trim().is_empty());
        first.map_or_else(
            || format!("{name:?}"),
            |cell| format!("{name:?} (such as {cell:?})"),
        )
    });
    let shown: Vec<String> = shown.collect();
    match survey.names.len().saturating_sub(MOST_SHOWN) {
        0 => shown.join(", "),
        others => format!("{} and {others} more", shown.join(", ")),
    }
}

/// What is wrong with a column that gives no more than the day of a row, where most rows have the day of another.
fn days_alone(survey: &Survey, date: usize, decimal: DecimalMark) -> Option<String> {
    let cells = joined(survey, &[date]);
    let formats =
        of_numbers(&cells, decimal).map_or_else(|| matching(&cells, decimal), |one| vec![one]);
    let patterns = formats.iter().map(|format| match format {
        TimeFormat::Pattern(pattern) if !pattern.contains("%H") && !pattern.contains("%I") => {
            Some(pattern.as_str())
        }
        TimeFormat::Pattern(_)
        | TimeFormat::Rfc3339
        | TimeFormat::UnixSeconds
        | TimeFormat::UnixMilliseconds
        | TimeFormat::ExcelDays
        | TimeFormat::JulianDays => None,
    });
    let patterns: Option<Vec<&str>> = patterns.collect();
    let pattern = *patterns?.first()?;
    let mut rows: BTreeMap<&String, usize> = BTreeMap::new();
    for cell in &cells {
        *rows.entry(cell).or_default() += 1;
    }
    let repeated: usize = rows.values().filter(|rows| **rows > 1).sum();
    if 2 * repeated <= cells.len() {
        return None;
    }
    let name = &survey.names[date];
    Some(format!(
        "column {name:?} gives no more than the day, and {repeated} of {} rows have the day of another one: give --time-column \
         {name:?} and --time-column with the name of the column that has the time of day, and --time-format, such as \
         \"{pattern} %H:%M\"; where each row does stand for a whole day, --time-column {name:?} alone. The header has {:?}",
        cells.len(),
        survey.names
    ))
}

fn is_all_times_of_day(survey: &Survey, at: usize) -> bool {
    let name = survey.names[at].to_lowercase();
    let is_named = NAMES_OF_TIMES_OF_DAY.iter().any(|part| name.contains(part));
    let cells = survey.columns[at].iter();
    let mut filled = cells.filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some()
        && filled
            .all(|cell| clock::is_time_of_day(cell) || is_named && clock::may_be_time_of_day(cell))
}

/// Whether a name in lower case is one of numbers that may be times.
fn may_name_times(name: &str) -> bool {
    let mut parts = NAMES_OF_TIMES.iter().chain(&NAMES_OF_COUNTS);
    parts.any(|part| name.contains(part))
}

/// Whether the numbers of a column may be times, by its name.
pub(super) fn may_be_time(survey: &Survey, at: usize) -> bool {
    let name = survey.names[at].to_lowercase();
    may_name_times(&name) || name == "t_days" || is_all_times_of_day(survey, at)
}

/// Whether a column holds dates: numbers only where its name says that too.
fn is_dated(survey: &Survey, at: usize, decimal: DecimalMark) -> bool {
    let cells = joined(survey, &[at]);
    let name = survey.names[at].to_lowercase();
    let may_be_numbers = may_name_times(&name);
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

fn first_of(cells: &[String]) -> &str {
    cells.first().map_or("", String::as_str)
}

/// The one way in which these are written.
fn format_of(cells: &[String], decimal: DecimalMark) -> Result<TimeFormat, String> {
    if let Some(format) = of_numbers(cells, decimal) {
        return Ok(format);
    }
    let formats = in_order(matching(cells, decimal), cells, decimal);
    match &formats[..] {
        [only] => Ok(only.clone()),
        [] => Err(format!(
            "times like {:?} are in no form that is known; give --time-format, such as \"%d.%m.%Y %H:%M\"; what no format can write must be converted to days in \
             a column t_days, with --epoch for day 0",
            first_of(cells)
        )),
        several => {
            let flags = several
                .iter()
                .map(|format| format!("--time-format {:?}", word(format)));
            Err(format!(
                "dates like {:?} can be read in several ways, and no row decides; give {}",
                first_of(cells),
                flags.collect::<Vec<String>>().join(" or ")
            ))
        }
    }
}

/// Those of several formats by which the times go one way; all of them where none does.
fn in_order(formats: Vec<TimeFormat>, cells: &[String], decimal: DecimalMark) -> Vec<TimeFormat> {
    if formats.len() < 2 {
        return formats;
    }
    let goes_one_way = |format: &&TimeFormat| {
        let times = instants(cells, format, decimal);
        let steps = || times.windows(2).map(|pair| pair[1].duration_since(pair[0]));
        let back = steps().filter(SignedDuration::is_negative).count();
        let on = steps().filter(SignedDuration::is_positive).count();
        // Clocks are put back, and rows of one day change places: but against most of the steps none is long.
        !steps().any(|step| {
            if on >= back {
                step < -DISORDER
            } else {
                step > DISORDER
            }
        })
    };
    let ordered: Vec<TimeFormat> = formats.iter().filter(goes_one_way).cloned().collect();
    if ordered.is_empty() { formats } else { ordered }
}

/// The word or pattern of the config.
pub(super) fn word(format: &TimeFormat) -> &str {
    match format {
        TimeFormat::Rfc3339 => "rfc3339",
        TimeFormat::Pattern(pattern) => pattern,
        TimeFormat::UnixSeconds => "unix",
        TimeFormat::UnixMilliseconds => "unix_ms",
        TimeFormat::ExcelDays => "excel",
        TimeFormat::JulianDays => "mjd",
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
        let others = TIMES_WITHOUT_COLONS.iter();
        let others = others.filter(|_| date.contains("%Y"));
        let formats = TIMES
            .iter()
            .chain(others)
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
