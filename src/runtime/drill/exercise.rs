//! One drill: a site of its own follows a file of its own, in which a simulated slope fails.

use super::DrillContext;
use super::runner::DrillObserver;
use crate::alert::Level;
use crate::config::{self, Config, Drill, EXERCISE, HookConfig};
use crate::monitor::{EventKind, Given, KindShown, Order, OrderKind, Settings, Watched};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::clock::{self, Stopwatch};
use crate::runtime::daemon::Daemon;
use crate::runtime::deliver::{Dispatcher, Retry, Runner};
use crate::runtime::delivered::Delivered;
use crate::runtime::drilled::{PassedDrill, folder};
use crate::runtime::hook::{HookOutcome, Status};
use crate::runtime::reporting::Reporting;
use crate::runtime::shutdown::Shutdown;
use crate::runtime::site::{Sinks, Site};
use crate::runtime::sources::Sources;
use crate::runtime::standing::every;
use crate::store::{LeftOrder, Store};
use anyhow::Context as _;
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::Interval;

/// By when each hook must have taken the alert.
const LIMIT: Duration = Duration::from_secs(600);
/// By when the hooks must have taken its end.
const END_LIMIT: Duration = Duration::from_secs(60);
/// Readings an hour apart: those of the past, and those that are appended.
const PAST: Range<i32> = 0..30;
const APPENDED: Range<i32> = 30..114;
/// The made-up collapse lies so many hours after the first reading.
const COLLAPSE_HOURS: f64 = 120.0;
/// Displacement over the time in which the time left falls to 1/e, mm.
const SCALE_MM: f64 = 200.0;

/// A drill under way.
struct Exercise {
    daemon: Daemon,
    watched: DrillObserver,
    tick: Interval,
    shutdown: Shutdown,
}

/// Holds one drill to its end.
///
/// # Errors
/// Why it failed, one line for people.
pub(super) async fn hold(
    context: &DrillContext,
    drill: &Drill,
    shutdown: &Shutdown,
) -> Result<PassedDrill, String> {
    let started = clock::now();
    let file = made(context, started).map_err(|error| format!("its folder: {error}"))?;
    let hooks = hooks(&context.config);
    let mut exercise = Exercise::start(context, &hooks, shutdown)
        .map_err(|error| format!("it could not be started: {error}"))?;
    let held = exercise
        .held(&file, started, hooks.len(), context, drill)
        .await;
    Box::pin(exercise.end(hooks.len())).await;
    held
}

/// The hooks that drills reach: each at once, for the red of the drill's benchmark alone.
fn hooks(config: &Config) -> Vec<HookConfig> {
    let reached = config.hooks.iter().filter(|hook| hook.extra.drills);
    let of_the_drill = |hook: &HookConfig| HookConfig {
        levels: vec![Level::Red],
        benchmarks: BTreeSet::new(),
        site: false,
        escalate_after: None,
        hours: None,
        ..hook.clone()
    };
    reached.map(of_the_drill).collect()
}

/// The folder, without what the last drill left, and the file with the past in it.
fn made(context: &DrillContext, started: Timestamp) -> io::Result<PathBuf> {
    let folder = run_folder(context);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let file = folder.join(format!("{EXERCISE}.csv"));
    let text = format!("time,displacement_mm\n{}", rows(PAST, started));
    fs::write(&file, text)?;
    Ok(file)
}

fn run_folder(context: &DrillContext) -> PathBuf {
    folder(&context.config.site.state_dir).join("run")
}

/// Readings of a slope that fails, the last of all now: 1/v falls on a straight line.
fn rows(range: Range<i32>, now: Timestamp) -> String {
    let mut text = String::new();
    for row in range {
        let ago = SignedDuration::from_hours(i64::from(APPENDED.end - 1 - row));
        let time = now.saturating_sub(ago).unwrap_or(now);
        let left = COLLAPSE_HOURS - f64::from(row);
        let value = SCALE_MM * (COLLAPSE_HOURS / left).ln();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{time},{value:.4}");
    }
    text
}

/// The file is appended to as a logger does, and is on the disk when this returns.
fn append(file: &Path, text: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().append(true).open(file)?;
    file.write_all(text.as_bytes())?;
    file.sync_data()
}

impl Exercise {
    fn start(
        context: &DrillContext,
        hooks: &[HookConfig],
        shutdown: &Shutdown,
    ) -> anyhow::Result<Self> {
        let folder = run_folder(context);
        let text = format!(
            "[site]\nname = \"drill\"\nstate_dir = \"state\"\n\
             [[source]]\nid = \"{EXERCISE}\"\nkind = \"csv\"\npath = \"{EXERCISE}.csv\"\n\
             [[benchmark]]\nid = \"{EXERCISE}\"\nsource = \"{EXERCISE}\"\n\
             [alert]\nevacuation_time = \"3h\"\n[explain]\nsearch = false\n"
        );
        let config = config::parse(&text, &folder.join("drill.toml"))?;
        let store = Arc::new(Store::open(&config.site.state_dir)?);
        let watched = DrillObserver::default();
        let runner: Arc<dyn Runner> = Arc::new(watched.clone());
        let delivered = Delivered::of(Arc::clone(&store));
        let sinks = Sinks {
            store: Some(Arc::clone(&store)),
            alerts: Some(Dispatcher::with(
                &runner,
                hooks,
                &Retry::default(),
                delivered,
            )),
            status: Status::Exercise,
        };
        let name = &context.config.site.name;
        let mut goes_on = || ControlFlow::Continue(());
        let site = Site::resume(name, config.settings.clone(), sinks, &mut goes_on)?;
        let site = site.context("nothing breaks it off")?;
        let reporting = Reporting::inward();
        let sources = Sources::start(&config, &store, reporting.vitals.faults())?;
        let daemon = Daemon::new(&config, store, site, sources, reporting, clock::now);
        Ok(Self {
            daemon,
            watched,
            tick: Daemon::ticks(),
            shutdown: shutdown.clone(),
        })
    }

