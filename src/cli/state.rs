//! Asks a site's state, beside a running daemon or without one: its events, a copy of it.

use super::args::{OutputArgs, OutputFormat};
use super::exit::complain;
use super::text;
use crate::config::{self, Config, ConfigError};
use crate::monitor::EventKind;
use crate::reading::BenchmarkId;
use crate::store::Store;
use anyhow::Context;
use clap::builder::PossibleValuesParser;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

/// `--config`.
#[derive(Debug, clap::Args)]
pub(super) struct SiteArgs {
    /// The site whose daemon, or whose state, is asked
    #[arg(long, value_name = "CONFIG")]
    config: PathBuf,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

impl SiteArgs {
    /// The config as far as it is right, where a daemon runs on its state, with the config that was right before.
    fn of_the_daemon(&self, refused: ConfigError) -> anyhow::Result<Config> {
        let config = match config::load_as_far_as_right(&self.config) {
            Ok(config) if Store::is_held(&config.site.state_dir) => config,
            Ok(_) | Err(_) => return Err(refused.into()),
        };
        let (file, state) = (self.config.display(), config.site.state_dir.display());
        complain(&format!(
            "{file} has errors, which slipwatch check lists; what is asked goes to the daemon that runs on {state}, with the config before"
        ));
        Ok(config)
    }

    /// Its config and its state. The daemon goes on with the config before while the file is wrong, and so does who asks it.
    pub(super) fn open(&self) -> anyhow::Result<(Config, Store)> {
        let config = match config::load(&self.config) {
            Err(refused) => self.of_the_daemon(refused)?,
            Ok(config) => config,
        };
        let folder = &config.site.state_dir;
        let store = Store::look(folder)
            .with_context(|| format!("cannot read the state in {}", folder.display()))?;
        Ok((config, store))
    }
}

/// Print a site's events as `replay` does, in the order in which they were found
///
/// On a first start the newest readings are judged before those of the past, so that older events stand after newer ones.
#[derive(Debug, clap::Args)]
pub(super) struct EventsArgs {
    #[command(flatten)]
    site: SiteArgs,
    /// Only of this benchmark
    #[arg(long, value_name = "ID")]
    benchmark: Option<String>,
    /// Only of this kind, such as alert
    #[arg(long, value_name = "KIND", value_parser = PossibleValuesParser::new(EventKind::NAMES))]
    kind: Option<String>,
    /// Wait for more, until interrupted
    #[arg(long)]
    follow: bool,
}

/// Copy a site's state to a file, beside a running daemon
///
/// To restore it, stop the daemon and put the copy in the state folder as slipwatch.db, without slipwatch.db-wal and slipwatch.db-shm.
#[derive(Debug, clap::Args)]
pub(super) struct BackupArgs {
    /// Where to; there must be no such file yet
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    site: SiteArgs,
}

/// A file that was written.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct FileWritten {
    /// Which.
    pub(super) file: PathBuf,
    /// Its size.
    pub(super) bytes: u64,
}

/// Copies the state.
pub(super) fn backup(args: &BackupArgs) -> anyhow::Result<()> {
    let (_, store) = args.site.open()?;
    store
        .backup(&args.file)
        .with_context(|| format!("cannot write {}", args.file.display()))?;
    let written = FileWritten {
        file: args.file.clone(),
        bytes: std::fs::metadata(&args.file)?.len(),
    };
    args.site.output.print(&written, |written| {
        format!("{}: {} bytes\n", written.file.display(), written.bytes)
    })
}

/// Whether the config names the benchmark, or it has given a reading.
pub(super) fn is_known(
    config: &Config,
    store: &Store,
    benchmark: &BenchmarkId,
) -> anyhow::Result<bool> {
    let is_named = config.benchmarks.iter().any(|one| one.id == *benchmark);
    Ok(is_named || store.benchmarks()?.contains_key(benchmark))
}

/// What is said where it is not.
pub(super) fn no_benchmark(benchmark: &BenchmarkId) -> anyhow::Error {
    anyhow::anyhow!(
        "there is no benchmark {benchmark}: the config names none, and none has given a reading"
    )
}

/// Prints events.
pub(super) fn events(args: &EventsArgs) -> anyhow::Result<()> {
    let (config, store) = args.site.open()?;
    let zone = &config.site.time_zone;
    let mut stdout = std::io::stdout().lock();
    let mut after = 0;
    if let Some(benchmark) = args.benchmark.as_ref().filter(|_| !args.follow) {
        // One that was there has events.
        let id = BenchmarkId::new(benchmark);
        if !is_known(&config, &store, &id)? && store.events(0, None, Some(benchmark))?.is_empty() {
            return Err(no_benchmark(&id));
        }
    }
    loop {
        let events = store.events(after, args.kind.as_deref(), args.benchmark.as_deref())?;
        for (seq, body) in &events {
            after = *seq;
            match args.site.output.format {
                OutputFormat::Json => writeln!(stdout, "{body}")?,
                OutputFormat::Text => {
                    writeln!(stdout, "{}", text::line(&serde_json::from_str(body)?, zone))?;
                }
            }
        }
        if events.is_empty() {
            stdout.flush()?;
            if !args.follow {
                return Ok(());
            }
            std::thread::sleep(std::time::Duration::from_millis(500));
        }
    }
}
