//! Follows the files of all sources and puts what they hold in the order of its measurement.

use super::decode::{Arrival, Decoder};
use super::file::FileTail;
use crate::config::{Benchmark, FilePattern, Source};
use crate::reading::Timestamp;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Values in one batch at most.
const BATCH: usize = 1000;

/// Values in the order of their measurement, as far as they had arrived.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Batch {
    /// The values.
    pub arrivals: Vec<Arrival>,
    /// Whether the files hold no more for now.
    pub caught_up: bool,
}

/// Every followed file, and which folders to look for more.
#[derive(Debug)]
pub struct Follower {
    sources: Vec<(FilePattern, Arc<Decoder>)>,
    files: BTreeMap<(usize, PathBuf), FileTail>,
    /// The earliest pending value of each file; between two rounds there is none.
    heads: BTreeSet<(Timestamp, (usize, PathBuf))>,
    missing: BTreeSet<PathBuf>,
}

impl Follower {
    /// Follows nothing yet.
    pub fn new(sources: &[Source], benchmarks: &[Benchmark]) -> Self {
        let sources = sources.iter().map(|source| {
            let decoder = Arc::new(Decoder::new(source, benchmarks));
            (source.pattern.clone(), decoder)
        });
        Self {
            sources: sources.collect(),
            files: BTreeMap::new(),
            heads: BTreeSet::new(),
            missing: BTreeSet::new(),
        }
    }

    /// The folders to watch.
    pub fn folders(&self) -> BTreeSet<PathBuf> {
        let folders = self.sources.iter().map(|(pattern, _)| pattern.folder());
        folders.map(Path::to_owned).collect()
    }

    /// Lines, records and files that could not be used so far.
    pub fn quarantined(&self) -> u64 {
        self.files.values().map(|file| file.quarantined).sum()
    }

    /// Reads the next values. What the files held when a round began is merged by time over all
    /// files before the next round looks at them again: years of history in many files arrive as
    /// if they had come in live.
    pub fn poll(&mut self) -> Batch {
        if self.heads.is_empty() {
            self.rescan();
            for (key, file) in &mut self.files {
                file.refill();
                self.heads
                    .extend(file.pending.front().map(|head| (head.time, key.clone())));
            }
        }
        let mut arrivals = Vec::new();
        while arrivals.len() < BATCH
            && let Some((_, key)) = self.heads.pop_first()
        {
            let Some(file) = self.files.get_mut(&key) else {
                continue;
            };
            arrivals.extend(file.pending.pop_front());
            file.refill();
            self.heads
                .extend(file.pending.front().map(|head| (head.time, key)));
        }
        Batch {
            caught_up: self.heads.is_empty(),
            arrivals,
        }
    }

    /// Looks for files that have come or gone.
    fn rescan(&mut self) {
        let mut present = BTreeSet::new();
        for (index, (pattern, _)) in self.sources.iter().enumerate() {
            match list(pattern) {
                Ok(paths) => {
                    self.missing.remove(pattern.folder());
                    present.extend(paths.into_iter().map(|path| (index, path)));
                }
                Err(error) => {
                    let folder = pattern.folder().to_owned();
                    if !self.missing.contains(&folder) {
                        tracing::warn!(folder = %folder.display(), %error, "cannot list; will look again");
                        self.missing.insert(folder);
                    }
                }
            }
        }
        self.files.retain(|key, file| {
            let stays = present.contains(key);
            if !stays {
                tracing::info!(file = %file.path().display(), "gone");
            }
            stays
        });
        for key in present {
            if !self.files.contains_key(&key) {
                tracing::info!(file = %key.1.display(), "followed");
                let decoder = Arc::clone(&self.sources[key.0].1);
                let file = FileTail::new(key.1.clone(), decoder);
                self.files.insert(key, file);
            }
        }
    }
}

fn list(pattern: &FilePattern) -> io::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(pattern.folder())? {
        let entry = entry?;
        let name = entry.file_name();
        if name.to_str().is_some_and(|name| pattern.matches(name)) && entry.path().is_file() {
            paths.push(entry.path());
        }
    }
    Ok(paths)
}
