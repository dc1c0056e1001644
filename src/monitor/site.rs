//! One level for the whole site, from those of its benchmarks.

use super::event::{AlertState, Event, EventKind};
use crate::alert::Level;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};

/// Benchmarks that a text names.
const MOST_NAMED: usize = 5;

/// How the benchmarks' levels make one of the site. `unknown` does not count: it stands beside a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SiteLevel {
    /// The highest of all.
    Worst,
    /// The highest that so many reach.
    AtLeast(usize),
}

/// The site's level in force.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct SiteAlert {
    in_force: Option<(Level, Timestamp)>,
    /// Since when too many benchmarks are unknown.
    #[serde(default)]
    unknown: Option<Timestamp>,
}

impl SiteAlert {
    /// Takes the benchmarks' levels; says how the site's changes.
    pub(super) fn update<'a>(
        &mut self,
        rule: Option<SiteLevel>,
        now: Timestamp,
        levels: impl Iterator<Item = (&'a BenchmarkId, Level)>,
    ) -> Vec<Event> {
        let mut levels: Vec<(Level, &BenchmarkId)> = levels
            .filter(|(_, level)| (Level::Yellow..=Level::Red).contains(level))
            .map(|(id, level)| (level, id))
            .collect();
        levels.sort_by_key(|(level, _)| std::cmp::Reverse(*level));
        let needed = match rule {
            Some(SiteLevel::Worst) => 1,
            Some(SiteLevel::AtLeast(count)) => count.max(1),
            None => usize::MAX,
        };
        let level = levels.get(needed - 1).map(|(level, _)| *level);
        let before = self.in_force;
        if before.map(|(level, _)| level) == level {
            return Vec::new();
        }
        self.in_force = level.map(|level| (level, now));
        let reach = levels.iter().filter(|(own, _)| Some(*own) >= level);
        let reach: Vec<&BenchmarkId> = reach.map(|(_, id)| *id).collect();
        // As at a benchmark: a higher level supersedes the one before it, a lower one follows on its end.
        let fallen = before.filter(|(before, _)| level.is_none_or(|level| level < *before));
        let mut events: Vec<Event> = fallen
            .map(|(level, since)| event(now, level, since, AlertState::Resolved, &reach))
            .into_iter()
            .collect();
        let entered = self.in_force;
        events.extend(
            entered.map(|(level, since)| event(now, level, since, AlertState::Firing, &reach)),
        );
        events
    }
}

impl SiteAlert {
    /// Takes the benchmarks of which nothing can be said; says whether that becomes, or ceases to be, true of the
    /// site: where those that are known cannot make its level, or would make a lower one than all together.
    pub(super) fn update_unknown(
        &mut self,
        rule: Option<SiteLevel>,
        now: Timestamp,
        unknown: &[&BenchmarkId],
    ) -> Option<Event> {
        let needed = match rule? {
            SiteLevel::Worst => 1,
            SiteLevel::AtLeast(count) => count.max(1),
        };
        match (self.unknown, unknown.len() >= needed) {
            (None, true) => {
                self.unknown = Some(now);
                Some(event(now, Level::Unknown, now, AlertState::Firing, unknown))
            }
            (Some(since), false) => {
                self.unknown = None;
                Some(event(
                    now,
                    Level::Unknown,
                    since,
                    AlertState::Resolved,
                    unknown,
                ))
            }
            (None, false) | (Some(_), true) => None,
        }
    }
}

fn event(
    time: Timestamp,
    level: Level,
    since: Timestamp,
    state: AlertState,
    reach: &[&BenchmarkId],
) -> Event {
    let text = match state {
        AlertState::Firing => {
            let mut names: Vec<&str> = reach.iter().map(|id| id.as_str()).collect();
            names.truncate(MOST_NAMED);
            let more = reach.len() - names.len();
            let more = if more > 0 {
                format!(" and {more} more")
            } else {
                String::new()
            };
            format!("the site: {level} (benchmarks {}{more})", names.join(", "))
        }
        AlertState::Resolved => format!("the site: {level} ends"),
    };
    Event {
        time,
        benchmark: None,
        kind: EventKind::Alert {
            level,
            state,
            key: format!("site/{level}/{since}"),
            rule: "site".to_owned(),
            text,
        },
    }
}
