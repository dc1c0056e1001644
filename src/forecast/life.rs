//! Simulated lives of slopes, drawn broadly, with their end known: what forecasts are calibrated on.
//!
//! A block creeps, then follows the law with m, time and slip of its own, under a load that nobody declares
//! (Ornstein-Uhlenbeck, and a season on every second slope); its displacement is read with noise, gaps and
//! now and then a reset.

use crate::fit::{Observation, Observations};
use crate::model::{Accuracy, Law, Load, LoadedLaw};
use crate::reading::Quantity;
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// How a life ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// Passes the critical velocity.
    Failing,
    /// Accelerates to a velocity that it keeps.
    Saturating,
    /// Creeps at one velocity.
    Steady,
    /// Slows down to a velocity that it keeps.
    Settling,
}

/// One simulated slope and its readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Life {
    /// How it ends.
    pub fate: Fate,
    /// (days, mm), with noise, gaps and resets.
    pub readings: Vec<(f64, f64)>,
    /// When [`Life::CRITICAL_MM_PER_DAY`] was passed, days.
    pub failure_days: Option<f64>,
}

/// Step of the load, days.
const LOAD_STEP: f64 = 0.1;
/// Days in a year, for the season.
const YEAR: f64 = 365.25;

struct Slope {
    law: Law,
    onset: f64,
    end: f64,
}

impl Life {
    /// Passing this velocity is failure, mm/day.
    pub const CRITICAL_MM_PER_DAY: f64 = 1000.0;

    /// What a monitor has of this slope by `now_days`.
    pub fn known(&self, now_days: f64) -> Observations {
        let known = self.readings.iter().filter(|(days, _)| *days <= now_days);
        let values = known.map(|(t_days, value)| Observation {
            t_days: *t_days,
            value: *value,
            sigma: None,
        });
        Observations {
            quantity: Quantity::Displacement,
            averaging_days: 0.0,
            values: values.collect(),
        }
    }

    /// The life that `seed` gives; a slope that its load brings to another end, or down in less than 0.4 of
    /// its time, is drawn anew.
    pub fn draw(fate: Fate, seed: u64) -> Self {
        let mut generator = Pcg64::seed_from_u64(seed);
        loop {
            if let Some(life) = Self::attempt(fate, &mut generator) {
                return life;
            }
        }
    }

    /// `count` benchmarks of one failing mass: one onset, one time to failure and one load, but each its own
    /// m, slip and readings. Under the load their failure times come to lie apart by what their m make of it.
    pub fn draw_together(count: usize, seed: u64) -> Vec<Self> {
        let mut generator = Pcg64::seed_from_u64(seed);
        loop {
            let duration = log_uniform(&mut generator, 60.0, 700.0);
            let onset = duration * generator.random_range(0.0..2.0);
            let knots = load(onset + 1.5 * duration, &mut generator);
            let together: Option<Vec<Self>> = (0..count)
                .map(|_| {
                    let law = law(Fate::Failing, duration, &mut generator);
                    Self::of(
                        Fate::Failing,
                        law,
                        (onset, duration),
                        &knots,
                        &mut generator,
                    )
                })
                .collect();
            if let Some(together) = together {
                return together;
            }
        }
    }

    fn attempt(fate: Fate, generator: &mut impl Rng) -> Option<Self> {
        let duration = log_uniform(generator, 60.0, 700.0);
        let onset = duration * generator.random_range(0.0..2.0);
        let law = law(fate, duration, generator);
        let knots = load(onset + 1.5 * duration, generator);
        Self::of(fate, law, (onset, duration), &knots, generator)
    }

    fn of(
        fate: Fate,
        law: Law,
        (onset, duration): (f64, f64),
        knots: &[(f64, f64)],
        generator: &mut impl Rng,
    ) -> Option<Self> {
        let end = onset + 1.5 * duration;
        let slope = Slope { law, onset, end };
        let (path, failure_days) = slope.path(knots)?;
        let ends_as_it_should = match (fate, failure_days) {
            (Fate::Failing, Some(days)) => days > onset + 0.4 * duration,
            (Fate::Failing, None) => false,
            (_, passed) => passed.is_none(),
        };
        ends_as_it_should.then(|| Self {
            fate,
            readings: read(&path, generator),
            failure_days,
        })
    }
}

