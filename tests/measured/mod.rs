//! Finds measured series that may be read here but not redistributed.
#![allow(clippy::print_stdout, reason = "a skipped test must say so")]

use std::path::{Path, PathBuf};

/// The file of that name, where the folder of measured data exists; otherwise says so.
pub(crate) fn measured(name: &str) -> Option<PathBuf> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data")
        .join(name);
    if file.exists() {
        return Some(file);
    }
    println!("skipped: no measured data ({name})");
    None
}
