//! What a whole search for the missing effect costs, and one solution of the law in it.

#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]

use divan::{Bencher, black_box};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::effects::{Explanation, Kind, Options, explain};
use slipwatch::model::{Accuracy, Drive, Driven, Law, Load, LoadedLaw};
use slipwatch::reading::{
    BenchmarkId, Channel, LengthUnit, Reading, Sample, Series, Unit, after_days,
};

/// Daily readings.
const DAYS: usize = 1500;
/// Standard deviation of a reading, mm.
const NOISE_MM: f64 = 1.0;
/// The log-load of one standard deviation of the reservoir's delayed level, and the delay's mean, days.
const GAIN: f64 = 0.5;
const DELAY_DAYS: f64 = 12.0;

fn main() {
    divan::main();
}

/// An autoregressive series of a value a day, with some of the year in it; standard deviation about 1.
fn weather(generator: &mut Pcg64, memory_days: f64, season: f64) -> Vec<f64> {
    let decay = (-1.0 / memory_days).exp();
    let mut state = 0.0;
    let each = (0..DAYS).map(|day| {
        let step: f64 = generator.sample(StandardNormal);
        state = decay * state + (1.0 - decay * decay).sqrt() * step;
        state + season * (std::f64::consts::TAU * day as f64 / 365.25).sin()
    });
    each.collect()
}

fn law() -> Law {
    Law::from_paper(0.8, 3.0, 400.0, 1.5).unwrap()
}

/// 1,500 displacements of a slope that a reservoir drives, and four channels, one of them the reservoir's.
fn slope() -> (Series, Vec<Channel>) {
    let mut generator = Pcg64::seed_from_u64(20_260_401);
    let level = weather(&mut generator, 40.0, 0.3);
    let others = [(3.0, 0.2), (20.0, 1.0), (8.0, 0.5)]
        .map(|(memory, season)| weather(&mut generator, memory, season));
    let decay = (-1.0 / DELAY_DAYS).exp();
    let mut state = level[0];
    let delayed: Vec<f64> = level
        .iter()
        .map(|value| {
            state = decay * state + (1.0 - decay) * value;
            GAIN * state
        })
        .collect();
    let knots = delayed.iter().enumerate();
    let load = Load::new(knots.map(|(day, f)| (day as f64, *f)).collect()).unwrap();
    let loaded = LoadedLaw::new(&law(), &load, Accuracy::Fit).unwrap();
    let days: Vec<f64> = (0..DAYS).map(|day| day as f64).collect();
    let mut motions = vec![None; DAYS];
    loaded.motions(&days, &mut motions);
    let epoch = "2019-01-01T00:00:00Z".parse().unwrap();
    let at = |day: usize| after_days(epoch, day as f64).unwrap();
    let readings = motions.iter().enumerate().map(|(day, motion)| {
        let noise: f64 = generator.sample(StandardNormal);
        Reading {
            time: at(day),
            value: motion.unwrap().displacement + NOISE_MM * noise,
            sigma: None,
        }
    });
    let series = Series {
        benchmark: BenchmarkId::new("bench"),
        unit: Unit::Length(LengthUnit::Millimetre),
        averaging: None,
        readings: readings.collect(),
    };
    let channel = |(name, values): (&str, &Vec<f64>)| Channel {
        name: name.to_owned(),
        unit: Some("m".to_owned()),
        stated: None,
        samples: (0..DAYS)
            .map(|day| Sample {
                time: at(day),
                value: 10.0 + values[day],
            })
            .collect(),
    };
    let [rain, air, flow] = &others;
    let each = [
        ("reservoir_level_m", &level),
        ("snow_depth_m", rain),
        ("sea_level_m", air),
        ("well_level_m", flow),
    ];
    (series, each.map(channel).to_vec())
}

/// 1,500 readings and 4 channels.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn explain_1500_readings(bencher: Bencher) {
    let (series, channels) = slope();
    bencher.bench(|| -> Explanation {
        let options = Options::default();
        let found = explain(black_box(&series), &channels, &[], &options, &mut |_| {});
        assert_eq!(found.verdict.effect, Kind::HYDROLOGICAL);
        found
    });
}

/// One solution of the law on as many nodes: what a fit asks for at every step.
#[divan::bench]
fn one_solution_of_1500_nodes(bencher: Bencher) {
    let days: Vec<f64> = (0..DAYS).map(|day| day as f64).collect();
    let load: Vec<f64> = days.iter().map(|day| 0.5 * (day / 40.0).sin()).collect();
    let mut driven = Driven::default();
    bencher.bench_local(|| {
        let drive = Drive {
            nodes: black_box(&days),
            log_load: &load,
            events: &[],
            per_velocity: 0.0,
            per_slip: 0.0,
        };
        driven.solve(&law(), &drive)
    });
}
