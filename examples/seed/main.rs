//! Repeats the studies of Helmstetter et al. (2004) and writes docs/seed.md with its figures: `seed`.
//!
//! Every number in the document is measured by the run that writes it; a second run writes the same bytes.

mod claims;
mod document;
mod figures;
mod la_clapiere;
mod recorded;
mod regimes;
mod synthetic;
mod vaiont;

use anyhow::{Context, Result};
use document::Studies;
use std::path::Path;

/// The paper's number of synthetic series.
const SYNTHETICS: u64 = 200;

fn main() -> Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let studies = Studies::run(SYNTHETICS)?;
    let figures = [
        ("regimes", figures::regimes(&regimes::columns()?)),
        ("vaiont", figures::vaiont(&studies.vaiont)?),
        (
            "la-clapiere",
            figures::la_clapiere(&studies.la_clapiere, &studies.fits)?,
        ),
        (
            "sweep",
            figures::sweep(&studies.growing, &studies.growing_velocity)?,
        ),
        ("synthetic", figures::synthetic(&studies.synthetic)),
    ];
    let folder = docs.join("seed");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    for (name, figure) in figures {
        let file = folder.join(format!("{name}.svg"));
        std::fs::write(&file, figure.svg()).with_context(|| file.display().to_string())?;
    }
    let file = docs.join("seed.md");
    std::fs::write(&file, document::text(&studies)?).with_context(|| file.display().to_string())
}
