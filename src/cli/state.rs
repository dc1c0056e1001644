//! Asks a site's state, or leaves an order in it: beside a running daemon or without one.

use super::args::{Format, OutputArgs};
use super::exit::UsageError;
use super::text;
use crate::alert::Level;
use crate::config::{self, Config, value};
use crate::monitor::{AlertState, Event, EventKind, Order};
use crate::reading::BenchmarkId;
use crate::runtime::clock;
use crate::store::Store;
use anyhow::Context;
use clap::Subcommand;
use clap::builder::PossibleValuesParser;
use jiff::SignedDuration;
use std::collections::BTreeMap;
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

pub(super) type InForce = BTreeMap<(Option<BenchmarkId>, Level), Event>;

/// The alerts in force: by benchmark and level, of each benchmark the highest, and `unknown` beside it.
pub(super) fn in_force(store: &Store) -> anyhow::Result<InForce> {
    let mut standing = InForce::new();
    for event in every(store, "alert")? {
        let EventKind::Alert { level, state, .. } = &event.kind else {
            continue;
        };
        let (level, state, place) = (*level, *state, event.benchmark.clone());
        match state {
            AlertState::Firing => {
                standing.retain(|(own, lower), _| {
                    *own != place || (*lower == Level::Unknown) != (level == Level::Unknown)
                });
                standing.insert((place, level), event);
            }
            AlertState::Resolved => {
                standing.remove(&(place, level));
            }
        }
    }
    Ok(standing)
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
            site,
        } => {
            limit(*span, Order::LONGEST_SHELVE)?;
            let (benchmark, until) = (BenchmarkId::new(benchmark), until(*span)?);
            (site, Order::Shelve { benchmark, until })
        }
        Action::Silence {
            benchmark,
            span,
            site,
        } => {
            limit(*span, Order::LONGEST_SILENCE)?;
            let (benchmark, until) = (benchmark.as_ref().map(BenchmarkId::new), until(*span)?);
            (site, Order::Silence { benchmark, until })
        }
        Action::Unsilence { benchmark, site } => {
            let benchmark = benchmark.as_ref().map(BenchmarkId::new);
            (site, Order::Unsilence { benchmark })
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

/// Every order that was taken, oldest first.
pub(super) fn orders(store: &Store) -> anyhow::Result<Vec<Event>> {
    every(store, "order")
}

/// Every event of a kind, oldest first.
pub(super) fn every(store: &Store, kind: &str) -> anyhow::Result<Vec<Event>> {
    let mut all = Vec::new();
    let mut after = 0;
    loop {
        let events = store.events(after, Some(kind), None)?;
        let Some((last, _)) = events.last() else {
            return Ok(all);
        };
        after = *last;
        for (_, body) in &events {
            all.push(serde_json::from_str(body)?);
        }
    }
}

/// The orders in force by which no hook is run, as they were given.
pub(super) fn silences(orders: &[Event]) -> Vec<Event> {
    let now = clock::now();
    let mut standing: Vec<Event> = Vec::new();
    for event in orders {
        let EventKind::Order { order, until, .. } = &event.kind else {
            continue;
        };
        if order == "unsilence" {
            let place = &event.benchmark;
            standing.retain(|one| place.is_some() && one.benchmark != *place);
        } else if until.is_some_and(|until| until > now) {
            standing.push(event.clone());
        }
    }
    standing
}

/// Who has seen what is in force: acknowledgements since its alert was called.
pub(super) fn acknowledged(orders: &[Event], in_force: &InForce) -> Vec<Event> {
    let is_of = |ack: &Event, place: &Option<BenchmarkId>, alert: &Event| {
        (ack.benchmark.is_none() || ack.benchmark == *place) && ack.time >= alert.time
    };
    let is_one = |event: &&Event| {
        let is_ack =
            matches!(&event.kind, EventKind::Order { order, .. } if order == "acknowledge");
        is_ack
            && in_force
                .iter()
                .any(|((place, _), alert)| is_of(event, place, alert))
    };
    orders.iter().filter(is_one).cloned().collect()
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
    let (in_force, orders) = (in_force(&store)?, orders(&store)?);
    let mut standing = silences(&orders);
    standing.extend(acknowledged(&orders, &in_force));
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
