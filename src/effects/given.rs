//! The law with causes that are known beforehand: what its error would be, and nothing judged.

use super::candidates::{all_along, event_times, jump, once};
use super::channels::distinct;
use super::definition::Trying;
use super::explanation::{Change, ErrorChange};
use super::faults::{Inspected, inspect};
use super::findings::least_squares;
use super::judge::{block, without_block};
use super::kind::Kind;
use super::options::Options;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::Fitted;
use super::search::{DeclaredPart, Search};
use super::term::{Scratch, Term};
use super::trials::{Trial, TrialBase};
use crate::reading::{Channel, Series, Timestamp, after_days, days_since};
use std::fmt;

/// A declared time may be off by so many readings: clocks are, and so is what people write down (said of [`Cause::at`] too).
const DECLARED_WITHIN: usize = 2;

/// An effect that is known, or declared, to be there; how large it is, how late it acts, and what shape it has, is not.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Its kind.
    pub kind: Kind,
    /// The covariate it works through; `None` for kinds that need none.
    pub channel: Option<String>,
    /// When it happened, for kinds that happen once; `None` where that is not known. It is moved by two readings at most.
    pub at: Option<Timestamp>,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name())?;
        if let Some(channel) = &self.channel {
            write!(f, ":{channel}")?;
        }
        match self.at {
            Some(at) => write!(f, "@{at}"),
            None => Ok(()),
        }
    }
}

/// The errors of the law with these `causes`, fitted as [`explain`](super::explain()) fits what it finds and held out as
/// there, from the reading at `held_out_from` on where that is given. Nothing has to earn its place, so this is what an
/// explanation could come to that knew the truth. Causes that are no term of the law or of the reading (`partition`,
/// `correlated-noise`, and the two ends), or whose covariate is missing, add nothing. `None` with too few readings.
pub fn error_given(
    series: &Series,
    channels: &[Channel],
    causes: &[Cause],
    held_out_from: Option<Timestamp>,
    options: &Options,
) -> Option<ErrorChange> {
    let Inspected {
        series,
        channels,
        faults,
        ..
    } = inspect(series, channels);
    let faulty: Vec<String> = faults.into_iter().filter_map(|f| f.channel).collect();
    let (channels, _) = distinct(channels, &faulty);
    let ready = Ready::of(&series, &channels, &mut Vec::new())?;
    let problem = &ready.problem;
    let mut search = ready.search(options, false);
    let null = search.null(&ready.plain)?;
    let (full, _) = put_in(&mut search, null, causes)?;
    let mut scratch = Scratch::default();
    let after = least_squares(problem, &ready.plain, &full, &mut scratch)?;
    let all = 0..problem.t.len();
    let unit = series.unit;
    let of = |fitted: &Fitted, range: std::ops::Range<usize>| {
        Some(fitted.rms(problem, range) / unit.factor())
    };
    let mut error = ErrorChange {
        unit,
        fit: Change {
            before: of(&ready.plain, all.clone()),
            after: of(&after, all.clone()),
        },
        held_out: Change::default(),
        held_out_step: Change::default(),
        held_out_from: None,
        caveat: None,
    };
    let from = match held_out_from {
        Some(time) => Some(reading_at(problem, time)),
        None => block(problem, &full.terms, options.held_out_share),
    };
    if let Some(from) = from.filter(|from| (8..all.end).contains(from)) {
        let mut held = |fitted: &Fitted| {
            let fitted = without_block(problem, fitted, from, &mut scratch)?;
            of(&fitted, from..all.end)
        };
        error.held_out = Change {
            before: held(&ready.plain),
            after: held(&full),
        };
        error.held_out_from = after_days(problem.epoch, problem.t[from]);
    }
    Some(error)
}

