//! Series drawn from the posterior's own prior, whose truth is therefore known.
//!
//! The law and its scatter are drawn as `fit::under_load` states them under a constant load, by the exact solution and an
//! Ornstein-Uhlenbeck walk: nothing of the fit is used here. The sizes of the scatter are confined, to between 0.3 and 30 %, and
//! before a late start the velocity is that of the start, or walks away from it.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StudentT};
use rand_pcg::Pcg64;
use slipwatch::fit::{Observation, Observations};
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::reading::Quantity;
use studies::random::{log_uniform_by_exp, normal, uniform};

/// Whether the law holds from the first reading on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Starts {
    /// In every series.
    First,
    /// In half of them; in the others later.
    ToBeFound,
}

/// How a series was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measured {
    /// Velocities whose scatter is relative and unknown.
    Velocity,
    /// Velocities with a stated standard error, some of them therefore backwards.
    VelocityWithSigma,
    /// Displacements with an error that is not stated.
    Displacement,
}

/// One series and its truth.
#[derive(Debug, Clone)]
pub(crate) struct DrawnSeries {
    pub(crate) observations: Observations,
    pub(crate) measured: Measured,
    /// The law at the last reading.
    pub(crate) law: Law,
    /// Days of the first reading that follows the law; 0 where all do.
    pub(crate) onset_days: f64,
}

/// Slopes: from this share of 1/length to this many of 1/interval, the slowest at most in 1/interval, how much rarer the fast
/// ones are, and the standard deviation of the slope times the newest interval.
const SLOPES: (f64, f64) = (0.02, 2.0);
const SLOWEST: f64 = 2e-4;
const RARE: f64 = 0.1;
const SLOPE_PER_INTERVAL: f64 = 1.5;
/// Scale of the Cauchy number that is kappa times the length of the record.
const CURVATURE: f64 = 3.0;
const MOST_LN_Y: f64 = 14.0;
/// Medians of the scatter and of what remembers of it, the standard deviation of the log of either, and where both are kept.
const SCATTER: (f64, f64) = (0.03, 1.0);
const REMEMBERED: (f64, f64) = (0.04, 1.0);
const SCATTERS: (f64, f64) = (0.003, 0.3);
/// Share of the series whose scatter remembers nothing.
const WITHOUT_MEMORY: f64 = 0.4;
/// Standard deviations, from one reading to the next, of a velocity that follows no law yet.
const DRIFTS_BEFORE: [f64; 4] = [0.0, 0.05, 0.15, 0.4];

/// The `index`-th series of a family.
pub(crate) fn drawn(index: u64, starts: Starts) -> DrawnSeries {
    let mut rng = Pcg64::seed_from_u64(0x5eed_0000 + index);
    loop {
        if let Some(one) = attempt(&mut rng, starts) {
            return one;
        }
    }
}

/// Reading times, evenly or at random, from 0 on.
fn times(rng: &mut Pcg64) -> Vec<f64> {
    let wanted = log_uniform_by_exp(rng, 15.0, 500.0).round();
    let count = (15..500)
        .find(|count| f64::from(*count) >= wanted)
        .unwrap_or(500);
    let length = log_uniform_by_exp(rng, 20.0, 1000.0);
    let mut times: Vec<f64> = if rng.random::<bool>() {
        (0..count)
            .map(|i| length * f64::from(i) / f64::from(count - 1))
            .collect()
    } else {
        (0..count).map(|_| uniform(rng, 0.0, length)).collect()
    };
    times.sort_by(f64::total_cmp);
    times.dedup_by(|later, earlier| *later - *earlier < 0.022);
    let first = times[0];
    times.iter().map(|time| time - first).collect()
}

/// A law for the last reading, from the prior; the record's length and newest interval in days.
fn law(rng: &mut Pcg64, length: f64, interval: f64) -> Option<Law> {
    let lowest = (SLOPES.0 / length).min(SLOWEST / interval);
    let size = log_uniform_by_exp(rng, lowest, SLOPES.1 / interval);
    let unresolved = size * interval / SLOPE_PER_INTERVAL;
    let kept = (lowest / size).powf(RARE) * (-0.5 * unresolved * unresolved).exp();
    if rng.random::<f64>() >= kept {
        return None;
    }
    let quarter = std::f64::consts::FRAC_PI_2;
    let kappa = CURVATURE * (quarter * rng.random::<f64>()).tan() / length;
    let p = if rng.random::<bool>() {
        uniform(rng, 0.0, 0.6)
    } else {
        uniform(rng, -1.0, 0.0)
    };
    let r = if rng.random::<bool>() { size } else { -size };
    let is_loaded = kappa / p.abs() + r > 0.0;
    is_loaded.then(|| Law::from_fit(10.0 * normal(rng).exp(), r, kappa.copysign(p), p))
}

/// A size of the scatter.
fn size(rng: &mut Pcg64, (median, spread): (f64, f64)) -> f64 {
    loop {
        let size = median * (spread * normal(rng)).exp();
        if (SCATTERS.0..SCATTERS.1).contains(&size) {
            return size;
        }
    }
}

