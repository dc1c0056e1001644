//! A load that changes over a while, or that comes and goes, and that nothing measures: no effect of the table has its shape. An event,
//! a load that answers to the motion, or a covariate follows such a load part of the way and gains much by it; so what is
//! accepted of them must account for the readings as well as the slow load does.

use super::act::Act;
use super::candidates::{once, slow};
use super::explanation::Candidate;
use super::kind::Kind;
use super::problem::Problem;
use super::refit::{Fitted, Start, likeliest, refit};
use super::rival::Rival;
use super::search::{Refitted, Search};
use super::term::Term;
use crate::reading::after_days;

/// Beginnings of a ramp, or middles of a pulse, that are tried: so many, evenly over the record.
const PLACES: usize = 24;
/// Lengths of ramps, and standard deviations of pulses, as shares of the record.
const RAMPS: [f64; 5] = [0.08, 0.15, 0.25, 0.4, 0.6];
const PULSES: [f64; 4] = [0.025, 0.05, 0.1, 0.2];
/// What is shorter, as a share of the record or in readings, is an event, or not seen to be none.
const SHORTEST_RAMP: (f64, f64) = (0.03, 8.0);
const SHORTEST_PULSE: (f64, f64) = (0.02, 3.0);
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
        let shortest = (shortest.0 * span).max(shortest.1 * problem.spacing);
        self.at >= first && end <= last && self.days >= shortest && self.days <= span
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

    /// When it begins to change, when it changes most or turns, and when it ends.
    fn turns(&self) -> [f64; 3] {
        let first = match self.shape {
            SlowShape::Ramp => self.at,
            SlowShape::Pulse => self.at - self.days,
        };
        let step = match self.shape {
            SlowShape::Ramp => 0.5 * self.days,
            SlowShape::Pulse => self.days,
        };
        [first, first + step, first + 2.0 * step]
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
        let own = all.iter().zip(&deviances);
        let mut own: Vec<(&SlowLoad, &f64)> = own.collect();
        own.sort_by(|a, b| a.1.total_cmp(b.1));
        let mut best: Option<SlowFit> = None;
        for shape in [SlowShape::Ramp, SlowShape::Pulse] {
            // Beside a poor law the likeliest may lie far from where the load changes: the likeliest of each length is fitted.
            let mut fits: Vec<(Fitted, SlowLoad)> = Vec::new();
            for (load, _) in own.iter().filter(|(one, _)| one.shape == shape) {
                if fits
                    .iter()
                    .all(|(_, other)| other.days.to_bits() != load.days.to_bits())
                {
                    let fitted = self.best_start(base, &load.term(problem));
                    fits.extend(fitted.map(|fitted| (fitted, **load)));
                }
            }
            let each = fits.into_iter();
            let first = each.min_by(|a, b| a.0.bic(problem).total_cmp(&b.0.bic(problem)));
            let fitted = first.map(|(fitted, load)| self.slow_fit(base, fitted, load));
            best = best
                .into_iter()
                .chain(fitted)
                .max_by(|a, b| a.gain.total_cmp(&b.gain));
        }
        best
    }

    /// A joint fit with such a load, its place and length moved while that helps.
    fn slow_fit(&mut self, base: &Fitted, fitted: Fitted, load: SlowLoad) -> SlowFit {
        let problem = self.problem;
        let (mut fitted, mut load) = (fitted, load);
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
        SlowFit {
            gain: base.bic(problem) - fitted.bic(problem) - shape,
            fitted,
            load,
        }
    }

    /// The likeliest event about where the slow load changes, found from the law that was found with that load, and the kinds that do as
    /// well: beside a poor law an event seldom finds its place, and the slow load stands for it. `None` where none
    /// comes within the margin of the load.
    pub(super) fn event_instead(
        &mut self,
        base: &Fitted,
        slow: &SlowFit,
    ) -> Option<(Refitted, Vec<Rival>)> {
        let (problem, margin) = (self.problem, self.options.bic_margin);
        let mut each: Vec<Fitted> = Vec::new();
        let events = self.options.effects.iter();
        for definition in events.filter(|definition| !definition.once().is_empty()) {
            let nearest = self.event_from(slow, Kind::of(definition));
            each.extend(nearest.map(|mut fitted| {
                self.sharpen(&mut fitted);
                fitted
            }));
        }
        each.retain(|fitted| {
            // A change of the friction follows almost any bend, and is to account for the readings better than the slow load.
            let newest = fitted.terms.last();
            let least = if newest.is_some_and(|term| matches!(term.act, Act::Friction(_))) {
                slow.gain + margin
            } else {
                slow.gain - margin
            };
            base.bic(problem) - fitted.bic(problem) > least
        });
        each.sort_by(|a, b| a.bic(problem).total_cmp(&b.bic(problem)));
        let fitted = each.first()?.clone();
        let gain = base.bic(problem) - fitted.bic(problem);
        let near = each.iter().skip(1);
        let near = near.filter(|other| other.bic(problem) < fitted.bic(problem) + margin);
        let kinds = near.filter_map(|other| Some(Rival::from(other.terms.last()?.kind)));
        let ties = kinds.collect();
        let one = Refitted {
            term: fitted.terms.last()?.clone(),
            fitted,
            rms: f64::INFINITY,
            follows_season: false,
            gain,
            p_value: 1.0,
        };
        Some((one, ties))
    }

    /// The likeliest event of that kind at one of the turns of the slow load, in place of it.
    fn event_from(&mut self, slow: &SlowFit, kind: Kind) -> Option<Fitted> {
        let problem = self.problem;
        let mut law = Start::at(&slow.fitted);
        law.terms.pop();
        let size = law.parameters.pop()?;
        let mut fits: Vec<Fitted> = Vec::new();
        for day in slow.load.turns() {
            let at = problem.t.partition_point(|t| *t < day);
            if at < 2 || at + 2 >= problem.used {
                continue;
            }
            for term in once(kind, at) {
                let first = if matches!(term.act, Act::Step) {
                    size
                } else if matches!(term.act, Act::Reset) {
                    -size
                } else {
                    term.act.starts()[0]
                };
                let start = law.clone().with_size(&term, first);
                fits.extend(refit(problem, &start, self.bank, &mut self.scratch));
            }
        }
        likeliest(problem, fits.into_iter())
    }

    /// The best of the loads one stride away, where it is better.
    fn nearer_load(
        &mut self,
        fitted: &Fitted,
        load: SlowLoad,
        stride: f64,
    ) -> Option<(Fitted, SlowLoad)> {
        let problem = self.problem;
        let own = self.whiteners_of(fitted.noise);
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
        let [begins, _, _] = slow.load.turns();
        self.candidates
            .retain(|old| old.effect != Kind::UNEXPLAINED);
        self.candidates.push(Candidate {
            effect: Kind::UNEXPLAINED,
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
