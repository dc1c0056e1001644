//! An order by which nobody is notified of some alerts for a time: never for longer than it may last, whatever the clock says.

use super::clock::TOLERANCE;
use super::standing::lasts;
use crate::alert::Level;
use crate::monitor::Order;
use crate::reading::{BenchmarkId, Timestamp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Alerts of which nobody is notified for a time.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
pub struct Mute {
    /// `None`: of the whole site.
    pub benchmark: Option<BenchmarkId>,
    /// Nothing above it is muted; `None`: everything is.
    pub up_to: Option<Level>,
    /// Its end, by the host's clock.
    pub until: Timestamp,
    /// When it was given, by the host's clock; `None` where an older version took it.
    #[serde(default)]
    pub given_at: Option<Timestamp>,
}

impl Mute {
    /// Whether it is in force while the host's clock says `host_time`, by which it was given, right or wrong. Of one that would last
    /// longer than it may, that clock has been set since.
    pub(super) fn is_in_force(&self, host_time: Timestamp) -> bool {
        let longest = match self.up_to {
            Some(_) => Order::LONGEST_SHELVE,
            None => Order::LONGEST_SILENCE,
        };
        let left = self.until.duration_since(host_time);
        left <= longest + TOLERANCE && lasts((self.given_at, self.until), host_time)
    }
}
