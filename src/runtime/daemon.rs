//! The daemon's work loop: takes what comes, lets time go by, carries out people's orders, takes up another config on request.

mod reload;
mod turns;
mod upkeep;

use self::turns::PreferredSource;
use super::beside::SideTasks;
use super::clock::Stopwatch;
use super::deliver::{Dispatcher, Retry};
use super::delivered::Delivered;
use super::log;
use super::mqtt;
use super::progress::Progress;
use super::reporting::Reporting;
use super::service_faults::{ServiceFault, ServiceFaults};
use super::shutdown::Shutdown;
use super::site::{Site, announce_ends};
use super::sources::Sources;
use super::tail::{Arrival, ArrivalBatch};
use crate::config::Config;
use crate::monitor::Input;
use crate::reading::Timestamp;
use crate::store::{Position, Store, StoreError, Verified};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;
use tokio::signal::unix::Signal;
use tokio::sync::watch;

/// How long the hooks may take to finish when the daemon stops, and those of a former config.
pub(super) const DRAIN_LIMIT: Duration = Duration::from_secs(20);
/// An alert that people are to be notified of at once waits no longer than this for others.
const URGENT: Duration = Duration::from_secs(2);
/// When nothing has come for this long, what queued is judged.
const QUIET: Duration = Duration::from_millis(50);
/// So many steps of a backlog of files are written together: to write a page once for many values costs less than once a batch.
const MOST_TOGETHER_WRITTEN: usize = 8_000;
/// How often time is let pass when nothing arrives.
const TICK: Duration = Duration::from_secs(1);

/// A site with what feeds it and what shows how it is.
#[derive(Debug)]
pub struct Daemon {
    pub(super) config: Config,
    /// See [`reload::read_by_hooks`].
    read_by_hooks: u64,
    pub(super) store: Arc<Store>,
    /// The site.
    pub site: Site,
    /// What feeds it.
    pub sources: Sources,
    /// What shows how it is.
    pub reporting: Reporting,
    /// The host's clock.
    host_time: fn() -> Timestamp,
    /// Once, and as of the last batch: a logger that was away hands in its backlog in several.
    is_caught_up: bool,
    is_up_to_date: bool,
    /// The files; brokers may still have to send what they kept.
    files_are_read: bool,
    /// How far files have been read by what was taken, while some of it is held.
    positions: Vec<Position>,
    /// Since the last commit.
    since_commit: Stopwatch,
    since_orders: Stopwatch,
    since_tick: Stopwatch,
    preferred: PreferredSource,
    /// Lines, records and files that could not be used, as the state has it.
    quarantined: BTreeMap<String, u64>,
    /// What lasts and keeps it from its work, as it has written it into the state folder.
    faults: Option<Vec<ServiceFault>>,
    /// How far the rows of the state have been looked at.
    verified: Verified,
    /// What it is to report once the past has been read: that its state holds nothing but readings of files that are not read.
    pub(super) inherited: Option<String>,
    /// What works beside it; nothing in a simulation.
    pub(super) beside: Option<SideTasks>,
}

/// The way to the hooks of `config`.
pub(super) fn dispatcher(
    config: &Config,
    store: &Arc<Store>,
    faults: &ServiceFaults,
) -> Dispatcher {
    reload::announce_hooks(config, faults);
    let delivered = Delivered::of(Arc::clone(store)).reporting(faults);
    Dispatcher::start(&config.hooks, &Retry::default(), delivered)
}

impl Daemon {
    /// The daemon on a site that has been resumed from `store`; `host_time` is the host's clock.
    pub fn new(
        config: &Config,
        store: Arc<Store>,
        site: Site,
        sources: Sources,
        reporting: Reporting,
        host_time: fn() -> Timestamp,
    ) -> Self {
        Self {
            config: config.clone(),
            read_by_hooks: reload::read_by_hooks(config),
            store,
            site,
            sources,
            reporting,
            host_time,
            is_caught_up: false,
            is_up_to_date: false,
            files_are_read: false,
            positions: Vec::new(),
            since_commit: Stopwatch::start(),
            since_orders: Stopwatch::start(),
            since_tick: Stopwatch::start(),
            preferred: PreferredSource::Files,
            quarantined: BTreeMap::new(),
            faults: None,
            verified: Verified::default(),
            inherited: None,
            beside: None,
        }
    }

