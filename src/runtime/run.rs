//! The daemon: files to the monitor, events to the state folder, alerts to the hooks.

use super::clock::{self, Stopwatch};
use super::deliver::{Dispatcher, Retry};
use super::delivered::Delivered;
use super::event_log::EventLog;
use super::hook::Status;
use super::pulse::{Pulse, PulseError};
use super::sandbox;
use super::shutdown::{self, Shutdown};
use super::site::{Counts, Sinks, Site};
use super::tail::{self, Arrival, Batch, Follower};
use crate::config::Config;
use crate::monitor::Input;
use std::fs::{File, TryLockError};
use std::io;
use std::path::PathBuf;
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;

/// Batches between the files and the monitor.
const BATCHES: usize = 4;
/// How long the hooks may take to finish when the daemon stops.
const DRAIN_LIMIT: Duration = Duration::from_secs(20);
/// How often time is let pass when nothing arrives.
const TICK: Duration = Duration::from_secs(1);

/// How far the daemon has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// What has been counted.
    pub counts: Counts,
    /// Whether the past has been read.
    pub is_caught_up: bool,
}

/// Why the daemon ended other than by being asked to.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The state folder cannot be used.
    #[error("state folder {}: {source}", .folder.display())]
    State {
        /// The folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another daemon works on the state folder.
    #[error("state folder {}: another slipwatch is at work on it", .folder.display())]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// Nobody could be let in to ask.
    #[error(transparent)]
    Pulse(#[from] PulseError),
    /// The part that follows the files broke off.
    #[error("following the files broke off: {0}")]
    Follow(#[from] tokio::task::JoinError),
}

/// Runs the site until `shutdown` is asked for and returns what it has counted, which `progress`
/// shows on the way; needs a multi-threaded tokio runtime.
///
/// Every file is read from its start each time: there are no saved offsets yet, the past is
/// rebuilt. What was written to `events.ndjson` is not written again, and what a hook has taken
/// according to `delivered.ndjson` is not sent again.
///
/// # Errors
/// [`RunError`]; being asked to stop is none.
pub async fn run(
    config: &Config,
    shutdown: Shutdown,
    progress: &watch::Sender<Progress>,
) -> Result<Counts, RunError> {
    let State {
        events,
        delivered,
        lock: _lock,
    } = State::open(config)?;
    if let Err(error) = shutdown::survive_the_file_limit() {
        tracing::warn!(%error, "a limit on the length of files would end this process");
    }
    for what in config.without_effect() {
        tracing::warn!("{what}");
    }
    sandbox::announce(&config.hooks);
    let mut pulse = Pulse::start(&config.site, None).await?;
    let dispatcher = Dispatcher::start(&config.hooks, &Retry::default(), delivered);
    let sinks = Sinks {
        events,
        alerts: Some(dispatcher),
        status: Status::Actual,
    };
    let mut site = Site::new(&config.site.name, config.settings.clone(), sinks);
    let follower = Follower::new(&config.sources, &config.benchmarks);
    // Stops the sources when this function ends for whatever reason.
    let (stop, stopped) = shutdown::pair();
    let (sender, receiver) = mpsc::channel(BATCHES);
    let source = tokio::spawn(tail::follow(follower, sender, stopped));
    tracing::info!(site = config.site.name, state = %config.site.state_dir.display(), "started");
    let worked = work(&mut site, receiver, shutdown, progress, &mut pulse).await;
    stop.pull();
    pulse.stop().await;
    let counts = site.counts();
    let closed = site.close(clock::now(), DRAIN_LIMIT).await;
    tracing::info!(?counts, "stopped");
    let followed = joined(source).await;
    let folder = config.site.state_dir.clone();
    (worked.and(closed.map(drop))).map_err(|source| RunError::State { folder, source })?;
    followed.map(|()| counts)
}

async fn joined(source: JoinHandle<Result<(), tokio::task::JoinError>>) -> Result<(), RunError> {
    Ok(source.await??)
}

/// Takes batches until the stop is asked for or the source has ended.
async fn work(
    site: &mut Site,
    mut batches: mpsc::Receiver<Batch>,
    mut shutdown: Shutdown,
    progress: &watch::Sender<Progress>,
    pulse: &mut Pulse,
) -> io::Result<()> {
    // Once, and as of the last batch: a logger that was away hands in its backlog in several.
    let (mut is_caught_up, mut is_up_to_date) = (false, false);
    let mut tick = tokio::time::interval(TICK);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        pulse.turn();
        tokio::select! {
            biased;
            () = shutdown.requested() => return Ok(()),
            batch = batches.recv() => {
                let Some(batch) = batch else { return Ok(()) };
                let still = shutdown.clone();
                tokio::task::block_in_place(|| take_batch(site, &batch, &still, pulse))?;
                is_up_to_date = batch.caught_up;
                if is_up_to_date {
                    site.caught_up(clock::now());
                }
                let counts = site.counts();
                if is_up_to_date && !is_caught_up {
                    is_caught_up = true;
                    pulse.caught_up();
                    tracing::info!(?counts, "caught up");
                }
                progress.send_replace(Progress { counts, is_caught_up });
            }
            // Data time is the clock's only once the past has been read.
            _ = tick.tick() => if is_caught_up {
                tokio::task::block_in_place(|| pass(site, pulse, is_up_to_date))?;
            },
        }
    }
}

/// Lets time go by to the present.
fn pass(site: &mut Site, pulse: &Pulse, is_up_to_date: bool) -> io::Result<()> {
    let now = clock::now();
    pulse.vitals.note(&site.pass(now));
    site.commit(now)?;
    if is_up_to_date {
        site.caught_up(now);
    }
    Ok(())
}

/// Steps the monitor through a batch; a stop that is asked for half-way ends it after a value.
fn take_batch(
    site: &mut Site,
    batch: &Batch,
    shutdown: &Shutdown,
    pulse: &mut Pulse,
) -> io::Result<()> {
    for arrival in &batch.arrivals {
        if shutdown.is_requested() {
            break;
        }
        take(site, arrival, pulse);
        pulse.turn();
    }
    let committed = site.commit(clock::now());
    let counts = site.counts();
    pulse.vitals.update(|health| {
        health.is_store_writable = committed.is_ok();
        health.readings = counts.taken;
        health.repeated = counts.repeated;
        health.from_the_future = counts.from_the_future;
        health.unwritten = counts.unwritten;
    });
    committed
}

fn take(site: &mut Site, arrival: &Arrival, pulse: &Pulse) {
    let stopwatch = Stopwatch::start();
    let taken = site.counts().taken;
    let events = site.take(arrival, clock::now());
    match &arrival.input {
        Input::Reading { benchmark, .. } if site.counts().taken > taken => {
            let took = stopwatch.elapsed();
            pulse.vitals.read(benchmark, arrival.time, &events, took);
        }
        Input::Reading { .. }
        | Input::Sample { .. }
        | Input::Missing { .. }
        | Input::Tick
        | Input::Found(_) => {
            pulse.vitals.note(&events);
        }
    }
}

#[derive(Debug)]
struct State {
    events: EventLog,
    delivered: Delivered,
    /// Held as long as the daemon runs.
    lock: File,
}

impl State {
    fn open(config: &Config) -> Result<Self, RunError> {
        let folder = &config.site.state_dir;
        let fail = |source| RunError::State {
            folder: folder.clone(),
            source,
        };
        std::fs::create_dir_all(folder).map_err(fail)?;
        let lock = File::create(folder.join("lock")).map_err(fail)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let folder = folder.clone();
                return Err(RunError::InUse { folder });
            }
            Err(TryLockError::Error(source)) => return Err(fail(source)),
        }
        Ok(Self {
            events: EventLog::open(&folder.join("events.ndjson")).map_err(fail)?,
            delivered: Delivered::open(&folder.join("delivered.ndjson")).map_err(fail)?,
            lock,
        })
    }
}
