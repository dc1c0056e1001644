//! Where the inversion of the law under a constant load ends, as starts of the plain law: a law that goes to failure within a few days
//! of the last reading, or leaves a steady state late, is reached from no start that only looks at the first readings.

use super::problem::Problem;
use super::refit::Start;
use super::term::{Scratch, parameters_of};
use crate::fit::{ConstantLoad, Exponent, PointReadings};
use crate::reading::Quantity;

/// So many of its minima, the best first.
const MINIMA: usize = 3;

/// Halvings of what is taken off r.
const HALVINGS: usize = 16;

/// The law at the best minima of its inversion. That takes every reading for a point value with one error for all.
pub(super) fn inverted_starts(problem: &Problem, scratch: &mut Scratch) -> Vec<Start> {
    let pairs = problem.t.iter().copied().zip(problem.y.iter().copied());
    let readings = PointReadings::new(problem.quantity, pairs.take(problem.used));
    let inverted = ConstantLoad::fit(&readings, Exponent::Free);
    let minima = inverted.minima.iter().take(MINIMA);
    minima
        .map(|found| {
            let mut parameters = parameters_of(&found.law, problem.whole_span()).to_vec();
            if problem.quantity == Quantity::Displacement {
                parameters.push(found.displacement_at_start);
            }
            outliving(problem, &mut parameters, scratch);
            Start::of_law(parameters)
        })
        .collect()
}

/// Takes as little off r as lets the law come to the last reading by the refits' rougher solution too, which fails some hours earlier or
/// later than the precise one, and no faster than it was read; nothing where the law does not fail.
fn outliving(problem: &Problem, parameters: &mut [f64], scratch: &mut Scratch) {
    let (own, last) = (parameters[1], problem.used - 1);
    let (mut too_little, mut enough) = (0.0, 1.0);
    let mut share = 0.0;
    for _ in 0..HALVINGS {
        parameters[1] = own - share * own.abs();
        let goes_on = scratch.predict(problem, &[], parameters);
        if goes_on && (share <= 0.0 || scratch.prediction[last] <= problem.y[last]) {
            enough = share;
        } else {
            too_little = share;
        }
        if enough <= 0.0 {
            return;
        }
        share = 0.5 * (too_little + enough);
    }
    parameters[1] = own - enough * own.abs();
}
