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

    /// The highest of them.
    pub(in crate::monitor::track) fn highest_since(&self, since: Timestamp) -> Level {
        let levels = self.since(since).map(|(_, level)| level);
        levels.max().unwrap_or(Level::Green)
    }
}
