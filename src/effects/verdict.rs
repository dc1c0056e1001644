//! From what a search accepted to what is said: the verdict, what stands beside it, and how much is explained.

use super::act::Act;
use super::daily;
use super::dated;
use super::definition::{EffectSize, FittedCoefficients};
use super::diagnosis::{Judged, innovations, newest_off};
use super::explanation::{Candidate, Effect, Explained};
use super::gain_interval;
use super::judge::{WithoutAny, coefficients, named};
use super::kind::Kind;
use super::noise::{Memory, Whitener};
use super::options::Options;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::{Fitted, Start, refit, under_likeliest};
use super::response::Driver;
use super::rival::Rival;
use super::search::{Accepted, SIGNIFICANT, SearchResult};
use super::term::{Scratch, Term, law_parameters, time_of};
use super::velocity_factor;
use super::whole::is_worse_than_none;
use crate::reading::{Quantity, Unit};

/// What the search is concluded to mean.
pub(super) struct Verdict {
    pub(super) effects: Vec<Effect>,
    pub(super) explained: Explained,
    pub(super) cannot_separate_from: Vec<Rival>,
    /// The law with the effects that stand.
    pub(super) full: Fitted,
}

/// Explained in full, the residual is at most this many times the white noise.
pub(super) const LARGEST_REST: f64 = 2.0;
/// A kind without independent evidence stands beside something left where it gains this many times the margin and the later block is
/// predicted with no more than this share of the error.
const STANDING_OUT: f64 = 30.0;
const FAR_BETTER: f64 = 0.1;
/// So does a jump of the velocity that gains this many times the margin where, so many readings earlier or later, it would
/// gain less by so many times the margin: what is left is another matter, and no slow load looks like that.
const SHARP: f64 = 4.0;
const APART: usize = 3;
const LOSES: f64 = 2.0;
/// By so much of the BIC noise that a reading remembers is distinguished from an undeclared load. Set on simulated slopes: at the
/// margin of the search 6 of 100 with such noise were said to lack a load, and 1 of 100 under such a load is called noise since.
const ALIKE: f64 = 3.0;
/// So many standard deviations off, the last innovations are not noise's.
const OUT_OF_NOISE: f64 = 5.0;
/// Most kinds without independent evidence that are accepted together.
const MOST_LABELS: usize = 2;
/// Steps of a finite length pass a failure: the law fails where it is so many times faster than it ever was with all its effects.
const RUNS_AWAY: f64 = 30.0;

/// Concludes: a kind without independent evidence stands as the verdict only if nothing is left unexplained after it.
pub(super) fn conclude(
    ready: &Ready,
    found: &mut SearchResult,
    options: &Options,
    scratch: &mut Scratch,
) -> Verdict {
    let (problem, margin) = (&ready.problem, options.bic_margin);
    let mut full = found.full.clone();
    let mut accepted = found.accepted.clone();
    let mut judged = Judged::of(problem, &full, &ready.bank, scratch);
    let load_gain = judged.as_ref().map_or(0.0, Judged::load_gain);
    let mut left = found.has_slow_load || found.is_daily || load_gain > margin;
    let only_labels =
        !accepted.is_empty() && full.terms.iter().all(|term| term.kind.fits_any_bend());
    let mut cannot_separate_from = Vec::new();
    let is_whole = !left && accounts_for_all(problem, &full);
    if only_labels && !is_whole {
        left = true;
        let (stays, kept) = what_stands(ready, found, &full, options, scratch);
        for (index, term) in full.terms.iter().enumerate() {
            if !kept.contains(&index) {
                cannot_separate_from.push(named(term, &ready.drivers));
                refuse(&mut found.candidates, problem, term);
            }
        }
        accepted = kept.iter().map(|index| accepted[*index].clone()).collect();
        full = stays;
        judged = Judged::of(problem, &full, &ready.bank, scratch);
    }
    let ties = accepted.iter().flat_map(|how| how.ties.iter().cloned());
    cannot_separate_from.extend(ties);
    let mut effects = effects_of(ready, &full, &accepted, scratch);
    if found.has_slow_load || effects.is_empty() {
        cannot_separate_from.append(&mut found.may_have_acted);
    }
    left |= effects.is_empty() && refused(&found.candidates, margin);
    let memory_gain = judged.as_ref().map_or(0.0, Judged::memory_gain);
    let remembers = memory_gain > margin && may_remember(&full);
    if remembers && !left && effects.is_empty() {
        // A slow load that nothing declares leaves what remembers as well.
        if judged
            .as_ref()
            .is_some_and(|one| is_a_motion_alike(problem, &full, one))
        {
            left = true;
            cannot_separate_from.push(Rival::from(Kind::CORRELATED_NOISE));
        } else if full.noise.memory == Memory::Load {
            full = under_memory_of_readings(ready, &full, scratch).unwrap_or(full);
        }
    }
    if found.is_daily && effects.is_empty() {
        cannot_separate_from.push(Rival::from(Kind::TIDE));
        cannot_separate_from.extend(daily::rivals());
    }
    let cannot_separate_from = separate(cannot_separate_from, &effects);
    // Another channel, or a load that nothing measures, would explain as much: what is found is not all that may have acted.
    let is_other = |one: &Rival| one.channel.is_some() || one.kind == Kind::UNEXPLAINED;
    let is_alone = !cannot_separate_from.iter().any(is_other);
    if remembers && !left {
        effects.push(correlated(ready.unit, &full, memory_gain));
    }
    let explained = match (effects.is_empty(), left || !is_alone) {
        (false, false) => Explained::Full,
        (false, true) => Explained::Partly,
        (true, _) => Explained::None,
    };
    let end = if left { Kind::UNEXPLAINED } else { Kind::NONE };
    if effects.is_empty() {
        effects.push(Effect::of(end));
    }
    Verdict {
        effects,
        explained,
        cannot_separate_from,
        full,
    }
}

