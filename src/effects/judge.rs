//! What an effect must show before it is accepted: sign, memory, bounds, and a later block that it helps to predict.

use super::act::Act;
use super::beside::{BESIDE, undoes_a_neighbour};
use super::definition::{LiesIn, Support};
use super::fresh::{best_of_all_starts, best_of_starts, fresh_starts};
use super::kind::{Form, Kind};
use super::noise::{Memory, Noise, Whitener};
use super::problem::{Problem, slips};
use super::refit::{Fitted, Start, likeliest, refit};
use super::response::Driver;
use super::rival::Rival;
use super::slip_alike::is_loosening;
use super::term::{Scratch, Term, coefficients_of, law_parameters};
use crate::reading::{CovariateKind, Quantity};

/// Velocities that are means over more of their own spacings would be smooth: their noise is shared by so many.
const LONGEST_MEAN: f64 = 30.0;

/// A fit without effects that are judged, and one with them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared<'a> {
    pub(super) before: &'a Fitted,
    pub(super) after: &'a Fitted,
}

impl Compared<'_> {
    /// How many terms are judged: the newest ones.
    pub(super) fn newest(self) -> usize {
        self.after.terms.len() - self.before.terms.len()
    }
}

/// The laws without any effect: by least squares, and under the likeliest noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct WithoutAny<'a> {
    pub(super) plain: &'a Fitted,
    pub(super) null: &'a Fitted,
}

/// The later block has at least so many readings.
const FEWEST_HELD_OUT: usize = 5;

/// Coefficients are moved to what was learned before the block in so many steps.
const MOVES: u32 = 8;

/// The error extrapolated over all of the block carries the law's own drift: of what independent data support it may grow by the
/// first factor at most. A tide, and waves of the reading, come back to where they were and cannot drift: what grows there is the law's. (Of six
/// drawn records with waves of 3 mm about a trend that bends or wanders they were refused in three at the first factor, at 144 to 484 %, and in one
/// of two of the carbon dioxide at Mauna Loa a load took their place.)
const MOST_EXTRAPOLATED: f64 = 1.2;
const MOST_OF_WHAT_COMES_BACK: f64 = 10.0;

/// An event is no larger than this, in log-load or ln of the state, and no load for one standard deviation; and no smaller than that.
const LARGEST: f64 = 4.5;
const SMALLEST_EVENT: f64 = 0.03;

/// By what factor the held-out error may grow where it is extrapolated over all of the block; what only the shape of the readings
/// supports may change the law, and with it no error may grow.
pub(super) fn most_extrapolated(kind: Kind) -> f64 {
    let definition = kind.definition();
    let is_wave_of_reading =
        definition.lies_in == LiesIn::Reading && !definition.wave_periods.is_empty();
    match definition.support {
        Support::Astronomy => MOST_OF_WHAT_COMES_BACK,
        Support::Shape if is_wave_of_reading => MOST_OF_WHAT_COMES_BACK,
        Support::Nothing => 1.0,
        Support::Covariate | Support::Shape => MOST_EXTRAPOLATED,
    }
}

