//! What each hook is to receive of the alerts that come: an end goes to those who received the beginning.

use super::at_once::{has_begun_in, is_over_by};
use super::{Dispatcher, HookQueue, HookShare, locked, without_reported};
use crate::runtime::hook::{Alert, MessageState};

impl Dispatcher {
    /// What each hook is to receive of `alerts`.
    pub fn shares(&self, alerts: &[Alert]) -> Vec<HookShare> {
        let each = self.hooks.iter().enumerate();
        each.map(|(place, way)| {
            let (mut own, mut unreported) = (Vec::new(), Vec::new());
            for (number, alert) in alerts.iter().enumerate() {
                let share = if is_over_by(alert, &alerts[number..]) {
                    None
                } else if has_begun_in(alert, &alerts[..number]) {
                    self.end_of_earlier(way, alert)
                } else {
                    self.share(way, alert)
                };
                if let Some(share) = share {
                    own.push(share);
                } else if way.hook.asks_for(alert) {
                    unreported.push(alert.clone());
                }
            }
            let (alerts, mut reported) = without_reported(own);
            reported.append(&mut unreported);
            HookShare {
                place,
                name: way.hook.name(),
                audience: way.hook.benchmarks.clone(),
                alerts,
                reported,
            }
        })
        .collect()
    }

    /// What a hook is to receive where `alert` has come. An end goes to those who received the beginning: where that was one of
    /// a lower level, by its own key. Where neither was sent because it waited, or was called off, the end is not either.
    fn share(&self, way: &HookQueue, alert: &Alert) -> Option<Alert> {
        let asks = way.hook.asks_for(alert);
        if alert.state != MessageState::Resolved {
            return asks.then(|| alert.clone());
        }
        let is_its_own = asks && (!alert.is_flood() || way.hook.is_audience_of(alert));
        // Also where the config asks for less than when it began.
        let beginning = alert.beginning();
        let knows = is_its_own && self.has_received(way, &beginning)
            || !alert.is_flood() && self.was_notified(way, &beginning);
        if knows {
            return Some(alert.clone());
        }
        // What stood for many was called off when nothing of it was in force any more.
        if alert.is_flood() {
            return None;
        }
        self.end_of_earlier(way, alert).or_else(|| {
            let is_due = is_its_own && !self.is_unsent(way, &alert.beginning());
            is_due.then(|| alert.clone())
        })
    }

    /// With the end of `alert` that of the lower level which the hook has received the beginning of.
    fn end_of_earlier(&self, way: &HookQueue, alert: &Alert) -> Option<Alert> {
        let mut ends = alert
            .earlier
            .iter()
            .rev()
            .map(|one| alert.end_of(one.benchmark.as_ref(), one.level, &one.key));
        ends.find(|end| {
            let beginning = end.beginning();
            let asks = way.hook.asks_for(end);
            asks && self.has_received(way, &beginning) || self.was_notified(way, &beginning)
        })
    }

    /// Whether this one, which the hook has not been run for, waited or was called off.
    fn is_unsent(&self, way: &HookQueue, alert: &Alert) -> bool {
        let delivered = locked(&self.delivered);
        way.hook.may_wait() || delivered.is_called_off(alert, &way.hook.name())
    }

    /// Whether a hook has been run for this alert, whatever came of it.
    pub(super) fn has_received(&self, way: &HookQueue, alert: &Alert) -> bool {
        let name = way.hook.name();
        let was_tried = locked(&way.queued).was_tried(alert);
        let delivered = locked(&self.delivered);
        was_tried || delivered.was_notified(alert, &name) || delivered.attempts(alert, &name) > 0
    }

    /// Whether a hook has taken this alert.
    fn was_notified(&self, way: &HookQueue, alert: &Alert) -> bool {
        locked(&self.delivered).was_notified(alert, &way.hook.name())
    }
}
