//! Whether a predicted time stays put while t_max grows, and how far it should move by the law itself.

use crate::fit::Rate;
use crate::forecast::InverseVelocityLine;
use crate::model::{Accuracy, Law, Trajectory};
use serde::{Deserialize, Serialize};

/// Refits before anything is announced.
const FEWEST_REFITS: usize = 5;

/// Refits in a row that must agree that it moved.
const AGREEING: u32 = 3;
/// A law whose own line would run faster than this says nothing of it, days a day.
const FASTEST_EXPECTED: f64 = 10.0;

/// A predicted time that moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MovedIntercept {
    /// The time last announced, days.
    pub(super) from_days: f64,
    /// The time now, days.
    pub(super) to_days: f64,
    /// Days of movement a day of new readings since then.
    pub(super) drift_days_per_day: f64,
}

/// Follows one predicted time over successive refits.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Drift {
    refits: usize,
    /// Refits in a row at which it stood later (positive) or earlier (negative) by enough.
    agreeing: i32,
    /// (t_max, predicted) at the last announcement, days.
    announced: Option<(f64, f64)>,
}

impl Drift {
    /// Takes the time predicted at `t_max`; says when it has moved by `least` days and a quarter of the
    /// time that was left since the last announcement. `None` as prediction starts over.
    pub(super) fn update(
        &mut self,
        t_max: f64,
        predicted: Option<f64>,
        least: f64,
    ) -> Option<MovedIntercept> {
        let Some(to_days) = predicted else {
            *self = Self::default();
            return None;
        };
        self.refits += 1;
        if self.refits < FEWEST_REFITS {
            return None;
        }
        let Some((since, from_days)) = self.announced else {
            self.announced = Some((t_max, to_days));
            return None;
        };
        let enough = least.max(0.25 * (from_days - t_max).abs());
        let moved = to_days - from_days;
        self.agreeing = match (moved >= enough, moved <= -enough) {
            (true, _) => self.agreeing.max(0) + 1,
            (_, true) => self.agreeing.min(0) - 1,
            (false, false) => 0,
        };
        if self.agreeing.unsigned_abs() < AGREEING || t_max <= since {
            return None;
        }
        self.agreeing = 0;
        self.announced = Some((t_max, to_days));
        Some(MovedIntercept {
            from_days,
            to_days,
            drift_days_per_day: (to_days - from_days) / (t_max - since),
        })
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
    Some((line(later)? - line(0.0)?) / later).filter(|drift| drift.abs() <= FASTEST_EXPECTED)
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
                readings: 1,
                error: crate::fit::ReadingError::Own,
            })
            .collect();
        let now = Trajectory::solve(&law, 9.0, Accuracy::Full).at(9.0);
        let Some(motion) = now else { return };
        let expected = expected_by_the_law(&law.from_y(motion.y), &rates, 9.0);
        assert!(expected.unwrap() < 0.0, "{expected:?}");
    }
}
