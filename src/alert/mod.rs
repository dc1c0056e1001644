//! Alert policy: from chances of failure and plain thresholds to levels that rise at once and fall slowly.
//!
//! This module never sees a parameter of the law, only chances and observed motion.

mod advice;
mod declared;
mod latch;
mod policy;
mod rules;

pub use declared::{Combination, Condition, DeclaredRule, Held};
pub use latch::{Entered, Latch, Transition};
pub use policy::{Level, Policy, Threshold};
pub use rules::{Call, Cause, Evidence};
