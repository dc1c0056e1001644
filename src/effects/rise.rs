//! A rise that takes several readings is motion, and no reset of the instrument.

use super::candidates::offset;
use super::frame::{Frame, dot};
use super::refit::{Fitted, jacobian};
use super::search::Search;
use super::term::Act;

/// Readings on either side in which a reset has no second one beside it; so many of these places, and the jump took several readings.
const BESIDE: usize = 3;
const SEVERAL: usize = 2;

impl Search<'_> {
    /// Whether the jump that is the newest term of `fitted` goes on over the readings beside it: further jumps the same way, at two places
    /// or more, gain the margin. One alone may be a mean that straddles the reset.
    pub(super) fn takes_several_readings(&mut self, fitted: &Fitted) -> bool {
        let problem = self.problem;
        let newest = fitted.terms.last().and_then(|term| term.at);
        let noise = self.bank.iter().find(|one| one.noise == fitted.noise);
        let (Some(at), Some(noise), Some(size)) = (newest, noise, fitted.parameters.last()) else {
            return false;
        };
        let columns = jacobian(problem, fitted, &mut self.scratch);
        let frame = Frame::new(noise.clone(), &fitted.residual(problem), &columns);
        let places = (at.saturating_sub(BESIDE).max(1)..=at + BESIDE)
            .filter(|place| *place != at && *place < problem.used);
        let goes_on = |place: &usize| {
            let further = offset(problem, *place);
            let cost = further.parameters() * (problem.used as f64).ln();
            let Act::Reading(steps) = &further.act else {
                return false;
            };
            let directions = frame.new_directions(steps);
            let taken = directions.first().map(|unit| dot(unit, &frame.residual));
            taken.is_some_and(|taken| {
                let gain =
                    frame.deviance(frame.misfit) - frame.deviance(frame.misfit - taken * taken);
                taken * size > 0.0 && gain - cost >= self.options.bic_margin
            })
        };
        places.filter(goes_on).count() >= SEVERAL
    }
}

#[cfg(test)]
mod tests;
