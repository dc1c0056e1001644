//! The linear search: everything that may be missing, by what it would take off the misfit.

use super::candidates::{
    delays, event_times, events, feedbacks, jumps, of_channel, offset, responses, seasonal,
    thermal, tides, times_of_jumps,
};
use super::frame::Frames;
use super::kind::{Form, Kind};
use super::linear::Linear;
use super::noise::{Memory, Whitener};
use super::problem::Problem;
use super::response::Driver;
use super::surrogate::{
    Innovations, NullGains, SearchedDriver, Tried, noise_alone, shifted_covariates,
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
    pub(super) drivers: &'a [(usize, Driver)],
    /// Whether each driver is a temperature.
    pub(super) temperatures: &'a [bool],
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
            let alike = noise.memory == memory && noise.days.total_cmp(&best.days).is_eq();
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

    /// A covariate's responses in the load, by its level or by its rate.
    pub(super) fn in_load(&self, (index, driver): (usize, &Driver), form: Form) -> Vec<Term> {
        let responses = responses(form, &delays(self.problem, driver)).into_iter();
        let each = responses.filter_map(|one| of_channel(self.problem, (index, driver), one));
        each.collect()
    }

    /// A temperature's responses in the reading.
    pub(super) fn in_reading(&self, (index, driver): (usize, &Driver)) -> Vec<Term> {
        let delays = delays(self.problem, driver).into_iter();
        let each = delays.filter_map(|days| thermal(self.problem, (index, driver), 1, days));
        each.collect()
    }

    pub(super) fn trial(&self, term: Term) -> Trial {
        let columns = self.linear.columns(self.problem, &term);
        let gain = self.frames.deviance() - self.frames.deviance_with(&columns) - self.cost(&term);
        Trial { term, gain }
    }

    /// The best response of each covariate, by its level and by its rate, on the load, and of temperatures in the reading as well.
    pub(super) fn of_covariates(&self) -> Vec<Trial> {
        let mut trials = Vec::new();
        for (driver, temperature) in self.drivers.iter().zip(self.temperatures) {
            let present = |kind: Kind| {
                let own = |term: &Term| term.kind == kind && term.channel == Some(driver.0);
                self.present.iter().any(own)
            };
            let own = (driver.0, &driver.1);
            for form in [Form::Level, Form::Rate] {
                if present(Kind::Hydrological) {
                    continue;
                }
                let each = self.in_load(own, form).into_iter();
                let each = each.map(|term| self.trial(term));
                trials.extend(each.max_by(|a, b| a.gain.total_cmp(&b.gain)));
            }
            if *temperature && !present(Kind::Thermal) {
                let each = self.in_reading(own).into_iter();
                let each = each.map(|term| self.trial(term));
                trials.extend(each.max_by(|a, b| a.gain.total_cmp(&b.gain)));
            }
        }
        trials
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
        let present = |kind: Kind| self.present.iter().any(|term| term.kind == kind);
        let mut terms = Vec::new();
        let all_along = seasonal(self.problem)
            .into_iter()
            .chain(tides(self.problem))
            .chain(feedbacks(self.problem));
        terms.extend(all_along.filter(|term| !present(term.kind)));
        for at in self.event_times() {
            terms.extend(events(at));
        }
        let jumps = jumps(self.problem, &self.residual);
        terms.extend(jumps.into_iter().map(|at| offset(self.problem, at)));
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
    pub(super) fn null_gains_of(
        &self,
        drivers: &[(usize, Driver)],
        count: usize,
        seed: u64,
    ) -> NullGains {
        let both = (&self.linear, &self.frames);
        let known = || self.drivers.iter().zip(self.temperatures);
        let searched = drivers.iter().map(|(index, driver)| SearchedDriver {
            index: *index,
            driver,
            is_temperature: known().any(|((own, _), is_one)| own == index && *is_one),
        });
        let searched: Vec<SearchedDriver<'_>> = searched.collect();
        shifted_covariates(self.problem, &searched, both, (count, seed))
    }

    /// What the search without covariates gains without any effect.
    pub(super) fn null_gains_of_noise(
        &self,
        tried: (&[Tried], Innovations),
        count: usize,
        seed: u64,
    ) -> NullGains {
        noise_alone(&self.frames, tried, (count, seed))
    }
}
