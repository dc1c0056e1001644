//! What is doubtful in the readings of a site, by what lies in its files now: above all how rarely it is measured.

use super::preview::{Preview, SourceView};
use crate::config::Config;
use crate::monitor::MAY_SKIP;
use crate::reading::{BenchmarkId, Timestamp, figure};
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet};

/// So many readings must fall into the time that an evacuation takes: a fit that sees the
/// acceleration needs several, and the last of them must leave time to go.
const READINGS_AN_EVACUATION: i32 = 4;
/// Readings that end so long, and so many of their own intervals, before the newest of their source are left behind.
const LEFT_BEHIND: SignedDuration = SignedDuration::from_hours(24);
const LEFT_OUT: i32 = 12;

/// A line where more of a source's files is refused than taken.
fn mostly_refused(source: &SourceView, preview: &Preview) -> Option<String> {
    let own = preview
        .benchmarks
        .iter()
        .filter(|one| one.source == source.id);
    let taken: u64 = own.map(|one| one.readings).sum();
    let refused: u64 = source.refused.iter().map(|one| one.rows).sum();
    let most = source.refused.iter().max_by_key(|one| one.rows)?;
    (refused > taken).then(|| {
        format!(
            "source {:?}: {refused} rows or cells of its files are refused, and {taken} readings are taken; the first of the most frequent kind: {}",
            source.id, most.first
        )
    })
}

/// A line for each benchmark that is measured too rarely for its evacuation time to mean anything, or not at all, or
/// whose readings hardly mean what was intended.
pub fn sampling_warnings(config: &Config, preview: &Preview) -> Vec<String> {
    let settings = &config.settings;
    let lines = preview.benchmarks.iter().filter_map(|benchmark| {
        let id = &benchmark.id;
        let spacing = SignedDuration::from_secs(benchmark.every_s?);
        let policy = settings.benchmarks.get(id).unwrap_or(&settings.policy);
        let evacuation = policy.evacuation_time;
        (spacing > evacuation / READINGS_AN_EVACUATION).then(|| {
            format!(
                "benchmark {:?}: measured every {spacing:#}, and evacuation_time is {evacuation:#}; \
                 a warning can come too late, measure {READINGS_AN_EVACUATION} times within it or more",
                id.as_str()
            )
        })
    });
    let suspicions = preview.benchmarks.iter().flat_map(|benchmark| {
        let id = benchmark.id.as_str();
        let lines = benchmark.suspicions.iter();
        lines.map(move |line| format!("benchmark {id:?}: {line}"))
    });
    let covariates = preview.covariates.iter().flat_map(|covariate| {
        let name = &covariate.name;
        let lines = covariate.suspicions.iter();
        lines.map(move |line| format!("covariate {name:?}: {line}"))
    });
    let mut shared = several_sources(preview);
    shared.extend(unnamed_beside_a_broker(config));
    let behind = left_behind(preview);
    let waiting = held_back(config, preview);
    let ends = preview.refused_ends.iter().cloned();
    let refused = preview
        .sources
        .iter()
        .filter_map(|source| mostly_refused(source, preview));
    let absent = preview
        .without_readings
        .iter()
        .map(|without_readings| without_readings.text.clone());
    lines
        .chain(suspicions)
        .chain(exceeded(config, preview))
        .chain(covariates)
        .chain(shared)
        .chain(behind)
        .chain(waiting)
        .chain(refused)
        .chain(ends)
        .chain(absent)
        .collect()
}

/// A line for each threshold that the newest reading is beyond: its level would be in force from the start.
fn exceeded(config: &Config, preview: &Preview) -> Vec<String> {
    let settings = &config.settings;
    let mut lines = Vec::new();
    for benchmark in &preview.benchmarks {
        let id = &benchmark.id;
        let policy = settings.benchmarks.get(id).unwrap_or(&settings.policy);
        for threshold in &policy.thresholds {
            if let (Some(limit), Some(moved)) = (threshold.displacement_mm, benchmark.moved_mm)
                && moved >= limit
            {
                lines.push(format!(
                    "benchmark {:?}: it has moved by {} mm since its first reading, and the threshold displacement = \"{limit} mm\" calls {} from there \
                     on: it is exceeded already; is it meant from another zero?",
                    id.as_str(),
                    figure(moved, 1),
                    threshold.level
                ));
            }
        }
    }
    lines
}

