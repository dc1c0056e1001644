//! Times as the clocks of a zone show them, alone and in a text.

use super::{BEFORE_ALL, Timestamp, minute};
use jiff::tz::TimeZone;

/// The text with its times in UTC as the clocks of `zone` show them.
pub fn local(text: &str, zone: &TimeZone) -> String {
    if *zone == TimeZone::UTC {
        return text.to_owned();
    }
    let mut out = String::with_capacity(text.len() + 8);
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let (shown, length) = match time_at(rest) {
            Some((time, length)) => (clock(time, zone), length),
            None => (letter.to_string(), letter.len_utf8()),
        };
        out.push_str(&shown);
        rest = &rest[length..];
    }
    out
}

/// The time in UTC with which `text` begins, and its length.
fn time_at(text: &str) -> Option<(Timestamp, usize)> {
    let is_like = |(byte, like): (u8, u8)| match like {
        b'0' => byte.is_ascii_digit(),
        b'T' => byte == b'T' || byte == b' ',
        other => byte == other,
    };
    let start = text.as_bytes().get(..MINUTE.len())?;
    if !start.iter().copied().zip(MINUTE.bytes()).all(is_like) {
        return None;
    }
    let rest = &text[MINUTE.len()..];
    let seconds = rest.find(|letter: char| !matches!(letter, ':' | '.' | '0'..='9'))?;
    let length = MINUTE.len() + seconds + 1;
    let is_utc = rest[seconds..].starts_with('Z');
    let seconds = if seconds == 0 {
        ":00"
    } else {
        &rest[..seconds]
    };
    let time = format!("{}{seconds}Z", &text[..MINUTE.len()])
        .parse()
        .ok()?;
    is_utc.then_some((time, length))
}

/// How a time begins.
const MINUTE: &str = "0000-00-00T00:00";

/// To the minute, as a clock there shows it.
pub fn clock(time: Timestamp, zone: &TimeZone) -> String {
    if *zone == TimeZone::UTC || time <= BEFORE_ALL {
        return minute(time);
    }
    let local = time.to_zoned(zone.clone());
    local.strftime("%Y-%m-%d %H:%M %Z").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_text_are_shown_by_the_clocks_of_the_zone_and_nothing_else_changes() {
        let rome = TimeZone::get("Europe/Rome").unwrap();
        for (text, shown) in [
            ("2017-06-05 01:00Z  P1", "2017-06-05 03:00 CEST  P1"),
            ("since 2017-01-05T23:30:00Z.", "since 2017-01-06 00:30 CET."),
            (
                "(until 2017-06-05T01:00:00Z): 2017-06-05T02:00:00Z; x",
                "(until 2017-06-05 03:00 CEST): 2017-06-05 04:00 CEST; x",
            ),
            (
                "at 2017-06-05T01:00:00.25Z, é",
                "at 2017-06-05 03:00 CEST, é",
            ),
            ("2017-06-05T01:00:00+02:00", "2017-06-05T01:00:00+02:00"),
            ("2017-06-05 01:00", "2017-06-05 01:00"),
            ("x 2017-06-05é", "x 2017-06-05é"),
        ] {
            assert_eq!(local(text, &rome), shown);
            assert_eq!(local(text, &TimeZone::UTC), text);
        }
    }
}
