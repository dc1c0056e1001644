//! What the times of a table, and the names of their columns, say of the logger's clock.

use crate::config::value;
use crate::reading::{Timestamp, bracketed};
use jiff::tz::TimeZone;

/// Fewer times show nothing.
const FEWEST_TIMES: usize = 10;
/// Of the steps from one time to the next, one in so many goes back where a clock shows each hour twice.
const ONE_IN: usize = 20;

/// What is wrong with times on the logger's clock, taken as UTC, of which no hour is over 12 and that are in no order; `pattern`: how
/// they would be written with AM and PM.
pub(super) fn of_twelve_hours(times: &[Timestamp], pattern: &str) -> Option<String> {
    let hours = times.iter().map(|time| time.to_zoned(TimeZone::UTC).hour());
    let (low, high) = hours.fold((i8::MAX, i8::MIN), |(low, high), hour| {
        (low.min(hour), high.max(hour))
    });
    if times.len() < FEWEST_TIMES || low < 1 || high > 12 {
        return None;
    }
    let steps = || times.windows(2).map(|pair| pair[1].cmp(&pair[0]));
    let back = steps().filter(|step| step.is_lt()).count();
    let on = steps().filter(|step| step.is_gt()).count();
    // Rows of several points have one time.
    let odd = back.min(on);
    (ONE_IN * odd >= times.len()).then(|| {
        format!(
            "no hour is over 12 and none is 0, and {odd} times go back: a clock of 12 hours without AM and PM shows each hour twice a \
             day. Let the logger write 24 hours, or AM and PM; where the hours are right as they stand, give --time-format {pattern:?}"
        )
    })
}

/// The zone that the name of a column of times has: `Time (UTC)`, `time_utc`, `Timestamp_GMT+08:00`, `Time (Europe/Rome)`.
pub(super) fn zone_in_name(name: &str) -> Option<TimeZone> {
    if let Some(zone) = bracketed(name).filter(|zone| zone.contains('/')) {
        return value::time_zone(zone).ok();
    }
    let plain = name.to_ascii_uppercase().replace('\u{2212}', "-");
    let at = ["UTC", "GMT"].iter().find_map(|word| plain.find(word))?;
    let is_within = plain[..at].ends_with(|one: char| one.is_alphanumeric());
    let rest = &plain[at + 3..];
    let behind = rest.trim_start();
    let rest = if behind.starts_with(['+', '-']) {
        behind
    } else if behind.contains(|one: char| one.is_ascii_digit())
        || behind.contains("PLUS")
        || behind.contains("MINUS")
        || behind.contains("OFFSET")
    {
        // An offset that is written in a way of its own: for people to say.
        return None;
    } else {
        rest
    };
    let offset: String = rest
        .chars()
        .take_while(|one| one.is_ascii_digit() || "+-:".contains(*one))
        .collect();
    let is_end = !rest[offset.len()..].starts_with(|one: char| one.is_alphanumeric() || one == '_');
    if is_within || !is_end {
        return None;
    }
    value::time_zone(&format!("{}{offset}", &plain[at..at + 3])).ok()
}

/// The zones that letters stand for in the name of a column, of which none is UTC, and their hours before UTC.
const LETTERS: [(&str, i8); 9] = [
    ("CET", 1),
    ("MEZ", 1),
    ("CEST", 2),
    ("MESZ", 2),
    ("EET", 2),
    ("EST", -5),
    ("CST", -6),
    ("MST", -7),
    ("PST", -8),
];

fn zone_by_letters(name: &str) -> Option<(&str, TimeZone)> {
    let mut words = name.split(|one: char| !one.is_alphanumeric());
    words.find_map(|word| Some((word, of_letters(word)?)))
}

/// The zone that these letters stand for, which is never changed: that of CET.
pub(super) fn of_letters(word: &str) -> Option<TimeZone> {
    let (_, hours) = LETTERS.iter().find(|(letters, _)| *letters == word)?;
    of_hours(*hours)
}

/// The zone of so many hours before UTC.
pub(super) fn of_hours(hours: i8) -> Option<TimeZone> {
    value::time_zone(&format!("{hours:+03}:00")).ok()
}

