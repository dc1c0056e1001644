//! A covariate's response, and when the load steps, chosen about other laws than the one that was fitted without them. That one has bent towards what they
//! do, and about it another delay, or time, explains more than the right one: about a steady law, and again about the law fitted with it.

use super::act::Act;
use super::candidates::once;
use super::fresh::plain_starts;
use super::kind::Kind;
use super::linear::Linear;
use super::margin::BY_SHAPE;
use super::noise::{Noise, Whitener};
use super::refit::{Fitted, Start, jacobian, likeliest, refit, towards};
use super::response::Driver;
use super::search::{Refitted, Search};
use super::term::Term;
use super::trials::{Trial, TrialBase};

/// So many that promise most about a steady law are refitted too.
const ABOUT_STEADY: usize = 3;
/// So often at most.
const ROUNDS: usize = 3;
/// By how much of the BIC another response must promise more by the law linearised.
const PROMISES: f64 = 1.0;

impl Search<'_> {
    /// The best responses about a law at a steady rate, of those that `known` has another response of: where the covariate is what
    /// bends the readings, the law fitted without it is bent the same way. None beside effects that are in the law.
    pub(super) fn about_a_steady_law(steady: Option<&TrialBase>, known: &[Trial]) -> Vec<Trial> {
        let Some(ground) = steady else {
            return Vec::new();
        };
        let is_known = |trial: &Trial| {
            let own = |known: &Trial| {
                known.term.channel == trial.term.channel
                    && known.term.response == trial.term.response
            };
            known.iter().any(own)
        };
        let mut trials = ground.of_covariates();
        trials.retain(|trial| trial.gain > 0.0 && !is_known(trial));
        trials.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        trials.truncate(ABOUT_STEADY);
        trials
    }

    /// Where no event of the ground is found that gains what is asked for: the step of the load that is found about a steady law, where it
    /// gains more than that which is known.
    pub(super) fn with_a_step_about_a_steady_law(
        &mut self,
        base: &Fitted,
        steady: Option<&TrialBase>,
        others: &mut Vec<Refitted>,
    ) {
        let events = others
            .iter()
            .filter(|one| one.term.kind.is_event_of_the_ground());
        let most = events.map(|one| one.gain).fold(f64::MIN, f64::max);
        if most >= BY_SHAPE * self.options.bic_margin {
            return;
        }
        let Some(trial) = steady.and_then(step_about_a_steady_law) else {
            return;
        };
        let known = (others.iter()).position(|one| one.term.kind == trial.term.kind);
        if known.is_some_and(|place| others[place].term.at == trial.term.at) {
            return;
        }
        let Some(there) = self.refitted(base, &trial.term) else {
            return;
        };
        match known {
            Some(place) if others[place].gain >= there.gain => {}
            Some(place) => others[place] = there,
            None => others.push(there),
        }
    }

    /// The steady law nearest to the readings; `None` where `base` has effects.
    pub(super) fn steady_law(&mut self, base: &Fitted) -> Option<Fitted> {
        let start = plain_starts(self.problem).into_iter().next();
        let start = start.filter(|_| base.terms.is_empty())?;
        let white = Whitener::new(self.problem, Noise::WHITE);
        towards(self.problem, &start, &white, (0, &mut self.scratch))
    }

    /// `one` with the response of its form that explains most; another is taken while it gains more. `None` where none does.
    pub(super) fn with_another_delay(&mut self, base: &Fitted, one: &Refitted) -> Option<Refitted> {
        let mut best: Option<Refitted> = None;
        for _ in 0..ROUNDS {
            let now = best.as_ref().unwrap_or(one);
            let next = self.promising_delay(base, now);
            let next = next.and_then(|term| self.under_delay(base, now, &term));
            match next.filter(|next| next.gain > now.gain) {
                Some(next) => best = Some(next),
                None => break,
            }
        }
        best
    }

    /// The response that explains most about the law fitted with `one`, where that is another; `None` of what has none.
    fn promising_delay(&mut self, base: &Fitted, one: &Refitted) -> Option<Term> {
        let (problem, fitted) = (self.problem, &one.fitted);
        let response = one.term.response?;
        let driver = Driver::at(self.drivers, one.term.channel)?;
        let law = (fitted.terms.as_slice(), fitted.parameters.as_slice());
        let linear = Linear::about(problem, law, &mut self.scratch)?;
        let mut columns = jacobian(problem, fitted, &mut self.scratch);
        // The readings as the law without the covariate leaves them.
        let (own, size) = (columns.pop()?, *fitted.parameters.last()?);
        let residual = fitted.residual(problem).into_iter().zip(own);
        let residual: Vec<f64> = residual.map(|(left, by)| left + size * by).collect();
        let ground = self.ground_about(linear, residual, &columns, &base.terms);
        let known = ground.trial(one.term.clone()).gain;
        let is_other = |term: &Term| {
            let other = term.response;
            other.is_some_and(|other| other.form == response.form && other != response)
        };
        let each = ground.through(one.term.kind, driver).into_iter().flatten();
        let each = each.filter(is_other).map(|term| ground.trial(term));
        let best = each.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
        (best.gain > known + PROMISES).then_some(best.term)
    }

    /// The joint fit with that term in place of the newest one of `one`, from its law and from others.
    fn under_delay(&mut self, base: &Fitted, one: &Refitted, term: &Term) -> Option<Refitted> {
        let mut start = Start::at(&one.fitted);
        *start.terms.last_mut()? = term.clone();
        let near = refit(self.problem, &start, self.bank, &mut self.scratch);
        let far = self.best_start(base, term);
        let mut fitted = likeliest(self.problem, near.into_iter().chain(far))?;
        self.sharpen(&mut fitted);
        self.known(base, fitted)
    }
}

