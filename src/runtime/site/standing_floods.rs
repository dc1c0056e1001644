//! What was reported together stands by one key until all of it is over, and its end goes to those who received its beginning.

use super::{BEFORE_ALL, Site};
use crate::monitor::from_bytes;
use crate::reading::Timestamp;
use crate::runtime::hook::{Alert, FLOOD};
use crate::store::{DeliveryOutcome, Store, StoreError};

impl Site {
    /// What stood for many when the state was written.
    pub(super) fn recall_floods(&mut self, store: &Store) -> Result<(), StoreError> {
        for body in store.without_end(&format!("{FLOOD}/"))? {
            let Ok(alert) = from_bytes::<Alert>(&body) else {
                tracing::error!("an alert of many benchmarks cannot be read");
                continue;
            };
            let seen = Some(DeliveryOutcome::Acknowledged);
            if let Some(one) = self.standing.stand_for_many(&alert) {
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
        if let Some(alerts) = &self.sinks.alerts {
            for one in self.standing.floods() {
                if !self.standing.has_in_force(&one.alert) {
                    alerts.stop_trying(&one.alert);
                }
            }
        }
        self.standing.end_floods(time)
    }

    /// Somebody has seen everything but the alerts with the keys `since`.
    pub(super) fn acknowledge_floods(&mut self, since: &[String]) {
        let is_seen = |flood: &Alert| {
            let mut members = flood.many.iter().flat_map(|many| &many.members);
            !members.any(|member| since.contains(&member.key))
        };
        self.standing.acknowledge_floods(is_seen);
        if let Some(alerts) = &self.sinks.alerts {
            alerts.end_those_of_many(&is_seen);
        }
    }

    /// Somebody has everything silenced.
    pub(super) fn spare_floods(&self) {
        if let Some(alerts) = &self.sinks.alerts {
            (self.standing.floods()).for_each(|one| alerts.spare(&one.alert));
        }
    }

    /// Offers those again that are in force: a hook may have been added, or have had no room.
    pub(super) fn offer_floods_again(&self, host_time: Timestamp) {
        let Some(alerts) = &self.sinks.alerts else {
            return;
        };
        for one in self.standing.floods() {
            let alert = &one.alert;
            let is_due =
                alert.must_arrive() && !one.is_acknowledged && self.standing.has_in_force(alert);
            if is_due && !self.mutes.are_of(alert, host_time) {
                alerts.offer_where(alert, false, &|hook| hook.is_audience_of(alert));
            }
        }
    }
}
