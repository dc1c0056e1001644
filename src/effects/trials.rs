//! The linear search: everything that may be missing, by what it would take off the misfit.

use super::candidates::{
    all_along, delays, event_times, in_load, in_reading, jump, jumps, once, responses,
    times_of_jumps,
};
use super::definition::{EffectDefinition, Trying};
use super::frame::Frames;
use super::kind::{Form, Kind};
use super::linear::Linear;
use super::noise::{Memory, Whitener};
use super::problem::Problem;
use super::response::Driver;
use super::surrogate::{
    Innovations, NullGains, SearchedCovariates, Tried, noise_alone, shifted_covariates,
};
use super::term::Term;

/// A term with its linear gain.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub(super) term: Term,
    /// Fall of the BIC by the law linearised.
    pub(super) gain: f64,
}

/// What stands before a search for one more effect.
pub(super) struct TrialBase<'a> {
    pub(super) problem: &'a Problem,
    pub(super) drivers: &'a [Driver],
    /// The effects that are tried.
    pub(super) effects: &'static [&'static EffectDefinition],
    pub(super) linear: Linear,
    pub(super) frames: Frames,
    /// Readings less prediction.
    pub(super) residual: Vec<f64>,
    /// The terms already in the law.
    pub(super) present: &'a [Term],
}

/// The noise models that a search for one more effect goes through: white, the likeliest of either memory, and
/// those of the same memory that are smaller, as they will be once the effect is in.
pub(super) fn shortlist(frames: &Frames) -> Vec<Whitener> {
    let mut list = vec![frames.each[0].whitener.clone()];
    for memory in [Memory::Reading, Memory::Load] {
        let own = frames
            .each
            .iter()
            .filter(|frame| frame.whitener.noise.memory == memory);
        let Some(best) = own.min_by(|a, b| a.deviance(a.misfit).total_cmp(&b.deviance(b.misfit)))
        else {
            continue;
        };
        let best = best.whitener.noise;
        for frame in &frames.each {
            let noise = frame.whitener.noise;
            let same = |one: f64, other: f64| one.total_cmp(&other).is_eq();
            let alike = noise.memory == memory
                && same(noise.days, best.days)
                && same(noise.longer, best.longer);
            if alike && noise.ratio <= best.ratio {
                list.push(frame.whitener.clone());
            }
        }
    }
    list
}

