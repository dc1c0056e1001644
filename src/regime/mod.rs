//! Which regime the slope is in, with what probability, and when it flipped.

mod tracker;

pub use tracker::{Flip, Tracker, label, leader};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The regimes of the law, read from the signs of r and kappa.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Regime {
    /// Accelerates to failure in finite time (kappa > 0, r > 0).
    UnstableAccelerating,
    /// Accelerates, then saturates (kappa < 0, r > 0).
    StableAccelerating,
    /// Slows down for ever (kappa > 0, r < 0).
    UnstableDecelerating,
    /// Slows down to a constant velocity (kappa < 0, r < 0).
    StableDecelerating,
    /// The readings do not decide.
    Undetermined,
}

impl Regime {
    /// The four regimes that the law knows.
    pub const KNOWN: [Self; 4] = [
        Self::UnstableAccelerating,
        Self::StableAccelerating,
        Self::UnstableDecelerating,
        Self::StableDecelerating,
    ];

    /// The label used in output.
    pub fn label(self) -> &'static str {
        match self {
            Self::UnstableAccelerating => "unstable-accelerating",
            Self::StableAccelerating => "stable-accelerating",
            Self::UnstableDecelerating => "unstable-decelerating",
            Self::StableDecelerating => "stable-decelerating",
            Self::Undetermined => "undetermined",
        }
    }
}

impl fmt::Display for Regime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.label())
    }
}
