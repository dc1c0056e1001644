//! What a candidate predicts of a later block, of which nothing was known to its fit: extrapolated over all of it, and from reading to reading.

use super::definition::Support;
use super::judge::{
    Compared, HeldOut, StepErrors, block, held_out, most_extrapolated, step_errors,
};
use super::objection::{Judgement, Objection, ObjectionWeight};
use super::problem::Problem;
use super::refit::Fitted;
use super::search::{Refitted, Search};
use crate::reading::figure;

/// The later block is predicted no worse from reading to reading: neither in -2 ln likelihood, by more than the first, nor in
/// the errors, by more than the second factor.
const WORSE: f64 = 2.0;
const WORSE_STEPS: f64 = 1.005;
/// A held-out error that is so many times as large is no figure.
const RUNS_AWAY: f64 = 1000.0;
/// An event beside other effects that only its shape supports may gain less where the later block is predicted with less than this share of the
/// error. At .5 an event in place of rain that the law lacks would have been accepted beside a measured lake, with .33; of a step that was put
/// in beside another the share is .04.
const FAR_NEARER: f64 = 0.1;

impl Search<'_> {
    /// The held-out error with `one` over that without, and why it is evidence against it.
    pub(super) fn held_out(&mut self, base: &Fitted, one: &Refitted) -> Judgement {
        let share = self.options.held_out_share;
        if block(self.problem, &one.fitted.terms, share).is_none() {
            // A short record has none, and a step that has only just come says so by its date.
            let is_late =
                block(self.problem, &[], share).is_some() && !one.term.kind.fits_any_bend();
            let reason =
                "an event stands too late for a later block by which to judge it".to_owned();
            return (None, is_late.then(|| reason.into()));
        }
        let models = Compared {
            before: base,
            after: &one.fitted,
        };
        let Some(held) = held_out(self.problem, models, share, &mut self.scratch) else {
            let reason = "without the later block it cannot be fitted".to_owned();
            return (None, Some(reason.into()));
        };
        let (before, after) = held.errors(self.problem);
        let ratio = after / before.max(1e-300);
        // Where the law runs away within the block also without a covariate, that says nothing of it: what happens from reading to reading does.
        let is_judged = one.term.kind.definition().support != Support::Covariate
            || StepErrors::is_a_figure(self.problem, after)
            || StepErrors::is_a_figure(self.problem, before);
        if is_judged && (!ratio.is_finite() || ratio > most_extrapolated(one.term.kind)) {
            let reason = if ratio <= RUNS_AWAY {
                format!("the held-out error grows to {} %", figure(100.0 * ratio, 1))
            } else {
                "with it the held-out error is over a thousand times as large".to_owned()
            };
            return (
                Some(ratio).filter(|ratio| ratio.is_finite()),
                Some(reason.into()),
            );
        }
        let reason = self.worse_from_reading_to_reading(base, one, &held);
        let reason = reason.or_else(|| {
            self.worse_than_without_any(base, one, &held)
                .map(Objection::from)
        });
        (Some(ratio).filter(|_| is_judged), reason)
    }

    /// Why not, by all effects together: what improves on a law with effects may in its own later block still be worse than the law
    /// without any, and the errors that are reported are those.
    fn worse_than_without_any(
        &mut self,
        base: &Fitted,
        one: &Refitted,
        held: &HeldOut,
    ) -> Option<String> {
        let models = Compared {
            before: self.null.as_ref().filter(|_| !base.terms.is_empty())?,
            after: &one.fitted,
        };
        let (newest, scratch) = (models.newest(), &mut self.scratch);
        let steps = step_errors(self.problem, models, held.from, newest, scratch)?;
        let share = share_grown_to(self.problem, steps.before, steps.after);
        share.map(|share| {
            format!("with it all effects together predict the held-out readings worse than none: {share:.0} % of the error from reading to reading")
        })
    }

    /// Why not, by the held-out readings, each predicted from those before it: what only the shape of the readings supports may
    /// have changed the law, and is judged with the law as it was learned before the block.
    fn worse_from_reading_to_reading(
        &mut self,
        base: &Fitted,
        one: &Refitted,
        held: &HeldOut,
    ) -> Option<Objection> {
        let models = Compared {
            before: base,
            after: &one.fitted,
        };
        let newest = models.newest();
        let (before, after) = if one.term.kind.fits_any_bend() {
            held.errors_of_changes(self.problem)
        } else {
            let steps = step_errors(self.problem, models, held.from, newest, &mut self.scratch);
            match steps.filter(|steps| steps.after.is_finite() && steps.deviance.is_finite()) {
                None => {
                    let why = "as it is learned before the later block, the readings cannot be fitted with it";
                    return Some(why.to_owned().into());
                }
                Some(steps) if steps.deviance > WORSE => {
                    let worse = steps.deviance;
                    let why = format!(
                        "the held-out readings are less likely with it, by {worse:.1} in -2 ln likelihood"
                    );
                    return Some(why.into());
                }
                Some(steps) => (steps.before, steps.after),
            }
        };
        let share = share_grown_to(self.problem, before, after)?;
        // So much do the squares of so few errors grow at a likelihood that may be accepted.
        let readings = self.problem.t.len() - held.from;
        let is_within_chance = (share / 100.0).powi(2) <= 1.0 + WORSE / readings as f64;
        Some(Objection {
            why: format!("from reading to reading the held-out error grows to {share:.0} %"),
            weight: if is_within_chance {
                ObjectionWeight::WithinChance
            } else {
                ObjectionWeight::Against
            },
        })
    }

    /// What share of the error an event leaves of the later block that gains the margin, if not as many times it as are asked of what only the
    /// shape of the readings supports: that it predicts readings of which its fit knew nothing is more than its shape. `None` where that is
    /// not so, and of anything else.
    pub(super) fn predicted_after_all(&mut self, base: &Fitted, one: &Refitted) -> Option<f64> {
        let is_beside = !base.terms.is_empty() && one.term.kind.is_event_of_the_ground();
        // The shape of values that are no raw readings says nothing.
        if self.is_drawn || !is_beside || !self.is_refused_for_its_gain_alone(one) {
            return None;
        }
        let (held, objection) = self.held_out(base, one);
        let is_far_nearer = objection.is_none() && held.is_some_and(|share| share < FAR_NEARER);
        held.filter(|_| is_far_nearer)
    }
}

/// To what share an error from reading to reading grows, %; `None` where it does not, or where the one before is no figure.
fn share_grown_to(problem: &Problem, before: f64, after: f64) -> Option<f64> {
    let is_worse = after > WORSE_STEPS * before && StepErrors::is_a_figure(problem, before);
    is_worse.then(|| 100.0 * after / before.max(1e-300))
}

#[cfg(test)]
mod tests;
