//! Follows the files of all sources and puts what they hold in the order of its measurement.

use super::at_work::AtWork;
use super::decode::{Arrival, Decoder};
use super::departed::hold_newest;
use super::file::FileTail;
use super::position::Saved;
use super::reorder::{Reorder, WaitingReading};
use crate::config::{Benchmark, FilePattern, FileSource};
use crate::monitor::from_bytes;
use crate::reading::{Quantity, Timestamp};
use crate::runtime::clock::Stopwatch;
use crate::store::Position;
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Values in one batch at most: while the past is read, and later, when what comes live does not wait for a backlog.
const BATCH: usize = 1000;
const LIVE_BATCH: usize = 250;
/// Of a table whose rows go back in time so many are taken at once: those of each minute over two weeks.
const MOST_BACKWARDS: usize = 20_000;
/// While a backlog is read the other files are looked at so often.
const LOOK_BESIDE: Duration = Duration::from_millis(250);

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
    /// Readings that have been read and wait for earlier ones, or have done so: what is new.
    pub waiting: Vec<WaitingReading>,
    /// Lines, records and files that could not be used, a source: what is new.
    pub quarantined: BTreeMap<String, u64>,
}

/// A source's number and a path.
pub(super) type FileKey = (usize, PathBuf);

/// The [`Arrival::rank`] of a file's next value, and the file.
type Head = (Timestamp, bool, String, Option<Quantity>, FileKey);

/// One source.
#[derive(Debug)]
pub(super) struct Followed {
    pub(super) id: String,
    pub(super) pattern: FilePattern,
    pub(super) decoder: Arc<Decoder>,
    /// Where values wait for earlier ones.
    pub(super) reorder: Option<Reorder>,
    /// What could not be used in files that are gone, and of all its files what has been reported.
    pub(super) quarantined_in_gone: u64,
    quarantined_reported: u64,
}

