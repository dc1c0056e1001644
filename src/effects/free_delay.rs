//! The delay of a covariate's response, free beside the law and the gain. One after the other they stay where they are: with another delay the
//! readings ask for another law, and each alone makes the fit worse.

use super::act::Act;
use super::candidates::with_response;
use super::fresh::fresh_laws;
use super::noise::{Noise, Whitener};
use super::refit::{AT_ONCE, Fitted, Start, likeliest, refit};
use super::response::{Driver, Response};
use super::search::{Refitted, Search};
use super::term::Term;

/// Most steps of Gauss and Newton.
const ROUNDS: usize = 8;
/// By so much of its ln a delay is moved for the derivative.
const NUDGE: f64 = 0.02;
/// The most that ln of a delay is moved at once, and the least that is worth a fit.
const FARTHEST: f64 = 0.5;
const SETTLED: f64 = 0.01;
/// A step that does not help is halved so many times.
const HALVINGS: usize = 2;
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
    /// where neither is nearer to the readings.
    fn with_free_delay(&mut self, base: &Fitted, one: &Refitted) -> Option<Refitted> {
        one.term.response.filter(|_| one.gain > 0.0)?;
        let mut followed = one.fitted.clone();
        self.follow_delay(&mut followed);
        let at_once = self.answering_at_once(base, &one.term);
        let best = likeliest(self.problem, at_once.into_iter().chain([followed]))?;
        let helps = best.bic(self.problem) < one.fitted.bic(self.problem) - HELPS;
        helps.then(|| self.known(base, best))?
    }

    /// The joint fit with one more term from a law whose velocity answers to the load at once and that forgets nothing of it: from others a
    /// fit seldom finds its way there, as these imitate the load themselves.
    fn answering_at_once(&mut self, base: &Fitted, term: &Term) -> Option<Fitted> {
        let laws = fresh_laws(self.problem, base, term);
        let white = [Whitener::new(self.problem, Noise::WHITE)];
        let start = laws.get(AT_ONCE)?;
        let mut fitted = refit(self.problem, start, &white, &mut self.scratch)?;
        self.sharpen(&mut fitted);
        self.follow_delay(&mut fitted);
        Some(fitted)
    }

    /// Moves the newest term's delay together with law and gain while that helps.
    fn follow_delay(&mut self, fitted: &mut Fitted) {
        for _ in 0..ROUNDS {
            match self.toward_its_delay(fitted) {
                Some(next) => *fitted = next,
                None => break,
            }
        }
    }

    /// One step of Gauss and Newton in the delay, the law and the gains; `None` where it does not help.
    fn toward_its_delay(&mut self, fitted: &Fitted) -> Option<Fitted> {
        let term = fitted.terms.last()?;
        let mean_days = term.response?.mean_days;
        let mut start = Start::at(fitted);
        *start.terms.last_mut()? = self.with_its_derivative(term)?;
        start.parameters.push(0.0);
        let own = self.whiteners_of(fitted.noise);
        let mut there = refit(self.problem, &start, &own, &mut self.scratch)?;
        let (by_delay, gain) = (there.parameters.pop()?, *there.parameters.last()?);
        let mut by = (by_delay / gain).clamp(-FARTHEST, FARTHEST);
        for _ in 0..=HALVINGS {
            if by.is_nan() || by.abs() < SETTLED {
                return None;
            }
            let mut start = Start::at(&there);
            let moved = self.with_mean_delay(term, mean_days * by.exp());
            if let Some(moved) = moved {
                *start.terms.last_mut()? = moved;
                let next = refit(self.problem, &start, &own, &mut self.scratch);
                let helps =
                    |next: &Fitted| next.bic(self.problem) < fitted.bic(self.problem) - HELPS;
                if let Some(next) = next.filter(helps) {
                    return Some(next);
                }
            }
            by *= 0.5;
        }
        None
    }

    /// The term with a second column: what its first one changes by per ln of the delay. `None` of what has no one column or no delay.
    fn with_its_derivative(&self, term: &Term) -> Option<Term> {
        let mean_days = term.response?.mean_days;
        let nudged = self.with_mean_delay(term, mean_days * NUDGE.exp())?;
        let (own, nudged) = (only_column(&term.act)?, only_column(&nudged.act)?);
        let both = own.iter().zip(nudged);
        let by_delay = both.map(|(own, nudged)| (nudged - own) / NUDGE).collect();
        let columns = vec![own.to_vec(), by_delay];
        let act = if matches!(term.act, Act::Load(_)) {
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
