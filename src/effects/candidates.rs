//! Everything that may be missing, as terms to be tried.

use super::act::{Act, harmonics, standardise};
use super::definition::SearchedRecord;
use super::frame::dot;
use super::kind::{Form, Kind};
use super::problem::{Problem, slips};
use super::quantiles::upper_median;
use super::response::{Driver, Response};
use super::term::{MIDDLE, Term};
use crate::reading::Quantity;

/// A covariate follows the year if its harmonics hold this share of its variance.
const SEASONAL_SHARE: f64 = 0.5;
/// And one that is one wave of a year, by that wave alone.
const ONE_WAVE_SHARE: f64 = 0.93;
/// Times tried for what happens once.
const EVENT_TIMES: usize = 64;
/// So many of the largest innovations are tried beside them, of those that are so many times the median size or more.
const LARGE_INNOVATIONS: usize = 8;
const LARGE: f64 = 5.0;
/// Jumps of the reading tried, the largest first.
const JUMPS: usize = 24;
/// No event within so many readings of either end: what happens there cannot be distinguished from noise.
pub(super) const EVENT_MARGIN: usize = 5;

/// A term without covariate, response or time.
fn plain(kind: Kind, act: Act) -> Term {
    Term {
        kind,
        channel: None,
        response: None,
        at: None,
        share: MIDDLE,
        act,
    }
}

/// Waves in the load of these periods, days.
pub(super) fn waves(problem: &Problem, kind: Kind, periods: &[f64]) -> Term {
    plain(kind, record(problem).waves(periods))
}

/// What a definition is given to know of a record.
fn record(problem: &Problem) -> SearchedRecord<'_> {
    SearchedRecord {
        quantity: problem.quantity,
        epoch: problem.epoch,
        days: &problem.nodes,
        reading_days: &problem.t,
        span_days: problem.span(),
        spacing_days: problem.spacing,
        averaging_days: problem.averaging_days,
    }
}

/// The responses tried for each covariate: their mean delays, days.
pub(super) fn delays(problem: &Problem, driver: &Driver) -> Vec<f64> {
    // No shorter than what the sampling of both resolves, no longer than a memory of half the record.
    let shortest = driver.step().max(0.25 * problem.spacing);
    let longest = problem.span() / 6.0;
    let mut delays = vec![0.0];
    let mut delay = shortest;
    let ratio = (longest / shortest).max(1.0).powf(1.0 / 7.0).max(1.5);
    while delay <= longest * 1.001 {
        delays.push(delay);
        delay *= ratio;
    }
    delays
}

/// A covariate's term in the load for one response; `None` where it stands still.
pub(super) fn in_load(
    problem: &Problem,
    kind: Kind,
    driver: &Driver,
    response: Response,
) -> Option<Term> {
    let column = driver.respond(response, &problem.nodes)?;
    Some(Term {
        kind,
        channel: Some(driver.index),
        response: Some(response),
        at: None,
        share: MIDDLE,
        act: Act::Load(vec![column]),
    })
}

/// `term`, which works through `driver`, with another response; `None` where that stands still.
pub(super) fn with_response(
    problem: &Problem,
    term: &Term,
    driver: &Driver,
    response: Response,
) -> Option<Term> {
    if matches!(term.act, Act::Reading(_)) {
        let Response {
            stages, mean_days, ..
        } = response;
        return in_reading(problem, term.kind, driver, stages, mean_days);
    }
    in_load(problem, term.kind, driver, response)
}

/// The responses of one form that a search goes through.
pub(super) fn responses(form: Form, delays: &[f64]) -> Vec<Response> {
    let mut responses = Vec::new();
    for &mean_days in delays {
        for stages in [1, 2] {
            // Two stages of no delay are one, and a rate needs its own scale.
            if stages == 2 && mean_days == 0.0 {
                continue;
            }
            responses.push(Response {
                form,
                stages,
                mean_days,
                before: 0.0,
            });
        }
    }
    responses
}

/// What an effect may be all along, where it needs no covariate.
pub(super) fn all_along(problem: &Problem, kind: Kind) -> Vec<Term> {
    let acts = kind.definition().all_along(&record(problem));
    acts.into_iter().map(|act| plain(kind, act)).collect()
}

/// Whether two years have been read.
pub(super) fn are_two_years(problem: &Problem) -> bool {
    record(problem).shows_the_year()
}

/// Whether a covariate's response mostly repeats itself from year to year: a year's harmonics hold this share of it.
pub(super) fn follows_season(problem: &Problem, term: &Term) -> bool {
    let periods = Kind::SEASONAL.definition().wave_periods;
    let share = || held_by(problem, term, periods);
    are_two_years(problem) && share().is_some_and(|share| share > SEASONAL_SHARE)
}

/// Whether a covariate's response is one wave of a year, in a record that does not show whether that repeats.
pub(super) fn is_one_wave(problem: &Problem, term: &Term) -> bool {
    let year = &Kind::SEASONAL.definition().wave_periods[..1];
    let share = || held_by(problem, term, year);
    !are_two_years(problem) && share().is_some_and(|share| share > ONE_WAVE_SHARE)
}

