//! What happens at once, seen in velocities that are means over some time: a step of the load rises as slowly as a change
//! of the friction would, and neither the step nor the mean gains much without the other. Both are tried together.

use super::act::Act;
use super::candidates;
use super::judge::coefficients;
use super::kind::Kind;
use super::refit::{Fitted, Start, refit};
use super::search::{Accepted, Refitted, SIGNIFICANT, Search};
use super::term::Term;

/// A mean over less than this many spacings cannot be distinguished from none.
const SHORTEST: f64 = 0.5;

impl Search<'_> {
    /// The best event as a mean over some time shows it, both refitted with the law; `None` where it gains no more than
    /// what was found one by one (`single`) by the margin, where either of the two gains less than the margin beside the other, or where
    /// the readings may be no such means.
    pub(super) fn averaged_event(
        &mut self,
        base: &Fitted,
        single: &[Refitted],
        round: usize,
    ) -> Option<(Refitted, Vec<Accepted>)> {
        let margin = self.options.bic_margin;
        let events = single.iter();
        let events = events.filter(|one| one.term.kind.is_event_of_the_ground());
        let alone = events.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
        // That something happened is known; what the mean adds has the margin of the best of them to pass.
        if alone.gain < margin || alone.p_value >= SIGNIFICANT {
            return None;
        }
        let kinds = self.options.effects.iter().map(|one| Kind::of(one));
        let mut all_along = kinds.flat_map(|kind| candidates::all_along(self.problem, kind));
        let mean = all_along.find(|term| matches!(term.act, Act::Averaging))?;
        if base.terms.iter().any(|term| term.kind == mean.kind) {
            return None;
        }
        let mut best: Option<Refitted> = None;
        for spacings in mean.act.starts() {
            for one in self.under_a_mean(base, &mean, *spacings) {
                if best.as_ref().is_none_or(|best| one.gain > best.gain) {
                    best = Some(one);
                }
            }
        }
        let best = best?;
        let most = single.iter().map(|one| one.gain).fold(alone.gain, f64::max);
        if best.gain < most + margin {
            return None;
        }
        let share = |bic_gain: f64, p_value: f64| Accepted {
            bic_gain,
            p_value,
            ties: Vec::new(),
        };
        // The event at the time at which the mean let it be seen may need no mean.
        let event = self.refitted(base, &best.term)?;
        let spacings = coefficients(self.problem, &best.fitted, base.terms.len());
        if best.gain < event.gain + margin || spacings[0] < SHORTEST {
            let p_value = alone.p_value;
            let is_better = event.gain > most + margin;
            let shares = vec![share(event.gain, p_value)];
            return is_better.then_some((Refitted { p_value, ..event }, shares));
        }
        // What the BIC rises by without the one beside the other.
        let of_mean = best.gain - event.gain;
        let of_event = best.gain - self.gain_of_mean(base, &mean, single);
        if of_event < margin {
            return None;
        }
        let null_gains = self.null_gains_of_itself(base, round)?;
        let shares = [of_mean, of_event].map(|gain| share(gain, null_gains.p_of_two(gain)));
        let p_value = shares[0].p_value.max(shares[1].p_value);
        Some((Refitted { p_value, ..best }, shares.into()))
    }

    /// What the mean gains without an event.
    fn gain_of_mean(&mut self, base: &Fitted, mean: &Term, single: &[Refitted]) -> f64 {
        let known = single.iter().find(|one| one.term.kind == mean.kind);
        let gain = match known {
            Some(known) => Some(known.gain),
            None => self.refitted(base, mean).map(|one| one.gain),
        };
        gain.unwrap_or(0.0).max(0.0)
    }

    /// The best event of each kind where every reading is a mean over so many spacings to begin with.
    fn under_a_mean(&mut self, base: &Fitted, mean: &Term, spacings: f64) -> Vec<Refitted> {
        let own = self.whiteners_of(base.noise);
        let start = Start {
            frozen: 1,
            ..Start::at(base).with_size(mean, spacings)
        };
        let Some(averaged) = refit(self.problem, &start, &own, &mut self.scratch) else {
            return Vec::new();
        };
        let mut terms: Vec<(f64, Term)> = Vec::new();
        if let Some(ground) = self.ground(&averaged) {
            for at in ground.event_times() {
                let kinds = self.options.effects.iter().map(|one| Kind::of(one));
                let jumps = kinds.filter(|kind| kind.jumps());
                for term in jumps.flat_map(|kind| candidates::once(kind, at)) {
                    let trial = ground.trial(term);
                    match terms
                        .iter_mut()
                        .find(|(_, own)| own.kind == trial.term.kind)
                    {
                        Some(known) if known.0 >= trial.gain => {}
                        Some(known) => *known = (trial.gain, trial.term),
                        None => terms.push((trial.gain, trial.term)),
                    }
                }
            }
        }
        let problem = self.problem;
        let each = terms.into_iter();
        let each = each.filter_map(|(_, term)| self.refitted(&averaged, &term));
        each.map(|one| Refitted {
            gain: base.bic(problem) - one.fitted.bic(problem),
            ..one
        })
        .collect()
    }
}
