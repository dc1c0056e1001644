//! One round of the search: the most promising trials refitted with the law, each with the p-value of its search.

use super::act::Act;
use super::candidates;
use super::frame::Frames;
use super::free_delay::SHORTEST;
use super::fresh::{
    best_of_starts, fresh_laws, fresh_starts, from_the_first_readings, under_growing_means,
};
use super::linear::Linear;
use super::noise::{Noise, Whitener};
use super::problem::Problem;
use super::refit::{Fitted, Start, jacobian, likeliest, refit, under_likeliest};
use super::response::Driver;
use super::search::{DeclaredPart, Refitted, SIGNIFICANT, Search};
use super::surrogate::{Innovations, NullGains};
use super::term::Term;
use super::trials::{Trial, TrialBase, best_against_the_motion, best_of_each_kind, shortlist};
use std::cell::LazyCell;

/// Most candidates refitted for one place: the best of each covariate, and of the kinds that need none.
const MOST_COVARIATES: usize = 8;
const MOST_OTHERS: usize = 6;
/// Parameters of the friction: b, a and p.
const MOST_FRICTION: usize = 3;
/// A covariate that follows the year may fit as well shifted by whole years, but no better than this at any shift.
const AT_RANDOM: f64 = 0.3;

/// Fits by least squares that are followed by one under the likeliest noise.
const LEVELS: usize = 2;

/// How far the newest term's delay, or its time, is moved at once.
#[derive(Debug, Clone, Copy)]
enum Stride {
    Coarse,
    Fine,
    /// This share of the time between two readings.
    Within(f64),
}

/// From the longest to the shortest: each is tried until it gains nothing more.
const STRIDES: [Stride; 4] = [
    Stride::Coarse,
    Stride::Fine,
    Stride::Within(0.25),
    Stride::Within(0.08),
];

