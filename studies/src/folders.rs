//! Where files lie.

use std::path::{Path, PathBuf};

/// The folder of the project: documents, recordings and the config are in it.
pub fn project() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.parent().unwrap_or(own).to_path_buf()
}

/// A measured series of that name that may be read here but not redistributed, where the folder of these has it.
pub fn measured(name: &str) -> Option<PathBuf> {
    let file = project().join("../shared/data").join(name);
    file.exists().then_some(file)
}
