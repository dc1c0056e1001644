//! The forecast is the slope's, not the file's: what does not change the slope does not change it, and what changes little
//! changes it little.

use crate::crisis::{Crisis, policy};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::fit::Observations;
use slipwatch::forecast::{LawForecaster, Outlook};
use slipwatch::reading::{BenchmarkId, Reading, Series, Timestamp, Unit, after_days, days_since};

const CRITICAL: f64 = 1000.0;
/// The collapse, days.
const COLLAPSE: f64 = 30.0;
const NOISE: f64 = 0.3;

/// Creep of 1 mm/day that runs away by an inverse-velocity line in its last ten days, read each `interval` days.
fn failing(interval: f64, until: f64) -> Vec<(f64, f64)> {
    let mut generator = Pcg64::seed_from_u64(11);
    let minutes = 10.0 / 1440.0;
    let every = (interval / minutes).round();
    let mut readings = Vec::new();
    let mut index = 0.0;
    loop {
        let days = index * minutes;
        let z: f64 = generator.sample(StandardNormal);
        if days > until {
            return readings;
        }
        if index % every == 0.0 {
            let onset = COLLAPSE - 10.0;
            let run = if days > onset {
                -10.0 * (1.0 - (days - onset) / 10.0).ln()
            } else {
                days - onset
            };
            readings.push((days, run + NOISE * z));
        }
        index += 1.0;
    }
}

fn observations(readings: &[(f64, f64)]) -> Observations {
    Observations::of_displacements(readings.iter().copied())
}

fn outlook(readings: &[(f64, f64)]) -> Outlook {
    let mut panel = LawForecaster::default();
    panel.update(&observations(readings), CRITICAL).unwrap()
}

/// Chances within spans, of both distributions, and the probability of an acceleration.
fn numbers(outlook: &Outlook) -> Vec<f64> {
    let spans = [0.5, 1.0, 2.0, 5.0, 10.0, 30.0];
    let both = [&outlook.collapse, &outlook.chances];
    let chances = both
        .iter()
        .flat_map(|passage| spans.map(|days| passage.chance_within(days)));
    chances.chain([outlook.accelerating]).collect()
}

fn furthest(a: &Outlook, b: &Outlook) -> f64 {
    let pairs = numbers(a).into_iter().zip(numbers(b));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn series(name: &str, readings: &[(f64, f64)]) -> Series {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let reading = |(days, value): &(f64, f64)| Reading {
        time: after_days(start, *days).unwrap(),
        value: *value,
        sigma: None,
    };
    Series {
        benchmark: BenchmarkId::new(name),
        unit: Unit::MM,
        averaging: None,
        readings: readings.iter().map(reading).collect(),
    }
}

/// Days before the collapse at which red is first called.
fn red_before(readings: &[(f64, f64)]) -> Option<f64> {
    let series = series("P", readings);
    let start = series.readings[0].time;
    let first = Crisis::play(&series, &policy(24)).first(Level::Red)?;
    let collapse = after_days(start, COLLAPSE - readings[0].0).unwrap();
    Some(days_since(first, collapse))
}

#[test]
fn the_zero_of_the_displacement_and_of_time_change_nothing() {
    let readings = failing(0.25, 27.0);
    let plain = outlook(&readings);
    for (days, mm) in [(0.0, 5e4), (0.0, -5e5), (730.0, 0.0), (-365.0, 1e4)] {
        let moved: Vec<(f64, f64)> = readings.iter().map(|(t, x)| (t + days, x + mm)).collect();
        let off = furthest(&plain, &outlook(&moved));
        assert!(off < 1e-5, "{days} days, {mm} mm: {off}");
    }
}

#[test]
fn a_newest_reading_moved_within_its_noise_moves_the_chances_of_the_levels_by_bounded_odds() {
    // ln of the odds, a standard deviation of the noise.
    const MOST_LN_ODDS: f64 = 4.0;
    for until in [12.0, 22.0, 25.0, 27.0, 29.0] {
        let readings = failing(1.0 / 24.0, until);
        let mut before: Option<Vec<f64>> = None;
        for step in -4..=4 {
            let mut moved = readings.clone();
            moved.last_mut().unwrap().1 += 0.25 * NOISE * f64::from(step);
            let found = outlook(&moved);
            let odds = [1.0, 5.0, 30.0].map(|days| {
                let chance = found.chances.chance_within(days).clamp(1e-4, 1.0 - 1e-4);
                (chance / (1.0 - chance)).ln()
            });
            if let Some(before) = before {
                let pairs = odds.iter().zip(&before);
                let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(
                    most < 0.25 * MOST_LN_ODDS,
                    "day {until}, step {step}: {most}"
                );
            }
            before = Some(odds.to_vec());
        }
    }
}

#[test]
fn a_slope_is_red_about_as_early_however_often_it_is_read() {
    let dense = red_before(&failing(1.0 / 24.0, COLLAPSE - 0.05)).unwrap();
    for interval in [1.0 / 144.0, 0.25, 0.5] {
        let early = red_before(&failing(interval, COLLAPSE - 0.05)).unwrap();
        let ratio = early / dense;
        assert!(
            (0.5..2.0).contains(&ratio),
            "each {interval} days: {early} d, hourly {dense} d"
        );
    }
}

#[test]
fn without_its_quiet_history_or_a_tenth_of_its_readings_it_is_red_about_as_early() {
    let all = failing(1.0 / 24.0, COLLAPSE - 0.05);
    let whole = red_before(&all).unwrap();
    let recent: Vec<(f64, f64)> = all.iter().copied().filter(|(t, _)| *t > 12.0).collect();
    let mut generator = Pcg64::seed_from_u64(3);
    let thinned: Vec<(f64, f64)> = all
        .iter()
        .copied()
        .filter(|_| generator.random::<f64>() > 0.1)
        .collect();
    for (name, readings) in [("recent", recent), ("thinned", thinned)] {
        let early = red_before(&readings).unwrap();
        let ratio = early / whole;
        assert!(
            (0.5..2.0).contains(&ratio),
            "{name}: {early} d, whole {whole} d"
        );
    }
}
