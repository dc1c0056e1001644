//! A population of laws that walks over the posterior: each is moved along the difference of two others (differential
//! evolution, ter Braak 2006), so that steps have the posterior's own shape and size.

use super::Cell;
use super::evidence::{self, Room, ShapeEvidence, StartedLaw, weigh};
use super::gains::{Gains, LoadMemory, RateRecord};
use super::joined::{self, MOST_JOINED, WalksBefore};
use super::past::PastSolution;
use super::search::GridSearch;
use super::space::{DrawnShape, Point, Space};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Laws in the population, and how many of those about the table's laws each is chosen from.
const WALKERS: usize = 64;
const CHOSEN_FROM: usize = 3;
/// Steps along differences, over the size that is best for a normal posterior: 2.38 over the root of twice its dimensions.
const STEP: f64 = 0.636;
/// One round in this many goes the whole difference, from one mode to another.
const WHOLE: usize = 8;
/// How much the size of a step varies, and what is added to it.
const VARIED: f64 = 0.2;
const SHAKEN: f64 = 1e-3;
/// The seed: the same readings give the same laws.
const SEED: u64 = 2004;

/// One law of the population.
#[derive(Debug, Clone, Copy)]
struct Walker {
    at: Point,
    ln: f64,
}

/// A law that was drawn, with where it starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct DrawnLaw {
    pub(super) shape: DrawnShape,
    pub(super) started: StartedLaw,
    /// ln v less the record's centre, and its variance: of the law under today's load where that changes, or else without what
    /// the readings scatter by.
    pub(super) level: (f64, f64),
    /// Variance of a reading about the law.
    pub(super) variance: f64,
    /// A standard normal number for its velocity.
    pub(super) deviate: f64,
}

/// What a point is weighed with, used again and again.
struct LawWeigher {
    record: RateRecord,
    space: Space,
    past: PastSolution,
    predicted: Vec<[f64; 1]>,
    /// ln(1 + |r| t) at the middle of each rate, where the law drifts by it.
    e_folds: Vec<f64>,
    /// What came before each rate, by no law.
    before: WalksBefore,
    room: Room<1>,
    evaluations: usize,
}

/// A population on its way.
pub(super) struct Walk {
    scales: LawWeigher,
    walkers: Vec<Walker>,
    generator: Pcg64,
    rounds: usize,
}

impl LawWeigher {
    /// The evidence of a law, and the gains that gave it.
    fn weigh(&mut self, at: &Point, least: f64) -> (ShapeEvidence, Gains, DrawnShape) {
        self.evaluations += 1;
        let shape = self.space.shape(at);
        self.predict(&shape);
        let memory = LoadMemory::new(&self.record, &self.space.noise(at));
        self.before.walk(&self.record, &memory);
        let gains = Gains::new(&self.record, &memory, &self.e_folds, &self.before.ln);
        let joins = self.joins();
        let least = if joins { least - MOST_JOINED } else { least };
        let [mut found] = weigh(&self.record, &self.predicted, &gains, least, &mut self.room);
        if joins && found.ln.is_finite() {
            let best = joined::join(&self.before, &self.predicted, &gains, &mut self.room);
            found = evidence::over_all_starts(&gains, &self.room, best);
        }
        (found, gains, shape)
    }

    /// Whether a law begins where the walk before it ends: one that drifts had left that velocity.
    fn joins(&self) -> bool {
        self.record.assumed.drift == 0.0 && self.record.assumed.follows_errors
    }

    /// ln of the posterior density; minus infinity where it cannot reach `least`.
    fn ln_posterior(&mut self, at: &Point, least: f64) -> f64 {
        let prior = self.space.ln_prior(at);
        if prior == f64::NEG_INFINITY {
            return prior;
        }
        let (found, _, shape) = self.weigh(at, least - prior);
        let now = found.ln_velocity + self.record.centre;
        found.ln + prior + self.space.ln_prior_of_kept(&shape, now)
    }

    /// ln of the velocity of a law that begins there, less the record's centre, and its variance.
    fn level(&self, gains: &Gains, started: &StartedLaw, share: f64) -> (f64, f64) {
        let found = &started.evidence;
        let [of_velocity, of_load, both] = found.today;
        if self.record.assumed.load_changes {
            return (found.ln_velocity, of_velocity);
        }
        let joined = self
            .joins()
            .then(|| {
                let of = (started.rates, self.predicted.as_slice());
                joined::level_joined(&self.before, (gains, &self.room), of, share)
            })
            .flatten();
        let alone = (
            found.ln_velocity - found.load,
            of_velocity + of_load - 2.0 * both,
        );
        joined.unwrap_or(alone)
    }

    /// ln of the mean rates in units of the velocity now.
    fn predict(&mut self, shape: &DrawnShape) {
        let record = &self.record;
        self.past.solve(shape.past, record.from[0]);
        let mut hint = 0;
        let mut before: Option<(f64, f64)> = None;
        for index in (0..record.from.len()).rev() {
            let (from, to) = (record.from[index], record.to[index]);
            let ln = if from > to {
                let newer = match before {
                    Some((ago, slip)) if ago.to_bits() == to.to_bits() => slip,
                    _ => self.past.at(to, &mut hint).1,
                };
                let older = self.past.at(from, &mut hint).1;
                before = Some((from, older));
                ((older - newer) / (from - to)).max(1e-300).ln()
            } else {
                -self.past.at(to, &mut hint).0
            };
            self.predicted[index] = [ln];
        }
        if record.assumed.drift > 0.0 {
            let size = shape.past.r.abs();
            for (slot, middle) in self.e_folds.iter_mut().zip(&record.middle) {
                *slot = (size * middle).ln_1p();
            }
        }
    }
}

