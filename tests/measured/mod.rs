//! Finds measured series that may be read here but not redistributed.

use std::path::{Path, PathBuf};

/// The file of that name, where the folder of measured data has it.
pub(crate) fn measured(name: &str) -> Option<PathBuf> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data")
        .join(name);
    file.exists().then_some(file)
}
