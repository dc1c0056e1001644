//! Two effects at once. Where a law lacks two, either alone may bend it so that the later block is predicted worse, and neither would
//! ever be accepted: what the readings refuse of the first for that reason alone is tried with a second beside it.

use super::judge::objection;
use super::refit::Fitted;
use super::search::{Accepted, Judgement, OneMore, Refitted, SIGNIFICANT, Search};

/// Second effects that are tried beside the first.
const MOST_SECOND: usize = 2;

impl Search<'_> {
    /// The effect that gains most, where its later block alone speaks against it and it gains more than what may be accepted by the
    /// margin, with a second one beside it: `None` where both together may not be accepted either.
    pub(super) fn two_together(
        &mut self,
        base: &Fitted,
        (refitted, judged): (&[Refitted], &[Judgement]),
        round: usize,
    ) -> Option<OneMore> {
        let each = || refitted.iter().zip(judged);
        let open = each().filter(|(_, (_, reason))| reason.is_none());
        let most = open.map(|(one, _)| one.gain).fold(0.0, f64::max);
        let refused = each().filter(|(_, (held, reason))| held.is_some() && reason.is_some());
        let (first, _) = refused.max_by(|a, b| a.0.gain.total_cmp(&b.0.gain))?;
        if first.gain < most + self.options.bic_margin {
            return None;
        }
        let mut beside = self.refits(&first.fitted, round)?;
        beside.retain(|one| self.stands_beside(one));
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
            let (held, reason) = self.judged(base, &both);
            if reason.is_none() && self.slower(base, &both, both.gain).is_none() {
                for (one, (held, reason)) in each() {
                    self.note(&one.term, one, *held, reason.clone());
                }
                for term in &both.fitted.terms[base.terms.len()..] {
                    self.note(term, &both, held, None);
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

    /// Whether it may be accepted beside another, but for the later block.
    fn stands_beside(&self, one: &Refitted) -> bool {
        one.gain >= self.options.bic_margin
            && one.p_value < SIGNIFICANT
            && objection(self.problem, &one.fitted, self.drivers).is_none()
    }
}
