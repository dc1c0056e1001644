//! Fits that start from laws of their own, not from where a fit without the newest effect ended: the best law without an
//! effect may be a poor one, beside which everything that is tried gains alike.

use super::noise::{Noise, Whitener};
use super::problem::Problem;
use super::refit::{Fitted, Start, plain_starts, refit_from, towards};
use super::term::{Scratch, Term, law_parameters};

/// So many steps from each start, and only the best so many starts are followed to the end.
const FIRST_STEPS: usize = 8;
const FOLLOWED: usize = 4;

/// Starts of the law with `terms`, at every size that they may start at.
pub(super) fn fresh_starts(problem: &Problem, terms: &[Term]) -> Vec<Start> {
    let sizes = terms.iter().map(|term| term.starts().len()).max();
    let mut all = Vec::new();
    for size in 0..sizes.unwrap_or(1) {
        for plain in plain_starts(problem) {
            let joined = terms.iter().fold(plain, |start, term| {
                let own = term.starts();
                start.with_size(term, own[size.min(own.len() - 1)])
            });
            all.push(joined);
        }
    }
    all
}

/// Starts of the law with the effects of `base` as they are there, and one more term.
pub(super) fn fresh_laws(problem: &Problem, base: &Fitted, term: &Term) -> Vec<Start> {
    let known = &base.parameters[law_parameters(problem)..];
    let law = |mut start: Start| {
        start.terms.clone_from(&base.terms);
        start.parameters.extend(known);
        start
    };
    let laws: Vec<Start> = plain_starts(problem).into_iter().map(law).collect();
    let sizes = term.starts().iter();
    sizes
        .flat_map(|size| laws.iter().map(|law| law.clone().with_size(term, *size)))
        .collect()
}

/// The best of many starts by least squares: all a few steps far, then those that lead.
pub(super) fn best_of_starts(
    problem: &Problem,
    starts: &[Start],
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let white = [Whitener::new(problem, Noise::WHITE)];
    let mut first: Vec<Fitted> = starts
        .iter()
        .filter_map(|start| towards(problem, start, &white[0], (FIRST_STEPS, scratch)))
        .collect();
    first.sort_by(|a, b| a.surprise.total_cmp(&b.surprise));
    let leading: Vec<Start> = first.iter().take(FOLLOWED).map(Start::at).collect();
    let best = refit_from(problem, &leading, &white, scratch)?;
    // What goes along a narrow valley has not arrived after one fit's steps.
    refit_from(problem, &[Start::at(&best)], &white, scratch)
}
