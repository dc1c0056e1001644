//! One site at work: the monitor, what it has taken in, and where its events go.
//!
//! The daemon, a replay and a demo drive the same calls: [`Site::take`] for each value,
//! [`Site::commit`] after each batch, [`Site::pass`] when time goes by, [`Site::close`] at the end.
//! The wall clock comes in as an argument; whoever replays hands in the data's own time.

mod alerts;
mod arrivals;
mod flood;
mod memory;
mod message_burst;
mod mutes;
mod read_times;
mod returned;
mod set_back;
mod standing;
mod standing_floods;
mod timekeeper;
mod unproven;
mod waiting;

pub(super) use arrivals::{Untimely, untimely};
pub(super) use mutes::announce_ends;
pub(super) use unproven::Unproven;

use message_burst::MessageBurst;
use mutes::Mutes;
use read_times::ReadTimes;
use returned::Returned;
use set_back::Agreeing;
use standing::StandingAlerts;
use timekeeper::{PauseLength, Timekeeper};
use waiting::WaitingReadings;

use crate::alert::Level;
use crate::monitor::{Event, EventKind, Input, Monitor, Notice, RESET_FOUND, SUSPECT, Settings};
use crate::reading::{BEFORE_ALL, BenchmarkId, Timestamp};
use crate::runtime::clock::Stopwatch;
use crate::runtime::deliver::Dispatcher;
use crate::runtime::hook::{Alert, MessageState, Status};
use crate::runtime::searches::Searches;
use crate::runtime::tail::Arrival;
use crate::store::{Batch, LeftOrder, Position, Store, StoreError};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// Ticks for one passage of time at most; a monitor that asks for more is broken.
const MOST_TICKS: usize = 1_000_000;
/// An alert younger than this is never long past.
const LEAST_FRESHNESS: SignedDuration = SignedDuration::from_hours(1);
/// A benchmark that gave a reading within this time is still watched, whatever its policy says.
const LEAST_WATCHED: SignedDuration = SignedDuration::from_hours(30 * 24);

/// Steps that may wait for room on the disk; then nothing more is taken in.
const MOST_UNWRITTEN: usize = 20_000;
/// After so many steps the monitor's memory is saved, or after so many for each benchmark if that is more.
const STEPS_A_MEMORY: usize = 2_000;
const STEPS_A_BENCHMARK: usize = 20;
/// After so many times more where readings are taken without being judged: to take them again costs little.
const STEPS_UNJUDGED: usize = 10;
/// The site's own part of the memory, beside those of the monitor.
const OWN: &str = "\0site";

/// Where a site's events go.
#[derive(Debug)]
pub struct Sinks {
    /// What is kept; `None`: nothing.
    pub store: Option<Arc<Store>>,
    /// The alerts; with `None` nobody is notified.
    pub alerts: Option<Dispatcher>,
    /// What the hooks receive of the alerts' meaning.
    pub status: Status,
}

/// What has been counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Values that the monitor took.
    pub taken: u64,
    /// Values dropped because they had been taken before.
    pub repeated: u64,
    /// Values dropped because they are from the future.
    pub from_the_future: u64,
    /// Values dropped because they are from the first day of 1970, or from before 1678.
    #[serde(default)]
    pub without_clock: u64,
    /// Alerts that fired no hook because they are long past.
    pub long_past: u64,
}

/// One site at work.
#[derive(Debug)]
pub struct Site {
    name: String,
    settings: Settings,
    monitor: Monitor,
    searches: Searches,
    sinks: Sinks,
    /// Since the last commit.
    batch: Batch,
    /// Whether the last commit found no room.
    is_full: bool,
    steps_since_memory: usize,
    /// The latest data time stepped to; it never goes back.
    now: Option<Timestamp>,
    read: ReadTimes,
    failure_times: BTreeMap<Option<BenchmarkId>, Timestamp>,
    /// Alerts since the last commit.
    fresh: Vec<Alert>,
    standing: StandingAlerts,
    /// Who asked not to be notified.
    mutes: Mutes,
    counts: Counts,
    keeper: Timekeeper,
    unproven: Unproven,
    /// Values that wait, unacknowledged, until the host's clock is right.
    held: VecDeque<Arrival>,
    /// What has been read, and waits for earlier values.
    waiting: WaitingReadings,
    /// Values that were taken before, and corrected: until all that came with them has been seen.
    returned: Returned,
    /// Messages that come so fast that the past is not over yet.
    burst: MessageBurst,
    agreeing: Agreeing,
    /// Runs since something came late of which more may come in the next batch.
    batch_goes_on: Option<Stopwatch>,
}

