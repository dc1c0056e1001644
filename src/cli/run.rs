//! `run CONFIG`: the daemon, until SIGTERM or SIGINT.

use super::args::{OutputArgs, OutputFormat};
use super::text;
use crate::config;
use crate::runtime::log::{self, LogFormat};
use crate::runtime::progress::Progress;
use crate::runtime::run as daemon;
use crate::runtime::sandbox::OURSELVES;
use crate::runtime::shutdown::Shutdown;
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long threads that still wait may take at the end.
const LAST_THREADS: Duration = Duration::from_secs(1);

/// Watch a site: follow its files, write events to its state folder, run its hooks
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The site's config
    #[arg(value_name = "CONFIG")]
    config: PathBuf,
    /// How the log on stderr looks [default: as --format]
    #[arg(long, value_enum, value_name = "FORMAT")]
    log: Option<LogFormat>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs the daemon until it is asked to stop.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    log::init(args.log.unwrap_or(match args.output.format {
        OutputFormat::Text => LogFormat::Text,
        OutputFormat::Json => LogFormat::Json,
    }));
    let mut config = config::load(&args.config)?;
    config.sandbox_hooks(Path::new(OURSELVES));
    for warning in &config.warnings {
        tracing::warn!(%warning, "doubtful config");
    }
    let runtime = asynchronous()?;
    let ended = runtime.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        let (progress, _) = tokio::sync::watch::channel(Progress::default());
        Box::pin(daemon::run(&config, shutdown, &progress, text::line)).await?;
        Ok(())
    });
    // All is closed by now; a name server that does not answer keeps a thread for up to a minute.
    runtime.shutdown_timeout(LAST_THREADS);
    ended
}

/// The runtime that the daemon and a replay need.
pub(super) fn asynchronous() -> anyhow::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("cannot start the asynchronous runtime")
}
