//! One site at work: the monitor, what it has taken in, and where its events go.
//!
//! The daemon, a replay and a demo drive the same calls: [`Site::take`] for each value,
//! [`Site::commit`] after each batch, [`Site::pass`] when time goes by, [`Site::close`] at the end.
//! The wall clock comes in as an argument; whoever replays hands in the data's own time.

use super::deliver::Dispatcher;
use super::event_log::EventLog;
use super::hook::{Alert, Status};
use super::seen::{Novelty, Seen};
use super::tail::Arrival;
use crate::alert::Level;
use crate::monitor::{AlertState, Event, EventKind, Input, Monitor, Settings};
use crate::reading::{BenchmarkId, Timestamp};
use jiff::SignedDuration;
use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

/// Ticks for one passage of time at most; a monitor that asks for more is broken.
const MOST_TICKS: usize = 1_000_000;
/// So far ahead of the wall clock a measurement may be: clocks differ, days do not.
const CLOCK_TOLERANCE: SignedDuration = SignedDuration::from_hours(1);
/// An alert younger than this is never long past.
const LEAST_FRESHNESS: SignedDuration = SignedDuration::from_hours(1);

/// Where a site's events go.
#[derive(Debug)]
pub struct Sinks {
    /// All of them.
    pub events: EventLog,
    /// The alerts; `None` tells nobody.
    pub alerts: Option<Dispatcher>,
    /// What the hooks are told of the alerts' meaning.
    pub status: Status,
}

/// What has been counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Values that the monitor took.
    pub taken: u64,
    /// Values dropped because they had been taken before.
    pub repeated: u64,
    /// Values dropped because they are from the future.
    pub from_the_future: u64,
    /// Alerts that fired no hook because they are long past.
    pub long_past: u64,
}

