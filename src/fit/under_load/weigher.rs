//! One law between those of the table, weighed by the record.

use super::evidence::{self, Room, ShapeEvidence, StartedLaw, weigh};
use super::gains::{Gains, LoadMemory, RateRecord};
use super::joined::{self, MOST_JOINED, WalksBefore};
use super::past::PastSolution;
use super::space::{DrawnShape, Point, Space};

/// What a point is weighed with, used again and again.
pub(super) struct LawWeigher {
    pub(super) record: RateRecord,
    pub(super) space: Space,
    past: PastSolution,
    pub(super) predicted: Vec<[f64; 1]>,
    /// ln(1 + |r| t) at the middle of each rate, where the law drifts by it.
    e_folds: Vec<f64>,
    /// What came before each rate, by no law.
    before: WalksBefore,
    pub(super) room: Room<1>,
    pub(super) evaluations: usize,
}

impl LawWeigher {
    pub(super) fn new(space: Space, record: RateRecord) -> Self {
        let count = record.from.len();
        Self {
            space,
            record,
            past: PastSolution::default(),
            predicted: vec![[0.0]; count],
            e_folds: vec![0.0; count],
            before: WalksBefore::default(),
            room: Room::default(),
            evaluations: 0,
        }
    }

    /// The evidence of a law, and the gains that gave it.
    pub(super) fn weigh(&mut self, at: &Point, least: f64) -> (ShapeEvidence, Gains, DrawnShape) {
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
    pub(super) fn ln_posterior(&mut self, at: &Point, least: f64) -> f64 {
        let prior = self.space.ln_prior(at);
        if prior == f64::NEG_INFINITY {
            return prior;
        }
        let (found, _, shape) = self.weigh(at, least - prior);
        let now = found.ln_velocity + self.record.centre;
        found.ln + prior + self.space.ln_prior_of_kept(&shape, now)
    }

    /// ln of the velocity of a law that begins there, less the record's centre, and its variance.
    pub(super) fn level(&self, gains: &Gains, started: &StartedLaw, share: f64) -> (f64, f64) {
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
    pub(super) fn predict(&mut self, shape: &DrawnShape) {
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
