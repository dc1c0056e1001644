//! `convert IN OUT`: readings from one file format to another.

use super::args::{FileArgs, OutputArgs, OutputFormat, say_remarks, warn_of};
use super::bar;
use super::exit::{self, UsageError};
use crate::runtime::ingest::{self, ConvertStage};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Convert readings between CSV, NDJSON, TOA5 and MCAP, by the names' endings
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file to read
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write, replaced when it is there
    #[arg(value_name = "OUT")]
    out: PathBuf,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Converts, and says what was written and what the output has no place for.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if args.out == Path::new("-") {
        let text = "convert writes a file, whose ending says how: name one, such as out.ndjson";
        return Err(UsageError(text.to_owned()).into());
    }
    let bar = bar::shared();
    let mut progress = |stage: ConvertStage| match stage {
        ConvertStage::Read(share) => bar::share(&bar, share),
        ConvertStage::Written(bytes) => {
            bar::of_bytes(&bar);
            bar.set_position(bytes);
        }
    };
    let options = args.file.options();
    let report = ingest::convert(&args.input, &args.out, &options, &mut progress);
    bar.finish_and_clear();
    let report = report?;
    warn_of(report.disorder);
    say_remarks(&report.remarks);
    for what in &report.left_out {
        exit::complain(&format_args!("warning: left out: {what}"));
    }
    let mut stdout = std::io::stdout().lock();
    match args.output.format {
        OutputFormat::Json => writeln!(stdout, "{}", serde_json::to_string(&report)?)?,
        OutputFormat::Text => {
            for series in &report.series {
                let (id, quantity) = (&series.benchmark, series.quantity);
                let (readings, unit) = (series.readings, series.unit);
                writeln!(stdout, "{id}: {readings} readings of {quantity} in {unit}")?;
            }
            for channel in &report.channels {
                writeln!(stdout, "{}: {} samples", channel.name, channel.samples)?;
            }
        }
    }
    Ok(())
}
