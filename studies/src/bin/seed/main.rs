//! Repeats the studies of Helmstetter et al. (2004) and writes docs/seed.md with its figures:
//! `seed [--recordings FOLDER]`. With a folder of other readings of the two slopes, the document is
//! written there.
//!
//! Every number in the document is measured by the run that writes it; a second run writes the same bytes.

mod as_drawn;
mod claims;
mod claims_vaiont;
mod document;
mod document_vaiont;
mod figures;
mod given_up;
mod la_clapiere;
mod recorded;
mod regimes;
mod river;
mod simplex;
mod synthetic;
#[cfg(test)]
mod tests;
mod vaiont;
mod valley;

use anyhow::{Context, Result};
use document::Studies;
use recorded::Archive;
use std::path::PathBuf;

/// The paper's number of synthetic series.
const SYNTHETICS: u64 = 200;

fn main() -> Result<()> {
    let (archive, target) = match given_folder()? {
        Some(folder) => (Archive::of(&folder)?, folder),
        None => (Archive::own()?, studies::project().join("docs")),
    };
    let studies = Studies::run(SYNTHETICS, &archive)?;
    let folder = target.join("seed");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    for (name, figure) in figures::all(&studies)? {
        let file = folder.join(format!("{name}.svg"));
        std::fs::write(&file, figure.svg()).with_context(|| file.display().to_string())?;
    }
    let file = target.join("seed.md");
    std::fs::write(&file, document::text(&studies)?).with_context(|| file.display().to_string())
}

/// The folder of `--recordings FOLDER`.
fn given_folder() -> Result<Option<PathBuf>> {
    let mut arguments = std::env::args_os().skip(1);
    let Some(flag) = arguments.next() else {
        return Ok(None);
    };
    let folder = arguments.next().filter(|_| flag == "--recordings");
    let folder = folder.context("usage: seed [--recordings FOLDER]")?;
    anyhow::ensure!(
        arguments.next().is_none(),
        "usage: seed [--recordings FOLDER]"
    );
    Ok(Some(PathBuf::from(folder)))
}
