//! Fits that start from laws of their own, not from where a fit without the newest effect ended: the best law without an
//! effect may be a poor one, beside which everything that is tried gains alike.

use super::act::Act;
use super::noise::{Noise, Whitener};
use super::problem::{Problem, slips};
use super::refit::{Fitted, Start, likeliest, refit_from, towards};
use super::term::{Scratch, Term, law_parameters};
use crate::reading::Quantity;

/// So many steps from each start, and only the best so many starts are followed to the end.
const FIRST_STEPS: usize = 8;
const FOLLOWED: usize = 4;
/// A fit has arrived where another from its end lowers -2 ln likelihood by less than this; so many more are made at most.
const ARRIVED: f64 = 0.01;
const MOST_AGAIN: usize = 25;
/// Shares of the slip within which a load that answers to the motion has hardly shown.
const EARLY: [f64; 4] = [0.1, 0.25, 0.5, 0.75];
/// Lengths of a growing mean, spacings of the readings.
const GROWING: [f64; 7] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
/// Fewest readings of an early law.
const FEWEST_EARLY: usize = 12;

/// Which of [`plain_starts`] answers to a load at once.
pub(super) const AT_ONCE: usize = 1;

/// Starts of the law alone: steady, steady and answering to a load at once, accelerating, relaxing from above and from below, soon there, and there within the first readings.
pub(super) fn plain_starts(problem: &Problem) -> Vec<Start> {
    let shapes = [
        (0.0, -2.0, 0.0),
        (0.0, -6.0, 0.0),
        (0.8, -1.0, 0.3),
        (0.95, -3.0, 0.0),
        (-3.0, 1.0, -0.5),
        (1.0, 2.0, -0.5),
        (-20.0, 3.4, -0.8),
        (-150.0, 5.2, -1.0),
    ];
    let used = problem.used;
    let ends = (used / 5).max(2);
    let early = match problem.quantity {
        Quantity::Displacement => {
            (problem.y[ends] - problem.y[0]) / (problem.t[ends] - problem.t[0])
        }
        Quantity::Velocity => problem.y[..ends].iter().sum::<f64>() / ends as f64,
    };
    let typical = problem.typical_velocity();
    let early = early.clamp(0.01 * typical, 100.0 * typical);
    let start = |(r, ln_a, p): (f64, f64, f64)| {
        let velocity = if r == 0.0 { typical } else { early };
        let mut parameters = vec![velocity.ln(), r, ln_a, p];
        if problem.quantity == Quantity::Displacement {
            parameters.push(problem.y[0]);
        }
        Start::of_law(parameters)
    };
    shapes.into_iter().map(start).collect()
}

