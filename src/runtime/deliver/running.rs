//! The runs of a hook: which are at work and for what, and what a worker waits for.

use crate::reading::Timestamp;
use crate::runtime::hook::{Alert, HookOutcome};
use std::pin::Pin;
use std::task::Poll;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::Instant;

/// An alert that a hook has not taken yet.
#[derive(Debug)]
pub(super) struct Waiting {
    pub(super) alert: Alert,
    /// Counts from 1, over restarts.
    pub(super) attempt: u32,
    /// Not tried since the start.
    pub(super) is_new: bool,
    /// An escalation: from when on it does not wait for an acknowledgement any more, and when it was noted.
    pub(super) escalation: Option<(Instant, Option<Timestamp>)>,
    /// It waits for an acknowledgement, for somebody on duty or for the end of a silence: it is not sent on the way out either.
    pub(super) is_held: bool,
}

/// A hook's run, and for what. It ends with its worker.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) task: JoinHandle<HookOutcome>,
    pub(super) waiting: Waiting,
    pub(super) started: Instant,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// The first run that ends, by its place; `None` when it broke off.
pub(super) async fn finished(running: &mut [Running]) -> (usize, Option<HookOutcome>) {
    std::future::poll_fn(|context| {
        for (index, run) in running.iter_mut().enumerate() {
            if let Poll::Ready(ended) = Pin::new(&mut run.task).poll(context) {
                return Poll::Ready((index, ended.ok()));
            }
        }
        Poll::Pending
    })
    .await
}

pub(super) async fn until(due: Option<Instant>) {
    if let Some(due) = due {
        tokio::time::sleep_until(due).await;
    }
}

/// What the config says of a hook since the last look; `None` where it says nothing else.
pub(super) fn news<T: Clone>(changes: &mut watch::Receiver<T>) -> Option<T> {
    let newest = changes.borrow_and_update();
    newest.has_changed().then(|| newest.clone())
}