    /// Works until the stop is asked for or the source has ended.
    pub(super) async fn work(
        &mut self,
        shutdown: Shutdown,
        mut hangup: Signal,
        progress: &watch::Sender<Progress>,
    ) -> Result<(), StoreError> {
        self.note_closed()?;
        self.config_is_taken();
        self.keep_faults();
        let (mut tick, mut asked) = (Self::ticks(), shutdown.clone());
        loop {
            self.reporting.turn();
            tokio::select! {
                biased;
                () = asked.requested() => return Ok(()),
                _ = hangup.recv() => self.reload(&shutdown).await?,
                goes_on = self.take_next(&mut tick, &shutdown) => if !goes_on? {
                    return Ok(());
                },
            }
            let (counts, is_caught_up) = (self.site.counts(), self.is_caught_up);
            progress.send_replace(Progress {
                counts,
                is_caught_up,
            });
        }
    }

    /// Steps the monitor through a batch; a stop that is asked for half-way ends it after a value, and the rest of
    /// the batch is read again by the next start.
    ///
    /// # Errors
    /// When the state cannot be used any more.
    pub fn take_batch(
        &mut self,
        batch: ArrivalBatch,
        shutdown: &Shutdown,
    ) -> Result<(), StoreError> {
        let vitals = &self.reporting.vitals;
        batch
            .found
            .into_iter()
            .for_each(|found| vitals.takes(found));
        for (source, more) in &batch.quarantined {
            vitals.quarantined(source, *more);
        }
        self.site.note_waiting(batch.waiting);
        if !self.is_caught_up {
            self.site.queue_backlog(batch.arrivals.len());
        }
        let mut prepared = 0;
        for (number, arrival) in batch.arrivals.iter().enumerate() {
            if shutdown.is_requested() {
                return self.commit();
            }
            if prepared == 0 {
                prepared = self.site.prepare(&batch.arrivals[number..]);
            }
            prepared -= 1;
            self.take(arrival)?;
            self.commit_what_is_urgent()?;
        }
        self.positions.extend(batch.positions);
        self.files_are_read = batch.caught_up;
        if !batch.caught_up {
            self.preferred = PreferredSource::Messages;
        }
        // Of a backlog one batch follows another, and time is not let pass.
        self.take_orders_in_time()?;
        if batch.caught_up {
            self.decide();
        } else {
            let events = self.site.judge_meanwhile();
            self.reporting.vitals.note(&events);
        }
        self.release()?;
        self.end_batch()?;
        if !batch.caught_up && self.may_commit_later() {
            self.is_up_to_date = false;
            return Ok(());
        }
        self.commit()?;
        // Also while years of backlog come in: the state is not to hold all of their refits at once.
        self.thin()?;
        self.note_up_to_date()
    }

    /// Where all there is has been read, from files and from brokers, what of it is still in force is sent, and from then on time
    /// passes without readings too.
    fn note_up_to_date(&mut self) -> Result<(), StoreError> {
        self.is_up_to_date = self.files_are_read && self.sources.have_begun();
        if !self.is_up_to_date {
            return Ok(());
        }
        let stopwatch = Stopwatch::start();
        let events = self.site.caught_up((self.host_time)())?;
        self.reporting.vitals.judged(&events, stopwatch.elapsed());
        if !self.is_caught_up {
            self.is_caught_up = true;
            self.reporting.caught_up();
            let counts = self.site.counts();
            let quarantined: u64 = self.reporting.vitals.health().quarantined.values().sum();
            tracing::info!(
                taken = counts.taken,
                repeated = counts.repeated,
                from_the_future = counts.from_the_future,
                quarantined,
                "caught up"
            );
            self.report_inherited()?;
        }
        Ok(())
    }

