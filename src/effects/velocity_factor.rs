//! By how much the velocity goes with what drives it: not the log-load alone, for the law's state answers to the load as well.

use super::act::Act;
use super::problem::Problem;
use super::refit::Fitted;
use super::term::Scratch;
use crate::reading::LineFit;

/// By which factor the velocity is higher where what enters the load through this term is one standard deviation higher, in the mean over
/// the fitted time: the slope of the ln of the velocity with the term over that without it. `None` for what is no single column
/// of a load, and where the law without it fails within the record.
pub(super) fn per_sd(
    problem: &Problem,
    full: &Fitted,
    index: usize,
    scratch: &mut Scratch,
) -> Option<f64> {
    let Act::Load(columns) = &full.terms[index].act else {
        return None;
    };
    let [column] = columns.as_slice() else {
        return None;
    };
    let without = full.parameters_without(problem, index);
    let mut velocities = |parameters: &[f64]| {
        let goes_on = scratch.predict(problem, &full.terms, parameters);
        goes_on.then(|| scratch.driven.velocity.clone())
    };
    let (with, without) = (velocities(&full.parameters)?, velocities(&without)?);
    let last = *problem.t.get(problem.used.checked_sub(1)?)?;
    let fitted = problem
        .nodes
        .iter()
        .take_while(|node| **node <= last)
        .count();
    let ratio = with
        .iter()
        .zip(&without)
        .map(|(with, without)| (with / without).ln());
    let pairs: Vec<(f64, f64)> = column.iter().copied().zip(ratio).take(fitted).collect();
    let factor = LineFit::through(&pairs)?.slope().exp();
    factor.is_finite().then_some(factor)
}
