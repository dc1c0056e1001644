//! Measured series that may be read here but not redistributed. A test of them is ignored where `build.rs` has not
//! found their folder.

use std::path::PathBuf;

/// The file of that name.
///
/// # Panics
///
/// Where it is not there.
pub(crate) fn measured(name: &str) -> PathBuf {
    studies::measured(name).unwrap_or_else(|| panic!("{name} is not among the measured series"))
}
