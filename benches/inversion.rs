//! What an inversion costs: the least squares alone, and with regime and failure time.

#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]

use divan::{Bencher, black_box};
use slipwatch::fit::{ConstantLoad, Exponent, PointReadings};
use slipwatch::inversion::{FitReport, Inversion, InversionOptions};
use slipwatch::reading::{BenchmarkId, Series, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::Path;

const READINGS: usize = 67;

fn main() {
    divan::main();
}

/// The first readings of benchmark 5 of the reconstruction of Vaiont.
fn series() -> Series {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let file = folder.join("vaiont-1963-reconstruction.mcap");
    let (recording, _) = read_files(&[file], &ReadOptions::default()).unwrap();
    let benchmark = BenchmarkId::new("5");
    let mut series = recording.series(Some(&benchmark), None).unwrap().clone();
    series.readings.truncate(READINGS);
    series
}

#[divan::bench]
fn least_squares_of_67_readings(bencher: Bencher) {
    let series = series();
    let first = series.readings[0].time;
    let each = series.readings.iter();
    let pairs = each.map(|reading| (days_since(first, reading.time), reading.value));
    let readings = PointReadings::new(series.quantity(), pairs);
    bencher.bench_local(|| -> ConstantLoad {
        ConstantLoad::fit(black_box(&readings), Exponent::Free)
    });
}

#[divan::bench]
fn everything_that_fit_reports_of_67_readings(bencher: Bencher) {
    let inversion = Inversion::new(&series(), &InversionOptions::default());
    bencher.bench_local(|| -> FitReport {
        let inversion = black_box(&inversion);
        inversion.report(&inversion.least_squares(), 0.0)
    });
}
