//! What a search found, written into the explanation: figures before and after, tests, and the curves behind them.

use super::diagnosis::{
    Judged, autocorrelation, innovations, is_clear, load_sd, runs, stoffer_toloi, undeclared_load,
};
use super::explain::Options;
use super::explanation::{
    Change, Curves, Explained, Explanation, NoiseReport, ResidualTests, Structure,
};
use super::fuller::Fuller;
use super::judge::{HeldOut, held_out, named, step_errors};
use super::noise::{Memory, Noise, Whitener};
use super::problem::Problem;
use super::refit::{Fitted, Start, plain_starts, refit_from};
use super::response::Driver;
use super::search::Found;
use super::term::{Act, Scratch, Term};
use super::verdict::{LARGEST_REST, Verdict, contribution};
use crate::reading::after_days;

/// What is left is no noise where a test gives it less than this p-value.
const LEFT_OVER: f64 = 0.001;

/// Most stretches of structure that are told.
const MOST_STRETCHES: usize = 8;

/// Readings, noise models, covariates.
type Ground<'a> = (&'a Problem, &'a [Whitener], &'a [(usize, Driver)]);

/// Writes what was found into the explanation.
pub(super) fn tell(
    explanation: &mut Explanation,
    ground: Ground,
    (found, verdict): (Found, Verdict),
    options: &Options,
    scratch: &mut Scratch,
) {
    let (problem, _, drivers) = ground;
    let factor = explanation.unit.factor();
    let Verdict {
        mut effects,
        explained,
        cannot_separate_from,
        full,
    } = verdict;
    explanation.explained = explained;
    explanation.cannot_separate_from = cannot_separate_from;
    let noise = full.noise;
    explanation.noise = NoiseReport {
        white: full.sigma / factor,
        correlated: if noise.memory == Memory::Reading {
            noise.ratio * full.sigma / factor
        } else {
            0.0
        },
        memory_days: (noise.memory == Memory::Reading && noise.days.is_finite())
            .then_some(noise.days),
    };
    // Errors are those of least squares, before and after.
    let after = least_squares(problem, &full, scratch).unwrap_or_else(|| found.plain.clone());
    let n = problem.t.len();
    explanation.error.fit = Change {
        before: Some(found.plain.rms(problem, 0..n) / factor),
        after: Some(after.rms(problem, 0..n) / factor),
    };
    let held = held_out(problem, (&[], &full), options.held_out_share, scratch);
    if let Some(held) = &held {
        let (before, after) = held.errors(problem);
        explanation.error.held_out = Change {
            before: Some(before / factor),
            after: Some(after / factor),
        };
        explanation.error.held_out_from = after_days(problem.epoch, problem.t[held.from]);
        let learned: usize = full.terms.iter().map(Term::coefficients).sum();
        let both = (&found.null, &full);
        let steps = step_errors(problem, both, (held.from, learned), scratch);
        explanation.error.held_out_step = Change {
            before: steps.map(|steps| steps.before / factor),
            after: steps.map(|steps| steps.after / factor),
        };
    }
    // What remembers in the residual may pass for an instrument's only while it is small.
    let noise = explanation.noise.white;
    let rest = explanation.error.fit.after.unwrap_or(0.0);
    let found_any = !full.terms.is_empty();
    if found_any && explained == Explained::Full && rest > LARGEST_REST * noise {
        explanation.explained = Explained::Partly;
    }
    residual_tests(explanation, ground, (&found.null, &full), scratch);
    if explanation.explained == Explained::Full && is_contradicted(&explanation.residual) {
        explanation.explained = Explained::Partly;
    }
    curves(explanation, problem, (&found.plain, &after, held.as_ref()));
    for (index, term) in full.terms.iter().enumerate() {
        let name = unique(&explanation.curves, named(term, drivers).to_string());
        let added = contribution(problem, &full, index, scratch);
        let added = added.into_iter().map(|value| value / factor).collect();
        explanation.curves.contributions.insert(name.clone(), added);
        if let Some(load) = log_load(problem, &full, index) {
            explanation.curves.log_loads.insert(name, load);
        }
    }
    explanation.fuller = Fuller::of(problem, &full, drivers);
    explanation.verdict = effects.remove(0);
    explanation.also = effects;
    let mut candidates = found.candidates;
    candidates.sort_by(|a, b| b.bic_gain.total_cmp(&a.bic_gain));
    explanation.candidates = candidates;
}

/// Whether a test of what is left says that it is no noise.
fn is_contradicted(residual: &ResidualTests) -> bool {
    let values = [residual.runs.after, residual.stoffer_toloi.after];
    values.into_iter().flatten().any(|p| p < LEFT_OVER)
}

/// The law with the effects of `full`, by least squares over all readings.
pub(super) fn least_squares(
    problem: &Problem,
    full: &Fitted,
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let white = [Whitener::new(problem, Noise::WHITE)];
    let starts = plain_starts(problem).into_iter();
    let mut starts: Vec<Start> = starts.map(|start| start.joined(&full.terms)).collect();
    starts.push(Start::at(full));
    refit_from(problem, &starts, &white, scratch)
}

