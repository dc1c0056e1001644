//! Tables that cannot be followed as they are: no header, dates in the header, times that no format can write.

use crate::runtime::ingest::Survey;
use jiff::civil::Date;

/// So many names of columns that are dates show that these stand in the header.
const FEWEST_DATES: usize = 5;
/// How a date is written there.
const DATES: [&str; 3] = ["%Y%m%d", "%Y-%m-%d", "%d.%m.%Y"];

/// What is wrong with the header: it is a row, or it has the dates.
pub(super) fn header(survey: &Survey) -> Option<String> {
    no_header(survey).or_else(|| dates_in_header(survey))
}

/// What is wrong with a file whose first line is a row like those below.
fn no_header(survey: &Survey) -> Option<String> {
    let mut named = survey.names.iter().filter(|name| !name.is_empty());
    let is_value = |name: &String| {
        let is_part = |one: char| one.is_ascii_digit() || "+-.,:;/ TZ".contains(one);
        name.starts_with(|one: char| one.is_ascii_digit() || "+-.".contains(one))
            && name.chars().all(is_part)
    };
    (named.clone().next().is_some() && named.all(is_value)).then(|| {
        format!(
            "its first line ({}) is a row and no header, and the columns have no names: let the logger write a header, or write one line above the \
             rows, with the names of the columns, such as time,P1_displacement_mm",
            survey.names.join(", ")
        )
    })
}

/// What is wrong with a table that has one row a point and one column a date, as those of satellites do.
fn dates_in_header(survey: &Survey) -> Option<String> {
    let is_date = |name: &&String| {
        let digits = name.trim_start_matches(|one: char| one.is_ascii_alphabetic());
        let mut formats = DATES.iter();
        formats.any(|format| Date::strptime(format, digits).is_ok())
    };
    let dates: Vec<&String> = survey.names.iter().filter(is_date).collect();
    let (first, last) = (dates.first()?, dates.last()?);
    (dates.len() >= FEWEST_DATES).then(|| {
        format!(
            "dates stand in its header ({} from {first:?} to {last:?}), one row a point: expected one row a date. Turn the table, so that the \
             dates stand in a column time and each point has a column, such as P1_displacement_mm; a value is then the displacement towards the \
             satellite or away from it, whose sign must be the one of motion downslope",
            dates.len()
        )
    })
}

/// Parts of the names of columns that count time in a way that no format can write, and what these are.
const COUNTS: [(&[&str], &str); 4] = [
    (
        &["gpsweek", "gps week", "gps_week", "tow", "sow", "gpssec"],
        "weeks and seconds of GPS time: as t_days = 7 * week + seconds / 86400, with --epoch 1980-01-06T00:00:00Z, times are 18 s ahead of UTC",
    ),
    (
        &[
            "decimalday",
            "decimal day",
            "decimal_day",
            "day of year",
            "dayofyear",
            "doy",
            "yearday",
        ],
        "days of the year, which may have a fraction: t_days = day - 1, with --epoch and the first of January; whole days in one column and the year \
         in another are read with --time-format \"%Y %j\"",
    ),
    (
        &[
            "decimalyear",
            "decimal year",
            "decimal_year",
            "decyear",
            "yyyy.yyyy",
        ],
        "years with a fraction: the days of them since a day, with --epoch for that day",
    ),
    (
        &[
            "elapsed",
            "since",
            "runtime",
            "verstrichen",
            "laufzeit",
            "ecoul",
            "trascors",
        ],
        "a count since a start: t_days is the same in days, with --epoch for the start",
    ),
];

/// What to do about columns that count time, by their names.
pub(super) fn times(names: &[String]) -> Option<String> {
    let plain = names.iter().map(|name| name.to_lowercase());
    let plain: Vec<String> = plain.collect();
    let (name, what) = COUNTS.iter().find_map(|(parts, what)| {
        let is_one = |name: &String| parts.iter().any(|part| is_in(name, part));
        let at = plain.iter().position(is_one)?;
        Some((&names[at], what))
    })?;
    Some(format!(
        "column {name:?} may be a count that no format can write, and must be converted to days in a column t_days ({what})"
    ))
}

/// Whether the name has this part; one of three letters as a word of its own.
fn is_in(name: &str, part: &str) -> bool {
    if part.len() > 3 {
        return name.contains(part);
    }
    let mut words = name.split(|one: char| !one.is_alphanumeric());
    words.any(|word| word == part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::Delimiter;

    fn named(names: &[&str]) -> Survey {
        Survey {
            delimiter: Delimiter::Comma,
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            columns: Vec::new(),
            encoding: None,
        }
    }

    #[test]
    fn a_row_in_the_place_of_the_header_and_dates_in_it_are_recognised() {
        for (names, said) in [
            (&["2026-09-01T00:00:00Z", "1", "2.5"][..], Some("no header")),
            (&["01.09.2026 00:00;1", "1;2", "3"], Some("no header")),
            (&["101", "2026", "244", "0", "-12.6"], Some("no header")),
            (&["time", "1", "2"], None),
            (
                &[
                    "pid", "20200103", "20200109", "20200115", "20200121", "20200127",
                ],
                Some("one row a point"),
            ),
            (&["pid", "D20200103", "D20200109", "5"], None),
        ] {
            let found = header(&named(names));
            let is_right = match said {
                Some(said) => found.as_ref().is_some_and(|found| found.contains(said)),
                None => found.is_none(),
            };
            assert!(is_right, "{names:?}: {found:?}");
        }
    }

    #[test]
    fn columns_that_count_time_are_named_with_what_they_are_converted_to() {
        for (name, said) in [
            ("GPSWeek", Some("1980-01-06")),
            ("TOW", Some("1980-01-06")),
            ("DecimalDay", Some("day - 1")),
            ("Elapsed (h)", Some("since a start")),
            ("Tower_mm", None),
            ("Datum", None),
        ] {
            let found = times(&[name.to_owned()]);
            let is_right = match said {
                Some(said) => found.as_ref().is_some_and(|found| found.contains(said)),
                None => found.is_none(),
            };
            assert!(is_right, "{name}: {found:?}");
        }
    }
}
