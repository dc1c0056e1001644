//! Follows the files of all sources and puts what they hold in the order of its measurement.

use super::decode::{Arrival, Decoder};
use super::departed::{MOST_DEPARTED, hold_newest};
use super::file::FileTail;
use super::position::FileId;
use super::reorder::Reorder;
use crate::config::{Benchmark, FilePattern, FileSource};
use crate::reading::Timestamp;
use crate::runtime::clock::Stopwatch;
use crate::store::Position;
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Values in one batch at most.
const BATCH: usize = 1000;

/// Values in the order of their measurement, as far as they had arrived.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ArrivalBatch {
    /// The values.
    pub arrivals: Vec<Arrival>,
    /// How far files have been read once all of these, and those before, are taken: what has changed.
    pub positions: Vec<Position>,
    /// Whether the files hold no more for now; one that has given nothing for very long is not waited for.
    pub caught_up: bool,
    /// Whether there is a file of which more is to be read.
    pub has_more: bool,
    /// Runs since the look that found the first of these values; also where the files held more than one batch.
    pub found: Option<Stopwatch>,
    /// Lines, records and files that could not be used, a source: what is new.
    pub quarantined: BTreeMap<String, u64>,
}

/// A source's number and a path.
type FileKey = (usize, PathBuf);

/// The [`Arrival::rank`] of a file's next value, and the file.
type Head = (Timestamp, bool, String, FileKey);

/// One source.
#[derive(Debug)]
struct Followed {
    id: String,
    pattern: FilePattern,
    decoder: Arc<Decoder>,
    /// Where values wait for earlier ones.
    reorder: Option<Reorder>,
    /// What could not be used in files that are gone, and of all its files what has been reported.
    quarantined_in_gone: u64,
    quarantined_told: u64,
}

impl Followed {
    /// Whether the pattern asks for a file of this name.
    fn takes(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(OsStr::to_str);
        path.parent() == Some(self.pattern.folder())
            && name.is_some_and(|name| is_ours(&self.pattern, &self.decoder, name))
    }
}

/// Every followed file, and which folders to look for more.
#[derive(Debug)]
pub struct Follower {
    sources: Vec<Followed>,
    files: BTreeMap<FileKey, FileTail>,
    /// The earliest pending value of each file; between two rounds there is none.
    heads: BTreeSet<Head>,
    missing: BTreeSet<PathBuf>,
    /// Runs since the last look at the files.
    looked: Option<Stopwatch>,
    /// Positions that nobody needs any more.
    gone: Vec<(usize, Position)>,
    /// What may be missing of files that are gone.
    lost: Vec<Arrival>,
    /// Files whose names are no text, as they were reported.
    not_text: BTreeSet<PathBuf>,
}

impl Follower {
    /// Follows nothing yet; files go on from where `saved`, by name, has left them.
    pub fn new(
        sources: &[FileSource],
        benchmarks: &[Benchmark],
        saved: &[(String, Vec<u8>)],
    ) -> Self {
        let of = |source: &FileSource| Followed {
            id: source.id.clone(),
            pattern: source.pattern.clone(),
            decoder: Arc::new(Decoder::new(source, benchmarks)),
            reorder: (source.reorder > SignedDuration::ZERO).then(|| Reorder::new(source.reorder)),
            quarantined_in_gone: 0,
            quarantined_told: 0,
        };
        let sources: Vec<Followed> = sources.iter().map(of).collect();
        let files = saved
            .iter()
            .filter_map(|(name, body)| restored(&sources, name, body));
        Self {
            files: files.collect(),
            sources,
            heads: BTreeSet::new(),
            missing: BTreeSet::new(),
            looked: None,
            gone: Vec::new(),
            lost: Vec::new(),
            not_text: BTreeSet::new(),
        }
    }

    /// The folders to watch.
    pub fn folders(&self) -> BTreeSet<PathBuf> {
        let folders = self.sources.iter().map(|source| source.pattern.folder());
        folders.map(Path::to_owned).collect()
    }

    /// Whether there is a file of this source.
    pub fn follows(&self, source: &str) -> bool {
        let files = self.files.keys();
        files
            .into_iter()
            .any(|(index, _)| self.sources[*index].id == source)
    }

    /// Lines, records and files that could not be used so far.
    pub fn quarantined(&self) -> u64 {
        (0..self.sources.len())
            .map(|source| self.quarantined_of(source))
            .sum()
    }

    fn quarantined_of(&self, source: usize) -> u64 {
        let files = self.files.iter().filter(|((of, _), _)| *of == source);
        let in_files: u64 = files.map(|(_, file)| file.quarantined).sum();
        in_files + self.sources[source].quarantined_in_gone
    }

