//! The alerts in force: at each place one level, perhaps `unknown` beside it, and what has been sent that stands for many of them.

use super::flood;
use crate::alert::Level;
use crate::reading::{BEFORE_ALL, BenchmarkId, Timestamp};
use crate::runtime::hook::{Alert, MessageState};
use crate::runtime::many::{EarlierLevel, FloodMember};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Where an alert stands: one level is in force at a benchmark, and beside it perhaps `unknown`.
pub(super) type AlertPlace = (Option<BenchmarkId>, bool);

/// An alert in force.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct AlertInForce {
    pub(super) alert: Alert,
    /// Whether it has been offered to the hooks.
    pub(super) is_sent: bool,
    /// Whether this one, or a lower one that it superseded, has been offered to them: people wait for its end.
    #[serde(default, rename = "was_told")]
    pub(super) was_notified: bool,
    /// Whether an alert of many benchmarks has reported it too.
    #[serde(default, rename = "is_told_together")]
    pub(super) is_reported_together: bool,
    /// Whether somebody has seen it.
    #[serde(default)]
    pub(super) attention: Attention,
}

/// What people do about an alert in force.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Attention {
    /// Nobody has acknowledged it.
    #[default]
    Awaited,
    /// Somebody has: hooks that have not taken it are not notified of it any more, nor those that a config adds.
    Acknowledged,
}

/// An alert of many benchmarks that has not ended.
#[derive(Debug, Clone)]
pub(super) struct StandingFlood {
    /// Its beginning.
    pub(super) alert: Alert,
    /// Whether somebody has acknowledged everything since.
    pub(super) is_acknowledged: bool,
}

/// What is in force: neither resolved nor superseded.
#[derive(Debug, Default)]
pub(super) struct StandingAlerts {
    by_place: BTreeMap<AlertPlace, AlertInForce>,
    /// What stands for many, by its key, until all of these are over.
    floods: BTreeMap<String, StandingFlood>,
}

fn place(alert: &Alert) -> AlertPlace {
    (alert.event.benchmark.clone(), alert.level == Level::Unknown)
}

impl StandingAlerts {
    /// As the memory has them; what stands for many is read from the outbox.
    pub(super) fn remembered(all: Vec<(AlertPlace, AlertInForce)>) -> Self {
        Self {
            by_place: all.into_iter().collect(),
            floods: BTreeMap::new(),
        }
    }

    /// For the memory.
    pub(super) fn to_remember(&self) -> Vec<(AlertPlace, AlertInForce)> {
        let all = self.by_place.iter();
        all.map(|(place, one)| (place.clone(), one.clone()))
            .collect()
    }

    /// What is in force where this alert has its place.
    pub(super) fn at_place_of(&self, alert: &Alert) -> Option<&AlertInForce> {
        self.by_place.get(&place(alert))
    }

    /// All that are in force.
    pub(super) fn all(&self) -> impl Iterator<Item = &AlertInForce> {
        self.by_place.values()
    }

    /// The same, to be noted of each what becomes of it.
    pub(super) fn all_mut(&mut self) -> impl Iterator<Item = &mut AlertInForce> {
        self.by_place.values_mut()
    }

    /// Notes what is in force: a level supersedes the lower ones of its benchmark, and its end
    /// ends them too.
    pub(super) fn stand(&mut self, alert: Alert, is_sent: bool) {
        let had = self.at_place_of(&alert);
        if alert.is_correction() || had.is_some_and(|had| had.alert.level > alert.level) {
            return;
        }
        let was_notified = is_sent || had.is_some_and(|had| had.was_notified);
        match alert.state {
            MessageState::Firing if alert.level != Level::Green => {
                let place = place(&alert);
                let standing = AlertInForce {
                    alert,
                    is_sent,
                    was_notified,
                    is_reported_together: false,
                    attention: Attention::Awaited,
                };
                self.by_place.insert(place, standing);
            }
            MessageState::Firing | MessageState::Resolved => {
                self.by_place.remove(&place(&alert));
            }
            MessageState::Correction => (),
        }
    }

