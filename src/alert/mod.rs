//! Alert policy: from chances of failure and plain thresholds to levels that rise at once and fall slowly.
//!
//! This module never sees a parameter of the law, only chances and observed motion.

mod policy;

pub use policy::{Level, Policy, Threshold};
