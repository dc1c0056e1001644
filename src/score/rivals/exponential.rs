//! An exponential velocity up to a threshold (Vibert, Arnould, Cojean and Le Cleac'h 1988, "Essai de prévision
//! de rupture d'un versant montagneux à Saint-Etienne-de-Tinée, France", Proc. 5th Int. Symp. Landslides,
//! Lausanne, vol. 1, 789-792).
//!
//! The threshold is the critical velocity of the site; the line through ln v goes through the whole record.

use super::straight::line_through;
use super::{moves, point, rates};
use crate::forecast::Passage;
use crate::score::Known;

/// Where the line through ln v reaches the threshold.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let rates = rates(known);
    let points: Vec<(f64, f64, f64)> = rates
        .iter()
        .filter(|rate| moves(rate))
        .map(|rate| (rate.middle(), rate.velocity.ln(), 1.0))
        .collect();
    let line = line_through(&points)?;
    if line.slope() <= 0.0 {
        return Some(Passage::default());
    }
    point(line.reaches(known.critical_mm_per_day.ln()) - known.now_days)
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, velocities, when};
    use super::*;

    #[test]
    fn an_exponential_velocity_reaches_the_threshold_on_its_day() {
        let known = velocities(1.0, 40.0, |t| 1000.0 * (0.1 * (t - 60.0)).exp());
        let days = when(&known, forecast(&known).as_ref());
        assert!((days - 60.0).abs() < 1e-6, "{days}");
    }

    #[test]
    fn a_slope_that_slows_down_never_fails_and_a_short_record_says_nothing() {
        let slowing = velocities(1.0, 30.0, |t| 50.0 * (-0.1 * t).exp());
        assert!(never(forecast(&slowing).as_ref()));
        assert_eq!(forecast(&velocities(1.0, 2.0, f64::exp)), None);
    }
}