    /// Takes a broker's message, and whatever else has come from there by now, in one commit.
    ///
    /// # Errors
    /// When the state cannot be used any more.
    pub fn take_messages(&mut self, first: mqtt::ReceivedMessage) -> Result<(), StoreError> {
        let mut next = Some(first);
        let mut prepared = 0;
        let mut waiting = VecDeque::new();
        while let Some(delivery) = next {
            self.site
                .messages_come(self.sources.deliveries.len() + waiting.len());
            self.site.queue();
            let vitals = &self.reporting.vitals;
            vitals.takes(delivery.found);
            vitals.quarantined(&delivery.source, delivery.quarantined);
            if prepared == 0 {
                self.sources.receive_more(&mut waiting);
                let more = waiting.iter().flat_map(|one| &one.arrivals);
                prepared = self.site.prepare(delivery.arrivals.iter().chain(more));
            }
            for arrival in self.site.not_outdated(&delivery)? {
                self.take(arrival)?;
                self.commit_what_is_urgent()?;
            }
            prepared = prepared.saturating_sub(delivery.arrivals.len());
            self.sources.hold(delivery.receipt);
            self.sources.receive_more(&mut waiting);
            next = waiting.pop_front();
        }
        self.take_orders_in_time()?;
        if self.is_up_to_date {
            self.decide();
        }
        if self.site.queues() {
            // Durable and acknowledged first: the broker sends more only then.
            self.commit()?;
            if self.site.may_queue_on() {
                return Ok(());
            }
        }
        self.end_batch()?;
        self.commit()
    }

    /// Takes what was held for the clock; what files say of their positions counts once nothing is held.
    fn release(&mut self) -> Result<(), StoreError> {
        let events = self.site.release((self.host_time)())?;
        self.reporting.vitals.note(&events);
        if self.holds_nothing() {
            let positions = std::mem::take(&mut self.positions);
            self.site.note_positions(positions);
        } else {
            keep_latest(&mut self.positions);
        }
        Ok(())
    }

    /// All that came together has been seen.
    fn decide(&mut self) {
        let events = self.site.decide((self.host_time)());
        self.reporting.vitals.note(&events);
    }

    /// Whether all that was read has been taken, or is known not to count.
    fn holds_nothing(&self) -> bool {
        self.site.held() == 0 && !self.site.is_undecided()
    }

    /// Judges what came late and what queued. No alert waits for the rest.
    fn end_batch(&mut self) -> Result<(), StoreError> {
        loop {
            let stopwatch = Stopwatch::start();
            let events = self.site.end_batch(self.files_are_read);
            self.reporting.vitals.judged(&events, stopwatch.elapsed());
            if !self.site.queues() {
                return Ok(());
            }
            self.commit_what_is_urgent()?;
            self.reporting.turn();
        }
    }

    fn judge_queued(&mut self) -> Result<(), StoreError> {
        self.end_batch()?;
        self.commit()
    }

    /// Looks back on what came late at one benchmark, or goes on through the past before a first start.
    ///
    /// # Errors
    /// When the state cannot be used any more.
    pub fn look_back(&mut self) -> Result<(), StoreError> {
        let (stopwatch, owed_past) = (Stopwatch::start(), self.site.owes_past());
        let events = self.site.look_back();
        self.reporting.vitals.judged(&events, stopwatch.elapsed());
        let is_judged = owed_past && !self.site.owes_past();
        if is_judged {
            self.site.save_memory();
        }
        self.commit()?;
        if is_judged {
            tracing::info!("the history before the first start has been judged");
        }
        Ok(())
    }

    fn take(&mut self, arrival: &Arrival) -> Result<(), StoreError> {
        let stopwatch = Stopwatch::start();
        let taken = self.site.counts().taken;
        let events = self.site.take(arrival, (self.host_time)())?;
        let vitals = &self.reporting.vitals;
        let is_taken = self.site.counts().taken > taken;
        if is_taken && let Input::Reading { benchmark, .. } = &arrival.input {
            vitals.read(benchmark, arrival.time, &events, stopwatch.elapsed());
        } else {
            vitals.note(&events);
        }
        self.reporting.turn();
        Ok(())
    }

    /// An alert does not wait for the rest of the batch; those that come together go together.
    fn commit_what_is_urgent(&mut self) -> Result<(), StoreError> {
        if self.since_commit.elapsed() >= URGENT && self.site.is_urgent((self.host_time)()) {
            self.since_commit = Stopwatch::start();
            return self.site.commit((self.host_time)());
        }
        Ok(())
    }

