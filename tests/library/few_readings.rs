//! A slope that is read daily and collapses within a week of the beginning of its acceleration.

use crate::crisis::{Crisis, policy};
use jiff::SignedDuration;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::reading::{BenchmarkId, Reading, Series, Timestamp, Unit, after_days};

/// Days of creep before it, mm/day of that, days of the acceleration, and the standard deviation of the noise, mm.
const QUIET: f64 = 94.0;
const CREEP: f64 = 0.3;
const ACCELERATES: f64 = 6.0;
const NOISE: f64 = 1.0;

/// Velocity K / (T - t) beside the creep, K from 20 to 100 mm, until it is 1 m/day: that is the end.
fn slope(seed: u64) -> (Series, Timestamp) {
    let mut generator = Pcg64::seed_from_u64(seed);
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let scale = 20.0 * 5.0_f64.powf(generator.random::<f64>());
    let meets = QUIET + ACCELERATES + generator.random::<f64>();
    let end = meets - scale / 1000.0;
    let mut readings = Vec::new();
    for day in (0..200).map(f64::from).take_while(|day| *day < end) {
        let (since, span) = ((day - QUIET).max(0.0), meets - QUIET);
        let run = scale * ((span / (span - since)).ln() - since / span);
        let z: f64 = generator.sample(StandardNormal);
        readings.push(Reading {
            time: after_days(start, day).unwrap(),
            value: CREEP * day + run + NOISE * z,
            sigma: None,
        });
    }
    let series = Series {
        benchmark: BenchmarkId::new("P"),
        unit: Unit::MM,
        averaging: None,
        readings,
    };
    (series, after_days(start, end).unwrap())
}

#[test]
fn a_slope_read_daily_that_runs_up_within_a_week_is_red_a_day_before_in_two_cases_of_three() {
    let in_time = (0..12).filter(|seed| {
        let (series, end) = slope(8000 + seed);
        let red = Crisis::play(&series, &policy(24)).first(Level::Red);
        red.is_some_and(|red| end.duration_since(red) >= SignedDuration::from_hours(24))
    });
    let count = in_time.count();
    assert!(count >= 8, "{count} of 12");
}
