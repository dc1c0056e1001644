//! The exit codes, and the words that go with them to stderr.

use std::fmt::Display;
use std::io::Write;

/// The job found trouble.
pub(super) const TROUBLE: u8 = 1;
/// Input or output failed.
pub(super) const IO: u8 = 74;
/// The config is wrong.
pub(super) const CONFIG: u8 = 78;

/// Writes a line to stderr; nobody can be told when that fails.
pub(super) fn complain(what: &dyn Display) {
    let _ = writeln!(std::io::stderr(), "{what}");
}
