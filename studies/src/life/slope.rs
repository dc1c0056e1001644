//! The law of a simulated slope and the path that it takes under its load.

use super::load::STEP_DAYS;
use super::{Fate, Life};
use crate::healing::law_from_healing;
use crate::random::log_uniform;
use rand::{Rng, RngExt};
use slipwatch::model::{Accuracy, Law, Load, LoadedLaw};

/// (days, mm) at every knot of the load.
pub(super) type DisplacementPath = Vec<(f64, f64)>;

pub(super) struct Slope {
    pub(super) law: Law,
    /// The block creeps until then and follows the law from then on, days.
    pub(super) onset: f64,
    pub(super) end: f64,
}

/// Knots in the windows whose mean velocities show a season, 30 days, and a step, one day.
const SEASON: usize = 300;
const DAY: usize = 10;

/// Days of the onset, and to the end that the law alone would bring; the record is 1.5 times as long.
pub(super) fn span(fate: Fate, generator: &mut impl Rng) -> (f64, f64) {
    match fate {
        Fate::Failing
        | Fate::Saturating
        | Fate::Steady
        | Fate::Settling
        | Fate::Reset
        | Fate::Noisy => {
            let duration = log_uniform(generator, 60.0, 700.0);
            (duration * generator.random_range(0.0..2.0), duration)
        }
        // From the first day on, and more than a year of it.
        Fate::Seasonal => (0.0, log_uniform(generator, 300.0, 1000.0)),
        Fate::Stepped => (0.0, log_uniform(generator, 60.0, 700.0)),
    }
}

/// The law that takes about `duration` days to its end.
pub(super) fn law(fate: Fate, duration: f64, generator: &mut impl Rng) -> Law {
    let m = m(fate, generator);
    let p = 1.0 - 1.0 / m;
    if fate == Fate::Failing {
        let s_theta = 1.0 + log_uniform(generator, 0.2, 10.0);
        let unit = law_from_healing(1.0, 1.0, s_theta, p);
        let a = unit.failure_days().unwrap_or(1.0) / duration;
        // v ~ (D_c/m) / (t_c - t) near failure, and D_c/m = v_i/b, mm.
        let v_i = log_uniform(generator, 50.0, 1000.0) * s_theta * a;
        return law_from_healing(v_i, a, s_theta, p);
    }
    // The velocity it keeps over that of the creep.
    let gain = match fate {
        Fate::Saturating => log_uniform(generator, 2.0, 20.0),
        Fate::Settling => log_uniform(generator, 0.1, 0.7),
        Fate::Failing
        | Fate::Steady
        | Fate::Seasonal
        | Fate::Stepped
        | Fate::Reset
        | Fate::Noisy => 1.0,
    };
    // The relaxation takes half of the time.
    let a = 2.0 / duration / (-p * gain.powf(1.0 - p));
    let v_i = match fate {
        Fate::Noisy => log_uniform(generator, 0.05, 1.0),
        Fate::Stepped => log_uniform(generator, 0.1, 30.0),
        Fate::Failing
        | Fate::Saturating
        | Fate::Steady
        | Fate::Settling
        | Fate::Seasonal
        | Fate::Reset => log_uniform(generator, 0.1, 10.0),
    };
    law_from_healing(v_i, a, gain.powf((1.0 - m) / m), p)
}

fn m(fate: Fate, generator: &mut impl Rng) -> f64 {
    match fate {
        Fate::Failing => generator.random_range(1.0..1.7),
        Fate::Saturating | Fate::Steady | Fate::Settling | Fate::Reset | Fate::Noisy => {
            generator.random_range(0.5..0.95)
        }
        // Nearer to 1 a strong load would let it accelerate without bound: at rest v goes as e^f to the power 1/(1 - m).
        Fate::Seasonal | Fate::Stepped => {
            if generator.random::<bool>() {
                generator.random_range(0.2..0.6)
            } else {
                -log_uniform(generator, 0.3, 3.0)
            }
        }
    }
}

/// Whether the true motion shows what the fate says of it.
pub(super) fn moves_as(fate: Fate, path: &[(f64, f64)]) -> bool {
    match fate {
        Fate::Seasonal => {
            let months = sorted_means(path, SEASON);
            let (Some(least), Some(most)) = (months.first(), months.last()) else {
                return false;
            };
            (2.0..=10.0).contains(&(most / least))
        }
        Fate::Stepped => {
            let days = sorted_means(path, DAY);
            let (Some(creep), Some(most)) = (days.get(days.len() / 2), days.last()) else {
                return false;
            };
            (3.0..=30.0).contains(&(most / creep))
        }
        Fate::Failing
        | Fate::Saturating
        | Fate::Steady
        | Fate::Settling
        | Fate::Reset
        | Fate::Noisy => true,
    }
}

/// Mean velocities over windows of `knots` steps of the load, mm/day, increasing.
fn sorted_means(path: &[(f64, f64)], knots: usize) -> Vec<f64> {
    let bounds: Vec<f64> = path.iter().step_by(knots).map(|(_, x)| *x).collect();
    let window = knots as f64 * STEP_DAYS;
    let mut means: Vec<f64> = bounds.windows(2).map(|x| (x[1] - x[0]) / window).collect();
    means.sort_by(f64::total_cmp);
    means
}

impl Slope {
    /// Where it is at every knot of the load, and when the critical velocity was passed.
    pub(super) fn path(&self, knots: &[(f64, f64)]) -> Option<(DisplacementPath, Option<f64>)> {
        let mut path = vec![(0.0, 0.0)];
        let mut creep = 0.0;
        let before = knots.partition_point(|(days, _)| *days <= self.onset);
        for pair in knots[..before].windows(2) {
            let load = f64::midpoint(pair[0].1, pair[1].1).exp();
            creep += self.law.v_i * load * (pair[1].0 - pair[0].0);
            path.push((pair[1].0, creep));
        }
        let onset = knots.get(before.checked_sub(1)?)?.0;
        let moving: Vec<(f64, f64)> = knots[before - 1..]
            .iter()
            .map(|(days, load)| (days - onset, *load))
            .collect();
        let times: Vec<f64> = moving.iter().skip(1).map(|(days, _)| *days).collect();
        let load = Load::new(moving).ok()?;
        let loaded = LoadedLaw::new(&self.law, &load, Accuracy::Fit).ok()?;
        let horizon = self.end - onset;
        let failure = loaded.days_to_velocity(Life::CRITICAL_MM_PER_DAY, horizon);
        let mut motions = vec![None; times.len()];
        loaded.motions(&times, &mut motions);
        for (days, motion) in times.iter().zip(&motions) {
            if failure.is_some_and(|failure| *days > failure) {
                break;
            }
            path.push((onset + days, creep + (*motion)?.displacement));
        }
        Some((path, failure.map(|days| onset + days)))
    }
}
