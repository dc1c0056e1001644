//! The likeliest laws near those of the table, by least squares. Where readings scatter little, the laws of the table are many
//! standard errors from each of them, and a walk that began with the table alone would take thousands of rounds to get there.

use super::Cell;
use super::evidence;
use super::space::{CURVATURE, P, Point, SCATTER, SLOPE};
use super::weigher::LawWeigher;
use crate::fit::damped::{Damping, Descendable, StepOutcome, descend};
use crate::regime::Regime;
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// The coordinates that the predicted rates depend on.
const SHAPED: [usize; 3] = [P, CURVATURE, SLOPE];
/// Standard deviations of the prior of these, about: what the readings do not resolve stays within them.
const PRIOR_WIDTHS: [f64; 3] = [0.4, 1.5, 1.5];
/// Step of a derivative: the past is within 1e-4, and its errors are smoother than that.
const STEP: f64 = 1e-3;
/// Rounds of a descent, how often the scatter is set anew after one, and the gain that ends one.
const ROUNDS: usize = 12;
const RESCALED: usize = 3;
const LEAST_GAIN: f64 = 1e-3;
const TRIES: usize = 6;
/// The scatter of readings that lie on a law.
const LEAST_SCATTER: f64 = 1e-5;
/// Laws are drawn about a mode as widely as the posterior to so many times that, evenly in the log: it has longer tails than a normal one.
const WIDEST: f64 = 6.0;

/// The likeliest law of one side of m = 1 that either gathers speed or loses it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    pub(super) ln: f64,
    pub(super) at: Point,
    /// The lower triangle whose square is the covariance of p, curvature and slope.
    root: Matrix3<f64>,
    /// Standard error of ln of the scatter.
    scatter_error: f64,
}

impl Mode {
    /// A law about this one: the shape and the scatter by the normal density, what remembers as in `near`.
    pub(super) fn draw(&self, near: &Point, generator: &mut Pcg64) -> Point {
        let wider = WIDEST.powf(generator.random());
        let mut normal = || wider * generator.sample::<f64, _>(StandardNormal);
        let moved = self.root * Vector3::from_fn(|_, _| normal());
        let mut at = *near;
        for (coordinate, moved) in SHAPED.into_iter().zip(moved.iter()) {
            at[coordinate] = self.at[coordinate] + moved;
        }
        at[SCATTER] = self.at[SCATTER] + self.scatter_error * normal();
        at
    }
}

/// The modes that are found from the heaviest law of each regime, each with that law.
pub(super) fn modes<'a>(cells: &'a [Cell], weigher: &mut LawWeigher) -> Vec<(&'a Cell, Mode)> {
    let mut modes = Vec::new();
    for regime in Regime::KNOWN {
        let of_it = cells.iter().filter(|cell| cell.shape().regime() == regime);
        let Some(cell) = of_it.max_by(|a, b| a.weight.total_cmp(&b.weight)) else {
            continue;
        };
        let start = weigher.space.at(cell);
        let found = modes_from(&start, weigher);
        modes.extend(found.into_iter().map(|mode| (cell, mode)));
    }
    modes
}

/// The modes that are found from one law, over the whole record and over what that law explains.
pub(super) fn modes_from(start: &Point, weigher: &mut LawWeigher) -> Vec<Mode> {
    let count = weigher.record.from.len();
    let (_, gains, _) = weigher.weigh(start, f64::NEG_INFINITY);
    let explained = evidence::start_at(&gains, &weigher.room, 0.5).map(|law| law.rates);
    let explained = explained.unwrap_or(count);
    let whole = (explained < count).then_some(count);
    let each = [Some(explained), whole].into_iter().flatten();
    each.filter_map(|rates| mode(start, count - rates, weigher))
        .collect()
}

/// The mode that a descent from `start` ends in, over the rates from `first` on.
fn mode(start: &Point, first: usize, weigher: &mut LawWeigher) -> Option<Mode> {
    let mut problem = LeastSquares::from(*start, first, weigher);
    for _ in 0..RESCALED {
        descend(&mut problem, &DAMPING, ROUNDS);
        problem.rescale();
    }
    if !problem.linearise() {
        return None;
    }
    let root = problem.normal.0.try_inverse()?.cholesky()?.l();
    let (at, count) = (problem.at, problem.residuals.len());
    Some(Mode {
        ln: weigher.ln_posterior(&at, f64::NEG_INFINITY),
        at,
        root,
        scatter_error: (0.5 / count as f64).sqrt(),
    })
}

const DAMPING: Damping = Damping {
    most_tries: TRIES,
    ..Damping::PLAIN
};

/// The misses of a law over the newest rates, of which the level of ln v is free.
struct LeastSquares<'a> {
    weigher: &'a mut LawWeigher,
    first: usize,
    at: Point,
    start: Point,
    /// One over the standard error of each rate.
    weights: Vec<f64>,
    /// Misses over their standard errors.
    residuals: Vec<f64>,
    cost: f64,
    normal: (Matrix3<f64>, Vector3<f64>),
}

