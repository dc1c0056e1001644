//! Slopes under a load that a covariate carries, drawn from a seed: the readings, the covariate, and when the slope fails.

use anyhow::{Context, Result};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Exp, Gamma};
use rand_pcg::Pcg64;
use slipwatch::model::{Accuracy, Law, Load, LoadedLaw};
use slipwatch::reading::{
    BenchmarkId, Channel, LengthUnit, Reading, Recording, Sample, Series, Timestamp, Unit,
    after_days,
};
use studies::law_from_healing;
use studies::random::{normal, uniform};

/// Days between two values of the load.
const TICK: f64 = 0.1;
/// A slope is not drawn again more often than this.
const MOST_TRIES: u64 = 50;
/// No record is shorter.
const FEWEST_READINGS: usize = 80;

/// One slope.
#[derive(Debug)]
pub(crate) struct DrivenLife {
    pub(crate) recording: Recording,
    /// When it fails; `None` where it stands.
    pub(crate) failure: Option<Timestamp>,
    /// The covariate's name.
    pub(crate) channel: &'static str,
}

/// What the weather or the water does to a slope.
struct Driver {
    channel: &'static str,
    /// Of the covariate, (days, value).
    samples: Vec<(f64, f64)>,
    /// The log-load, a value each tick.
    log_load: Vec<f64>,
}

/// The slope of this seed; the even ones fail.
pub(crate) fn life(seed: u64) -> Result<DrivenLife> {
    let mut tries = (0..MOST_TRIES).map(|k| attempt(seed.is_multiple_of(2), seed * MOST_TRIES + k));
    tries
        .find_map(Result::transpose)
        .context("no slope could be drawn")?
}

fn attempt(fails: bool, seed: u64) -> Result<Option<DrivenLife>> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let span = uniform(&mut rng, 150.0, 500.0);
    let driver = if rng.random::<bool>() {
        rain(&mut rng, span)?
    } else {
        lake(&mut rng, span)
    };
    let days: Vec<f64> = (0..driver.log_load.len())
        .map(|k| k as f64 * TICK)
        .collect();
    let knots = days.iter().copied().zip(driver.log_load.iter().copied());
    let load = Load::new(knots.collect())?;
    let v_i = 10_f64.powf(uniform(&mut rng, -0.3, 0.7));
    let law = if fails {
        let at = span * uniform(&mut rng, 0.6, 0.95);
        failing_at(&mut rng, (v_i, at), &load)?
    } else {
        // Slower than the steady state that it comes to, so that it does not fail.
        let (a, p) = (
            uniform(&mut rng, 0.5, 3.0) / span,
            uniform(&mut rng, 0.0, 0.6),
        );
        law_from_healing(v_i, a, uniform(&mut rng, 0.6, 1.0), p)
    };
    let loaded = LoadedLaw::new(&law, &load, Accuracy::Fit)?;
    let failure = loaded.failure_days(span);
    if failure.is_some() != fails {
        return Ok(None);
    }
    let step = if rng.random::<bool>() { 0.25 } else { 1.0 };
    let noise = [0.2, 0.5, 1.0, 2.0][rng.random_range(0..4)];
    let end = failure.unwrap_or(span);
    let count = whole((end / step).ceil());
    let times: Vec<f64> = (0..count).map(|k| k as f64 * step).collect();
    let mut motions = vec![None; times.len()];
    loaded.motions(&times, &mut motions);
    let read = times
        .iter()
        .zip(motions)
        .filter_map(|(t, motion)| Some((*t, motion?)));
    let read = read.map(|(t, motion)| (t, motion.displacement + noise * normal(&mut rng)));
    let read: Vec<(f64, f64)> = read.collect();
    if read.len() < FEWEST_READINGS {
        return Ok(None);
    }
    let samples: Vec<(f64, f64)> = driver
        .samples
        .into_iter()
        .filter(|(t, _)| *t < end)
        .collect();
    Ok(Some(DrivenLife {
        recording: recording(driver.channel, &samples, &read)?,
        failure: failure.and_then(|days| after_days(epoch()?, days)),
        channel: driver.channel,
    }))
}

