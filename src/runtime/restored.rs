//! A state that was put back from a backup, and which alerts of it are over.

use super::hook::{Alert, MessageState};
use super::standing::in_force;
use crate::monitor::{EventKind, from_bytes};
use crate::store::{Store, StoreError};
use std::collections::BTreeSet;

/// What is said of it.
pub(super) const TEXT: &str = "the state is a copy that `slipwatch backup` made and that was put back: what ended, or was acknowledged, after it was made is not known; \
     what was in force then is sent to the hooks again";

/// In a state that was put back, has the hooks be sent again what was in force when the copy was made: they may have been sent its end since,
/// and would hold the next call of the same level for known. Whether it was put back.
///
/// # Errors
/// [`StoreError`].
pub(super) fn offer_again(store: &Store) -> Result<bool, StoreError> {
    if !store.is_copy()? {
        return Ok(false);
    }
    let in_force = keys_in_force(store)?;
    store.offer_again(&|body| is_over(body, &in_force))?;
    tracing::warn!("{TEXT}");
    Ok(true)
}

/// The keys of the alerts in force.
///
/// # Errors
/// [`StoreError`].
pub fn keys_in_force(store: &Store) -> Result<BTreeSet<String>, StoreError> {
    let in_force = in_force(store, None)?;
    let keys = in_force.into_values().filter_map(|event| {
        if let EventKind::Alert { key, .. } = event.kind {
            Some(key)
        } else {
            None
        }
    });
    Ok(keys.collect())
}

/// Whether this is the beginning of an alert that is not in force any more, by the keys of those that are.
pub fn is_over(body: &[u8], in_force: &BTreeSet<String>) -> bool {
    let Ok(alert) = from_bytes::<Alert>(body) else {
        return false;
    };
    let stands = match &alert.many {
        Some(many) => (many.members.iter()).any(|one| in_force.contains(&one.key)),
        // One of an older version does not say what it reports.
        None => alert.is_flood() || in_force.contains(&alert.key),
    };
    alert.state == MessageState::Firing && !stands
}
