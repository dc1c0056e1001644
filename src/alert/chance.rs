//! A chance in words: one way for alerts, status, reports and the page.

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

#[cfg(test)]
mod tests {
    use super::*;

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
