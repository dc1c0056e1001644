//! Scores every method's forecasts of the time of failure as they would have been made: `skill`.
//!
//!     cargo run --release -p studies --bin skill                        on the training records, and the recordings
//!     cargo run --release -p studies --bin skill -- --judged            on the records that nothing was tuned on
//!     cargo run --release -p studies --bin skill -- --judged --write    the same into docs/skill.md
//!     cargo run --release -p studies --bin skill -- --simulated 70 --records records.ndjson
//!
//! At each lead before a failure, and at looks spread over a record that ended without one, each method is given
//! what had been measured until then, and what it says is scored against what came.
#![expect(
    clippy::print_stderr,
    reason = "what is left out is printed for who runs it"
)]

mod chances;
mod corpus;
mod document;
mod figures;
mod la_clapiere;
mod lines;
mod record;
mod recorded;
mod reduce;
mod run;
mod simulated;
mod sites;
mod sums;
mod table;
mod verdicts;

use anyhow::{Context, Result, bail};
use clap::Parser;
use corpus::Subjects;
use slipwatch::score::METHODS;
use std::io::Write as _;
use std::path::PathBuf;
use studies::Corpus;
use sums::Scored;

/// Scores forecasts of the time of failure.
#[derive(Debug, Parser)]
struct Arguments {
    /// Simulated records, beside the recordings.
    #[arg(long, default_value_t = Corpus::LIVES)]
    simulated: u64,
    /// On the records that are kept for judgement; without it, on those for training.
    #[arg(long)]
    judged: bool,
    /// Only these methods; all where none is named.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Writes every forecast into this file, a line each.
    #[arg(long, value_name = "FILE")]
    records: Option<PathBuf>,
    /// Writes docs/skill.md and its figures instead of printing tables.
    #[arg(long, conflicts_with = "only")]
    write: bool,
    /// Makes no forecast, and takes those that `--records` wrote into this file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "records"])]
    from: Option<PathBuf>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let methods: Vec<_> = METHODS
        .iter()
        .filter(|method| {
            arguments.only.is_empty() || arguments.only.iter().any(|name| name == method.name)
        })
        .collect();
    if methods.is_empty() {
        let known: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
        bail!("no such method: expected one of {}", known.join(", "));
    }
    if arguments.simulated > Corpus::LIVES {
        bail!("at most {} simulated records", Corpus::LIVES);
    }
    let recorded = recorded::load(|heading| eprintln!("left out: {heading} (no measured data)"))?;
    let corpus = if arguments.judged {
        Corpus::JUDGED
    } else {
        Corpus::TRAINING
    };
    let subjects = Subjects::new(recorded, corpus, arguments.simulated);
    let series = match &arguments.from {
        Some(file) => {
            let lines = std::fs::read_to_string(file);
            lines::read(&lines.with_context(|| file.display().to_string())?)?
        }
        None => run::run(&subjects, &methods, arguments.threads)?,
    };
    if let Some(file) = &arguments.records {
        let lines = lines::written(&series)?;
        std::fs::write(file, lines).with_context(|| file.display().to_string())?;
    }
    if arguments.write {
        let names = methods.iter().map(|method| method.name).collect();
        return document::write(&Scored::of(&series, names), arguments.judged);
    }
    write!(std::io::stdout(), "{}", table::text(&series, &methods))?;
    Ok(())
}
