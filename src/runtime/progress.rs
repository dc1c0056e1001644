//! How far the daemon has come, for whoever runs it in this process.

use super::site::Counts;

/// How far the daemon has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// What has been counted.
    pub counts: Counts,
    /// Whether the past has been read.
    pub is_caught_up: bool,
}
