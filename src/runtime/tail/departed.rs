//! Files that are no longer under their names. They are read on: a logger that holds its file open writes on to it after
//! a rotation has renamed it, moved it to another folder, or removed it.

use super::file::{Content, Departed, FileTail};
use super::position::{FileId, Saved};
use crate::reading::Timestamp;
use crate::runtime::clock::{self, Stopwatch};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Files that are held open, those written to last: what is moved to another folder, or removed, can be read only so.
const MOST_OPEN: usize = 128;
/// A file that has another name by now is closed when it has not grown for so long: loggers write once a day too.
const RENAMED_FOR: Duration = Duration::from_secs(48 * 60 * 60);
/// So is one that has no name any more. Its room on the disk becomes free only then.
const REMOVED_FOR: Duration = Duration::from_secs(2 * 60);

/// Where a file is that has gone.
enum NewPath {
    Named(PathBuf),
    Nameless(PathBuf),
}

/// Which names files have in folders, each of which is listed once although thousands of files may have gone from it.
#[derive(Default)]
pub(super) struct FolderNames(BTreeMap<PathBuf, BTreeMap<FileId, Vec<PathBuf>>>);

impl FolderNames {
    /// The names in the folder of `file` that lead to it.
    fn of(&mut self, file: &FileTail) -> &[PathBuf] {
        let (Some(folder), Some(place)) = (file.path.parent(), file.place) else {
            return &[];
        };
        if !self.0.contains_key(folder) {
            self.0.insert(folder.to_owned(), names_in(folder));
        }
        let names = self.0.get(folder).and_then(|names| names.get(&place));
        names.map_or(&[], Vec::as_slice)
    }
}

fn names_in(folder: &Path) -> BTreeMap<FileId, Vec<PathBuf>> {
    let mut names: BTreeMap<FileId, Vec<PathBuf>> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        // Not what a link leads to: that is elsewhere.
        if let Ok(metadata) = entry.metadata() {
            let own = names.entry(FileId::of(&metadata)).or_default();
            own.push(entry.path());
        }
    }
    names
}

/// What becomes of a file that is no longer under its name.
pub(super) enum Departure {
    /// It is read on, there.
    To(PathBuf),
    /// Nothing more is expected of it.
    Over,
    /// Nobody knows where it is.
    Untraced,
}

impl FileTail {
    /// The file is no longer under its name: finds where it is, so that what was, and is, written to it is read.
    pub(super) fn leave(&mut self, folders: &mut FolderNames) -> Departure {
        if self.place.is_none() || matches!(self.content, Content::Complete | Content::Refused(_)) {
            return Departure::Over;
        }
        let (path, is_nameless) = match self.new_path(folders) {
            Some(NewPath::Named(path)) => (path, false),
            Some(NewPath::Nameless(path)) => (path, true),
            None => return Departure::Untraced,
        };
        let same = self.departed.take().filter(|one| one.at == self.at);
        let grew = same.map_or_else(Stopwatch::start, |one| one.grew);
        let limit = if is_nameless {
            REMOVED_FOR
        } else {
            RENAMED_FOR
        };
        if grew.elapsed() > limit {
            return Departure::Over;
        }
        self.departed = Some(Departed {
            grew,
            at: self.at,
            is_nameless,
        });
        Departure::To(path)
    }

    /// It is kept under this name from now on.
    pub(super) fn rename(&mut self, path: &Path) {
        path.clone_into(&mut self.path);
        self.reported = Saved::default();
        self.safe.origin = (self.origin != self.path).then(|| self.origin.clone());
        // What was written to it before it went is read before it counts as read.
        self.idle = None;
    }

    /// Whether the file at `path` is this one. Once a file is removed that nobody holds open, its number may be that of
    /// another one: then what was read last is to stand there too.
    pub(super) fn is_at(&self, path: &Path) -> bool {
        let found = std::fs::metadata(path).map(|metadata| FileId::of(&metadata));
        if self.place.is_none() || found.ok() != self.place {
            return false;
        }
        match self.at {
            _ if self.held.is_some() => true,
            // Nothing has been read of it: its names are all that is known.
            0 => path == self.path || path == self.origin,
            _ => self.goes_on(path),
        }
    }

    fn new_path(&self, folders: &mut FolderNames) -> Option<NewPath> {
        if self.is_at(&self.path) {
            return Some(NewPath::Named(self.path.clone()));
        }
        let held = self.held.as_ref();
        let inode = held.and_then(|file| file.metadata().ok());
        let is_removed = inode.as_ref().is_some_and(|inode| inode.nlink() == 0);
        if !is_removed {
            let names = folders.of(self);
            if let Some(path) = names.iter().find(|path| self.is_at(path)) {
                return Some(NewPath::Named(path.clone()));
            }
        }
        let name = (!is_removed).then(|| name_of(held?)).flatten();
        if let Some(name) = name.filter(|name| self.is_at(name)) {
            return Some(NewPath::Named(name));
        }
        // No file has this name, as long as this one is held.
        let mut name = self.origin.clone().into_os_string();
        name.push(format!(" (gone, {})", inode?.ino()));
        Some(NewPath::Nameless(name.into()))
    }

    /// Whether it has not been written to for so long that nothing more is expected of it.
    pub(super) fn is_old(&self) -> bool {
        let (seconds, nanoseconds) = self.modified;
        let nanoseconds = i32::try_from(nanoseconds).unwrap_or_default();
        let Ok(modified) = Timestamp::new(seconds, nanoseconds) else {
            return true;
        };
        let age = Duration::try_from(clock::now().duration_since(modified));
        age.is_ok_and(|age| age > RENAMED_FOR)
    }

    /// Whether nothing more was in it when it was last looked at, or it could not be read.
    pub(super) fn is_read_out(&self) -> bool {
        self.idle.is_some() || self.trouble.is_some()
    }

    /// Whether it is read although it has no name that a restart would find it by.
    pub(super) fn is_nameless(&self) -> bool {
        self.departed.as_ref().is_some_and(|one| one.is_nameless)
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
    growing.sort_by_key(|file| Reverse((file.is_nameless(), file.modified)));
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
