//! Vaiont, 2 August to 8 October 1963: daily velocities of benchmarks 5, 50, 63 and 67.
//!
//! "Paper" is Helmstetter et al. (2004); everything else is invented within what it leaves open.

use super::interpolation::between;
use super::noise::{ColouredNoise, rounded};
use super::projection::{combined, without};
use super::provenance::Provenance;
use anyhow::{Context, Result};
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::reading::{
    BenchmarkId, Channel, Reading, Recording, Sample, Series, Timestamp, Unit, after_days,
};

/// File name of the recording.
pub(crate) const FILE: &str = "vaiont-1963-reconstruction.mcap";
/// Day 0. The date is the paper's; that a day counts from its midnight, and that each reading
/// stands at midnight, is invented.
pub(crate) const DAY_ZERO: &str = "1963-08-02T00:00:00+01:00";
/// 2 August to 8 October: paper. One reading a day: invented.
const DAYS: u32 = 68;
/// Invented.
const SEED: u64 = 1963;
/// Invented: standard deviation of the noise over the velocity, before what the law could fit is taken from it.
const NOISE: f64 = 0.04;
/// Invented: correlation of the noise from day to day.
const NOISE_MEMORY: f64 = 0.3;

struct VaiontPoint {
    id: &'static str,
    /// Paper: the fitted B/A, to its two decimals.
    m: f64,
    /// The law's velocity on day 0, mm/day. Invented, within the paper's velocities and displacements.
    v_i: f64,
    /// Initial slope of the inverse velocity over its first value, per day. Invented, for day 69.5.
    r: f64,
    /// Its curvature, per day. Invented; below zero for 67, which bends upwards (paper).
    kappa: f64,
}

const BENCHMARKS: [VaiontPoint; 4] = [
    VaiontPoint {
        id: "5",
        m: 1.35,
        v_i: 9.6,
        r: 0.01375,
        kappa: 0.0008,
    },
    // 0.998 is 1.00; at 1 itself the law has no x_i, T and D.
    VaiontPoint {
        id: "50",
        m: 0.998,
        v_i: 5.0,
        r: 0.01471,
        kappa: -0.0004,
    },
    VaiontPoint {
        id: "63",
        m: 1.24,
        v_i: 9.4,
        r: 0.01379,
        kappa: 0.0007,
    },
    VaiontPoint {
        id: "67",
        m: 0.99,
        v_i: 6.0,
        r: 0.01741,
        kappa: -0.003,
    },
];

/// Reservoir level on days of the record, in metres. Paper: filling since April 1963, draw-down
/// from 26 September (day 55). Invented: every level, and the straight lines between them.
const RESERVOIR: [(f64, f64); 5] = [
    (0.0, 700.0),
    (33.0, 709.0),
    (48.0, 710.0),
    (55.0, 710.0),
    (67.0, 701.0),
];

/// The reconstruction, from its constants and seed alone.
///
/// # Errors
/// When a constant makes no law or no date.
pub(crate) fn recording() -> Result<Recording> {
    let day_zero: Timestamp = DAY_ZERO.parse()?;
    let time = |day: u32| after_days(day_zero, f64::from(day)).context("a day beyond the calendar");
    let times = (0..DAYS).map(time).collect::<Result<Vec<_>>>()?;
    let mut series = Vec::new();
    for (seed, benchmark) in (SEED..).zip(&BENCHMARKS) {
        let readings = times.iter().zip(velocities(benchmark, seed)?);
        let readings = readings.map(|(&time, velocity)| Reading {
            time,
            value: rounded(velocity, 2),
            sigma: None,
        });
        series.push(Series {
            benchmark: BenchmarkId::new(benchmark.id),
            unit: Unit::MM_PER_DAY,
            averaging: None,
            readings: readings.collect(),
        });
    }
    let levels = times.iter().zip(0..DAYS).map(|(&time, day)| Sample {
        time,
        value: rounded(between(&RESERVOIR, f64::from(day)), 2),
    });
    let channel = Channel {
        name: "reservoir_level_m".to_owned(),
        unit: Some("m".to_owned()),
        stated: None,
        samples: levels.collect(),
    };
    Ok(Recording {
        series,
        channels: vec![channel],
        provenance: provenance().entries(),
    })
}

