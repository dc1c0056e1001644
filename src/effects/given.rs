//! The law with causes that are known beforehand: what its error would be, and nothing judged.

use super::candidates::{event_times, events, feedbacks, offset, seasonal, tides};
use super::channels::distinct;
use super::explanation::{Change, ErrorChange};
use super::faults::{Inspected, inspect};
use super::findings::least_squares;
use super::judge::{block, without_block};
use super::kind::Kind;
use super::options::Options;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::Fitted;
use super::search::Search;
use super::term::Scratch;
use super::trials::{Ground, Trial};
use crate::reading::{Channel, Series, Timestamp, after_days, days_since};

/// An effect that is known to be there; how large it is, how late it acts, and what shape it has, is not.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Its kind.
    pub kind: Kind,
    /// The covariate it works through; `None` for kinds that need none.
    pub channel: Option<String>,
    /// When it happened, for kinds that happen once; `None` where that is not known. It is moved to where it fits best.
    pub at: Option<Timestamp>,
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
    let channels = distinct(channels, &faulty);
    let ready = Ready::of(&series, &channels, &mut Vec::new())?;
    let problem = &ready.problem;
    let full = fitted(ready.search(options, false), &ready.plain, causes)?;
    let mut scratch = Scratch::default();
    let after = least_squares(problem, &full, &mut scratch)?;
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

/// The law with the causes, one after another, that first which promises most, each refitted with all before it.
fn fitted(mut search: Search, plain: &Fitted, causes: &[Cause]) -> Option<Fitted> {
    let mut full = search.null(plain)?;
    let mut left: Vec<&Cause> = causes.iter().collect();
    while !left.is_empty() {
        let ground = search.ground(&full)?;
        let trials = left.iter().enumerate();
        let trials = trials.filter_map(|(index, cause)| Some((index, promising(&ground, cause)?)));
        let Some((index, trial)) = trials.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain)) else {
            break;
        };
        left.swap_remove(index);
        if let Some(one) = search.refitted(&full, &trial.term) {
            full = one.fitted;
        }
    }
    Some(full)
}

/// The shape of a cause that takes most off the misfit; `None` where it has none.
fn promising(ground: &Ground, cause: &Cause) -> Option<Trial> {
    let problem = ground.problem;
    let trials: Vec<Trial> = match cause.kind {
        Kind::Hydrological | Kind::Thermal => of_channel(ground, cause),
        Kind::LoadStep | Kind::StateReset | Kind::FrictionChange => times(problem, cause.at)
            .into_iter()
            .flat_map(events)
            .filter(|term| term.kind == cause.kind)
            .map(|term| ground.trial(term))
            .collect(),
        Kind::Offset => times(problem, cause.at)
            .into_iter()
            .map(|at| ground.trial(offset(problem, at)))
            .collect(),
        Kind::Seasonal | Kind::Tide | Kind::RateLimit | Kind::Geometry | Kind::IntervalMean => {
            let all_along = seasonal(problem).into_iter().chain(tides(problem));
            all_along
                .chain(feedbacks(problem))
                .filter(|term| term.kind == cause.kind)
                .map(|term| ground.trial(term))
                .collect()
        }
        Kind::Partition | Kind::CorrelatedNoise | Kind::Unexplained | Kind::None => Vec::new(),
    };
    trials.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))
}

fn of_channel(ground: &Ground, cause: &Cause) -> Vec<Trial> {
    let own = |trial: &Trial| {
        let mut drivers = ground.drivers.iter();
        let driver = drivers.find(|(index, _)| Some(*index) == trial.term.channel);
        trial.term.kind == cause.kind
            && driver.is_some_and(|(_, driver)| Some(&driver.name) == cause.channel.as_ref())
    };
    ground.of_covariates().into_iter().filter(own).collect()
}

/// The readings before which it may have happened: those that the search would try, or, where the time is known, all
/// within what the search distinguishes.
fn times(problem: &Problem, at: Option<Timestamp>) -> Vec<usize> {
    let tried = event_times(problem);
    let Some(time) = at else { return tried };
    let apart = tried.windows(2).map(|pair| pair[1] - pair[0]).max();
    let (at, apart) = (reading_at(problem, time), apart.unwrap_or(1));
    (at.saturating_sub(apart).max(2)..(at + apart + 1).min(problem.used - 2)).collect()
}

/// The first reading not before `time`.
fn reading_at(problem: &Problem, time: Timestamp) -> usize {
    // Times go through days and back.
    let day = days_since(problem.epoch, time) - 1e-6 * problem.spacing;
    problem.t.partition_point(|t| *t < day)
}

#[cfg(test)]
mod tests;
