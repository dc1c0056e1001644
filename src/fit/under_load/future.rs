//! When a velocity will be passed: each law run on, its load and its drift drawn on the way.

use super::assumptions::Assumptions;
use super::{Cell, LoadPosterior};
use crate::fit::quasi_random::{halton, normal_quantile};
use std::sync::LazyLock;

/// Draws of all cells together: each has its share of them by its weight, the remainder carried from cell to cell.
const DRAWS: usize = 1024;
/// How much of the drift of an e-fold shows in the time that remains.
const IN_TIME: f64 = 0.3;
/// Rounds of the search for the time at which the load has let enough of the law pass.
const ROUNDS: usize = 6;
/// Two rounds that differ by no more than this share have found it.
const CLOSE: f64 = 1e-4;

/// The first of the normal deviates, in the order in which they are drawn.
static DEVIATES: LazyLock<Vec<[f64; 5]>> =
    LazyLock::new(|| (1..=KEPT_DEVIATES).map(deviates).collect());
const KEPT_DEVIATES: u32 = 2048;

fn deviates(index: u32) -> [f64; 5] {
    halton(index).map(normal_quantile)
}

impl LoadPosterior {
    /// (days from the present, probability) of the first passage of `velocity` mm/day, of those that come
    /// within `horizon` days.
    pub fn passages(&self, velocity: f64, horizon: f64) -> Vec<(f64, f64)> {
        let mut passages = Vec::new();
        let (mut drawn, mut reached) = (0_u32, 0.0);
        for cell in &self.cells {
            reached += cell.weight;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of a count, from 0 up"
            )]
            let due = (reached * DRAWS as f64 + 0.5) as u32;
            for index in drawn..due {
                let kept = DEVIATES.get(index as usize).copied();
                let z = kept.unwrap_or_else(|| deviates(index + 1));
                if let Some(days) = cell.days_to(velocity.ln(), z)
                    && days <= horizon
                {
                    passages.push((days, 1.0 / DRAWS as f64));
                }
            }
            drawn = due.max(drawn);
        }
        passages
    }
}

impl Cell {
    /// Days to a velocity under the load, the velocity and the future that `z` draws.
    fn days_to(&self, ln_velocity: f64, z: [f64; 5]) -> Option<f64> {
        let shape = self.shape();
        let (of_velocity, of_load) = self.variances;
        let now = self.ln_velocity + of_velocity.sqrt() * z[0];
        if now >= ln_velocity {
            return Some(0.0);
        }
        let along = if of_velocity > 0.0 {
            self.covariance / of_velocity
        } else {
            0.0
        };
        let left = (of_load - along * self.covariance).max(0.0);
        let load = self.load + along * (now - self.ln_velocity) + left.sqrt() * z[1];
        let pace = (IN_TIME * Assumptions::CHANGING_LOAD.drift * z[4]).exp();
        let mut days = shape.days_to(ln_velocity - (now - load)) / self.r;
        for _ in 0..ROUNDS {
            let memories = if days.is_finite() {
                days / self.tau
            } else {
                f64::INFINITY
            };
            let keep = (-memories).exp();
            let mean = self.mean_load(load, memories, keep, z[2]);
            let at_the_end =
                load * keep + self.sigma * (1.0 - keep * keep).sqrt() * (0.6 * z[2] + 0.8 * z[3]);
            let law = shape.days_to(ln_velocity - (now - load) - at_the_end) / self.r;
            let next = law * (-mean).exp() / pace;
            // A law that never gets there under its lasting load: each round would find the same.
            if days.is_infinite() && next.is_infinite() {
                return None;
            }
            if (next - days).abs() <= CLOSE * days {
                return Some(next);
            }
            days = if days.is_finite() && next.is_finite() {
                f64::midpoint(days, next)
            } else {
                next
            };
        }
        days.is_finite().then_some(days)
    }

    /// The mean load over the next `memories` of its own, after which the share `keep` of it is left, from `load` now.
    fn mean_load(&self, load: f64, memories: f64, keep: f64, z: f64) -> f64 {
        if memories < 1e-3 {
            return load;
        }
        if memories.is_infinite() {
            return 0.0;
        }
        let variance = (2.0 * memories - 3.0 + 4.0 * keep - keep * keep) / (memories * memories);
        load * (1.0 - keep) / memories + self.sigma * variance.max(0.0).sqrt() * z
    }
}
