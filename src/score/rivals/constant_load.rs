//! The slider block under constant load, fitted to the readings alone (Helmstetter, Sornette, Grasso, Andersen,
//! Gluzman and Pisarenko 2004, "Slider block friction model for landslides: Application to Vaiont and La Clapière
//! landslides", J. Geophys. Res. 109, B02409).
//!
//! Least squares of the readings as they stand, as there; the minimum is sought over all branches of m by
//! [`ConstantLoad`] instead of by simplices from random points.

use super::point;
use crate::fit::{ConstantLoad, Exponent, FitOutcome, PointReadings};
use crate::forecast::Passage;
use crate::model::{Accuracy, Law, Trajectory};
use crate::score::Known;

/// The passage of the critical velocity by the law that fits the whole record best.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let observations = &known.observations;
    let pairs = observations
        .values
        .iter()
        .map(|reading| (reading.t_days, reading.value));
    let readings = PointReadings::new(observations.quantity, pairs);
    let fitted = ConstantLoad::fit(&readings, Exponent::Free);
    if matches!(fitted.outcome, FitOutcome::TooFew { .. }) {
        return None;
    }
    let Some(best) = fitted.best() else {
        return Some(Passage::default());
    };
    point(days_left(
        &best.law,
        readings.length_days(),
        known.critical_mm_per_day,
    ))
}

/// Days from the newest reading to `critical`, mm/day; 0 where the law has had its singularity.
fn days_left(law: &Law, length_days: f64, critical: f64) -> f64 {
    let now = Trajectory::solve(law, length_days, Accuracy::Fit).at(length_days);
    now.map_or(0.0, |motion| {
        let left = law.from_y(motion.y).days_to_velocity(critical);
        left.unwrap_or(f64::INFINITY)
    })
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, slips, velocities, when};
    use super::*;

    #[test]
    fn its_own_law_passes_the_critical_velocity_when_it_should() {
        let law = Law::from_paper(1.35, 0.6, 80.0, 40.0).unwrap();
        let passed = law.days_to_velocity(1000.0).unwrap();
        let solved = Trajectory::solve(&law, 90.0, Accuracy::Fit);
        let known = slips(1.0, 0.8 * passed, |t| solved.at(t).unwrap().displacement);
        let days = when(&known, forecast(&known).as_ref());
        assert!((days / passed - 1.0).abs() < 1e-3, "{days}, not {passed}");
    }

    #[test]
    fn a_slope_that_slows_down_never_fails_and_a_short_record_says_nothing() {
        let slowing = velocities(1.0, 30.0, |t| 50.0 / (1.0 + t));
        assert!(never(forecast(&slowing).as_ref()));
        assert_eq!(forecast(&slips(1.0, 3.0, |t| t * t)), None);
    }

    #[test]
    fn a_law_that_once_was_fast_and_slows_down_does_not_pass_again() {
        let law = Law::from_paper(1.35, 2.0, 10.0, 9000.0).unwrap();
        assert!(law.v_i > 1000.0);
        assert!(days_left(&law, 200.0, 1000.0).is_infinite());
    }
}
