//! What comes and goes with the year in the readings is not said of the slope.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::effects::{Explanation, Kind, Options, explain};
use slipwatch::reading::{
    BenchmarkId, Channel, Reading, Sample, Series, Timestamp, Unit, after_days,
};

const DAYS: u32 = 1200;
const YEAR: f64 = 365.25;

fn at(day: u32) -> Timestamp {
    let epoch = "2021-01-01T06:00:00Z".parse().unwrap();
    after_days(epoch, f64::from(day)).unwrap()
}

/// A channel with a yearly course, whose days differ by a walk that is drawn back.
fn yearly(name: &str, phase_days: f64, generator: &mut Pcg64) -> Channel {
    let mut weather = 0.0;
    let samples = (0..DAYS).map(|day| {
        weather = 0.8 * weather + 1.8 * generator.sample::<f64, _>(StandardNormal);
        let phase = std::f64::consts::TAU * (f64::from(day) - phase_days) / YEAR;
        Sample {
            time: at(day),
            value: 8.0 - 10.0 * phase.cos() + weather,
        }
    });
    Channel {
        name: name.to_owned(),
        unit: None,
        stated: None,
        samples: samples.collect(),
    }
}

/// A steady slope of so many mm/day, read each day with an error of 1.5 mm and a yearly wave of `wave_mm`, beside the air's temperature and a lake that have
/// nothing to do with it.
fn read(mm_per_day: f64, wave_mm: f64, seed: u64) -> Explanation {
    let mut generator = Pcg64::seed_from_u64(seed);
    let readings = (0..DAYS).map(|day| {
        let noise: f64 = generator.sample(StandardNormal);
        let phase = std::f64::consts::TAU * (f64::from(day) - 200.0) / YEAR;
        Reading {
            time: at(day),
            value: mm_per_day * f64::from(day) + wave_mm * phase.cos() + 1.5 * noise,
            sigma: None,
        }
    });
    let series = Series {
        benchmark: BenchmarkId::new("receiver"),
        unit: Unit::MM,
        averaging: None,
        readings: readings.collect(),
    };
    let channels = [
        yearly("air_temperature_c", 15.0, &mut generator),
        yearly("lake_level_m", 130.0, &mut generator),
    ];
    let options = Options {
        surrogates: 99,
        ..Options::default()
    };
    explain(&series, &channels, &[], &options, &mut |_| ())
}

fn has_channel(explanation: &Explanation) -> bool {
    let mut effects = std::iter::once(&explanation.verdict).chain(&explanation.also);
    effects.any(|effect| effect.channel.is_some())
}

#[test]
fn a_wave_of_the_year_in_the_readings_of_a_slope_that_hardly_moves_is_of_the_readings() {
    let said = read(0.01, 3.0, 1);
    assert_eq!(said.verdict.effect, Kind::SEASONAL_READING);
    assert!(!has_channel(&said));
    assert_eq!(said.verdict.unit.as_deref(), Some("mm"));
    let size = said.verdict.size.unwrap();
    assert!((size - 3.0).abs() < 0.3, "{size}");
    assert_eq!(said.verdict.period_days, Some(YEAR));
}

#[test]
fn where_waves_would_change_the_velocity_by_little_they_are_of_the_readings_too() {
    for seed in [2, 3] {
        let said = read(0.3, 0.8, seed);
        assert!(!has_channel(&said), "{seed}: {:?}", said.verdict);
    }
}
