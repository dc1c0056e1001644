//! Between what values the gain of a covariate may lie: how far it can be moved, with the law, all other effects and its own delay free, before
//! the law misses the readings by more than 90 % of the cases in which that is its gain.

use super::act::Act;
use super::backward::start_without;
use super::candidates::with_response;
use super::judge::coefficients;
use super::noise::Whitener;
use super::prior::Prior;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::{Fitted, Start, jacobian, towards};
use super::response::{Driver, Response};
use super::term::{Scratch, Term, coefficients_of};
use crate::reading::CHI_SQUARED_90;

/// 90 % quantile of chi squared with one degree of freedom, and how near to it a bound is looked for.
const DROP: f64 = CHI_SQUARED_90;
const NEAR: f64 = 0.3;
/// Most steps of one refit, which begins at that of a gain nearby, and most gains that are tried on one side.
const STEPS: usize = 8;
const MOST_GAINS: usize = 6;
/// By so much of its ln a delay is moved to see what that changes, and the most that it is moved to the best one at a gain.
const NUDGE: f64 = 0.15;
const FARTHEST: f64 = 0.45;
/// A bound is looked for no farther than so many times as far as the straight line has it.
const UNLIKE: f64 = 8.0;

/// The misfit over the gain of one covariate, whose term is the last.
struct GainProfile<'a> {
    ready: &'a Ready,
    whitener: &'a Whitener,
    start: Start,
    least: f64,
}

/// Bounds of 90 % of the gain of a term, which has one coefficient, under the noise in force; `None` of other terms, and where the readings leave
/// it open.
pub(super) fn interval(
    ready: &Ready,
    full: &Fitted,
    index: usize,
    scratch: &mut Scratch,
) -> Option<[f64; 2]> {
    let gain = *coefficients(&ready.problem, full, index).first()?;
    let whitener = ready.bank.iter().find(|one| one.noise == full.noise)?;
    let start = with_last(ready, full, index)?;
    let deviation = deviation(&ready.problem, full, whitener, (index, scratch))?;
    let mut profile = GainProfile {
        ready,
        whitener,
        start: start.clone(),
        least: 0.0,
    };
    (profile.start, profile.least) = profile.at(&start, gain, scratch)?;
    let by = DROP.sqrt() * deviation;
    let low = profile.bound(gain, -by, scratch)?;
    let high = profile.bound(gain, by, scratch)?;
    Some([low, high])
}

/// `full` as a start, the term of that index the last, its coefficient held; `None` where it has several.
fn with_last(ready: &Ready, full: &Fitted, index: usize) -> Option<Start> {
    let problem = &ready.problem;
    let term = full.terms[index].clone();
    let [gain] = *coefficients(problem, full, index) else {
        return None;
    };
    let mut start = start_without(problem, full, index);
    if let Some(before) = what_gathered_before(ready, &term) {
        start = start.with_size(&before, 0.0);
    }
    Some(Start {
        frozen: 1,
        ..start.with_size(&term, gain)
    })
}

/// What more of what had gathered before its covariate's first value changes in `term`, as a term of its own; `None` where that was not fitted.
fn what_gathered_before(ready: &Ready, term: &Term) -> Option<Term> {
    let own = term.response.filter(|own| own.before != 0.0)?;
    let driver = Driver::at(&ready.drivers, term.channel)?;
    let more = Response {
        before: own.before + driver.spread(),
        ..own
    };
    let more = with_response(&ready.problem, term, driver, more)?;
    let (Act::Load(own), Act::Load(more)) = (&term.act, more.act) else {
        return None;
    };
    let both = own.first()?.iter().zip(more.first()?);
    Some(Term {
        response: None,
        act: Act::Load(vec![both.map(|(own, more)| more - own).collect()]),
        ..term.clone()
    })
}

/// Standard deviation of a term's coefficient by the law linearised, all others free.
fn deviation(
    problem: &Problem,
    full: &Fitted,
    whitener: &Whitener,
    (index, scratch): (usize, &mut Scratch),
) -> Option<f64> {
    let mut columns = jacobian(problem, full, scratch);
    let own = columns.remove(coefficients_of(problem, &full.terms, index).start);
    let frame = super::frame::Frame::new(whitener.clone(), &own, &columns);
    let deviation = full.sigma / frame.misfit.sqrt();
    deviation.is_finite().then_some(deviation)
}