/// What share of the course of a covariate in a term's load waves of these periods, days, hold; `None` of other terms.
fn held_by(problem: &Problem, term: &Term, periods: &[f64]) -> Option<f64> {
    let (Act::Load(columns), Some(_)) = (&term.act, term.channel) else {
        return None;
    };
    let column = columns.first()?;
    // What a rate adds up to is the covariate itself.
    let course = match term.response.map(|response| response.form) {
        Some(Form::Rate) => standardise(slips(&problem.nodes, column)),
        Some(Form::Level) | None => Some(column.clone()),
    };
    let mut left = course?;
    let whole = dot(&left, &left);
    let mut directions: Vec<Vec<f64>> = Vec::new();
    for harmonic in harmonics(&problem.nodes, periods) {
        let mut unit = harmonic;
        for known in &directions {
            let share = dot(known, &unit);
            unit.iter_mut()
                .zip(known)
                .for_each(|(u, k)| *u -= share * k);
        }
        let length = dot(&unit, &unit).sqrt();
        for u in &mut unit {
            *u /= length;
        }
        let share = dot(&unit, &left);
        left.iter_mut()
            .zip(&unit)
            .for_each(|(l, u)| *l -= share * u);
        directions.push(unit);
    }
    Some(1.0 - dot(&left, &left) / whole)
}

/// What of that kind happened once, before reading `at`, in each way that it may.
pub(super) fn once(kind: Kind, at: usize) -> impl Iterator<Item = Term> {
    let acts = kind.definition().once().iter();
    acts.map(move |act| Term {
        at: Some(at),
        ..plain(kind, act.clone())
    })
}

/// A load of that course at the nodes, which nothing measures and no kind names.
pub(super) fn slow(course: Vec<f64>) -> Term {
    plain(Kind::UNEXPLAINED, Act::Load(vec![course]))
}

/// The readings at which an event is tried, evenly over the record.
pub(super) fn event_times(problem: &Problem) -> Vec<usize> {
    let (first, end) = (EVENT_MARGIN, problem.used.saturating_sub(EVENT_MARGIN));
    let stride = end.saturating_sub(first).div_ceil(EVENT_TIMES).max(1);
    (first..end).step_by(stride).collect()
}

/// Those at which the innovations are largest, far above the usual ones. Where noise remembers, an event a few readings away
/// explains nothing of a jump.
pub(super) fn times_of_jumps(problem: &Problem, innovations: &[f64]) -> Vec<usize> {
    let end = problem.used.saturating_sub(EVENT_MARGIN);
    let range = EVENT_MARGIN..end.min(innovations.len());
    let mut sizes: Vec<(usize, f64)> = range.map(|at| (at, innovations[at].abs())).collect();
    let usual = upper_median(sizes.iter().map(|(_, size)| *size).collect());
    sizes.retain(|(_, size)| *size > LARGE * usual);
    sizes.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    sizes.truncate(LARGE_INNOVATIONS);
    sizes.into_iter().map(|(at, _)| at).collect()
}

/// A jump of the reading before reading `at`.
pub(super) fn jump(problem: &Problem, kind: Kind, at: usize) -> Term {
    let column = (0..problem.t.len()).map(|i| f64::from(u8::from(i >= at)));
    Term {
        at: Some(at),
        ..plain(kind, Act::Reading(vec![column.collect()]))
    }
}

/// The largest jumps of the residual: where the medians on both sides differ most.
pub(super) fn jumps(problem: &Problem, residual: &[f64]) -> Vec<usize> {
    if problem.quantity == Quantity::Velocity {
        return Vec::new();
    }
    let beside = 4;
    let level = |range: &[f64]| upper_median(range.to_vec());
    let mut sizes: Vec<(usize, f64)> = (2..residual.len().saturating_sub(1))
        .map(|i| {
            let before = &residual[i.saturating_sub(beside)..i];
            let after = &residual[i..(i + beside).min(residual.len())];
            let jump = (level(after) - level(before)).abs();
            // The step between the two readings themselves, so that the sharpest place wins.
            (i, jump.min((residual[i] - residual[i - 1]).abs()))
        })
        .collect();
    sizes.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    sizes.truncate(JUMPS);
    sizes.into_iter().map(|(i, _)| i).collect()
}

/// A covariate in the reading: of a displacement its delayed value, of a velocity the rate of that.
pub(super) fn in_reading(
    problem: &Problem,
    kind: Kind,
    driver: &Driver,
    stages: u8,
    mean_days: f64,
) -> Option<Term> {
    let form = match problem.quantity {
        Quantity::Displacement => Form::Level,
        Quantity::Velocity => Form::Rate,
    };
    let response = Response {
        form,
        stages,
        mean_days,
        before: 0.0,
    };
    let column = driver.respond(response, &problem.t)?;
    Some(Term {
        kind,
        channel: Some(driver.index),
        response: Some(response),
        at: None,
        share: MIDDLE,
        act: Act::Reading(vec![column]),
    })
}
