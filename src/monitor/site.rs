//! One level for the whole site, from those of its benchmarks.

use super::event::{AlertState, Event, EventKind, SITE};
use super::in_force::LevelsInForce;
use super::{Input, Monitor, Notice};
use crate::alert::{Level, another_since};
use crate::reading::{BEFORE_ALL, BenchmarkId, Timestamp};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Benchmarks that a text names.
const MOST_NAMED: usize = 5;

/// For how long the site's level waits for benchmarks that have given no reading yet, where the config says nothing: one that is read once a day has
/// given its first by then.
pub(crate) const fn first_readings_within() -> SignedDuration {
    SignedDuration::from_hours(25)
}

/// How the benchmarks' levels make one of the site. `unknown` does not count: it stands beside a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SiteLevel {
    /// The highest of all.
    Worst,
    /// The highest that so many reach.
    AtLeast(usize),
}

impl SiteLevel {
    /// What these levels of benchmarks make of the site; `None` where too few of them are in force.
    pub fn of(self, levels: impl Iterator<Item = Level>) -> Option<Level> {
        let mut levels: Vec<Level> = levels.filter(|level| *level != Level::Unknown).collect();
        levels.sort_unstable_by_key(|level| Reverse(*level));
        levels.get(self.needed() - 1).copied()
    }

    /// Benchmarks, at least one.
    fn needed(self) -> usize {
        match self {
            Self::Worst => 1,
            Self::AtLeast(count) => count.max(1),
        }
    }
}

/// The site's level in force.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct SiteAlert {
    in_force: Option<(Level, Timestamp)>,
    /// Since when too many benchmarks are unknown.
    #[serde(default)]
    unknown: Option<Timestamp>,
    /// Since when each level was in force that was the newest of it: that is in its key.
    #[serde(default)]
    newest: BTreeMap<Level, Timestamp>,
    /// When its level was first asked for once there was data time.
    #[serde(default)]
    begun: Option<Timestamp>,
    /// Until when it has waited so far: by the clock that may be later than data time.
    #[serde(default)]
    has_waited_until: Option<Timestamp>,
    /// When the first of the benchmarks that it waits for is waited for no longer.
    #[serde(default)]
    waits_until: Option<Timestamp>,
}

impl SiteAlert {
    /// When its level is to be asked for again although no benchmark's has changed.
    pub(super) fn deadline(&self) -> Option<Timestamp> {
        self.waits_until
    }

    /// How many of those that have never read are waited for at `now`: unknown for less than `within`. They count as benchmarks without a level.
    fn wait_for(
        &mut self,
        awaited: impl Iterator<Item = Timestamp>,
        now: Timestamp,
        within: SignedDuration,
    ) -> usize {
        let now = now.max(self.has_waited_until.unwrap_or(now));
        self.has_waited_until = Some(now);
        self.begun = self.begun.or((now > BEFORE_ALL).then_some(now));
        let Some(begun) = self.begun else {
            self.waits_until = None;
            return awaited.count();
        };
        let ends = |since: Timestamp| {
            let end = since.max(begun).checked_add(within);
            end.unwrap_or(Timestamp::MAX)
        };
        let ends: Vec<Timestamp> = awaited.map(ends).filter(|end| *end > now).collect();
        self.waits_until = ends.iter().min().copied();
        ends.len()
    }

