//! Saito's three points of tertiary creep (Saito 1969, "Forecasting time of slope failure by tertiary creep",
//! Proc. 7th Int. Conf. Soil Mech. Found. Eng., Mexico City, vol. 2, 677-683).
//!
//! In tertiary creep the velocity is inverse to the time that is left. Of three times t1 < t2 < t3 between
//! which the displacement grows by equal amounts follows the time of failure
//! t1 + (t2 - t1)^2 / 2 / ((t2 - t1) - (t3 - t1) / 2).
//!
//! The choice of the points is ours, Saito drew them by hand: t3 is now, t1 the onset of acceleration by the
//! crossing of trailing averages, and t2 where half of what moved between them had moved.

use super::{displacements, onset, point, rates};
use crate::forecast::Passage;
use crate::score::Known;

/// Velocities since the onset, at least: two halves of a displacement from fewer are one step of the record.
const FEWEST_VELOCITIES: usize = 4;

/// The failure by three points since the onset of acceleration.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let rates = rates(known);
    onset::from_onset(&rates, |since| {
        if rates.len() - since < FEWEST_VELOCITIES {
            return None;
        }
        let path = displacements(&rates);
        point(failure(&path[since..])? - known.now_days)
    })
}

/// The failure by the first point, the last and the one halfway up; infinite where the first half took no
/// longer than the second.
fn failure(path: &[(f64, f64)]) -> Option<f64> {
    let (&(first, from), &(last, to)) = (path.first()?, path.last()?);
    if to <= from {
        return Some(f64::INFINITY);
    }
    let half = f64::midpoint(from, to);
    let after = path.iter().position(|(_, slip)| *slip >= half)?;
    let [(t0, slip0), (t1, slip1)] = [path[after.checked_sub(1)?], path[after]];
    let middle = t0 + (t1 - t0) * (half - slip0) / (slip1 - slip0);
    let (early, whole) = (middle - first, last - first);
    let gain = early - 0.5 * whole;
    if gain <= 0.0 {
        return Some(f64::INFINITY);
    }
    Some(first + 0.5 * early * early / gain)
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, slips, when};
    use super::*;

    #[test]
    fn tertiary_creep_fails_when_the_three_points_say() {
        let known = slips(0.25, 44.0, |t| -80.0 * (1.0 - t / 50.0).ln());
        let days = when(&known, forecast(&known).as_ref());
        assert!((days - 50.0).abs() < 0.05, "{days}");
    }

    #[test]
    fn a_slope_that_slows_down_never_fails_and_a_short_record_says_nothing() {
        let slowing = slips(1.0, 40.0, |t| 80.0 * (1.0 + t).ln());
        assert!(never(forecast(&slowing).as_ref()));
        let scant = slips(1.0, 6.0, |t| -80.0 * (1.0 - t / 50.0).ln());
        assert_eq!(forecast(&scant), None);
    }
}