impl<'a> Search<'a> {
    /// What stands before a search for one more effect than `base` has.
    pub(super) fn ground<'b>(&mut self, base: &'b Fitted) -> Option<TrialBase<'b>>
    where
        'a: 'b,
    {
        let linear = Linear::about(
            self.problem,
            (&base.terms, &base.parameters),
            &mut self.scratch,
        )?;
        let columns = jacobian(self.problem, base, &mut self.scratch);
        let residual = base.residual(self.problem);
        Some(self.ground_about(linear, residual, &columns, &base.terms))
    }

    /// The same of a law linearised, which leaves that residual and may go along those columns; `present` are the terms in it.
    pub(super) fn ground_about<'b>(
        &self,
        linear: Linear,
        residual: Vec<f64>,
        columns: &[Vec<f64>],
        present: &'b [Term],
    ) -> TrialBase<'b>
    where
        'a: 'b,
    {
        let bank = shortlist(&Frames::new(self.bank, &residual, columns));
        TrialBase {
            problem: self.problem,
            drivers: self.drivers,
            effects: self.options.effects,
            frames: Frames::new(&bank, &residual, columns),
            linear,
            residual,
            present,
        }
    }

    /// What a search for one more effect that needs no covariate gains without any.
    pub(super) fn null_gains_of_itself(
        &mut self,
        base: &Fitted,
        round: usize,
    ) -> Option<NullGains> {
        let ground = self.ground(base)?;
        let (_, tried) = ground.of_itself();
        let (count, seed) = (self.options.surrogates, self.seed_of(round) + 1);
        Some(ground.null_gains_of_noise(&tried, Innovations::AsTheyAre, count, seed))
    }

    /// Of the surrogates of this round; the next number is that of those without covariates.
    fn seed_of(&self, round: usize) -> u64 {
        self.options.seed + 2 * round as u64
    }

    /// The most promising trials refitted, each with the p-value of the search that found it.
    pub(super) fn refits(&mut self, base: &Fitted, round: usize) -> Option<Vec<Refitted>> {
        let ground = self.ground(base)?;
        let (count, seed) = (self.options.surrogates, self.seed_of(round));
        let steady = self.steady_law(base);
        let steady = steady.as_ref().and_then(|law| self.ground(law));
        let covariates = self.through_covariates(base, &ground, steady.as_ref());
        let (others, tried) = ground.of_itself();
        let back = best_against_the_motion(&others, &ground);
        let mut best = best_of_each_kind(others);
        best.truncate(MOST_OTHERS);
        best.extend(back);
        let mut others = self.refit_each(base, best);
        self.with_a_step_about_a_steady_law(base, steady.as_ref(), &mut others);
        self.events_at_one_time(base, &mut others);
        // Only what passes the margin is judged by it.
        let of_noise = |kind| ground.null_gains_of_noise(&tried, kind, count, seed + 1);
        let alone = LazyCell::new(|| of_noise(Innovations::AsTheyAre));
        let without_jumps = LazyCell::new(|| of_noise(Innovations::WithoutJumps));
        let mut all = Vec::new();
        let margin = self.options.bic_margin;
        if covariates.iter().any(|one| one.gain > margin) {
            let shifted = ground.null_gains_of(ground.drivers, count, seed);
            let null_gains = self.amplified(base, shifted);
            let covariates = covariates.into_iter().map(|one| {
                let paid = one.paid(self.problem);
                one.judged_by(&null_gains, paid)
            });
            let mut covariates: Vec<Refitted> = covariates.collect();
            let rival = others.iter().map(|one| one.gain).fold(0.0, f64::max);
            self.judge_by_whole_searches(base, &mut covariates, (rival, seed));
            all.extend(covariates.into_iter().map(|one| {
                let net = one.gain;
                if one.is_its_own_shift(one.p_value) {
                    return one.judged_by(&alone, net);
                }
                one
            }));
        } else {
            all.extend(covariates);
        }
        if others.iter().any(|one| one.gain > margin) {
            all.extend(others.into_iter().map(|one| {
                let gain = one.gain;
                if is_jump(&one.term, &ground.frames) {
                    return one.judged_by(&without_jumps, gain);
                }
                one.judged_by(&alone, gain).judged_by_astronomy()
            }));
        } else {
            all.extend(others);
        }
        Some(all)
    }

    /// The best of each covariate, refitted; `steady` is the ground about a steady law.
    pub(super) fn through_covariates(
        &mut self,
        base: &Fitted,
        ground: &TrialBase,
        steady: Option<&TrialBase>,
    ) -> Vec<Refitted> {
        let mut covariates = ground.of_covariates();
        covariates.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        covariates.truncate(MOST_COVARIATES);
        let steady = Self::about_a_steady_law(steady, &covariates);
        covariates.extend(steady);
        let mut covariates = self.refit_each(base, covariates);
        let again = covariates.iter();
        let again = again.filter_map(|one| self.with_another_delay(base, one));
        let again: Vec<Refitted> = again.collect();
        covariates.extend(again);
        let mut best = best_of_each_response(covariates, self.options.bic_margin);
        self.with_free_delays_beside(base, &mut best);
        best
    }

    /// The kinds of what happens once are compared at one time: where the best of them was found, each other one is tried
    /// too. The law linearised seldom has a large event of every kind at its right time.
    fn events_at_one_time(&mut self, base: &Fitted, others: &mut [Refitted]) {
        let events = others
            .iter()
            .filter(|one| one.term.kind.is_event_of_the_ground());
        let Some(best) = events.max_by(|a, b| a.gain.total_cmp(&b.gain)) else {
            return;
        };
        if best.gain < self.options.bic_margin {
            return;
        }
        let (at, share) = (best.term.at, best.term.share);
        for one in others.iter_mut() {
            if !one.term.kind.is_event_of_the_ground() || one.term.at == at {
                continue;
            }
            let term = Term {
                at,
                share,
                ..one.term.clone()
            };
            if let Some(there) = self.refitted(base, &term)
                && there.gain > one.gain
            {
                *one = there;
            }
        }
    }

    fn refit_each(&mut self, base: &Fitted, trials: Vec<Trial>) -> Vec<Refitted> {
        let each = trials.into_iter();
        each.filter_map(|trial| self.refitted(base, &trial.term))
            .collect()
    }

    /// The null gains by the law linearised, made as much larger as full refits of the largest of them are.
    pub(super) fn amplified(&mut self, base: &Fitted, mut null_gains: NullGains) -> NullGains {
        let mut most = 1.0_f64;
        for (term, gain) in std::mem::take(&mut null_gains.largest) {
            let start = Start::at(base).joined(std::slice::from_ref(&term));
            let own = self.bank.iter();
            let own: Vec<Whitener> = own
                .filter(|whitener| whitener.noise.memory == base.noise.memory)
                .cloned()
                .collect();
            if let Some(fitted) = refit(self.problem, &start, &own, &mut self.scratch) {
                let cost = term.parameters() * (self.problem.used as f64).ln();
                let full = base.bic(self.problem) - fitted.bic(self.problem) + cost;
                most = most.max(full / gain.max(1.0));
            }
        }
        null_gains.amplified(most)
    }

    /// The joint fit with one more term, from the law of `base` and from fresh laws; its shape is refined where it
    /// promises something.
    pub(super) fn refitted(&mut self, base: &Fitted, term: &Term) -> Option<Refitted> {
        let problem = self.problem;
        let mut fitted = self.best_start(base, term)?;
        let is_beside = is_event_beside(base, term);
        // The delays beside an event were found without it: with others it may gain a margin more.
        let least = if is_beside {
            -self.options.bic_margin
        } else {
            0.0
        };
        if base.bic(problem) - fitted.bic(problem) > least {
            self.sharpen(&mut fitted);
            if is_beside {
                self.settle_delays(&mut fitted);
                self.sharpen(&mut fitted);
            }
        }
        if matches!(term.act, Act::Friction(_)) {
            fitted = self.fewer_or_more(base, fitted);
        }
        self.known(base, fitted)
    }

    /// What a fit with one more term than `base` has comes to, before any search is made for its p-value.
    pub(super) fn known(&mut self, base: &Fitted, fitted: Fitted) -> Option<Refitted> {
        let problem = self.problem;
        let white = [Whitener::new(problem, Noise::WHITE)];
        let level = refit(problem, &Start::at(&fitted), &white, &mut self.scratch);
        let rms = level.map(|level| level.rms(problem, 0..problem.used));
        Some(Refitted {
            gain: base.bic(problem) - fitted.bic(problem),
            follows_season: candidates::follows_season(problem, fitted.terms.last()?),
            term: fitted.terms.last()?.clone(),
            rms: rms.unwrap_or(f64::INFINITY),
            fitted,
            p_value: 1.0,
        })
    }

    /// The best joint fit with one more term as it is.
    pub(super) fn best_start(&mut self, base: &Fitted, term: &Term) -> Option<Fitted> {
        let (problem, bank) = (self.problem, self.bank);
        let white = [Whitener::new(problem, Noise::WHITE)];
        let mut fits: Vec<Fitted> = Vec::new();
        let fresh = fresh_laws(problem, base, term);
        let mut levels = Vec::from_iter(best_of_starts(problem, &fresh, &mut self.scratch));
        if base.terms.is_empty() {
            let grown = from_the_first_readings(problem, term, &mut self.scratch);
            levels.extend(grown.filter(|grown| grown.prediction.len() == problem.t.len()));
        }
        if is_event_beside(base, term) {
            let joint: Vec<Term> = base.terms.iter().chain([term]).cloned().collect();
            let fresh = fresh_starts(problem, &joint);
            levels.extend(best_of_starts(problem, &fresh, &mut self.scratch));
        }
        levels.extend(under_growing_means(problem, base, term, &mut self.scratch));
        for size in term.act.starts() {
            let start = Start::at(base).with_size(term, *size);
            fits.extend(refit(problem, &start, bank, &mut self.scratch));
            levels.extend(refit(problem, &start, &white, &mut self.scratch));
        }
        // By least squares first as well: from there the fit finds what a noise that remembers would hide.
        levels.sort_by(|a, b| a.deviance.total_cmp(&b.deviance));
        for level in levels.iter().take(LEVELS) {
            let start = under_likeliest(problem, level, bank, &mut self.scratch);
            fits.extend(refit(problem, &start, bank, &mut self.scratch));
        }
        likeliest(problem, fits.into_iter())
    }

    /// Refines the newest term's shape, and fits once more under every noise model.
    pub(super) fn sharpen(&mut self, fitted: &mut Fitted) {
        for stride in STRIDES {
            self.refine(fitted, stride);
        }
        let last = refit(
            self.problem,
            &Start::at(fitted),
            self.bank,
            &mut self.scratch,
        );
        if let Some(last) = last.filter(|last| last.bic(self.problem) < fitted.bic(self.problem)) {
            *fitted = last;
        }
    }

    /// A change of the friction with as many changing parameters as pay for themselves, beside the law of `base`, or, where
    /// that leads to nothing better, beside the law found with it.
    fn fewer_or_more(&mut self, base: &Fitted, found: Fitted) -> Fitted {
        let own = found.terms.last().map_or(0, Term::coefficients);
        let mut beside = Start::at(&found);
        beside.terms.pop();
        beside.parameters.truncate(found.parameters.len() - own);
        for law in [Start::at(base), beside] {
            let best = self.by_count(base, &law, &found);
            if let Some(best) = best.filter(|best| best.bic(self.problem) < found.bic(self.problem))
            {
                return best;
            }
        }
        found
    }

    /// The best of the changes of one, two and three parameters of the friction: from the pace alone, each fit starts where
    /// the one with fewer ended, for all three at once seldom find their way from nothing.
    fn by_count(&mut self, base: &Fitted, law: &Start, found: &Fitted) -> Option<Fitted> {
        let (problem, bank) = (self.problem, self.bank);
        let mut term = found.terms.last()?.clone();
        let mut best: Option<Fitted> = None;
        let mut known: Vec<f64> = Vec::new();
        for count in 1..=MOST_FRICTION {
            term.act = Act::Friction(count);
            let mut start = law.clone().with_size(&term, 1e-3);
            let first = start.parameters.len() - count;
            start.parameters[first..first + known.len()].copy_from_slice(&known);
            let Some(mut fitted) = refit(problem, &start, bank, &mut self.scratch) else {
                continue;
            };
            if base.bic(problem) - fitted.bic(problem) > 0.0 {
                self.sharpen(&mut fitted);
            }
            known = fitted.parameters[first..].to_vec();
            if let Some(last) = fitted.terms.last() {
                term.clone_from(last);
            }
            best = likeliest(problem, best.into_iter().chain([fitted]));
        }
        best
    }

    /// Moves the newest term's delay, or its time, while that helps.
    fn refine(&mut self, fitted: &mut Fitted, stride: Stride) {
        for later in [true, false] {
            while let Some(term) = fitted
                .terms
                .last()
                .and_then(|term| self.moved(term, stride, later))
            {
                let mut start = Start::at(fitted);
                start.terms.pop();
                start.terms.push(term);
                let bank = self.whiteners_of(fitted.noise);
                match refit(self.problem, &start, &bank, &mut self.scratch) {
                    Some(next) if next.bic(self.problem) < fitted.bic(self.problem) - 0.05 => {
                        *fitted = next;
                    }
                    _ => break,
                }
            }
        }
    }

    /// The term with another delay, or at another time; `None` where it has neither, or would leave its range.
    fn moved(&self, term: &Term, stride: Stride, later: bool) -> Option<Term> {
        if term.at.is_some() {
            return self.at_another_time(term, stride, later);
        }
        let mean_days = term.response?.mean_days;
        let factor: f64 = match stride {
            Stride::Coarse => 1.6,
            Stride::Fine => 1.25,
            Stride::Within(_) => return None,
        };
        let factor = if later { factor } else { 1.0 / factor };
        if mean_days > 0.0 {
            return self.with_mean_delay(term, mean_days * factor);
        }
        let driver = Driver::at(self.drivers, term.channel)?;
        later.then(|| self.with_mean_delay(term, SHORTEST * driver.step()))?
    }

    fn at_another_time(&self, term: &Term, stride: Stride, later: bool) -> Option<Term> {
        let (at, sign) = (term.at?, if later { 1.0 } else { -1.0 });
        let by = match stride {
            Stride::Coarse => (self.problem.used / 128).max(1) as f64,
            Stride::Fine => 1.0,
            // A jump of the reading lies between the same two readings all the time.
            Stride::Within(_) if term.is_jump_of_reading() => return None,
            Stride::Within(share) => share,
        };
        let passed = (at as f64 + term.share + sign * by).max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and a place among the readings"
        )]
        let to = passed as usize;
        // One wild reading at either end is no event of the ground; a jump of the reading may come back.
        let margin = if term.is_jump_of_reading() {
            2
        } else {
            candidates::EVENT_MARGIN
        };
        let inside = to >= margin && to + margin < self.problem.used;
        let may_be = inside && (to == at || self.declared != DeclaredPart::EffectAndTime);
        may_be.then(|| {
            if term.is_jump_of_reading() {
                return candidates::jump(self.problem, term.kind, to);
            }
            Term {
                at: Some(to),
                share: passed.fract(),
                ..term.clone()
            }
        })
    }
}

