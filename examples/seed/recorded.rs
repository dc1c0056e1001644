//! The two reconstructions in the repository, and displacement and velocity out of each other.

use anyhow::{Context, Result};
use slipwatch::inversion::{FitReport, Inversion, Options};
use slipwatch::reading::{Reading, Recording, Series, Timestamp, Unit, after_days, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::Path;

/// The day from which the paper counts at Vaiont.
pub(crate) const VAIONT_DAY_ZERO: &str = "1963-08-02T00:00:00+01:00";
const DAYS_PER_YEAR: f64 = 365.25;

/// Benchmarks 5, 50, 63 and 67: velocity.
pub(crate) fn vaiont() -> Result<Recording> {
    recording("vaiont-1963-reconstruction.mcap")
}

/// Benchmark 10: displacement.
pub(crate) fn la_clapiere() -> Result<Series> {
    let recording = recording("la-clapiere-1982-1995-reconstruction.mcap")?;
    Ok(recording.series(None, None)?.clone())
}

fn recording(file: &str) -> Result<Recording> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let (recording, _) = read_files(&[folder.join(file)], &ReadOptions::default())?;
    Ok(recording)
}

/// One inversion with everything that is said of it; the clock stays out.
pub(crate) fn report(series: &Series, options: &Options) -> FitReport {
    let inversion = Inversion::new(series, options);
    inversion.report(&inversion.least_squares(), 0.0)
}

/// The paper's days at Vaiont.
pub(crate) fn vaiont_day(time: Timestamp) -> Result<f64> {
    Ok(days_since(VAIONT_DAY_ZERO.parse()?, time))
}

/// The year and its part.
pub(crate) fn decimal_year(time: Timestamp) -> Result<f64> {
    let start: Timestamp = "1980-01-01T00:00:00Z".parse()?;
    Ok(1980.0 + days_since(start, time) / DAYS_PER_YEAR)
}

/// Mean velocities between neighbouring displacements, each at the middle of its interval, in mm/day.
pub(crate) fn velocities(displacements: &Series) -> Result<Series> {
    let between = |pair: &[Reading]| {
        let days = days_since(pair[0].time, pair[1].time);
        Some(Reading {
            time: after_days(pair[0].time, 0.5 * days)?,
            value: (pair[1].value - pair[0].value) * displacements.unit.factor() / days,
            sigma: None,
        })
    };
    let readings = displacements.readings.windows(2).map(between);
    let readings: Option<Vec<Reading>> = readings.collect();
    Ok(Series {
        unit: Unit::MM_PER_DAY,
        averaging: None,
        readings: readings.context("a time beyond the calendar")?,
        ..displacements.clone()
    })
}

/// Displacements since the first reading, in mm, by the trapezoidal rule over velocities in mm/day.
pub(crate) fn displacements(velocities: &Series) -> Series {
    let factor = velocities.unit.factor();
    let mut sum = 0.0;
    let mut earlier: Option<&Reading> = None;
    let mut readings = Vec::new();
    for reading in &velocities.readings {
        if let Some(earlier) = earlier {
            let mean = 0.5 * (earlier.value + reading.value) * factor;
            sum += mean * days_since(earlier.time, reading.time);
        }
        earlier = Some(reading);
        readings.push(Reading {
            value: sum,
            ..*reading
        });
    }
    Series {
        unit: Unit::MM,
        averaging: None,
        readings,
        ..velocities.clone()
    }
}
