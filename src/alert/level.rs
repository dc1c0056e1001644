//! How severe an alert is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How severe an alert is. A threshold or a rule of the site may call yellow, orange and red too.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Nothing to report.
    Green,
    /// Look closer: the chance of collapse within the outlook is `yellow_chance` or more, or that which is reported `orange_chance` or more, the regime turned unstable, a predicted time comes
    /// nearer, or the readings do not follow the law or move upslope.
    Yellow,
    /// Prepare: the chance of collapse within the outlook is `orange_chance` or more, or red is pending: its chance is reached at the newest
    /// reading and not yet in the mean.
    Orange,
    /// Evacuate: the chance of collapse within `red_within` of the next reading is `red_chance` or more, and its mean is high too, or it is far
    /// more at one reading, or red was in force of late. Or the settled velocity is the critical velocity or more.
    Red,
    /// Nothing can be said: no readings, a stuck sensor, readings that cannot be true or hardly mean what was intended, another quantity than
    /// the one that is monitored, or a wrong clock. It stands beside the level in force.
    Unknown,
}

impl Level {
    /// The word in events, config and hooks.
    pub fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Yellow => "yellow",
            Self::Orange => "orange",
            Self::Red => "red",
            Self::Unknown => "unknown",
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
