//! What is reported of a search: figures before and after, tests, and the curves behind them.

use super::act::Act;
use super::diagnosis::{
    Judged, autocorrelation, innovations, is_clear, load_sd, runs, stoffer_toloi, undeclared_load,
};
use super::explanation::{
    Candidate, Change, Curves, Effect, ErrorChange, Explained, NoiseReport, ResidualTests,
    Structure,
};
use super::fresh::{best_of_starts, fresh_starts};
use super::judge::{Compared, HeldOut, StepErrors, held_out, named, step_errors};
use super::kind::Kind;
use super::known_load::KnownLoad;
use super::noise::{Memory, Noise, Whitener};
use super::options::Options;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::{Fitted, Start, towards};
use super::rival::Rival;
use super::search::SearchResult;
use super::term::{Scratch, Term};
use super::verdict::{LARGEST_REST, Verdict, contribution};
use crate::reading::{Unit, after_days, rounding_error};
use std::collections::BTreeMap;

/// What is left is no noise where a test gives it less than this p-value, and nothing is explained in full under the second one.
const LEFT_OVER: f64 = 0.001;
const NOT_IN_FULL: f64 = 0.005;

/// A white noise of so many times what the readings' digits leave open is noise that they show.
const CLEAR_OF_DIGITS: f64 = 1.5;

const FAILS: &str = "The law fails within the held-out readings: an error larger than all that the readings range over is no figure, and is not given.";

const DRIFTS: &str = "Extrapolated over all held-out readings the error grows: there the law's own drift since the block began counts at every reading. What the effects add shows in the error from reading to reading.";

/// Most stretches of structure that are reported.
const MOST_STRETCHES: usize = 8;

/// What a search found, with the figures, tests and curves that are reported of it.
pub(super) struct Findings {
    pub(super) verdict: Effect,
    pub(super) explained: Explained,
    pub(super) also: Vec<Effect>,
    pub(super) cannot_separate_from: Vec<Rival>,
    pub(super) error: ErrorChange,
    pub(super) candidates: Vec<Candidate>,
    pub(super) residual: ResidualTests,
    pub(super) noise: NoiseReport,
    pub(super) curves: Curves,
    pub(super) known_load: KnownLoad,
}

impl Findings {
    /// The verdict, and what stands beside it.
    pub(super) fn effects(&self) -> impl Iterator<Item = &Effect> + Clone {
        [&self.verdict].into_iter().chain(&self.also)
    }

    /// Where there was nothing to search, or no law to start from.
    pub(super) fn none(unit: Unit) -> Self {
        Self {
            verdict: Effect::of(Kind::NONE),
            explained: Explained::None,
            also: Vec::new(),
            cannot_separate_from: Vec::new(),
            error: ErrorChange::none(unit),
            candidates: Vec::new(),
            residual: ResidualTests::default(),
            noise: NoiseReport::default(),
            curves: Curves::default(),
            known_load: KnownLoad::default(),
        }
    }
}

/// All that is reported of what was found and concluded.
pub(super) fn findings(
    ready: &Ready,
    found: SearchResult,
    verdict: Verdict,
    options: &Options,
    scratch: &mut Scratch,
) -> Findings {
    let (problem, unit) = (&ready.problem, ready.unit);
    let Verdict {
        mut effects,
        explained,
        cannot_separate_from,
        full,
    } = verdict;
    let noise = noise_report(&full, unit);
    // Errors are those of least squares, before and after.
    let plain = &found.plain;
    let after = least_squares(problem, plain, &full, scratch).unwrap_or_else(|| plain.clone());
    let both = Compared {
        before: plain,
        after: &full,
    };
    let mut held = held_out(problem, both, options.held_out_share, scratch);
    let (mut before, mut null) = (plain, &found.null);
    if full.terms.is_empty() {
        // Nothing entered: what differs before and after are two fits of one law, of which the nearer counts for both.
        (before, null) = (&after, &full);
        held = held.map(HeldOut::by_the_nearer);
    }
    let by_least_squares = Compared {
        before,
        after: &after,
    };
    let both = Compared {
        before: null,
        after: &full,
    };
    let error = errors(problem, by_least_squares, held.as_ref(), unit);
    let held_out_step = steps(ready, both, held.as_ref(), scratch);
    let is_missing = held_out_step.before.is_none() || held_out_step.after.is_none();
    let caveat = (held.is_some() && is_missing).then(|| FAILS.to_owned());
    let error = ErrorChange {
        held_out_step,
        caveat: error.caveat.or(caveat),
        ..error
    };
    let (residual, left) = residual_tests(ready, both, scratch);
    let explained = confirmed(explained, &full, &noise, &error, &residual);
    // Nothing was found, and yet what is left is no noise, nor what the digits leave open.
    let is_read = full.sigma > CLEAR_OF_DIGITS * problem.rounding;
    if effects[0].effect == Kind::NONE && is_read && is_contradicted(&residual, LEFT_OVER) {
        effects[0] = Effect::of(Kind::UNEXPLAINED);
    }
    let curves = curves(problem, by_least_squares, held.as_ref(), unit, left);
    let curves = with_effects(curves, ready, &full, scratch);
    let mut candidates = found.candidates;
    candidates.sort_by(|a, b| b.bic_gain.total_cmp(&a.bic_gain));
    Findings {
        verdict: effects.remove(0),
        explained,
        also: effects,
        cannot_separate_from,
        error,
        candidates,
        residual,
        noise,
        curves,
        known_load: KnownLoad::of(problem, &full, &ready.drivers),
    }
}

