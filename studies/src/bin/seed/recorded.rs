//! The readings of both slopes, reconstructions unless others are given, and displacement and velocity out of each other.

use anyhow::{Context, Result};
use slipwatch::inversion::{FitReport, Inversion, InversionOptions};
use slipwatch::reading::{
    Channel, Quantity, Reading, Recording, Series, Timestamp, Unit, after_days, days_since,
};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::Path;

/// The day from which the paper counts at Vaiont.
pub(crate) const VAIONT_DAY_ZERO: &str = "1963-08-02T00:00:00+01:00";
const DAYS_PER_YEAR: f64 = 365.25;

/// How the names of the files begin.
const VAIONT: &str = "vaiont-1963";
const LA_CLAPIERE: &str = "la-clapiere-1982-1995";
/// Endings of files that can be read.
const READABLE: [&str; 5] = ["mcap", "csv", "ndjson", "jsonl", "dat"];

/// What the readings of a slope are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum RecordKind {
    /// Made to fulfil what the paper states.
    Reconstruction,
    /// Anything else, as its file says.
    Other(String),
}

impl RecordKind {
    fn of(recording: &Recording) -> Self {
        match recording.provenance.get("kind") {
            Some(kind) if kind.contains("reconstruction") => Self::Reconstruction,
            Some(kind) => Self::Other(kind.clone()),
            None => Self::Other("of unstated origin".to_owned()),
        }
    }

    /// `reconstructed` of a reconstruction, else what the readings are.
    pub(crate) fn note(&self, reconstructed: &str) -> String {
        match self {
            Self::Reconstruction => reconstructed.to_owned(),
            Self::Other(kind) => format!("**Readings {kind}.**"),
        }
    }

    /// In a word or two.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Reconstruction => "reconstruction",
            Self::Other(kind) => kind,
        }
    }
}

/// The readings of both slopes.
#[derive(Debug, Clone)]
pub(crate) struct Archive {
    /// Benchmarks 5, 50, 63 and 67: velocity.
    pub(crate) vaiont: Recording,
    pub(crate) vaiont_kind: RecordKind,
    /// Benchmark 10: displacement.
    pub(crate) la_clapiere: Series,
    pub(crate) la_clapiere_kind: RecordKind,
    /// The Tinée's flow, where the file has one channel.
    pub(crate) flow: Option<Channel>,
}

impl Archive {
    /// The recordings in the repository.
    pub(crate) fn own() -> Result<Self> {
        Self::of(&studies::project().join("recordings"))
    }

    /// Those in a folder: a file each whose name begins as here, in any format that can be read.
    pub(crate) fn of(folder: &Path) -> Result<Self> {
        let vaiont = recording(folder, VAIONT)?;
        let la_clapiere = recording(folder, LA_CLAPIERE)?;
        let displacement = la_clapiere.series(None, Some(Quantity::Displacement))?;
        Ok(Self {
            vaiont_kind: RecordKind::of(&vaiont),
            la_clapiere_kind: RecordKind::of(&la_clapiere),
            la_clapiere: displacement.clone(),
            flow: la_clapiere.channels.first().cloned(),
            vaiont,
        })
    }
}

fn recording(folder: &Path, name: &str) -> Result<Recording> {
    let context = || format!("{}: reading the folder", folder.display());
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(context)? {
        let file = entry.with_context(context)?.path();
        let is_named = |text: &str| text.starts_with(name);
        let ending = file.extension().and_then(|ending| ending.to_str());
        let is_readable = ending.is_some_and(|ending| READABLE.contains(&ending));
        if is_readable
            && file
                .file_stem()
                .and_then(|stem| stem.to_str())
                .is_some_and(is_named)
        {
            found.push(file);
        }
    }
    anyhow::ensure!(
        found.len() == 1,
        "{}: {} files whose name begins with {name}, expected one",
        folder.display(),
        found.len()
    );
    let (recording, _) = read_files(&found, &ReadOptions::default())?;
    Ok(recording)
}

/// One inversion with everything that is said of it; the clock stays out.
pub(crate) fn report(series: &Series, options: &InversionOptions) -> FitReport {
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
