//! The delay of a covariate's response, free beside the law and the gain. One after the other they stay where they are: with another delay the
//! readings ask for another law, and each alone makes the fit worse.

use super::act::Act;
use super::candidates::with_response;
use super::fresh::{AT_ONCE, fresh_laws};
use super::noise::{Noise, Whitener};
use super::refit::{Fitted, Start, likeliest, refit};
use super::response::{Driver, Response};
use super::search::{Refitted, Search};
use super::term::{Term, coefficients_of};

/// Most steps of Gauss and Newton.
const ROUNDS: usize = 8;
/// By so much of its ln a delay is moved for the derivative.
const NUDGE: f64 = 0.02;
/// The most that ln of a delay is moved at once, and the least that is worth a fit.
const FARTHEST: f64 = 0.5;
const SETTLED: f64 = 0.01;
/// A step that does not help is halved so many times.
const HALVINGS: usize = 2;
/// What had gathered before a covariate's first value is fitted where it counts at more readings than these.
const FEWEST_EARLY: usize = 8;
/// And where 95 % of the response have passed within this share of the record.
const LONGEST_START: f64 = 1.0 / 3.0;
/// What a step must lower the BIC by.
const HELPS: f64 = 0.05;
/// The shortest delay that is tried, spacings of the covariate; none becomes this when it is made longer.
pub(super) const SHORTEST: f64 = 0.3;

