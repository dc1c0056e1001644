//! Looks for files that have come or gone.
//!
//! A file is known by its number and by what was read of it last, not by its name: one that is no longer under its name
//! is read on wherever it is. Where a source asks for it by another name it is read there from its start, as what that name says, unless
//! a rotation has given it that name: it is then what it was.

use super::decode::Decoder;
use super::departed::{Departure, FolderNames};
use super::file::FileTail;
use super::follow::{FileKey, Followed, Follower, name};
use super::position::FileId;
use super::reorder::Forgotten;
use super::rotation::is_rotated_name;
use crate::config::FilePattern;
use crate::store::Position;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

/// Files that are read on after they have gone; beyond, those are closed that were written to longest ago.
const MOST_DEPARTED: usize = 64;

/// What the sources' folders hold that they ask for.
#[derive(Debug, Default)]
struct Listing {
    files: BTreeMap<FileKey, FileId>,
    /// A path of each.
    paths: BTreeMap<FileId, PathBuf>,
    /// The files that were followed before the folders were listed.
    known: BTreeSet<FileId>,
    /// Sources whose folders are there and could not be listed.
    unlisted: BTreeSet<usize>,
}

/// What becomes of a file that is not under its name.
enum GoneFile {
    Stays,
    Moves(FileKey),
    /// It is read no more; what may be missing of it is said, if anything.
    Closed(Option<&'static str>),
}

impl Listing {
    /// Whether a rotation has given the file its new name `to`: another file, that nobody knew, stands under its first name, or the new
    /// name says so.
    fn is_rotated(&self, file: &FileTail, to: &FileKey) -> bool {
        if self.files.get(to) != file.place.as_ref() {
            return false;
        }
        let successor = self.files.get(&(to.0, file.origin.clone()));
        successor.is_some_and(|place| !self.known.contains(place))
            || is_rotated_name(&file.origin, &to.1)
    }
}

impl Followed {
    /// Whether the pattern asks for a file of this name.
    fn takes(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(OsStr::to_str);
        path.parent() == Some(self.pattern.folder())
            && name.is_some_and(|name| is_ours(&self.pattern, &self.decoder, name))
    }

    /// After a restart the config may be another one, and ask for other files.
    fn still_asks_for(&self, file: &FileTail) -> bool {
        !file.is_restored || self.takes(&file.origin)
    }
}

impl Follower {
    /// Looks for files that have come or gone.
    pub(super) fn rescan(&mut self) {
        let mut listing = self.list();
        let mut renamed = self.first_names();
        let sources = &self.sources;
        let may_be_there = |key: &FileKey, file: &FileTail| {
            let is_unlisted = listing.unlisted.contains(&key.0) && file.origin == file.path;
            is_unlisted && sources[key.0].still_asks_for(file)
        };
        let gone: Vec<FileKey> = (self.files.iter_mut())
            .filter_map(|(key, file)| match listing.files.get(key) {
                Some(place) if file.is_other_than(*place) => Some(key.clone()),
                Some(_) => {
                    file.departed = None;
                    None
                }
                None => (!may_be_there(key, file)).then(|| key.clone()),
            })
            .collect();
        if !gone.is_empty() {
            listing.known = self.places();
        }
        // All of them first: the new name of one may be the former name of another.
        let gone: Vec<(FileKey, FileTail)> = gone
            .into_iter()
            .filter_map(|key| self.files.remove_entry(&key))
            .collect();
        let (mut moves, mut folders) = (Vec::new(), FolderNames::default());
        for (key, mut file) in gone {
            self.at_work.comes_to(key.0);
            match self.outcome(&key, &mut file, &listing, &mut folders) {
                GoneFile::Stays => {
                    self.files.insert(key, file);
                }
                GoneFile::Moves(to) => {
                    let forgotten = self.forget(&key);
                    let name = name(&self.sources[key.0].id, &key.1);
                    self.at_once.push(Position { name, body: None });
                    moves.push((key, to, file, forgotten));
                }
                GoneFile::Closed(lost) => self.close(&key, &file, lost),
            }
        }
        for (from, to, file, forgotten) in moves {
            self.move_file(&from, to, file, &forgotten);
        }
        self.make_room();
        renamed.extend(self.first_names());
        let come = listing.files.into_keys();
        let come: Vec<FileKey> = come.filter(|key| !self.files.contains_key(key)).collect();
        if come.is_empty() {
            return;
        }
        let known = self.known_before();
        for key in come {
            tracing::info!(file = %key.1.display(), "followed");
            let file = self.newly_followed(&key, &renamed, &known);
            self.files.insert(key, file);
        }
    }

    fn outcome(
        &self,
        key: &FileKey,
        file: &mut FileTail,
        listing: &Listing,
        folders: &mut FolderNames,
    ) -> GoneFile {
        if !self.sources[key.0].still_asks_for(file) {
            return without_trace(key, file);
        }
        let listed = file.place.and_then(|place| listing.paths.get(&place));
        if let Some(path) = listed.filter(|path| file.is_at(path)) {
            let (first, to) = ((key.0, file.origin.clone()), (key.0, path.clone()));
            let is_back = listing.files.get(&first) == file.place.as_ref();
            let to = if is_back { first } else { to };
            return if (is_back || listing.is_rotated(file, &to)) && !self.files.contains_key(&to) {
                file.departed = None;
                GoneFile::Moves(to)
            } else {
                // Read there, from its start.
                GoneFile::Closed(None)
            };
        }
        match file.leave(folders) {
            Departure::To(path) if path == key.1 => GoneFile::Stays,
            Departure::To(path) => {
                let to = (key.0, path);
                // It came there after the folders were listed: the next look reads it there, from its start.
                let is_listed = listing.files.contains_key(&to);
                if is_listed {
                    GoneFile::Closed(None)
                } else {
                    GoneFile::Moves(to)
                }
            }
            Departure::Over => GoneFile::Closed(None),
            Departure::Untraced => without_trace(key, file),
        }
    }

