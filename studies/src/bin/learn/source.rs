//! The files that are written: what was learnt, and documents.

use anyhow::Context;
use slipwatch::forecast::Network;
use std::path::{Path, PathBuf};
use studies::Family;

const LEARNED: &str = "src/forecast/learned.txt";

/// Writes src/forecast/learned.txt.
pub(crate) fn write(network: &Network) -> anyhow::Result<()> {
    document(LEARNED, &network.text())
}

/// The network that src/forecast/learned.txt holds.
pub(crate) fn in_force() -> anyhow::Result<Network> {
    let file = at(LEARNED);
    let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    Ok(Network::from_text(&text))
}

/// Keeps a network that was trained on so many slopes of every family but one.
pub(crate) fn keep(network: &Network, without: Family, slopes: u64) -> anyhow::Result<()> {
    let file = place(without, slopes);
    let folder = file.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    std::fs::write(&file, network.text()).with_context(|| file.display().to_string())
}

/// The network that [`keep`] has kept.
pub(crate) fn kept(without: Family, slopes: u64) -> anyhow::Result<Network> {
    let file = place(without, slopes);
    let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    Ok(Network::from_text(&text))
}

fn place(without: Family, slopes: u64) -> PathBuf {
    at(&format!("target/left-out/{slopes}-{without:?}.txt"))
}

/// Writes the file of that name in the source tree.
pub(crate) fn document(name: &str, text: &str) -> anyhow::Result<()> {
    let file = at(name);
    std::fs::write(&file, text).with_context(|| file.display().to_string())?;
    eprintln!("wrote {}", file.display());
    Ok(())
}

fn at(name: &str) -> PathBuf {
    studies::project().join(name)
}