impl TrialBase<'_> {
    /// The BIC's price of a term.
    pub(super) fn cost(&self, term: &Term) -> f64 {
        term.parameters() * (self.problem.used as f64).ln()
    }

    /// What a term adds to the directions, for null gains.
    pub(super) fn tried(&self, term: &Term) -> Tried {
        let columns = self.linear.columns(self.problem, term);
        Tried::new(&self.frames, &columns, self.cost(term))
    }

    /// What an effect may be through a covariate, by kinds of response of which each has a best one: in the load those by its level
    /// and those by its rate, in the reading those that the quantity has.
    pub(super) fn through(&self, kind: Kind, own: &Driver) -> Vec<Vec<Term>> {
        let (problem, delays) = (self.problem, delays(self.problem, own));
        match kind.definition().trying {
            Trying::CovariateInLoad(_) => [Form::Level, Form::Rate]
                .map(|form| {
                    let each = responses(form, &delays).into_iter();
                    let terms = each.filter_map(|one| in_load(problem, kind, own, one));
                    terms.collect()
                })
                .into(),
            Trying::CovariateInReading(_) => {
                let each = delays.into_iter();
                let terms = each.filter_map(|days| in_reading(problem, kind, own, 1, days));
                vec![terms.collect()]
            }
            Trying::AllAlong(_) | Trying::Once(_) | Trying::JumpOfReading | Trying::Elsewhere => {
                Vec::new()
            }
        }
    }

    pub(super) fn trial(&self, term: Term) -> Trial {
        let columns = self.linear.columns(self.problem, &term);
        let gain = self.frames.deviance() - self.frames.deviance_with(&columns) - self.cost(&term);
        Trial { term, gain }
    }

    /// The best response of each covariate, by its level and by its rate, on the load, and of temperatures in the reading as well.
    pub(super) fn of_covariates(&self) -> Vec<Trial> {
        let mut trials = Vec::new();
        for driver in self.drivers {
            let is_tried = |kind: &Kind| kind.definition().is_tried_through(driver.kind);
            for kind in self.kinds().filter(is_tried) {
                let own = |term: &Term| term.kind == kind && term.channel == Some(driver.index);
                if self.present.iter().any(own) {
                    continue;
                }
                for terms in self.through(kind, driver) {
                    let each = terms.into_iter().map(|term| self.trial(term));
                    trials.extend(each.max_by(|a, b| a.gain.total_cmp(&b.gain)));
                }
            }
        }
        trials
    }

    /// The kinds of effects that are tried.
    fn kinds(&self) -> impl Iterator<Item = Kind> {
        self.effects.iter().map(|definition| Kind::of(definition))
    }

    /// The readings before which something that happens once is tried.
    pub(super) fn event_times(&self) -> Vec<usize> {
        let mut times = event_times(self.problem);
        times.extend(times_of_jumps(self.problem, self.frames.innovations()));
        times.sort_unstable();
        times.dedup();
        times
    }

    /// Everything that needs no covariate, with the directions it adds.
    pub(super) fn of_itself(&self) -> (Vec<Trial>, Vec<Tried>) {
        // Of waves of one period, in the load and in the reading, one is enough.
        let is_new = |kind: &Kind| {
            let waves = kind.definition().wave_periods;
            let is_there = |term: &Term| {
                let present = term.kind.definition().wave_periods;
                term.kind == *kind || !waves.is_empty() && waves.first() == present.first()
            };
            !self.present.iter().any(is_there)
        };
        let mut terms = Vec::new();
        for kind in self.kinds().filter(is_new) {
            terms.extend(all_along(self.problem, kind));
        }
        for at in self.event_times() {
            terms.extend(self.kinds().flat_map(|kind| once(kind, at)));
        }
        let jumps = jumps(self.problem, &self.residual);
        let kinds = self.kinds();
        for kind in kinds.filter(|kind| kind.definition().is_jump_of_reading()) {
            terms.extend(jumps.iter().map(|at| jump(self.problem, kind, *at)));
        }
        let (mut trials, mut tried) = (Vec::new(), Vec::new());
        for term in terms {
            let one = self.tried(&term);
            let left = self.frames.each.iter();
            let left: Vec<(Vec<f64>, f64)> = left.map(|f| (f.residual.clone(), f.misfit)).collect();
            let gain = self.frames.deviance() - one.deviance(&self.frames, &left);
            trials.push(Trial { term, gain });
            tried.push(one);
        }
        (trials, tried)
    }

    /// What the search over these covariates gains without any effect.
    pub(super) fn null_gains_of(&self, drivers: &[Driver], count: usize, seed: u64) -> NullGains {
        let searched = SearchedCovariates {
            problem: self.problem,
            effects: self.effects,
            linear: &self.linear,
            frames: &self.frames,
        };
        shifted_covariates(searched, drivers, count, seed)
    }

    /// What the search without covariates gains without any effect.
    pub(super) fn null_gains_of_noise(
        &self,
        tried: &[Tried],
        kind: Innovations,
        count: usize,
        seed: u64,
    ) -> NullGains {
        noise_alone(&self.frames, tried, kind, count, seed)
    }
}

/// The best jump of the reading against the motion, where that of all is along it: which may be slip, and is refused then.
pub(super) fn best_against_the_motion(trials: &[Trial], ground: &TrialBase) -> Option<Trial> {
    let back = |trial: &&Trial| {
        let at = trial.term.at.filter(|at| *at > 0);
        at.is_some_and(|at| ground.residual[at] < ground.residual[at - 1])
    };
    let by_gain = |a: &&Trial, b: &&Trial| a.gain.total_cmp(&b.gain);
    let jumps = || trials.iter().filter(|one| one.term.is_jump_of_reading());
    let best = jumps().max_by(by_gain)?;
    let against = jumps().filter(back).max_by(by_gain)?;
    (!back(&best) && against.gain > 0.0).then(|| against.clone())
}

/// The best of each kind, those that gain most first.
pub(super) fn best_of_each_kind(mut trials: Vec<Trial>) -> Vec<Trial> {
    trials.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut best: Vec<Trial> = Vec::new();
    for trial in trials {
        if !best.iter().any(|known| known.term.kind == trial.term.kind) {
            best.push(trial);
        }
    }
    best
}
