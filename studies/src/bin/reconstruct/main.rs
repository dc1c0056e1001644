//! Writes the reconstructions of two historic records into a folder: `reconstruct recordings`.
//!
//! No table of these records is available. What is written follows the statements of
//! Helmstetter et al. (2004) and is invented where they are silent; every constant says which.

mod facts;
mod interpolation;
mod la_clapiere;
mod loaded_law;
mod noise;
mod projection;
mod provenance;
#[cfg(test)]
mod tests;
mod tinee;
mod vaiont;

use anyhow::{Context, Result};
use slipwatch::reading::Recording;
use slipwatch::runtime::ingest::write_mcap;
use std::io::Write;
use std::path::PathBuf;

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = PathBuf::from(folder.context("give the folder to write into")?);
    let vaiont = vaiont::recording()?;
    facts::vaiont(&vaiont, vaiont::DAY_ZERO.parse()?)?;
    let la_clapiere = la_clapiere::recording()?;
    facts::la_clapiere(&la_clapiere)?;
    let days = la_clapiere::days()?;
    let motions = la_clapiere::motions(&days, la_clapiere::Parts::All)?;
    facts::la_clapiere_motion(&motions)?;
    tell_shares(&days)?;
    write(&vaiont, &folder.join(vaiont::FILE))?;
    write(&la_clapiere, &folder.join(la_clapiere::FILE))
}

/// How much of La Clapière's slip the paper's fit, the river and the rest account for.
fn tell_shares(days: &[la_clapiere::Day]) -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "La Clapière, slip since the first reading, mm: the fit, + river, + the rest"
    )?;
    for (year, [fit, river, all]) in la_clapiere::shares(days)? {
        writeln!(out, "{year:.1}  {fit:6.0}  {river:6.0}  {all:6.0}")?;
    }
    Ok(())
}

fn write(recording: &Recording, file: &std::path::Path) -> Result<()> {
    write_mcap(recording, file)?;
    writeln!(std::io::stdout(), "wrote {}", file.display())?;
    Ok(())
}
