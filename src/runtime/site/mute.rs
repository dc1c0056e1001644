//! Who asked not to be told, of what, until when.

use super::Site;
use crate::alert::Level;
use crate::monitor::Order;
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::hook::Alert;
use serde::{Deserialize, Serialize};

/// Orders in force at most; the oldest goes.
const MOST: usize = 256;

/// Alerts that are not told for a time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Mute {
    /// `None`: of the whole site.
    benchmark: Option<BenchmarkId>,
    /// Nothing above it is muted; `None`: everything is.
    up_to: Option<Level>,
    until: Timestamp,
}

impl Site {
    /// Does what people ask for, as far as it concerns who is told.
    pub(super) fn obey(&mut self, order: &Order) {
        match order {
            Order::Acknowledge { benchmark, .. } => {
                let seen = self
                    .standing
                    .iter_mut()
                    .filter(|((place, _), _)| benchmark.is_none() || place == benchmark);
                for (_, one) in seen {
                    (one.is_sent, one.was_told) = (true, true);
                    if let Some(alerts) = &self.sinks.alerts {
                        alerts.end(&one.alert);
                    }
                }
            }
            Order::Shelve { benchmark, until } => {
                let level = self.monitor.level(benchmark).unwrap_or(Level::Green);
                self.mute(Some(benchmark.clone()), Some(level), *until);
            }
            Order::Silence { benchmark, until } => self.mute(benchmark.clone(), None, *until),
        }
    }

    fn mute(&mut self, benchmark: Option<BenchmarkId>, up_to: Option<Level>, until: Timestamp) {
        self.mutes.push(Mute {
            benchmark,
            up_to,
            until,
        });
        let excess = self.mutes.len().saturating_sub(MOST);
        self.mutes.drain(..excess);
    }

    /// Whether nobody is to be told of this alert at `wall`.
    pub(super) fn is_muted(&self, alert: &Alert, wall: Timestamp) -> bool {
        self.mutes.iter().any(|mute| {
            let here = mute.benchmark.is_none() || mute.benchmark == alert.event.benchmark;
            let low = mute.up_to.is_none_or(|up_to| alert.level <= up_to);
            here && low && wall < mute.until
        })
    }
}
