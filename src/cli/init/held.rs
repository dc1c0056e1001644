//! What a file holds: benchmarks, covariates alone, or nothing that can be used.

use super::unnamed::{UnusableFile, covariates_alone, mostly_refused, without_readings};
use super::{Args, PlannedBenchmark, PlannedSource};
use crate::cli::args::say_remarks;
use crate::config::SourceKind;
use crate::reading::{BenchmarkId, Quantity, Unit};
use crate::runtime::ingest::{
    FileSurvey, Measure, ReadOptions, TextFormat, look_through, read_with_remarks,
};
use std::collections::BTreeSet;
use std::path::Path;

/// What a file holds.
pub(super) enum FoundInFile {
    Benchmarks(Vec<PlannedBenchmark>),
    /// Covariates by their names, and what is said of it where no other file has a benchmark.
    Covariates(Vec<String>, String),
    /// Which flag names its benchmarks.
    Open(String),
    /// What is wrong with it, so that no flag mends it.
    Bad(String),
}

impl From<UnusableFile> for FoundInFile {
    fn from(file: UnusableFile) -> Self {
        if file.has_a_flag {
            Self::Open(file.problem)
        } else {
            Self::Bad(file.problem)
        }
    }
}

/// Looks through a file; adds the names of its columns to `columns`.
pub(super) fn held(
    file: &Path,
    source: &PlannedSource,
    args: &Args,
    columns: &mut BTreeSet<String>,
) -> anyhow::Result<FoundInFile> {
    let mut options = ReadOptions {
        dialect: source.dialect.clone(),
        ..args.file.options()
    };
    if let Some(zone) = &source.zone {
        options.conventions.clock.zone = Some(zone.clone());
    }
    let looked = look(file, source.kind, &options)?;
    columns.extend(looked.columns.iter().map(|(name, _)| name.clone()));
    columns.extend(looked.names.iter().cloned());
    let stated = |benchmark: &BenchmarkId, unit: Unit| {
        let mut maps = args.file.columns.iter();
        let map =
            maps.find(|map| map.benchmark == *benchmark && map.measure == Measure::Reading(unit));
        map.map(|map| (map.column.clone(), unit.to_string()))
    };
    let found = looked
        .readings
        .iter()
        .map(|(benchmark, unit)| PlannedBenchmark {
            id: benchmark.as_str().to_owned(),
            source: source.id.clone(),
            column: stated(benchmark, *unit),
            is_velocity: unit.quantity() == Quantity::Velocity,
            has_both: false,
        });
    let found: Vec<PlannedBenchmark> = found.collect();
    if found.is_empty() {
        let unusable = without_readings(file, &looked, &args.covariates.stated);
        return Ok(match covariates_alone(&looked, &args.covariates.stated) {
            Some(names) => FoundInFile::Covariates(names, unusable.problem),
            None => unusable.into(),
        });
    }
    if let Some(unusable) = mostly_refused(file, &looked) {
        return Ok(unusable.into());
    }
    Ok(FoundInFile::Benchmarks(one_quantity_each(found)))
}

/// The displacement of each benchmark that has its velocity too: the config names each benchmark once.
fn one_quantity_each(mut found: Vec<PlannedBenchmark>) -> Vec<PlannedBenchmark> {
    let with = |velocity: bool, found: &[PlannedBenchmark]| -> BTreeSet<String> {
        let of_it = found.iter().filter(|one| one.is_velocity == velocity);
        of_it.map(|one| one.id.clone()).collect()
    };
    let (displacements, velocities) = (with(false, &found), with(true, &found));
    found.retain(|one| !one.is_velocity || !displacements.contains(&one.id));
    for one in &mut found {
        one.has_both = !one.is_velocity && velocities.contains(&one.id);
    }
    found
}

fn look(file: &Path, kind: SourceKind, options: &ReadOptions) -> anyhow::Result<FileSurvey> {
    let Some(format) = TextFormat::named(kind.name()) else {
        let read = read_with_remarks(&[file.to_owned()], options)?;
        say_remarks(&read.remarks);
        let series = read.recording.series.into_iter();
        return Ok(FileSurvey {
            readings: series.map(|one| (one.benchmark, one.unit)).collect(),
            ..FileSurvey::default()
        });
    };
    Ok(look_through(format, file, options)?)
}
