//! Times that are written as numbers.

use crate::reading::suspicion::AHEAD;
use crate::reading::{DecimalMark, Dialect, TimeFormat, Timestamp};
use crate::runtime::clock::now;
use jiff::fmt::strtime::BrokenDownTime;

/// Dates and times in one row of digits, by the number of these.
const COMPACT: [(usize, &str); 4] = [
    (8, "%Y%m%d"),
    (10, "%Y%m%d%H"),
    (12, "%Y%m%d%H%M"),
    (14, "%Y%m%d%H%M%S"),
];
/// The years in which a number of so many digits is taken for such a date.
const COMPACT_YEARS: std::ops::Range<i16> = 1900..2100;

/// The format of numbers, where all of them can be times.
pub(super) fn of_numbers(cells: &[String], decimal: DecimalMark) -> Option<TimeFormat> {
    if let Some(compact) = compact(cells) {
        return Some(compact);
    }
    let dialect = Dialect {
        decimal,
        ..Dialect::default()
    };
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

/// The format of rows of digits that are all dates of one length: a count of seconds is one by chance now and then, but not in all rows.
fn compact(cells: &[String]) -> Option<TimeFormat> {
    let digits = cells.first()?.len();
    let (_, pattern) = COMPACT.iter().find(|(count, _)| *count == digits)?;
    let is_date = |cell: &String| {
        let year = cell.get(..4).and_then(|year| year.parse().ok());
        let read = BrokenDownTime::parse(pattern, cell);
        let date = read.and_then(|read| read.to_date());
        cell.len() == digits
            && cell.bytes().all(|digit| digit.is_ascii_digit())
            && year.is_some_and(|year| COMPACT_YEARS.contains(&year))
            && date.is_ok_and(|date| Some(date.year()) == year)
    };
    cells
        .iter()
        .all(is_date)
        .then(|| TimeFormat::Pattern((*pattern).to_owned()))
}

/// The format itself; for numbers of days, modified Julian days where the column is named so. `newest`: the newest time by the format.
pub(super) fn of_days(
    names: &str,
    first: &str,
    format: TimeFormat,
    newest: Option<Timestamp>,
) -> Result<TimeFormat, String> {
    if format != TimeFormat::ExcelDays {
        return Ok(format);
    }
    let names = names.to_lowercase();
    if names.contains("mjd") || names.contains("julian") {
        return Ok(TimeFormat::JulianDays);
    }
    match newest.filter(|newest| *newest > now() + AHEAD) {
        Some(newest) => Err(format!(
            "numbers such as {} are days of Excel that lie ahead of the clock ({}): for modified Julian days give --time-format mjd, else --time-format excel",
            first,
            newest.strftime("%Y-%m-%d")
        )),
        None => Ok(format),
    }
}
