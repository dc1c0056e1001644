//! A covariate that is logged after what it did: its clock runs late, or its dates are wrong. What is found in its place is a label for
//! what it explains.

use super::candidates::{delays, in_load, is_one_wave, responses};
use super::kind::{Form, Kind};
use super::refit::Fitted;
use super::response::Driver;
use super::search::{Accepted, Refitted, SIGNIFICANT, Search};

/// A covariate is tried so many times earlier, by up to this share of the record.
const TIMES: usize = 24;
const FARTHEST: f64 = 0.1;
/// What is hours early may be a daily wave in another phase.
const NEAREST_DAYS: f64 = 1.0;
/// By so many margins of the BIC it must explain more than all that was found, which it would else only resemble.
const LEADS: f64 = 4.0;

/// A covariate with its values so many days earlier, by the law linearised.
struct Earlier {
    driver: Driver,
    days: f64,
    gain: f64,
}

impl Search<'_> {
    /// Takes out all that was found where a covariate with its values some days earlier explains far more: nothing acts before it comes, so
    /// that it is not the explanation, and what was found beside it is none either.
    pub(super) fn refuse_beside_a_late_covariate(
        &mut self,
        null: &Fitted,
        full: &mut Fitted,
        accepted: &mut Vec<Accepted>,
    ) {
        let problem = self.problem;
        let found = null.bic(problem) - full.bic(problem);
        let Some((one, days)) = self.logged_late(null, found) else {
            return;
        };
        let name = Driver::at(self.drivers, one.term.channel).map(|own| own.name.clone());
        let name = name.unwrap_or_default();
        let more = one.gain - found;
        for term in &full.terms {
            let why = format!(
                "{name} explains {more:.0} more of the BIC if it is taken {days:.0} days earlier"
            );
            self.refuse_after_all(term, &why);
        }
        let why = format!(
            "only with its values {days:.0} days earlier: what acts does not come after what it does, and its clock or its dates may be wrong"
        );
        let term = one.term.clone();
        self.note(&term, &one, None, Some(why));
        accepted.clear();
        full.clone_from(null);
    }

    /// The covariate that explains more than what was `found`, of the BIC, with its values so many days earlier.
    fn logged_late(&mut self, null: &Fitted, found: f64) -> Option<(Refitted, f64)> {
        let asked = found.max(0.0) + LEADS * self.options.bic_margin;
        let best = self.best_earlier(null)?;
        if best.gain < 0.5 * asked || best.days < NEAREST_DAYS {
            return None;
        }
        let one = self.refitted_through(null, &best.driver)?;
        // What comes each year is in step with any year's motion at some time earlier.
        let is_of_the_year = one.follows_season || is_one_wave(self.problem, &one.term);
        if one.gain < asked || is_of_the_year {
            return None;
        }
        // Each time that was tried is a search of its own.
        let ground = self.ground(null)?;
        let (count, seed) = (self.options.surrogates, self.options.seed);
        let null_gains = ground.null_gains_of(self.drivers, count, seed);
        let null_gains = self.amplified(null, null_gains);
        let p_value = (TIMES as f64 * null_gains.p_value(one.paid(self.problem))).min(1.0);
        let is_sure = p_value < SIGNIFICANT;
        is_sure.then_some((Refitted { p_value, ..one }, best.days))
    }

    /// That covariate, and that time earlier, which takes most off the misfit by the law linearised; `None` where it is nearly as good as it is.
    fn best_earlier(&mut self, null: &Fitted) -> Option<Earlier> {
        let problem = self.problem;
        let drivers = self.drivers;
        let ground = self.ground(null)?;
        let kind = Kind::HYDROLOGICAL;
        let tried = drivers
            .iter()
            .filter(|driver| kind.definition().is_tried_through(driver.kind));
        let gain_of = |driver: &Driver| {
            let delays: Vec<f64> = delays(problem, driver).into_iter().step_by(2).collect();
            let forms = [Form::Level, Form::Rate].into_iter();
            let terms = forms
                .flat_map(|form| responses(form, &delays))
                .filter(|response| response.stages == 1)
                .filter_map(|response| in_load(problem, kind, driver, response));
            terms
                .map(|term| ground.trial(term).gain)
                .fold(f64::MIN, f64::max)
        };
        let each = tried.flat_map(|driver| {
            earlier_by(
                driver.step().max(problem.spacing),
                FARTHEST * problem.span(),
            )
            .into_iter()
            .map(|days| {
                let driver = driver.earlier(days);
                let gain = gain_of(&driver);
                Earlier { driver, days, gain }
            })
        });
        each.max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// The best refit with the one covariate.
    fn refitted_through(&mut self, null: &Fitted, driver: &Driver) -> Option<Refitted> {
        let drivers = [driver.clone()];
        let mut other = self.through_others(&drivers);
        let ground = other.ground(null);
        let found = ground.map(|ground| other.through_covariates(null, &ground, None));
        self.scratch = other.scratch;
        let found = found.unwrap_or_default().into_iter();
        found.max_by(|a, b| a.gain.total_cmp(&b.gain))
    }
}

/// By how many days a covariate is brought forward: from twice the shortest, evenly in their logarithm.
fn earlier_by(shortest: f64, longest: f64) -> Vec<f64> {
    let first = 2.0 * shortest;
    if longest < first {
        return Vec::new();
    }
    let ratio = (longest / first).powf(1.0 / (TIMES - 1) as f64);
    let all = (0..TIMES).scan(first, |next, _| {
        let days = *next;
        *next *= ratio;
        Some(days)
    });
    all.collect()
}

#[cfg(test)]
mod tests;