impl Walk {
    /// A population about the laws of the table, each in proportion to its weight.
    pub(super) fn about(cells: &[Cell], search: GridSearch) -> Option<Self> {
        let GridSearch { record, prior, .. } = search;
        let count = record.from.len();
        let mut walk = Self {
            scales: LawWeigher {
                space: Space::new(prior, &record),
                record,
                past: PastSolution::default(),
                predicted: vec![[0.0]; count],
                e_folds: vec![0.0; count],
                before: WalksBefore::default(),
                room: Room::default(),
                evaluations: 0,
            },
            walkers: Vec::new(),
            generator: Pcg64::seed_from_u64(SEED),
            rounds: 0,
        };
        let wanted = WALKERS * CHOSEN_FROM;
        let mut reached = 0.0;
        let mut tried: Vec<Walker> = Vec::with_capacity(wanted);
        for cell in cells {
            reached += cell.weight;
            while (tried.len() as f64 + 0.5) < reached * wanted as f64 && tried.len() < wanted {
                let at = walk.scales.space.near(cell, &mut walk.generator);
                let ln = walk.scales.ln_posterior(&at, f64::NEG_INFINITY);
                tried.push(Walker { at, ln });
            }
        }
        walk.choose(&tried);
        (!walk.walkers.is_empty()).then_some(walk)
    }

    /// Chooses the population: by the root of the posterior, so that it is wider than that.
    fn choose(&mut self, tried: &[Walker]) {
        let best = tried
            .iter()
            .map(|one| one.ln)
            .fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() {
            return;
        }
        let weight = |one: &Walker| (0.5 * (one.ln - best)).exp();
        let total: f64 = tried.iter().map(weight).sum();
        let mut reached = 0.0;
        for one in tried {
            reached += weight(one) / total;
            while (self.walkers.len() as f64 + 0.5) < reached * WALKERS as f64
                && self.walkers.len() < WALKERS
            {
                self.walkers.push(*one);
            }
        }
    }

    /// Moves each law of the population once.
    pub(super) fn round(&mut self) {
        self.rounds += 1;
        let count = self.walkers.len();
        let step = if self.rounds.is_multiple_of(WHOLE) {
            1.0
        } else {
            STEP
        };
        for index in 0..count {
            let other = |away: usize| (index + away) % count;
            let one = other(self.generator.random_range(1..count.max(2)));
            let two = other(self.generator.random_range(1..count.max(2)));
            let size: f64 = self.generator.sample(StandardNormal);
            let along = self.walkers[one].at - self.walkers[two].at;
            let shake = Point::from_fn(|_, _| self.generator.sample::<f64, _>(StandardNormal));
            let size = if step < 1.0 {
                step * (VARIED * size).exp()
            } else {
                step
            };
            let at = self.walkers[index].at + along * size + shake * SHAKEN;
            let luck = self.generator.random::<f64>().max(1e-300).ln();
            let least = self.walkers[index].ln + luck;
            let ln = self.scales.ln_posterior(&at, least);
            if ln >= least {
                self.walkers[index] = Walker { at, ln };
            }
        }
    }

    /// Doubts the rates that the best law so far cannot explain, and weighs the population again.
    pub(super) fn doubt(&mut self) {
        let best = self.walkers.iter().max_by(|a, b| a.ln.total_cmp(&b.ln));
        let Some(at) = best.map(|best| best.at) else {
            return;
        };
        let scales = &mut self.scales;
        let (_, gains, _) = scales.weigh(&at, f64::NEG_INFINITY);
        let lane = (0, scales.space.noise(&at).scatter);
        let squares = evidence::misses(&scales.record, &scales.predicted, lane, &gains);
        scales.record.doubt(&squares);
        for walker in &mut self.walkers {
            walker.ln = scales.ln_posterior(&walker.at, f64::NEG_INFINITY);
        }
    }

    /// The population as it is, each law with a start and a velocity drawn.
    pub(super) fn draw(&mut self) -> Vec<DrawnLaw> {
        let mut drawn = Vec::with_capacity(self.walkers.len());
        for walker in &self.walkers {
            let (_, gains, shape) = self.scales.weigh(&walker.at, f64::NEG_INFINITY);
            let shares = [0; 2].map(|_| self.generator.random::<f64>());
            let noise = self.scales.space.noise(&walker.at);
            let deviate = self.generator.sample(StandardNormal);
            let scales = &self.scales;
            let started = evidence::start_at(&gains, &scales.room, shares[0]);
            drawn.extend(started.map(|started| DrawnLaw {
                shape,
                level: scales.level(&gains, &started, shares[1]),
                started,
                variance: noise.scatter.powi(2) + noise.sigma.powi(2),
                deviate,
            }));
        }
        drawn
    }

    /// The record that the laws are weighed with.
    pub(super) fn record(&self) -> &RateRecord {
        &self.scales.record
    }

    /// Laws weighed so far.
    pub(super) fn evaluations(&self) -> usize {
        self.scales.evaluations
    }
}
