//! What a day's reading of a drawn slope, and the channels beside it, are made of.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::reading::{
    BenchmarkId, Channel, Reading, Sample, Series, Timestamp, Unit, after_days,
};

pub(crate) const YEAR: f64 = 365.25;

fn at(day: f64) -> Timestamp {
    let epoch = "2021-01-01T06:00:00Z".parse().unwrap();
    after_days(epoch, day).unwrap()
}

pub(crate) fn normal(generator: &mut Pcg64) -> f64 {
    generator.sample(StandardNormal)
}

/// Displacements, mm, one each day.
pub(crate) fn read_daily(days: u32, mut mm: impl FnMut(f64) -> f64) -> Series {
    let readings = (0..days).map(f64::from).map(|day| Reading {
        time: at(day),
        value: mm(day),
        sigma: None,
    });
    Series {
        benchmark: BenchmarkId::new("prism"),
        unit: Unit::MM,
        averaging: None,
        readings: readings.collect(),
    }
}

/// A channel with one value each day.
pub(crate) fn channel(name: &str, days: u32, mut value: impl FnMut(f64) -> f64) -> Channel {
    let samples = (0..days).map(f64::from).map(|day| Sample {
        time: at(day),
        value: value(day),
    });
    Channel {
        name: name.to_owned(),
        unit: None,
        stated: None,
        samples: samples.collect(),
    }
}

/// A channel with a yearly course, lowest on that day, and weather that keeps four fifths of itself from day to day.
pub(crate) fn yearly(name: &str, days: u32, lowest_day: f64, generator: &mut Pcg64) -> Channel {
    let mut weather = 0.0;
    channel(name, days, |day| {
        weather = 0.8 * weather + 1.8 * normal(generator);
        let phase = std::f64::consts::TAU * (day - lowest_day) / YEAR;
        8.0 - 10.0 * phase.cos() + weather
    })
}
