//! Which alerts have reached which hook: as it stands in the state, and what found no room there yet.

use super::clock;
use super::hook::{Alert, state_name};
use super::service_faults::{FaultPlace, ServiceFaults};
use crate::store::{Delivery, DeliveryOutcome, Store, StoreError};
use jiff::Timestamp;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Receipts that may wait for room on the disk.
const MOST_UNWRITTEN: usize = 20_000;

/// Key, level, state and hook.
type DeliveredKey = (String, &'static str, &'static str, String);

/// The receipts of all hooks: in the state or, for a replay, only in memory.
#[derive(Debug, Default)]
pub struct Delivered {
    /// What came to its end while this program ran: taken, called off by people, or over.
    ended: BTreeMap<DeliveredKey, DeliveryOutcome>,
    unwritten: Vec<(Delivery, DeliveryOutcome)>,
    store: Option<Arc<Store>>,
    /// Whether the last ones could not be made durable, and that has been logged.
    are_unwritten_logged: bool,
    /// Where hooks that do not take their alerts are reported.
    faults: ServiceFaults,
}

/// The alert as the outbox keeps it for a hook.
///
/// # Errors
/// [`StoreError::Unreadable`] when it cannot be written as bytes.
pub(super) fn delivery(alert: &Alert, hook: &str) -> Result<Delivery, StoreError> {
    let body = rmp_serde::to_vec_named(alert);
    Ok(Delivery {
        key: alert.key.clone(),
        level: alert.level.name().to_owned(),
        state: state_name(alert.state).to_owned(),
        hook: hook.to_owned(),
        time: alert.event.time,
        noted: clock::now(),
        body: body.map_err(|error| StoreError::Unreadable(error.to_string()))?,
    })
}

fn delivered_key(alert: &Alert, hook: &str) -> DeliveredKey {
    let (level, state) = (alert.level.name(), state_name(alert.state));
    (alert.key.clone(), level, state, hook.to_owned())
}

impl Delivered {
    /// The receipts in `store`.
    pub fn of(store: Arc<Store>) -> Self {
        Self {
            store: Some(store),
            ..Self::default()
        }
    }

    /// The same, and hooks that do not take their alerts stand in `faults`.
    #[must_use]
    pub fn reporting(self, faults: &ServiceFaults) -> Self {
        Self {
            faults: faults.clone(),
            ..self
        }
    }

    /// `hook` has not taken `alert`; `how` says after how many attempts, and why.
    pub(super) fn fails(&self, hook: &str, alert: &Alert, how: &str) {
        let (level, state) = (alert.level.name(), state_name(alert.state));
        let place = alert.event.benchmark.as_ref();
        let place = place.map_or("the site".to_owned(), ToString::to_string);
        let text = format!("{level} ({state}) of {place} was not taken by {how}");
        self.faults.begin_fault(FaultPlace::of_hook(hook), &text);
    }

    /// `hook` takes what it gets.
    pub(super) fn fails_no_more(&self, hook: &str) {
        self.faults.end_fault(&FaultPlace::of_hook(hook));
    }

    /// Whether nothing more is to be tried with this alert at `hook`: it has taken it, somebody acknowledged or silenced it
    /// in time, or it was over before.
    pub fn has(&self, alert: &Alert, hook: &str) -> bool {
        matches!(
            self.outcome(alert, hook),
            Some(
                DeliveryOutcome::Delivered
                    | DeliveryOutcome::Acknowledged
                    | DeliveryOutcome::Silenced
                    | DeliveryOutcome::Over
            )
        )
    }

    /// Whether `hook` has taken this alert.
    pub(super) fn was_notified(&self, alert: &Alert, hook: &str) -> bool {
        self.outcome(alert, hook) == Some(DeliveryOutcome::Delivered)
    }

    /// Whether `hook` is not to get this alert because people see to it already.
    pub(super) fn is_called_off(&self, alert: &Alert, hook: &str) -> bool {
        matches!(
            self.outcome(alert, hook),
            Some(DeliveryOutcome::Acknowledged | DeliveryOutcome::Silenced)
        )
    }

    /// When `hook` was first to get this alert, by the host's clock; `None` where no state says it.
    pub(super) fn noted(&self, alert: &Alert, hook: &str) -> Option<Timestamp> {
        self.store.as_ref()?.noted(alert.identity(), hook).ok()?
    }

    /// What has become of this alert at `hook`; `None` where nothing says it.
    fn outcome(&self, alert: &Alert, hook: &str) -> Option<DeliveryOutcome> {
        if let Some(ended) = self.ended.get(&delivered_key(alert, hook)) {
            return Some(*ended);
        }
        let store = self.store.as_ref()?;
        // Twice is better than never.
        let stored = store.outcome_of(alert.identity(), hook);
        stored.unwrap_or(None)
    }

    /// How often `hook` has been tried with this alert before this program ran.
    pub(super) fn attempts(&self, alert: &Alert, hook: &str) -> u32 {
        let stored = self.store.as_ref();
        let stored = stored.map(|store| store.attempts(alert.identity(), hook));
        // It only numbers the attempts, and bounds them for what need not arrive.
        stored.map_or(0, |stored| stored.unwrap_or(0))
    }

    /// Notes what became of this alert at `hook`, to be made durable with many others by [`Delivered::commit`].
    ///
    /// # Errors
    /// When it cannot be written as bytes.
    pub(super) fn record_outcome(
        &mut self,
        alert: &Alert,
        hook: &str,
        outcome: DeliveryOutcome,
    ) -> Result<(), StoreError> {
        let receipt = delivered_key(alert, hook);
        match outcome {
            DeliveryOutcome::Delivered
            | DeliveryOutcome::Acknowledged
            | DeliveryOutcome::Silenced => {
                self.ended.insert(receipt, outcome);
            }
            DeliveryOutcome::Over => {
                self.ended.entry(receipt).or_insert(outcome);
            }
            DeliveryOutcome::Waiting | DeliveryOutcome::Dead | DeliveryOutcome::Closed => {}
        }
        if self.store.is_some() && self.unwritten.len() < MOST_UNWRITTEN {
            self.unwritten.push((delivery(alert, hook)?, outcome));
        }
        Ok(())
    }

    /// Notes what became of this alert at `hook`: in any case until the daemon stops, and on a full disk no longer
    /// than that unless [`Delivered::commit`] finds room.
    ///
    /// # Errors
    /// When that cannot be made durable; the alert may then be sent once more, after a restart, with the same key.
    pub fn note(
        &mut self,
        alert: &Alert,
        hook: &str,
        outcome: DeliveryOutcome,
    ) -> Result<(), StoreError> {
        self.record_outcome(alert, hook, outcome)?;
        self.commit()
    }

    /// Makes durable what found no room before.
    ///
    /// # Errors
    /// When that fails.
    pub fn commit(&mut self) -> Result<(), StoreError> {
        if let Some(store) = &self.store
            && !self.unwritten.is_empty()
        {
            store.record_outcomes(&self.unwritten)?;
            self.unwritten.clear();
        }
        Ok(())
    }

    /// As [`Delivered::commit`]; that it cannot be done is logged, once until it can again.
    pub fn commit_or_log(&mut self) {
        match self.commit() {
            Ok(()) if self.are_unwritten_logged => {
                tracing::info!("the receipts of alerts are kept again");
                self.are_unwritten_logged = false;
            }
            Ok(()) => {}
            Err(_) if self.are_unwritten_logged => {}
            Err(error) => {
                tracing::warn!(%error, "the receipts of alerts cannot be kept: a restart may send their alerts again");
                self.are_unwritten_logged = true;
            }
        }
    }
}
