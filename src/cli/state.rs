//! Asks a site's state, or leaves an order in it: beside a running daemon or without one.

use super::args::{Format, OutputArgs};
use super::exit::UsageError;
use super::table::Table;
use super::text;
use crate::alert::Level;
use crate::config::{self, Config, value};
use crate::monitor::{AlertState, Event, EventKind, Order};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::clock;
use crate::store::Store;
use anyhow::Context;
use clap::Subcommand;
use jiff::SignedDuration;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

/// `--config`.
#[derive(Debug, clap::Args)]
struct SiteArgs {
    /// The site whose daemon, or whose state, is asked
    #[arg(long, value_name = "CONFIG")]
    config: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

impl SiteArgs {
    fn open(&self) -> anyhow::Result<(Config, Store)> {
        let config = config::load(&self.config)?;
        let folder = &config.site.state_dir;
        let store = Store::look(folder)
            .with_context(|| format!("cannot read the state in {}", folder.display()))?;
        Ok((config, store))
    }
}

/// Say what a site's benchmarks do: level, regime, failure time, newest reading
#[derive(Debug, clap::Args)]
pub(super) struct StatusArgs {
    #[command(flatten)]
    site: SiteArgs,
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
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
    /// Wait for more, until interrupted
    #[arg(long)]
    follow: bool,
}

/// List the alerts in force, or say that they are seen, or that they are not to be told for a time
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
    /// Do not tell of the level in force at a benchmark, or a lower one; a higher one is told at once
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
    /// Tell again, from now on, of what was silenced or shelved
    Unsilence {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Tell of nothing, red neither; what is in force at the end is told then
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

/// How one benchmark stands.
#[derive(Debug, Serialize)]
struct Standing {
    benchmark: BenchmarkId,
    level: Level,
    /// Since when.
    since: Option<Timestamp>,
    /// Since when the monitor cannot tell: no data, a sensor fault.
    unknown_since: Option<Timestamp>,
    /// Whether nothing can be said of it now; so it is before its first reading.
    is_unknown: bool,
    newest_reading: Option<Timestamp>,
    regime: Option<String>,
    velocity_mm_per_day: Option<f64>,
    failure_time: Option<Timestamp>,
    chance_within_evacuation_time: Option<f64>,
}

#[derive(Debug, Serialize)]
struct SiteStatus {
    site: String,
    benchmarks: Vec<Standing>,
    steps: i64,
    alerts_waiting: usize,
    bytes: u64,
    /// Since when nothing can be said of the site: too many benchmarks are unknown, or the clock is wrong.
    site_unknown_since: Option<Timestamp>,
    /// The orders by which alerts are not told.
    silences: Vec<Event>,
}

/// Says how the site stands.
pub(super) fn status(args: &StatusArgs) -> anyhow::Result<()> {
    let (config, store) = args.site.open()?;
    let levels = in_force(&store)?;
    let mut refits = BTreeMap::new();
    for body in store.latest("refit")? {
        let event: Event = serde_json::from_str(&body)?;
        if let Some(benchmark) = event.benchmark {
            refits.insert(benchmark, event.kind);
        }
    }
    let mut newest: BTreeMap<BenchmarkId, Option<Timestamp>> = BTreeMap::new();
    newest.extend(config.benchmarks.iter().map(|one| (one.id.clone(), None)));
    let read = store.benchmarks()?.into_iter();
    newest.extend(read.map(|(benchmark, time)| (benchmark, Some(time))));
    let each = newest.into_iter().map(|(benchmark, newest)| {
        let standing = Standing {
            level: Level::Green,
            since: None,
            unknown_since: None,
            is_unknown: newest.is_none(),
            newest_reading: newest,
            regime: None,
            velocity_mm_per_day: None,
            failure_time: None,
            chance_within_evacuation_time: None,
            benchmark,
        };
        stands(standing, &levels, &refits)
    });
    let status = SiteStatus {
        site: config.site.name,
        benchmarks: each.collect(),
        steps: store.last_step(),
        alerts_waiting: store.waiting()?.len(),
        bytes: store.bytes()?,
        site_unknown_since: levels.get(&(None, Level::Unknown)).map(|event| event.time),
        silences: silences(&store)?,
    };
    args.site.output.print(&status, status_text)
}

type InForce = BTreeMap<(Option<BenchmarkId>, Level), Event>;

fn stands(
    mut standing: Standing,
    levels: &InForce,
    refits: &BTreeMap<BenchmarkId, EventKind>,
) -> Standing {
    for ((place, level), event) in levels {
        if place.as_ref() != Some(&standing.benchmark) {
            continue;
        }
        if *level == Level::Unknown {
            (standing.unknown_since, standing.is_unknown) = (Some(event.time), true);
        } else {
            (standing.level, standing.since) = (*level, Some(event.time));
        }
    }
    if let Some(EventKind::Refit {
        regime,
        failure_time,
        velocity_mm_per_day,
        chance_within_evacuation_time,
        ..
    }) = refits.get(&standing.benchmark)
    {
        standing.regime = Some(regime.label.to_string());
        standing.velocity_mm_per_day = *velocity_mm_per_day;
        standing.failure_time = failure_time.median;
        standing.chance_within_evacuation_time = Some(*chance_within_evacuation_time);
    }
    standing
}

fn status_text(status: &SiteStatus) -> String {
    let mut table = Table::headed([
        "benchmark",
        "level",
        "since",
        "newest reading",
        "regime",
        "mm/day",
        "failure (median)",
    ]);
    let time = |time: Option<Timestamp>| time.map_or_else(|| "-".to_owned(), text::minute);
    for one in &status.benchmarks {
        let velocity = one
            .velocity_mm_per_day
            .map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        table.row([
            text::plain(one.benchmark.as_str()),
            if one.is_unknown {
                format!("{}, unknown", one.level)
            } else {
                one.level.to_string()
            },
            time(one.unknown_since.or(one.since)),
            time(one.newest_reading),
            one.regime.clone().unwrap_or_else(|| "-".to_owned()),
            velocity,
            time(one.failure_time),
        ]);
    }
    let silences = status.silences.iter();
    let silences: String = silences.map(|event| text::line(event) + "\n").collect();
    format!(
        "{}: {} inputs taken, {} alerts wait for a hook\n{silences}\n{table}",
        text::plain(&status.site),
        status.steps,
        status.alerts_waiting
    )
}

/// The alerts in force: by benchmark and level, of each benchmark the highest, and `unknown` beside it.
fn in_force(store: &Store) -> anyhow::Result<InForce> {
    let mut standing = InForce::new();
    let mut after = 0;
    loop {
        let events = store.events(after, Some("alert"), None)?;
        let Some((last, _)) = events.last() else {
            return Ok(standing);
        };
        after = *last;
        for (_, body) in &events {
            let event: Event = serde_json::from_str(body)?;
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
    }
}

/// Prints events.
pub(super) fn events(args: &EventsArgs) -> anyhow::Result<()> {
    let (_, store) = args.site.open()?;
    let mut stdout = std::io::stdout().lock();
    let mut after = 0;
    loop {
        let events = store.events(after, args.kind.as_deref(), args.benchmark.as_deref())?;
        for (seq, body) in &events {
            after = *seq;
            match args.site.output.format {
                Format::Json => writeln!(stdout, "{body}")?,
                Format::Text => writeln!(stdout, "{}", text::line(&serde_json::from_str(body)?))?,
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
        let told =
            format!("--for {span:#} is too long: {hours}h at most, then give the order again");
        return Err(UsageError(told).into());
    }
    Ok(())
}

/// The orders in force by which alerts are not told, as they were given.
fn silences(store: &Store) -> anyhow::Result<Vec<Event>> {
    let now = clock::now();
    let mut standing: Vec<Event> = Vec::new();
    let mut after = 0;
    loop {
        let events = store.events(after, Some("order"), None)?;
        let Some((last, _)) = events.last() else {
            return Ok(standing);
        };
        after = *last;
        for (_, body) in &events {
            let event: Event = serde_json::from_str(body)?;
            let EventKind::Order { order, until, .. } = &event.kind else {
                continue;
            };
            if order == "unsilence" {
                let place = &event.benchmark;
                standing.retain(|one| place.is_some() && one.benchmark != *place);
            } else if until.is_some_and(|until| until > now) {
                standing.push(event);
            }
        }
    }
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
    let (_, store) = site.open()?;
    let mut stdout = std::io::stdout().lock();
    let mut standing: Vec<Event> = in_force(&store)?.into_values().collect();
    standing.extend(silences(&store)?);
    standing.sort_by_key(|event| event.time);
    for event in &standing {
        match site.output.format {
            Format::Json => writeln!(stdout, "{}", serde_json::to_string(event)?)?,
            Format::Text => writeln!(stdout, "{}", text::line(event))?,
        }
    }
    Ok(())
}
