//! `check CONFIG`: whether the site file is right.

use super::exit;
use crate::config::{self, ConfigError};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Checks the site file `file` and says what it amounts to: 0 when it is right, 78 when it is not
/// or cannot be read. Warnings and problems go to stderr; with `json` the problems to stdout as well.
///
/// # Errors
/// When the result cannot be written.
pub fn run(file: &Path, json: bool) -> anyhow::Result<ExitCode> {
    let mut stdout = std::io::stdout().lock();
    match config::check(file) {
        Ok(summary) => {
            for warning in &summary.warnings {
                exit::complain(&warning);
            }
            if json {
                writeln!(stdout, "{}", serde_json::to_string(&summary)?)?;
            } else {
                writeln!(stdout, "{summary}")?;
            }
            Ok(ExitCode::SUCCESS)
        }
        Err(error) => {
            exit::complain(&error);
            if json && let ConfigError::Invalid { problems } = &error {
                let problems = serde_json::json!({ "problems": problems });
                writeln!(stdout, "{problems}")?;
            }
            Ok(exit::CONFIG.into())
        }
    }
}
