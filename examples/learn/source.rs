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