impl Refitted {
    /// The gain before its parameters are paid for, as null gains are.
    pub(super) fn paid(&self, problem: &Problem) -> f64 {
        self.gain + self.term.parameters() * (problem.used as f64).ln()
    }

    /// Shifted by years, what follows the year is the same again: shifts, which give it this p-value, cannot give its time, and that
    /// noise does not do as much has to be enough. The season stays a rival.
    pub(super) fn is_its_own_shift(&self, shifted: f64) -> bool {
        self.follows_season && (SIGNIFICANT..AT_RANDOM).contains(&shifted)
    }
}

/// Whether it is an event of the ground beside effects that were found without it: these have taken up what they could of it, by their sizes, their delays and
/// the law.
fn is_event_beside(base: &Fitted, term: &Term) -> bool {
    !base.terms.is_empty() && term.kind.is_event_of_the_ground()
}

/// Whether a term makes one large innovation of the reading, or, where the noise remembers, of the velocity.
fn is_jump(term: &Term, frames: &Frames) -> bool {
    term.is_jump_of_reading() || (term.kind.jumps() && frames.remembers())
}

/// The best of each covariate by its level, and by its rate, and a second with another delay where the BIC cannot separate them: the one may
/// predict the later block where the other does not.
fn best_of_each_response(mut all: Vec<Refitted>, margin: f64) -> Vec<Refitted> {
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut best: Vec<Refitted> = Vec::new();
    for one in all {
        let mut alike = best.iter().filter(|known| known.is_as(&one));
        let is_kept = match (alike.next(), alike.next()) {
            (None, _) => true,
            (Some(first), None) => {
                first.gain - one.gain < margin && first.term.response != one.term.response
            }
            (Some(_), Some(_)) => false,
        };
        if is_kept {
            best.push(one);
        }
    }
    best
}

#[cfg(test)]
mod tests;