/// Why `fitted` (the last of its terms being new) is not what the physics allow; `None` if it is.
pub(super) fn objection(problem: &Problem, fitted: &Fitted, drivers: &[Driver]) -> Option<String> {
    let term = fitted.terms.last()?;
    let own = newest_coefficients(fitted);
    if let Some(response) = term.response
        && response.outlasts_half_of(problem.span())
    {
        return Some(format!(
            "its memory of {:.0} days is over half the record",
            response.memory_days()
        ));
    }
    if let Some(reason) = within_a_gap(problem, fitted, drivers) {
        return Some(reason);
    }
    let channel = Driver::at(drivers, term.channel);
    let loosening = channel.is_some_and(|driver| is_loosening(&driver.name));
    let level = term.response.is_some_and(|r| r.form == Form::Level);
    // Rain that begins slows nothing either: its rate has the sign of its level.
    let is_rain = channel.is_some_and(|driver| driver.kind == CovariateKind::Rain);
    match term.act {
        Act::Load(_) if (is_rain || loosening && level) && own[0] < 0.0 => {
            Some("its sign is not physical: more water would slow the slope".to_owned())
        }
        Act::PerVelocity | Act::PerSlip | Act::Step | Act::Reset | Act::Friction(_)
            if jumps_at_once(problem, fitted) =>
        {
            Some("half of its motion lies between two readings: a jump of the reading looks the same".to_owned())
        }
        Act::PerVelocity if own[0] <= 0.0 => {
            Some("its sign is not physical: the load would grow with the velocity".to_owned())
        }
        Act::PerSlip if own[0] <= 0.0 => {
            Some("its sign is not physical: the slope would steepen under the block".to_owned())
        }
        Act::Averaging if own[0] < 0.5 => {
            Some("the readings are means over no more than their own spacing".to_owned())
        }
        Act::Averaging if own[0] > LONGEST_MEAN => Some(format!(
            "no instrument that is read so often gives means over {:.0} of its readings",
            own[0]
        )),
        Act::Load(_) if own.iter().any(|gain| gain.abs() > LARGEST) => {
            Some("its gain lies on its bound".to_owned())
        }
        Act::Step | Act::Reset if own[0].abs() > LARGEST => {
            Some("its size lies on its bound".to_owned())
        }
        Act::Step | Act::Reset if own[0].abs() < SMALLEST_EVENT => {
            Some("its size is nothing: all that it does is to bend the law".to_owned())
        }
        Act::Step | Act::Reset if undoes_a_neighbour(problem, fitted) => Some(format!(
            "within {BESIDE} readings another event does the opposite: a jump of the reading looks the same"
        )),
        Act::Load(_)
        | Act::PerVelocity
        | Act::PerSlip
        | Act::Averaging
        | Act::Step
        | Act::Reset
        | Act::Friction(_)
        | Act::Reading(_) => None,
    }
}

/// Why the newest term, which happened once, is not judged: a covariate in the law has no values at that time, or none that still acts.
fn within_a_gap(problem: &Problem, fitted: &Fitted, drivers: &[Driver]) -> Option<String> {
    let (newest, others) = fitted.terms.split_last()?;
    let at = newest.at?;
    let days = [at.saturating_sub(1), at].map(|reading| problem.t[reading]);
    let missing = others.iter().find_map(|other| {
        let (driver, response) = (Driver::at(drivers, other.channel)?, other.response?);
        let unknown = |day: &f64| driver.gap_at(*day, response.mean_days).is_some();
        days.iter().any(unknown).then_some(driver)
    });
    let name = &missing?.name;
    Some(format!(
        "{name} is in the law and has no values then: what it did looks the same"
    ))
}

/// Whether the motion goes half of its whole way from one reading to the next, jumps of the reading left out.
pub(super) fn jumps_at_once(problem: &Problem, fitted: &Fitted) -> bool {
    let predicted = &fitted.prediction;
    if problem.quantity == Quantity::Velocity || predicted.len() < 2 {
        return false;
    }
    let is_offset = |i: usize| {
        let mut offsets = fitted.terms.iter().filter(|term| term.is_jump_of_reading());
        offsets.any(|term| term.at == Some(i))
    };
    let steps = (1..predicted.len()).filter(|i| !is_offset(*i));
    let steps: Vec<f64> = steps
        .map(|i| (predicted[i] - predicted[i - 1]).abs())
        .collect();
    let largest = steps.iter().copied().fold(0.0, f64::max);
    largest > 0.5 * steps.iter().sum::<f64>()
}

/// Errors over the later block without and with the new terms.
#[derive(Debug, Clone)]
pub(super) struct HeldOut {
    /// Index of the first reading of the block.
    pub(super) from: usize,
    pub(super) before: Fitted,
    pub(super) after: Fitted,
}

