//! What an alert says of others: those whose levels it ended, and those that it reports together.

use crate::alert::Level;
use crate::reading::BenchmarkId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// A lower level of the same benchmark that a higher one followed on before it had ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EarlierLevel {
    /// Where; `None`: the whole site.
    pub benchmark: Option<BenchmarkId>,
    /// Which level.
    pub level: Level,
    /// Its alert's key.
    pub key: String,
}

/// One of the alerts that are reported together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FloodMember {
    /// Where.
    pub benchmark: Option<BenchmarkId>,
    /// Its own key.
    pub key: String,
}

/// Of what one message reports of many benchmarks.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManyAlerts {
    /// The benchmarks of the hooks that it is made for; empty: of hooks that ask for all.
    pub audience: BTreeSet<BenchmarkId>,
    /// Each alert that it reports.
    pub members: Vec<FloodMember>,
}
