//! `run CONFIG`: the daemon, until SIGTERM or SIGINT.

use super::exit;
use crate::config;
use crate::runtime::log::{self, LogFormat};
use crate::runtime::run::{self as daemon, RunError};
use crate::runtime::shutdown::Shutdown;
use anyhow::Context;
use std::path::Path;
use std::process::ExitCode;

/// Runs the daemon with the site file `file`: 0 when it was asked to stop, 78 for a bad config, 74
/// when the state folder cannot be used.
///
/// # Errors
/// When the program itself cannot start: no runtime, no signals.
pub fn run(file: &Path, format: LogFormat) -> anyhow::Result<ExitCode> {
    log::init(format);
    let config = match config::load(file) {
        Ok(config) => config,
        Err(error) => {
            exit::complain(&error);
            return Ok(exit::CONFIG.into());
        }
    };
    for warning in &config.warnings {
        tracing::warn!(%warning, "doubtful config");
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("cannot start the asynchronous runtime")?;
    let ended = runtime.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        let (progress, _) = tokio::sync::watch::channel(daemon::Progress::default());
        anyhow::Ok(daemon::run(&config, shutdown, &progress).await)
    })?;
    Ok(match ended {
        Ok(_counts) => ExitCode::SUCCESS,
        Err(error) => {
            exit::complain(&error);
            match error {
                RunError::State { .. } | RunError::InUse { .. } => exit::IO.into(),
                RunError::Follow(_) => exit::TROUBLE.into(),
            }
        }
    })
}