impl HeldOut {
    /// Of two fits of one law that one for both which is nearer to the readings before the block.
    pub(super) fn by_the_nearer(mut self) -> Self {
        if self.after.deviance < self.before.deviance {
            self.before.clone_from(&self.after);
        } else {
            self.after.clone_from(&self.before);
        }
        self
    }

    /// Root mean square errors over the block, mm or mm/day.
    pub(super) fn errors(&self, problem: &Problem) -> (f64, f64) {
        let range = self.from..problem.t.len();
        (
            self.before.rms(problem, range.clone()),
            self.after.rms(problem, range),
        )
    }

    /// Root mean square errors of what the readings of the block change by, each from the one before it, mm or mm/day: by
    /// how much the law had drifted until then counts once, and not again at every later reading.
    pub(super) fn errors_of_changes(&self, problem: &Problem) -> (f64, f64) {
        let of = |fitted: &Fitted| {
            let off = |i: usize| problem.y[i] - fitted.prediction[i];
            let squares = (self.from..problem.t.len()).map(|i| (off(i) - off(i - 1)).powi(2));
            (squares.sum::<f64>() / (problem.t.len() - self.from) as f64).sqrt()
        };
        (of(&self.before), of(&self.after))
    }
}

/// The block: the last `share` of the readings, or less where an event stands late: half of what follows it.
pub(super) fn block(problem: &Problem, terms: &[Term], share: f64) -> Option<usize> {
    let n = problem.t.len();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a count"
    )]
    let usual = ((1.0 - share) * n as f64).ceil() as usize;
    let latest = terms.iter().filter_map(|term| term.at).max().unwrap_or(0);
    let from = usual.max(latest + (n - latest) / 2);
    (from + FEWEST_HELD_OUT <= n && from >= 2 * FEWEST_HELD_OUT).then_some(from)
}

/// A later block for loads that answer to the motion, and grow with it to the end: half of what follows once they have
/// shown, and the last readings at least. `None` where there is no such load.
fn block_once_shown(problem: &Problem, fitted: &Fitted) -> Option<usize> {
    let n = problem.t.len();
    let each = fitted.terms.iter();
    let shown = each.filter_map(|term| shown(problem, fitted, term)).max()?;
    Some((shown + (n - shown) / 2).min(n.saturating_sub(FEWEST_HELD_OUT)))
}

/// The first reading at which a load that answers to the motion is half as large as it gets; `None` of other terms.
fn shown(problem: &Problem, fitted: &Fitted, term: &Term) -> Option<usize> {
    let grown: Vec<f64> = match term.act {
        Act::PerVelocity => fitted.velocity.clone(),
        Act::PerSlip => slips(&problem.t, &fitted.velocity),
        Act::Load(_)
        | Act::Step
        | Act::Reset
        | Act::Friction(_)
        | Act::Reading(_)
        | Act::Averaging => return None,
    };
    let most = grown.iter().copied().fold(0.0, f64::max);
    grown.iter().position(|size| *size >= 0.5 * most)
}

/// Fits both models without the block, by least squares: nothing of it is known to them but the covariates, the shape of
/// the response, and where a fit to all may start one. Where the newest term would be refused for what they predict, they are followed until they
/// have arrived. Where a load that answers to the motion cannot be learned before the block, because it had hardly acted, a later block is taken.
pub(super) fn held_out(
    problem: &Problem,
    Compared { before, after }: Compared<'_>,
    share: f64,
    scratch: &mut Scratch,
) -> Option<HeldOut> {
    let from = block(problem, &after.terms, share)?;
    let models = Compared { before, after };
    let mut usual = without_both(problem, models, from, best_of_starts, scratch);
    let newest = after.terms.last();
    let most = newest.map_or(1.0, |term| most_extrapolated(term.kind));
    let grows = |held: &HeldOut, most: f64| {
        let (before, after) = held.errors(problem);
        after.is_nan() || after > most * before
    };
    if usual.as_ref().is_none_or(|held| grows(held, most)) {
        let arrived = without_both(problem, models, from, best_of_all_starts, scratch);
        usual = arrived.or(usual);
    }
    if usual.as_ref().is_some_and(|held| !grows(held, 1.0)) {
        return usual;
    }
    let later = block_once_shown(problem, after).filter(|later| *later > from);
    let later =
        later.and_then(|later| without_both(problem, models, later, best_of_starts, scratch));
    later.or(usual)
}