/// A line for each benchmark of which several readings wait before the first is judged.
fn held_back(config: &Config, preview: &Preview) -> Vec<String> {
    let held = preview.benchmarks.iter().filter_map(|one| {
        let source = config.sources.iter().find(|source| source.id == one.source)?;
        let every = SignedDuration::from_secs(one.every_s?.max(1));
        let is_long = source.reorder >= every.saturating_mul(MAY_SKIP);
        is_long.then(|| {
            format!(
                "benchmark {:?}: measured every {every:#}, and its source lets each reading wait for {:#} (reorder): a \
                 warning comes so much later; make reorder shorter than {MAY_SKIP} of its readings take",
                one.id.as_str(),
                source.reorder
            )
        })
    });
    held.collect()
}

/// A line for each benchmark whose readings end long before others of its source do: its column may be gone, or what stands there is
/// refused.
fn left_behind(preview: &Preview) -> Vec<String> {
    let mut newest: BTreeMap<&str, Timestamp> = BTreeMap::new();
    for one in &preview.benchmarks {
        let of_source = newest.entry(&one.source).or_insert(one.last.0);
        *of_source = one.last.0.max(*of_source);
    }
    // A column whose header has another name from some file on goes on as a covariate.
    for one in &preview.covariates {
        if let Some(of_source) = newest.get_mut(one.source.as_str()) {
            *of_source = one.last.max(*of_source);
        }
    }
    let left = preview.benchmarks.iter().filter_map(|one| {
        let behind = newest
            .get(one.source.as_str())?
            .duration_since(one.last.0);
        let every = SignedDuration::from_secs(one.every_s?.max(1));
        let is_left = behind > LEFT_BEHIND && behind > every.saturating_mul(LEFT_OUT);
        is_left.then(|| {
            format!(
                "benchmark {:?}: its readings end at {}, {behind:#} before the newest of its source: does its column still stand in the file, and are \
                 its values taken?",
                one.id.as_str(),
                one.last.0
            )
        })
    });
    left.collect()
}

/// A line where messages of a broker, which cannot be read in advance, may give benchmarks of another source too, as no `[[benchmark]]` says which one
/// has them.
fn unnamed_beside_a_broker(config: &Config) -> Option<String> {
    let files = config.sources.iter().map(|source| &source.id);
    let brokers = config.brokers.iter().map(|broker| &broker.id);
    let sources: Vec<&str> = files.chain(brokers).map(String::as_str).collect();
    let is_open = config.benchmarks.is_empty() && !config.brokers.is_empty();
    (is_open && sources.len() > 1).then(|| {
        format!(
            "no [[benchmark]] says which of the sources {} it comes from: where two of them give one name, their readings are taken as one series",
            listed(sources)
        )
    })
}

/// `"a" and "b"`.
fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|one| format!("{one:?}")).collect();
    quoted.join(" and ")
}

/// A line for each benchmark that comes from more than one source: what one instrument says would be mixed with what another does.
fn several_sources(preview: &Preview) -> Vec<String> {
    let mut sources: BTreeMap<&BenchmarkId, BTreeSet<&str>> = BTreeMap::new();
    for one in &preview.benchmarks {
        sources.entry(&one.id).or_default().insert(&one.source);
    }
    let several = sources.into_iter().filter(|(_, sources)| sources.len() > 1);
    let lines = several.map(|(id, sources)| {
        format!(
            "benchmark {:?} comes from the sources {}, whose readings are taken as one series: name the one source in a [[benchmark]]",
            id.as_str(),
            listed(sources)
        )
    });
    lines.collect()
}