    /// Takes the benchmarks' levels; says how the site's changes. Where fewer than the rule asks for can be judged, because nothing can be
    /// said of `lost` among `all`, all of those are enough: a site does not stay silent because its sensors have died, or never read.
    fn update(
        &mut self,
        rule: Option<SiteLevel>,
        now: Timestamp,
        in_force: &LevelsInForce,
        (lost, all): (usize, usize),
    ) -> Vec<Event> {
        let judged = all.saturating_sub(lost);
        let needed = |rule: SiteLevel| match lost {
            0 => rule.needed(),
            _ => rule.needed().min(judged.max(1)),
        };
        let level = rule.and_then(|rule| in_force.reached_by(needed(rule)));
        let before = self.in_force;
        if before.map(|(level, _)| level) == level {
            return Vec::new();
        }
        self.in_force = level.map(|level| (level, self.begin(level, now)));
        let reach = level.map_or_else(Vec::new, |level| in_force.at_least(level));
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

    /// Since when a level is in force that begins at `now`: what ended may begin again at the same data time, as another alert.
    fn begin(&mut self, level: Level, now: Timestamp) -> Timestamp {
        let since = another_since(self.newest.get(&level).copied(), now);
        self.newest.insert(level, since);
        since
    }

    /// Takes the benchmarks of which nothing can be said, among `all`; says whether that becomes, or ceases to be, true of the
    /// site: where those that are known cannot make its level, or the unknown ones could by themselves, or together with those at
    /// orange or red could make a higher one.
    fn update_unknown(
        &mut self,
        rule: Option<SiteLevel>,
        now: Timestamp,
        in_force: &LevelsInForce,
        (unknown, all): (&[&BenchmarkId], usize),
    ) -> Option<Event> {
        let level = self.in_force.map(|(level, _)| level);
        let may_reach = |higher: Level, needed: usize| {
            let mut reach: BTreeSet<&BenchmarkId> = in_force.at_least(higher).into_iter().collect();
            reach.extend(unknown);
            Some(higher) > level && reach.len() >= needed
        };
        let is_unknown = !unknown.is_empty()
            && rule.is_some_and(|rule| {
                let needed = rule.needed();
                unknown.len() >= needed
                    || all - unknown.len() < needed
                    || [Level::Orange, Level::Red].into_iter().any(|higher| {
                        !in_force.at_least(higher).is_empty() && may_reach(higher, needed)
                    })
            });
        match (self.unknown, is_unknown) {
            (None, true) => {
                let since = self.begin(Level::Unknown, now);
                self.unknown = Some(since);
                Some(event(
                    now,
                    Level::Unknown,
                    since,
                    AlertState::Firing,
                    unknown,
                ))
            }
            (Some(since), false) => {
                self.unknown = None;
                Some(event(now, Level::Unknown, since, AlertState::Resolved, &[]))
            }
            (None, false) | (Some(_), true) => None,
        }
    }
}

impl Monitor {
    /// How the site's level changes, and whether it is unknown, after `events` of benchmarks.
    pub(super) fn site_levels(
        &mut self,
        now: Timestamp,
        input: &Input,
        events: &[Event],
    ) -> Vec<Event> {
        let rule = self.settings.site;
        let is_changed = matches!(input, Input::Settings(_));
        let called = |event: &Event| {
            let EventKind::Alert { level, .. } = event.kind else {
                return None;
            };
            Some(level)
        };
        let levels = || events.iter().filter_map(called);
        // Where data time lies ahead of the clock, it has passed as far as the clock says.
        let passed = if let Input::Notice(Notice::Passed { until, .. }) = input {
            now.max(*until)
        } else {
            now
        };
        let is_waited = self.site.waits_until.is_none_or(|until| passed < until);
        if !is_changed && is_waited && levels().next().is_none() {
            return Vec::new();
        }
        let (in_force, awaited) = (self.benchmarks.in_force(), self.outages.awaited());
        let waited_for = if rule.is_some_and(|rule| rule.needed() > 1) {
            let since = awaited.clone().map(|(_, since)| since);
            let within = self.settings.first_readings_within;
            self.site.wait_for(since, passed, within)
        } else {
            self.site.waits_until = None;
            0
        };
        let all = self.benchmarks.all().len() + awaited.clone().count();
        let unknown = in_force.unknown().iter();
        let unknown: Vec<&BenchmarkId> = unknown.chain(awaited.map(|(id, _)| id)).collect();
        let lost = unknown.len() - waited_for;
        let mut of_site = self.site.update(rule, now, in_force, (lost, all));
        let said = (self.site).update_unknown(rule, now, in_force, (&unknown, all));
        of_site.extend(said);
        of_site
    }
}

/// One line for a person: the site's level, and the benchmarks that make it.
pub fn site_text(level: Level, reach: &[&BenchmarkId]) -> String {
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

fn event(
    time: Timestamp,
    level: Level,
    since: Timestamp,
    state: AlertState,
    reach: &[&BenchmarkId],
) -> Event {
    let text = match state {
        AlertState::Firing => site_text(level, reach),
        AlertState::Resolved => format!("the site: {level} ends"),
    };
    Event {
        time,
        benchmark: None,
        kind: EventKind::Alert {
            level,
            state,
            key: format!("{SITE}/{level}/{since}"),
            rule: "site".to_owned(),
            text,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_of_a_site_is_the_highest_that_enough_benchmarks_reach() {
        let levels = [Level::Orange, Level::Unknown, Level::Red, Level::Yellow];
        let of = |rule: SiteLevel| rule.of(levels.into_iter());
        assert_eq!(of(SiteLevel::Worst), Some(Level::Red));
        assert_eq!(of(SiteLevel::AtLeast(2)), Some(Level::Orange));
        assert_eq!(of(SiteLevel::AtLeast(4)), None);
    }
}
