//! What is taken for granted of the law before the readings, whatever is assumed of the load.

use crate::fit::Rate;
use crate::fit::newest_slope::{SLOPE_PER_INTERVAL, newest_interval_days};

/// Prior probability of m > 1, where most slopes that are watched are.
pub(super) const UNSTABLE: f64 = 0.65;
/// The prior of p spans this, m from 0.5 to 2.5, evenly on either side of m = 1.
pub const P_PRIOR: (f64, f64) = (-1.0, 0.6);
/// Prior of what a stable slope will keep: mm/day, and the standard deviation of ln v above it.
const KEPT: (f64, f64) = (2.0, 1.0);
/// Slopes: from this share of 1/length to this many of 1/interval.
const SLOPES: (f64, f64) = (0.02, 2.0);
/// And the slowest, at most, in 1/interval.
const SLOWEST: f64 = 2e-4;
/// The prior of ln r falls as r to the minus this: few slopes are met in their last days.
pub(super) const RARE: f64 = 0.1;

/// The prior of the slope r of a record, and of what a slope will keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SlopePrior {
    /// The newest sampling interval, days.
    interval: f64,
    /// The least and the greatest |r|, 1/day.
    pub(super) lowest: f64,
    pub(super) highest: f64,
}

impl SlopePrior {
    /// Of `rates` that span `length` days.
    pub(super) fn new(rates: &[Rate], length: f64) -> Self {
        let interval = newest_interval_days(rates).unwrap_or(length).max(1e-6);
        // A short record knows as well as a long one that most slopes take thousands of readings.
        let lowest = (SLOPES.0 / length).min(SLOWEST / interval);
        let highest = (SLOPES.1 / interval).max(2.0 * lowest);
        Self {
            interval,
            lowest,
            highest,
        }
    }

    /// ln of the prior of a law whose shape has that of its own, at a slope, with ln of the velocity (mm/day) that it will keep
    /// where it keeps one.
    pub(super) fn ln_prior(&self, of_shape: f64, r: f64, ln_kept: Option<f64>) -> f64 {
        let resolved = r * self.interval / SLOPE_PER_INTERVAL;
        let kept = ln_kept.map_or(0.0, above_kept);
        of_shape - RARE * r.ln() - 0.5 * (resolved * resolved + kept * kept)
    }
}

/// Standard deviations by which a velocity that a slope will keep, ln of mm/day, lies above what slopes keep.
pub(super) fn above_kept(ln_velocity: f64) -> f64 {
    ((ln_velocity - KEPT.0.ln()) / KEPT.1).max(0.0)
}
