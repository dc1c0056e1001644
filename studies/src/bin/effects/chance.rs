//! Draws from the few distributions that everything here is drawn from.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

pub(crate) fn uniform(rng: &mut Pcg64, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

pub(crate) fn log_uniform(rng: &mut Pcg64, low: f64, high: f64) -> f64 {
    uniform(rng, low.ln(), high.ln()).exp()
}

pub(crate) fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// 1 with the given chance, otherwise -1.
pub(crate) fn sign(rng: &mut Pcg64, chance_of_plus: f64) -> f64 {
    if so(rng, chance_of_plus) { 1.0 } else { -1.0 }
}

pub(crate) fn so(rng: &mut Pcg64, chance: f64) -> bool {
    rng.random::<f64>() < chance
}

/// One of the choices, each with its weight; the last where the weights are spent.
pub(crate) fn one_of<T: Copy>(rng: &mut Pcg64, choices: &[(f64, T)]) -> T {
    let total: f64 = choices.iter().map(|(weight, _)| weight).sum();
    let mut left = rng.random::<f64>() * total;
    let mut chosen = choices[0].1;
    for (weight, choice) in choices {
        chosen = *choice;
        left -= weight;
        if left < 0.0 {
            break;
        }
    }
    chosen
}

/// A whole number from `low` to `high`, both included.
pub(crate) fn count(rng: &mut Pcg64, low: usize, high: usize) -> usize {
    rng.random_range(low..=high)
}
