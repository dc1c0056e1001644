//! What the outbox knows an alert by.

use slipwatch::store::AlertIdentity;

/// The beginning of the red with this key.
pub(crate) fn red_fires(key: &str) -> AlertIdentity<'_> {
    AlertIdentity {
        key,
        level: "red",
        state: "firing",
    }
}