/// Velocity at each day's reading, mm/day: the law's, and noise that the law cannot fit.
fn velocities(benchmark: &VaiontPoint, seed: u64) -> Result<Vec<f64>> {
    let law = Unknowns::of(benchmark);
    let velocities = law.velocities()?;
    let noise = ColouredNoise::new(seed, NOISE, NOISE_MEMORY);
    let noise = velocities.iter().zip(noise).map(|(v, noise)| v * noise);
    let residuals = without(&law.directions()?, noise.collect());
    Ok(velocities
        .iter()
        .zip(residuals)
        .map(|(v, e)| v + e)
        .collect())
}

/// What a fit of the velocity looks for.
#[derive(Debug, Clone, Copy)]
struct Unknowns {
    v_i: f64,
    /// r, kappa and p = 1 - 1/m.
    shape: [f64; 3],
}

impl Unknowns {
    fn of(benchmark: &VaiontPoint) -> Self {
        Self {
            v_i: benchmark.v_i,
            shape: [benchmark.r, benchmark.kappa, 1.0 - 1.0 / benchmark.m],
        }
    }

    /// Velocity on every day, mm/day.
    fn velocities(&self) -> Result<Vec<f64>> {
        let [r, kappa, p] = self.shape;
        let law = Law::from_fit(self.v_i, r, kappa, p);
        let last = f64::from(DAYS - 1);
        let solution = Trajectory::solve(&law, last * (1.0 + 1e-12), Accuracy::Full);
        let velocity = |day: u32| Some(solution.at(f64::from(day))?.velocity);
        let velocities: Option<Vec<f64>> = (0..DAYS).map(velocity).collect();
        velocities.context("the law fails before the last reading")
    }

    /// How the velocities change with each unknown and with each two of them: the first and second
    /// differences, over steps far above the rounding and far below what changes the law's form.
    fn directions(&self) -> Result<Vec<Vec<f64>>> {
        let steps = [1e-3 * self.shape[0], 0.03 * self.shape[1], 0.02];
        let at = |moves: [f64; 3]| {
            let mut moved = *self;
            for index in 0..3 {
                moved.shape[index] += moves[index] * steps[index];
            }
            moved.velocities()
        };
        let unit = |index: usize, size: f64| {
            let mut moves = [0.0; 3];
            moves[index] = size;
            moves
        };
        let here = self.velocities()?;
        let mut directions = vec![here.clone()];
        for i in 0..3 {
            let (up, down) = (at(unit(i, 1.0))?, at(unit(i, -1.0))?);
            directions.push(combined(&[(1.0, &up), (-1.0, &down)]));
            directions.push(combined(&[(1.0, &up), (1.0, &down), (-2.0, &here)]));
            for j in 0..i {
                let both = |a: f64, b: f64| {
                    let mut moves = unit(i, a);
                    moves[j] = b;
                    at(moves)
                };
                let (pp, pm, mp, mm) = (
                    both(1.0, 1.0)?,
                    both(1.0, -1.0)?,
                    both(-1.0, 1.0)?,
                    both(-1.0, -1.0)?,
                );
                directions.push(combined(&[
                    (1.0, &pp),
                    (-1.0, &pm),
                    (-1.0, &mp),
                    (1.0, &mm),
                ]));
            }
        }
        Ok(directions)
    }
}

fn provenance() -> Provenance<'static> {
    Provenance {
        title: "Vaiont, Italy, 2 August to 8 October 1963: velocity of benchmarks 5, 50, 63 and 67",
        stated: "best m = 1.35 (5), 1.00 (50), 1.24 (63), 0.99 (67) of velocities fitted with the least rms; \
                 the straight line through 1/v meets zero near day 69.5 for all; velocities from 5 to more \
                 than 200 mm/day; displacement between 0.8 and 4 m; 5 and 63 alike; 50's acceleration small \
                 in absolute value, significant in relative value; the fits of 5, 63 and 50 close to \
                 1/(t_c - t), 67 bending upwards in 1/v; the reservoir filling from April, drawn down from \
                 26 September",
        invented: "one reading a day, at midnight +01:00; the first velocity, r and kappa; noise of 4 % in \
                   velocity, correlation 0.3 from day to day, of which only what the law cannot fit \
                   was kept, to the second order in its unknowns; every reservoir level",
        seed: SEED,
    }
}
