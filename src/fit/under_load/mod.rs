//! The posterior of the law. What is assumed of the load and of the scatter is an argument ([`Assumptions`]): it may have changed
//! undeclared, which is what the monitor uses, or it was constant, the special case that `fit` gives parameters of.
//!
//! The velocity is that of the law times e^f. Beside the law's parameters, three things are uncertain:
//!
//! - the log-load f, Ornstein-Uhlenbeck with a standard deviation and a memory of its own; under a constant load that is
//!   scatter which remembers, and no part of the law;
//! - the law itself: seen from the present, ln v drifts off with each e-fold of the time to failure that one looks back, so
//!   that old readings weigh less than new ones; under a constant load it does not;
//! - where the law begins: before its start, which may be any reading, the velocity is a random walk.
//!
//! The law is taken in the coordinates of the present. The velocity and the load of today are integrated exactly, by a linear
//! filter that runs from the present into the past (`gains`), which gives the evidence of every start in one pass
//! (`evidence`). What is left, the shape (p and the ratio of healing to acceleration), the slope r and the noise, is gone through
//! in two ways. [`LoadPosterior`] runs over a table of shapes (`shape`) and a grid of ln r (`search`): deterministic and fast,
//! for forecasts with every reading. [`LawDraws`] begins there and at the likeliest laws near them (`modes`), and draws laws between those of the table (`space`, `population`):
//! intervals of parameters need draws of what is continuous.
//!
//! Priors (`prior`): nearly uniform in ln r (falling as r^-0.1), from 1/(50 lengths of the record), and no more than
//! 1/5000 of one over the newest sampling interval, to twice that, where r times the interval is also
//! half-normal with standard deviation 1.5; accelerating and slowing
//! down alike. Where the load may change, of the slopes that are watched: m above 1 with probability 0.65, and ln of the velocity
//! that a stable slope will keep half-normal above 2 mm/day with standard deviation 1 (a slope that keeps a velocity mostly
//! keeps a low one: "very slow" ends at 4.4 mm/day, Cruden and Varnes 1996). Under a constant load either side of m = 1 alike,
//! however near (kappa times the length of the record is Cauchy), and any velocity: the readings alone decide. f, its memory and the scatter of the
//! readings over grids, each point alike; drawn laws have continuous ones (`space`). An outlier's error has the tails of Student's t.

mod assumptions;
mod draws;
mod evidence;
mod future;
mod gains;
mod joined;
mod modes;
mod other_prior;
mod past;
mod population;
mod prior;
mod search;
mod shape;
mod space;
mod weigher;

pub use assumptions::Assumptions;
pub use draws::{LawDraws, Onset};
pub use other_prior::OtherPrior;
pub use prior::P_PRIOR;

use super::rates::Rate;
use crate::model::Law;
use crate::regime::Regime;
use search::GridSearch;
use serde::{Deserialize, Serialize};
use shape::Shape;
use std::collections::BTreeMap;

/// Fewest rates.
const FEWEST_RATES: usize = 5;
/// The heaviest laws, by which a next reading is predicted.
const HEAVIEST: usize = 64;

/// One law out of the posterior, with t = 0 at the present.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LawSample {
    /// The law.
    pub law: Law,
    /// Its share of the probability.
    pub weight: f64,
}

/// A weighted sample of laws that agree with the readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    /// The present: the time of the last reading used, days.
    pub now_days: f64,
    /// The laws; their weights sum to 1.
    pub samples: Vec<LawSample>,
    /// Standard deviation of a rate about the one by the law, as a fraction of it.
    pub scatter: f64,
}

/// A law, with what the readings say of the velocity and of the load of today.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    shape: usize,
    /// |r|, 1/day.
    r: f64,
    /// Standard deviation of the load, and its memory in days.
    sigma: f64,
    tau: f64,
    /// ln of the velocity (mm/day) and the load of today: means, variances and covariance.
    ln_velocity: f64,
    load: f64,
    variances: (f64, f64),
    covariance: f64,
    /// Relative scatter of a reading.
    scatter: f64,
    weight: f64,
}

impl Cell {
    fn shape(&self) -> &'static Shape {
        &shape::SHAPES[self.shape]
    }

    /// Under today's load.
    fn law(&self) -> Law {
        let shape = self.shape();
        let (r, kappa) = shape.slope_and_curvature(self.r);
        Law::from_fit(self.ln_velocity.exp(), r, kappa, shape.p)
    }
}

/// The law under an undeclared load, as the readings leave it open.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadPosterior {
    /// The present: the end of the last rate, days.
    pub now_days: f64,
    cells: Vec<Cell>,
}

impl LoadPosterior {
    /// Fits `rates`, oldest first; `None` with fewer than five, or where none of them moves.
    pub fn fit(rates: &[Rate]) -> Option<Self> {
        let moves = rates.iter().any(|rate| rate.velocity > 0.0);
        if rates.len() < FEWEST_RATES || !moves {
            return None;
        }
        let mut search = GridSearch::new(rates, &Assumptions::CHANGING_LOAD);
        let cells = search.cells(rates)?;
        Some(Self {
            now_days: rates.last()?.to,
            cells,
        })
    }

    /// Probability of each regime.
    pub fn regimes(&self) -> BTreeMap<Regime, f64> {
        let mut regimes: BTreeMap<Regime, f64> =
            Regime::KNOWN.into_iter().map(|r| (r, 0.0)).collect();
        for cell in &self.cells {
            *regimes.entry(cell.shape().regime()).or_default() += cell.weight;
        }
        regimes
    }

    /// The heaviest laws, with their share, under today's load; t = 0 is the present.
    pub fn ensemble(&self) -> Ensemble {
        let mut heaviest: Vec<(usize, &Cell)> = self.cells.iter().enumerate().collect();
        let order = |one: &(usize, &Cell), other: &(usize, &Cell)| {
            let by_weight = other.1.weight.total_cmp(&one.1.weight);
            by_weight.then(one.0.cmp(&other.0))
        };
        // Of thousands of cells these few alone are to be in order.
        if heaviest.len() > HEAVIEST {
            heaviest.select_nth_unstable_by(HEAVIEST, order);
            heaviest.truncate(HEAVIEST);
        }
        heaviest.sort_unstable_by(order);
        let heaviest: Vec<&Cell> = heaviest.into_iter().map(|(_, cell)| cell).collect();
        let total: f64 = heaviest.iter().map(|cell| cell.weight).sum();
        let variance = |cell: &&Cell| {
            cell.weight * (cell.variances.0 + cell.scatter.powi(2) + 0.5 * cell.sigma.powi(2))
        };
        let scatter = (heaviest.iter().map(variance).sum::<f64>() / total).sqrt();
        let samples = heaviest.iter().map(|cell| LawSample {
            law: cell.law(),
            weight: cell.weight / total,
        });
        Ensemble {
            now_days: self.now_days,
            samples: samples.collect(),
            scatter,
        }
    }
}
