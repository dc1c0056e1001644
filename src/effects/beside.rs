//! Events within a few readings of each other.

use super::act::Act;
use super::problem::Problem;
use super::refit::Fitted;
use super::term::coefficients_of;

/// Two events so many readings apart, one of which undoes the other, are one jump of the reading.
pub(super) const BESIDE: usize = 3;

/// Whether the newest term is an event that undoes, within a few readings, what another one does to the velocity.
pub(super) fn undoes_a_neighbour(problem: &Problem, fitted: &Fitted) -> bool {
    // ln v rises by a step, and falls by what the state gains.
    let jump = |index: usize| {
        let term = &fitted.terms[index];
        let own = coefficients_of(problem, &fitted.terms, index);
        let size = fitted.parameters[own].first()?;
        match term.act {
            Act::Step => Some((term.at?, *size)),
            Act::Reset => Some((term.at?, -size)),
            Act::Load(_)
            | Act::PerVelocity
            | Act::PerSlip
            | Act::Averaging
            | Act::Friction(_)
            | Act::Reading(_) => None,
        }
    };
    let Some((last, (at, size))) =
        (fitted.terms.len().checked_sub(1)).and_then(|last| Some((last, jump(last)?)))
    else {
        return false;
    };
    let mut others = (0..last).filter_map(jump);
    others.any(|(other, by)| other.abs_diff(at) <= BESIDE && by * size < 0.0)
}