    fn newly_quarantined(&mut self) -> BTreeMap<String, u64> {
        let mut new = BTreeMap::new();
        for index in 0..self.sources.len() {
            let total = self.quarantined_of(index);
            let source = &mut self.sources[index];
            let more = total - std::mem::replace(&mut source.quarantined_told, total);
            if more > 0 {
                new.insert(source.id.clone(), more);
            }
        }
        new
    }

    /// Reads the next values. What the files held when a round began is merged by [`Arrival::rank`] over all
    /// files before the next round looks at them again: years of history in many files arrive as
    /// if they had come in live. Values of a source that waits for earlier ones go out when they have waited for long
    /// enough, also by the wall clock's time, `wall`.
    pub fn poll(&mut self, wall: Timestamp) -> ArrivalBatch {
        if self.heads.is_empty() {
            self.looked = Some(Stopwatch::start());
            self.rescan();
            for (key, file) in &mut self.files {
                file.refill();
                self.heads.extend(head(key.clone(), file));
            }
            hold_newest(self.files.values_mut());
        }
        let (mut direct, mut read) = (Vec::new(), 0);
        while read < BATCH
            && let Some((.., key)) = self.heads.pop_first()
        {
            let Some(file) = self.files.get_mut(&key) else {
                continue;
            };
            read += 1;
            match (&mut self.sources[key.0].reorder, file.pending.pop_front()) {
                (Some(reorder), Some(arrival)) => reorder.take(arrival, wall),
                (None, arrival) => direct.extend(arrival),
                (Some(_), None) => {}
            }
            file.refill();
            self.heads.extend(head(key, file));
        }
        let mut arrivals = self.release(wall);
        arrivals.append(&mut self.lost);
        arrivals.extend(direct);
        let is_due = |source: &Followed| source.reorder.as_ref().is_some_and(Reorder::is_due);
        ArrivalBatch {
            positions: self.positions(),
            caught_up: self.heads.is_empty()
                && !self.sources.iter().any(is_due)
                && !self.files.values().any(FileTail::is_awaited),
            has_more: self.files.values().any(|file| file.has_more),
            found: self.looked.filter(|_| !arrivals.is_empty()),
            quarantined: self.newly_quarantined(),
            arrivals,
        }
    }

    /// What has waited for long enough.
    fn release(&mut self, wall: Timestamp) -> Vec<Arrival> {
        let mut arrivals = Vec::new();
        for source in &mut self.sources {
            if let Some(reorder) = &mut source.reorder {
                arrivals.extend(reorder.release(wall, BATCH));
            }
        }
        arrivals.sort_by(|one, other| one.rank().cmp(&other.rank()));
        arrivals
    }

    /// What has changed of how far the files may be acknowledged: not past what still waits.
    fn positions(&mut self) -> Vec<Position> {
        let mut positions = std::mem::take(&mut self.gone);
        for ((source, path), file) in &mut self.files {
            if file.is_nameless() {
                continue;
            }
            let moved = file.moved().map(|body| Position {
                name: name(&self.sources[*source].id, path),
                body: Some(body),
            });
            positions.extend(moved.map(|position| (*source, position)));
        }
        let mut free = Vec::new();
        for (source, position) in positions {
            match &mut self.sources[source].reorder {
                Some(reorder) => reorder.note(position),
                None => free.push(position),
            }
        }
        let reorders = self.sources.iter_mut();
        let reorders = reorders.filter_map(|source| source.reorder.as_mut());
        free.extend(reorders.flat_map(Reorder::positions));
        free
    }

    /// Looks for files that have come or gone.
    fn rescan(&mut self) {
        let present = self.list();
        let is_gone = |key: &FileKey, file: &FileTail| match present.get(key) {
            None => true,
            Some(place) => file.is_other_than(*place),
        };
        let gone: Vec<FileKey> = self
            .files
            .iter()
            .filter(|(key, file)| is_gone(key, file))
            .map(|(key, _)| key.clone())
            .collect();
        // All of them first: the new name of one may be the former name of another.
        let gone: Vec<(FileKey, FileTail)> = gone
            .into_iter()
            .filter_map(|key| self.files.remove_entry(&key))
            .collect();
        for (key, file) in gone {
            self.depart(key, file, &present);
        }
        for key in present.into_keys() {
            if !self.files.contains_key(&key) {
                tracing::info!(file = %key.1.display(), "followed");
                let source = &self.sources[key.0];
                let decoder = Arc::clone(&source.decoder);
                let file = FileTail::new(key.1.clone(), decoder);
                self.files.insert(key, file);
            }
        }
    }

