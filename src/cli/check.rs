//! `check CONFIG`: whether the site file is right, and what its files would be taken for.

use super::args::{OutputArgs, OutputFormat};
use super::{exit, preview as text};
use crate::config::{self, ConfigError, ConfigProblem, ConfigSummary};
use crate::reading::plain;
use crate::runtime::doctor;
use crate::runtime::inherited::InheritedReadings;
use crate::runtime::preview::{Preview, preview};
use crate::runtime::sampling;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Check a site's config and say everything that is wrong with it, and what its files hold
///
/// Exits 1 where a benchmark gets readings from no file: it would not be monitored.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The site's config; - reads stdin, with paths from the working folder
    #[arg(value_name = "CONFIG")]
    config: PathBuf,
    /// Look at the config alone, not at the files: for a service that must start while a logger is silent
    #[arg(long)]
    config_only: bool,
    #[command(flatten)]
    output: OutputArgs,
}

/// What has no source.
#[derive(Debug, thiserror::Error)]
#[error("{}: nothing is read of {}; see the warnings", config.display(), what.join(", "))]
struct Unwatched {
    config: PathBuf,
    what: Vec<String>,
}

/// What a config that is right amounts to.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct Shown<'a> {
    #[serde(flatten)]
    summary: &'a ConfigSummary,
    /// None where the files were not looked at.
    preview: Option<&'a Preview>,
}

/// What is wrong with a config that is refused.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct Refused<'a> {
    /// In the order of the file.
    problems: &'a [ConfigProblem],
}

/// Says what the site file amounts to. Warnings and problems go to stderr; with JSON the problems
/// go to stdout as well.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    check(&args.config, args.output, !args.config_only)
}

/// The same for another command that has written a config.
pub(super) fn check(file: &Path, output: OutputArgs, looks_at_files: bool) -> anyhow::Result<()> {
    let json = output.format == OutputFormat::Json;
    let mut stdout = std::io::stdout().lock();
    match config::check(file) {
        Ok(mut summary) => {
            let preview = if looks_at_files {
                Some(look(file, &mut summary)?)
            } else {
                None
            };
            for warning in &summary.warnings {
                exit::complain(&plain(warning));
            }
            if json {
                let (summary, preview) = (&summary, preview.as_ref());
                let shown = Shown { summary, preview };
                writeln!(stdout, "{}", serde_json::to_string(&shown)?)?;
            } else {
                let is_fed = preview
                    .as_ref()
                    .is_none_or(|preview| preview.without_readings.is_empty());
                let summary = plain(&summary.to_string());
                writeln!(stdout, "{}{summary}", if is_fed { "" } else { "not " })?;
                if let Some(preview) = &preview {
                    let zone = config::load(file)?.site.time_zone;
                    write!(stdout, "{}", text::shown(preview, &zone))?;
                }
            }
            stdout.flush()?;
            preview.map_or(Ok(()), |preview| all_are_fed(file, &preview))
        }
        Err(error) => {
            if json && let ConfigError::Invalid { problems } = &error {
                let refused = Refused { problems };
                writeln!(stdout, "{}", serde_json::to_string(&refused)?)?;
            }
            Err(error.into())
        }
    }
}

/// Looks at what lies in the sources' files now; doubts about it become warnings.
fn look(file: &Path, summary: &mut ConfigSummary) -> Result<Preview, ConfigError> {
    let config = config::load(file)?;
    let preview = preview(&config);
    let place = file.display();
    let absent = preview.absent.iter().map(ToString::to_string);
    summary.warnings.extend(absent);
    let inherited = InheritedReadings::of(&config).map(|inherited| inherited.text(&config));
    summary
        .warnings
        .extend(inherited.map(|line| format!("{place}: warning: {line}")));
    let unstartable = doctor::unstartable(&config).into_iter();
    summary
        .warnings
        .extend(unstartable.map(|line| format!("{place}: warning: {line}")));
    let sampling_warnings = sampling::sampling_warnings(&config, &preview).into_iter();
    summary
        .warnings
        .extend(sampling_warnings.map(|line| format!("{place}: warning: {line}")));
    Ok(preview)
}

fn all_are_fed(config: &Path, preview: &Preview) -> anyhow::Result<()> {
    if preview.without_readings.is_empty() {
        return Ok(());
    }
    let what = preview
        .without_readings
        .iter()
        .map(|one| match &one.benchmark {
            Some(benchmark) => format!("benchmark {:?}", benchmark.as_str()),
            None if one.source.is_empty() => "the site".to_owned(),
            None => format!("source {:?}", one.source),
        });
    Err(Unwatched {
        config: config.to_owned(),
        what: what.collect(),
    }
    .into())
}
