//! Series as files: a CSV in the format that `slipwatch` reads, and beside it what is known of it.

use super::drawn::Drawn;
use anyhow::{Context, Result};
use slipwatch::reading::Recording;
use slipwatch::runtime::ingest::write_csv;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Writes `NAME.csv` and `NAME.truth.json` into `folder`.
pub(crate) fn write(folder: &Path, name: &str, drawn: &Drawn) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
    let mut series = vec![drawn.series.clone()];
    series.extend(drawn.neighbours.iter().cloned());
    let recording = Recording {
        series,
        channels: drawn.channels.clone(),
        ..Recording::default()
    };
    let table = folder.join(format!("{name}.csv"));
    let file = File::create(&table).with_context(|| format!("{}", table.display()))?;
    write_csv(&recording, BufWriter::new(file))?;
    let known = folder.join(format!("{name}.truth.json"));
    let file = File::create(&known).with_context(|| format!("{}", known.display()))?;
    serde_json::to_writer_pretty(BufWriter::new(file), &drawn.truth)?;
    Ok(())
}