    /// Gives the end of an alert the time that people were given of its call: before the first reading that is the time of
    /// the decision, and the reading that ends it may have been measured earlier.
    pub(super) fn date_end(&self, alert: &mut Alert) {
        let had = self.at_place_of(alert);
        if alert.state == MessageState::Resolved
            && let Some(had) = had.filter(|had| had.alert.key == alert.key)
            && had.alert.event.time > BEFORE_ALL
        {
            let called = had.alert.event.time;
            alert.called = Some(called);
            alert.event.time = alert.event.time.max(called);
        }
    }

    /// Notes the lower levels that it follows on, or that end with it: who received one of these, and no higher one, receives
    /// its end.
    pub(super) fn follow_on(&self, alert: &mut Alert) {
        let Some(AlertInForce { alert: had, .. }) = self.at_place_of(alert) else {
            return;
        };
        let follows = alert.state == MessageState::Firing && had.level < alert.level;
        if follows || had.key == alert.key {
            alert.earlier.clone_from(&had.earlier);
        }
        if follows {
            alert.earlier.push(EarlierLevel {
                benchmark: had.event.benchmark.clone(),
                level: had.level,
                key: had.key.clone(),
            });
        }
    }

    /// Whether it is the end of what people have been notified of.
    pub(super) fn is_waited_for(&self, alert: &Alert) -> bool {
        let had = self.at_place_of(alert);
        alert.state == MessageState::Resolved
            && had.is_some_and(|had| had.was_notified && had.alert.level <= alert.level)
    }

    /// Whether it is the end of what nobody has been notified of.
    pub(super) fn ends_unreported(&self, alert: &Alert) -> bool {
        let had = self.at_place_of(alert);
        alert.state == MessageState::Resolved && had.is_some_and(|had| !had.was_notified)
    }

    /// Notes that an alert of many benchmarks reports this one to a hook too.
    pub(super) fn note_reported_together(&mut self, alert: &Alert) {
        if let Some(standing) = self.by_place.get_mut(&place(alert)) {
            standing.is_reported_together |= standing.alert.key == alert.key;
        }
    }

    /// The level in force at a benchmark before the alerts with the keys `since` were called.
    pub(super) fn level_before(&self, benchmark: &BenchmarkId, since: &[String]) -> Level {
        let standing = self.by_place.get(&(Some(benchmark.clone()), false));
        let Some(AlertInForce { alert, .. }) = standing else {
            return Level::Green;
        };
        if !since.contains(&alert.key) {
            return alert.level;
        }
        let earlier = alert
            .earlier
            .iter()
            .filter(|one| one.benchmark.as_ref() == Some(benchmark) && !since.contains(&one.key));
        earlier.map(|one| one.level).max().unwrap_or(Level::Green)
    }

    /// Notes that hooks are notified of this one, where it stands for many.
    pub(super) fn stand_for_many(&mut self, alert: &Alert) -> Option<&mut StandingFlood> {
        if alert.state != MessageState::Firing || alert.many.is_none() {
            return None;
        }
        let one = StandingFlood {
            alert: alert.clone(),
            is_acknowledged: false,
        };
        Some(self.floods.entry(alert.key.clone()).or_insert(one))
    }

    /// What stands for many.
    pub(super) fn floods(&self) -> impl Iterator<Item = &StandingFlood> {
        self.floods.values()
    }

    /// Somebody has acknowledged those of these that `is_seen`.
    pub(super) fn acknowledge_floods(&mut self, is_seen: impl Fn(&Alert) -> bool) {
        for one in self.floods.values_mut() {
            one.is_acknowledged |= is_seen(&one.alert);
        }
    }

    /// Takes out those that stand for nothing any more, and returns their ends at `time`.
    pub(super) fn end_floods(&mut self, time: Timestamp) -> Vec<Alert> {
        let over = self
            .floods
            .iter()
            .filter(|(_, one)| !self.goes_on(&one.alert));
        let over: Vec<String> = over.map(|(key, _)| key.clone()).collect();
        let taken = over.iter().filter_map(|key| self.floods.remove(key));
        taken.map(|one| flood::end(&one.alert, time)).collect()
    }

    /// Whether one of the alerts that it reports is in force.
    pub(super) fn has_in_force(&self, flood: &Alert) -> bool {
        self.has(flood, |standing, member| standing.key == member.key)
    }

