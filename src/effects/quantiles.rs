//! Medians and quantiles of values that are finite numbers.

use crate::reading::{self, DEVIATION_PER_MEDIAN};

/// The middle of `values`; 0 where there are none.
pub(super) fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The value under which `share` of them lie, between the two nearest; 0 where there are none.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let below = place.floor();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of the length"
    )]
    let index = (below as usize).min(last);
    let above = sorted[(index + 1).min(last)];
    sorted[index] + (place - below) * (above - sorted[index])
}

/// Standard deviation of the middle of `values`, heavy tails left out: 1.4826 times their median
/// distance from their median.
pub(super) fn robust_deviation(values: &[f64]) -> f64 {
    let middle = median(values);
    let distances: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    DEVIATION_PER_MEDIAN * median(&distances)
}

/// The middle value, of an even number the upper one of both; 0 of none.
pub(super) fn upper_median(mut values: Vec<f64>) -> f64 {
    reading::upper_median(&mut values).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_little_are_what_there_is() {
        assert!((median(&[3.0, 1.0, 2.0]) - 2.0).abs() < 1e-12);
        assert!((quantile(&[1.0, 2.0], 0.5) - 1.5).abs() < 1e-12);
        assert!(median(&[]).abs() < 1e-12);
    }
}
