//! What was reported together stands by one key until all of it is over, and its end goes to those who received its beginning.

use super::{BEFORE_ALL, Site, flood};
use crate::alert::Level;
use crate::reading::Timestamp;
use crate::runtime::hook::{Alert, FLOOD, MessageState};
use crate::runtime::many::FloodMember;
use crate::store::{DeliveryOutcome, Store, StoreError};

/// One that has not ended.
#[derive(Debug, Clone)]
pub(super) struct StandingFlood {
    /// Its beginning.
    alert: Alert,
    /// Whether somebody has acknowledged everything since.
    is_acknowledged: bool,
}

impl Site {
    /// Notes that hooks are notified of this one, where it stands for many.
    pub(super) fn stand_for_many(&mut self, alert: &Alert) {
        if alert.state == MessageState::Firing && alert.many.is_some() {
            let one = StandingFlood {
                alert: alert.clone(),
                is_acknowledged: false,
            };
            self.floods.entry(alert.key.clone()).or_insert(one);
        }
    }

    /// What stood for many when the state was written.
    pub(super) fn recall_floods(&mut self, store: &Store) -> Result<(), StoreError> {
        for body in store.without_end(&format!("{FLOOD}/"))? {
            let Ok(alert) = rmp_serde::from_slice::<Alert>(&body) else {
                tracing::error!("an alert of many benchmarks cannot be read");
                continue;
            };
            self.stand_for_many(&alert);
            let seen = Some(DeliveryOutcome::Acknowledged);
            if let Some(one) = self.floods.get_mut(&alert.key) {
                one.is_acknowledged = store.is_noted(alert.identity(), None, seen)?;
            }
        }
        Ok(())
    }

    /// The ends of those that stand for nothing any more. One whose levels are all superseded by higher ones is not tried any
    /// more, and ends with these.
    pub(super) fn ended_floods(&mut self, now: Timestamp) -> Vec<Alert> {
        let time = self.data_now();
        let time = if time > BEFORE_ALL { time } else { now };
        let mut ended = Vec::new();
        for (key, one) in &self.floods {
            if !self.has_in_force(&one.alert)
                && let Some(alerts) = &self.sinks.alerts
            {
                alerts.is_over(&one.alert);
            }
            if !self.goes_on(&one.alert) {
                ended.push((key.clone(), flood::end(&one.alert, time)));
            }
        }
        let ends = ended.into_iter().map(|(key, end)| {
            self.floods.remove(&key);
            end
        });
        ends.collect()
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
            let standing = &self.standing.get(&place)?.alert;
            (standing.key == member.key).then_some(standing)
        })
    }

    fn has(&self, flood: &Alert, is_it: impl Fn(&Alert, &FloodMember) -> bool) -> bool {
        let is_unknown = flood.level == Level::Unknown;
        let mut members = flood.many.iter().flat_map(|many| &many.members);
        members.any(|member| {
            let place = (member.benchmark.clone(), is_unknown);
            let standing = self.standing.get(&place);
            standing.is_some_and(|one| is_it(&one.alert, member))
        })
    }

    /// Somebody has seen everything but the alerts with the keys `since`.
    pub(super) fn acknowledge_floods(&mut self, since: &[String]) {
        let is_seen = |flood: &Alert| {
            let mut members = flood.many.iter().flat_map(|many| &many.members);
            !members.any(|member| since.contains(&member.key))
        };
        for one in self.floods.values_mut() {
            one.is_acknowledged |= is_seen(&one.alert);
        }
        if let Some(alerts) = &self.sinks.alerts {
            alerts.end_those_of_many(&is_seen);
        }
    }

    /// Somebody has everything silenced.
    pub(super) fn spare_floods(&self) {
        if let Some(alerts) = &self.sinks.alerts {
            (self.floods.values()).for_each(|one| alerts.spare(&one.alert));
        }
    }

    /// Offers those again that are in force: a hook may have been added, or have had no room.
    pub(super) fn offer_floods_again(&self, wall: Timestamp) {
        let Some(alerts) = &self.sinks.alerts else {
            return;
        };
        for one in self.floods.values() {
            let alert = &one.alert;
            let is_due = alert.must_arrive() && !one.is_acknowledged && self.has_in_force(alert);
            if is_due && !self.is_muted(alert, wall) {
                alerts.offer_where(alert, false, &|hook| hook.is_audience_of(alert));
            }
        }
    }
}