/// ln of the velocity before the onset over that at it, at each time: a walk into the past.
fn before_onset(rng: &mut Pcg64, times: &[f64], onset: f64) -> Vec<f64> {
    let drift = DRIFTS_BEFORE[rng.random_range(0..DRIFTS_BEFORE.len())];
    let mut ln = 0.0;
    let mut back: Vec<f64> = times
        .iter()
        .rev()
        .map(|time| {
            if *time < onset {
                ln += drift * normal(rng);
            }
            ln
        })
        .collect();
    back.reverse();
    back
}

/// The relative deviation of the motion at each time.
fn random_process(rng: &mut Pcg64, times: &[f64], spread: f64, memory: f64) -> Vec<f64> {
    let mut value = spread * normal(rng);
    let mut before = 0.0;
    let step = |time: &f64| {
        let keep = (-(time - before) / memory).exp();
        before = *time;
        value = keep * value + spread * (1.0 - keep * keep).sqrt() * normal(rng);
        value
    };
    times.iter().map(step).collect()
}

fn attempt(rng: &mut Pcg64, starts: Starts) -> Option<DrawnSeries> {
    let times = times(rng);
    let count = times.len();
    if count < 15 {
        return None;
    }
    let end = times[count - 1];
    let late = starts == Starts::ToBeFound && rng.random::<bool>();
    let onset = if late {
        let ago = log_uniform_by_exp(rng, end - times[count - 5], end);
        times.iter().copied().find(|time| *time >= end - ago)?
    } else {
        0.0
    };
    let mut newest: Vec<f64> = times[count - 4..].windows(2).map(|w| w[1] - w[0]).collect();
    newest.sort_by(f64::total_cmp);
    let law = law(rng, end, newest[1])?;
    let past = Trajectory::solve(&law.reversed(), end - onset, Accuracy::Full);
    let edge = past.at(end - onset)?;
    if edge.y.ln().abs() > MOST_LN_Y {
        return None;
    }
    let remembered = if rng.random::<f64>() < WITHOUT_MEMORY {
        0.0
    } else {
        size(rng, REMEMBERED)
    };
    let scatter = (size(rng, SCATTER), remembered);
    let memory = log_uniform_by_exp(rng, end / count as f64, end);
    let measured = match rng.random_range(0..20) {
        0..9 => Measured::Velocity,
        9..12 => Measured::VelocityWithSigma,
        _ => Measured::Displacement,
    };
    let walked = before_onset(rng, &times, onset);
    let first = times.partition_point(|time| *time < onset);
    let motion = |time: &f64| {
        past.at(end - time)
            .map(|at| (at.velocity, -at.displacement))
    };
    let of_law: Option<Vec<(f64, f64)>> = times[first..].iter().map(motion).collect();
    let mut clean = of_law?;
    for index in (0..first).rev() {
        let velocity = edge.velocity * walked[index].exp();
        let (next, moved) = clean[0];
        let days = times[index + 1] - times[index];
        clean.insert(0, (velocity, moved - days * f64::midpoint(velocity, next)));
    }
    let values = measure(rng, (&times, &clean), measured, (scatter, memory));
    Some(DrawnSeries {
        observations: observations(measured, values),
        measured,
        law,
        onset_days: onset,
    })
}

/// The readings, with their standard errors where stated.
fn measure(
    rng: &mut Pcg64,
    (times, clean): (&[f64], &[(f64, f64)]),
    measured: Measured,
    ((size, remembered), memory): ((f64, f64), f64),
) -> Vec<Observation> {
    let heavy = StudentT::new(7.0).ok();
    let white = |rng: &mut Pcg64| heavy.map_or(0.0, |t| t.sample(rng));
    let deviation = random_process(rng, times, remembered, memory);
    let count = times.len();
    let slip = clean[count - 1].1 - clean[0].1;
    let error = size * slip / (count - 1) as f64;
    let mut velocities: Vec<f64> = clean.iter().map(|(velocity, _)| *velocity).collect();
    velocities.sort_by(f64::total_cmp);
    let sigma = 2.0 * size * velocities[count / 2];
    let mut moved = clean[0].1;
    let one = |index: usize| {
        let (velocity, displacement) = clean[index];
        let (value, sigma) = match measured {
            Measured::Velocity | Measured::VelocityWithSigma => {
                let scatter = deviation[index] + size * white(rng);
                let value = velocity * scatter.exp();
                if measured == Measured::Velocity {
                    (value, None)
                } else {
                    (value + sigma * normal(rng), Some(sigma))
                }
            }
            Measured::Displacement => {
                if index > 0 {
                    let middle = f64::midpoint(deviation[index - 1], deviation[index]);
                    let slipped = middle + size * white(rng);
                    moved += (displacement - clean[index - 1].1) * slipped.exp();
                }
                (moved + error * normal(rng), None)
            }
        };
        Observation {
            t_days: times[index],
            value,
            sigma,
        }
    };
    (0..count).map(one).collect()
}

fn observations(measured: Measured, values: Vec<Observation>) -> Observations {
    let quantity = match measured {
        Measured::Velocity | Measured::VelocityWithSigma => Quantity::Velocity,
        Measured::Displacement => Quantity::Displacement,
    };
    Observations {
        quantity,
        averaging_days: 0.0,
        values,
    }
}