type Standing = (Option<BenchmarkId>, &'static str);

/// One site at work.
#[derive(Debug)]
pub struct Site {
    name: String,
    settings: Settings,
    monitor: Monitor,
    sinks: Sinks,
    seen: Seen,
    /// The latest data time stepped to; it never goes back.
    now: Option<Timestamp>,
    newest: BTreeMap<BenchmarkId, Timestamp>,
    failure_times: BTreeMap<Option<BenchmarkId>, Timestamp>,
    /// Alerts since the last commit.
    fresh: Vec<Alert>,
    /// Alerts in force that no hook was told of because they began long ago.
    standing: BTreeMap<Standing, Alert>,
    counts: Counts,
}

impl Site {
    /// A site that has seen nothing.
    pub fn new(name: &str, settings: Settings, sinks: Sinks) -> Self {
        Self {
            name: name.to_owned(),
            monitor: Monitor::new(settings.clone()),
            settings,
            sinks,
            seen: Seen::default(),
            now: None,
            newest: BTreeMap::new(),
            failure_times: BTreeMap::new(),
            fresh: Vec::new(),
            standing: BTreeMap::new(),
            counts: Counts::default(),
        }
    }

    /// Takes one value. What was taken before, or lies ahead of the wall clock, changes nothing.
    pub fn take(&mut self, arrival: &Arrival, wall: Timestamp) -> Vec<Event> {
        let ahead = arrival.time.duration_since(wall);
        if ahead > CLOCK_TOLERANCE {
            self.counts.from_the_future += 1;
            let (time, total) = (arrival.time, self.counts.from_the_future);
            tracing::warn!(%time, ?arrival.input, total, "measured in the future: quarantined");
            return Vec::new();
        }
        match self.seen.look(arrival) {
            Novelty::New => {}
            Novelty::Repeated => {
                self.counts.repeated += 1;
                return Vec::new();
            }
        }
        self.counts.taken += 1;
        let mut events = self.pass(arrival.time);
        if let Input::Reading { benchmark, .. } = &arrival.input {
            let newest = self.newest.entry(benchmark.clone()).or_insert(arrival.time);
            *newest = arrival.time.max(*newest);
        }
        let now = self.now.map_or(arrival.time, |now| now.max(arrival.time));
        events.extend(self.step(now, &arrival.input));
        events
    }

    /// Lets data time pass up to `until`: every deadline of the monitor on the way is kept.
    pub fn pass(&mut self, until: Timestamp) -> Vec<Event> {
        let mut events = Vec::new();
        for _ in 0..MOST_TICKS {
            let due = self.monitor.next_deadline();
            let Some(due) = due.filter(|due| *due <= until) else {
                return events;
            };
            let due = self.now.map_or(due, |now| now.max(due));
            events.extend(self.step(due, &Input::Tick));
            if self.monitor.next_deadline().is_some_and(|next| next <= due) {
                tracing::error!(%due, "the monitor's deadline does not move on");
                return events;
            }
        }
        tracing::error!(%until, "too many deadlines at once");
        events
    }

    /// When the monitor wants to be woken.
    pub fn next_deadline(&self) -> Option<Timestamp> {
        self.monitor.next_deadline()
    }

    fn step(&mut self, now: Timestamp, input: &Input) -> Vec<Event> {
        self.now = Some(now);
        let events = self.monitor.step(now, input);
        for event in &events {
            self.handle(event);
        }
        events
    }

    /// Puts an event on its way; nothing leaves before [`Site::commit`].
    pub fn handle(&mut self, event: &Event) {
        self.sinks.events.add(event);
        if let EventKind::Refit { failure_time, .. } = &event.kind {
            match failure_time.median {
                Some(median) => self.failure_times.insert(event.benchmark.clone(), median),
                None => self.failure_times.remove(&event.benchmark),
            };
        }
        let failure_time = self.failure_times.get(&event.benchmark).copied();
        self.fresh.extend(Alert::new(
            event,
            &self.name,
            failure_time,
            self.sinks.status,
        ));
    }

    /// Makes the events durable, then hands the alerts to the hooks, but for what is long past at
    /// `wall`.
    ///
    /// # Errors
    /// When the events cannot be made durable; the alerts go out all the same.
    pub fn commit(&mut self, wall: Timestamp) -> io::Result<()> {
        let recorded = self.sinks.events.commit();
        for alert in std::mem::take(&mut self.fresh) {
            let place = (alert.event.benchmark.clone(), alert.level.name());
            self.standing.remove(&place);
            let age = wall.duration_since(alert.event.time);
            if age <= self.freshness(alert.event.benchmark.as_ref()) {
                self.send(&alert);
            } else {
                self.counts.long_past += 1;
                if alert.state == AlertState::Firing && alert.level != Level::Green {
                    self.standing.insert(place, alert);
                }
            }
        }
        recorded
    }

    /// The history has been read: an alert that began long ago and is still in force, at a
    /// benchmark whose readings are recent, is not past at all, and goes out.
    pub fn caught_up(&mut self, wall: Timestamp) {
        for ((benchmark, _), alert) in std::mem::take(&mut self.standing) {
            let newest = match &benchmark {
                Some(benchmark) => self.newest.get(benchmark),
                None => self.newest.values().max(),
            };
            let limit = self.freshness(benchmark.as_ref());
            if newest.is_some_and(|newest| wall.duration_since(*newest) <= limit) {
                self.send(&alert);
            }
        }
    }

    fn send(&self, alert: &Alert) {
        if let Some(alerts) = &self.sinks.alerts {
            alerts.offer(alert);
        }
    }

    fn freshness(&self, benchmark: Option<&BenchmarkId>) -> SignedDuration {
        let own = benchmark.and_then(|benchmark| self.settings.benchmarks.get(benchmark));
        let policy = own.unwrap_or(&self.settings.policy);
        policy
            .evacuation_time
            .checked_mul(2)
            .unwrap_or(SignedDuration::MAX)
            .max(LEAST_FRESHNESS)
    }

    /// What has been counted.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The monitor's own summary, the last line of a replay.
    pub fn summary(&self) -> Option<Event> {
        self.monitor.summary()
    }

    /// Makes everything durable and gives the hooks up to `limit` to finish. Returns how many
    /// alerts no hook has taken; `None` when the limit was reached.
    ///
    /// # Errors
    /// When the events cannot be made durable.
    pub async fn close(mut self, wall: Timestamp, limit: Duration) -> io::Result<Option<usize>> {
        let recorded = self.commit(wall);
        let lost = match self.sinks.alerts.take() {
            Some(alerts) => alerts.close(limit).await,
            None => Some(0),
        };
        recorded.map(|()| lost)
    }
}