impl Search<'_> {
    /// `term` with its response's mean delay so many days; `None` of what has no response, and beyond the delays that are tried.
    pub(super) fn with_mean_delay(&self, term: &Term, mean_days: f64) -> Option<Term> {
        let response = Response {
            mean_days,
            ..term.response?
        };
        self.with_shape(term, response)
    }

    /// `term` with that response; `None` as above.
    fn with_shape(&self, term: &Term, response: Response) -> Option<Term> {
        let mean_days = response.mean_days;
        let driver = Driver::at(self.drivers, term.channel)?;
        let is_tried = mean_days >= SHORTEST * driver.step()
            && !response.outlasts_half_of(self.problem.span());
        if !is_tried {
            return None;
        }
        with_response(self.problem, term, driver, response)
    }

    /// Puts beside each of `known` the best that its effect comes to with its delay free, and leaves out those that explain clearly less. Of
    /// what explains much the same the later block says which predicts it.
    pub(super) fn with_free_delays_beside(&mut self, base: &Fitted, known: &mut Vec<Refitted>) {
        let mut free: Vec<Refitted> = Vec::new();
        for one in known.iter() {
            let Some(found) = self.with_free_delay(base, one) else {
                continue;
            };
            match free.iter_mut().find(|other| other.is_as(&found)) {
                Some(other) if other.gain < found.gain => *other = found,
                Some(_) => {}
                None => free.push(found),
            }
        }
        let margin = self.options.bic_margin;
        known.retain(|one| {
            let mut better = free.iter().filter(|other| other.is_as(one));
            better.all(|other| other.gain < one.gain + margin)
        });
        known.extend(free);
    }

    /// `one` with its delay free beside law and gain, from the law that it has and from one whose velocity answers to the load at once; `None`
    /// where none is nearer to the readings.
    fn with_free_delay(&mut self, base: &Fitted, one: &Refitted) -> Option<Refitted> {
        one.term.response.filter(|_| one.gain > 0.0)?;
        let mut followed = one.fitted.clone();
        self.follow_delay(&mut followed, false);
        let at_once = [false, true].map(|holds| self.answering_at_once(base, &one.term, holds));
        let all = at_once.into_iter().flatten().chain([followed]);
        let best = likeliest(self.problem, all)?;
        let helps = best.bic(self.problem) < one.fitted.bic(self.problem) - HELPS;
        helps.then(|| self.known(base, best))?
    }

    /// Moves the delays of the effects that `full` had before its newest one: they were found without it.
    pub(super) fn settle_delays(&mut self, full: &mut Fitted) {
        for index in 0..full.terms.len().saturating_sub(1) {
            if full.terms[index].response.is_none() {
                continue;
            }
            let last = full.terms.len() - 1;
            let mut turned = self.with_term_moved(full, index, last);
            self.follow_delay(&mut turned, false);
            if turned.bic(self.problem) < full.bic(self.problem) - HELPS {
                *full = self.with_term_moved(&turned, last, index);
            }
        }
    }

    /// The same with the term of one index at another.
    pub(super) fn with_term_moved(&self, fitted: &Fitted, from: usize, to: usize) -> Fitted {
        let mut moved = fitted.clone();
        let own = coefficients_of(self.problem, &moved.terms, from);
        let own: Vec<f64> = moved.parameters.drain(own).collect();
        let term = moved.terms.remove(from);
        moved.terms.insert(to, term);
        let place = coefficients_of(self.problem, &moved.terms, to).start;
        moved.parameters.splice(place..place, own);
        moved
    }

    /// The joint fit with one more term from a law whose velocity answers to the load at once and that forgets nothing of it: from others a
    /// fit seldom finds its way there, as these imitate the load themselves. Where its shape is held first, no law bends before the delay is right.
    fn answering_at_once(
        &mut self,
        base: &Fitted,
        term: &Term,
        holds_shape: bool,
    ) -> Option<Fitted> {
        // What has no delay has no derivative by it either.
        let driver = Driver::at(self.drivers, term.channel)?;
        let has_none = term.response?.mean_days <= 0.0;
        let shortest = has_none.then(|| self.with_mean_delay(term, SHORTEST * driver.step()));
        let term = shortest.flatten().unwrap_or_else(|| term.clone());
        let laws = fresh_laws(self.problem, base, &term);
        let white = [Whitener::new(self.problem, Noise::WHITE)];
        let start = Start {
            holds_shape,
            ..laws.into_iter().nth(AT_ONCE)?
        };
        let mut fitted = refit(self.problem, &start, &white, &mut self.scratch)?;
        if holds_shape {
            self.follow_delay(&mut fitted, true);
            let free = Start::at(&fitted);
            fitted = refit(self.problem, &free, &white, &mut self.scratch)?;
        }
        self.sharpen(&mut fitted);
        self.follow_delay(&mut fitted, false);
        Some(fitted)
    }

    /// Moves the newest term's delay, and what had gathered before its covariate's first value, together with law and gain while that helps.
    fn follow_delay(&mut self, fitted: &mut Fitted, holds_shape: bool) {
        for _ in 0..ROUNDS {
            match self.toward_its_delay(fitted, holds_shape) {
                Some(next) => *fitted = next,
                None => break,
            }
        }
    }

    /// One step of Gauss and Newton in the delay, the start, the law and the gains; `None` where it does not help. Not the damped descent:
    /// each trial is itself a descent of law and gains.
    fn toward_its_delay(&mut self, fitted: &Fitted, holds_shape: bool) -> Option<Fitted> {
        let term = fitted.terms.last()?;
        let response = term.response?;
        let spread = Driver::at(self.drivers, term.channel)?.spread();
        let derived = self.with_its_derivatives(term)?;
        let count = derived.coefficients() - 1;
        let mut start = Start {
            holds_shape,
            ..Start::at(fitted)
        };
        *start.terms.last_mut()? = derived;
        start.parameters.extend(vec![0.0; count]);
        let own = self.whiteners_of(fitted.noise);
        let mut there = refit(self.problem, &start, &own, &mut self.scratch)?;
        let by = there.parameters.split_off(there.parameters.len() - count);
        let gain = *there.parameters.last()?;
        let by = |index: usize| by.get(index).map_or(0.0, |by| by / gain);
        let mut step = (by(0).clamp(-FARTHEST, FARTHEST), by(1));
        for _ in 0..=HALVINGS {
            if !step.0.is_finite() || step.0.abs().max(step.1.abs()) < SETTLED {
                return None;
            }
            let moved = Response {
                mean_days: response.mean_days * step.0.exp(),
                before: response.before + step.1 * spread,
                ..response
            };
            if let Some(moved) = self.with_shape(term, moved) {
                let mut start = Start {
                    holds_shape,
                    ..Start::at(&there)
                };
                *start.terms.last_mut()? = moved;
                let next = refit(self.problem, &start, &own, &mut self.scratch);
                let helps =
                    |next: &Fitted| next.bic(self.problem) < fitted.bic(self.problem) - HELPS;
                if let Some(next) = next.filter(helps) {
                    return Some(next);
                }
            }
            step = (0.5 * step.0, 0.5 * step.1);
        }
        None
    }

    /// The term with more columns: what its first one changes by per ln of the delay and, where that counts, per standard deviation of the
    /// covariate that had gathered before it. `None` of what has no one column or no delay.
    fn with_its_derivatives(&self, term: &Term) -> Option<Term> {
        let response = term.response?;
        let driver = Driver::at(self.drivers, term.channel)?;
        let early = *self.problem.t.get(FEWEST_EARLY)?;
        let later = Response {
            mean_days: response.mean_days * NUDGE.exp(),
            ..response
        };
        let more = Response {
            before: response.before + NUDGE * driver.spread(),
            ..response
        };
        let is_of_load = matches!(term.act, Act::Load(_));
        // What is forgotten as slowly as the record lasts would be any bend.
        let is_short = response.memory_days() <= LONGEST_START * self.problem.span();
        let counts = is_of_load && is_short && driver.remembers_its_start(response, early);
        let own = only_column(&term.act)?;
        let mut columns = vec![own.to_vec()];
        for nudged in [Some(later), counts.then_some(more)].into_iter().flatten() {
            let nudged = self.with_shape(term, nudged)?;
            let both = own.iter().zip(only_column(&nudged.act)?);
            columns.push(both.map(|(own, nudged)| (nudged - own) / NUDGE).collect());
        }
        let act = if is_of_load {
            Act::Load(columns)
        } else {
            Act::Reading(columns)
        };
        Some(Term {
            act,
            ..term.clone()
        })
    }
}

/// The column of what acts through one.
fn only_column(act: &Act) -> Option<&[f64]> {
    match act {
        Act::Load(columns) | Act::Reading(columns) => match columns.as_slice() {
            [only] => Some(only),
            _ => None,
        },
        Act::Step
        | Act::Reset
        | Act::Friction(_)
        | Act::PerVelocity
        | Act::PerSlip
        | Act::Averaging => None,
    }
}
