//! Readings that a state holds of files which the config does not read: of another site, or of a year that is over.

use super::tail::KnownFiles;
use crate::config::Config;
use crate::reading::BenchmarkId;
use crate::store::{Store, StoreError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Files and benchmarks that are named.
const MOST_NAMED: usize = 3;

/// What a state holds of files that no source of the config reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InheritedReadings {
    files: Vec<PathBuf>,
    /// The benchmarks that may have readings of them, with all readings that the state holds of each.
    readings: BTreeMap<BenchmarkId, u64>,
    /// Whether the state has read no other file.
    pub is_all: bool,
}

impl InheritedReadings {
    /// By the state that the config names; `None` where all that it holds is of files that the config reads, or where it cannot be
    /// looked at.
    pub fn of(config: &Config) -> Option<Self> {
        let folder = &config.site.state_dir;
        if !Store::file(folder).exists() {
            return None;
        }
        let looked = Store::look(folder).and_then(|store| Self::in_store(&store, config));
        looked.ok().flatten()
    }

    /// The same by a state that is open.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn in_store(store: &Store, config: &Config) -> Result<Option<Self>, StoreError> {
        let known = KnownFiles::of(config, &store.positions()?);
        if known.left.is_empty() {
            return Ok(None);
        }
        let mut readings = store.counts_of_readings()?;
        if known.left.values().all(|named| !named.is_empty()) {
            let named: BTreeSet<&BenchmarkId> = known.left.values().flatten().collect();
            readings.retain(|id, _| named.contains(id));
        }
        readings.retain(|_, count| *count > 0);
        Ok((!readings.is_empty()).then(|| Self {
            files: known.left.into_keys().collect(),
            readings,
            is_all: known.asked_for == 0 && config.brokers.is_empty(),
        }))
    }

    /// How many readings of which benchmarks, and from which files.
    pub fn what(&self) -> String {
        let benchmarks = self.readings.iter();
        let benchmarks = benchmarks.map(|(id, count)| format!("{count} readings of {id}"));
        let files = self.files.iter().map(|file| file.display().to_string());
        let from = if self.is_all {
            " that were read from"
        } else {
            ", a part of which was read from"
        };
        format!("{}{from} {}", few(benchmarks), few(files))
    }

    /// What that means for a site that runs, and what to do.
    pub fn text(&self, config: &Config) -> String {
        format!(
            "state folder {}: it holds {}, which no source of this config reads: they count as readings of this site; if they are \
             another site's, give this one a state_dir of its own",
            config.site.state_dir.display(),
            self.what()
        )
    }
}

/// The first of them, and how many more there are.
fn few(all: impl ExactSizeIterator<Item = String>) -> String {
    let more = all.len().saturating_sub(MOST_NAMED);
    let mut named: Vec<String> = all.take(MOST_NAMED).collect();
    if more > 0 {
        named.push(format!("{more} more"));
    }
    match named.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        _ => named.concat(),
    }
}