/// The law that takes about `duration` days to its end.
fn law(fate: Fate, duration: f64, generator: &mut impl Rng) -> Law {
    let m: f64 = match fate {
        Fate::Failing => generator.random_range(1.0..1.7),
        Fate::Saturating | Fate::Steady | Fate::Settling => generator.random_range(0.5..0.95),
    };
    let p = 1.0 - 1.0 / m;
    // The velocity it keeps over that of the creep.
    let gain = match fate {
        Fate::Failing | Fate::Steady => 1.0,
        Fate::Saturating => log_uniform(generator, 2.0, 20.0),
        Fate::Settling => log_uniform(generator, 0.1, 0.7),
    };
    let s_theta = match fate {
        Fate::Failing => 1.0 + log_uniform(generator, 0.2, 10.0),
        Fate::Saturating | Fate::Steady | Fate::Settling => gain.powf((1.0 - m) / m),
    };
    let a = match fate {
        Fate::Failing => {
            let unit = regular(1.0, 1.0, s_theta, p);
            unit.failure_days().unwrap_or(1.0) / duration
        }
        // The relaxation takes half of the time.
        Fate::Saturating | Fate::Steady | Fate::Settling => {
            2.0 / duration / (-p * gain.powf(1.0 - p))
        }
    };
    let v_i = match fate {
        // v ~ (D_c/m) / (t_c - t) near failure, and D_c/m = v_i/b, mm.
        Fate::Failing => log_uniform(generator, 50.0, 1000.0) * s_theta * a,
        Fate::Saturating | Fate::Steady | Fate::Settling => log_uniform(generator, 0.1, 10.0),
    };
    regular(v_i, a, s_theta, p)
}

/// The law with healing `a`, loading b = S theta a, and p.
fn regular(v_i: f64, a: f64, s_theta: f64, p: f64) -> Law {
    Law {
        v_i,
        r: a * (s_theta - 1.0),
        kappa: a * p,
        p,
        a,
        b: a * s_theta,
    }
}

/// (days, log-load) over the whole life.
fn load(end: f64, generator: &mut impl Rng) -> Vec<(f64, f64)> {
    let sigma = generator.random_range(0.0..0.25);
    let memory = log_uniform(generator, 3.0, 40.0);
    let season = if generator.random::<bool>() {
        generator.random_range(0.1..0.4)
    } else {
        0.0
    };
    let phase = generator.random_range(0.0..std::f64::consts::TAU);
    let keep = f64::exp(-LOAD_STEP / memory);
    let mut wander = sigma * normal(generator);
    let mut knots = Vec::new();
    let mut index = 0_u32;
    loop {
        let days = LOAD_STEP * f64::from(index);
        let seasonal = season * (std::f64::consts::TAU * days / YEAR + phase).sin();
        knots.push((days, wander + seasonal));
        if days > end {
            return knots;
        }
        wander = wander * keep + sigma * f64::sqrt(1.0 - keep * keep) * normal(generator);
        index += 1;
    }
}

type Path = (Vec<(f64, f64)>, Option<f64>);

impl Slope {
    /// (days, mm) at every knot of the load, and when the critical velocity was passed.
    fn path(&self, knots: &[(f64, f64)]) -> Option<Path> {
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

/// The readings of a path: (days, mm).
fn read(path: &[(f64, f64)], generator: &mut impl Rng) -> Vec<(f64, f64)> {
    let end = path[path.len() - 1].0;
    let interval = log_uniform(generator, 0.25, 3.0);
    let noise = log_uniform(generator, 0.3, 2.0);
    let mut gaps: Vec<(f64, f64)> = Vec::new();
    while generator.random::<f64>() < 0.6 {
        let start = generator.random_range(0.0..end);
        gaps.push((start, start + interval * generator.random_range(3.0..20.0)));
    }
    let reset = (generator.random::<f64>() < 1.0 / 7.0).then(|| {
        let size = generator.random_range(20.0..100.0);
        let sign = if generator.random::<bool>() {
            1.0
        } else {
            -1.0
        };
        (generator.random_range(0.0..end), sign * size)
    });
    let mut readings = Vec::new();
    let mut index = 0_u32;
    loop {
        let days = interval * f64::from(index);
        if days >= end {
            return readings;
        }
        index += 1;
        let error = noise * normal(generator);
        if gaps.iter().any(|gap| days > gap.0 && days < gap.1) {
            continue;
        }
        let after = path.partition_point(|(t, _)| *t <= days);
        let ((t0, x0), (t1, x1)) = (path[after - 1], path[after]);
        let moved = x0 + (x1 - x0) * (days - t0) / (t1 - t0);
        let zero = reset.map_or(0.0, |(when, size)| if days >= when { size } else { 0.0 });
        readings.push((days, moved + error + zero));
    }
}

fn normal(generator: &mut impl Rng) -> f64 {
    generator.sample(StandardNormal)
}

fn log_uniform(generator: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(generator.random::<f64>())
}
