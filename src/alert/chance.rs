//! A chance, and a span of time, in words: one way for alerts, status, reports and the page.

use jiff::SignedDuration;

/// Chances under this, or as near to one, are not written as none or as certain.
const ROUNDED_AWAY: f64 = 0.005;

/// `0.23`, `< 0.01`, `> 0.99`.
pub fn chance_in_words(chance: f64) -> String {
    if chance < ROUNDED_AWAY {
        "< 0.01".to_owned()
    } else if chance >= 1.0 - ROUNDED_AWAY {
        "> 0.99".to_owned()
    } else {
        format!("{chance:.2}")
    }
}

/// The same in percent: `23 %`, `< 1 %`, `> 99 %`.
pub fn percent_in_words(chance: f64) -> String {
    if chance < ROUNDED_AWAY {
        "< 1 %".to_owned()
    } else if chance >= 1.0 - ROUNDED_AWAY {
        "> 99 %".to_owned()
    } else {
        format!("{:.0} %", (100.0 * chance).round())
    }
}

/// From so many days on a span of whole days is written in days.
const IN_DAYS: i64 = 5;
const MINUTES_PER_DAY: i64 = 24 * 60;

/// `30 days`, `24 h`, `1.5 h`, `25 min`.
pub fn span_in_words(span: SignedDuration) -> String {
    let minutes = span.as_secs() / 60;
    if minutes < 60 {
        format!("{minutes} min")
    } else if minutes % MINUTES_PER_DAY == 0 && minutes >= IN_DAYS * MINUTES_PER_DAY {
        format!("{} days", minutes / MINUTES_PER_DAY)
    } else if minutes % 60 == 0 {
        format!("{} h", minutes / 60)
    } else {
        format!("{:.1} h", span.as_secs_f64() / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_is_written_in_hours_and_in_minutes_below_one() {
        let words = |minutes| span_in_words(SignedDuration::from_mins(minutes));
        assert_eq!(words(25), "25 min");
        assert_eq!(words(90), "1.5 h");
        assert_eq!(words(48 * 60), "48 h");
    }

    #[test]
    fn no_chance_is_written_as_none_or_as_certain() {
        let both = |chance: f64| (chance_in_words(chance), percent_in_words(chance));
        for (chance, words, percent) in [
            (0.0, "< 0.01", "< 1 %"),
            (0.004_9, "< 0.01", "< 1 %"),
            (0.005, "0.01", "1 %"),
            (0.234, "0.23", "23 %"),
            (0.994, "0.99", "99 %"),
            (0.995, "> 0.99", "> 99 %"),
            (0.996, "> 0.99", "> 99 %"),
            (1.0, "> 0.99", "> 99 %"),
        ] {
            assert_eq!(both(chance), (words.to_owned(), percent.to_owned()));
        }
    }
}