/// A name that no curve has yet.
fn unique(curves: &Curves, name: String) -> String {
    let taken = |name: &String| curves.contributions.contains_key(name);
    if !taken(&name) {
        return name;
    }
    let mut count = 2;
    while taken(&format!("{name} {count}")) {
        count += 1;
    }
    format!("{name} {count}")
}

/// What a term adds to the log-load at the readings, where it acts there.
fn log_load(problem: &Problem, full: &Fitted, index: usize) -> Option<Vec<f64>> {
    let own = super::judge::coefficients(problem, full, index);
    let term: &Term = &full.terms[index];
    let at = |node: usize| match &term.act {
        Act::Load(columns) => {
            let each = columns.iter().zip(own);
            Some(each.map(|(column, gain)| gain * column[node]).sum())
        }
        Act::Step => {
            let from = super::term::event_node(problem, term.at?);
            Some(if node >= from { own[0] } else { 0.0 })
        }
        Act::Reset
        | Act::Friction(_)
        | Act::PerVelocity
        | Act::PerSlip
        | Act::Reading(_)
        | Act::Averaging => None,
    };
    problem.node_of.iter().map(|&node| at(node)).collect()
}

fn curves(
    explanation: &mut Explanation,
    problem: &Problem,
    (before, after, held): (&Fitted, &Fitted, Option<&HeldOut>),
) {
    let factor = explanation.unit.factor();
    let scaled = |values: &[f64]| values.iter().map(|value| value / factor).collect();
    let curves = &mut explanation.curves;
    let times = problem.t.iter();
    curves.times = times
        .filter_map(|t| after_days(problem.epoch, *t))
        .collect();
    curves.readings = scaled(&problem.y);
    curves.before = scaled(&before.prediction);
    curves.after = scaled(&after.prediction);
    if let Some(held) = held {
        curves.before_held_out = scaled(&held.before.prediction);
        curves.after_held_out = scaled(&held.after.prediction);
    }
}

/// The tests of the residual, the undeclared load left in it, and its autocorrelation, before and after.
fn residual_tests(
    explanation: &mut Explanation,
    (problem, bank, _): Ground,
    (null, full): (&Fitted, &Fitted),
    scratch: &mut Scratch,
) {
    let mut each = [null, full].map(|fitted| {
        let judged = Judged::of((problem, fitted), bank, scratch)?;
        let innovations = innovations(problem, fitted, judged.plain);
        let load = judged
            .load
            .map(|(whitener, _)| undeclared_load(problem, fitted, whitener));
        Some((judged.load_gain(), innovations, load.unwrap_or_default()))
    });
    let tests = &mut explanation.residual;
    let curves = &mut explanation.curves;
    curves.lag_days = problem.spacing;
    if let Some((gain, innovations, load)) = each[0].take() {
        tests.runs.before = runs(&innovations);
        tests.stoffer_toloi.before = stoffer_toloi(problem, &innovations);
        tests.undeclared_load_bic_gain.before = Some(gain);
        tests.undeclared_load_sd.before = Some(load_sd(&load));
        curves.autocorrelation.before = autocorrelation(problem, &innovations);
        curves.load_before = load;
    }
    if let Some((gain, innovations, load)) = each[1].take() {
        tests.runs.after = runs(&innovations);
        tests.stoffer_toloi.after = stoffer_toloi(problem, &innovations);
        tests.undeclared_load_bic_gain.after = Some(gain);
        tests.undeclared_load_sd.after = Some(load_sd(&load));
        curves.autocorrelation.after = autocorrelation(problem, &innovations);
        if gain > 0.0 {
            tests.structure = structure(problem, &load);
        }
        curves.load_after = load;
    }
}

/// Where the undeclared load stands clear of nothing, the clearest stretches first.
fn structure(problem: &Problem, load: &[(f64, f64)]) -> Vec<Structure> {
    let mut stretches: Vec<Structure> = Vec::new();
    let mut i = 0;
    while i < load.len() {
        if !is_clear(load[i]) {
            i += 1;
            continue;
        }
        let from = i;
        let sign = load[i].0.signum();
        let mut peak = i;
        while i < load.len() && is_clear(load[i]) && load[i].0 * sign > 0.0 {
            if load[i].0.abs() > load[peak].0.abs() {
                peak = i;
            }
            i += 1;
        }
        let time = |k: usize| after_days(problem.epoch, problem.t[k]);
        if let (Some(from), Some(until)) = (time(from), time(i - 1)) {
            stretches.push(Structure {
                from,
                until,
                log_load: load[peak].0,
                z: load[peak].0 / load[peak].1,
            });
        }
    }
    stretches.sort_by(|a, b| b.z.abs().total_cmp(&a.z.abs()));
    stretches.truncate(MOST_STRETCHES);
    stretches
}
