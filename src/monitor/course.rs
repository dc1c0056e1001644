//! The levels in force at a benchmark over time, from the alerts that entered and left them.

use super::event::{AlertState, Event, EventKind};
use crate::alert::Level;
use crate::reading::{BenchmarkId, Timestamp};
use schemars::JsonSchema;
use serde::Serialize;

/// A level and how long it was in force.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize)]
pub struct LevelStretch {
    /// The level.
    pub level: Level,
    /// When it was entered.
    pub from: Timestamp,
    /// When it was left, or the end of what is known.
    pub to: Timestamp,
}

/// Every stretch of one level within `first` and `last`; then those in which it was unknown, which stand beside
/// the level. `None`: of the whole site.
pub fn levels_in(
    events: &[Event],
    benchmark: Option<&BenchmarkId>,
    (first, last): (Timestamp, Timestamp),
) -> (Vec<LevelStretch>, Vec<LevelStretch>) {
    let mut levels = LevelCourse::new(Level::Green, first);
    let mut unknown = LevelCourse::new(Level::Green, first);
    for event in events {
        let EventKind::Alert { level, state, .. } = &event.kind else {
            continue;
        };
        if event.benchmark.as_ref() != benchmark {
            continue;
        }
        let course = match level {
            Level::Unknown => &mut unknown,
            Level::Green | Level::Yellow | Level::Orange | Level::Red => &mut levels,
        };
        match state {
            AlertState::Firing => course.enter(*level, event.time),
            // Another level has been entered already where this is not the one in force.
            AlertState::Resolved if course.level == *level => {
                course.enter(Level::Green, event.time);
            }
            AlertState::Resolved => {}
        }
    }
    let mut unknown = unknown.until(last);
    unknown.retain(|stretch| stretch.level == Level::Unknown);
    (levels.until(last), unknown)
}

/// A level as it changes.
#[derive(Debug)]
struct LevelCourse {
    level: Level,
    since: Timestamp,
    past: Vec<LevelStretch>,
}

impl LevelCourse {
    fn new(level: Level, since: Timestamp) -> Self {
        Self {
            level,
            since,
            past: Vec::new(),
        }
    }

    fn enter(&mut self, level: Level, at: Timestamp) {
        if level == self.level {
            return;
        }
        if at > self.since {
            self.past.push(LevelStretch {
                level: self.level,
                from: self.since,
                to: at,
            });
        }
        self.level = level;
        self.since = at;
    }

    fn until(mut self, end: Timestamp) -> Vec<LevelStretch> {
        // The level that is in force at the end has no width where it was entered there.
        self.past.push(LevelStretch {
            level: self.level,
            from: self.since,
            to: end.max(self.since),
        });
        self.past
    }
}