/// Fits without the readings from `from` on, from many starts.
type FitFromStarts = fn(&Problem, &[Start], &mut Scratch) -> Option<Fitted>;

fn without_both(
    problem: &Problem,
    Compared { before, after }: Compared<'_>,
    from: usize,
    fit: FitFromStarts,
    scratch: &mut Scratch,
) -> Option<HeldOut> {
    let mut without = |fitted: &Fitted| {
        let (part, starts) = starts_without_block(problem, fitted, from);
        fit(&part, &starts, scratch)
    };
    Some(HeldOut {
        from,
        before: without(before)?,
        after: without(after)?,
    })
}

/// The law with the terms of `fitted` by least squares from fresh starts and from there, without the readings from `from`
/// on.
pub(super) fn without_block(
    problem: &Problem,
    fitted: &Fitted,
    from: usize,
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let (part, starts) = starts_without_block(problem, fitted, from);
    best_of_starts(&part, &starts, scratch)
}

/// The same from each of the starts, followed until it has arrived: of two laws that predict much the same the one must not seem the better
/// for where its fit stopped.
pub(super) fn arrived_without_block(
    problem: &Problem,
    fitted: &Fitted,
    from: usize,
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let (part, starts) = starts_without_block(problem, fitted, from);
    best_of_all_starts(&part, &starts, scratch)
}

fn starts_without_block(problem: &Problem, fitted: &Fitted, from: usize) -> (Problem, Vec<Start>) {
    let part = problem.trained_on(from);
    let mut starts = fresh_starts(&part, &fitted.terms);
    starts.push(in_units_of(&part, problem, fitted));
    (part, starts)
}

/// The later block predicted reading after reading, each from those before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepErrors {
    /// Root mean square errors, mm or mm/day.
    pub(super) before: f64,
    pub(super) after: f64,
    /// How much worse it is predicted with the terms, in -2 ln likelihood.
    pub(super) deviance: f64,
}

impl StepErrors {
    /// Whether an error is one of a law that follows the readings: it is no larger than all that they range over. One that nearly fails
    /// answers so strongly to what it has just read that its next reading may be predicted to be anything.
    pub(super) fn is_a_figure(problem: &Problem, error: f64) -> bool {
        error <= problem.range()
    }
}

/// The later block by its innovations, without and with the newest terms of `after`, their coefficients as they were learned
/// before the block. The law itself is fitted to all readings on both sides: its own extrapolation is not what is in
/// question. `None` where it cannot be fitted.
pub(super) fn step_errors(
    problem: &Problem,
    Compared { before, after }: Compared<'_>,
    from: usize,
    newest: usize,
    scratch: &mut Scratch,
) -> Option<StepErrors> {
    let part = problem.trained_on(from);
    let known = [Whitener::new(
        &part,
        noise_in_units_of(&part, problem, after.noise),
    )];
    let early = refit(&part, &in_units_of(&part, problem, after), &known, scratch)?;
    let early = in_units_of(problem, &part, &early);
    let newest = &after.terms[after.terms.len() - newest..];
    let learned: usize = newest.iter().map(Term::coefficients).sum();
    let errors = |fitted: &Fitted| {
        let whitener = Whitener::new(problem, fitted.noise);
        let residual = fitted.residual(problem);
        let deviance = whitener.deviance_from(&residual, from, fitted.sigma);
        (whitener.step_errors_from(&residual, from), deviance)
    };
    let without = errors(before);
    let own = under_learned(problem, after, &early.parameters, learned, scratch);
    let mut with = own.as_ref().map(errors);
    let is_worse = with.is_none_or(|with| with.0 > without.0 || with.1 > without.1);
    if is_worse && before.noise != after.noise {
        // Noise that follows the readings makes up for an effect that is a little too large or too small: both may have it.
        let alike = Fitted {
            noise: before.noise,
            ..after.clone()
        };
        let alike = under_learned(problem, &alike, &early.parameters, learned, scratch);
        let each = with.into_iter().chain(alike.as_ref().map(errors));
        with = each.min_by(|a, b| a.1.total_cmp(&b.1));
    }
    let with = with?;
    Some(StepErrors {
        before: without.0,
        after: with.0,
        deviance: with.1 - without.1,
    })
}