/// Starts of the law with `terms`, at every size that they may start at.
pub(super) fn fresh_starts(problem: &Problem, terms: &[Term]) -> Vec<Start> {
    let sizes = terms.iter().map(|term| term.act.starts().len()).max();
    let mut all = Vec::new();
    for size in 0..sizes.unwrap_or(1) {
        for plain in plain_starts(problem) {
            let joined = terms.iter().fold(plain, |start, term| {
                let own = term.act.starts();
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
    let sizes = term.act.starts().iter();
    sizes
        .flat_map(|size| laws.iter().map(|law| law.clone().with_size(term, *size)))
        .collect()
}

/// The law with a load that answers to the motion, followed from the first readings, at which that load has hardly shown,
/// to all of them: without it the slope's own law would go to infinite velocity where the load slows it down in the end, and in a
/// law that suits the whole record there is nothing for the load to slow down. `None` of another term.
pub(super) fn from_the_first_readings(
    problem: &Problem,
    term: &Term,
    scratch: &mut Scratch,
) -> Option<Fitted> {
    if !matches!(term.act, Act::PerVelocity | Act::PerSlip) {
        return None;
    }
    let counts = EARLY.map(|share| readings_until(problem, share));
    let mut counts: Vec<usize> = counts
        .into_iter()
        .filter(|count| (FEWEST_EARLY..problem.used).contains(count))
        .collect();
    counts.dedup();
    let first = problem.until(*counts.first()?);
    let mut known = best_of_starts(&first, &plain_starts(&first), scratch)?;
    let mut part = first;
    let wholes = counts.into_iter().skip(1).chain([problem.used]);
    for count in wholes {
        let next = problem.until(count);
        let sizes = if known.terms.is_empty() {
            term.act.starts()
        } else {
            &[0.0]
        };
        let start = in_terms_of(&next, &part, &known, term);
        let starts = sizes.iter().map(|size| {
            if known.terms.is_empty() {
                start.clone().with_size(term, *size)
            } else {
                start.clone()
            }
        });
        known = best_of_starts(&next, &starts.collect::<Vec<_>>(), scratch)?;
        part = next;
    }
    Some(known)
}

/// The law of `base` under a mean over more and more readings, each fit from the law under the shorter mean: a law that
/// nearly fails within the last mean is not reached from one that is far from its failure. All of these, the mean's length
/// free in the end; none of another term.
pub(super) fn under_growing_means(
    problem: &Problem,
    base: &Fitted,
    term: &Term,
    scratch: &mut Scratch,
) -> Vec<Fitted> {
    let mut all = Vec::new();
    if !matches!(term.act, Act::Averaging) {
        return all;
    }
    let white = [Whitener::new(problem, Noise::WHITE)];
    let mut law = Start::at(base);
    for spacings in GROWING {
        let held = Start {
            frozen: 1,
            ..law.clone().with_size(term, spacings)
        };
        let Some(under) = refit_from(problem, &[held], &white, scratch) else {
            continue;
        };
        law = Start::at(&under);
        law.terms.pop();
        law.parameters.pop();
        all.extend(refit_from(problem, &[Start::at(&under)], &white, scratch));
    }
    all
}

/// What was fitted to one part of the readings, in the parameters of another: these are in units of its span and of its
/// usual velocity.
fn in_terms_of(next: &Problem, part: &Problem, known: &Fitted, term: &Term) -> Start {
    let mut start = Start::at(known);
    let longer = next.whole_span() / part.whole_span();
    let faster = next.typical_velocity() / part.typical_velocity();
    start.parameters[1] *= longer;
    start.parameters[2] += longer.ln();
    let is_of_slip = matches!(term.act, Act::PerSlip);
    let larger = if is_of_slip { faster * longer } else { faster };
    let first = law_parameters(part);
    for coefficient in &mut start.parameters[first..] {
        *coefficient *= larger;
    }
    start
}

/// How many of the fitted readings lie within that share of the slip.
fn readings_until(problem: &Problem, share: f64) -> usize {
    let y = &problem.y[..problem.used];
    let slip: Vec<f64> = match problem.quantity {
        Quantity::Displacement => y.iter().map(|value| value - y[0]).collect(),
        Quantity::Velocity => slips(&problem.t, y),
    };
    let whole = slip[slip.len() - 1];
    slip.iter()
        .rposition(|slip| *slip <= share * whole)
        .map_or(0, |last| last + 1)
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
    first.sort_by(|a, b| a.deviance.total_cmp(&b.deviance));
    let leading: Vec<Start> = first.iter().take(FOLLOWED).map(Start::at).collect();
    let best = refit_from(problem, &leading, &white, scratch)?;
    // What goes along a narrow valley has not arrived after one fit's steps.
    refit_from(problem, &[Start::at(&best)], &white, scratch)
}

/// The best of many starts by least squares, each of them followed, and the best of them until another fit from its end changes nothing: along a
/// narrow valley the few steps that choose the leading starts may choose the wrong ones.
pub(super) fn best_of_all_starts(
    problem: &Problem,
    starts: &[Start],
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let white = [Whitener::new(problem, Noise::WHITE)];
    let leading = best_of_starts(problem, starts, scratch);
    let each = refit_from(problem, starts, &white, scratch);
    let mut best = likeliest(problem, leading.into_iter().chain(each))?;
    for _ in 0..MOST_AGAIN {
        let again = refit_from(problem, &[Start::at(&best)], &white, scratch);
        let Some(next) = again.filter(|next| next.deviance < best.deviance) else {
            break;
        };
        let has_arrived = best.deviance - next.deviance < ARRIVED;
        best = next;
        if has_arrived {
            break;
        }
    }
    Some(best)
}

#[cfg(test)]
mod tests;
