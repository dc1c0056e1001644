//! Voight's relation with a free exponent, dv/dt = A v^alpha (Voight 1988, "A method for prediction of volcanic
//! eruptions", Nature 332, 125-130; 1989, "A relation to describe rate-dependent material failure",
//! Science 243, 200-203).
//!
//! The relation integrated, v^(1 - alpha) is a straight line in time, is fitted to the logarithms of the
//! velocities since the onset of acceleration, as Crosta and Agliardi 2003 fit it ("Failure forecast for
//! large rock slides by surface displacement measurements", Can. Geotech. J. 40, 176-191): a difference of
//! noisy velocities, which Voight's own plot needs, says little. Failure is where the velocity reaches the
//! critical one, Voight's velocity of failure, and not infinity.

use super::simplex::descend;
use super::{moves, onset, point, rates};
use crate::fit::Rate;
use crate::forecast::Passage;
use crate::score::Known;

/// Fewer velocities than this leave nothing over from three unknowns.
const FEWEST_VELOCITIES: usize = 5;
/// alpha is near 2 wherever it has been measured.
const ALPHA: (f64, f64) = (1.0, 5.0);
const ALPHAS: [f64; 4] = [1.2, 1.7, 2.2, 3.0];
/// Growth over the span of the fit, d ln v / dt now times that span: where the search looks first, and its bounds.
const GROWTHS: [f64; 6] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
const GROWTH: (f64, f64) = (1e-3, 1e4);
const MOST_EVALUATIONS: usize = 200;
/// Nearer to 1 than this an exponent is 1.
const UNIT: f64 = 1e-9;

/// The passage of the critical velocity by the relation that fits best.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let rates = rates(known);
    onset::from_onset(&rates, |since| {
        let fitted = Velocities::of(&rates[since..])?.fit();
        let newest = rates.last()?.middle();
        point(newest + fitted.days_to(known.critical_mm_per_day) - known.now_days)
    })
}

/// (days from the newest, at most 0; ln of the velocity), over the span of the record.
struct Velocities {
    points: Vec<(f64, f64)>,
    span: f64,
}

/// The relation, by what it says of the newest velocity.
struct Relation {
    alpha: f64,
    /// d ln v / dt = A v^(alpha - 1), 1/day.
    growth: f64,
    ln_velocity: f64,
}

impl Velocities {
    fn of(rates: &[Rate]) -> Option<Self> {
        let newest = rates.last()?.middle();
        let points: Vec<(f64, f64)> = rates
            .iter()
            .filter(|rate| moves(rate))
            .map(|rate| (rate.middle() - newest, rate.velocity.ln()))
            .collect();
        let span = -points.first()?.0;
        (points.len() >= FEWEST_VELOCITIES && span > 0.0).then_some(Self { points, span })
    }

    fn fit(&self) -> Relation {
        let cost = |at: &[f64; 2]| self.misfit(at);
        let starts = ALPHAS
            .iter()
            .flat_map(|alpha| GROWTHS.map(|growth| [*alpha, growth.ln()]));
        let start = starts
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))
            .unwrap_or([2.0, 0.0]);
        let (at, _) = descend(cost, start, [0.2, 0.4], MOST_EVALUATIONS);
        Relation {
            alpha: at[0],
            growth: at[1].exp() / self.span,
            ln_velocity: self.ln_velocity(&at),
        }
    }

    /// ln v over its newest value, at alpha and ln of the growth over the span.
    fn shape(&self, [alpha, ln_growth]: &[f64; 2], days: f64) -> f64 {
        let grown = ln_growth.exp() * days / self.span;
        let over_one = alpha - 1.0;
        if over_one < UNIT {
            grown
        } else {
            -(-over_one * grown).ln_1p() / over_one
        }
    }

    fn ln_velocity(&self, at: &[f64; 2]) -> f64 {
        let left = self
            .points
            .iter()
            .map(|(days, ln)| ln - self.shape(at, *days));
        left.sum::<f64>() / self.points.len() as f64
    }

    /// Sum of squares of ln v, the newest velocity projected out.
    fn misfit(&self, at: &[f64; 2]) -> f64 {
        let inside = |value: f64, (low, high): (f64, f64)| (low..=high).contains(&value);
        if !inside(at[0], ALPHA) || !inside(at[1].exp(), GROWTH) {
            return f64::INFINITY;
        }
        let left = |(days, ln): &(f64, f64)| ln - self.shape(at, *days);
        let (mut sum, mut squares) = (0.0, 0.0);
        for one in self.points.iter().map(left) {
            sum += one;
            squares += one * one;
        }
        squares - sum * sum / self.points.len() as f64
    }
}

impl Relation {
    /// Days from the newest velocity to `critical`, mm/day; 0 where it is passed.
    fn days_to(&self, critical: f64) -> f64 {
        let ln_ratio = critical.ln() - self.ln_velocity;
        let over_one = self.alpha - 1.0;
        if ln_ratio <= 0.0 {
            0.0
        } else if over_one < UNIT {
            ln_ratio / self.growth
        } else {
            -(-over_one * ln_ratio).exp_m1() / (over_one * self.growth)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, velocities, when};
    use super::*;

    #[test]
    fn its_own_law_passes_the_critical_velocity_when_it_should_whatever_the_exponent() {
        // 1000 mm/day is passed on day 50, at which d ln v / dt = growth.
        for (alpha, growth) in [(1.0 + 1e-12, 0.1), (1.4, 0.2), (2.0, 1.0), (2.6, 4.0)] {
            let velocity = |t: f64| {
                let over_one: f64 = alpha - 1.0;
                1000.0 * (-(over_one * growth * (50.0 - t)).ln_1p() / over_one).exp()
            };
            let known = velocities(1.0, 40.0, velocity);
            let days = when(&known, forecast(&known).as_ref());
            assert!((days - 50.0).abs() < 0.05, "alpha {alpha}: {days}");
        }
    }

    #[test]
    fn a_slope_that_slows_down_never_fails_and_a_short_record_says_nothing() {
        let slowing = velocities(1.0, 30.0, |t| 50.0 / (1.0 + t));
        assert!(never(forecast(&slowing).as_ref()));
        let scant = velocities(1.0, 5.0, |t| 50.0 / (30.0 - t));
        assert_eq!(forecast(&scant), None);
    }
}
