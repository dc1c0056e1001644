//! The straight line through inverse velocity, as practitioners draw it (Fukuzono 1985).

use crate::fit::Rate;

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

/// Fewer points than this make no line.
const FEWEST: usize = 4;
/// The line is not followed below this share of its mean.
const NEARLY_ZERO: f64 = 0.02;
/// Two lines that meet zero within this, days, are one.
const SAME_DAYS: f64 = 0.01;

/// Sums of squares and products about the means of (days, inverse velocity) points.
struct Moments {
    mean_t: f64,
    mean_y: f64,
    tt: f64,
    ty: f64,
    yy: f64,
}

impl Moments {
    /// `None` under four points, or where all stand at one time.
    fn of(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let n = points.len() as f64;
        let mean_t = points.iter().map(|(t, _)| t).sum::<f64>() / n;
        let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / n;
        let (mut tt, mut ty, mut yy) = (0.0, 0.0, 0.0);
        for (t, y) in points {
            tt += (t - mean_t) * (t - mean_t);
            ty += (t - mean_t) * (y - mean_y);
            yy += (y - mean_y) * (y - mean_y);
        }
        (tt > 0.0).then_some(Self {
            mean_t,
            mean_y,
            tt,
            ty,
            yy,
        })
    }

    fn slope(&self) -> f64 {
        self.ty / self.tt
    }
}

impl InverseVelocityLine {
    /// The line through the rates that move forward and stand clear of their noise; `None` under four.
    pub fn fit(rates: &[Rate]) -> Option<Self> {
        Self::through(&Self::points(rates))
    }

    /// One over the days from `now_days` to where the line meets zero: the rate at which it falls over what is left of
    /// it, without a break where it is level, and below 0 where it rises. `None` under four rates that move.
    pub(super) fn approach(rates: &[Rate], now_days: f64) -> Option<f64> {
        let line = Moments::of(&Self::points(rates))?;
        let slope = line.slope();
        let left = line.mean_y + slope * (now_days - line.mean_t);
        Some(-slope / left.max(NEARLY_ZERO * line.mean_y))
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
        let Moments { mean_t, mean_y, .. } = Moments::of(&points)?;
        let oldest = points.first()?.0;
        let height = mean_y * (zero_days - oldest) / (zero_days - mean_t);
        Some([(oldest, height), (zero_days, 0.0)])
    }

    /// The line through (days, inverse velocity) points; `None` under four.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let line = Moments::of(points)?;
        let slope = line.slope();
        let intercept_days = (slope < 0.0).then(|| line.mean_t - line.mean_y / slope);
        let r_squared = if line.yy > 0.0 {
            line.ty * line.ty / (line.tt * line.yy)
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
