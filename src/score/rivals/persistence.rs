//! What moves goes on as it does: the forecast that any other has to beat.

use super::{point, rates};
use crate::forecast::Passage;
use crate::score::Known;

/// Now where the newest velocity is at or above the critical one, otherwise never.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let newest = rates(known).last()?.velocity;
    point(if newest >= known.critical_mm_per_day {
        0.0
    } else {
        f64::INFINITY
    })
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, slips, when};
    use super::*;

    #[test]
    fn a_slope_at_the_critical_velocity_fails_now_and_a_slower_one_never() {
        let fast = slips(1.0, 10.0, |t| 1001.0 * t);
        assert!((when(&fast, forecast(&fast).as_ref()) - 10.0).abs() < 1e-12);
        let slow = slips(1.0, 10.0, |t| 999.0 * t);
        assert!(never(forecast(&slow).as_ref()));
        assert_eq!(forecast(&slips(1.0, 0.0, |t| t)), None);
    }
}
