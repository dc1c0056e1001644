//! The files that a state has read, as far as it keeps its place in them, beside those that a config asks for.

use super::decode::{Decoder, whatever};
use super::file::read_at;
use super::position::{Saved, SavedContent};
use super::rescan::{is_ours, list};
use crate::config::{Config, FileSource};
use crate::monitor::from_bytes;
use crate::reading::BenchmarkId;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Files that are looked for under other names at most: each is compared with every file that the sources have.
const MOST_SOUGHT: usize = 100;

/// The files that a state has read.
#[derive(Debug, Default)]
pub struct KnownFiles {
    /// How many of them the config reads, under whatever name they have by now.
    pub asked_for: usize,
    /// Those that it does not read, by the name under which each was found, and the benchmarks that the config of then named of it;
    /// none: all that it had.
    pub left: BTreeMap<PathBuf, BTreeSet<BenchmarkId>>,
}

impl KnownFiles {
    /// By the `positions` that a state keeps, each under its source and path.
    pub fn of(config: &Config, positions: &[(String, Vec<u8>)]) -> Self {
        let sources: Vec<(&FileSource, Decoder)> = (config.sources.iter())
            .map(|source| (source, Decoder::new(source, &config.benchmarks)))
            .collect();
        let (mut known, mut there, mut sought) = (Self::default(), None, 0);
        for (name, body) in positions {
            let Some((_, path)) = name.split_once(':') else {
                continue;
            };
            let Ok(saved) = from_bytes::<Saved>(body) else {
                continue;
            };
            if saved.at == 0 && saved.content == SavedContent::Anew {
                continue;
            }
            let path = saved.origin.clone().unwrap_or_else(|| path.into());
            let is_named =
                |(source, decoder): &(&FileSource, Decoder)| asks(source, decoder, &path);
            let is_asked_for = sources.iter().any(is_named) || {
                sought += 1;
                let there = there.get_or_insert_with(|| files(&sources));
                sought <= MOST_SOUGHT && there.iter().any(|file| saved.is_beginning_of(file))
            };
            if is_asked_for {
                known.asked_for += 1;
                continue;
            }
            let named = saved.read_as.iter().flat_map(|all| all.keys().cloned());
            let named = named.filter(|id| *id != whatever());
            known.left.insert(path, named.collect());
        }
        known
    }
}

/// Whether the source asks for a file of this path. Where one of both paths is relative nothing shows from which folder, and the name
/// decides.
fn asks(source: &FileSource, decoder: &Decoder, path: &Path) -> bool {
    let name = path.file_name().and_then(OsStr::to_str);
    let folder = source.pattern.folder();
    let is_here = path.parent() == Some(folder)
        || source.pattern.is_of(path)
        || path.is_relative()
        || folder.is_relative();
    is_here && name.is_some_and(|name| is_ours(&source.pattern, decoder, name))
}

/// Every file that the sources have now.
fn files(sources: &[(&FileSource, Decoder)]) -> Vec<PathBuf> {
    let listed = sources
        .iter()
        .filter_map(|(source, decoder)| list(&source.pattern, decoder).ok());
    listed
        .flat_map(|(files, _)| files)
        .map(|(file, _)| file)
        .collect()
}

impl Saved {
    /// Whether `file` has what was read last where it was read: a folder may have been moved, and a file renamed.
    fn is_beginning_of(&self, file: &Path) -> bool {
        let length = self.mark.len() as u64;
        let read = File::open(file)
            .and_then(|file| read_at(&file, self.at.saturating_sub(length), length));
        !self.mark.is_empty() && read.is_ok_and(|bytes| bytes == self.mark)
    }
}
