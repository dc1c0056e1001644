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
    let ratios = ln_ratios(problem, full, index, scratch)?;
    let pairs: Vec<(f64, f64)> = column.iter().copied().zip(ratios).collect();
    let factor = LineFit::through(&pairs)?.slope().exp();
    factor.is_finite().then_some(factor)
}

/// By which factor the velocity is higher since the event of that index than it would be without it: e to the mean of the ln over the fitted time
/// since. `None` for what is no event of the ground, and where the law without it fails within the record.
pub(super) fn since_event(
    problem: &Problem,
    full: &Fitted,
    index: usize,
    scratch: &mut Scratch,
) -> Option<f64> {
    let term = &full.terms[index];
    let at = term.at.filter(|_| term.kind.is_event_of_the_ground())?;
    let ratios = ln_ratios(problem, full, index, scratch)?;
    let since = ratios.get(*problem.node_of.get(at)?..)?;
    let factor = (since.iter().sum::<f64>() / since.len() as f64).exp();
    factor.is_finite().then_some(factor)
}

/// ln of the velocity with the term of that index over that without it, by node of the fitted time; `None` where the law without it fails
/// within the record.
fn ln_ratios(
    problem: &Problem,
    full: &Fitted,
    index: usize,
    scratch: &mut Scratch,
) -> Option<Vec<f64>> {
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
    let ratios = with.iter().zip(&without);
    let ratios = ratios.map(|(with, without)| (with / without).ln());
    Some(ratios.take(fitted).collect())
}