fn noise_report(full: &Fitted, unit: Unit) -> NoiseReport {
    let factor = unit.factor();
    let noise = full.noise;
    let remembers = noise.memory == Memory::Reading;
    NoiseReport {
        white: full.sigma / factor,
        correlated: if remembers {
            noise.remembered() * full.sigma / factor
        } else {
            0.0
        },
        memory_days: noise.memory_days().filter(|_| remembers),
    }
}

/// Errors over the later block, each reading predicted from those before it; by what the law learned before the block moves
/// where that cannot be fitted.
fn steps(
    ready: &Ready,
    both: Compared<'_>,
    held: Option<&HeldOut>,
    scratch: &mut Scratch,
) -> Change {
    let problem = &ready.problem;
    let Some(held) = held else {
        return Change::default();
    };
    let newest = both.after.terms.len();
    let known = step_errors(problem, both, held.from, newest, scratch);
    let (before, mut after) = known.map_or_else(
        || held.errors_of_changes(problem),
        |steps| (steps.before, steps.after),
    );
    if newest == 0 {
        // With nothing added there is nothing to compare.
        after = before;
    }
    let shown = |error: f64| {
        let figure = Some(error).filter(|error| StepErrors::is_a_figure(problem, *error));
        figure.map(|error| error / ready.unit.factor())
    };
    Change {
        before: shown(before),
        after: shown(after),
    }
}

/// Errors of the fit, and extrapolated over the later block.
fn errors(
    problem: &Problem,
    Compared { before, after }: Compared<'_>,
    held: Option<&HeldOut>,
    unit: Unit,
) -> ErrorChange {
    let factor = unit.factor();
    let n = problem.t.len();
    let is_a_figure = |error: &f64| StepErrors::is_a_figure(problem, *error);
    let extrapolated = held.map(|held| held.errors(problem));
    let shown = |error: Option<f64>| error.filter(is_a_figure).map(|error| error / factor);
    let held_out = Change {
        before: shown(extrapolated.map(|(before, _)| before)),
        after: shown(extrapolated.map(|(_, after)| after)),
    };
    let has_failed =
        extrapolated.is_some() && (held_out.before.is_none() || held_out.after.is_none());
    let both = held_out.before.zip(held_out.after);
    let grows = both.is_some_and(|(before, after)| after > before);
    let caveat = has_failed.then_some(FAILS).or(grows.then_some(DRIFTS));
    ErrorChange {
        caveat: caveat.map(str::to_owned),
        fit: Change {
            before: Some(before.rms(problem, 0..n) / factor),
            after: Some(after.rms(problem, 0..n) / factor),
        },
        held_out,
        held_out_from: held.and_then(|held| after_days(problem.epoch, problem.t[held.from])),
        ..ErrorChange::none(unit)
    }
}

/// What was concluded to be explained in full is so only where the figures and the tests say nothing else.
fn confirmed(
    explained: Explained,
    full: &Fitted,
    noise: &NoiseReport,
    error: &ErrorChange,
    residual: &ResidualTests,
) -> Explained {
    // What remembers in the residual may pass for an instrument's only while it is small.
    let rest = error.fit.after.unwrap_or(0.0);
    let is_large = !full.terms.is_empty() && rest > LARGEST_REST * noise.white;
    if explained == Explained::Full && (is_large || is_contradicted(residual, NOT_IN_FULL)) {
        Explained::Partly
    } else {
        explained
    }
}

/// The curves with what each effect adds.
fn with_effects(mut curves: Curves, ready: &Ready, full: &Fitted, scratch: &mut Scratch) -> Curves {
    let problem = &ready.problem;
    for (index, term) in full.terms.iter().enumerate() {
        let name = unique(&curves, named(term, &ready.drivers).to_string());
        let added = contribution(problem, full, index, scratch);
        let added = added.into_iter().map(|value| value / ready.unit.factor());
        curves.contributions.insert(name.clone(), added.collect());
        if let Some(load) = log_load(problem, full, index) {
            curves.log_loads.insert(name, load);
        }
    }
    curves
}

/// Whether a test of what is left says that it is no noise.
fn is_contradicted(residual: &ResidualTests, least: f64) -> bool {
    let values = [residual.runs.after, residual.stoffer_toloi.after];
    values.into_iter().flatten().any(|p| p < least)
}

