//! Two effects at once. Where a law lacks two, either alone may bend it so that the later block is predicted worse, and neither would
//! ever be accepted: what the readings refuse of the first for that reason alone is tried with a second beside it.

use super::beside::BESIDE;
use super::judge::{Compared, held_out, step_errors};
use super::objection::Judgement;
use super::refit::Fitted;
use super::search::{Accepted, OneMore, Refitted, Search};

/// Second effects that are tried beside the first.
const MOST_SECOND: usize = 2;

impl Search<'_> {
    /// Where nothing may be accepted that more than the shape of the readings supports, the effect that gains most of those that their later
    /// block alone speaks against, with a second one beside it: `None` where both together may not be accepted either, and where an
    /// effect was found already: what is left of the law's drift would be credited to two more.
    pub(super) fn two_together(
        &mut self,
        base: &Fitted,
        refitted: &[Refitted],
        judged: &[Judgement],
        round: usize,
    ) -> Option<OneMore> {
        let each = || refitted.iter().zip(judged);
        let open = each().filter(|(_, (_, reason))| reason.is_none());
        let open = open.map(|(one, _)| one);
        let is_beaten = |one: &&Refitted| self.is_beaten_by_its_other_form(one, refitted, judged);
        let standing: Vec<&Refitted> = open.filter(|one| !is_beaten(one)).collect();
        // What nothing but the shape of the readings supports may be what two effects look like.
        let has_evidence = |one: &&Refitted| one.term.kind.has_independent_evidence();
        if !base.terms.is_empty() || standing.iter().any(has_evidence) {
            return None;
        }
        let gains = standing.iter().map(|one| one.gain);
        let by_shape = gains.fold(f64::NEG_INFINITY, f64::max) + self.options.bic_margin;
        let refused = each().filter(|(_, (held, reason))| held.is_some() && reason.is_some());
        let (first, _) = refused.max_by(|a, b| a.0.gain.total_cmp(&b.0.gain))?;
        let mut beside = self.refits(&first.fitted, round)?;
        beside.retain(|one| self.refused_at_once(one).is_none());
        let jumps: Vec<usize> = (standing.iter())
            .filter(|one| one.term.is_jump_of_reading())
            .filter_map(|one| one.term.at)
            .collect();
        let is_at_a_jump = |one: &Refitted| is_event_at_one(one, &jumps);
        if is_at_a_jump(first) {
            return None;
        }
        beside.retain(|one| !is_at_a_jump(one));
        beside.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        beside.truncate(MOST_SECOND);
        let (gain, p_value) = (first.gain, first.p_value);
        for second in beside {
            let shares = [(gain, p_value), (second.gain, second.p_value)];
            let both = Refitted {
                gain: gain + second.gain,
                p_value: p_value.max(second.p_value),
                ..second
            };
            if both.gain < by_shape {
                continue;
            }
            let (held, reason) = self.judged(base, &both);
            let is_taken = reason.is_none() && self.is_no_worse(base, &both.fitted);
            if is_taken && self.slower(base, &both, both.gain).is_none() {
                for (one, (held, objection)) in each() {
                    let reason = objection.as_ref().map(|objection| objection.why.clone());
                    self.note(&one.term, one, *held, reason);
                }
                // Each is noted with what it gains itself.
                let terms = &both.fitted.terms[base.terms.len()..];
                for (term, (gain, p_value)) in terms.iter().zip(shares) {
                    let fitted = both.fitted.clone();
                    let one = Refitted {
                        gain,
                        p_value,
                        fitted,
                        term: term.clone(),
                        ..both
                    };
                    self.note(term, &one, held, None);
                }
                let shares = shares.map(|(bic_gain, p_value)| Accepted {
                    bic_gain,
                    p_value,
                    ties: Vec::new(),
                });
                return Some(OneMore::Effect(both.fitted, shares.into()));
            }
        }
        None
    }

    /// Whether a covariate explains clearly more in its other form, which its later block alone speaks against: a law that lacks a second effect drifts
    /// without it, and the wrong form drifts less.
    fn is_beaten_by_its_other_form(
        &self,
        one: &Refitted,
        refitted: &[Refitted],
        judged: &[Judgement],
    ) -> bool {
        let is_of_the_other = |other: &Refitted| {
            let same = other.term.kind == one.term.kind && other.term.channel == one.term.channel;
            same && one.term.channel.is_some() && !other.is_as(one)
        };
        let mut others = refitted.iter().zip(judged);
        others.any(|(other, (held, reason))| {
            let is_refused = held.is_some() && reason.is_some();
            let leads = other.gain >= one.gain + self.options.bic_margin;
            is_refused && leads && is_of_the_other(other)
        })
    }

    /// Whether both together predict the block no worse, in each way that a single effect may be judged by: what is forgiven of an
    /// effect alone, because the law drifts without another, is not forgiven of both.
    fn is_no_worse(&mut self, base: &Fitted, both: &Fitted) -> bool {
        let models = Compared {
            before: base,
            after: both,
        };
        let share = self.options.held_out_share;
        let Some(held) = held_out(self.problem, models, share, &mut self.scratch) else {
            return false;
        };
        let newest = models.newest();
        let steps = step_errors(self.problem, models, held.from, newest, &mut self.scratch);
        let by_steps =
            steps.is_some_and(|steps| steps.after <= steps.before && steps.deviance <= 0.0);
        let falls = |(before, after): (f64, f64)| after <= before;
        by_steps && falls(held.errors(self.problem)) && falls(held.errors_of_changes(self.problem))
    }
}

/// Whether it is an event of the ground where the reading may have jumped, at one of `jumps`: two effects may look like that.
fn is_event_at_one(one: &Refitted, jumps: &[usize]) -> bool {
    let of_ground = one
        .term
        .at
        .filter(|_| one.term.kind.is_event_of_the_ground());
    of_ground.is_some_and(|at| jumps.iter().any(|jump| jump.abs_diff(at) <= BESIDE))
}
