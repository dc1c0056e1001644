//! Made-up slopes of several benchmarks that move as one, part, or never were one.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::reading::{BenchmarkId, Reading, Series, Timestamp, Unit, after_days};

/// What the benchmarks do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Fate {
    /// One motion throughout.
    Together,
    /// One motion, and an offset of one instrument.
    OneOffset,
    /// One motion, and stray readings of one instrument.
    Strays,
    /// Each its own motion from the start.
    Apart,
    /// A ratio that drifts from the first day to the last.
    Drift,
    /// The same, faster and faster or slower and slower.
    BentDrift,
    /// Groups at once.
    Parted,
    /// Groups whose ratio begins to drift.
    Parting,
}

/// Benchmarks, and the truth about them.
pub(crate) struct Slope {
    pub(crate) series: Vec<Series>,
    pub(crate) at: f64,
    pub(crate) groups: Vec<Vec<BenchmarkId>>,
}

/// Day 0 of every slope.
pub(crate) fn day_zero() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

struct Draw(Pcg64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }
}

/// Velocity of the common motion a day, mean 1.
fn motion(draw: &mut Draw, days: usize) -> Vec<f64> {
    let kind = draw.below(4);
    let (phase, length) = (draw.between(0.0, 6.3), days as f64);
    let end = length * draw.between(1.03, 1.3);
    let surges: Vec<f64> = (0..6).map(|_| draw.between(0.0, length)).collect();
    let velocity = |day: usize| {
        let day = day as f64;
        match kind {
            0 => 1.0,
            1 => length / (end - day),
            2 => 1.0 + 0.8 * (day * std::f64::consts::TAU / 365.25 + phase).sin(),
            _ => {
                0.4 + surges
                    .iter()
                    .map(|at| 8.0 * (-((day - at) / 3.0).powi(2)).exp())
                    .sum::<f64>()
            }
        }
    };
    let all: Vec<f64> = (0..days).map(velocity).collect();
    let mean = all.iter().sum::<f64>() / length;
    all.iter().map(|one| one / mean).collect()
}

/// A slope of 2 to 8 benchmarks; `velocities`: read as velocities with relative noise.
pub(crate) fn slope(fate: Fate, seed: u64, velocities: bool) -> Slope {
    let mut draw = Draw(Pcg64::seed_from_u64(seed));
    let days = 200 + draw.below(400);
    let count = 2 + draw.below(7);
    let at = draw.between(0.3, 0.7) * days as f64;
    let common = motion(&mut draw, days);
    let parted = 1 + draw.below((count / 2).max(1));
    let factor = if draw.below(2) == 0 {
        draw.between(0.2, 0.6)
    } else {
        draw.between(1.7, 4.0)
    };
    let every = [1.0, 1.0, 2.0, 4.0][draw.below(4)];
    let troubled = draw.below(count);
    let mut series = Vec::new();
    for index in 0..count {
        let amplitude = draw.between(-1.0, 1.0).exp();
        let own = if fate == Fate::Apart {
            motion(&mut draw, days)
        } else {
            common.clone()
        };
        let velocity: Vec<f64> = own
            .iter()
            .enumerate()
            .map(|(day, velocity)| {
                let since = (day as f64 - at).max(0.0) / (days as f64 - at);
                let share = day as f64 / days as f64;
                let by = match fate {
                    Fate::Parted if index < parted && day as f64 >= at => factor,
                    Fate::Parting if index < parted => 1.0 + 2.0 * (factor - 1.0) * since,
                    Fate::Drift if index < parted => 1.0 + (factor - 1.0) * share,
                    Fate::BentDrift if index < parted => factor.powf(1.5 * share),
                    Fate::Together
                    | Fate::OneOffset
                    | Fate::Strays
                    | Fate::Apart
                    | Fate::Drift
                    | Fate::BentDrift
                    | Fate::Parted
                    | Fate::Parting => 1.0,
                };
                amplitude * by.max(0.05) * velocity
            })
            .collect();
        let trouble = if index == troubled { Some(fate) } else { None };
        let readings = read(
            &mut draw,
            &velocity,
            (every, velocities, amplitude),
            trouble,
        );
        series.push(Series {
            benchmark: BenchmarkId::new(format!("b{index}")),
            unit: if velocities {
                Unit::MM_PER_DAY
            } else {
                Unit::MM
            },
            averaging: None,
            readings,
        });
    }
    let ids = |range: std::ops::Range<usize>| {
        range.map(|index| series[index].benchmark.clone()).collect()
    };
    Slope {
        groups: vec![ids(0..parted), ids(parted..count)],
        series,
        at,
    }
}

fn read(
    draw: &mut Draw,
    velocity: &[f64],
    (every, velocities, amplitude): (f64, bool, f64),
    trouble: Option<Fate>,
) -> Vec<Reading> {
    let days = velocity.len() as f64;
    let total: f64 = velocity.iter().sum();
    let (white, walking) = (
        total * draw.between(0.001, 0.01),
        amplitude * draw.between(0.02, 0.3),
    );
    let memory = draw.between(0.5, 0.95);
    let relative = draw.between(0.02, 0.08);
    let (gap, gap_days) = (draw.between(0.0, days), draw.between(0.0, 0.08) * days);
    let (offset_at, offset) = (
        draw.between(0.2, 0.8) * days,
        total * draw.between(0.1, 0.5),
    );
    let mut slip = 0.0;
    let mut day = draw.between(0.0, every);
    let mut noise = 0.0;
    let mut from = 0usize;
    let mut readings = Vec::new();
    while day < days {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a day of the record"
        )]
        let whole = day as usize;
        slip += velocity[from..whole].iter().sum::<f64>();
        from = whole;
        let exact = slip + (day - whole as f64) * velocity[whole];
        noise = memory * noise + (1.0 - memory * memory).sqrt() * draw.normal();
        let mut value = if velocities {
            velocity[whole] * (relative * draw.normal()).exp()
        } else {
            exact + white * draw.normal() + 3.0 * walking * noise
        };
        if trouble == Some(Fate::OneOffset) && day > offset_at && !velocities {
            value += offset;
        }
        if trouble == Some(Fate::Strays) && draw.below(40) == 0 {
            value += if velocities { 3.0 * value } else { 0.3 * total };
        }
        let is_missing = draw.below(20) == 0 || (day > gap && day < gap + gap_days);
        if !is_missing {
            let time = after_days(day_zero(), day).unwrap();
            readings.push(Reading {
                time,
                value,
                sigma: None,
            });
        }
        day += every * draw.between(0.9, 1.1);
    }
    readings
}