/// The law fitted to all readings under the last `learned` of the parameters that a part of them gave: from the law of that part, and
/// from that of all, its own coefficients moved there step by step, because a law that nearly fails may fail at once under
/// others.
fn under_learned(
    problem: &Problem,
    after: &Fitted,
    early: &[f64],
    learned: usize,
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let whole = [Whitener::new(problem, after.noise)];
    let law = after.parameters.len() - learned;
    let (own, learned_there) = (&after.parameters[law..], &early[law..]);
    let mut under = |parameters: &[f64], coefficients: &[f64]| {
        let start = Start {
            frozen: coefficients.len(),
            parameters: [&parameters[..law], coefficients].concat(),
            ..Start::at(after)
        };
        refit(problem, &start, &whole, scratch)
    };
    let at_once = under(early, learned_there);
    let moved = (1..=MOVES).try_fold(after.clone(), |there, k| {
        let share = f64::from(k) / f64::from(MOVES);
        let both = own.iter().zip(learned_there);
        let coefficients: Vec<f64> = both.map(|(own, to)| own + share * (to - own)).collect();
        under(&there.parameters, &coefficients)
    });
    likeliest(problem, at_once.into_iter().chain(moved))
}

/// A start at a fit to a part of the readings, or to all, in the units of `next`: coefficients of what answers to the
/// motion are in units of the usual velocity.
fn in_units_of(next: &Problem, known: &Problem, fitted: &Fitted) -> Start {
    let faster = next.typical_velocity() / known.typical_velocity();
    let mut start = Start::at(fitted);
    let mut from = law_parameters(known);
    for term in &fitted.terms {
        let own = &mut start.parameters[from..from + term.coefficients()];
        if matches!(term.act, Act::PerVelocity | Act::PerSlip) {
            for one in own {
                *one *= faster;
            }
        }
        from += term.coefficients();
    }
    start.noise = noise_in_units_of(next, known, fitted.noise);
    start
}

/// The same noise in the units of `next`: that of a load is in units of the usual velocity.
fn noise_in_units_of(next: &Problem, known: &Problem, noise: Noise) -> Noise {
    if noise.memory != Memory::Load {
        return noise;
    }
    Noise {
        ratio: noise.ratio * next.typical_velocity() / known.typical_velocity(),
        ..noise
    }
}

/// What a term is called: its kind, and its channel where there is one.
pub(super) fn named(term: &Term, drivers: &[Driver]) -> Rival {
    let channel = Driver::at(drivers, term.channel);
    Rival {
        kind: term.kind,
        channel: channel.map(|driver| driver.name.clone()),
    }
}

/// Where the coefficients of the term of that index stand among the parameters.
pub(super) fn coefficients<'a>(problem: &Problem, fitted: &'a Fitted, index: usize) -> &'a [f64] {
    &fitted.parameters[coefficients_of(problem, &fitted.terms, index)]
}

/// Those of the newest term; none where there is none.
pub(super) fn newest_coefficients(fitted: &Fitted) -> &[f64] {
    let count = fitted.terms.last().map_or(0, Term::coefficients);
    &fitted.parameters[fitted.parameters.len() - count..]
}

#[cfg(test)]
mod tests;