impl GainProfile<'_> {
    /// The gain on the side of `by` at which the misfit has grown by [`DROP`], which the straight line has at `gain + by`; `None` where
    /// none was tried at which it has.
    fn bound(&self, gain: f64, by: f64, scratch: &mut Scratch) -> Option<f64> {
        let (mut inside, mut outside) = ((0.0, 0.0), None::<(f64, f64)>);
        let mut nearest = self.start.clone();
        let mut away = 1.0;
        for _ in 0..MOST_GAINS {
            let there = self.at(&nearest, gain + away * by, scratch);
            let root = there
                .as_ref()
                .map(|(_, misfit)| (misfit - self.least).max(0.0).sqrt());
            match (there, root) {
                (Some((start, _)), Some(root)) if root * root <= DROP => {
                    (inside, nearest) = ((away, root), start);
                }
                (_, root) => outside = Some((away, root.unwrap_or(f64::INFINITY))),
            }
            if root.is_some_and(|root| (root * root - DROP).abs() < NEAR) {
                return Some(gain + away * by);
            }
            away = next(inside, outside);
            if away > UNLIKE {
                break;
            }
        }
        outside.map(|(outside, _)| gain + f64::midpoint(inside.0, outside) * by)
    }

    /// The best law with that gain, its delay free, as a start, and its misfit.
    fn at(&self, nearest: &Start, gain: f64, scratch: &mut Scratch) -> Option<(Start, f64)> {
        let mut start = nearest.clone();
        *start.parameters.last_mut()? = gain;
        let (here, misfit) = self.misfit(&start, scratch)?;
        let centre = here.clone();
        let mut moved = |by: f64| {
            let start = self.delayed(&centre, by)?;
            self.misfit(&start, scratch)
        };
        let Some((shorter, longer)) = moved(-NUDGE).zip(moved(NUDGE)) else {
            return Some((here, misfit));
        };
        let (slope, bend) = (longer.1 - shorter.1, longer.1 - 2.0 * misfit + shorter.1);
        let best = if bend > 0.0 {
            (-0.5 * slope / bend * NUDGE).clamp(-FARTHEST, FARTHEST)
        } else {
            -FARTHEST.copysign(slope)
        };
        let each = [
            Some((here, misfit)),
            Some(shorter),
            Some(longer),
            moved(best),
        ];
        each.into_iter()
            .flatten()
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The law fitted from there, and its misfit.
    fn misfit(&self, start: &Start, scratch: &mut Scratch) -> Option<(Start, f64)> {
        let problem = &self.ready.problem;
        let there = towards(problem, start, self.whitener, (STEPS, scratch))?;
        let prior = Prior::of(problem, &there.terms).misfit(&there.parameters);
        let start = Start {
            frozen: start.frozen,
            ..Start::at(&there)
        };
        Some((start, there.deviance + prior))
    }

    /// The same with the delay of the last term e^`by` times as long; `None` where it has none.
    fn delayed(&self, start: &Start, by: f64) -> Option<Start> {
        let term = start.terms.last()?;
        let own = term.response.filter(|own| own.mean_days > 0.0)?;
        let other = Response {
            mean_days: own.mean_days * by.exp(),
            ..own
        };
        let driver = Driver::at(&self.ready.drivers, term.channel)?;
        let other = with_response(&self.ready.problem, term, driver, other)?;
        let mut start = start.clone();
        *start.terms.last_mut()? = other;
        Some(start)
    }
}

/// Where to look next for the bound, by the farthest (times the step, root of the misfit) that is inside and the nearest outside.
fn next(inside: (f64, f64), outside: Option<(f64, f64)>) -> f64 {
    let target = DROP.sqrt();
    let Some(outside) = outside else {
        let farther = target / inside.1.max(target / UNLIKE);
        return inside.0 * farther.clamp(1.1, 2.5);
    };
    let share = (target - inside.1) / (outside.1 - inside.1);
    let share = if share.is_finite() {
        share.clamp(0.1, 0.9)
    } else {
        0.5
    };
    let share = if outside.1.is_infinite() { 0.5 } else { share };
    inside.0 + share * (outside.0 - inside.0)
}

