//! Alerts that come together: which of them begins and ends among them.

use crate::alert::Level;
use crate::runtime::hook::{Alert, MessageState};

/// Whether `alert` is the beginning of a level that one of those that come together with it, and after it, ends.
pub(super) fn is_over_by(alert: &Alert, later: &[Alert]) -> bool {
    let ends = |end: &Alert| {
        end.state == MessageState::Resolved
            && !end.is_flood()
            && end.event.benchmark == alert.event.benchmark
            && (end.level == Level::Unknown) == (alert.level == Level::Unknown)
            && end.level >= alert.level
    };
    alert.state == MessageState::Firing && !alert.is_flood() && later.iter().any(ends)
}

/// Whether `alert` is the end of one of those that come together with it, and before it.
pub(super) fn has_begun_in(alert: &Alert, earlier: &[Alert]) -> bool {
    let begins = |one: &Alert| {
        one.state == MessageState::Firing && one.key == alert.key && one.level == alert.level
    };
    alert.state == MessageState::Resolved && earlier.iter().any(begins)
}