impl<'a> LeastSquares<'a> {
    fn from(at: Point, first: usize, weigher: &'a mut LawWeigher) -> Self {
        let mut problem = Self {
            weigher,
            first,
            at,
            start: at,
            weights: Vec::new(),
            residuals: Vec::new(),
            cost: f64::INFINITY,
            normal: (Matrix3::identity(), Vector3::zeros()),
        };
        problem.weigh();
        problem
    }

    /// Weighs the rates by the scatter as it stands.
    fn weigh(&mut self) {
        let (record, scatter) = (&self.weigher.record, self.at[SCATTER].exp());
        let rates = self.first..record.from.len();
        let weight = |index| record.variance(index, scatter).sqrt().recip();
        self.weights = rates.map(weight).collect();
        let at = self.at;
        self.residuals = self.residuals_at(&at).unwrap_or_default();
        self.cost = self.cost_of(&self.residuals, &at);
    }

    /// Sets the scatter so that the misses are of its size.
    fn rescale(&mut self) {
        let count = self.residuals.len() as f64;
        let squares: f64 = self.residuals.iter().map(|miss| miss * miss).sum();
        if count == 0.0 || !squares.is_finite() {
            return;
        }
        let factor = (squares / count).sqrt();
        let scatter = self.at[SCATTER].exp() * factor;
        self.at[SCATTER] = scatter.max(LEAST_SCATTER).ln();
        self.weigh();
    }

    /// Misses over their standard errors, the level taken off; `None` where there is no such law.
    fn residuals_at(&mut self, at: &Point) -> Option<Vec<f64>> {
        if self.weigher.space.ln_prior(at) == f64::NEG_INFINITY {
            return None;
        }
        let shape = self.weigher.space.shape(at);
        self.weigher.predict(&shape);
        let read = &self.weigher.record.ln_velocity[self.first..];
        let predicted = &self.weigher.predicted[self.first..];
        let mut misses: Vec<f64> = read
            .iter()
            .zip(predicted)
            .map(|(read, [predicted])| read - predicted)
            .collect();
        let squared = self.weights.iter().map(|weight| weight * weight);
        let total: f64 = squared.clone().sum();
        let level: f64 = squared.zip(&misses).map(|(w, miss)| w * miss).sum::<f64>() / total;
        for (miss, weight) in misses.iter_mut().zip(&self.weights) {
            *miss = (*miss - level) * weight;
        }
        level.is_finite().then_some(misses)
    }

    /// The squares of the misses, and of what lies away from where it began.
    fn cost_of(&self, residuals: &[f64], at: &Point) -> f64 {
        if residuals.is_empty() {
            return f64::INFINITY;
        }
        let away = self.away(at).component_div(&Vector3::from(PRIOR_WIDTHS));
        residuals.iter().map(|miss| miss * miss).sum::<f64>() + away.norm_squared()
    }

    /// How far a point lies from where it began.
    fn away(&self, at: &Point) -> Vector3<f64> {
        Vector3::from(SHAPED.map(|coordinate| at[coordinate] - self.start[coordinate]))
    }
}

impl Descendable for LeastSquares<'_> {
    fn linearise(&mut self) -> bool {
        let at = self.at;
        let mut columns: [Vec<f64>; 3] = Default::default();
        for (slot, coordinate) in columns.iter_mut().zip(SHAPED) {
            let by = |size: f64| {
                let mut moved = at;
                moved[coordinate] += size;
                moved
            };
            let there = match self.residuals_at(&by(STEP)) {
                Some(there) => Some((there, STEP)),
                None => self.residuals_at(&by(-STEP)).map(|there| (there, -STEP)),
            };
            let Some((there, step)) = there else {
                return false;
            };
            *slot = there
                .iter()
                .zip(&self.residuals)
                .map(|(a, b)| (a - b) / step)
                .collect();
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let precision = Vector3::from(PRIOR_WIDTHS.map(|width| width.powi(-2)));
        let mut normal = Matrix3::from_fn(|i, j| dot(&columns[i], &columns[j]));
        normal += Matrix3::from_diagonal(&precision);
        let gradient = Vector3::from_fn(|i, _| dot(&columns[i], &self.residuals));
        let gradient = gradient + precision.component_mul(&self.away(&at));
        self.normal = (normal, gradient);
        !self.residuals.is_empty() && normal.iter().all(|one| one.is_finite())
    }

    fn step(&mut self, damping: f64) -> StepOutcome {
        let (mut normal, gradient) = self.normal;
        for index in 0..3 {
            normal[(index, index)] *= 1.0 + damping;
        }
        let Some(cholesky) = normal.cholesky() else {
            return StepOutcome::NoGain;
        };
        let step = cholesky.solve(&gradient);
        let mut at = self.at;
        for (coordinate, step) in SHAPED.into_iter().zip(step.iter()) {
            at[coordinate] -= step;
        }
        let Some(residuals) = self.residuals_at(&at) else {
            return StepOutcome::NoGain;
        };
        let cost = self.cost_of(&residuals, &at);
        if cost < self.cost {
            let gain = self.cost - cost;
            (self.at, self.residuals, self.cost) = (at, residuals, cost);
            return StepOutcome::Gained { gain, ease: 0.1 };
        }
        StepOutcome::NoGain
    }

    fn goes_on(&self, gain: f64) -> bool {
        gain > LEAST_GAIN * self.cost
    }
}