#[cfg(test)]
mod tests {
    use super::super::candidates::in_load;
    use super::super::fixture::{channel, daily, generator, lake, normals, series};
    use super::super::fresh::plain_starts;
    use super::super::kind::{Form, Kind};

    use super::*;
    use crate::reading::Quantity;

    const DAYS: usize = 200;
    /// Steps of a day in which the slope is moved.
    const STEPS_A_DAY: usize = 20;

    /// What comes of a lake's daily level after a mean delay of so many days, at each step, less its mean and over its deviation.
    fn after(level: &[f64], mean_days: f64) -> Vec<f64> {
        let kept = (-1.0 / (STEPS_A_DAY as f64 * mean_days)).exp();
        let mut passed = level[0];
        let each = (0..(level.len() - 1) * STEPS_A_DAY).map(|step| {
            let (day, share) = (
                step / STEPS_A_DAY,
                (step % STEPS_A_DAY) as f64 / STEPS_A_DAY as f64,
            );
            let now = level[day] + share * (level[day + 1] - level[day]);
            passed = kept * passed + (1.0 - kept) * now;
            passed
        });
        let each: Vec<f64> = each.collect();
        let count = each.len() as f64;
        let mean = each.iter().sum::<f64>() / count;
        let square = each.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / count;
        each.iter()
            .map(|one| (one - mean) / square.sqrt())
            .collect()
    }

    /// Bounds of a gain of .4 on a slope of 1 mm/day, and what was fitted.
    fn bounds(seed: u64) -> Option<([f64; 2], f64)> {
        let days = daily(DAYS);
        let random = &mut generator(seed);
        let level: Vec<f64> = lake(&days)
            .iter()
            .zip(normals(random, DAYS))
            .map(|(level, noise)| level + 0.5 * noise)
            .collect();
        let noise = normals(random, DAYS);
        let load = after(&level, 6.0);
        let mut moved = 0.0;
        let values = noise.into_iter().enumerate().map(|(day, noise)| {
            let passed = day.saturating_sub(1) * STEPS_A_DAY..day * STEPS_A_DAY;
            let steps = load[passed].iter().map(|load| (0.4 * load).exp());
            moved += steps.sum::<f64>() / STEPS_A_DAY as f64;
            moved + 0.3 * noise
        });
        let values: Vec<f64> = values.collect();
        let series = series(Quantity::Displacement, &days, &values);
        let channels = [channel("lake_level_m", &days, &level)];
        let ready = Ready::of(&series, &channels, &mut Vec::new())?;
        let response = Response {
            form: Form::Level,
            stages: 1,
            mean_days: 5.0,
            before: 0.0,
        };
        let term = in_load(
            &ready.problem,
            Kind::HYDROLOGICAL,
            &ready.drivers[0],
            response,
        )?;
        let start = plain_starts(&ready.problem).remove(0).with_size(&term, 0.1);
        let white = ready
            .bank
            .iter()
            .find(|one| one.noise == super::super::noise::Noise::WHITE)?;
        let scratch = &mut Scratch::default();
        let full = towards(&ready.problem, &start, white, (20, scratch))?;
        let fitted = *coefficients(&ready.problem, &full, 0).first()?;
        Some((interval(&ready, &full, 0, scratch)?, fitted))
    }

    #[test]
    fn nine_tenths_of_the_bounds_hold_the_gain_though_the_delay_is_not_known() {
        let each: Vec<([f64; 2], f64)> = (0..40).filter_map(bounds).collect();
        assert_eq!(each.len(), 40);
        let holding = each
            .iter()
            .filter(|([low, high], _)| (*low..=*high).contains(&0.4));
        let count = holding.count();
        assert!((33..=40).contains(&count), "{count} of 40: {each:?}");
        for ([low, high], fitted) in &each {
            assert!(
                *low > 0.38 && *high < 0.42 && low < fitted && fitted < high,
                "{each:?}"
            );
        }
    }

    #[test]
    fn the_next_gain_lies_between_one_that_is_inside_and_one_that_is_outside() {
        let away = next((1.0, 1.2), Some((2.0, 2.4)));
        assert!((1.1..1.9).contains(&away), "{away}");
        assert!((next((1.0, 1.2), Some((2.0, f64::INFINITY))) - 1.5).abs() < 1e-9);
        assert!(next((1.0, 0.0), None) > 2.0);
    }
}
