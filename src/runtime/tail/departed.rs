//! Files that are no longer under their names. They are read on: a logger that holds its file open writes on to it after
//! a rotation has renamed it, moved it to another folder, or removed it.

use super::file::{Content, Departed, FileTail};
use super::position::{FileId, Saved};
use crate::runtime::clock::Stopwatch;
use std::cmp::Reverse;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Files that are held open, those written to last: what is moved to another folder, or removed, can be read only so.
const MOST_OPEN: usize = 128;
/// Files that are read on after they have gone; beyond, the one that has not grown for the longest time is closed.
pub(super) const MOST_DEPARTED: usize = 64;
/// A file that has another name by now is closed when it has not grown for so long: loggers write once a day too.
const RENAMED_FOR: Duration = Duration::from_secs(48 * 60 * 60);
/// So is one that has no name any more. Its room on the disk becomes free only then.
const REMOVED_FOR: Duration = Duration::from_secs(2 * 60);

/// Where a file is that has gone.
enum Whereabouts {
    Named(PathBuf),
    Nameless(PathBuf),
}

impl FileTail {
    /// The file is no longer under its name: finds where it is, so that what was, and is, written to it is read. `None`
    /// when that is not known, or when nothing has come for long.
    pub(super) fn leave(&mut self) -> Option<PathBuf> {
        let place = self.place?;
        if matches!(self.content, Content::Complete | Content::Refused) {
            return None;
        }
        let (path, is_nameless) = match self.whereabouts(place)? {
            Whereabouts::Named(path) => (path, false),
            Whereabouts::Nameless(path) => (path, true),
        };
        let same = self.departed.take().filter(|one| one.at == self.at);
        let grew = same.map_or_else(Stopwatch::start, |one| one.grew);
        let limit = if is_nameless {
            REMOVED_FOR
        } else {
            RENAMED_FOR
        };
        if grew.elapsed() > limit {
            return None;
        }
        self.departed = Some(Departed {
            grew,
            at: self.at,
            is_nameless,
        });
        if self.path != path {
            self.path.clone_from(&path);
            // It is kept under its new name from the next look on.
            self.reported = Saved::default();
            self.safe.origin = Some(self.origin.clone());
        }
        Some(path)
    }

    fn whereabouts(&self, place: FileId) -> Option<Whereabouts> {
        let is_here =
            |path: &Path| std::fs::metadata(path).is_ok_and(|it| FileId::of(&it) == place);
        if is_here(&self.path) {
            return Some(Whereabouts::Named(self.path.clone()));
        }
        let held = self.held.as_ref();
        let inode = held.and_then(|file| file.metadata().ok());
        let is_removed = inode.as_ref().is_some_and(|inode| inode.nlink() == 0);
        if !is_removed && let Some(path) = self.in_its_folder(place) {
            return Some(Whereabouts::Named(path));
        }
        let name = (!is_removed).then(|| name_of(held?)).flatten();
        if let Some(name) = name.filter(|name| is_here(name)) {
            return Some(Whereabouts::Named(name));
        }
        // No file has this name, as long as this one is held.
        let mut name = self.origin.clone().into_os_string();
        name.push(format!(" (gone, {})", inode?.ino()));
        Some(Whereabouts::Nameless(name.into()))
    }

    fn in_its_folder(&self, place: FileId) -> Option<PathBuf> {
        let entries = std::fs::read_dir(self.path.parent()?).ok()?;
        entries.flatten().find_map(|entry| {
            let metadata = entry.metadata().ok()?;
            (FileId::of(&metadata) == place).then(|| entry.path())
        })
    }

    /// Whether it is read although it has no name that a restart would find it by.
    pub(super) fn is_nameless(&self) -> bool {
        self.departed.as_ref().is_some_and(|one| one.is_nameless)
    }

    /// How long a file that has gone has not grown.
    pub(super) fn has_rested(&self) -> Option<Duration> {
        Some(self.departed.as_ref()?.grew.elapsed())
    }

    /// Keeps it open, if it is still the one that is read.
    fn hold(&mut self) {
        let own = |file: &File| {
            let metadata = file.metadata().ok();
            metadata.is_some_and(|it| Some(FileId::of(&it)) == self.place)
        };
        self.held = File::open(&self.path).ok().filter(own);
    }
}

/// Keeps open those that were written to last, and no others.
pub(super) fn hold_newest<'a>(files: impl Iterator<Item = &'a mut FileTail>) {
    let may_grow =
        |file: &FileTail| matches!(file.content, Content::Text(_) | Content::Mcap { .. });
    let (mut growing, others): (Vec<_>, Vec<_>) =
        files.partition(|file| file.place.is_some() && may_grow(file));
    growing.sort_by_key(|file| Reverse((file.is_nameless(), file.modified())));
    let kept = growing.len().min(MOST_OPEN);
    for file in others.into_iter().chain(growing.drain(kept..)) {
        file.held = None;
    }
    for file in growing.into_iter().filter(|file| file.held.is_none()) {
        file.hold();
    }
}

/// The name of an open file, where the system says it.
fn name_of(file: &File) -> Option<PathBuf> {
    std::fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd())).ok()
}