    /// A file has another name: it is followed on under that.
    fn move_file(
        &mut self,
        from: &FileKey,
        to: FileKey,
        mut file: FileTail,
        forgotten: &Forgotten,
    ) {
        let is_taken = self.files.contains_key(&to);
        let source = &mut self.sources[to.0];
        if let Some(reorder) = &mut source.reorder {
            // What waits of it could not be read again.
            if forgotten.waits && (is_taken || file.is_nameless()) {
                reorder.flush();
            }
            let body = file.kept(forgotten.acknowledged.as_deref());
            if let Some(body) = body.filter(|_| !is_taken) {
                let name = name(&source.id, &to.1);
                reorder.keep(&name, &body);
                let body = Some(body);
                self.at_once.push(Position { name, body });
            }
        }
        if is_taken {
            self.lost
                .push(file.lost("under no name of its own any more"));
            source.quarantined_in_gone += file.quarantined;
            return;
        }
        let (was, now) = (from.1.display(), to.1.display());
        if file.departed.is_some() {
            tracing::info!(file = %was, %now, "gone from its name, and read on for as long as it grows");
        } else if to.1 == file.origin {
            tracing::info!(file = %was, %now, "back under its name, and read on");
        } else {
            tracing::info!(file = %was, %now, "renamed by a rotation, and read on as what it was");
        }
        file.rename(&to.1);
        self.files.insert(to, file);
    }

    /// A file is read no more.
    fn close(&mut self, key: &FileKey, file: &FileTail, lost: Option<&str>) {
        tracing::info!(file = %key.1.display(), "gone");
        self.lost.extend(lost.map(|what| file.lost(what)));
        let waits = self.forget(key).waits;
        let source = &mut self.sources[key.0];
        source.quarantined_in_gone += file.quarantined;
        let (name, body) = (name(&source.id, &key.1), None);
        match &mut source.reorder {
            Some(reorder) if waits => {
                reorder.flush();
                reorder.note(Position { name, body });
            }
            Some(_) | None => self.at_once.push(Position { name, body }),
        }
    }

    fn forget(&mut self, (source, path): &FileKey) -> Forgotten {
        let source = &mut self.sources[*source];
        let name = name(&source.id, path);
        let reorder = source.reorder.as_mut();
        reorder.map_or_else(Forgotten::default, |reorder| reorder.forget(&name))
    }

    /// Where more files have gone than may be: closes those that were written to longest ago, each once it has been
    /// read to its end.
    fn make_room(&mut self) {
        let departed = (self.files.iter()).filter(|(_, file)| file.departed.is_some());
        let mut departed: Vec<_> = departed
            .map(|(key, file)| (file.modified, key.clone(), file.is_read_out()))
            .collect();
        let surplus = departed.len().saturating_sub(MOST_DEPARTED);
        departed.sort_unstable();
        let oldest = departed.into_iter().take(surplus);
        for (_, key, _) in oldest.filter(|(.., is_read_out)| *is_read_out) {
            if let Some(file) = self.files.remove(&key) {
                let what = "no longer read, as too many files have gone from their names";
                self.close(&key, &file, file.may_grow().then_some(what));
            }
        }
    }

    fn list(&mut self) -> Listing {
        let mut listing = Listing::default();
        for (index, source) in self.sources.iter_mut().enumerate() {
            let folder = source.pattern.folder();
            self.at_work.comes_to(index);
            match list(&source.pattern, &source.decoder) {
                Ok((files, not_text)) => {
                    self.unlisted.remove(folder);
                    for path in not_text {
                        if self.not_text.insert(path.clone()) {
                            tracing::warn!(file = ?path, "its name is no UTF-8: it is not read; rename it");
                            source.quarantined_in_gone += 1;
                        }
                    }
                    for (path, place) in files {
                        listing.paths.insert(place, path.clone());
                        listing.files.insert((index, path), place);
                    }
                }
                Err(error) => {
                    if error.kind() != io::ErrorKind::NotFound {
                        listing.unlisted.insert(index);
                    }
                    let why = (source.id.clone(), error.to_string());
                    if self.unlisted.insert(folder.to_owned(), why).is_none() {
                        tracing::warn!(folder = %folder.display(), %error, "cannot list; will look again");
                    }
                }
            }
        }
        listing
    }
}

pub(super) fn is_ours(pattern: &FilePattern, decoder: &Decoder, name: &str) -> bool {
    let packed = name.strip_suffix(".gz").filter(|_| decoder.takes_packed());
    pattern.matches(name) || packed.is_some_and(|name| pattern.matches(name))
}

fn without_trace(key: &FileKey, file: &FileTail) -> GoneFile {
    let what = if file.is_restored {
        "gone since the last stop"
    } else {
        "gone, and not found again"
    };
    // An export replaces its file as a whole: what was read of the old one stands in the new one, under its first name.
    let is_lost = file.is_lost(&key.1) && !file.goes_on(&file.origin);
    GoneFile::Closed(is_lost.then_some(what))
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
