//! How grave an alert is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How grave an alert is.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Nothing to report.
    Green,
    /// Something has changed: look.
    Yellow,
    /// Failure is more likely than not within the outlook.
    Orange,
    /// Failure before an evacuation would have ended is too likely.
    Red,
    /// The monitor cannot decide: no data, a sensor fault, a stale model.
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
