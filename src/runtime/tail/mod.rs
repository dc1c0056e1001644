//! Follows growing files: text line by line, MCAP record by record; packed ones are read whole.
//!
//! [`lines`] and [`records`] are pure; [`Follower`] reads files when asked; [`follow`] is the
//! asynchronous shell that asks: when a watched folder changes, and every two seconds in any case,
//! because a watch can be lost, overflow, or never work on a network's file system.
//!
//! A follower goes on from the positions that it reported before and that were kept together with the values before
//! them; whoever takes the values drops what it has seen.

mod at_work;
mod decode;
mod departed;
mod faults;
mod file;
mod follow;
mod gap;
mod hanging;
mod known;
pub mod lines;
mod position;
mod preallocated;
mod quarantine;
mod recording;
pub mod records;
mod reorder;
mod rescan;
mod rotation;
mod saved;
mod text;
mod watch;

pub(super) use decode::Decoder;
pub use decode::{Arrival, is_taken, options_of};
pub use follow::{ArrivalBatch, Follower};
pub use hanging::FollowedFiles;
pub(super) use hanging::does_not_answer;
pub use known::KnownFiles;
pub use reorder::WaitingReading;
pub(super) use rescan::list;
pub(super) use text::{BadLine, LinesRead, MOST_REFUSED, RefusedRows, TextReader, guarded};

use super::clock::{self, Stopwatch};
use super::service_faults::ServiceFaults;
use super::shutdown::Shutdown;
use hanging::Looked;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc;
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
    mut files: FollowedFiles,
    batches: mpsc::Sender<ArrivalBatch>,
    faults: ServiceFaults,
    mut shutdown: Shutdown,
) -> Result<(), tokio::task::JoinError> {
    let mut readers = Box::new(files.readers());
    let mut rescan = tokio::time::interval(RESCAN);
    rescan.set_missed_tick_behavior(MissedTickBehavior::Delay);
    // At least once, so that it is kept of which benchmarks the files are read from here on.
    loop {
        if files.take_back() {
            readers = Box::new(files.readers());
        }
        let looking = Stopwatch::start();
        let batch = match files.look(readers).await? {
            Looked::Read(back, batch) => {
                readers = back;
                batch
            }
            Looked::Hangs => {
                readers = Box::new(files.readers());
                // Those of other files last until these have been read again.
                for (place, text) in files.faults() {
                    faults.begin_fault(place, &text);
                }
                if shutdown.is_requested() {
                    return Ok(());
                }
                continue;
            }
        };
        faults.set_file_faults(readers.follower.faults().into_iter().chain(files.faults()));
        let wake = Arc::clone(readers.watch.wake());
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
                () = wake.notified() => tokio::time::sleep_until(rested).await,
                _ = rescan.tick() => {}
                () = shutdown.requested() => return Ok(()),
            }
        }
    }
}
