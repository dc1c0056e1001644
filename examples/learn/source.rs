//! The file that holds what was learnt.

use anyhow::Context;
use slipwatch::forecast::Network;

/// Writes src/forecast/learned.txt.
pub(crate) fn write(network: &Network) -> anyhow::Result<()> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/src/forecast/learned.txt");
    std::fs::write(file, network.text()).with_context(|| file.to_owned())?;
    eprintln!("wrote {file}");
    Ok(())
}

/// The network that src/forecast/learned.txt holds.
pub(crate) fn in_force() -> anyhow::Result<Network> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/src/forecast/learned.txt");
    let text = std::fs::read_to_string(file).with_context(|| file.to_owned())?;
    Ok(Network::from_text(&text))
}
