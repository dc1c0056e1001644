//! Writes the reconstructions of two historic records into a folder: `reconstruct recordings`.
//!
//! No table of these records is available. What is written follows the statements of
//! Helmstetter et al. (2004) and is invented where they are silent; every constant says which.

mod interpolation;
mod la_clapiere;
mod loaded_law;
mod noise;
mod vaiont;

use anyhow::{Context, Result};
use slipwatch::runtime::ingest::{write_csv, write_mcap};
use std::collections::BTreeMap;
use std::path::PathBuf;

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = PathBuf::from(folder.context("give the folder to write into")?);
    for m in la_clapiere::motions(&la_clapiere::days()?)?.iter().step_by(10) { println!("{:.3} {:.1} {:.0}", m.year, m.velocity, m.slip_mm); }
    write_mcap(&vaiont::recording()?, &folder.join(vaiont::FILE))?;
    write_mcap(&la_clapiere::recording()?, &folder.join(la_clapiere::FILE))?;
    Ok(())
}

fn provenance(title: &str, law: &str, invented: &str, seed: u64) -> BTreeMap<String, String> {
    let seed = seed.to_string();
    let entries = [
        ("title", title),
        ("kind", "reconstruction"),
        ("statement", "These are not measured values."),
        ("law", law),
        ("invented", invented),
        ("seed", &seed),
    ];
    entries.into_iter().map(|(k, v)| (k.to_owned(), v.to_owned())).collect()
}
