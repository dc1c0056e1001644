//! Where files lie.

use std::path::{Path, PathBuf};

/// The folder of the project: documents, recordings and the config are in it.
pub fn project() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.parent().unwrap_or(own).to_path_buf()
}

/// A measured series of that name that may be read here but not redistributed, where the folder of these has it: the one that
/// `SLIPWATCH_MEASURED`, an absolute path, named when this was compiled, or else the one beside the project.
pub fn measured(name: &str) -> Option<PathBuf> {
    let folder = option_env!("SLIPWATCH_MEASURED");
    let folder = folder.map_or_else(|| project().join("../shared/data"), PathBuf::from);
    let file = folder.join(name);
    file.exists().then_some(file)
}
