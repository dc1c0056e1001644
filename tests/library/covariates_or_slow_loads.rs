//! A covariate is what acted only where a slow load that nothing measures does not do nearly as well.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::effects::{Explanation, Kind, Options, explain};
use slipwatch::reading::{
    BenchmarkId, Channel, Reading, Sample, Series, Timestamp, Unit, after_days,
};

fn at(day: f64) -> Timestamp {
    let epoch = "2021-01-01T06:00:00Z".parse().unwrap();
    after_days(epoch, day).unwrap()
}

fn channel(name: &str, days: u32, value: impl FnMut(f64) -> f64) -> Channel {
    let mut value = value;
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

/// A slope of that velocity, mm/day, by the day, read each day with an error of `noise` mm.
fn series(days: u32, velocity: impl Fn(f64) -> f64, noise: f64, generator: &mut Pcg64) -> Series {
    let mut moved = 0.0;
    let readings = (0..days).map(f64::from).map(|day| {
        let parts = (0..24).map(|hour| velocity(day - 1.0 + (f64::from(hour) + 0.5) / 24.0));
        moved += parts.sum::<f64>() / 24.0;
        Reading {
            time: at(day),
            value: moved + noise * generator.sample::<f64, _>(StandardNormal),
            sigma: None,
        }
    });
    Series {
        benchmark: BenchmarkId::new("prism"),
        unit: Unit::MM,
        averaging: None,
        readings: readings.collect(),
    }
}

fn said(series: &Series, channels: &[Channel]) -> Explanation {
    explain(series, channels, &[], &Options::default(), &mut |_| ())
}

#[test]
fn warmth_does_not_explain_a_slope_that_fails_by_a_power_law() {
    let mut generator = Pcg64::seed_from_u64(5);
    let power = |day: f64| 0.4 * (1.0 - day / 215.0).powf(-1.6);
    let slope = series(200, power, 0.8, &mut generator);
    let mut weather = 0.0;
    let warmth = channel("air_temperature_c", 200, |day| {
        weather = 0.8 * weather + 1.8 * generator.sample::<f64, _>(StandardNormal);
        8.0 - 10.0 * (std::f64::consts::TAU * (day - 15.0) / 365.25).cos() + weather
    });
    let explanation = said(&slope, &[warmth]);
    let mut effects = std::iter::once(&explanation.verdict).chain(&explanation.also);
    assert!(
        effects.all(|one| one.channel.is_none()),
        "{:?}",
        explanation.verdict
    );
}

#[test]
fn a_lake_that_is_drawn_down_once_explains_the_motion_that_comes_with_it() {
    let mut generator = Pcg64::seed_from_u64(6);
    let level = |day: f64| 170.0 - 10.0 * ((day - 40.0) / 15.0).clamp(0.0, 1.0);
    // It seeps out of the slope within days.
    let seeped = |day: f64| {
        let each = (0..40).map(|before| f64::from(before) * 0.5);
        let weights = each.map(|before| ((-before / 5.0).exp(), level(day - before)));
        let (sum, total) = weights.fold((0.0, 0.0), |(sum, total), (weight, level)| {
            (sum + weight * level, total + weight)
        });
        sum / total
    };
    let velocity = |day: f64| 0.5 * (0.12 * (170.0 - seeped(day))).exp();
    let slope = series(120, velocity, 0.3, &mut generator);
    let explanation = said(&slope, &[channel("lake_level_m", 120, level)]);
    assert_eq!(
        explanation.verdict.effect,
        Kind::HYDROLOGICAL,
        "{:?}",
        explanation.candidates
    );
}