impl Site {
    /// A site that has seen nothing.
    pub fn new(name: &str, settings: Settings, sinks: Sinks) -> Self {
        Self {
            name: name.to_owned(),
            monitor: Monitor::new(settings.clone()),
            settings,
            searches: Searches::default(),
            sinks,
            batch: Batch::default(),
            is_full: false,
            steps_since_memory: 0,
            now: None,
            read: ReadTimes::default(),
            failure_times: BTreeMap::new(),
            fresh: Vec::new(),
            standing: StandingAlerts::default(),
            mutes: Mutes::default(),
            counts: Counts::default(),
            keeper: Timekeeper::default(),
            unproven: Unproven::default(),
            held: VecDeque::new(),
            waiting: WaitingReadings::default(),
            returned: Returned::default(),
            burst: MessageBurst::default(),
            agreeing: Agreeing::default(),
            batch_goes_on: None,
        }
    }

    /// Thins a piece of what is older than `keep` by data time; whether there may be more.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn thin(&self, keep: SignedDuration) -> Result<bool, StoreError> {
        let (Some(store), Some(now)) = (&self.sinks.store, self.now) else {
            return Ok(false);
        };
        match now.checked_sub(keep) {
            Ok(before) if !self.is_full => store.thin(before),
            Ok(_) | Err(_) => Ok(false),
        }
    }

    /// The data time so far.
    fn data_now(&self) -> Timestamp {
        self.now.unwrap_or(BEFORE_ALL)
    }

    /// Goes by other settings from here on.
    pub fn change_settings(&mut self, settings: Settings) -> Vec<Event> {
        self.settings = settings.clone();
        self.waiting.clear();
        let now = self.data_now();
        self.step(now, &Input::Settings(Box::new(settings)))
    }

    /// Lets data time pass up to `until`: every deadline of the monitor on the way is kept.
    pub fn pass(&mut self, until: Timestamp) -> Vec<Event> {
        self.pass_by(until, None)
    }

    /// As [`Site::pass`]; where data time lies ahead of the `clock`, only what is due by this is judged.
    fn pass_by(&mut self, until: Timestamp, clock: Option<Timestamp>) -> Vec<Event> {
        let until = clock.map_or(until, |clock| until.min(clock));
        let mut events = Vec::new();
        for _ in 0..MOST_TICKS {
            let due = self.monitor.next_deadline();
            let Some(due) = due.filter(|due| *due <= until) else {
                return events;
            };
            let now = self.now.map_or(due, |now| now.max(due));
            events.extend(self.count_from_waiting(now, until));
            let next = self.monitor.next_deadline();
            if next.is_none_or(|next| next > due) {
                continue;
            }
            let (due, passed) = if clock.is_some_and(|clock| now > clock) {
                (due, passed(due, false))
            } else {
                (now, Input::Tick)
            };
            events.extend(self.step(now, &passed));
            if self.monitor.next_deadline().is_some_and(|next| next <= due) {
                tracing::error!(%due, "the monitor's deadline does not move on");
                return events;
            }
        }
        tracing::error!(%until, "too many deadlines at once");
        events
    }

    /// Judges by `until`, which it may be at the site, what is due without a reading; data time stays where it is. After a short time without readings
    /// only silences: where the clock is wrong, a level called by it would be too.
    fn judge_by(&mut self, until: Timestamp, pause: PauseLength) -> Vec<Event> {
        let Some(now) = self.now.filter(|_| self.sinks.store.is_some()) else {
            return Vec::new();
        };
        let mut events = self.count_from_waiting(now, until);
        if pause == PauseLength::Short {
            if self.monitor.falls_silent_by(until) {
                events.extend(self.step(now, &passed(until, true)));
            }
            return events;
        }
        for _ in 0..MOST_TICKS {
            let Some(due) = self.monitor.next_deadline().filter(|due| *due <= until) else {
                break;
            };
            events.extend(self.step(now, &passed(due, false)));
            if self.monitor.next_deadline().is_some_and(|next| next <= due) {
                tracing::error!(%due, "the monitor's deadline does not move on");
                break;
            }
        }
        events
    }

    /// Takes an order of people, once also where the state still has it. It is not of alerts that were called after it was given.
    ///
    /// # Errors
    /// When the state cannot be asked for these.
    pub fn order(&mut self, left: LeftOrder) -> Result<Vec<Event>, StoreError> {
        if self.batch.has_taken(left.number) {
            return Ok(Vec::new());
        }
        let mut order = left.order;
        if let Some(last) = left.last_event {
            let since = self.called_since(last, order.benchmark())?;
            order.note_called_since(since);
        }
        self.shorten(&mut order);
        self.batch.taken(left.number);
        tracing::warn!(?order, "an order was given");
        let now = self.data_now();
        Ok(self.step(now, &Input::Order(order)))
    }

    /// How far the files had been read when the values taken since the last commit were all handed over.
    pub fn note_positions(&mut self, positions: Vec<Position>) {
        if self.sinks.store.is_some() {
            for one in positions {
                self.batch.position(one);
            }
        }
    }

    fn step(&mut self, now: Timestamp, input: &Input) -> Vec<Event> {
        if let (Input::Settings(settings), Some(store)) = (input, &self.sinks.store) {
            let unwritten = i64::try_from(self.batch.steps()).unwrap_or(0);
            self.forget_values(settings, store.last_step() + unwritten);
        }
        let events = self.follow(now, input);
        if self.sinks.store.is_some() {
            self.batch.step(now, input, &events);
            log_suspicions(&events);
            self.note_step(input);
        }
        events
    }

    /// The readings up to step number `last` of what these settings end do not count any more.
    fn forget_values(&mut self, settings: &Settings, last: i64) {
        let former = &self.monitor.settings().watched;
        let mut ended = self.read.of_any();
        ended.retain(|id| settings.watched.ends(id, former));
        for id in ended {
            self.batch.forget(&id);
            self.read.forget_read(id, last);
        }
    }

    /// The monitor's step, and what the site itself remembers of it.
    fn follow(&mut self, now: Timestamp, input: &Input) -> Vec<Event> {
        self.now = Some(now);
        if let Input::Reading {
            benchmark, reading, ..
        } = input
        {
            self.read.note(benchmark, reading.time, now);
        }
        if let Input::Settings(settings) = input {
            let former = &self.monitor.settings().watched;
            let stays = |id: &BenchmarkId| !settings.watched.ends(id, former);
            self.read.retain(stays);
            // What a search finds in the former readings says nothing of the new ones.
            self.searches.retain(stays);
        }
        if let Input::Notice(Notice::FirstAhead { benchmark, .. }) = input {
            self.read.first_waits(benchmark);
        }
        if let Input::Order(order) = input {
            self.apply(order);
        }
        let events = self.monitor.step(now, input);
        for event in &events {
            if !input.makes_up(event) {
                self.handle(event);
            }
        }
        events
    }

    /// Puts an event on its way; nothing leaves before [`Site::commit`].
    pub fn handle(&mut self, event: &Event) {
        if let EventKind::Refit { failure_time, .. } = &event.kind {
            match failure_time.median {
                Some(median) => self.failure_times.insert(event.benchmark.clone(), median),
                None => self.failure_times.remove(&event.benchmark),
            };
        }
        let failure_time = self.failure_times.get(&event.benchmark).copied();
        let alert = Alert::new(event, &self.name, failure_time, self.sinks.status);
        self.fresh.extend(alert.map(|alert| {
            let benchmark = event.benchmark.as_ref();
            let is_unknown = alert.level == Level::Unknown && alert.state == MessageState::Firing;
            let in_force = benchmark.and_then(|benchmark| self.monitor.level(benchmark));
            let beside = in_force.filter(|level| is_unknown && *level > Level::Green);
            Alert { beside, ..alert }
        }));
    }

    /// What has been counted.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The monitor's own summary, the last line of a replay.
    pub fn summary(&self) -> Option<Event> {
        self.monitor.summary()
    }

    /// Makes everything durable, the monitor's memory with it, and gives the hooks up to `limit` to finish. Returns
    /// how many alerts no hook has taken; `None` when the limit was reached.
    ///
    /// # Errors
    /// When it cannot be made durable.
    pub async fn close(
        mut self,
        host_time: Timestamp,
        limit: Duration,
    ) -> Result<Option<usize>, StoreError> {
        self.save_memory();
        let recorded = self.commit(host_time);
        let lost = match self.sinks.alerts.take() {
            Some(alerts) => alerts.close(limit).await,
            None => Some(0),
        };
        recorded.map(|()| lost)
    }
}

/// What the readings hardly mean is for people to look into, and nobody else says it.
fn log_suspicions(events: &[Event]) {
    for event in events {
        if let EventKind::Fault { kind, text } = &event.kind
            && (kind.starts_with(SUSPECT) || kind == RESET_FOUND)
        {
            tracing::warn!(kind, "{text}");
        }
    }
}

fn passed(until: Timestamp, silences_alone: bool) -> Input {
    Input::Notice(Notice::Passed {
        until,
        silences_alone,
    })
}
