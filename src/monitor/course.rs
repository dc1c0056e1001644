//! The levels in force at a benchmark over time, from the alerts that entered and left them.

use super::event::{AlertState, Event, EventKind, REMOVED};
use crate::alert::Level;
use crate::reading::{BenchmarkId, TimeSpan, Timestamp};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// A level and how long it was in force.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize)]
pub struct LevelStretch {
    /// The level.
    pub level: Level,
    /// When it was entered.
    pub from: Timestamp,
    /// When it was left, or the end of what is known.
    pub to: Timestamp,
    /// Whether it is in force at the end of what is known.
    pub is_in_force: bool,
}

/// Every stretch of one level within `span`; then those in which it was unknown, which stand beside
/// the level. `None`: of the whole site.
pub fn levels_in(
    events: &[Event],
    benchmark: Option<&BenchmarkId>,
    span: TimeSpan,
) -> (Vec<LevelStretch>, Vec<LevelStretch>) {
    let mut levels = LevelCourse::new(Level::Green, span.from);
    let mut unknown = LevelCourse::new(Level::Green, span.from);
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
    let mut unknown = unknown.until(span.to);
    unknown.retain(|stretch| stretch.level == Level::Unknown);
    (levels.until(span.to), unknown)
}

/// `events` by the times that they are of: those of the past before a first start are found after those of the present. No alert ends
/// before it has begun, as by time one does whose end came with a backlog; and what is called at a benchmark that was taken out of the
/// config and put back, whose readings are read again, does not begin before what was ended when it was taken out.
pub fn by_time(events: Vec<Event>) -> Vec<Event> {
    let mut begun: BTreeMap<String, Timestamp> = BTreeMap::new();
    let mut taken_out: BTreeMap<Option<BenchmarkId>, Timestamp> = BTreeMap::new();
    let mut placed: Vec<(Timestamp, Event)> = Vec::with_capacity(events.len());
    for event in events {
        let mut place = event.time;
        if let EventKind::Alert {
            key, state, rule, ..
        } = &event.kind
        {
            match state {
                AlertState::Firing => {
                    let ended = taken_out.get(&event.benchmark);
                    place = ended.map_or(place, |ended| place.max(*ended));
                    begun.insert(key.clone(), place);
                }
                AlertState::Resolved => {
                    place = begun.get(key).map_or(place, |begun| place.max(*begun));
                    if rule == REMOVED {
                        taken_out.insert(event.benchmark.clone(), place);
                    }
                }
            }
        }
        placed.push((place, event));
    }
    placed.sort_by_key(|(place, _)| *place);
    placed.into_iter().map(|(_, event)| event).collect()
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
        // Of a benchmark that was put back, what its readings call again may have been before.
        let at = at.max(self.since);
        if at > self.since {
            self.past.push(LevelStretch {
                level: self.level,
                from: self.since,
                to: at,
                is_in_force: false,
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
            is_in_force: true,
        });
        self.past
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_called_again_after_a_benchmark_was_put_back_stands() {
        let at = |hour: i64| Timestamp::from_second(3600 * hour).unwrap();
        let alert = |hour, key: &str, state, rule: &str| Event {
            time: at(hour),
            benchmark: Some(BenchmarkId::new("5")),
            kind: EventKind::Alert {
                level: Level::Red,
                state,
                key: key.to_owned(),
                rule: rule.to_owned(),
                text: String::new(),
            },
        };
        let events = vec![
            alert(10, "first", AlertState::Firing, ""),
            alert(11, "first", AlertState::Resolved, REMOVED),
            alert(5, "past", AlertState::Firing, ""),
            alert(6, "past", AlertState::Resolved, ""),
            alert(8, "again", AlertState::Firing, ""),
        ];
        assert_eq!(by_time(events.clone()), events);
        let span = TimeSpan::new(at(0), at(20));
        let (levels, _) = levels_in(&events, events[0].benchmark.as_ref(), span);
        assert_eq!(levels.last().map(|last| last.level), Some(Level::Red));
    }

    #[test]
    fn the_end_that_a_backlog_brings_stands_after_the_beginning() {
        let at = |hour: i64| Timestamp::from_second(3600 * hour).unwrap();
        let alert = |hour, key: &str, state| Event {
            time: at(hour),
            benchmark: None,
            kind: EventKind::Alert {
                level: Level::Unknown,
                state,
                key: key.to_owned(),
                rule: String::new(),
                text: String::new(),
            },
        };
        let events = vec![
            alert(20, "present", AlertState::Firing),
            alert(12, "present", AlertState::Resolved),
            alert(5, "past", AlertState::Firing),
            alert(7, "past", AlertState::Resolved),
        ];
        let placed = [2, 3, 0, 1].map(|index: usize| events[index].clone());
        assert_eq!(by_time(events), placed);
    }
}
