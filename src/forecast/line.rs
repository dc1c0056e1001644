//! The straight line through inverse velocity, as practitioners draw it (Fukuzono 1985).

use crate::fit::Rate;
use crate::reading::LineFit;

/// Ordinary least squares of 1/v against time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseVelocityLine {
    /// Where it meets zero, days; `None` when it does not fall.
    pub intercept_days: Option<f64>,
    /// Its coefficient of determination.
    pub r_squared: f64,
    /// By how many standard errors of its slope it falls; below 0 where it rises.
    pub falls_by_errors: f64,
}

/// The line goes through this share of the rates, newest last, and no fewer than [`FEWEST_IN_LINE`].
const LINE_SHARE: f64 = 0.25;
const FEWEST_IN_LINE: usize = 8;
/// An intercept beyond this many lengths of the record is no prediction.
pub(crate) const FARTHEST_INTERCEPT: f64 = 3.0;
/// Fewer points than this make no line.
const FEWEST_POINTS: usize = 4;
/// The line is not followed below this share of its mean.
const NEARLY_ZERO: f64 = 0.02;
/// Two lines that meet zero within this, days, are one.
const SAME_DAYS: f64 = 0.01;

impl InverseVelocityLine {
    /// The newest of `rates`, through which the line goes.
    pub(crate) fn newest(rates: &[Rate]) -> &[Rate] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count within the slice"
        )]
        let share = (rates.len() as f64 * LINE_SHARE).round() as usize;
        &rates[rates.len().saturating_sub(share.max(FEWEST_IN_LINE))..]
    }

    /// The line through the rates that move forward and stand clear of their noise; `None` under four.
    pub fn fit(rates: &[Rate]) -> Option<Self> {
        Self::through(&Self::points(rates))
    }

    /// One over the days from `now_days` to where the line meets zero: the rate at which it falls over what is left of
    /// it, without a break where it is level, and below 0 where it rises. `None` under four rates that move.
    pub(super) fn approach(rates: &[Rate], now_days: f64) -> Option<f64> {
        let line = through_enough(&Self::points(rates))?;
        Some(-line.slope() / line.at(now_days).max(NEARLY_ZERO * line.mean_y))
    }

    /// (days, inverse velocity) of the rates that it takes.
    fn points(rates: &[Rate]) -> Vec<(f64, f64)> {
        let usable = rates.iter().filter(|rate| Self::takes(rate));
        usable
            .map(|rate| (rate.middle(), 1.0 / rate.velocity))
            .collect()
    }

    /// Whether a rate moves forward and stands clear of its noise.
    fn takes(rate: &Rate) -> bool {
        rate.velocity > 2.0 * rate.sigma && rate.velocity > 0.0
    }

    /// The line through the rates from its oldest point to where it meets zero, as (days, inverse velocity), if that
    /// is at `zero_days`: a line that was fitted to other rates is not drawn through these.
    pub fn segment(rates: &[Rate], zero_days: f64) -> Option<[(f64, f64); 2]> {
        let points = Self::points(rates);
        let drawn = Self::through(&points)?.intercept_days?;
        if (drawn - zero_days).abs() > SAME_DAYS {
            return None;
        }
        // A line of least squares goes through the mean of its points.
        let line = through_enough(&points)?;
        let oldest = points.first()?.0;
        let height = line.mean_y * (zero_days - oldest) / (zero_days - line.mean_x);
        Some([(oldest, height), (zero_days, 0.0)])
    }

    /// The line through (days, inverse velocity) points; `None` under four.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let line = through_enough(points)?;
        let slope = line.slope();
        let intercept_days = (slope < 0.0).then(|| line.reaches(0.0));
        let r_squared = if line.yy > 0.0 {
            line.xy * line.xy / (line.xx * line.yy)
        } else {
            0.0
        };
        let scatter = (1.0 - r_squared).max(f64::MIN_POSITIVE);
        let freedom = (points.len() - 2) as f64;
        Some(Self {
            intercept_days,
            r_squared,
            falls_by_errors: -slope.signum() * (freedom * r_squared / scatter).sqrt(),
        })
    }
}

/// Of inverse velocity by days; `None` under four points, or where all stand at one time.
fn through_enough(points: &[(f64, f64)]) -> Option<LineFit> {
    if points.len() < FEWEST_POINTS {
        return None;
    }
    LineFit::through(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_meets_zero_at_the_singularity_of_m_one() {
        let points: Vec<(f64, f64)> = (0..20)
            .map(|i| (f64::from(i), 0.02 * (30.0 - f64::from(i))))
            .collect();
        let line = InverseVelocityLine::through(&points).unwrap();
        assert!((line.intercept_days.unwrap() - 30.0).abs() < 1e-9);
        assert!((line.r_squared - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_slope_that_slows_down_has_no_intercept() {
        let points: Vec<(f64, f64)> = (0..20)
            .map(|i| (f64::from(i), 1.0 + f64::from(i)))
            .collect();
        assert_eq!(
            InverseVelocityLine::through(&points)
                .unwrap()
                .intercept_days,
            None
        );
    }
}