    async fn held(
        &mut self,
        file: &Path,
        started: Timestamp,
        hooks: usize,
        context: &DrillContext,
        drill: &Drill,
    ) -> Result<PassedDrill, String> {
        self.until(LIMIT, "its past was not read", |daemon, _| {
            daemon.reporting.vitals.health().is_caught_up
        })
        .await?;
        if self.watched.seen().begun.is_some() {
            return Err("it was red before its last readings".to_owned());
        }
        self.watched.seen().appended = Some(Stopwatch::start());
        append(file, &rows(APPENDED, started)).map_err(|error| format!("its file: {error}"))?;
        let taken = |_: &Daemon, watched: &DrillObserver| {
            let seen = watched.seen();
            let done = seen
                .outcomes
                .values()
                .filter(|one| **one == HookOutcome::Done);
            done.count() == hooks
        };
        let reached = self
            .until(LIMIT, "not every hook has taken it", taken)
            .await;
        reached.map_err(|why| self.explained(&why))?;
        let latency = self.watched.seen().latency.unwrap_or_default();
        let acknowledged = match drill.acknowledge_within {
            Some(within) => Some(self.acknowledged(context, started, within).await?),
            None => None,
        };
        Ok(PassedDrill {
            latency,
            acknowledged,
        })
    }

    /// Goes on until `is_so`.
    async fn until(
        &mut self,
        limit: Duration,
        what: &str,
        is_so: impl Fn(&Daemon, &DrillObserver) -> bool,
    ) -> Result<(), String> {
        let begun = Stopwatch::start();
        while !is_so(&self.daemon, &self.watched) {
            if begun.elapsed() > limit {
                return Err(format!("{what} within {limit:?}"));
            }
            let next = self.daemon.take_next(&mut self.tick, &self.shutdown).await;
            if !next.map_err(|error| error.to_string())? {
                return Err("its file is not followed any more".to_owned());
            }
        }
        Ok(())
    }

    /// Where no hook has begun no level was called.
    fn explained(&self, why: &str) -> String {
        let seen = self.watched.seen();
        if seen.begun.is_none() {
            return format!("{why}: no red was called, or no hook was run");
        }
        let failed = seen
            .outcomes
            .iter()
            .filter(|(_, one)| **one != HookOutcome::Done);
        let failed = failed.map(|(name, outcome)| format!("{name}: {outcome:?}"));
        format!("{why}: {}", failed.collect::<Vec<_>>().join("; "))
    }

    /// Waits for somebody to acknowledge it: the order stands in the site's own log, whatever way it came by.
    async fn acknowledged(
        &mut self,
        context: &DrillContext,
        started: Timestamp,
        within: SignedDuration,
    ) -> Result<Duration, String> {
        let begun = self.watched.seen().begun.unwrap_or_else(Stopwatch::start);
        let within = within.unsigned_abs();
        loop {
            let found =
                acknowledgement(&context.store, started).map_err(|error| error.to_string())?;
            if let Some(given) = found {
                let order = Order::Acknowledge {
                    benchmark: Some(BenchmarkId::new(EXERCISE)),
                    alert: None,
                    given,
                };
                // It did not come through this state: it has no number there.
                let order = LeftOrder {
                    number: 0,
                    order,
                    last_event: None,
                };
                let taken = self.daemon.site.order(order);
                taken.map_err(|error| error.to_string())?;
                return Ok(begun.elapsed());
            }
            if begun.elapsed() > within {
                return Err(format!("nobody has acknowledged it within {within:?}"));
            }
            let next = self.daemon.take_next(&mut self.tick, &self.shutdown).await;
            next.map_err(|error| error.to_string())?;
        }
    }

    /// The benchmark is watched no more, which ends its alert; the hooks get that end too.
    async fn end(mut self, hooks: usize) {
        let settings = Settings {
            watched: Watched {
                named: BTreeSet::new(),
                is_open: false,
                read_as: BTreeMap::new(),
                sources: BTreeMap::new(),
                open: BTreeMap::new(),
            },
            ..self.daemon.config.settings.clone()
        };
        self.daemon.site.change_settings(settings);
        if self.watched.seen().begun.is_some() {
            let ended = |_: &Daemon, watched: &DrillObserver| watched.seen().ended >= hooks;
            if let Err(why) = self
                .until(END_LIMIT, "not every hook has taken its end", ended)
                .await
            {
                tracing::warn!(why, "the end of a drill");
            }
        }
        let Daemon { site, sources, .. } = self.daemon;
        sources.stop();
        if let Err(error) = site.close(clock::now(), END_LIMIT).await {
            tracing::warn!(%error, "the state of a drill");
        }
        if let Err(error) = sources.join().await {
            tracing::warn!(%error, "the file of a drill");
        }
    }
}

/// Who has acknowledged a drill since `started`.
fn acknowledgement(
    store: &Store,
    started: Timestamp,
) -> Result<Option<Given>, crate::store::StoreError> {
    let orders = every(store, KindShown::ORDER.name)?;
    Ok(orders.into_iter().rev().find_map(|event| {
        let is_of_it = event.benchmark.as_ref().map(BenchmarkId::as_str) == Some(EXERCISE);
        let EventKind::Order { order, given, .. } = event.kind else {
            return None;
        };
        let is_since = given.given_at.is_some_and(|at| at >= started);
        (is_of_it && order == OrderKind::Acknowledge && is_since).then_some(given)
    }))
}
