//! A rise that takes several readings is motion, and no reset of the instrument.

use super::act::Act;
use super::candidates::jump;
use super::frame::{Frame, dot};
use super::refit::{Fitted, jacobian};
use super::search::Search;

/// Readings on either side in which a reset has no second one beside it; so many of these places, and the jump took several readings.
const BESIDE: usize = 3;
const SEVERAL: usize = 2;

impl Search<'_> {
    /// Whether the jump that is the newest term of `fitted` goes on over the readings beside it: further jumps the same way, at two places
    /// or more, gain the margin. One alone may be a mean that straddles the reset.
    pub(super) fn takes_several_readings(&mut self, fitted: &Fitted) -> bool {
        let problem = self.problem;
        let Some(newest) = fitted.terms.last() else {
            return false;
        };
        let noise = self.bank.iter().find(|one| one.noise == fitted.noise);
        let (Some(at), Some(noise), Some(size)) = (newest.at, noise, fitted.parameters.last())
        else {
            return false;
        };
        let columns = jacobian(problem, fitted, &mut self.scratch);
        let frame = Frame::new(noise.clone(), &fitted.residual(problem), &columns);
        let places = (at.saturating_sub(BESIDE).max(1)..=at + BESIDE)
            .filter(|place| *place != at && *place < problem.used);
        let steps = places.filter_map(|place| {
            if let Act::Reading(steps) = jump(problem, newest.kind, place).act {
                Some(steps)
            } else {
                None
            }
        });
        let mut steps: Vec<Vec<f64>> = steps.flatten().collect();
        let cost = newest.parameters() * (problem.used as f64).ln();
        let mut residual = frame.residual.clone();
        // One after the other: a jump beside another is like it, and gains with it.
        let mut taken = Vec::new();
        while taken.len() < SEVERAL {
            let Some((place, moved, unit)) = further(&frame, &taken, &steps, (&residual, *size))
            else {
                return false;
            };
            let before = dot(&residual, &residual);
            let gain = frame.deviance(before) - frame.deviance(before - moved * moved);
            if gain - cost < self.options.bic_margin {
                return false;
            }
            for (left, along) in residual.iter_mut().zip(&unit) {
                *left -= moved * along;
            }
            taken.push(steps.swap_remove(place));
        }
        true
    }
}

/// Beside those that are `taken`, the one of `steps` that takes most off a residual and goes the way of `size`: which, how much, and its
/// direction.
fn further(
    frame: &Frame,
    taken: &[Vec<f64>],
    steps: &[Vec<f64>],
    (residual, size): (&[f64], f64),
) -> Option<(usize, f64, Vec<f64>)> {
    let each = steps.iter().enumerate().filter_map(|(place, step)| {
        let columns: Vec<Vec<f64>> = taken.iter().chain([step]).cloned().collect();
        let unit = frame.new_directions(&columns).pop()?;
        let moved = dot(&unit, residual);
        (moved * size > 0.0).then_some((place, moved, unit))
    });
    each.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

#[cfg(test)]
mod tests;
