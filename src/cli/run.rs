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
use nix::sys::resource::{Resource, getrlimit, setrlimit};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Open files that are asked for.
const MOST_FILES: u64 = 65_536;
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
    allow_files();
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

/// As many open files as this user may have, up to what the packaged unit allows: files that are followed, callers of the page and
/// messages that wait for an answer are not to take what a hook needs.
fn allow_files() {
    let raised = getrlimit(Resource::RLIMIT_NOFILE).and_then(|(soft, hard)| {
        let wanted = hard.min(MOST_FILES);
        if soft >= wanted {
            return Ok(());
        }
        setrlimit(Resource::RLIMIT_NOFILE, wanted, hard)
    });
    if let Err(error) = raised {
        tracing::warn!(%error, "the limit of open files stays as it is");
    }
}

/// The runtime that the daemon and a replay need.
pub(super) fn asynchronous() -> anyhow::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("cannot start the asynchronous runtime")
}
