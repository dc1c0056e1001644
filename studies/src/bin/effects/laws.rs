//! Laws as slopes follow them: creeping, accelerating, saturating, slowing down, settling.

use rand_pcg::Pcg64;
use slipwatch::model::Law;
use studies::law_from_healing;
use studies::random::{log_uniform_by_exp, one_of, uniform};

/// What a slope does under a constant load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Character {
    /// At its steady velocity.
    Creeping,
    /// Towards a failure that comes after the record.
    Accelerating,
    /// Towards a failure about the end of the record, that something else must stop.
    Failing,
    /// Read until shortly before its failure.
    AtTheBrink,
    /// Towards a higher velocity that it keeps.
    Saturating,
    /// For ever slower.
    Hardening,
    /// Towards a lower velocity that it keeps.
    Settling,
}

pub(crate) const ANY: [(f64, Character); 5] = [
    (0.3, Character::Creeping),
    (0.25, Character::Accelerating),
    (0.15, Character::Saturating),
    (0.15, Character::Hardening),
    (0.15, Character::Settling),
];

/// A law of unit velocity for a record of `length` days.
pub(crate) fn draw(rng: &mut Pcg64, choices: &[(f64, Character)], length: f64) -> Law {
    match one_of(rng, choices) {
        Character::Creeping => {
            let p = stable_p(rng);
            let relaxation = length * log_uniform_by_exp(rng, 0.03, 2.0);
            law_from_healing(1.0, -1.0 / (p * relaxation), 1.0, p)
        }
        Character::Accelerating => {
            let p = 1.0 - 1.0 / uniform(rng, 1.02, 1.7);
            let s_theta = 1.0 + log_uniform_by_exp(rng, 0.2, 10.0);
            let duration = length * log_uniform_by_exp(rng, 1.1, 4.0);
            failing(s_theta, p, duration)
        }
        Character::Failing => {
            let p = 1.0 - 1.0 / uniform(rng, 1.02, 1.7);
            let s_theta = 1.0 + log_uniform_by_exp(rng, 0.2, 10.0);
            let duration = length * uniform(rng, 0.5, 1.15);
            failing(s_theta, p, duration)
        }
        Character::AtTheBrink => {
            let p = 1.0 - 1.0 / uniform(rng, 1.02, 1.7);
            let s_theta = 1.0 + log_uniform_by_exp(rng, 0.2, 10.0);
            failing(
                s_theta,
                p,
                length * (1.0 + log_uniform_by_exp(rng, 0.001, 0.03)),
            )
        }
        Character::Saturating => {
            let gain = log_uniform_by_exp(rng, 2.0, 15.0);
            relaxing(rng, gain, length)
        }
        Character::Hardening => {
            let p = 1.0 - 1.0 / uniform(rng, 1.05, 1.7);
            let s_theta = log_uniform_by_exp(rng, 0.05, 0.7);
            let a = log_uniform_by_exp(rng, 0.5, 20.0) / length;
            law_from_healing(1.0, a, s_theta, p)
        }
        Character::Settling => {
            let gain = log_uniform_by_exp(rng, 0.1, 0.6);
            relaxing(rng, gain, length)
        }
    }
}

/// The law that fails after `duration` days.
fn failing(s_theta: f64, p: f64, duration: f64) -> Law {
    let unit = law_from_healing(1.0, 1.0, s_theta, p)
        .failure_days()
        .unwrap_or(1.0);
    law_from_healing(1.0, unit / duration, s_theta, p)
}

/// Towards `gain` times its velocity, in a share of the record.
fn relaxing(rng: &mut Pcg64, gain: f64, length: f64) -> Law {
    let p = stable_p(rng);
    let s_theta = gain.powf(-p);
    let relaxation = length * log_uniform_by_exp(rng, 0.1, 0.7);
    // t* = 1 / (-kappa y^(p-1)) at the steady y = 1/gain.
    let a = 1.0 / (relaxation * -p * gain.powf(1.0 - p));
    law_from_healing(1.0, a, s_theta, p)
}

/// 0 < m < 1, seldom close to 1 where a slow load is felt 1/(1-m) times.
fn stable_p(rng: &mut Pcg64) -> f64 {
    1.0 - 1.0 / uniform(rng, 0.35, 0.93)
}
