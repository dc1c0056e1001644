//! What a message says of a level, and whether it means it: the words for both.

use crate::monitor::AlertState;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The state of a message that corrects what was called, and what stands in its key for a level.
pub(super) const CORRECTION: &str = "correction";

/// Whether a message means what it says; CAP 1.2's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
pub enum Status {
    /// The daemon's own.
    Actual,
    /// From a replay or a drill.
    Exercise,
    /// From `hook test`.
    Test,
}

impl Status {
    /// The word in `SLIPWATCH_STATUS`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Actual => "Actual",
            Self::Exercise => "Exercise",
            Self::Test => "Test",
        }
    }

    /// `text` as it is, or marked as part of an exercise or a test: whoever reads this line alone is to know whether it is meant.
    pub(in crate::runtime) fn marked(self, text: &str) -> String {
        match self {
            Self::Actual => text.to_owned(),
            Self::Exercise => format!("EXERCISE, do not act on this: {text}"),
            Self::Test => format!("TEST, do not act on this: {text}"),
        }
    }
}

/// What a message says of a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MessageState {
    /// It is in force.
    Firing,
    /// It has ended.
    Resolved,
    /// With readings that came late, or were corrected, it would have been called in the past; what is in force stays so.
    Correction,
}

impl From<AlertState> for MessageState {
    fn from(state: AlertState) -> Self {
        match state {
            AlertState::Firing => Self::Firing,
            AlertState::Resolved => Self::Resolved,
        }
    }
}

/// The word in `SLIPWATCH_STATE`.
pub(crate) fn state_name(state: MessageState) -> &'static str {
    match state {
        MessageState::Firing => "firing",
        MessageState::Resolved => "resolved",
        MessageState::Correction => CORRECTION,
    }
}
