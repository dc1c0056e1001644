//! One site at work: the monitor, what it has taken in, and where its events go.
//!
//! The daemon, a replay and a demo drive the same calls: [`Site::take`] for each value,
//! [`Site::commit`] after each batch, [`Site::pass`] when time goes by, [`Site::close`] at the end.
//! The wall clock comes in as an argument; whoever replays hands in the data's own time.

use super::deliver::Dispatcher;
use super::event_log::EventLog;
use super::hook::{Alert, Status};
use super::searches::Searches;
use super::seen::{Novelty, Seen};
use super::tail::Arrival;
use crate::alert::{Level, Policy};
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
/// A benchmark that gave a reading within this time is still watched, whatever its policy says.
const LEAST_WATCHED: SignedDuration = SignedDuration::from_hours(30 * 24);

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
    /// Events that are not in the log because the disk was full for too long.
    pub unwritten: u64,
}

/// Where an alert stands: one level is in force at a benchmark, and beside it perhaps `unknown`.
type Place = (Option<BenchmarkId>, bool);

/// An alert in force.
#[derive(Debug)]
struct Standing {
    alert: Alert,
    /// Whether it has been offered to the hooks.
    is_sent: bool,
}

/// One site at work.
#[derive(Debug)]
pub struct Site {
    name: String,
    settings: Settings,
    monitor: Monitor,
    searches: Searches,
    sinks: Sinks,
    seen: Seen,
    /// The latest data time stepped to; it never goes back.
    now: Option<Timestamp>,
    newest: BTreeMap<BenchmarkId, Timestamp>,
    failure_times: BTreeMap<Option<BenchmarkId>, Timestamp>,
    /// Alerts since the last commit.
    fresh: Vec<Alert>,
    /// What is in force: neither resolved nor superseded.
    standing: BTreeMap<Place, Standing>,
    counts: Counts,
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
    /// A reading by which the answer of a search is due waits for that.
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
        let now = self.now.map_or(arrival.time, |now| now.max(arrival.time));
        if let Input::Reading { benchmark, .. } = &arrival.input {
            let newest = self.newest.entry(benchmark.clone()).or_insert(arrival.time);
            *newest = arrival.time.max(*newest);
            if let Some(finding) = self.searches.due(benchmark, arrival.time) {
                events.extend(self.step(now, &Input::Found(finding)));
            }
        }
        events.extend(self.step(now, &arrival.input));
        for job in self.monitor.searches() {
            self.searches.start(job);
        }
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

    /// Makes the events durable (on a full disk they wait for the next time), then hands the
    /// alerts to the hooks, but for what began longer
    /// before `wall` than twice the evacuation time: of that, [`Site::caught_up`] sends what is
    /// still in force.
    ///
    /// # Errors
    /// When the events cannot be made durable; the alerts go out all the same.
    pub fn commit(&mut self, wall: Timestamp) -> io::Result<()> {
        let recorded = self.sinks.events.commit();
        self.counts.unwritten = self.sinks.events.dropped();
        if let Some(alerts) = &self.sinks.alerts {
            alerts.commit();
        }
        for alert in std::mem::take(&mut self.fresh) {
            let age = wall.duration_since(alert.event.time);
            let is_sent = age <= self.freshness(alert.event.benchmark.as_ref());
            if is_sent {
                self.send(&alert);
            } else {
                self.counts.long_past += 1;
                if let Some(alerts) = &self.sinks.alerts {
                    alerts.supersede(&alert);
                }
            }
            self.stand(alert, is_sent);
        }
        recorded
    }

    /// Notes what is in force: a level supersedes the lower ones of its benchmark, and its end
    /// ends them too.
    fn stand(&mut self, alert: Alert, is_sent: bool) {
        let is_unknown = alert.level == Level::Unknown;
        let place = (alert.event.benchmark.clone(), is_unknown);
        let had = self.standing.get(&place);
        if had.is_some_and(|had| had.alert.level > alert.level) {
            return;
        }
        match alert.state {
            AlertState::Firing if alert.level != Level::Green => {
                self.standing.insert(place, Standing { alert, is_sent });
            }
            AlertState::Firing | AlertState::Resolved => {
                self.standing.remove(&place);
            }
        }
    }

    /// Everything there is has been read: what is in force and was not sent because it began long
    /// ago goes out, however long ago that was.
    ///
    /// Only a benchmark that nobody watches any more is spared. Its newest reading is older than
    /// 30 days, the outlook and twice the evacuation time, whichever is the longest: an archive.
    /// Readings that merely stop do not make an alert past; silence is not safety.
    pub fn caught_up(&mut self, wall: Timestamp) {
        let mut standing = std::mem::take(&mut self.standing);
        for one in standing.values_mut() {
            if one.is_sent {
                // Again: there may have been no room for it. The hooks that have it ignore it.
                if one.alert.must_arrive() {
                    self.send(&one.alert);
                }
            } else if self.is_watched(one.alert.event.benchmark.as_ref(), wall) {
                self.send(&one.alert);
                one.is_sent = true;
                self.counts.long_past = self.counts.long_past.saturating_sub(1);
            }
        }
        self.standing = standing;
    }

    fn is_watched(&self, benchmark: Option<&BenchmarkId>, wall: Timestamp) -> bool {
        let newest = match benchmark {
            Some(benchmark) => self.newest.get(benchmark),
            None => self.newest.values().max(),
        };
        let limit = (self.freshness(benchmark))
            .max(self.policy(benchmark).outlook)
            .max(LEAST_WATCHED);
        newest.is_some_and(|newest| wall.duration_since(*newest) <= limit)
    }

    fn send(&self, alert: &Alert) {
        if let Some(alerts) = &self.sinks.alerts {
            alerts.offer(alert);
        }
    }

    fn freshness(&self, benchmark: Option<&BenchmarkId>) -> SignedDuration {
        (self.policy(benchmark).evacuation_time)
            .checked_mul(2)
            .unwrap_or(SignedDuration::MAX)
            .max(LEAST_FRESHNESS)
    }

    fn policy(&self, benchmark: Option<&BenchmarkId>) -> &Policy {
        benchmark.map_or(&self.settings.policy, |one| self.settings.policy(one))
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