/// The terms of the law as effects, what independent data support first.
fn effects_of(
    ready: &Ready,
    full: &Fitted,
    accepted: &[Accepted],
    scratch: &mut Scratch,
) -> Vec<Effect> {
    let each = accepted.iter().enumerate();
    let each = each.map(|(index, how)| Effect {
        at_interval: dated::interval(ready, full, index, scratch),
        ..effect(ready, full, index, how, scratch)
    });
    let mut effects: Vec<Effect> = each.collect();
    effects.sort_by_key(|effect| effect.effect.fits_any_bend());
    effects
}

/// Each rival once, without what was accepted beside it in the end.
fn separate(rivals: Vec<Rival>, effects: &[Effect]) -> Vec<Rival> {
    let mut each: Vec<Rival> = Vec::new();
    for rival in rivals {
        let is_accepted = effects
            .iter()
            .any(|one| one.effect == rival.kind && one.channel == rival.channel);
        if !is_accepted && !each.contains(&rival) {
            each.push(rival);
        }
    }
    each
}

/// Whether noise that the reading remembers may be what a fit left. With no effect in the law, a load in its noise may be that too.
fn may_remember(full: &Fitted) -> bool {
    match full.noise.memory {
        Memory::Reading => true,
        Memory::Load => full.terms.is_empty(),
        Memory::None => false,
    }
}

/// Whether an undeclared load leaves what remembers about as well as noise of the reading does.
fn is_a_load_alike(judged: &Judged) -> bool {
    judged.load.is_some() && judged.load_gain() > -ALIKE
}

/// Whether noise that the reading remembers would be no better an account than a motion is: an undeclared load leaves what remembers as
/// well, or the record ends with readings to which that noise does not lead either, as what has just begun to move does.
fn is_a_motion_alike(problem: &Problem, full: &Fitted, judged: &Judged) -> bool {
    let newest = newest_off(&innovations(problem, full, judged.plain));
    is_a_load_alike(judged) || newest > OUT_OF_NOISE
}

/// Whether something was refused that gains what is asked for and that noise does not do: then it is not the explanation, and something
/// is left all the same.
fn refused(candidates: &[Candidate], margin: f64) -> bool {
    candidates.iter().any(|one| {
        one.rejected_because.is_some()
            && one.bic_gain >= margin
            && one.p_value.is_some_and(|p| p < SIGNIFICANT)
    })
}

/// The same law under noise that the reading remembers.
fn under_memory_of_readings(ready: &Ready, full: &Fitted, scratch: &mut Scratch) -> Option<Fitted> {
    let problem = &ready.problem;
    let own = ready
        .bank
        .iter()
        .filter(|one| one.noise.memory == Memory::Reading);
    let own: Vec<Whitener> = own.cloned().collect();
    let start = under_likeliest(problem, full, &own, scratch);
    refit(problem, &start, &own, scratch)
}

/// Whether kinds without independent evidence leave no more than noise, and are few: enough events, one after the other, follow
/// any load there is.
fn accounts_for_all(problem: &Problem, full: &Fitted) -> bool {
    let rest = full.rms(problem, 0..problem.used);
    let small = match problem.quantity {
        Quantity::Displacement => rest <= LARGEST_REST * full.sigma,
        // Velocities have noise of several sizes.
        Quantity::Velocity => true,
    };
    let most = if full.noise.memory == Memory::None {
        MOST_LABELS
    } else {
        1
    };
    small && full.terms.len() <= most
}