    /// Whether one of these is in force, or a higher level that followed on it.
    fn goes_on(&self, flood: &Alert) -> bool {
        self.has(flood, |standing, member| {
            let mut earlier = standing.earlier.iter();
            standing.key == member.key || earlier.any(|one| one.key == member.key)
        })
    }

    /// The alerts in force that it reports.
    pub(super) fn members_in_force<'a>(
        &'a self,
        flood: &'a Alert,
    ) -> impl Iterator<Item = &'a Alert> {
        let is_unknown = flood.level == Level::Unknown;
        let members = flood.many.iter().flat_map(|many| &many.members);
        members.filter_map(move |member| {
            let place = (member.benchmark.clone(), is_unknown);
            let standing = &self.by_place.get(&place)?.alert;
            (standing.key == member.key).then_some(standing)
        })
    }

    fn has(&self, flood: &Alert, is_it: impl Fn(&Alert, &FloodMember) -> bool) -> bool {
        let is_unknown = flood.level == Level::Unknown;
        let mut members = flood.many.iter().flat_map(|many| &many.members);
        members.any(|member| {
            let place = (member.benchmark.clone(), is_unknown);
            let standing = self.by_place.get(&place);
            standing.is_some_and(|one| is_it(&one.alert, member))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::{AlertState, Event, EventKind};
    use crate::runtime::hook::Status;

    fn alert(level: Level, state: AlertState, key: &str, hour: i64) -> Alert {
        let event = Event {
            time: Timestamp::constant(hour * 3600, 0),
            benchmark: Some(BenchmarkId::new("5")),
            kind: EventKind::Alert {
                level,
                state,
                key: key.to_owned(),
                rule: "velocity".to_owned(),
                text: String::new(),
            },
        };
        Alert::new(&event, "valley", None, Status::Actual).unwrap()
    }

    #[test]
    fn a_higher_level_supersedes_a_lower_one_and_its_end_ends_both() {
        let mut standing = StandingAlerts::default();
        standing.stand(alert(Level::Yellow, AlertState::Firing, "a", 1), true);
        let mut red = alert(Level::Red, AlertState::Firing, "b", 2);
        standing.follow_on(&mut red);
        let earlier: Vec<&str> = red.earlier.iter().map(|one| one.key.as_str()).collect();
        assert_eq!(earlier, ["a"]);
        // People wait for its end although it was not sent: they received the yellow one.
        standing.stand(red, false);
        standing.stand(alert(Level::Yellow, AlertState::Firing, "c", 3), true);
        assert_eq!(standing.all().count(), 1);
        let end = alert(Level::Red, AlertState::Resolved, "b", 4);
        assert!(standing.is_waited_for(&end));
        assert!(!standing.ends_unreported(&end));
        standing.stand(end, true);
        assert_eq!(standing.all().count(), 0);
    }

    #[test]
    fn an_end_is_not_dated_before_what_it_ends() {
        let mut standing = StandingAlerts::default();
        standing.stand(alert(Level::Unknown, AlertState::Firing, "u", 5), true);
        let mut end = alert(Level::Unknown, AlertState::Resolved, "u", 3);
        standing.date_end(&mut end);
        assert_eq!(end.event.time, Timestamp::constant(5 * 3600, 0));
        assert_eq!(end.called, Some(end.event.time));
    }

    #[test]
    fn an_order_is_not_of_the_levels_that_were_called_since() {
        let mut standing = StandingAlerts::default();
        let id = BenchmarkId::new("5");
        assert_eq!(standing.level_before(&id, &[]), Level::Green);
        standing.stand(alert(Level::Orange, AlertState::Firing, "a", 1), true);
        let mut red = alert(Level::Red, AlertState::Firing, "b", 2);
        standing.follow_on(&mut red);
        standing.stand(red, true);
        let since =
            |keys: &[&str]| -> Vec<String> { keys.iter().map(|key| (*key).to_owned()).collect() };
        assert_eq!(standing.level_before(&id, &since(&[])), Level::Red);
        assert_eq!(standing.level_before(&id, &since(&["b"])), Level::Orange);
        assert_eq!(
            standing.level_before(&id, &since(&["a", "b"])),
            Level::Green
        );
    }
}