    /// Whether a batch of a backlog may be committed with the next one, which waits already.
    fn may_commit_later(&self) -> bool {
        !self.sources.batches.is_empty()
            && self.site.uncommitted() < MOST_TOGETHER_WRITTEN
            && !self.site.is_waiting()
            && self.since_commit.elapsed() < URGENT
            && !self.site.is_urgent((self.host_time)())
    }

    fn commit(&mut self) -> Result<(), StoreError> {
        self.since_commit = Stopwatch::start();
        let committed = self.site.commit((self.host_time)());
        let is_waiting = self.site.is_waiting();
        if committed.is_ok() && !is_waiting && self.holds_nothing() {
            self.reporting.vitals.note_taken();
            self.sources.acknowledge();
        }
        let (counts, queue) = (self.site.counts(), self.sources.batches.len());
        let (is_paused, searches) = (self.site.is_stalled(), self.site.searching());
        let held = self.site.held() as u64;
        let silences = self.site.mutes((self.host_time)());
        let is_in_place = self.store.is_in_place();
        self.note_state(committed.as_ref().err(), is_waiting, is_in_place);
        self.reporting.vitals.update(|health| {
            health.is_store_writable = committed.is_ok() && !is_waiting && is_in_place;
            health.is_clock_wrong = self.site.is_clock_wrong();
            health.held = held;
            health.log_lines_lost = log::lost();
            announce_ends(&health.silences, &silences);
            health.silences = silences;
            health.is_paused = is_paused;
            health.readings = counts.taken;
            health.repeated = counts.repeated;
            health.from_the_future = counts.from_the_future;
            health.without_clock = counts.without_clock;
            health.unwritten = self.site.unwritten();
            health.queue = queue;
            health.searches = searches;
        });
        committed
    }

    /// Deliveries are closed where the hooks are set up: at the start and when a config is taken.
    fn note_closed(&self) -> Result<(), StoreError> {
        let closed = self.store.closed_deliveries()?.len();
        (self.reporting.vitals).update(|health| health.outbox_closed = closed);
        Ok(())
    }

    /// Takes what people have ordered.
    fn take_orders(&mut self) -> Result<(), StoreError> {
        self.since_orders = Stopwatch::start();
        if !self.site.is_waiting() {
            self.store.delete_unreadable_orders()?;
            for order in self.store.orders()? {
                self.site.order(order)?;
            }
        }
        Ok(())
    }

    /// The same where it is time, however much comes.
    fn take_orders_in_time(&mut self) -> Result<(), StoreError> {
        if self.since_orders.elapsed() >= TICK {
            self.take_orders()?;
        }
        Ok(())
    }

    /// What is due whether anything comes or not.
    ///
    /// # Errors
    /// When the state cannot be used any more.
    pub fn tick(&mut self) -> Result<(), StoreError> {
        let now = (self.host_time)();
        self.since_tick = Stopwatch::start();
        self.take_orders()?;
        // Data time is the clock's only once the past has been read.
        if self.is_caught_up {
            let events = self.site.live(now);
            self.reporting.vitals.note(&events);
        }
        if self.is_up_to_date {
            self.decide();
        }
        self.release()?;
        if !self.site.may_queue_on() {
            self.end_batch()?;
        }
        self.commit()?;
        self.site.offer_refused()?;
        self.note_up_to_date()?;
        self.thin()?;
        self.verify();
        self.note_sources()?;
        self.keep_faults();
        let (outbox, oldest) = self.store.outbox(&self.config.later_hooks())?;
        let bytes = self.store.bytes()?;
        self.reporting.vitals.update(|health| {
            (health.outbox, health.outbox_oldest) = (outbox, oldest);
            health.database_bytes = Some(bytes);
        });
        Ok(())
    }
}

/// Of each file only how far it was read last.
fn keep_latest(positions: &mut Vec<Position>) {
    let mut latest = BTreeMap::new();
    for one in positions.drain(..) {
        latest.insert(one.name.clone(), one);
    }
    positions.extend(latest.into_values());
}
