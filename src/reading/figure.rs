//! Figures for people: a number of three hundred digits is none.

use std::fmt::Display;

/// From here on a figure stands in powers of ten; no slope, and no speed of one, is as large in mm or in mm/day.
const LARGE: f64 = 1e9;
/// Below this one that is given by all of its digits does too.
const SMALL: f64 = 1e-9;

/// `value` with so many decimals, or, where it is too large to be read so, as `2.160e10`.
pub fn figure(value: f64, decimals: usize) -> String {
    if value.is_finite() && value.abs() >= LARGE {
        format!("{value:.3e}")
    } else {
        format!("{value:.decimals$}")
    }
}

/// `1 gap`, `3 gaps`.
pub fn counted<N>(count: N, one: &str, several: &str) -> String
where
    N: Copy + Display + PartialEq + From<u8>,
{
    let what = if count == N::from(1) { one } else { several };
    format!("{count} {what}")
}

/// `value` by all digits that it was read with, or, where it is too large or too small to be read so, as `1e308`.
pub fn whole_figure(value: f64) -> String {
    let size = value.abs();
    if value.is_finite() && (size >= LARGE || size > 0.0 && size < SMALL) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// `value` without the last digits of a conversion of units: 26400, not 26400.000000000004.
pub fn shortest(value: f64) -> String {
    let twelve_digits = format!("{value:.11e}");
    whole_figure(twelve_digits.parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_converted_figure_has_no_digits_of_the_conversion() {
        let cases = [
            (1.1 * 24.0 * 1000.0, "26400"),
            (0.07 * 24.0 * 1000.0, "1680"),
            (1000.0, "1000"),
            (0.1, "0.1"),
        ];
        for (value, expected) in cases {
            assert_eq!(shortest(value), expected);
        }
    }

    #[test]
    fn a_figure_is_written_as_usual_until_nobody_could_read_it() {
        assert_eq!(figure(23.96, 3), "23.960");
        assert_eq!(figure(-999_999_999.0, 1), "-999999999.0");
        assert_eq!(figure(21_599_999_496.96, 3), "2.160e10");
        assert_eq!(figure(-1e308, 0), "-1.000e308");
        assert_eq!(figure(f64::INFINITY, 0), "inf");
        assert_eq!(whole_figure(0.0), "0");
        assert_eq!(whole_figure(-9999.9), "-9999.9");
        assert_eq!(whole_figure(1e308), "1e308");
        assert_eq!(whole_figure(5e-324), "5e-324");
    }
}
