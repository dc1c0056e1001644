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
    pub(super) fn void(&mut self) {
        self.void_until = self.changes.back().map(|(time, _)| *time);
    }

    /// Those of the `past` stand before these.
    pub(super) fn go_on_from(&mut self, past: Self) {
        let first = self.changes.front().map(|(time, _)| *time);
        let earlier = past.changes.into_iter();
        let mut all: VecDeque<(Timestamp, Level)> = earlier
            .take_while(|(time, _)| first.is_none_or(|first| *time < first))
            .chain(self.changes.drain(..))
            .collect();
        all.drain(..all.len().saturating_sub(MOST_LEVELS));
        self.changes = all;
        self.void_until = self.void_until.max(past.void_until);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::at;

    fn of(changes: &[(i64, Level)]) -> Levels {
        Levels {
            changes: changes
                .iter()
                .map(|(day, level)| (at(*day), *level))
                .collect(),
            void_until: None,
        }
    }

    #[test]
    fn a_red_of_the_past_is_one_of_late_after_a_first_start_and_one_called_in_error_is_none() {
        let mut own = of(&[(20, Level::Yellow)]);
        assert!(!own.was_red_since(at(8)));
        own.go_on_from(of(&[(5, Level::Red), (12, Level::Green)]));
        assert!(own.was_red_since(at(8)) && !own.was_red_since(at(13)));
        own.void();
        assert!(!own.was_red_since(at(8)));
    }
}
