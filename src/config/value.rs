//! Values with units: durations, speeds, accelerations, levels. `Err` says what to write instead.

use crate::alert::Level;
use crate::reading::{Quantity, Timestamp, Unit};
use jiff::SignedDuration;
use jiff::tz::TimeZone;

/// A duration longer than zero: `12h`, `30d`, `1h 30min`.
pub(crate) fn duration(text: &str) -> Result<SignedDuration, String> {
    let parsed = humantime::parse_duration(text)
        .map_err(|_| "write a number and a unit: \"10s\", \"12h\", \"30d\"".to_owned())?;
    if parsed.is_zero() {
        return Err("write a duration longer than zero, such as \"12h\"".to_owned());
    }
    SignedDuration::try_from(parsed).map_err(|_| "write a shorter duration".to_owned())
}

/// A duration of zero or more: `0s`, `10m`.
pub(super) fn duration_or_none(text: &str) -> Result<SignedDuration, String> {
    humantime::parse_duration(text)
        .ok()
        .and_then(|parsed| SignedDuration::try_from(parsed).ok())
        .ok_or_else(|| "write a number and a unit: \"0s\", \"10m\"".to_owned())
}

/// An instant: `2017-06-06T17:00:00Z`.
pub(crate) fn instant(text: &str) -> Result<Timestamp, String> {
    text.parse().map_err(|_| {
        if text.parse::<jiff::civil::Date>().is_ok() && !text.contains(':') {
            format!("write the time of day and the offset too, as in \"{}T17:00:00Z\"", text.trim())
        } else {
            "write it with its offset, as in \"2017-06-06T17:00:00Z\" or \"2017-06-06T19:00:00+02:00\"".to_owned()
        }
    })
}

/// A time zone by its IANA name, `Europe/Rome`, or by an offset of whole hours that never changes, `+01:00` or `UTC+1`.
pub(crate) fn time_zone(text: &str) -> Result<TimeZone, String> {
    let by_name = TimeZone::get(text);
    by_name.or_else(|_| {
        let zone = fixed_zone(text).and_then(|name| TimeZone::get(&name).ok());
        zone.ok_or_else(|| {
            "write an IANA name, such as \"Europe/Rome\", or an offset of whole hours, such as \"+01:00\", which is Etc/GMT-1"
                .to_owned()
        })
    })
}

/// The IANA name of an offset of whole hours, whose sign is the other way round: `Etc/GMT-1` of `+01:00`.
fn fixed_zone(text: &str) -> Option<String> {
    let plain = text.trim().to_ascii_uppercase();
    let bare = plain.strip_prefix("UTC").or(plain.strip_prefix("GMT"));
    let offset = bare.unwrap_or(&plain).trim();
    let (sign, rest) = match (offset.strip_prefix('+'), offset.strip_prefix('-')) {
        (Some(rest), _) => ('-', rest),
        (None, Some(rest)) => ('+', rest),
        (None, None) => return None,
    };
    let rest = rest
        .strip_suffix(":00")
        .or(rest.strip_suffix("00").filter(|rest| rest.len() == 2));
    let hours = rest.unwrap_or(offset.get(1..)?);
    if !(1..=2).contains(&hours.len()) || !hours.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    match hours.parse::<u8>().ok()? {
        0 => Some("UTC".to_owned()),
        hours => Some(format!("Etc/GMT{sign}{hours}")),
    }
}

/// A speed in mm/day: `1 m/day`, `50 mm/day`.
pub(crate) fn speed(text: &str) -> Result<f64, String> {
    measure(text, Quantity::Velocity, "\"50 mm/day\" or \"1 m/day\"")
}

/// A length in mm: `500 mm`.
pub(super) fn length(text: &str) -> Result<f64, String> {
    measure(text, Quantity::Displacement, "\"500 mm\" or \"2 m\"")
}

/// An acceleration in mm/day per day: `5 mm/day/day`.
pub(super) fn acceleration(text: &str) -> Result<f64, String> {
    let fix = || "write a positive number and a unit: \"5 mm/day/day\"".to_owned();
    let (number, unit) = split(text).ok_or_else(fix)?;
    let (rate, per) = unit.rsplit_once('/').ok_or_else(fix)?;
    let rate = Unit::parse(rate).map_err(|_| fix())?;
    let per = Unit::parse(&format!("mm/{per}")).map_err(|_| fix())?;
    if rate.quantity() != Quantity::Velocity {
        return Err(fix());
    }
    Ok(number * rate.factor() * per.factor())
}