/// Whether one kind without independent evidence is alone, gains many times the margin, and predicts the later block far better than
/// the law without it: then it stands although something is left beside it.
fn stands_out(full: &Fitted, candidates: &[Candidate], margin: f64) -> bool {
    let mut accepted = candidates
        .iter()
        .filter(|one| one.rejected_because.is_none());
    let (Some(one), None) = (accepted.next(), accepted.next()) else {
        return false;
    };
    let predicts = one.held_out.is_some_and(|ratio| ratio < FAR_BETTER);
    full.terms.len() == 1 && predicts && one.bic_gain > STANDING_OUT * margin
}

/// The law with those of the terms of `full` that stand beside what is left, all of them without independent evidence, and which
/// these are.
fn what_stands(
    ready: &Ready,
    found: &SearchResult,
    full: &Fitted,
    options: &Options,
    scratch: &mut Scratch,
) -> (Fitted, Vec<usize>) {
    let (problem, margin) = (&ready.problem, options.bic_margin);
    if stands_out(full, &found.candidates, margin) {
        // What is left is little beside it.
        return (full.clone(), vec![0]);
    }
    let laws = WithoutAny {
        plain: &found.plain,
        null: &found.null,
    };
    let share = options.held_out_share;
    let sharp = sharp_alone(ready, full, &found.accepted, margin, scratch);
    // Without the others they may predict the later block worse than none does.
    let sharp =
        sharp.filter(|(stays, _)| !is_worse_than_none(problem, laws, stays, share, scratch));
    sharp.unwrap_or_else(|| (found.null.clone(), Vec::new()))
}

/// The law with those of the accepted terms alone that are jumps of the velocity, few, and each known to within a few readings,
/// and which of the terms they are; `None` where there are none.
fn sharp_alone(
    ready: &Ready,
    full: &Fitted,
    accepted: &[Accepted],
    margin: f64,
    scratch: &mut Scratch,
) -> Option<(Fitted, Vec<usize>)> {
    let problem = &ready.problem;
    let is_large = |index: &usize| accepted[*index].bic_gain > SHARP * margin;
    let sharp = (0..full.terms.len()).filter(is_large);
    let sharp: Vec<usize> = sharp
        .filter(|index| is_sharp(ready, full, *index, margin, scratch))
        .collect();
    if sharp.is_empty() || sharp.len() > MOST_LABELS {
        return None;
    }
    if sharp.len() == full.terms.len() {
        return Some((full.clone(), sharp));
    }
    let law = full.parameters[..law_parameters(problem)].to_vec();
    let mut start = Start {
        parameters: law,
        terms: Vec::new(),
        ..Start::at(full)
    };
    for index in &sharp {
        start.terms.push(full.terms[*index].clone());
        let own = coefficients(problem, full, *index);
        start.parameters.extend(own);
    }
    Some((refit(problem, &start, &ready.bank, scratch)?, sharp))
}

/// Whether a term is a jump of the velocity that a few readings earlier, or later, would gain far less.
fn is_sharp(
    ready: &Ready,
    full: &Fitted,
    index: usize,
    margin: f64,
    scratch: &mut Scratch,
) -> bool {
    let problem = &ready.problem;
    let term = &full.terms[index];
    let inside = |at: &usize| term.kind.jumps() && *at > APART && at + APART < problem.used;
    let Some(at) = term.at.filter(inside) else {
        return false;
    };
    let own = ready.bank.iter().filter(|one| one.noise == full.noise);
    let own: Vec<Whitener> = own.cloned().collect();
    let mut loses = |at: usize| {
        let mut start = Start::at(full);
        start.terms[index].at = Some(at);
        let there = refit(problem, &start, &own, scratch);
        there.is_none_or(|there| there.bic(problem) > full.bic(problem) + LOSES * margin)
    };
    loses(at - APART) && loses(at + APART)
}

/// Refuses what was accepted as this term.
fn refuse(candidates: &mut [Candidate], problem: &Problem, term: &Term) {
    let at = time_of(problem, term);
    let own = candidates
        .iter_mut()
        .filter(|one| one.effect == term.kind && one.at == at && one.rejected_because.is_none());
    for one in own {
        one.rejected_because = Some(
            "structure is left after it, and it can follow almost any bend: no explanation"
                .to_owned(),
        );
    }
}

/// Noise that the reading remembers, as an effect that brings `bic_gain`.
fn correlated(unit: Unit, full: &Fitted, bic_gain: f64) -> Effect {
    let noise = full.noise;
    Effect {
        memory_days: noise.memory_days(),
        size: Some(noise.remembered() * full.sigma / unit.factor()),
        unit: Some(unit.to_string()),
        bic_gain,
        ..Effect::of(Kind::CORRELATED_NOISE)
    }
}