/// A law that fails at that day under the load.
fn failing_at(rng: &mut Pcg64, (v_i, at): (f64, f64), load: &Load) -> Result<Law> {
    let (a, p) = (uniform(rng, 0.02, 0.5) / at, uniform(rng, 0.05, 0.6));
    let of = |ratio: f64| law_from_healing(v_i, a, ratio, p);
    let (mut low, mut high) = (1e-3_f64, 1e4_f64);
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        let loaded = LoadedLaw::new(&of(middle), load, Accuracy::Fit)?;
        if loaded.failure_days(at).is_some() {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(of(high))
}

/// Storms a week apart or so, as daily sums; the load is what has not drained yet.
fn rain(rng: &mut Pcg64, span: f64) -> Result<Driver> {
    let (pause, storm) = (Exp::new(1.0 / 8.0)?, Gamma::new(0.8, 15.0)?);
    let mut daily = vec![0.0; days_in(span)];
    let mut day = pause.sample(rng);
    while let Some(sum) = daily.get_mut(whole(day)) {
        *sum += storm.sample(rng);
        day += pause.sample(rng) + 1.0;
    }
    let drains = [2.0, 5.0, 12.0][rng.random_range(0..3)];
    let per_tick = whole(1.0 / TICK);
    let mut wet = 0.0;
    let mut log_load = Vec::new();
    for sum in &daily {
        for _ in 0..per_tick {
            wet = wet * (-TICK / drains).exp() + sum * TICK;
            log_load.push(wet);
        }
    }
    Ok(Driver {
        channel: "rain_mm",
        // A sum is known at the end of its day.
        samples: daily
            .iter()
            .enumerate()
            .map(|(day, sum)| (day as f64 + 1.0, *sum))
            .collect(),
        log_load: scaled(rng, log_load),
    })
}

/// A lake that is drawn down and filled, read each day.
fn lake(rng: &mut Pcg64, span: f64) -> Driver {
    let (long, short) = (uniform(rng, 40.0, 150.0), uniform(rng, 15.0, 60.0));
    let phase = uniform(rng, 0.0, std::f64::consts::TAU);
    let level = |day: f64| {
        let turn = std::f64::consts::TAU * day;
        (turn / long + phase).sin() + 0.5 * (turn / short).sin()
    };
    let seeps = [0.5, 3.0, 10.0][rng.random_range(0..3)];
    let mut inside = level(0.0);
    let ticks = days_in(span) * whole(1.0 / TICK);
    let each = (0..ticks).map(|k| {
        inside += (level(k as f64 * TICK) - inside) * -(-TICK / seeps).exp_m1();
        inside
    });
    let log_load = each.collect();
    Driver {
        channel: "lake_level_m",
        samples: (0..days_in(span))
            .map(|day| (day as f64, 100.0 + 10.0 * level(day as f64)))
            .collect(),
        log_load: scaled(rng, log_load),
    }
}

/// With mean 0, and a standard deviation of .3 to .8 e-folds of velocity.
fn scaled(rng: &mut Pcg64, mut load: Vec<f64>) -> Vec<f64> {
    let n = load.len() as f64;
    let mean = load.iter().sum::<f64>() / n;
    let sd = (load.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / n).sqrt();
    let gain = uniform(rng, 0.3, 0.8) / sd.max(1e-9);
    for f in &mut load {
        *f = gain * (*f - mean);
    }
    load
}

fn recording(channel: &str, samples: &[(f64, f64)], read: &[(f64, f64)]) -> Result<Recording> {
    let epoch = epoch().context("a time")?;
    let at = |days: f64| after_days(epoch, days).context("a time out of range");
    let samples = samples.iter().map(|(day, value)| {
        Ok(Sample {
            time: at(*day)?,
            value: *value,
        })
    });
    let readings = read.iter().map(|(day, value)| {
        Ok(Reading {
            time: at(*day)?,
            value: *value,
            sigma: None,
        })
    });
    Ok(Recording {
        series: vec![Series {
            benchmark: BenchmarkId::new("a"),
            unit: Unit::Length(LengthUnit::Millimetre),
            averaging: None,
            readings: readings.collect::<Result<_>>()?,
        }],
        channels: vec![Channel {
            name: channel.to_owned(),
            unit: None,
            stated: None,
            samples: samples.collect::<Result<_>>()?,
        }],
        ..Recording::default()
    })
}

fn epoch() -> Option<Timestamp> {
    Timestamp::from_second(1_577_836_800).ok()
}

fn days_in(span: f64) -> usize {
    whole(span)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small and not negative"
)]
fn whole(value: f64) -> usize {
    value.round() as usize
}
