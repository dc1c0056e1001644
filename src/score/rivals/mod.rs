//! The rival methods, each as it was published, each knowing the past alone.

pub(super) mod constant_load;
pub(super) mod exponential;
pub(super) mod line;
pub(super) mod lppls;
mod onset;
pub(super) mod persistence;
pub(super) mod river;
pub(super) mod saito;
mod simplex;
mod straight;
pub(super) mod tangent;
pub(super) mod voight;

use super::Known;
use crate::fit::Rate;
use crate::forecast::{LawForecaster, Passage, by_the_law};
use crate::reading::Quantity;

/// What the monitor uses.
pub(super) fn panel(known: &Known) -> Option<Passage> {
    let outlook =
        LawForecaster::default().update(&known.observations, known.critical_mm_per_day)?;
    Some(outlook.collapse)
}

/// The law under an undeclared load, alone and as it comes.
pub(super) fn slider_block(known: &Known) -> Option<Passage> {
    by_the_law(&known.observations, known.critical_mm_per_day)
}

/// A point forecast, `days` from now: a time already past is now, one without end is never, and what is no
/// number says nothing.
fn point(days: f64) -> Option<Passage> {
    if days.is_nan() {
        return None;
    }
    if days.is_infinite() && days > 0.0 {
        return Some(Passage::default());
    }
    Some(Passage::from_times(vec![(days.max(0.0), 1.0)]))
}

/// The velocities in the record, oldest first.
fn rates(known: &Known) -> Vec<Rate> {
    let observations = &known.observations;
    let mut rates = observations.all_rates();
    let is_velocity = observations.quantity == Quantity::Velocity;
    if is_velocity && observations.values.iter().all(|one| one.sigma.is_none()) {
        // The methods as published take velocities as they are read.
        for rate in &mut rates {
            rate.sigma = 0.0;
        }
    }
    rates
}

/// Whether a velocity is forward and stands clear of its noise: the others have no logarithm or inverse that
/// says anything.
fn moves(rate: &Rate) -> bool {
    rate.velocity > 0.0 && rate.velocity > 2.0 * rate.sigma
}

/// (days, mm) at the start of the first rate and at the end of each.
fn displacements(rates: &[Rate]) -> Vec<(f64, f64)> {
    let Some(first) = rates.first() else {
        return Vec::new();
    };
    let mut path = vec![(first.from, 0.0)];
    let (mut at, mut slip) = (first.from, 0.0);
    let mut before = first.velocity;
    for rate in rates {
        let is_point = rate.to <= rate.from;
        let mean = if is_point {
            f64::midpoint(before, rate.velocity)
        } else {
            rate.velocity
        };
        slip += mean * (rate.to - at);
        (at, before) = (rate.to, rate.velocity);
        path.push((at, slip));
    }
    path
}

#[cfg(test)]
mod drawn;
