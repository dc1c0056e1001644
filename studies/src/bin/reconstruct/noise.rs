//! Seeded noise: the same seed gives the same recording, on every machine.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Stationary first-order autoregressive noise of mean zero.
#[derive(Debug)]
pub(crate) struct ColouredNoise {
    random: Pcg64,
    sigma: f64,
    memory: f64,
    last: Option<f64>,
}

impl ColouredNoise {
    /// Noise of standard deviation `sigma`, of which each value keeps the part `memory` of the one before.
    pub(crate) fn new(seed: u64, sigma: f64, memory: f64) -> Self {
        Self {
            random: Pcg64::seed_from_u64(seed),
            sigma,
            memory,
            last: None,
        }
    }
}

impl Iterator for ColouredNoise {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let fresh = self.sigma * standard_normal(&mut self.random);
        let value = match self.last {
            None => fresh,
            Some(last) => self.memory * last + (1.0 - self.memory * self.memory).sqrt() * fresh,
        };
        self.last = Some(value);
        self.last
    }
}

fn standard_normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

/// `value` with `places` decimals, as an observer would have written it down.
pub(crate) fn rounded(value: f64, places: i32) -> f64 {
    let scale = 10_f64.powi(places);
    (value * scale).round() / scale
}
