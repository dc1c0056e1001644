//! What is said once the config has been written: what it has, and what to do next.

use super::{Args, InitPlan};
use crate::cli::args::OutputFormat;
use crate::cli::exit;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::Write as _;
use std::path::Path;

/// What was written; the answer of `check` follows.
#[derive(Debug, JsonSchema, Serialize)]
pub(in crate::cli) struct ConfigWritten<'a> {
    /// The file.
    config: &'a Path,
    /// The benchmarks in it.
    benchmarks: Vec<&'a str>,
    /// What to do next: each command, and why.
    next: Vec<(String, &'static str)>,
}

pub(super) fn say_written(args: &Args, plan: &InitPlan) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    let config = args.output_config.display();
    match args.output.format {
        OutputFormat::Text => {
            let (sources, benchmarks) = (plan.sources.len(), plan.benchmarks.len());
            writeln!(
                stdout,
                "wrote {config} (sources: {sources}, benchmarks: {benchmarks}); it is checked now\n"
            )?;
        }
        OutputFormat::Json => {
            let ids = plan
                .benchmarks
                .iter()
                .map(|benchmark| benchmark.id.as_str());
            let written = ConfigWritten {
                config: &args.output_config,
                benchmarks: ids.collect(),
                next: next(args),
            };
            writeln!(stdout, "{}", serde_json::to_string(&written)?)?;
        }
    }
    Ok(())
}

pub(super) fn say_next(args: &Args) -> anyhow::Result<()> {
    if args.output.format == OutputFormat::Json {
        return Ok(());
    }
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "\nIs all this as you meant it? If not, edit {}. Then:",
        args.output_config.display()
    )?;
    for (command, what) in next(args) {
        writeln!(stdout, "  {command:WIDTH$}  {what}")?;
    }
    Ok(())
}

/// Columns of a command, beside which stands what it does.
const WIDTH: usize = 46;

/// The path as a shell takes it for one word.
fn in_shell(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+:,@%".contains(letter);
    let text = if text.starts_with('-') {
        format!("./{text}")
    } else {
        text
    };
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// The commands that come next, and what each does.
fn next(args: &Args) -> Vec<(String, &'static str)> {
    let config = in_shell(&args.output_config);
    let files: Vec<String> = args.files.iter().map(|file| in_shell(file)).collect();
    let mut next = vec![
        (
            format!("slipwatch doctor {config}"),
            "is this machine right for it",
        ),
        (
            format!("slipwatch replay {} --config {config}", files.join(" ")),
            "what it would have said so far",
        ),
    ];
    if args.hook.is_some() {
        next.push((
            format!("slipwatch hook test --config {config}"),
            "run the hook once, marked as a test",
        ));
    }
    next.push((
        format!("slipwatch run {config}"),
        "watch, until it is stopped",
    ));
    next.push((
        format!("slipwatch status --config {config}"),
        "how the site stands, while it runs",
    ));
    next
}

/// Says of a file that no point is watched by it.
pub(super) fn say_beside(file: &Path, covariates: &[String]) {
    exit::complain(&format_args!(
        "{}: it is taken for covariates alone ({}), as a source without benchmarks; if one of them has the readings of a point, \
         say so with --column",
        file.display(),
        covariates.join(", ")
    ));
}
