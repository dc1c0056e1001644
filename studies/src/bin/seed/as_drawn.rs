//! How small noise must be for the best m to be the law's, where nothing is taken from the noise.

use super::claims::SAME_M;
use super::recorded::vaiont_day;
use super::vaiont::Benchmark;
use anyhow::{Context, Result};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use slipwatch::fit::{ConstantLoad, Exponent, PointReadings};
use slipwatch::model::{Accuracy, Trajectory};
use slipwatch::reading::Quantity;

/// Standard deviations of the noise over the velocity.
const NOISES: [f64; 5] = [0.04, 0.01, 1e-3, 3e-4, 1e-4];
/// Correlation of the noise from day to day.
const MEMORY: f64 = 0.3;
/// Series of each kind.
pub(crate) const SERIES: u64 = 50;

/// Noise of one size.
#[derive(Debug, Clone)]
pub(crate) struct AsDrawn {
    pub(crate) noise: f64,
    /// Share of the series whose best m is the law's, for each benchmark.
    pub(crate) found: Vec<f64>,
    /// The noise's rms in mm/day, for each benchmark.
    pub(crate) rms: Vec<f64>,
}

/// The best fits' own velocities under noise of each size.
pub(crate) fn shares(benchmarks: &[Benchmark]) -> Result<Vec<AsDrawn>> {
    let of_noise = |noise: f64| {
        let mut one = AsDrawn {
            noise,
            found: Vec::new(),
            rms: Vec::new(),
        };
        for benchmark in benchmarks {
            let (found, rms) = of_benchmark(benchmark, noise)?;
            one.found.push(found);
            one.rms.push(rms);
        }
        Ok(one)
    };
    NOISES.into_iter().map(of_noise).collect()
}

fn of_benchmark(benchmark: &Benchmark, noise: f64) -> Result<(f64, f64)> {
    let law = benchmark.least_squares.best().context("no fit")?.law;
    let m = 1.0 / (1.0 - law.p);
    let mut days = Vec::new();
    for reading in &benchmark.series.readings {
        days.push(vaiont_day(reading.time)?);
    }
    let first = days.first().copied().context("no readings")?;
    let length = days.last().map_or(0.0, |last| last - first);
    let solution = Trajectory::solve(&law, length * (1.0 + 1e-12), Accuracy::Full);
    let mut exact = Vec::new();
    for day in days {
        let motion = solution.at(day - first).context("the law ends too early")?;
        exact.push((day - first, motion.velocity));
    }
    let (mut found, mut squares) = (0.0, 0.0);
    for seed in 0..SERIES {
        let noisy = noisy(&exact, noise, seed);
        let errors = noisy.iter().zip(&exact).map(|(a, b)| (a.1 - b.1).powi(2));
        squares += errors.sum::<f64>() / exact.len() as f64;
        let readings = PointReadings::new(Quantity::Velocity, noisy);
        let fit = ConstantLoad::fit(&readings, Exponent::Free);
        let best = fit.best().map(|best| 1.0 / (1.0 - best.law.p));
        found += f64::from(u8::from(
            best.is_some_and(|best| (best - m).abs() <= SAME_M),
        ));
    }
    let count = SERIES as f64;
    Ok((found / count, (squares / count).sqrt()))
}

fn noisy(exact: &[(f64, f64)], noise: f64, seed: u64) -> Vec<(f64, f64)> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let mut state = draw();
    let mut readings = Vec::new();
    for (day, velocity) in exact {
        readings.push((*day, velocity * (1.0 + noise * state)));
        state = MEMORY * state + (1.0 - MEMORY * MEMORY).sqrt() * draw();
    }
    readings
}
