//! Series made up for the tests of the engine's parts.

use super::given::Cause;
use super::kind::Kind;
use super::problem::Problem;
use crate::reading::{
    BenchmarkId, Channel, LengthUnit, Quantity, Reading, Sample, Series, TimeUnit, Timestamp, Unit,
    after_days,
};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

pub(super) fn generator(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

/// Independent, standard deviation 1.
pub(super) fn normals(generator: &mut Pcg64, count: usize) -> Vec<f64> {
    let one = |_| generator.sample(StandardNormal);
    (0..count).map(one).collect()
}

pub(super) fn epoch() -> Timestamp {
    "2001-01-01T00:00:00Z".parse().unwrap()
}

/// 0, 1, 2 ... days.
pub(super) fn daily(count: usize) -> Vec<f64> {
    (0..count).map(|day| day as f64).collect()
}

/// Whole days with gaps: of every `keep` days and `gap` more only the first `keep`.
pub(super) fn with_gaps(count: usize, keep: usize, gap: usize) -> Vec<f64> {
    let days = (0..).filter(|day| day % (keep + gap) < keep);
    days.take(count).map(|day: usize| day as f64).collect()
}

/// Readings in mm, or in mm/day, `days` after the epoch.
pub(super) fn series(quantity: Quantity, days: &[f64], values: &[f64]) -> Series {
    let unit = match quantity {
        Quantity::Displacement => Unit::Length(LengthUnit::Millimetre),
        Quantity::Velocity => Unit::Rate(LengthUnit::Millimetre, TimeUnit::Day),
    };
    let readings = days.iter().zip(values).map(|(day, value)| Reading {
        time: after_days(epoch(), *day).unwrap(),
        value: *value,
        sigma: None,
    });
    Series {
        benchmark: BenchmarkId::new("made up"),
        unit,
        averaging: None,
        readings: readings.collect(),
    }
}

pub(super) fn channel(name: &str, days: &[f64], values: &[f64]) -> Channel {
    let samples = days.iter().zip(values).map(|(day, value)| Sample {
        time: after_days(epoch(), *day).unwrap(),
        value: *value,
    });
    Channel {
        name: name.to_owned(),
        unit: None,
        stated: None,
        samples: samples.collect(),
    }
}

/// Readings of a slope that moves by 1 mm/day at these days, with noise of 1 mm or of 0.1 mm/day.
pub(super) fn steady(quantity: Quantity, days: &[f64], seed: u64) -> Problem {
    let noise = normals(&mut generator(seed), days.len());
    let each = days.iter().zip(noise);
    let values: Vec<f64> = match quantity {
        Quantity::Displacement => each.map(|(day, noise)| day + noise).collect(),
        Quantity::Velocity => each.map(|(_, noise)| 1.0 + 0.1 * noise).collect(),
    };
    let mut problem = Problem::new(&series(quantity, days, &values), &[]).unwrap();
    let typical = problem.typical_velocity();
    problem.see(&vec![typical; days.len()]);
    problem
}

/// Pearson's.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let means = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        let each = a.iter().zip(b);
        each.map(|(x, y)| of(x - means.0, y - means.1)).sum::<f64>()
    };
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

const COUNT: usize = 240;
/// mm.
pub(super) const NOISE: f64 = 0.2;

pub(super) fn cause(kind: Kind) -> Cause {
    Cause {
        kind,
        channel: None,
        at: None,
    }
}

pub(super) fn lake(days: &[f64]) -> Vec<f64> {
    days.iter().map(|day| (day / 9.0).sin()).collect()
}

/// 1 mm/day, by a factor of e^0.5 more where the lake is high, and a jump of the reading by 15 mm before day 100.
pub(super) fn driven_by_the_lake() -> (Series, Vec<Channel>) {
    let days = daily(COUNT);
    let noise = normals(&mut generator(3), COUNT);
    let mut moved = 0.0;
    let values = lake(&days).into_iter().zip(noise).enumerate();
    let values = values.map(|(day, (level, noise))| {
        moved += (0.5 * level).exp();
        moved + NOISE * noise + if day >= 100 { -15.0 } else { 0.0 }
    });
    let values: Vec<f64> = values.collect();
    let other: Vec<f64> = days.iter().map(|day| (day / 4.0).cos()).collect();
    let channels = vec![
        channel("lake", &days, &lake(&days)),
        channel("other", &days, &other),
    ];
    (series(Quantity::Displacement, &days, &values), channels)
}

/// 1 mm/day, by a factor of e^0.5 more where the lake is high, and by e^`step` more from day 110 on.
pub(super) fn lake_and_step(step: f64, seed: u64) -> (Series, Vec<Channel>) {
    let days = daily(COUNT);
    let noise = normals(&mut generator(seed), COUNT);
    let mut moved = 0.0;
    let each = lake(&days).into_iter().zip(noise).zip(&days);
    let values = each.map(|((level, noise), day)| {
        let step = if *day >= 110.0 { step } else { 0.0 };
        moved += (0.5 * level + step).exp();
        moved + NOISE * noise
    });
    let values: Vec<f64> = values.collect();
    let level = channel("lake", &days, &lake(&days));
    (series(Quantity::Displacement, &days, &values), vec![level])
}

pub(super) fn through(name: &str) -> Cause {
    Cause {
        channel: Some(name.to_owned()),
        ..cause(Kind::HYDROLOGICAL)
    }
}

pub(super) fn jump() -> Cause {
    Cause {
        at: after_days(epoch(), 100.0),
        ..cause(Kind::OFFSET)
    }
}
