//! A slope that is read daily and collapses within a week of the beginning of its acceleration.

use crate::crisis::{Crisis, policy};
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
    let scale = generator.random_range(20.0..100.0);
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
fn a_slope_read_daily_that_runs_up_within_a_week_is_red_a_day_before_in_half_of_the_cases_or_more()
{
    let leads: Vec<Option<f64>> = (0..12)
        .map(|seed| {
            let (series, end) = slope(8000 + seed);
            let red = Crisis::play(&series, &policy(24)).first(Level::Red)?;
            Some(end.duration_since(red).as_secs_f64() / 86_400.0)
        })
        .collect();
    let in_time = leads.iter().flatten().filter(|lead| **lead >= 1.0);
    assert!(in_time.count() >= 6, "days before the end: {leads:?}");
}
