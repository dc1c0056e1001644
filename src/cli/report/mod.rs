//! `report FILE... -o DIR`: one page, complete in itself, of a recording or of a daemon's state.

mod material;
mod page;
mod sections;

use super::args::{FILE_FLAGS, OutputArgs, ReadingArgs};
use super::exit::UsageError;
use super::state::FileWritten;
use crate::config::value;
use crate::reading::Timestamp;
use anyhow::{Context, bail};
use jiff::SignedDuration;
use std::path::PathBuf;

/// Write one page of a crisis: what was called when, forecasts as they were made, what the law lacks, the scorecard
///
/// The page is one HTML file that needs no other and prints well. From files it is DIR/report.html, drawn from a replay;
/// from a daemon's state DIR/report-DATE.html, DATE that of the newest reading, drawn from what the daemon said.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    /// The site whose daemon's state is reported, instead of files
    #[arg(long, value_name = "CONFIG", conflicts_with_all = ["files", "channels", "failure_time", "no_failure", "quantity", "evacuation_time", "critical_velocity"], conflicts_with_all = FILE_FLAGS)]
    config: Option<PathBuf>,
    /// Of a state: only this last stretch of its data, such as 7d; figures show five times as much
    #[arg(long, value_name = "DURATION", requires = "config", value_parser = value::duration)]
    last: Option<SignedDuration>,
    /// When the slope failed: forecasts are scored against it
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    failure_time: Option<Timestamp>,
    /// It had not failed when the record ended: forecasts are scored against that
    #[arg(long, conflicts_with = "failure_time")]
    no_failure: bool,
    /// Leave out the search for what the law lacks, which takes longest
    #[arg(long)]
    no_search: bool,
    /// The folder to write into, made where there is none
    #[arg(short, long, value_name = "DIR")]
    output_dir: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

/// Gathers what there is, and writes the page.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let (material, name) = match &args.config {
        Some(config) => {
            let material = material::of_state(args, config)?;
            let day = material.end().strftime("%Y-%m-%d");
            let name = format!("report-{day}.html");
            (material, name)
        }
        None => (material::of_files(args)?, "report.html".to_owned()),
    };
    if material.recording.series.is_empty() {
        bail!(UsageError("there are no readings to report".to_owned()));
    }
    let page = page::page(args, &material)?;
    let folder = &args.output_dir;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let file = folder.join(name);
    std::fs::write(&file, &page).with_context(|| format!("cannot write {}", file.display()))?;
    let bytes = page.len() as u64;
    args.output.print(&FileWritten { file, bytes }, |written| {
        format!("{}\n", written.file.display())
    })
}
