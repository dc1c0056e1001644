//! What one reading costs: a solution of the law, a posterior, an update of the whole panel.

#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]

use divan::{Bencher, black_box};
use slipwatch::fit::{Assumptions, LawDraws, Observation, Observations, RateOptions};
use slipwatch::forecast::LawForecaster;
use slipwatch::model::{Accuracy, Law, Load, LoadedLaw, Motion, Trajectory};
use slipwatch::reading::{BenchmarkId, Quantity, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::Path;

/// The readings that a fit is given here, and the passage that is asked for.
const READINGS: usize = 67;
const CRITICAL_MM_PER_DAY: f64 = 1000.0;

fn main() {
    divan::main();
}

/// The first readings of benchmark 5 of the reconstruction of Vaiont.
fn observations() -> Observations {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let file = folder.join("vaiont-1963-reconstruction.mcap");
    let (recording, _) = read_files(&[file], &ReadOptions::default()).unwrap();
    let benchmark = BenchmarkId::new("5");
    let series = recording.series(Some(&benchmark), None).unwrap();
    let first = series.readings[0].time;
    let values = series.readings.iter().take(READINGS);
    Observations {
        quantity: Quantity::Velocity,
        averaging_days: 0.0,
        values: values
            .map(|reading| Observation {
                t_days: days_since(first, reading.time),
                value: reading.value * series.unit.factor(),
                sigma: reading.sigma,
            })
            .collect(),
    }
}

#[divan::bench(args = [Accuracy::Fit, Accuracy::Full])]
fn trajectory_of_an_unstable_slope(accuracy: Accuracy) -> Trajectory {
    let law = Law::from_paper(1.35, 0.6, 1.0, 1.0).unwrap();
    Trajectory::solve(black_box(&law), 1.28, accuracy)
}

#[divan::bench(args = [Accuracy::Fit, Accuracy::Full])]
fn trajectory_of_a_stable_slope(accuracy: Accuracy) -> Trajectory {
    let law = Law::from_paper(0.98, 39.0, 1.0, 1.0).unwrap();
    Trajectory::solve(black_box(&law), 400.0, accuracy)
}

/// A year of daily loads, read on 67 days.
#[divan::bench(args = [Accuracy::Fit, Accuracy::Full])]
fn a_year_under_daily_loads(bencher: Bencher, accuracy: Accuracy) {
    let law = Law::from_paper(0.9, 4.0, 30.0, 1.0).unwrap();
    let days = (0..366).map(f64::from);
    let load = Load::new(days.map(|day| (day, 0.1 * (day / 58.0).sin())).collect()).unwrap();
    let loaded = LoadedLaw::new(&law, &load, accuracy).unwrap();
    let times: Vec<f64> = (0_u32..67).map(|k| f64::from(k) * 5.4).collect();
    let mut motions: Vec<Option<Motion>> = vec![None; times.len()];
    bencher.bench_local(|| loaded.motions(black_box(&times), &mut motions));
}

#[divan::bench]
fn posterior_of_67_readings(bencher: Bencher) {
    let rates = observations().rates(0..READINGS, RateOptions::default());
    bencher.bench(|| LawDraws::of(black_box(&rates), &Assumptions::CONSTANT_LOAD));
}

/// Hourly displacements of a slope that accelerates for ever more slowly, kept as a monitor keeps them.
fn watched(count: u32) -> Observations {
    let mut watched = Observations {
        quantity: Quantity::Displacement,
        averaging_days: 0.0,
        values: Vec::new(),
    };
    for index in 0..count {
        let ago = f64::from(count - index);
        let noise = 0.3 * (f64::from(index) * 12.9898).sin();
        watched.values.push(Observation {
            t_days: f64::from(index) / 24.0,
            value: -400.0 * ((ago + 300.0) / 24.0).ln() + noise,
            sigma: None,
        });
        watched.compact();
    }
    watched
}

/// One more reading: everything that the monitor computes, the forecast under an undeclared load included.
#[divan::bench(args = [100, 10_000, 1_000_000])]
fn one_more_reading(bencher: Bencher, count: u32) {
    let watched = watched(count);
    bencher
        .with_inputs(|| (LawForecaster::default(), watched.clone()))
        .bench_values(|(mut panel, mut watched)| {
            let last = watched.values[watched.values.len() - 1];
            watched.values.push(Observation {
                t_days: last.t_days + 1.0 / 24.0,
                ..last
            });
            watched.compact();
            panel.update(black_box(&watched), CRITICAL_MM_PER_DAY)
        });
}

/// The outlook of the 67 velocities, from nothing: the law under an undeclared load, and its forecast.
#[divan::bench]
fn outlook_of_67_readings(bencher: Bencher) {
    let all = observations();
    bencher.bench(|| LawForecaster::default().update(black_box(&all), CRITICAL_MM_PER_DAY));
}