/// The law with the effects of `full`, by least squares over all readings: no farther from them than the `plain` law, which is the
/// same with effects of no size.
pub(super) fn least_squares(
    problem: &Problem,
    plain: &Fitted,
    full: &Fitted,
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let nothing = full.terms.iter();
    let nothing = nothing.fold(Start::at(plain), |start, term| start.with_size(term, 0.0));
    // The law's priors may lead away from the nearest.
    let white = Whitener::new(problem, Noise::WHITE);
    let as_plain = towards(problem, &nothing, &white, (0, scratch));
    let mut starts = fresh_starts(problem, &full.terms);
    starts.extend([Start::at(full), nothing.clone()]);
    let best = best_of_starts(problem, &starts, scratch);
    let both = best.into_iter().chain(as_plain.clone());
    let nearest = both.min_by(|a, b| a.deviance.total_cmp(&b.deviance))?;
    let rms = |fitted: &Fitted| fitted.rms(problem, 0..problem.t.len());
    if rms(&nearest) <= rms(plain) {
        return Some(nearest);
    }
    if full.terms.is_empty() {
        return Some(plain.clone());
    }
    // Readings that weigh little in a fit count in its error as all others do.
    let even = Problem {
        weight: vec![1.0; problem.t.len()],
        ..problem.clone()
    };
    let starts = [Start::at(&nearest), nothing];
    let best = best_of_starts(&even, &starts, scratch);
    let all = best.into_iter().chain(as_plain).chain([nearest]);
    all.min_by(|a, b| rms(a).total_cmp(&rms(b)))
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
            let (from, _) = super::term::event_place(problem, (term.at?, term.share));
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
    problem: &Problem,
    Compared { before, after }: Compared<'_>,
    held: Option<&HeldOut>,
    unit: Unit,
    left: [Left; 2],
) -> Curves {
    let scaled = |values: &[f64]| values.iter().map(|value| value / unit.factor()).collect();
    let times = problem.t.iter();
    let [left_before, left_after] = left;
    Curves {
        times: times
            .filter_map(|t| after_days(problem.epoch, *t))
            .collect(),
        readings: scaled(&problem.y),
        before: scaled(&before.prediction),
        after: scaled(&after.prediction),
        before_held_out: held.map_or_else(Vec::new, |held| scaled(&held.before.prediction)),
        after_held_out: held.map_or_else(Vec::new, |held| scaled(&held.after.prediction)),
        load_before: left_before.load,
        load_after: left_after.load,
        autocorrelation: Change {
            before: left_before.autocorrelation,
            after: left_after.autocorrelation,
        },
        lag_days: problem.spacing,
        contributions: BTreeMap::new(),
        log_loads: BTreeMap::new(),
    }
}

/// What is left of the readings under one law, as it is drawn.
#[derive(Debug, Default)]
struct Left {
    load: Vec<(f64, f64)>,
    autocorrelation: Vec<f64>,
}

/// The tests of what one law leaves.
#[derive(Debug, Default)]
struct Tests {
    runs: Option<f64>,
    stoffer_toloi: Option<f64>,
    load_gain: Option<f64>,
    load_sd: Option<f64>,
}

/// The tests of the residual, the undeclared load left in it, and its autocorrelation, before and after.
fn residual_tests(
    ready: &Ready,
    Compared { before, after }: Compared<'_>,
    scratch: &mut Scratch,
) -> (ResidualTests, [Left; 2]) {
    let problem = &ready.problem;
    let [(before, left_before), (after, left_after)] = [before, after]
        .map(|fitted| {
            let judged = Judged::of(problem, fitted, &ready.bank, scratch)?;
            let innovations = innovations(problem, fitted, judged.plain);
            // A step of the resolution is so many times the error that it makes.
            let step = problem.rounding / rounding_error(fitted.sigma);
            let load = judged
                .load
                .map(|(whitener, _)| undeclared_load(problem, fitted, whitener));
            let load = load.unwrap_or_default();
            let tests = Tests {
                runs: runs(&innovations, step),
                stoffer_toloi: stoffer_toloi(problem, &innovations),
                load_gain: judged.load.is_some().then(|| judged.load_gain()),
                load_sd: (!load.is_empty()).then(|| load_sd(&load)),
            };
            let autocorrelation = autocorrelation(problem, &innovations);
            Some((
                tests,
                Left {
                    load,
                    autocorrelation,
                },
            ))
        })
        .map(Option::unwrap_or_default);
    let has_structure = after.load_gain.is_some_and(|gain| gain > 0.0);
    let tests = ResidualTests {
        runs: change(before.runs, after.runs),
        stoffer_toloi: change(before.stoffer_toloi, after.stoffer_toloi),
        undeclared_load_bic_gain: change(before.load_gain, after.load_gain),
        undeclared_load_sd: change(before.load_sd, after.load_sd),
        structure: if has_structure {
            structure(problem, &left_after.load)
        } else {
            Vec::new()
        },
    };
    (tests, [left_before, left_after])
}

fn change(before: Option<f64>, after: Option<f64>) -> Change {
    Change { before, after }
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

#[cfg(test)]
mod tests;
