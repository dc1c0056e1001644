//! A recording played through a site with a state folder and the page, at a pace that one can watch.

use super::clock;
use super::deliver::{Dispatcher, Retry};
use super::delivered::Delivered;
use super::hook::Status;
use super::replay::{ReplayPace, arrivals, wait};
use super::serve::{ListenError, ListenOptions, ServedState, Server};
use super::shutdown::Shutdown;
use super::site::{Sinks, Site};
use super::view::{Facts, SiteReader};
use super::vitals::Vitals;
use crate::config::HookConfig;
use crate::monitor::{Input, Settings};
use crate::reading::Recording;
use crate::store::{Store, StoreError};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// How often orders are read.
const POLL_INTERVAL: Duration = Duration::from_millis(300);
/// How long hooks may take to finish at the end.
const DRAIN_LIMIT: Duration = Duration::from_secs(10);

/// What is played, and to whom it is shown.
#[derive(Debug)]
pub struct ServedReplay<'a> {
    /// What was measured.
    pub recording: &'a Recording,
    /// How the monitor judges it.
    pub settings: Settings,
    /// How fast data time goes by.
    pub pace: ReplayPace,
    /// What the page says of the site.
    pub facts: Facts,
    /// Where the page is.
    pub options: ListenOptions,
    /// Who is notified, as in an exercise.
    pub hooks: &'a [HookConfig],
}

/// Why nothing is shown.
#[derive(Debug, thiserror::Error)]
pub enum ServedReplayError {
    /// The state cannot be used.
    #[error(transparent)]
    State(#[from] StoreError),
    /// The address cannot be listened on.
    #[error(transparent)]
    Listen(#[from] ListenError),
}

/// Plays it into the state in `folder` and stays up until `shutdown`; `opened` is called once the page is there. Needs
/// a multi-threaded tokio runtime.
///
/// # Errors
/// [`ServedReplayError`].
pub async fn show(
    served_replay: ServedReplay<'_>,
    folder: &Path,
    mut shutdown: Shutdown,
    opened: &mut (dyn FnMut(std::net::SocketAddr) + '_),
) -> Result<(), ServedReplayError> {
    let store = Arc::new(Store::open(folder)?);
    let reader = Some(Arc::new(SiteReader::open(
        folder,
        served_replay.facts.clone(),
    )?));
    let archive = Some(Arc::new(super::archive::Events::of(Arc::clone(&store))) as _);
    let vitals = Arc::new(Vitals::default());
    vitals.update(|health| (health.is_caught_up, health.is_store_writable) = (true, true));
    let behind = ServedState { archive, reader };
    let server = Server::open(served_replay.options.clone(), Arc::clone(&vitals), behind).await?;
    opened(server.address());
    let delivered = Delivered::of(Arc::clone(&store));
    let alerts = Dispatcher::start(served_replay.hooks, &Retry::default(), delivered);
    let sinks = Sinks {
        store: Some(Arc::clone(&store)),
        alerts: Some(alerts),
        status: Status::Exercise,
    };
    let site = Site::new(&served_replay.facts.name, served_replay.settings, sinks);
    let mut stage = Stage {
        site,
        store,
        vitals,
    };
    let arrivals = arrivals(served_replay.recording);
    let started = clock::later(Duration::ZERO);
    for arrival in &arrivals {
        let due =
            started + wait(served_replay.pace, arrivals[0].time, arrival.time).unwrap_or_default();
        stage.wait(Some(due), &mut shutdown).await?;
        if shutdown.is_requested() {
            break;
        }
        let events = tokio::task::block_in_place(|| stage.site.take(arrival, arrival.time))?;
        stage.site.commit(arrival.time)?;
        if let Input::Reading { benchmark, .. } = &arrival.input {
            (stage.vitals).read(benchmark, arrival.time, &events, Duration::ZERO);
        }
    }
    stage.wait(None, &mut shutdown).await?;
    server.stop().await;
    let now = stage.store.newest_step()?.unwrap_or_else(clock::now);
    // What its hooks did not take is in the log.
    stage.site.close(now, DRAIN_LIMIT).await?;
    Ok(())
}

struct Stage {
    site: Site,
    store: Arc<Store>,
    vitals: Arc<Vitals>,
}

impl Stage {
    /// Takes orders until `due`, or for ever; a stop that is asked for ends it.
    async fn wait(
        &mut self,
        due: Option<tokio::time::Instant>,
        shutdown: &mut Shutdown,
    ) -> Result<(), StoreError> {
        loop {
            self.vitals.turned();
            for order in self.store.orders()? {
                self.site.order(order)?;
                // The time of the data is all there is.
                let now = self.store.newest_step()?.unwrap_or_else(clock::now);
                self.site.commit(now)?;
            }
            let next = clock::later(POLL_INTERVAL);
            let next = due.map_or(next, |due| due.min(next));
            tokio::select! {
                () = tokio::time::sleep_until(next) => {}
                () = shutdown.requested() => return Ok(()),
            }
            if due.is_some_and(|due| next >= due) {
                return Ok(());
            }
        }
    }
}
