//! A straight line under noise, read as loggers read it, is called to no collapse.

use crate::crisis::{Crisis, policy};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::reading::{BenchmarkId, Reading, Series, Timestamp, Unit, after_days};

/// mm/day, standard deviation of the noise (mm), hours between readings, days, resolution (mm; 0 for none).
const SLOPES: [(f64, f64, f64, f64, f64); 11] = [
    (1.0, 0.2, 1.0, 20.0, 0.0),
    (1.0, 0.5, 6.0, 60.0, 0.0),
    (2.4, 0.3, 1.0, 17.0, 0.0),
    (7.2, 0.05, 1.0 / 6.0, 4.0, 0.0),
    (20.0, 0.1, 1.0 / 6.0, 4.0, 0.0),
    (5.0, 1.0, 24.0, 200.0, 0.0),
    (1.0, 0.4, 1.0 / 6.0, 4.0, 1.0),
    (0.0, 0.5, 1.0, 20.0, 0.0),
    (100.0, 2.0, 1.0, 20.0, 0.0),
    (0.3, 2.0, 168.0, 700.0, 0.0),
    (50.0, 0.02, 1.0, 10.0, 0.0),
];

fn slope((rate, noise, hours, days, resolution): (f64, f64, f64, f64, f64), seed: u64) -> Series {
    let mut generator = Pcg64::seed_from_u64(seed);
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let interval = hours / 24.0;
    let mut readings = Vec::new();
    let mut at = 0.0;
    while at < days {
        let z: f64 = generator.sample(StandardNormal);
        let mut value = rate * at + noise * z;
        if resolution > 0.0 {
            value = (value / resolution).round() * resolution;
        }
        readings.push(Reading {
            time: after_days(start, at).unwrap(),
            value,
            sigma: None,
        });
        at += interval;
    }
    Series {
        benchmark: BenchmarkId::new("P"),
        unit: Unit::MM,
        averaging: None,
        readings,
    }
}

#[test]
fn steady_creep_and_rest_are_never_orange_or_red() {
    for (seed, of) in (7000..).zip(SLOPES) {
        let crisis = Crisis::play(&slope(of, seed), &policy(24));
        let calls = [Level::Orange, Level::Red].map(|level| crisis.first(level));
        assert_eq!(calls, [None, None], "{of:?}, seed {seed}");
        let median = crisis.refits().last().unwrap().median;
        assert_eq!(median, None, "{of:?}, seed {seed}");
    }
}
