//! What the daemon takes next: files, messages, what time brings, what is looked back on.

use super::{Daemon, QUIET, TICK};
use crate::runtime::shutdown::Shutdown;
use crate::store::StoreError;
use std::time::Duration;
use tokio::time::{Interval, MissedTickBehavior};

/// However many messages come, time is let pass after so long.
const LATEST_TICK: Duration = Duration::from_secs(5);

/// What is taken next where both have come: after a batch of a backlog messages have their turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PreferredSource {
    Files,
    Messages,
}

impl Daemon {
    /// When time is let pass where nothing comes.
    pub(in crate::runtime) fn ticks() -> Interval {
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        tick
    }

    /// Takes what comes next, or lets time go by; `false` when the source has ended.
    pub(in crate::runtime) async fn take_next(
        &mut self,
        tick: &mut Interval,
        shutdown: &Shutdown,
    ) -> Result<bool, StoreError> {
        if self.are_messages_due()
            && let Ok(delivery) = self.sources.deliveries.try_recv()
        {
            self.preferred = PreferredSource::Files;
            tokio::task::block_in_place(|| self.take_messages(delivery))?;
            return Ok(true);
        }
        if self.files_are_read && self.since_tick.elapsed() >= LATEST_TICK {
            tokio::task::block_in_place(|| self.tick())?;
            return Ok(true);
        }
        tokio::select! {
            biased;
            batch = self.sources.batches.recv(), if !self.site.is_stalled() => {
                let Some(batch) = batch else { return Ok(false) };
                tokio::task::block_in_place(|| self.take_batch(batch, shutdown))?;
            }
            Some(delivery) = self.sources.deliveries.recv(), if !self.site.is_stalled() && self.sources.has_room() => {
                tokio::task::block_in_place(|| self.take_messages(delivery))?;
            }
            _ = tick.tick() => tokio::task::block_in_place(|| self.tick())?,
            () = tokio::time::sleep(QUIET), if self.site.queues() => {
                tokio::task::block_in_place(|| self.judge_queued())?;
            }
            // Last, so that it keeps nothing else waiting.
            () = std::future::ready(()), if self.site.has_review_pending() => {
                tokio::task::block_in_place(|| self.look_back())?;
            }
        }
        Ok(true)
    }

    /// Whether messages go before the next batch of files: what brokers send does not wait until a long file has been read. Before the past
    /// has been read it does, as the files may hold the past of the same benchmarks.
    fn are_messages_due(&self) -> bool {
        self.preferred == PreferredSource::Messages
            && self.is_caught_up
            && !self.site.is_stalled()
            && self.sources.has_room()
    }
}
