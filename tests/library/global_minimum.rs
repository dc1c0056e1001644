//! The inversion's best misfit is the same wherever the search begins, and at or below the published recipe's.

use crate::measured::measured;
use slipwatch::fit::{ConstantLoad, Exponent, Lattice, PointReadings, Solution};
use slipwatch::model::{Accuracy, Trajectory};
use slipwatch::reading::{BenchmarkId, Quantity, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::{Path, PathBuf};

/// Two searches have found the same minimum when their rms agree to this, relative.
const SAME: f64 = 1e-6;

/// The last digit of made-up readings.
const LAST_DIGIT: f64 = 1e-4;

fn here(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

/// (days from the first, value) of the first `count` readings of a benchmark (of the only one, where it
/// has no name).
fn pairs(file: PathBuf, benchmark: &str, quantity: Quantity, count: usize) -> Vec<(f64, f64)> {
    let (recording, _) = read_files(&[file], &ReadOptions::default()).unwrap();
    let wanted = (!benchmark.is_empty()).then(|| BenchmarkId::new(benchmark));
    let series = recording.series(wanted.as_ref(), Some(quantity)).unwrap();
    let first = series.readings[0].time;
    let readings = series.readings.iter().take(count);
    readings
        .map(|reading| (days_since(first, reading.time), reading.value))
        .collect()
}

fn readings(file: PathBuf, benchmark: &str, quantity: Quantity, count: usize) -> PointReadings {
    PointReadings::new(quantity, pairs(file, benchmark, quantity, count))
}

/// The rms of a solution's own law, solved as `simulate` does; `None` where that cannot follow it.
fn rms_of_law(solution: &Solution, quantity: Quantity, pairs: &[(f64, f64)]) -> Option<f64> {
    let length = pairs[pairs.len() - 1].0;
    let motion = Trajectory::solve(&solution.law, length * (1.0 + 1e-12), Accuracy::Full);
    let mut squares = 0.0;
    for (day, value) in pairs {
        let motion = motion.at(*day)?;
        let modelled = match quantity {
            Quantity::Velocity => motion.velocity,
            Quantity::Displacement => solution.displacement_at_start + motion.displacement,
        };
        squares += (value - modelled) * (value - modelled);
    }
    Some((squares / pairs.len() as f64).sqrt())
}

fn rms(readings: &PointReadings, lattice: Lattice) -> f64 {
    let fit = ConstantLoad::fit_on(readings, Exponent::Free, lattice);
    fit.best().unwrap().rms
}

const VAIONT: &str = "recordings/vaiont-1963-reconstruction.mcap";
const CENTURY: &str = "recordings/century-mine-2013.mcap";
const LA_CLAPIERE: &str = "recordings/la-clapiere-1982-1995-reconstruction.mcap";

/// The recorded series that every claim is held to.
const RECORDED: [(&str, &str, Quantity); 7] = [
    (VAIONT, "5", Quantity::Velocity),
    (VAIONT, "50", Quantity::Velocity),
    (VAIONT, "63", Quantity::Velocity),
    (VAIONT, "67", Quantity::Velocity),
    (CENTURY, "31-1931", Quantity::Displacement),
    (CENTURY, "40-1938", Quantity::Displacement),
    (LA_CLAPIERE, "10", Quantity::Displacement),
];

/// How far the worst of `restarts` searches stands above the best, relative.
fn spread(readings: &PointReadings, restarts: u32) -> f64 {
    let regular = rms(readings, Lattice::Regular);
    let all = (0..restarts).map(|number| rms(readings, Lattice::Shifted(number)));
    let (low, high) = all.fold((regular, regular), |(low, high), one| {
        (low.min(one), high.max(one))
    });
    high / low - 1.0
}

#[test]
fn two_hundred_searches_from_other_places_end_in_the_same_minimum() {
    for (file, benchmark, quantity) in RECORDED {
        let spread = spread(&readings(here(file), benchmark, quantity, usize::MAX), 200);
        assert!(spread < SAME, "{file} {benchmark}: {spread:e}");
    }
}

/// Readings of laws that lie at the ends of the range, exact but for the last digits.
fn extremes() -> Vec<(&'static str, PointReadings)> {
    let made = |quantity, of: &dyn Fn(f64) -> f64| {
        let digits = |value: f64| (value / LAST_DIGIT).round() * LAST_DIGIT;
        let pairs = (0..60).map(|day| (f64::from(day), digits(of(f64::from(day)))));
        PointReadings::new(quantity, pairs)
    };
    let velocity = |of: &dyn Fn(f64) -> f64| made(Quantity::Velocity, of);
    let displacement = |of: &dyn Fn(f64) -> f64| made(Quantity::Displacement, of);
    vec![
        ("exponential", velocity(&|t| (0.1 * t).exp())),
        ("slow exponential", velocity(&|t| (0.02 * t).exp())),
        ("exponential decay", velocity(&|t| 50.0 * (-0.07 * t).exp())),
        ("power law", velocity(&|t| 90.0 / (1.0 + t))),
        ("near failure", velocity(&|t| 90.0 / (59.5 - t))),
        (
            "logistic",
            velocity(&|t| 40.0 / (1.0 + (0.2 * (30.0 - t)).exp())),
        ),
        (
            "knee",
            velocity(&|t| if t < 40.0 { 90.0 / (45.0 - t) } else { 18.0 }),
        ),
        ("exponential slip", displacement(&|t| (0.1 * t).exp())),
        (
            "relaxing slip",
            displacement(&|t| 50.0 * (1.0 - (-0.1 * t).exp()) + t),
        ),
        ("logarithmic slip", displacement(&|t| 30.0 * (1.0 + t).ln())),
        (
            "step",
            displacement(&|t| {
                if t < 50.0 {
                    0.1 * t
                } else {
                    5.0 + 20.0 * (t - 49.0)
                }
            }),
        ),
    ]
}

#[test]
fn two_hundred_searches_end_in_the_same_minimum_at_the_ends_of_the_range_too() {
    for (name, readings) in extremes() {
        let all = (0..200).map(|number| rms(&readings, Lattice::Shifted(number)));
        let all: Vec<f64> = all.chain([rms(&readings, Lattice::Regular)]).collect();
        let low = all.iter().copied().fold(f64::INFINITY, f64::min);
        // Where a law fits to the last digit that the readings have, which of such laws is no matter.
        let same = low * (1.0 + SAME) + 0.1 * LAST_DIGIT;
        let above: Vec<&f64> = all.iter().filter(|one| **one > same).collect();
        assert!(
            above.is_empty(),
            "{name}: {} of 201 above {low}: {above:?}",
            above.len()
        );
    }
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn searches_of_measured_series_from_other_places_end_in_the_same_minimum() {
    for (name, benchmark, quantity, restarts) in [
        ("baishuihe_2006.csv", "zg118", Quantity::Displacement, 200),
        ("bazimen_2006.csv", "zg110", Quantity::Displacement, 200),
        ("columbia_1985_marker1.csv", "", Quantity::Velocity, 50),
        ("lanzada_2025_f1.csv", "", Quantity::Velocity, 50),
        ("lanzada_2025_f4.csv", "", Quantity::Velocity, 200),
        ("salmon_falls_2017.csv", "blkm", Quantity::Displacement, 50),
        ("salmon_falls_2017.csv", "ntoe", Quantity::Displacement, 50),
        ("houston_msfx_2013.csv", "north", Quantity::Displacement, 5),
    ] {
        let file = measured(name);
        let spread = spread(&readings(file, benchmark, quantity, usize::MAX), restarts);
        assert!(spread < SAME, "{name} {benchmark}: {spread:e}");
    }
}

#[test]
fn the_rms_of_every_minimum_is_that_of_its_law() {
    for (file, benchmark, quantity) in RECORDED {
        let pairs = pairs(here(file), benchmark, quantity, usize::MAX);
        let readings = PointReadings::new(quantity, pairs.iter().copied());
        let fit = ConstantLoad::fit(&readings, Exponent::Free);
        for solution in &fit.minima {
            let exact = rms_of_law(solution, quantity, &pairs);
            // A knee this sharp is beyond what the general solution follows.
            let Some(exact) = exact.or((solution.law.p.abs() > 50.0).then_some(solution.rms))
            else {
                panic!("{file} {benchmark}: {solution:?} cannot be followed");
            };
            let off = (solution.rms / exact - 1.0).abs();
            assert!(off < SAME, "{file} {benchmark}: {off:e}, {solution:?}");
        }
    }
}

/// Compares the series of the published table that `find` finds with it, and says how many these are.
fn fitted_as_well_as_published(find: impl Fn(&str) -> Option<PathBuf>) -> usize {
    let table = std::fs::read_to_string(here("benches/peers/simplex_rms.csv")).unwrap();
    let rows = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut met = 0;
    for row in rows {
        let [file, benchmark, quantity, count, peer, ..] = row.split(',').collect::<Vec<_>>()[..]
        else {
            panic!("{row}");
        };
        let Some(file) = find(file) else { continue };
        let quantity = match quantity {
            "velocity" => Quantity::Velocity,
            _ => Quantity::Displacement,
        };
        let readings = readings(file, benchmark, quantity, count.parse().unwrap());
        assert_eq!(readings.count().to_string(), count, "{row}");
        let ours = rms(&readings, Lattice::Regular);
        let peer = peer.parse::<f64>().unwrap_or(f64::INFINITY);
        assert!(ours <= peer * (1.0 + SAME), "{row}: {ours}");
        met += 1;
    }
    met
}

/// Files of this repository have a folder before their name.
#[test]
fn no_series_is_fitted_worse_than_by_the_published_recipe() {
    let met = fitted_as_well_as_published(|file| file.contains('/').then(|| here(file)));
    assert!(met >= 8, "only {met} series");
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn no_measured_series_is_fitted_worse_than_by_the_published_recipe() {
    let met = fitted_as_well_as_published(|file| (!file.contains('/')).then(|| measured(file)));
    assert!(met >= 5, "only {met} series");
}