/// The law with the causes, one after another, that first which promises most, each refitted with all before it; and by
/// term of the law which cause it is.
pub(super) fn put_in(
    search: &mut Search,
    mut full: Fitted,
    causes: &[Cause],
) -> Option<(Fitted, Vec<usize>)> {
    let mut left: Vec<usize> = (0..causes.len()).collect();
    let mut placed = Vec::new();
    while !left.is_empty() {
        let ground = search.ground(&full)?;
        let each = left.iter().enumerate();
        let each = each.map(|(place, cause)| (place, promising(&ground, &causes[*cause])));
        let most = |trials: &[Trial]| trials.iter().map(|one| one.gain).fold(f64::MIN, f64::max);
        let each = each.filter(|(_, trials)| !trials.is_empty());
        let Some((place, trials)) = each.max_by(|a, b| most(&a.1).total_cmp(&most(&b.1))) else {
            break;
        };
        let cause = left.swap_remove(place);
        search.declared = match causes[cause].at {
            Some(_) => DeclaredPart::EffectAndTime,
            None => DeclaredPart::Effect,
        };
        let refitted = trials.iter();
        let refitted = refitted.filter_map(|trial| search.refitted(&full, &trial.term));
        if let Some(one) = refitted.max_by(|a, b| a.gain.total_cmp(&b.gain)) {
            full = one.fitted;
            placed.push(cause);
        }
    }
    search.declared = DeclaredPart::Effect;
    Some((full, placed))
}

/// The shapes of a cause that take most off the misfit, of a covariate one by its level and one by its rate; none where it
/// has no shape here.
fn promising(ground: &TrialBase, cause: &Cause) -> Vec<Trial> {
    let each = shapes(ground, cause).into_iter();
    let mut best: Vec<Trial> = Vec::new();
    for trial in each.map(|term| ground.trial(term)) {
        let form = |one: &Trial| one.term.response.map(|response| response.form);
        match best.iter_mut().find(|one| form(one) == form(&trial)) {
            Some(one) if trial.gain > one.gain => *one = trial,
            Some(_) => {}
            None => best.push(trial),
        }
    }
    best
}

/// Everything that a cause may look like: its delays, its times, its periods.
pub(super) fn shapes(ground: &TrialBase, cause: &Cause) -> Vec<Term> {
    shapes_at(
        ground,
        cause,
        times(ground.problem, cause.at, DECLARED_WITHIN),
    )
}

/// Before which reading a cause whose time is declared would fit best, of those within what a search distinguishes.
pub(super) fn fits_best_before(ground: &TrialBase, cause: &Cause) -> Option<usize> {
    let tried = event_times(ground.problem);
    let apart = tried.windows(2).map(|pair| pair[1] - pair[0]).max();
    let within = apart.unwrap_or(1).max(DECLARED_WITHIN);
    let beside = times(ground.problem, Some(cause.at?), within);
    let trials = shapes_at(ground, cause, beside).into_iter();
    let best = trials
        .map(|term| ground.trial(term))
        .max_by(|a, b| a.gain.total_cmp(&b.gain));
    best?.term.at
}

fn shapes_at(ground: &TrialBase, cause: &Cause, times: Vec<usize>) -> Vec<Term> {
    let (problem, kind) = (ground.problem, cause.kind);
    match kind.definition().trying {
        Trying::CovariateInLoad(_) | Trying::CovariateInReading(_) => {
            let mut drivers = ground.drivers.iter();
            let own = drivers.find(|driver| Some(&driver.name) == cause.channel.as_ref());
            let through = own.map(|driver| ground.through(kind, driver));
            through.unwrap_or_default().into_iter().flatten().collect()
        }
        Trying::Once(_) => times.into_iter().flat_map(|at| once(kind, at)).collect(),
        Trying::JumpOfReading => times
            .into_iter()
            .map(|at| jump(problem, kind, at))
            .collect(),
        Trying::AllAlong(_) => all_along(problem, kind),
        Trying::Elsewhere => Vec::new(),
    }
}

/// The readings before which it may have happened: those that the search would try, or, where the time is known, all
/// within so many readings of it.
fn times(problem: &Problem, at: Option<Timestamp>, within: usize) -> Vec<usize> {
    let Some(time) = at else {
        return event_times(problem);
    };
    let at = reading_at(problem, time);
    (at.saturating_sub(within).max(2)..(at + within + 1).min(problem.used - 2)).collect()
}

/// The first reading not before `time`.
fn reading_at(problem: &Problem, time: Timestamp) -> usize {
    // Times go through days and back.
    let day = days_since(problem.epoch, time) - 1e-6 * problem.spacing;
    problem.t.partition_point(|t| *t < day)
}

#[cfg(test)]
mod tests;
