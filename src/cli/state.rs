//! Asks a site's state, or leaves an order in it: beside a running daemon or without one.

use super::args::{Format, OutputArgs};
use super::exit::UsageError;
use super::text;
use crate::config::{self, Config, value};
use crate::monitor::{EventKind, Order};
use crate::reading::BenchmarkId;
use crate::runtime::clock;
use crate::runtime::standing::{acknowledged, closed, in_force, orders, silences};
use crate::store::Store;
use anyhow::Context;
use clap::Subcommand;
use clap::builder::PossibleValuesParser;
use jiff::SignedDuration;
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
    pub(super) fn open(&self) -> anyhow::Result<(Config, Store)> {
        let config = config::load(&self.config)?;
        let folder = &config.site.state_dir;
        let store = Store::look(folder)
            .with_context(|| format!("cannot read the state in {}", folder.display()))?;
        Ok((config, store))
    }
}

/// Print a site's events, oldest first, as `replay` does
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

/// List the alerts in force, acknowledge them, or have no hook run for a time
#[derive(Debug, clap::Args)]
pub(super) struct AlertsArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the alerts in force
    List {
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Somebody has seen what is in force: hooks that have not taken it are not tried again
    Ack {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        /// Who has seen it
        #[arg(long, value_name = "NAME")]
        by: Option<String>,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Run no hook for the level in force at a benchmark or a lower one; for a higher one they are run at once
    Shelve {
        /// Where
        #[arg(long, value_name = "ID")]
        benchmark: String,
        /// For how long, such as 8h; thirty days at most
        #[arg(long = "for", value_name = "DURATION", value_parser = value::duration)]
        span: SignedDuration,
        /// Who
        #[arg(long, value_name = "NAME")]
        by: Option<String>,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Have hooks tried again with the alerts that were given up: at the daemon's next start or reload
    Redeliver {
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Run the hooks again, from now on, for what was silenced or shelved; what is in force is sent then
    #[command(visible_alias = "unshelve")]
    Unsilence {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        /// Who
        #[arg(long, value_name = "NAME")]
        by: Option<String>,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Run no hook, not for red either; what is in force at the end, or has ended meanwhile, is sent then
    Silence {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        /// For how long, such as 30min; seven days at most
        #[arg(long = "for", value_name = "DURATION", value_parser = value::duration)]
        span: SignedDuration,
        /// Who
        #[arg(long, value_name = "NAME")]
        by: Option<String>,
        #[command(flatten)]
        site: SiteArgs,
    },
}

/// Copy a site's state to a file, beside a running daemon
///
/// To restore it, stop the daemon and put the copy in the state folder as slipwatch.db, without slipwatch.db-wal.
#[derive(Debug, clap::Args)]
pub(super) struct BackupArgs {
    /// Where to; there must be no such file yet
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    site: SiteArgs,
}

/// Copies the state.
pub(super) fn backup(args: &BackupArgs) -> anyhow::Result<()> {
    let (_, store) = args.site.open()?;
    store
        .backup(&args.file)
        .with_context(|| format!("cannot write {}", args.file.display()))?;
    let said =
        serde_json::json!({ "file": args.file, "bytes": std::fs::metadata(&args.file)?.len() });
    args.site.output.print(&said, |said| {
        format!("{}: {} bytes\n", args.file.display(), said["bytes"])
    })
}

/// Prints events.
pub(super) fn events(args: &EventsArgs) -> anyhow::Result<()> {
    let (config, store) = args.site.open()?;
    let zone = &config.site.time_zone;
    let mut stdout = std::io::stdout().lock();
    let mut after = 0;
    loop {
        let events = store.events(after, args.kind.as_deref(), args.benchmark.as_deref())?;
        for (seq, body) in &events {
            after = *seq;
            match args.site.output.format {
                Format::Json => writeln!(stdout, "{body}")?,
                Format::Text => {
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

/// Lists alerts, or leaves an order.
pub(super) fn alerts(args: &AlertsArgs) -> anyhow::Result<()> {
    let until = |span: SignedDuration| clock::now().checked_add(span).context("that is too long");
    let (site, order) = match &args.action {
        Action::List { site } => return list(site),
        Action::Redeliver { site } => return redeliver(site),
        Action::Ack {
            benchmark,
            by,
            site,
        } => {
            let (benchmark, by) = (benchmark.as_ref().map(BenchmarkId::new), by.clone());
            (site, Order::Acknowledge { benchmark, by })
        }
        Action::Shelve {
            benchmark,
            span,
            by,
            site,
        } => {
            limit(*span, Order::LONGEST_SHELVE)?;
            let (benchmark, until) = (BenchmarkId::new(benchmark), until(*span)?);
            let by = by.clone();
            (
                site,
                Order::Shelve {
                    benchmark,
                    until,
                    by,
                },
            )
        }
        Action::Silence {
            benchmark,
            span,
            by,
            site,
        } => {
            limit(*span, Order::LONGEST_SILENCE)?;
            let (benchmark, until) = (benchmark.as_ref().map(BenchmarkId::new), until(*span)?);
            let by = by.clone();
            (
                site,
                Order::Silence {
                    benchmark,
                    until,
                    by,
                },
            )
        }
        Action::Unsilence {
            benchmark,
            by,
            site,
        } => {
            let (benchmark, by) = (benchmark.as_ref().map(BenchmarkId::new), by.clone());
            (site, Order::Unsilence { benchmark, by })
        }
    };
    let (config, store) = site.open()?;
    let is_known =
        |benchmark: &BenchmarkId| config.benchmarks.iter().any(|one| one.id == *benchmark);
    if let Some(benchmark) = order.benchmark()
        && !is_known(benchmark)
        && !store.benchmarks()?.contains_key(benchmark)
    {
        anyhow::bail!("benchmark {benchmark} has given no readings yet");
    }
    store.ask(&order)?;
    site.output.print(&order, |_| {
        "noted; the daemon takes it within a second, or at its next start\n".to_owned()
    })
}

/// Nobody is to be left without alerts for ever by one order.
fn limit(span: SignedDuration, longest: SignedDuration) -> anyhow::Result<()> {
    if span > longest {
        let hours = longest.as_hours();
        let text =
            format!("--for {span:#} is too long: {hours}h at most, then give the order again");
        return Err(UsageError(text).into());
    }
    Ok(())
}

fn redeliver(site: &SiteArgs) -> anyhow::Result<()> {
    let (_, store) = site.open()?;
    let said = serde_json::json!({ "deliveries": store.redeliver()? });
    site.output.print(&said, |said| {
        let count = &said["deliveries"];
        format!(
            "{count} deliveries wait again; the daemon makes them at its next start or reload\n"
        )
    })
}

fn list(site: &SiteArgs) -> anyhow::Result<()> {
    let (config, store) = site.open()?;
    let mut stdout = std::io::stdout().lock();
    let (in_force, orders) = (in_force(&store, None)?, orders(&store)?);
    let mut standing = silences(&orders, clock::now());
    standing.extend(acknowledged(&orders, &in_force));
    standing.extend(closed(&store, &in_force)?);
    standing.extend(in_force.into_values());
    standing.sort_by_key(|event| event.time);
    for event in &standing {
        match site.output.format {
            Format::Json => writeln!(stdout, "{}", serde_json::to_string(event)?)?,
            Format::Text => writeln!(stdout, "{}", text::line(event, &config.site.time_zone))?,
        }
    }
    Ok(())
}
