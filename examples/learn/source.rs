//! The file that holds what was learnt.

use anyhow::Context;
use slipwatch::forecast::{INPUTS, Network};
use std::fmt::Write as _;

/// Writes src/forecast/learned.rs.
pub(crate) fn write(network: &Network, slopes: u64) -> anyhow::Result<()> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/src/forecast/learned.rs");
    std::fs::write(file, text(network, slopes)?).with_context(|| file.to_owned())?;
    let formatted = std::process::Command::new("rustfmt")
        .args(["--edition", "2024", file])
        .status()
        .context("rustfmt")?;
    anyhow::ensure!(formatted.success(), "rustfmt {file}");
    eprintln!("wrote {file}");
    Ok(())
}

fn text(network: &Network, slopes: u64) -> anyhow::Result<String> {
    let mut out = format!(
        "//! The network that gives the chance of a collapse, taught on {slopes} simulated slopes of each family: written by\n\
         //! `cargo run --release --example learn`.\n\
         #![allow(clippy::approx_constant, reason = \"a learnt figure may come near to a constant\")]\n\
         #![allow(clippy::unreadable_literal, reason = \"no figure here is read by people\")]\n\n\
         use super::collapse::INPUTS;\nuse super::network::{{HIDDEN, Network}};\n\n\
         const UNITS: [[f32; INPUTS]; HIDDEN] = [\n"
    );
    for unit in &network.hidden {
        writeln!(out, "{},", row(unit))?;
    }
    let output: Vec<String> = network.output.iter().copied().map(figure).collect();
    write!(
        out,
        "];\n\n/// The network in force.\npub(super) const LEARNED: Network = Network {{\nhidden: UNITS,\noutput: [{}],\ndirect: {},\n}};\n",
        output.join(", "),
        row(&network.direct)
    )?;
    Ok(out)
}

fn row(weights: &[f32; INPUTS]) -> String {
    let all: Vec<String> = weights.iter().copied().map(figure).collect();
    format!("[{}]", all.join(", "))
}

fn figure(weight: f32) -> String {
    format!("{weight:.4}")
}
