//! File systems that do not answer, such as a network's share whose server is away: the call that asks them ends when they are back, perhaps
//! never. The sources on them are left out meanwhile, and all others are read on.

use super::follow::{ArrivalBatch, Follower};
use super::watch::FolderWatch;
use crate::config::{Benchmark, FileSource};
use crate::runtime::clock::{self, Stopwatch};
use crate::runtime::service_faults::{FaultPlace, ServiceFaultKind};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::task::{JoinError, JoinHandle, spawn_blocking};

/// A folder or a file that keeps the reading for longer than this is left out; where others are left out already, which may lie on the same
/// server, after a shorter time.
const LONGEST: Duration = Duration::from_secs(10);
const LONGEST_BESIDE: Duration = Duration::from_secs(2);
/// One that was left out within so long before is given twice as long each time, up to so many times: a slow one is read in the end.
const OF_LATE: Duration = Duration::from_secs(3600);
const MOST_DOUBLINGS: u32 = 3;
/// How often it is looked at how far the reading is.
const LOOKED_AT: Duration = Duration::from_millis(500);

/// That a folder does not answer, in words.
pub(in crate::runtime) fn does_not_answer(folder: &Path) -> String {
    let folder = folder.display();
    format!("{folder} does not answer (a network's share whose server is away?)")
}

/// Those who read the files, and watch their folders.
#[derive(Debug)]
pub(super) struct Readers {
    pub(super) follower: Follower,
    pub(super) watch: FolderWatch,
}

/// What came of one look at all files.
pub(super) enum Looked {
    /// What they hold.
    Read(Box<Readers>, ArrivalBatch),
    /// A source does not answer; the others can be read without it.
    Hangs,
}

/// The sources of a folder that does not answer.
#[derive(Debug)]
struct LeftOut {
    sources: Vec<String>,
    folder: PathBuf,
    /// Ends when it does answer.
    reading: JoinHandle<()>,
}

/// The files of a config's sources, and how far they have been read.
#[derive(Debug)]
pub struct FollowedFiles {
    sources: Vec<FileSource>,
    benchmarks: Vec<Benchmark>,
    /// What has been sent, by name: reading goes on from there.
    positions: BTreeMap<String, Vec<u8>>,
    left_out: Vec<LeftOut>,
    /// How often each folder has been left out of late, and when it was last.
    counts: BTreeMap<PathBuf, (u32, Stopwatch)>,
    was_live: bool,
    /// What readers that are made anew could not find again: files that have no name any more, and what has been reported of names that are no text.
    nameless: BTreeMap<String, File>,
    not_text: BTreeSet<PathBuf>,
}

impl FollowedFiles {
    /// Reading goes on from where `saved`, by name, has left the files.
    pub fn new(
        sources: &[FileSource],
        benchmarks: &[Benchmark],
        saved: Vec<(String, Vec<u8>)>,
    ) -> Self {
        Self {
            sources: sources.to_vec(),
            benchmarks: benchmarks.to_vec(),
            positions: saved.into_iter().collect(),
            left_out: Vec::new(),
            counts: BTreeMap::new(),
            was_live: false,
            nameless: BTreeMap::new(),
            not_text: BTreeSet::new(),
        }
    }

    fn is_left_out(&self, id: &str) -> bool {
        let mut all = self.left_out.iter().flat_map(|one| &one.sources);
        all.any(|source| source == id)
    }

    /// The sources that answer, in the order of the readers' numbers.
    fn answering(&self) -> impl Iterator<Item = &FileSource> {
        let sources = self.sources.iter();
        sources.filter(|source| !self.is_left_out(&source.id))
    }

    /// Readers of all sources that answer.
    pub(super) fn readers(&self) -> Readers {
        let sources: Vec<FileSource> = self.answering().cloned().collect();
        let is_read = |name: &str| {
            !name
                .split_once(':')
                .is_some_and(|(id, _)| self.is_left_out(id))
        };
        let saved = self.positions.iter().filter(|(name, _)| is_read(name));
        let saved: Vec<(String, Vec<u8>)> = saved
            .map(|(name, body)| (name.clone(), body.clone()))
            .collect();
        let mut follower = Follower::new(&sources, &self.benchmarks, &saved);
        follower.is_live = self.was_live;
        follower.hold(&self.nameless);
        follower.not_text.clone_from(&self.not_text);
        let folders = sources.iter().enumerate();
        let folders = folders.map(|(index, one)| (one.pattern.folder().to_owned(), index));
        Readers {
            follower,
            watch: FolderWatch::new(folders.collect()),
        }
    }

    /// Looks at all files once. Where one of them, or a folder, does not answer for too long its source is left out, and `readers` are lost.
    ///
    /// # Errors
    /// When the reading broke off.
    pub(super) async fn look(&mut self, readers: Box<Readers>) -> Result<Looked, JoinError> {
        let at_work = readers.follower.at_work.clone();
        let (sender, mut read) = tokio::sync::oneshot::channel();
        let reading = spawn_blocking(move || {
            let Readers {
                mut follower,
                mut watch,
            } = *readers;
            watch.renew(&follower.at_work);
            let batch = follower.poll(clock::now());
            let readers = Box::new(Readers { follower, watch });
            // Nobody waits for one that took too long: what it read is read again.
            let _ = sender.send((readers, batch));
        });
        let (mut steps, mut since) = (at_work.steps(), Stopwatch::start());
        loop {
            tokio::select! {
                read = &mut read => {
                    let Ok((readers, batch)) = read else {
                        reading.await?;
                        return Ok(Looked::Hangs);
                    };
                    self.note(&batch);
                    self.keep(&readers.follower);
                    return Ok(Looked::Read(readers, batch));
                }
                () = tokio::time::sleep(LOOKED_AT) => {}
            }
            let now = at_work.steps();
            if now != steps {
                (steps, since) = (now, Stopwatch::start());
                continue;
            }
            let source = self.answering().nth(at_work.source());
            let Some(folder) = source.map(|one| one.pattern.folder().to_owned()) else {
                continue;
            };
            if since.elapsed() >= self.longest(&folder) {
                self.leave_out(folder, reading);
                return Ok(Looked::Hangs);
            }
        }
    }

