//! Follows growing files: text line by line, MCAP record by record; packed ones are read once.
//!
//! [`lines`] and [`records`] are pure; [`Follower`] reads files when asked; [`follow`] is the
//! asynchronous shell that asks: when a watched folder changes, and every two seconds in any case,
//! because a watch can be lost, overflow, or never work on a network's file system.
//!
//! A follower goes on from the positions that it reported before and that were kept together with the values before
//! them; whoever takes the values drops what it has seen.

mod decode;
mod departed;
mod faults;
mod file;
mod follow;
mod gap;
mod known;
pub mod lines;
mod position;
mod quarantine;
mod recording;
pub mod records;
mod reorder;
mod rescan;
mod rotation;
mod saved;
mod text;

pub(super) use decode::Decoder;
pub use decode::{Arrival, is_taken, options_of};
pub use follow::{ArrivalBatch, Follower};
pub use known::KnownFiles;
pub use reorder::WaitingReading;
pub(super) use rescan::list;
pub(super) use text::{BadLine, LinesRead, MOST_REFUSED, RefusedRows, TextReader};

use super::clock::{self, Stopwatch};
use super::service_faults::ServiceFaults;
use super::shutdown::Shutdown;
use notify::{RecommendedWatcher, RecursiveMode, Watcher};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Notify, mpsc};
use tokio::time::MissedTickBehavior;

/// How often the files are read when the system reports no change of them.
const RESCAN: Duration = Duration::from_secs(2);

/// Between two looks: so many times as long as the last one took, so that following a busy writer costs a fifth of a
/// core at most, and a change after a quiet time is read at once.
const REST: u32 = 4;
const SHORTEST_REST: Duration = Duration::from_millis(5);
const LONGEST_REST: Duration = Duration::from_millis(200);

/// Follows until `shutdown` is asked for or nobody takes the batches any more.
///
/// Every round is sent, an empty one too: that the files hold no more is news. Files and folders that cannot be read are kept in
/// `faults`.
///
/// # Errors
/// When a reading task broke off.
pub async fn follow(
    mut follower: Follower,
    batches: mpsc::Sender<ArrivalBatch>,
    faults: ServiceFaults,
    mut shutdown: Shutdown,
) -> Result<(), tokio::task::JoinError> {
    let mut watch = FolderWatch::new(follower.folders());
    let mut rescan = tokio::time::interval(RESCAN);
    rescan.set_missed_tick_behavior(MissedTickBehavior::Delay);
    // At least once, so that it is kept of which benchmarks the files are read from here on.
    loop {
        watch.renew();
        let looking = Stopwatch::start();
        let batch;
        (follower, batch) = tokio::task::spawn_blocking(move || {
            let batch = follower.poll(clock::now());
            (follower, batch)
        })
        .await?;
        faults.are_of_files(follower.faults());
        let rest = (REST * looking.elapsed()).clamp(SHORTEST_REST, LONGEST_REST);
        let rested = clock::later(rest);
        let (waits, rests) = (
            batch.caught_up && !batch.has_more,
            batch.has_more && batch.arrivals.is_empty(),
        );
        tokio::select! {
            biased;
            sent = batches.send(batch) => if sent.is_err() { return Ok(()) },
            () = shutdown.requested() => return Ok(()),
        }
        if shutdown.is_requested() {
            return Ok(());
        }
        if rests {
            tokio::select! {
                () = tokio::time::sleep_until(rested) => {}
                () = shutdown.requested() => return Ok(()),
            }
        }
        if waits {
            tokio::select! {
                () = watch.wake.notified() => tokio::time::sleep_until(rested).await,
                _ = rescan.tick() => {}
                () = shutdown.requested() => return Ok(()),
            }
        }
    }
}

/// One watcher for all folders.
#[derive(Debug)]
struct FolderWatch {
    watcher: Option<RecommendedWatcher>,
    unwatched: BTreeSet<PathBuf>,
    /// Of which it has been said that they cannot be watched.
    reported: BTreeSet<PathBuf>,
    wake: Arc<Notify>,
}

impl FolderWatch {
    fn new(folders: BTreeSet<PathBuf>) -> Self {
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

    /// Watches the folders that could not be watched so far.
    fn renew(&mut self) {
        let Some(watcher) = &mut self.watcher else {
            return;
        };
        self.unwatched.retain(|folder| {
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