/// Every followed file, and which folders to look for more.
#[derive(Debug)]
pub struct Follower {
    pub(super) sources: Vec<Followed>,
    pub(super) files: BTreeMap<FileKey, FileTail>,
    /// The earliest pending value of each file; between two rounds there is none.
    heads: BTreeSet<Head>,
    /// Folders that cannot be listed, of which source, and why.
    pub(super) unlisted: BTreeMap<PathBuf, (String, String)>,
    /// Runs since the last look at the files.
    looked: Option<Stopwatch>,
    /// The files held no more once: what comes since is live, but for the backlog of one or another.
    pub(super) is_live: bool,
    /// Positions that are to be kept, or forgotten, whatever still waits.
    pub(super) at_once: Vec<Position>,
    /// What may be missing of files that are gone.
    pub(super) lost: Vec<Arrival>,
    /// Files whose names are no text, as they were reported.
    pub(super) not_text: BTreeSet<PathBuf>,
    /// Which source is being read.
    pub(super) at_work: AtWork,
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
            quarantined_reported: 0,
        };
        let mut sources: Vec<Followed> = sources.iter().map(of).collect();
        for source in &mut sources {
            if let Some(reorder) = &mut source.reorder {
                reorder.restore(saved, &source.id);
            }
        }
        let files = saved
            .iter()
            .filter_map(|(name, body)| restored(&sources, name, body));
        let is_followed = |name: &str| {
            let source = name.split_once(':').map(|(source, _)| source);
            sources.iter().any(|one| Some(one.id.as_str()) == source)
        };
        let left = |(name, body): &(String, Vec<u8>)| {
            let saved: Saved = from_bytes(body).ok().filter(|_| !is_followed(name))?;
            let body = rmp_serde::to_vec_named(&saved.left()?).ok()?;
            let (name, body) = (name.clone(), Some(body));
            Some(Position { name, body })
        };
        let left = saved.iter().filter_map(left).collect();
        Self {
            files: files.collect(),
            sources,
            heads: BTreeSet::new(),
            unlisted: BTreeMap::new(),
            looked: None,
            is_live: false,
            at_once: left,
            lost: Vec::new(),
            not_text: BTreeSet::new(),
            at_work: AtWork::default(),
        }
    }

    /// Whether there is a file of this source.
    pub fn follows(&self, source: &str) -> bool {
        let files = self.files.keys();
        files
            .into_iter()
            .any(|(index, _)| self.sources[*index].id == source)
    }

    /// Files that are read although they have no name any more, open, by the names of their positions.
    pub(super) fn nameless(&self) -> BTreeMap<String, File> {
        let nameless = self.files.iter().filter(|(_, file)| file.is_nameless());
        let open = nameless.filter_map(|((source, path), file)| {
            let held = file.held.as_ref()?.try_clone().ok()?;
            Some((name(&self.sources[*source].id, path), held))
        });
        open.collect()
    }

    /// Goes on reading these of the files.
    pub(super) fn hold(&mut self, nameless: &BTreeMap<String, File>) {
        for ((source, path), file) in &mut self.files {
            let held = nameless.get(&name(&self.sources[*source].id, path));
            file.held = held.and_then(|held| held.try_clone().ok());
        }
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
            let more = total - std::mem::replace(&mut source.quarantined_reported, total);
            if more > 0 {
                new.insert(source.id.clone(), more);
            }
        }
        new
    }

    /// Reads the next values. What the files held when a round began is merged by [`Arrival::rank`] over all
    /// files before the next round looks at them again: years of history in many files arrive as
    /// if they had come in live. Values of a source that waits for earlier ones go out when they have waited for long
    /// enough, also by the wall clock's time, `host_time`.
    pub fn poll(&mut self, host_time: Timestamp) -> ArrivalBatch {
        if self.heads.is_empty() {
            self.looked = Some(Stopwatch::start());
            self.rescan();
            self.expect_unended_files();
            for (key, file) in &mut self.files {
                self.at_work.comes_to(key.0);
                file.refill();
                self.heads.extend(head(key.clone(), file));
            }
            hold_newest(self.files.values_mut());
        }
        let mut arrivals = std::mem::take(&mut self.lost);
        arrivals.extend(self.beside_a_backlog(host_time));
        let most = if self.is_live { LIVE_BATCH } else { BATCH };
        let mut read = arrivals.len();
        let mut direct = Vec::new();
        let mut newest: Option<(FileKey, Timestamp)> = None;
        while let Some((time, .., key)) = self.heads.first() {
            // A table with its newest row on top is read on, or that row would be judged by a record of which nothing else is corrected.
            let goes_back =
                (newest.as_ref()).is_some_and(|(file, newest)| file == key && time < newest);
            if read >= if goes_back { MOST_BACKWARDS } else { most } {
                break;
            }
            if !goes_back {
                newest = Some((key.clone(), *time));
            }
            let Some((.., key)) = self.heads.pop_first() else {
                break;
            };
            let Some(file) = self.files.get_mut(&key) else {
                continue;
            };
            read += 1;
            self.at_work.comes_to(key.0);
            direct.extend(next_of(file, &mut self.sources[key.0], host_time));
            file.refill();
            self.heads.extend(head(key, file));
        }
        direct.sort_by(|one, other| one.rank().cmp(&other.rank()));
        arrivals.extend(merged(self.release(host_time), direct));
        let is_due = |source: &Followed| source.reorder.as_ref().is_some_and(Reorder::is_due);
        let caught_up = self.heads.is_empty()
            && !self.sources.iter().any(is_due)
            && !self.files.values().any(FileTail::is_awaited);
        self.is_live |= caught_up;
        ArrivalBatch {
            positions: self.positions(),
            caught_up,
            has_more: self.files.values().any(|file| file.has_more),
            waiting: self.newly_waiting(),
            found: self.looked.filter(|_| !arrivals.is_empty()),
            quarantined: self.newly_quarantined(),
            arrivals,
        }
    }

    /// What has come to files that held no more, while a backlog is read from others: it is live, and goes first. Until all files have held
    /// no more once, every value has its place in the past.
    fn beside_a_backlog(&mut self, host_time: Timestamp) -> Vec<Arrival> {
        let is_due = |looked: &Stopwatch| looked.elapsed() >= LOOK_BESIDE;
        if !self.is_live || self.heads.is_empty() || !self.looked.as_ref().is_some_and(is_due) {
            return Vec::new();
        }
        self.looked = Some(Stopwatch::start());
        self.rescan();
        let read: BTreeSet<FileKey> = self.heads.iter().map(|(.., key)| key.clone()).collect();
        let mut live = Vec::new();
        for (key, file) in &mut self.files {
            if read.contains(key) {
                continue;
            }
            self.at_work.comes_to(key.0);
            file.refill();
            while live.len() < LIVE_BATCH / 2 && !file.pending.is_empty() {
                live.extend(next_of(file, &mut self.sources[key.0], host_time));
                file.refill();
            }
            self.heads.extend(head(key.clone(), file));
        }
        live
    }

    /// What has waited for long enough.
    fn release(&mut self, host_time: Timestamp) -> Vec<Arrival> {
        let mut arrivals = Vec::new();
        for source in &mut self.sources {
            if let Some(reorder) = &mut source.reorder {
                arrivals.extend(reorder.release(host_time, BATCH));
            }
        }
        arrivals.sort_by(|one, other| one.rank().cmp(&other.rank()));
        arrivals
    }

    fn newly_waiting(&mut self) -> Vec<WaitingReading> {
        let reorders = self.sources.iter_mut();
        let reorders = reorders.filter_map(|source| source.reorder.as_mut());
        reorders.flat_map(Reorder::new_readings).collect()
    }

    /// What has changed of how far the files may be acknowledged: not past what still waits.
    fn positions(&mut self) -> Vec<Position> {
        let mut free = std::mem::take(&mut self.at_once);
        for ((source, path), file) in &mut self.files {
            let source = &mut self.sources[*source];
            let Some(body) = file.moved() else { continue };
            let position = Position {
                name: name(&source.id, path),
                body: Some(body),
            };
            match &mut source.reorder {
                Some(reorder) => reorder.note(position),
                None => free.push(position),
            }
        }
        let reorders = self.sources.iter_mut();
        let reorders = reorders.filter_map(|source| source.reorder.as_mut());
        free.extend(reorders.flat_map(Reorder::positions));
        free
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

/// The next value of a file; `None` where it waits for earlier ones of its source.
fn next_of(file: &mut FileTail, source: &mut Followed, host_time: Timestamp) -> Option<Arrival> {
    let arrival = file.pending.pop_front()?;
    // What a restart could not read again does not wait.
    match source.reorder.as_mut().filter(|_| !file.is_nameless()) {
        Some(reorder) => {
            reorder.take(arrival, host_time, file.changed);
            None
        }
        None => Some(arrival),
    }
}

/// What has waited and what has not, by [`Arrival::rank`]: a source that waits must not be days ahead of those beside it. Each keeps its
/// own order.
fn merged(waited: Vec<Arrival>, direct: Vec<Arrival>) -> Vec<Arrival> {
    let mut all = Vec::with_capacity(waited.len() + direct.len());
    let mut waited = waited.into_iter().peekable();
    for next in direct {
        while let Some(before) = waited.next_if(|one| one.rank() <= next.rank()) {
            all.push(before);
        }
        all.push(next);
    }
    all.extend(waited);
    all
}

fn head(key: FileKey, file: &FileTail) -> Option<Head> {
    let (time, is_reading, name, quantity) = file.pending.front()?.rank();
    Some((time, is_reading, name.to_owned(), quantity, key))
}

/// What a position is kept under: its source and its path.
pub(super) fn name(source: &str, path: &Path) -> String {
    format!("{source}:{}", path.display())
}