/// What is said where the name of a column of times has another zone than is stated.
pub(super) fn another_zone(name: &str, stated: &TimeZone) -> Option<String> {
    let by_letters = || zone_by_letters(name).map(|(letters, zone)| (letters.to_owned(), zone));
    let by_name = |zone: TimeZone| (zone.iana_name().unwrap_or("UTC").to_owned(), zone);
    let (word, named) = zone_in_name(name).map(by_name).or_else(by_letters)?;
    // A day of winter, and one of summer.
    let differ = ["2026-01-15T12:00:00Z", "2026-07-15T12:00:00Z"]
        .iter()
        .filter_map(|day| day.parse::<Timestamp>().ok())
        .any(|day| named.to_offset(day) != stated.to_offset(day));
    differ.then(|| {
        format!(
            "column {name:?} has the zone {} in its name, and --time-zone is {}, which counts: is that right?",
            word,
            stated.iana_name().unwrap_or("UTC")
        )
    })
}

/// Whether a cell is hours, minutes and perhaps seconds, parted by colons, with `AM` or `PM` or without.
pub(super) fn is_time_of_day(cell: &str) -> bool {
    let plain = cell
        .trim_end_matches(['A', 'P', 'a', 'p', 'M', 'm'])
        .trim_end();
    let has_half = ["AM", "PM", "am", "pm"]
        .iter()
        .any(|half| cell.ends_with(half));
    let clock = if has_half { plain } else { cell };
    let parts: Vec<&str> = clock.split(':').collect();
    let is_part =
        |part: &&str| (1..=2).contains(&part.len()) && part.bytes().all(|c| c.is_ascii_digit());
    (2..=3).contains(&parts.len()) && parts.iter().all(is_part)
}

/// Whether a cell may be a time of day in a column that is named so: `0930`, `093000`, `09.30`, `09h30` or `09`.
pub(super) fn may_be_time_of_day(cell: &str) -> bool {
    let digits: String = cell.replacen(['.', 'h'], "", 1);
    let is_all = digits.bytes().all(|c| c.is_ascii_digit());
    let part = |at: usize| {
        digits
            .get(at..at + 2)
            .and_then(|part| part.parse::<u8>().ok())
    };
    let is_clock = match digits.len() {
        2 => part(0) <= Some(24),
        4 | 6 => part(0) <= Some(24) && part(2) < Some(60) && part(4) < Some(60),
        _ => false,
    };
    is_all && is_clock
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_in_the_name_of_a_column_is_found() {
        for (name, expected) in [
            ("Time (UTC)", Some("UTC")),
            ("time_utc", Some("UTC")),
            ("Timestamp_GMT+08:00", Some("Etc/GMT-8")),
            ("Time (UTC+1)", Some("Etc/GMT-1")),
            ("Time (GMT-03)", Some("Etc/GMT+3")),
            ("Time (UTC -7)", Some("Etc/GMT+7")),
            ("Time [UTC +1]", Some("Etc/GMT-1")),
            ("Time (UTC\u{2212}7)", Some("Etc/GMT+7")),
            ("Time (UTC plus 2)", None),
            ("UTC offset 02:00", None),
            ("Zeit [Europe/Rome]", Some("Europe/Rome")),
            ("time", None),
            ("Time (local)", None),
            ("utcome", None),
            ("Datum", None),
        ] {
            let zone = zone_in_name(name);
            let zone = zone.as_ref().and_then(TimeZone::iana_name);
            assert_eq!(zone, expected, "{name}");
        }
        let rome = TimeZone::get("Europe/Rome").unwrap();
        assert!(another_zone("Time (UTC)", &rome).is_some());
        assert!(another_zone("Time (UTC)", &TimeZone::UTC).is_none());
        let said = another_zone("Time (MST)", &rome).unwrap();
        assert!(said.contains("has the zone MST in its name"), "{said}");
        assert!(another_zone("test", &rome).is_none());
    }

    #[test]
    fn a_clock_of_twelve_hours_is_seen_where_its_times_repeat() {
        let start: Timestamp = "2026-11-09T00:00:00Z".parse().unwrap();
        let at = |hour: i64| {
            let shown = match hour.rem_euclid(12) {
                0 => 12,
                rest => rest,
            };
            start + jiff::SignedDuration::from_hours(24 * (hour / 24) + shown)
        };
        let all: Vec<Timestamp> = (0..96).map(at).collect();
        let pattern = "%m/%d/%Y %H:%M";
        assert!(of_twelve_hours(&all, pattern).is_some_and(|said| said.contains(pattern)));
        let mornings: Vec<Timestamp> = (0..96).filter(|hour| hour % 24 < 12).map(at).collect();
        assert!(of_twelve_hours(&mornings[1..12], pattern).is_none());
    }
}
