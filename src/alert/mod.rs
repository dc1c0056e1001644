//! Alert policy: from chances of failure and plain thresholds to levels that rise at once and fall slowly.
//!
//! This module never sees a parameter of the law, only chances and observed motion.

mod advice;
mod chance;
mod declared;
mod evidence;
mod held;
mod latch;
mod level;
mod policy;
mod rules;

pub use chance::{chance_in_words, percent_in_words, span_in_words};
pub use declared::{Combination, Condition, DeclaredRule};
pub use evidence::{AlertCause, AlertEvidence, RedCourse};
pub use held::Held;
pub(crate) use latch::another_since;
pub use latch::{Entered, Latch, Transition};
pub use level::Level;
pub use policy::{Policy, Threshold, to_the_next_reading};
pub use rules::{Call, REPORTED_CHANCE, is_observed};
