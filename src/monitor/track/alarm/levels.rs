//! Which levels were in force at a benchmark of late, for who looks back.

use crate::alert::{Latch, Level};
use crate::reading::Timestamp;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Changes of level that are remembered.
const MOST_LEVELS: usize = 64;

/// Which levels were in force, and from when on.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Levels {
    changes: VecDeque<(Timestamp, Level)>,
    /// Until when levels were called in error, or by readings that meant something else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    void_until: Option<Timestamp>,
}

impl Levels {
    /// What is in force at `time`, noted by when it was called: that is in its alert's key.
    pub(super) fn note(&mut self, time: Timestamp, latch: &Latch) {
        let (level, time) = latch.in_force().unwrap_or((Level::Green, time));
        let last = self.changes.back().map_or(Level::Green, |(_, last)| *last);
        if level != last {
            self.changes.push_back((time, level));
        }
        if self.changes.len() > MOST_LEVELS {
            self.changes.pop_front();
        }
    }

    /// Those in force at `since` or later, the oldest first.
    pub(in crate::monitor::track) fn since(
        &self,
        since: Timestamp,
    ) -> impl Iterator<Item = (Timestamp, Level)> {
        let at = self.changes.partition_point(|(time, _)| *time <= since);
        self.changes.iter().skip(at.saturating_sub(1)).copied()
    }

    /// Those so far say nothing of the slope.
    pub(super) fn are_void_until(&mut self, now: Timestamp) {
        self.void_until = Some(now);
    }

    /// Whether red was in force at `since` or later, and not in error.
    pub(super) fn was_red_since(&self, since: Timestamp) -> bool {
        let mut own = self.since(since);
        own.any(|(from, level)| {
            level == Level::Red && self.void_until.is_none_or(|void| from > void)
        })
    }

    /// The highest of them.
    pub(in crate::monitor::track) fn highest_since(&self, since: Timestamp) -> Level {
        let levels = self.since(since).map(|(_, level)| level);
        levels.max().unwrap_or(Level::Green)
    }
}
