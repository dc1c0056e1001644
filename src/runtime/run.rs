//! The daemon: files to the monitor, everything to the state folder, alerts to the hooks.

use super::beside::SideTasks;
use super::clock;
use super::daemon::{DRAIN_LIMIT, Daemon, dispatcher};
use super::hook::Status;
use super::link;
use super::progress::Progress;
use super::record::live::EventWords;
use super::reporting::{Reporting, ReportingError};
use super::restored;
use super::serve::ServedState;
use super::shutdown::{self, Shutdown};
use super::site::{Counts, Sinks, Site};
use super::sources::Sources;
use super::standing::in_force;
use super::view::{Facts, SiteReader};
use super::vitals::Vitals;
use crate::alert::Level;
use crate::config::Config;
use crate::reading::BenchmarkId;
use crate::store::{Store, StoreError};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

/// Why the daemon ended other than by being asked to.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The state folder cannot be used, or no longer.
    #[error("state folder {}: {source}", .folder.display())]
    State {
        /// The folder.
        folder: PathBuf,
        /// What is wrong with it.
        source: StoreError,
    },
    /// The address at which the daemon is asked cannot be used.
    #[error(transparent)]
    Reporting(#[from] ReportingError),
    /// The part that follows the files broke off.
    #[error("following the files broke off: {0}")]
    Follow(#[from] tokio::task::JoinError),
}

/// Runs the site until `shutdown` is asked for and returns what it has counted, which `progress`
/// shows on the way; needs a multi-threaded tokio runtime.
///
/// It goes on where its state was last committed: files from where they had been read, the monitor from what it
/// remembered, alerts that no hook had taken. `words` gives an event's line for a person, in the record.
///
/// # Errors
/// [`RunError`]; being asked to stop is none.
pub async fn run(
    config: &Config,
    shutdown: Shutdown,
    progress: &watch::Sender<Progress>,
    words: EventWords,
) -> Result<Counts, RunError> {
    let fail = |source| RunError::State {
        folder: config.site.state_dir.clone(),
        source,
    };
    // From the start on: until somebody listens the signal would end the process.
    let hangup = signal(SignalKind::hangup()).map_err(|error| fail(error.into()))?;
    let store = Arc::new(Store::open(&config.site.state_dir).map_err(fail)?);
    if let Err(error) = shutdown::survive_the_file_limit() {
        tracing::warn!(%error, "a limit on the length of files would end this process");
    }
    let is_restored = restored::offer_again(&store).map_err(fail)?;
    link::make_secret_of(config);
    let vitals = Arc::new(Vitals::default());
    show_stored(config, &store, &vitals).map_err(fail)?;
    let behind = ServedState {
        archive: Some(Arc::new(super::archive::Events::of(Arc::clone(&store)))),
        reader: reader(config, &vitals),
    };
    let mut reporting = Reporting::start(&config.site, vitals, behind).await?;
    let sinks = Sinks {
        store: Some(Arc::clone(&store)),
        alerts: Some(dispatcher(config, &store, reporting.vitals.faults())),
        status: Status::Actual,
    };
    let resume = || resumed(config, sinks, &mut reporting, &shutdown);
    let Some(site) = tokio::task::block_in_place(resume).map_err(fail)? else {
        reporting.stop().await;
        tracing::info!("stopped before all stored readings had been judged again");
        return Ok(Counts::default());
    };
    site.show(&reporting.vitals);
    reporting.vitals.retain(|benchmark| site.shows(benchmark));
    for (source, count) in store.quarantined().map_err(fail)? {
        reporting.vitals.quarantined(&source, count);
    }
    let beside = SideTasks::start(config, &store, &reporting.vitals, &shutdown, words);
    let sources = Sources::start(config, &store, reporting.vitals.faults()).map_err(fail)?;
    let mut daemon = Daemon::new(config, store, site, sources, reporting, clock::now);
    daemon.beside = Some(beside);
    daemon.note_inherited(config).map_err(fail)?;
    daemon.note_restored(is_restored).map_err(fail)?;
    tracing::info!(site = config.site.name, state = %config.site.state_dir.display(), "started");
    let worked = daemon.work(shutdown, hangup, progress).await;
    let Daemon {
        site,
        sources,
        reporting,
        beside,
        ..
    } = daemon;
    sources.stop();
    let record = match beside {
        Some(beside) => beside.stop().await,
        None => None,
    };
    reporting.stop().await;
    let counts = site.counts();
    let closed = site.close(clock::now(), DRAIN_LIMIT).await;
    if let Some(record) = record {
        record.close(DRAIN_LIMIT).await;
    }
    log_counts(&counts);
    let followed = sources.join().await;
    worked.and(closed.map(drop)).map_err(fail)?;
    followed?;
    Ok(counts)
}

fn log_counts(counts: &Counts) {
    tracing::info!(
        taken = counts.taken,
        repeated = counts.repeated,
        from_the_future = counts.from_the_future,
        without_clock = counts.without_clock,
        long_past = counts.long_past,
        "stopped"
    );
}

/// The site as its state has it; `None` where `shutdown` is asked for meanwhile.
fn resumed(
    config: &Config,
    sinks: Sinks,
    reporting: &mut Reporting,
    shutdown: &Shutdown,
) -> Result<Option<Site>, StoreError> {
    let mut turn = || {
        reporting.turn();
        if shutdown.is_requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    Site::resume(&config.site.name, config.settings.clone(), sinks, &mut turn)
}

/// Shows how the benchmarks stood when the last events were written: until the steps since then are judged again nothing newer is
/// known, and a benchmark that is unknown is not to look as if it were not.
fn show_stored(config: &Config, store: &Store, vitals: &Vitals) -> Result<(), StoreError> {
    let read = store.benchmarks()?;
    let standing = in_force(store, None)?;
    let named = config.settings.watched.named.iter();
    let all: BTreeSet<&BenchmarkId> = read.keys().chain(named).collect();
    for benchmark in all {
        let newest = read.get(benchmark).copied();
        let own = standing
            .keys()
            .filter(|(place, _)| place.as_ref() == Some(benchmark));
        let (unknown, called): (Vec<Level>, Vec<Level>) = own
            .map(|(_, level)| *level)
            .partition(|level| *level == Level::Unknown);
        let level = called.into_iter().max().unwrap_or(Level::Green);
        let is_unknown = newest.is_none() || !unknown.is_empty();
        vitals.resume(benchmark, newest, level, is_unknown);
    }
    Ok(())
}

/// What the page asks, where the site listens. A page that cannot be shown is no reason not to watch.
fn reader(config: &Config, vitals: &Arc<Vitals>) -> Option<Arc<SiteReader>> {
    config.site.listen?;
    match SiteReader::open(&config.site.state_dir, Facts::of(config)) {
        Ok(reader) => Some(Arc::new(reader.of_daemon(Arc::clone(vitals)))),
        Err(error) => {
            tracing::error!(%error, "the page cannot be shown");
            None
        }
    }
}