    /// A file is no longer under its name: it is followed on under another, or forgotten.
    fn depart(&mut self, key: FileKey, mut file: FileTail, present: &BTreeMap<FileKey, FileId>) {
        // After a restart the config may be another one, and ask for other files.
        let is_asked_for = !file.is_restored || self.sources[key.0].takes(&file.origin);
        let moved = is_asked_for.then(|| file.leave()).flatten();
        let moved = moved.map(|path| (key.0, path));
        let moved = moved.filter(|moved| !present.contains_key(moved));
        if moved.as_ref() == Some(&key) {
            self.files.insert(key, file);
            return;
        }
        self.forget_position(&key);
        let Some(moved) = moved else {
            tracing::info!(file = %key.1.display(), "gone");
            if file.is_lost(&key.1) {
                self.lost.push(file.lost());
            }
            self.sources[key.0].quarantined_in_gone += file.quarantined;
            return;
        };
        self.make_room();
        tracing::info!(file = %key.1.display(), now = %moved.1.display(), "gone from its name, and read on for as long as it grows");
        self.files.insert(moved, file);
    }

    /// Where there are as many files that have gone as may be: closes the one that has not grown for the longest time.
    fn make_room(&mut self) {
        let departed = self.files.iter();
        let departed = departed.filter_map(|(key, file)| Some((file.has_rested()?, key)));
        let departed: Vec<_> = departed.collect();
        if departed.len() < MOST_DEPARTED {
            return;
        }
        let Some(key) = departed.into_iter().max().map(|(_, key)| key.clone()) else {
            return;
        };
        if let Some(file) = self.files.remove(&key) {
            tracing::info!(file = %key.1.display(), "no longer read on: too many files have gone");
            self.sources[key.0].quarantined_in_gone += file.quarantined;
        }
        self.forget_position(&key);
    }

    /// The store has no position of a file of this name any more.
    fn forget_position(&mut self, (source, path): &FileKey) {
        let name = name(&self.sources[*source].id, path);
        self.gone.push((*source, Position { name, body: None }));
    }

    fn list(&mut self) -> BTreeMap<FileKey, FileId> {
        let mut present = BTreeMap::new();
        for (index, source) in self.sources.iter_mut().enumerate() {
            let pattern = &source.pattern;
            match list(pattern, &source.decoder) {
                Ok((files, not_text)) => {
                    self.missing.remove(pattern.folder());
                    for path in not_text {
                        if self.not_text.insert(path.clone()) {
                            tracing::warn!(file = ?path, "its name is no UTF-8: it is not read; rename it");
                            source.quarantined_in_gone += 1;
                        }
                    }
                    let keyed = files
                        .into_iter()
                        .map(|(path, place)| ((index, path), place));
                    present.extend(keyed);
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
        present
    }
}

/// The file as it was left, unless its source is no longer there or its bytes mean nothing to this version: it is then
/// read from its start, and what is known of it dropped.
fn restored(sources: &[Followed], name: &str, body: &[u8]) -> Option<(FileKey, FileTail)> {
    let (id, path) = name.split_once(':')?;
    let index = sources.iter().position(|source| source.id == id)?;
    let path = PathBuf::from(path);
    match FileTail::restored(path.clone(), Arc::clone(&sources[index].decoder), body) {
        Ok(file) => Some(((index, path), file)),
        Err(error) => {
            tracing::warn!(file = %path.display(), %error, "no position: read from its start");
            None
        }
    }
}

fn head(key: FileKey, file: &FileTail) -> Option<Head> {
    let (time, is_reading, name) = file.pending.front()?.rank();
    Some((time, is_reading, name.to_owned(), key))
}

/// What a position is kept under: its source and its path.
fn name(source: &str, path: &Path) -> String {
    format!("{source}:{}", path.display())
}

fn is_ours(pattern: &FilePattern, decoder: &Decoder, name: &str) -> bool {
    let packed = name.strip_suffix(".gz").filter(|_| decoder.takes_packed());
    pattern.matches(name) || packed.is_some_and(|name| pattern.matches(name))
}

/// Files, and what has a name that is no text.
pub(in crate::runtime) type Listed = (Vec<(PathBuf, FileId)>, Vec<PathBuf>);

/// The files of the pattern, packed ones among them where the source has text; and those that would be, if their names
/// were text.
pub(in crate::runtime) fn list(pattern: &FilePattern, decoder: &Decoder) -> io::Result<Listed> {
    let is_ours = |name: &str| is_ours(pattern, decoder, name);
    let (mut files, mut not_text) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(pattern.folder())? {
        let entry = entry?;
        let name = entry.file_name();
        match name.to_str() {
            Some(name) if is_ours(name) => {}
            None if is_ours(&name.to_string_lossy()) => {
                not_text.push(entry.path());
                continue;
            }
            Some(_) | None => continue,
        }
        // Not the entry's own: a link counts as the file that it leads to.
        if let Ok(metadata) = std::fs::metadata(entry.path())
            && metadata.is_file()
        {
            files.push((entry.path(), FileId::of(&metadata)));
        }
    }
    Ok((files, not_text))
}
