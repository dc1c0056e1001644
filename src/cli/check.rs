//! `check CONFIG`: whether the site file is right.

use super::args::{Format, OutputArgs};
use super::exit;
use crate::config::{self, ConfigError};
use crate::runtime::sampling;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Check a site's config and say everything that is wrong with it
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The site's config
    #[arg(value_name = "CONFIG")]
    config: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

/// Says what the site file amounts to. Warnings and problems go to stderr; with JSON the problems
/// go to stdout as well.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let json = args.output.format == Format::Json;
    let mut stdout = std::io::stdout().lock();
    match config::check(&args.config) {
        Ok(mut summary) => {
            summary.warnings.extend(slow_sampling(&args.config)?);
            for warning in &summary.warnings {
                exit::complain(&warning);
            }
            if json {
                writeln!(stdout, "{}", serde_json::to_string(&summary)?)?;
            } else {
                writeln!(stdout, "{summary}")?;
            }
            Ok(())
        }
        Err(error) => {
            if json && let ConfigError::Invalid { problems } = &error {
                let problems = serde_json::json!({ "problems": problems });
                writeln!(stdout, "{problems}")?;
            }
            Err(error.into())
        }
    }
}

/// By what lies in the sources' files now.
fn slow_sampling(file: &Path) -> Result<Vec<String>, ConfigError> {
    let config = config::load(file)?;
    let lines = sampling::doubts(&config).into_iter();
    let place = file.display();
    Ok(lines
        .map(|line| format!("{place}: warning: {line}"))
        .collect())
}
