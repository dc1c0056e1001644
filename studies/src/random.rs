//! Draws from the few distributions that simulated slopes are drawn from.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// From the standard normal distribution.
pub fn normal(generator: &mut impl Rng) -> f64 {
    generator.sample(StandardNormal)
}

/// From `low` to `high`.
pub fn uniform(generator: &mut impl Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * generator.random::<f64>()
}

/// From `low` to `high`, both over 0, uniform in its logarithm.
pub fn log_uniform(generator: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(generator.random::<f64>())
}

/// The same with another rounding: what was drawn by it is drawn again to the last bit.
pub fn log_uniform_by_exp(generator: &mut impl Rng, low: f64, high: f64) -> f64 {
    uniform(generator, low.ln(), high.ln()).exp()
}

/// Whether what has this chance happens.
pub fn happens(generator: &mut impl Rng, chance: f64) -> bool {
    generator.random::<f64>() < chance
}

/// 1 with the given chance, otherwise -1.
pub fn sign(generator: &mut impl Rng, chance_of_plus: f64) -> f64 {
    if happens(generator, chance_of_plus) {
        1.0
    } else {
        -1.0
    }
}

/// One of the choices, each with its weight; the last where the weights are spent.
///
/// # Panics
/// Without any choice.
pub fn one_of<T: Copy>(generator: &mut impl Rng, choices: &[(f64, T)]) -> T {
    let total: f64 = choices.iter().map(|(weight, _)| weight).sum();
    let mut left = generator.random::<f64>() * total;
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
pub fn count(generator: &mut impl Rng, low: usize, high: usize) -> usize {
    generator.random_range(low..=high)
}
