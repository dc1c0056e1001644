//! Whether a predicted time stays put while t_max grows, and how far it should move by the law itself.

use crate::fit::Rate;
use crate::forecast::InverseVelocityLine;
use crate::model::{Accuracy, Law, Trajectory};
use std::collections::VecDeque;

/// Refits over which a drift is measured.
const REFITS: usize = 12;
/// Refits before anything is announced.
const FEWEST: usize = 5;

/// A predicted time that moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moved {
    /// The time last announced, days.
    pub(super) from_days: f64,
    /// The time now, days.
    pub(super) to_days: f64,
    /// Days a day of new readings, by least squares over the latest refits.
    pub(super) drift_days_per_day: f64,
}

/// Follows one predicted time over successive refits.
#[derive(Debug, Clone, Default)]
pub(super) struct Drift {
    /// (t_max, predicted), days.
    refits: VecDeque<(f64, f64)>,
    announced: Option<f64>,
}

impl Drift {
    /// Takes the time predicted at `t_max`; says when it has moved by `least` days and a quarter of the
    /// time that was left since the last announcement. `None` as prediction starts over.
    pub(super) fn update(
        &mut self,
        t_max: f64,
        predicted: Option<f64>,
        least: f64,
    ) -> Option<Moved> {
        let Some(predicted) = predicted else {
            self.refits.clear();
            self.announced = None;
            return None;
        };
        self.refits.push_back((t_max, predicted));
        if self.refits.len() > REFITS {
            self.refits.pop_front();
        }
        if self.refits.len() < FEWEST {
            return None;
        }
        let Some(from_days) = self.announced else {
            self.announced = Some(predicted);
            return None;
        };
        let enough = least.max(0.25 * (from_days - t_max).abs());
        if (predicted - from_days).abs() < enough {
            return None;
        }
        self.announced = Some(predicted);
        Some(Moved {
            from_days,
            to_days: predicted,
            drift_days_per_day: self.slope(),
        })
    }

    fn slope(&self) -> f64 {
        let n = self.refits.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| self.refits.iter().map(f).sum::<f64>() / n;
        let (mean_t, mean_p) = (mean(|r| r.0), mean(|r| r.1));
        let (mut tt, mut tp) = (0.0, 0.0);
        for (t, p) in &self.refits {
            tt += (t - mean_t) * (t - mean_t);
            tp += (t - mean_t) * (p - mean_p);
        }
        if tt > 0.0 { tp / tt } else { 0.0 }
    }
}

/// How fast the intercept of the line through the last rates would move if `law` (t = 0 at `now_days`)
/// held: a straight line through 1/v runs late on a slider block with m > 1, and early with m < 1.
pub(super) fn expected_by_the_law(law: &Law, rates: &[Rate], now_days: f64) -> Option<f64> {
    let span = now_days - rates.first()?.from;
    let later = span / rates.len().max(2) as f64;
    let past = Trajectory::solve(&law.reversed(), span, Accuracy::Fit);
    let future = Trajectory::solve(law, later, Accuracy::Fit);
    let line = |shift: f64| {
        let points = rates.iter().map(|rate| {
            let t = rate.middle() + shift - now_days;
            let motion = if t <= 0.0 { past.at(-t) } else { future.at(t) };
            motion.map(|motion| (t, 1.0 / motion.velocity))
        });
        let points: Option<Vec<(f64, f64)>> = points.collect();
        InverseVelocityLine::through(&points?)?.intercept_days
    };
    Some((line(later)? - line(0.0)?) / later).filter(|drift| drift.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_prediction_is_not_announced_and_a_receding_one_is() {
        let mut drift = Drift::default();
        for day in 0..20 {
            assert_eq!(drift.update(f64::from(day), Some(40.0), 1.0), None);
        }
        let mut moved = None;
        for day in 20..30 {
            let t = f64::from(day);
            moved = moved.or(drift.update(t, Some(40.0 + (t - 20.0)), 1.0));
        }
        assert!(moved.unwrap().drift_days_per_day > 0.1);
    }

    #[test]
    fn the_line_through_a_law_with_m_above_one_is_expected_to_come_in() {
        // y bends down towards failure: the line over early readings meets zero too late.
        let law = Law::from_paper(1.5, 0.3, 30.0, 1.0).unwrap();
        let rates: Vec<Rate> = (0..10)
            .map(|i| Rate {
                from: f64::from(i),
                to: f64::from(i),
                velocity: 1.0,
                sigma: 0.0,
            })
            .collect();
        let now = Trajectory::solve(&law, 9.0, Accuracy::Full).at(9.0);
        let Some(motion) = now else { return };
        let expected = expected_by_the_law(&law.from_y(motion.y), &rates, 9.0);
        assert!(expected.unwrap() < 0.0, "{expected:?}");
    }
}
