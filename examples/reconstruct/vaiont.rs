//! Vaiont, 2 August to 8 October 1963: daily velocities of benchmarks 5, 50, 63 and 67.
//!
//! "Paper" is Helmstetter et al. (2004); everything else is invented within what it leaves open.

use crate::interpolation::between;
use crate::loaded_law::Block;
use crate::noise::{ColouredNoise, rounded};
use crate::provenance::Provenance;
use anyhow::{Context, Result};
use slipwatch::model::Law;
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
/// Invented: standard deviation of ln(velocity).
const NOISE: f64 = 0.04;
/// Invented: correlation of the noise from day to day.
const NOISE_MEMORY: f64 = 0.3;
/// Invented: the day from which the velocity's increase exhausts itself (that it does: paper).
const EXHAUSTION_FROM_DAY: f64 = 64.0;
/// Steps of a day, for an integration exact to far below the rounding of the readings.
const STEPS_PER_DAY: u32 = 200;

/// The state and scales that the law of a benchmark starts from.
enum Start {
    /// The paper's `x_i`, T in days and D in mm/day, for m other than 1.
    Scaled { x_i: f64, t_days: f64, d: f64 },
    /// `S theta_i`, `theta_i` in days and the first velocity in mm/day, for m = 1.
    Unit {
        s_theta_i: f64,
        theta_i_days: f64,
        v_i: f64,
    },
}

struct Benchmark {
    id: &'static str,
    /// Paper: the fitted B/A.
    m: f64,
    /// Invented, within the paper's velocities, displacements and day 69.5.
    start: Start,
    /// Invented: log-load lost per day from [`EXHAUSTION_FROM_DAY`] on.
    exhaustion_per_day: f64,
}

const BENCHMARKS: [Benchmark; 4] = [
    Benchmark {
        id: "5",
        m: 1.35,
        start: Start::Scaled {
            x_i: 0.05,
            t_days: 3790.0,
            d: 0.175,
        },
        exhaustion_per_day: 0.035,
    },
    Benchmark {
        id: "50",
        m: 1.0,
        start: Start::Unit {
            s_theta_i: 2.0,
            theta_i_days: 69.3,
            v_i: 5.0,
        },
        exhaustion_per_day: 0.015,
    },
    Benchmark {
        id: "63",
        m: 1.24,
        start: Start::Scaled {
            x_i: 0.05,
            t_days: 2040.0,
            d: 0.23,
        },
        exhaustion_per_day: 0.055,
    },
    Benchmark {
        id: "67",
        m: 0.99,
        start: Start::Scaled {
            x_i: 100.0,
            t_days: 0.0253,
            d: 573.0,
        },
        exhaustion_per_day: 0.0,
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
        let noise = ColouredNoise::new(seed, NOISE, NOISE_MEMORY);
        let velocities = velocities(benchmark)?.into_iter().zip(noise);
        let readings = times
            .iter()
            .zip(velocities)
            .map(|(&time, (velocity, noise))| Reading {
                time,
                value: rounded(velocity * noise.exp(), 2),
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
        samples: levels.collect(),
    };
    Ok(Recording {
        series,
        channels: vec![channel],
        provenance: provenance().entries(),
    })
}

fn law(benchmark: &Benchmark) -> Result<Law> {
    let law = match benchmark.start {
        Start::Scaled { x_i, t_days, d } => Law::from_paper(benchmark.m, x_i, t_days, d),
        Start::Unit {
            s_theta_i,
            theta_i_days,
            v_i,
        } => Law::at_unit_m(s_theta_i, theta_i_days, v_i),
    };
    law.with_context(|| format!("benchmark {}", benchmark.id))
}

/// Velocity at each day's reading, mm/day, before noise.
fn velocities(benchmark: &Benchmark) -> Result<Vec<f64>> {
    let law = law(benchmark)?;
    let load = |day: f64| -benchmark.exhaustion_per_day * (day - EXHAUSTION_FROM_DAY).max(0.0);
    let mut block = Block::START;
    let mut velocities = Vec::new();
    for day in 0..DAYS {
        velocities.push(block.velocity(&law, load(f64::from(day))));
        block = block.advance(&law, load, 1.0, STEPS_PER_DAY);
    }
    Ok(velocities)
}

fn provenance() -> Provenance<'static> {
    Provenance {
        title: "Vaiont, Italy, 2 August to 8 October 1963: velocity of benchmarks 5, 50, 63 and 67",
        stated: "m = 1.35 (5), 1.00 (50), 1.24 (63), 0.99 (67); the straight line through 1/v \
                 meets zero near day 69.5 for all; velocities from 5 to more than 200 mm/day; \
                 displacement between 0.8 and 4 m; 5 and 63 alike; 50's acceleration small in \
                 absolute value, significant in relative value; 67 bending upwards in 1/v; the \
                 increase exhausted before the critical time; the reservoir filling from April, \
                 drawn down from 26 September",
        invented: "one reading a day, at midnight +01:00; x_i, T and D; the log-load lost from \
                   day 64 on, by which the increase exhausts itself; noise of 4 % in velocity, \
                   correlation 0.3 from day to day; every reservoir level",
        seed: SEED,
    }
}
