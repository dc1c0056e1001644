//! Who gave an order, when, why and by which way: the audit trail of what people did.

use crate::reading::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Who gave an order, and how.
#[derive(Debug, Clone, Default, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
pub struct Given {
    /// Who.
    #[serde(default)]
    pub by: Option<String>,
    /// Why.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub why: Option<String>,
    /// By which way.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub door: Option<OrderedBy>,
    /// When, by the host's clock.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub given_at: Option<Timestamp>,
    /// Keys of alerts that were called after it was given and before it was taken: whoever gave it had not seen them, and it is
    /// not of them.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub called_since: Vec<String>,
}

/// The way by which an order came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderedBy {
    /// `slipwatch alerts`, on the machine itself.
    CommandLine,
    /// The page, or another caller of the HTTP API.
    Http,
    /// The signed link in the alert's own message.
    Link,
}

impl OrderedBy {
    /// The word for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::CommandLine => "the command line",
            Self::Http => "HTTP",
            Self::Link => "the link in its message",
        }
    }
}

/// What an order asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderKind {
    /// It has been seen.
    Acknowledge,
    /// One level of a benchmark is not reported for a time.
    Shelve,
    /// Nothing is reported for a time.
    Silence,
    /// The level in force is over.
    Resolve,
    /// All is reported again.
    Unsilence,
}

impl OrderKind {
    /// The word in its JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Acknowledge => "acknowledge",
            Self::Shelve => "shelve",
            Self::Silence => "silence",
            Self::Resolve => "resolve",
            Self::Unsilence => "unsilence",
        }
    }
}