fn measure(text: &str, quantity: Quantity, examples: &str) -> Result<f64, String> {
    let fix = || format!("write a positive number and a unit: {examples}");
    let (number, unit) = split(text).ok_or_else(fix)?;
    let unit = Unit::parse(unit).map_err(|_| fix())?;
    if unit.quantity() == quantity {
        Ok(number * unit.factor())
    } else {
        Err(fix())
    }
}

fn split(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = text
        .find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)))
        .unwrap_or(text.len());
    let number: f64 = text[..end].parse().ok()?;
    (number.is_finite() && number > 0.0).then(|| (number, text[end..].trim()))
}

/// So many bytes: `64 MB`, `1 GB`, `512 kB`, `10000 B`.
pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let fix = || "write a positive number and a unit: \"64 MB\", \"1 GB\"".to_owned();
    let (number, unit) = split(text).ok_or_else(fix)?;
    let factor = match unit {
        "B" => 1.0,
        "kB" => 1e3,
        "MB" => 1e6,
        "GB" => 1e9,
        "TB" => 1e12,
        _ => return Err(fix()),
    };
    let bytes = number * factor;
    if !(1.0..1e18).contains(&bytes) {
        return Err(fix());
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within the range of a u64"
    )]
    let whole = bytes as u64;
    Ok(whole)
}

/// A level by its word.
pub(super) fn level(text: &str) -> Result<Level, String> {
    [
        Level::Green,
        Level::Yellow,
        Level::Orange,
        Level::Red,
        Level::Unknown,
    ]
    .into_iter()
    .find(|level| level.name() == text)
    .ok_or_else(|| "write green, yellow, orange, red or unknown".to_owned())
}

/// A level that calls for something to be done.
pub(super) fn raised_level(text: &str) -> Result<Level, String> {
    match level(text) {
        Ok(level @ (Level::Yellow | Level::Orange | Level::Red)) => Ok(level),
        Ok(Level::Green | Level::Unknown) | Err(_) => Err("write yellow, orange or red".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_of_whole_hours_is_a_time_zone() {
        for (text, name) in [
            ("Europe/Rome", "Europe/Rome"),
            ("+01:00", "Etc/GMT-1"),
            ("UTC+1", "Etc/GMT-1"),
            ("GMT-03:00", "Etc/GMT+3"),
            ("+0800", "Etc/GMT-8"),
            ("utc+00:00", "UTC"),
            ("Etc/GMT+3", "Etc/GMT+3"),
        ] {
            let zone = time_zone(text);
            let found = zone.as_ref().map(|zone| zone.iana_name());
            assert_eq!(found, Ok(Some(name)), "{text}");
        }
        for text in ["+05:30", "+1:0", "Roma", "+99", "+"] {
            assert!(
                time_zone(text).is_err_and(|why| why.contains("Etc/GMT-1")),
                "{text}"
            );
        }
    }

    #[test]
    fn a_value_with_a_unit_comes_out_in_millimetres_and_days() {
        assert_eq!(speed("1 m/day"), Ok(1000.0));
        assert!((speed("2mm/h").unwrap() - 48.0).abs() < 1e-9);
        assert_eq!(length("2 m"), Ok(2000.0));
        assert_eq!(acceleration("5 mm/day/day"), Ok(5.0));
        assert!((acceleration("1 mm/h/h").unwrap() - 576.0).abs() < 1e-9);
        assert_eq!((bytes("64 MB"), bytes("0.5 kB")), (Ok(64_000_000), Ok(500)));
        assert_eq!(duration("1d 12h"), Ok(SignedDuration::from_hours(36)));
    }

    #[test]
    fn a_value_without_a_unit_or_of_another_kind_is_refused() {
        for text in ["5", "5 mm", "-5 mm/day", "0 mm/day", "NaN mm/day", "mm/day"] {
            assert!(speed(text).is_err(), "{text}");
        }
        for text in ["5 mm/day", "5 mm", "5 mm/day/furlong"] {
            assert!(acceleration(text).is_err(), "{text}");
        }
        for text in ["64", "64 Mb", "-1 MB", "0 B", "MB", "1e30 GB"] {
            assert!(bytes(text).is_err(), "{text}");
        }
        for text in ["0s", "12", "", "-1h"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
