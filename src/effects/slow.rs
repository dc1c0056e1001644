//! A load that changes over a while, or that comes and goes, and that nothing measures: no effect of the table has its shape. An event,
//! a load that answers to the motion, or a covariate follows such a load part of the way and gains much by it; so what is
//! accepted of them must account for the readings as well as the slow load does.

use super::candidates::slow;
use super::explanation::Candidate;
use super::kind::Kind;
use super::noise::Whitener;
use super::problem::Problem;
use super::refit::{Fitted, Start, refit};
use super::search::Search;
use super::term::Term;
use crate::reading::after_days;

/// Beginnings of a ramp, or middles of a pulse, that are tried: so many, evenly over the record.
const PLACES: usize = 24;
/// Lengths of ramps, and standard deviations of pulses, as shares of the record.
const RAMPS: [f64; 5] = [0.08, 0.15, 0.25, 0.4, 0.6];
const PULSES: [f64; 4] = [0.025, 0.05, 0.1, 0.2];
/// What is shorter is an event.
const SHORTEST_RAMP: f64 = 0.06;
const SHORTEST_PULSE: f64 = 0.02;
/// By what factor the length, and by what share of it the place, is moved at once.
const STRIDES: [f64; 3] = [0.5, 0.2, 0.07];
/// What its place and its length cost beside its size.
const SHAPE: f64 = 2.0;

/// How it goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SlowShape {
    /// From nothing to a new level.
    Ramp,
    /// As a bell does, up and down again.
    Pulse,
}

/// One such load; days since the first node.
#[derive(Debug, Clone, Copy)]
struct SlowLoad {
    shape: SlowShape,
    /// When a ramp begins, or the middle of a pulse.
    at: f64,
    /// The ramp's length, or the pulse's standard deviation.
    days: f64,
}

/// The likeliest slow load beside a law.
#[derive(Debug)]
pub(super) struct SlowFit {
    pub(super) fitted: Fitted,
    /// Fall of the BIC.
    pub(super) gain: f64,
    load: SlowLoad,
}

impl SlowLoad {
    fn each(problem: &Problem) -> Vec<Self> {
        let (first, span) = (problem.t[0], problem.span());
        let ramps = RAMPS.map(|share| (SlowShape::Ramp, share));
        let pulses = PULSES.map(|share| (SlowShape::Pulse, share));
        let mut all = Vec::new();
        for (shape, share) in ramps.into_iter().chain(pulses) {
            for place in 0..PLACES {
                let at = first + span * (place as f64 + 0.5) / PLACES as f64;
                let days = share * span;
                let one = Self { shape, at, days };
                all.extend(one.is_within(problem).then_some(one));
            }
        }
        all
    }

    /// Whether it is slow, and most of it lies within the record.
    fn is_within(&self, problem: &Problem) -> bool {
        let (first, last, span) = (problem.t[0], problem.t[problem.used - 1], problem.span());
        let (shortest, end) = match self.shape {
            SlowShape::Ramp => (SHORTEST_RAMP, self.at + 0.5 * self.days),
            SlowShape::Pulse => (SHORTEST_PULSE, self.at),
        };
        self.at >= first && end <= last && self.days >= shortest * span && self.days <= span
    }

    fn term(&self, problem: &Problem) -> Term {
        let of = |t: &f64| {
            let passed = (t - self.at) / self.days;
            match self.shape {
                SlowShape::Ramp => passed.clamp(0.0, 1.0),
                SlowShape::Pulse => (-0.5 * passed * passed).exp(),
            }
        };
        slow(problem.nodes.iter().map(of).collect())
    }

    /// Longer, shorter, later and earlier by a share of its length.
    fn beside(&self, stride: f64) -> [Self; 4] {
        let longer = |factor: f64| Self {
            days: self.days * factor,
            ..*self
        };
        let later = |share: f64| Self {
            at: self.at + share * self.days,
            ..*self
        };
        [
            longer(1.0 + stride),
            longer(1.0 / (1.0 + stride)),
            later(stride),
            later(-stride),
        ]
    }
}

impl Search<'_> {
    /// The likeliest slow load beside `base`; `None` where none can be fitted.
    pub(super) fn slow_load(&mut self, base: &Fitted) -> Option<SlowFit> {
        let ground = self.ground(base)?;
        let problem = self.problem;
        let all = SlowLoad::each(problem);
        let columns = all
            .iter()
            .flat_map(|one| ground.linear.columns(problem, &one.term(problem)));
        let deviances = ground
            .frames
            .deviance_with_each(&columns.collect::<Vec<_>>());
        let mut best: Option<SlowFit> = None;
        for shape in [SlowShape::Ramp, SlowShape::Pulse] {
            let own = all.iter().zip(&deviances);
            let own = own.filter(|(one, _)| one.shape == shape);
            let Some((load, _)) = own.min_by(|a, b| a.1.total_cmp(b.1)) else {
                continue;
            };
            let fitted = self.with_slow_load(base, *load);
            best = best
                .into_iter()
                .chain(fitted)
                .max_by(|a, b| a.gain.total_cmp(&b.gain));
        }
        best
    }

    /// The joint fit with such a load, its place and length moved while that helps.
    fn with_slow_load(&mut self, base: &Fitted, load: SlowLoad) -> Option<SlowFit> {
        let problem = self.problem;
        let mut fitted = self.best_start(base, &load.term(problem))?;
        let mut load = load;
        for stride in STRIDES {
            while let Some((next, other)) = self.nearer_load(&fitted, load, stride) {
                (fitted, load) = (next, other);
            }
        }
        let last = refit(problem, &Start::at(&fitted), self.bank, &mut self.scratch);
        if let Some(last) = last.filter(|last| last.bic(problem) < fitted.bic(problem)) {
            fitted = last;
        }
        let shape = SHAPE * (problem.used as f64).ln();
        Some(SlowFit {
            gain: base.bic(problem) - fitted.bic(problem) - shape,
            fitted,
            load,
        })
    }

    /// The best of the loads one stride away, where it is better.
    fn nearer_load(
        &mut self,
        fitted: &Fitted,
        load: SlowLoad,
        stride: f64,
    ) -> Option<(Fitted, SlowLoad)> {
        let problem = self.problem;
        let own = self.bank.iter().filter(|one| one.noise == fitted.noise);
        let own: Vec<Whitener> = own.cloned().collect();
        let beside = load.beside(stride).into_iter();
        let each = beside.filter(|other| other.is_within(problem));
        let each = each.filter_map(|other| {
            let mut start = Start::at(fitted);
            start.terms.pop();
            start.terms.push(other.term(problem));
            let there = refit(problem, &start, &own, &mut self.scratch)?;
            Some((there, other))
        });
        let best = each.min_by(|a, b| a.0.bic(problem).total_cmp(&b.0.bic(problem)))?;
        (best.0.bic(problem) < fitted.bic(problem) - 0.1).then_some(best)
    }

    /// Writes down that a slow load was tried, and what it came to.
    pub(super) fn note_slow(&mut self, slow: &SlowFit, reason: String) {
        let begins = match slow.load.shape {
            SlowShape::Ramp => slow.load.at,
            SlowShape::Pulse => slow.load.at - slow.load.days,
        };
        self.candidates
            .retain(|old| old.effect != Kind::Unexplained);
        self.candidates.push(Candidate {
            effect: Kind::Unexplained,
            channel: None,
            form: None,
            at: after_days(self.problem.epoch, begins.max(0.0)),
            lag_days: None,
            bic_gain: slow.gain,
            p_value: None,
            held_out: None,
            rejected_because: Some(reason),
        });
    }
}

#[cfg(test)]
mod tests;