/// Everything known of one term of the law.
pub(super) fn effect(
    ready: &Ready,
    full: &Fitted,
    index: usize,
    how: &Accepted,
    scratch: &mut Scratch,
) -> Effect {
    let problem = &ready.problem;
    let term = &full.terms[index];
    let own = coefficients(problem, full, index);
    let channel = Driver::at(&ready.drivers, term.channel).map(|driver| driver.name.clone());
    let factor = ready.unit.factor();
    let size = size(ready, term, own);
    let mut said = Effect {
        channel,
        form: term.response.map(|response| response.form),
        p_value: Some(how.p_value),
        lag_days: term.response.map(|response| response.mean_days),
        memory_days: term.response.map(|response| response.memory_days()),
        at: time_of(problem, term),
        bic_gain: how.bic_gain,
        contribution_rms: rms(&contribution(problem, full, index, scratch))
            // A law that nearly fails without it has no prediction to be compared with either.
            .filter(|added| *added <= problem.range())
            .map(|added| added / factor),
        gain_per_sd: size.gain_per_sd,
        period_days: size.period_days,
        size: size.size,
        unit: size.unit,
        ..Effect::of(term.kind)
    };
    if said.gain_per_sd.is_some() {
        let scale = if matches!(term.act, Act::Reading(_)) {
            factor
        } else {
            1.0
        };
        let bounds = gain_interval::interval(ready, full, index, scratch);
        said.velocity_factor_per_sd = velocity_factor::per_sd(problem, full, index, scratch);
        said.gain_interval = bounds.map(|bounds| bounds.map(|bound| bound / scale));
    }
    if term.at.is_some() && said.size.is_some() {
        let bounds = gain_interval::interval(ready, full, index, scratch);
        said.size_interval = bounds.and_then(|bounds| sizes(ready, term, bounds));
        said.velocity_factor = velocity_factor::since_event(problem, full, index, scratch);
    }
    said
}

/// What the bounds of an event's one coefficient are as its size, the lower first.
fn sizes(ready: &Ready, term: &Term, bounds: [f64; 2]) -> Option<[f64; 2]> {
    let [one, other] = bounds.map(|bound| size(ready, term, &[bound]).size);
    let (one, other) = (one?, other?);
    Some([one.min(other), one.max(other)])
}

/// Gain, size, period, as the kind has them.
fn size(ready: &Ready, term: &Term, values: &[f64]) -> EffectSize {
    let problem = &ready.problem;
    let fitted = FittedCoefficients {
        values,
        unit: ready.unit,
        typical_mm_per_day: problem.typical_velocity(),
        span_days: problem.whole_span(),
        spacing_days: problem.spacing,
    };
    (term.kind.definition().size)(&fitted)
}

/// What a term adds to the prediction of every reading: with it, less without. Not a number where the law without it fails within
/// the record: there it has no prediction to be compared with.
pub(super) fn contribution(
    problem: &Problem,
    full: &Fitted,
    index: usize,
    scratch: &mut Scratch,
) -> Vec<f64> {
    let without = full.parameters_without(problem, index);
    let goes_on = scratch.predict(problem, &full.terms, &without);
    let most = RUNS_AWAY * full.velocity.iter().copied().fold(0.0, f64::max);
    if !goes_on || scratch.driven.velocity.iter().any(|v| *v > most) {
        return vec![f64::NAN; problem.t.len()];
    }
    let both = full.prediction.iter().zip(&scratch.prediction);
    both.map(|(with, without)| with - without).collect()
}

fn rms(values: &[f64]) -> Option<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    square.is_finite().then(|| square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::fixture::steady;
    use super::*;

    /// A law that speeds up over a hundred days, slowed by a load that steps down by so many e-folds before day 40.
    fn slowed(by: f64) -> (Problem, Fitted) {
        let days: Vec<f64> = (0..100).map(f64::from).collect();
        let problem = steady(Quantity::Displacement, &days, 1);
        let term = super::super::candidates::once(Kind::LOAD_STEP, 40)
            .next()
            .unwrap();
        // Fails after some two thirds of the record where nothing slows it.
        let law = vec![0.0, 1.5, -3.0, 0.0, 0.0];
        let start = Start::of_law(law).with_size(&term, -by);
        let white = Whitener::new(&problem, start.noise);
        let scratch = &mut Scratch::default();
        let fitted = super::super::refit::towards(&problem, &start, &white, (0, scratch));
        (problem, fitted.unwrap())
    }

    #[test]
    fn what_a_term_adds_to_a_law_that_fails_without_it_is_no_number() {
        let (problem, full) = slowed(3.0);
        let added = contribution(&problem, &full, 0, &mut Scratch::default());
        assert!(added.iter().all(|value| value.is_nan()));
        assert_eq!(rms(&added), None);
    }
}