/// A step of the load where it explains most about a steady law, of which that is the ground: about a plain law that has bent towards it, it
/// explains more elsewhere. `None` where it gains nothing.
fn step_about_a_steady_law(ground: &TrialBase) -> Option<Trial> {
    let mut kinds = ground.effects.iter().map(|definition| Kind::of(definition));
    let is_step = |act: &Act| matches!(act, Act::Step);
    let kind = kinds.find(|kind| kind.definition().once().iter().any(is_step))?;
    let times = ground.event_times().into_iter();
    let steps = times.flat_map(|at| once(kind, at));
    let each = steps.map(|term| ground.trial(term));
    let best = each.max_by(|a, b| a.gain.total_cmp(&b.gain));
    best.filter(|best| best.gain > 0.0)
}

#[cfg(test)]
mod tests {
    use super::super::explain::explain;
    use super::super::fixture::{channel, daily, generator, normals, series};
    use super::super::kind::{Form, Kind};
    use super::super::options::Options;
    use crate::reading::Quantity;

    /// A lake that rises and falls by its own, and as it seeps in over so many days, about their means.
    fn seeping(seed: u64, days: usize, mean_delay: f64) -> (Vec<f64>, Vec<f64>) {
        let kicks = normals(&mut generator(seed), days);
        let (mut trend, mut level, mut inside) = (0.0, 0.0, 0.0);
        let both = kicks.into_iter().map(|kick| {
            trend = 0.9 * trend + kick;
            level = 0.97 * level + 0.1 * trend;
            inside += (level - inside) * -(-1.0 / mean_delay).exp_m1();
            (level, inside)
        });
        both.unzip()
    }

    #[test]
    fn a_lake_that_seeps_in_over_days_is_found_with_its_delay() {
        let count = 300;
        let days = daily(count);
        for (seed, delay, gain) in [(1, 12.0, 0.6), (2, 5.0, -0.6)] {
            let (lake, inside) = seeping(seed, count, delay);
            let mean = inside.iter().sum::<f64>() / count as f64;
            let square = inside.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
            let deviation = (square / count as f64).sqrt();
            let noise = normals(&mut generator(100 + seed), count);
            let mut moved = 0.0;
            let values = inside.iter().zip(noise).map(|(one, noise)| {
                moved += (gain * (one - mean) / deviation).exp();
                moved + noise
            });
            let series = series(Quantity::Displacement, &days, &values.collect::<Vec<f64>>());
            let lake = channel("lake_level_m", &days, &lake);
            let said = explain(&series, &[lake], &[], &Options::default(), &mut |_| ());
            let found = &said.verdict;
            assert_eq!(found.effect, Kind::HYDROLOGICAL, "{found:?}");
            assert_eq!(found.form, Some(Form::Level), "{found:?}");
            let ratio = found.lag_days.unwrap() / delay;
            assert!((0.6..1.6).contains(&ratio), "{found:?} for {delay}");
        }
    }
}
