//! The watch on the folders of all sources: a change is read at once.

use super::at_work::AtWork;
use notify::{RecommendedWatcher, RecursiveMode, Watcher};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use tokio::sync::Notify;

/// One watcher for all folders.
#[derive(Debug)]
pub(super) struct FolderWatch {
    watcher: Option<RecommendedWatcher>,
    /// With the number of a source that has files there.
    unwatched: BTreeMap<PathBuf, usize>,
    /// Of which it has been said that they cannot be watched.
    reported: BTreeSet<PathBuf>,
    wake: Arc<Notify>,
}

impl FolderWatch {
    /// Of these folders, each with the number of a source.
    pub(super) fn new(folders: BTreeMap<PathBuf, usize>) -> Self {
        let wake = Arc::new(Notify::new());
        let waker = Arc::clone(&wake);
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            // Reading a file is an event too, and our own reading must not wake us.
            if event.is_ok_and(|event| !event.kind.is_access()) {
                waker.notify_one();
            }
        })
        .inspect_err(|error| tracing::warn!(%error, "no watcher: files are read in turn"))
        .ok();
        Self {
            watcher,
            unwatched: folders,
            reported: BTreeSet::new(),
            wake,
        }
    }

    /// Woken by a change.
    pub(super) fn wake(&self) -> &Arc<Notify> {
        &self.wake
    }

    /// Watches the folders that could not be watched so far.
    pub(super) fn renew(&mut self, at_work: &AtWork) {
        let Some(watcher) = &mut self.watcher else {
            return;
        };
        self.unwatched.retain(|folder, source| {
            at_work.comes_to(*source);
            let watched = watcher.watch(folder, RecursiveMode::NonRecursive);
            let Err(error) = watched else { return false };
            // A folder that is not there is reported by whoever lists it.
            if !matches!(error.kind, notify::ErrorKind::PathNotFound) && folder.is_dir() && self.reported.insert(folder.clone()) {
                tracing::warn!(folder = %folder.display(), %error, "no watch: files are read in turn");
            }
            true
        });
    }
}