    /// How often it has been left out of late.
    fn count(&self, folder: &Path) -> u32 {
        let known = self.counts.get(folder);
        let of_late = known.filter(|(_, last)| last.elapsed() < OF_LATE);
        of_late.map_or(0, |(count, _)| *count)
    }

    fn longest(&self, folder: &Path) -> Duration {
        let count = self.count(folder);
        let first = if self.left_out.is_empty() {
            LONGEST
        } else {
            LONGEST_BESIDE
        };
        first * 2_u32.pow(count.min(MOST_DOUBLINGS))
    }

    fn leave_out(&mut self, folder: PathBuf, reading: JoinHandle<()>) {
        tracing::error!(folder = %folder.display(), "does not answer: the other sources are read without it");
        let again = (self.count(&folder) + 1, Stopwatch::start());
        self.counts.insert(folder.clone(), again);
        let sources = self.sources.iter();
        let sources = sources.filter(|source| source.pattern.folder() == folder);
        self.left_out.push(LeftOut {
            sources: sources.map(|source| source.id.clone()).collect(),
            folder,
            reading,
        });
    }

    /// Whether a folder answers again that was left out: readers are to be made anew.
    pub(super) fn take_back(&mut self) -> bool {
        let before = self.left_out.len();
        self.left_out.retain(|one| {
            let is_back = one.reading.is_finished();
            if is_back {
                tracing::info!(folder = %one.folder.display(), "answers again, and is read on");
            }
            !is_back
        });
        self.left_out.len() < before
    }

    fn note(&mut self, batch: &ArrivalBatch) {
        for position in &batch.positions {
            match &position.body {
                Some(body) => {
                    let known = self.positions.entry(position.name.clone()).or_default();
                    known.clone_from(body);
                }
                None => {
                    self.positions.remove(&position.name);
                }
            }
        }
        self.was_live |= batch.caught_up;
    }

    fn keep(&mut self, follower: &Follower) {
        self.nameless = follower.nameless();
        if self.not_text.len() < follower.not_text.len() {
            self.not_text.extend(follower.not_text.iter().cloned());
        }
    }

    /// The folders that do not answer.
    pub(super) fn faults(&self) -> impl Iterator<Item = (FaultPlace, String)> {
        self.left_out.iter().map(|one| {
            let place = FaultPlace {
                kind: ServiceFaultKind::FolderUnreadable,
                source: one.sources.first().cloned(),
                what: one.folder.display().to_string(),
            };
            let what = does_not_answer(&one.folder);
            let text = format!("{what}: it is not read until it does; the other sources are");
            (place, text)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use crate::monitor::Input;
    use std::fs::{self, OpenOptions};
    use std::io::Write as _;
    use std::os::unix::ffi::OsStringExt as _;

    const HEADER: &str = "time,displacement_mm\n";

    async fn look(
        files: &mut FollowedFiles,
        readers: Box<Readers>,
    ) -> (Box<Readers>, ArrivalBatch) {
        match files.look(readers).await.unwrap() {
            Looked::Read(readers, batch) => (readers, batch),
            Looked::Hangs => panic!("it answers"),
        }
    }

    #[tokio::test]
    async fn readers_that_are_made_anew_go_on_with_a_removed_file_and_report_no_name_again() {
        let folder = tempfile::tempdir().unwrap();
        let site = "[site]\nname = \"s\"\nstate_dir = \"state\"\n\
                    [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n";
        let config = config::parse(site, &folder.path().join("site.toml")).unwrap();
        let name = std::ffi::OsString::from_vec(b"M\xfcller.csv".to_vec());
        fs::write(folder.path().join(name), HEADER).unwrap();
        let path = folder.path().join("5.csv");
        let mut logger = OpenOptions::new()
            .append(true)
            .create(true)
            .open(&path)
            .unwrap();
        writeln!(logger, "{HEADER}2020-01-01T00:00:00Z,1").unwrap();
        let mut files = FollowedFiles::new(&config.sources, &config.benchmarks, Vec::new());
        let readers = Box::new(files.readers());
        let (readers, batch) = look(&mut files, readers).await;
        assert_eq!(batch.quarantined.get("logger"), Some(&1));
        let (readers, _) = look(&mut files, readers).await;
        fs::remove_file(&path).unwrap();
        let (readers, _) = look(&mut files, readers).await;
        drop(readers);
        writeln!(logger, "2020-01-01T01:00:00Z,2").unwrap();
        let readers = Box::new(files.readers());
        let (_, batch) = look(&mut files, readers).await;
        let mut taken = Vec::new();
        for arrival in &batch.arrivals {
            let Input::Reading { reading, .. } = &arrival.input else {
                panic!("{arrival:?}");
            };
            taken.push(reading.value);
        }
        assert_eq!(taken, [2.0]);
        assert!(batch.quarantined.is_empty(), "{:?}", batch.quarantined);
    }
}
