//! Which alerts have reached which hook: as it stands in the state, and what found no room there yet.

use super::clock;
use super::hook::{Alert, state_name};
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
    /// What came to its end while this program ran: taken, or acknowledged in time.
    ended: BTreeMap<DeliveredKey, DeliveryOutcome>,
    unwritten: Vec<(Delivery, DeliveryOutcome)>,
    store: Option<Arc<Store>>,
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

impl Delivered {
    /// The receipts in `store`.
    pub fn of(store: Arc<Store>) -> Self {
        Self {
            store: Some(store),
            ..Self::default()
        }
    }

    /// Whether `hook` has taken this alert, or is not to get it because somebody acknowledged it in time.
    pub fn has(&self, alert: &Alert, hook: &str) -> bool {
        self.was_notified(alert, hook) || self.stands(alert, hook, DeliveryOutcome::Acknowledged)
    }

    /// Whether `hook` has taken this alert.
    pub(super) fn was_notified(&self, alert: &Alert, hook: &str) -> bool {
        self.stands(alert, hook, DeliveryOutcome::Delivered)
    }

    /// When `hook` was first to get this alert, by the host's clock; `None` where no state says it.
    pub(super) fn noted(&self, alert: &Alert, hook: &str) -> Option<Timestamp> {
        let identity = (
            alert.key.as_str(),
            alert.level.name(),
            state_name(alert.state),
        );
        self.store.as_ref()?.noted(identity, hook).ok()?
    }

    /// Whether this alert has come to this end at `hook`.
    fn stands(&self, alert: &Alert, hook: &str, fate: DeliveryOutcome) -> bool {
        let (level, state) = (alert.level.name(), state_name(alert.state));
        let receipt = (alert.key.clone(), level, state, hook.to_owned());
        if let Some(ended) = self.ended.get(&receipt) {
            return *ended == fate;
        }
        let stored = self
            .store
            .as_ref()
            .map(|store| store.is_noted((&alert.key, level, state), Some(hook), Some(fate)));
        // Twice is better than never.
        stored.is_some_and(|stored| stored.unwrap_or(false))
    }

    /// How often `hook` has been tried with this alert before this program ran.
    pub(super) fn attempts(&self, alert: &Alert, hook: &str) -> u32 {
        let identity = (
            alert.key.as_str(),
            alert.level.name(),
            state_name(alert.state),
        );
        let stored = (self.store.as_ref()).map(|store| store.attempts(identity, hook));
        // It only numbers the attempts, and bounds them for what need not arrive.
        stored.map_or(0, |stored| stored.unwrap_or(0))
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
        fate: DeliveryOutcome,
    ) -> Result<(), StoreError> {
        if matches!(
            fate,
            DeliveryOutcome::Delivered | DeliveryOutcome::Acknowledged
        ) {
            let (level, state) = (alert.level.name(), state_name(alert.state));
            self.ended
                .insert((alert.key.clone(), level, state, hook.to_owned()), fate);
        }
        if self.store.is_some() && self.unwritten.len() < MOST_UNWRITTEN {
            self.unwritten.push((delivery(alert, hook)?, fate));
        }
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
}
