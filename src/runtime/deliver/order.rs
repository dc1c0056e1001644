//! Which of the alerts that wait for a hook goes first, and which of them go one after the other.

use crate::alert::Level;
use crate::reading::BenchmarkId;
use crate::runtime::hook::{Alert, MessageState};

/// How severe it is: of two that are due the higher goes first.
pub(super) fn severity(alert: &Alert) -> u8 {
    match (alert.level, alert.state) {
        (Level::Red, MessageState::Firing) => 5,
        (Level::Orange, MessageState::Firing) => 4,
        (Level::Unknown, MessageState::Firing) => 3,
        (
            Level::Red | Level::Orange | Level::Unknown,
            MessageState::Resolved | MessageState::Correction,
        ) => 2,
        (Level::Yellow, _) => 1,
        (Level::Green, _) => 0,
    }
}

/// Whether people may have to leave their houses.
pub(super) fn is_severe(alert: &Alert) -> bool {
    severity(alert) >= 4
}

/// Whether red is called.
pub(super) fn is_red(alert: &Alert) -> bool {
    severity(alert) >= 5
}

/// What is reported by one run at a time, so that its order stays.
pub(super) fn place(alert: &Alert) -> Option<&BenchmarkId> {
    alert.event.benchmark.as_ref()
}
