//! How the alarm of each place stands, by the names of ISA-18.2 (ANSI/ISA-18.2-2016, "Management of Alarm Systems for the
//! Process Industries"), from the events in a site's state.

use super::standing::{NumberedEvent, TakenOrders, every};
use crate::alert::Level;
use crate::monitor::{
    AlertState, CalledLevel, Declared, Event, EventKind, KindShown, OrderKind, REMOVED, by_time,
};
use crate::reading::{BenchmarkId, Timestamp};
use crate::store::{Store, StoreError};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// How the alarm of a place stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlarmState {
    /// No level above green is in force, and the last one was acknowledged.
    Normal,
    /// The conditions of a rule of the site's own hold, and have not held for long enough yet.
    Pending,
    /// A level is in force that nobody has acknowledged.
    Unacknowledged,
    /// A level is in force that somebody has acknowledged, and the forecast calls for it.
    Acknowledged,
    /// The last level has ended, and nobody has acknowledged it.
    ReturnedUnacknowledged,
    /// A level is in force that somebody has acknowledged; the forecast calls for a lower one, and the slope has not slowed
    /// down for long enough.
    Latched,
    /// Nobody is notified of this level for a time (`alerts shelve`).
    Shelved,
    /// Nobody is notified of anything for a time (`alerts silence`).
    Suppressed,
    /// Declared maintenance: readings are kept and not judged.
    OutOfService,
}

impl AlarmState {
    /// The word in its JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Pending => "pending",
            Self::Unacknowledged => "unacknowledged",
            Self::Acknowledged => "acknowledged",
            Self::ReturnedUnacknowledged => "returned-unacknowledged",
            Self::Latched => "latched",
            Self::Shelved => "shelved",
            Self::Suppressed => "suppressed",
            Self::OutOfService => "out-of-service",
        }
    }
}

/// The newest alert of a place, whether it has ended and whether people have seen it.
#[derive(Debug, Clone)]
struct NewestAlert {
    event: Event,
    /// When it ended.
    ended: Option<Timestamp>,
    is_acknowledged: bool,
}

impl NewestAlert {
    fn has_ended(&self) -> bool {
        self.ended.is_some()
    }
}

/// An alert that has ended and that nobody has acknowledged.
#[derive(Debug, Clone)]
pub struct ReturnedAlert {
    /// Its beginning.
    pub event: Event,
    /// When it ended.
    pub ended: Timestamp,
}

/// What the alarms of a site stand by at a moment.
#[derive(Debug)]
pub struct Alarms {
    newest: BTreeMap<Option<BenchmarkId>, NewestAlert>,
    /// The alerts in force which say that nothing is known of a place: they stand beside its level.
    unknown: BTreeMap<Option<BenchmarkId>, Event>,
    /// What people have ordered.
    orders: TakenOrders,
    /// Orders by which nobody is notified, with their numbers among the events.
    silences: Vec<NumberedEvent>,
    /// Benchmarks under declared maintenance; `None`: the whole site.
    out_of_service: Vec<Option<BenchmarkId>>,
}

impl Alarms {
    /// Those of the events until `at`, of all without it, at the moment `now`. Without `at` maintenance goes on where one of `declared`, what
    /// is declared now, says so, whether a reading has come since or not.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn read(
        store: &Store,
        at: Option<Timestamp>,
        now: Timestamp,
        declared: &[Declared],
    ) -> Result<Self, StoreError> {
        let is_known = |event: &Event| at.is_none_or(|at| event.time <= at);
        let mut alerts = by_time(every(store, KindShown::ALERT.name)?);
        alerts.retain(is_known);
        let (mut newest, mut unknown) = (BTreeMap::new(), BTreeMap::new());
        for event in alerts {
            if level(&event) == Some(Level::Unknown) {
                take_unknown(&mut unknown, event);
            } else {
                take(&mut newest, event);
            }
        }
        let orders = TakenOrders::read(store, at)?;
        for one in newest.values_mut() {
            one.is_acknowledged = is_seen(&orders, &one.event);
        }
        Ok(Self {
            newest,
            unknown,
            silences: orders.numbered_silences(now),
            orders,
            out_of_service: match at {
                Some(at) => reported_maintenance(store, at, now)?,
                None => maintenance_in(declared, now),
            },
        })
    }

    /// Whether nothing is known of a place, and nobody has acknowledged that.
    fn is_unseen_unknown(&self, place: Option<&BenchmarkId>) -> bool {
        let unknown = self.unknown.get(&place.cloned());
        unknown.is_some_and(|event| !is_seen(&self.orders, event))
    }

    /// How that of a place stands, `None` of the whole site, where its newest forecast calls for `called`.
    pub fn state(&self, place: Option<&BenchmarkId>, called: Option<&CalledLevel>) -> AlarmState {
        let newest = self.newest.get(&place.cloned());
        if self.is_out_of_service(place) {
            return AlarmState::OutOfService;
        }
        if let Some(muted) = self.muted(place, newest) {
            return muted;
        }
        match newest {
            Some(one) if !one.has_ended() && !one.is_acknowledged => AlarmState::Unacknowledged,
            Some(one) if !one.has_ended() => {
                let is_held = called.is_some_and(|called| Some(called.level) < one.level());
                if is_held {
                    AlarmState::Latched
                } else {
                    AlarmState::Acknowledged
                }
            }
            _ if self.is_unseen_unknown(place) => AlarmState::Unacknowledged,
            Some(one) if !one.is_acknowledged => AlarmState::ReturnedUnacknowledged,
            _ if called.is_some_and(|called| !called.pending.is_empty()) => AlarmState::Pending,
            _ => AlarmState::Normal,
        }
    }

    fn is_out_of_service(&self, place: Option<&BenchmarkId>) -> bool {
        let is_here = |at: Option<&BenchmarkId>| at.is_none() || at == place;
        self.out_of_service.iter().any(|one| is_here(one.as_ref()))
    }

    /// How one alert stands: as its place does where it is the newest there. One of the level `unknown` stands beside
    /// the place's level, and for itself.
    pub fn state_of(
        &self,
        alert: &Event,
        is_acknowledged: bool,
        called: Option<&CalledLevel>,
    ) -> AlarmState {
        let place = alert.benchmark.as_ref();
        let newest = self.newest.get(&alert.benchmark);
        let is_newest = newest.is_some_and(|one| key(&one.event) == key(alert));
        if is_newest {
            return self.state(place, called);
        }
        let unknown = self.unknown.get(&alert.benchmark);
        if unknown.is_some_and(|one| key(one) == key(alert)) {
            return self.state_of_unknown(place, is_acknowledged);
        }
        if is_acknowledged {
            AlarmState::Normal
        } else {
            AlarmState::ReturnedUnacknowledged
        }
    }

    /// How one stands that is in force: shelving a level leaves it as it is, and no forecast calls for it.
    fn state_of_unknown(&self, place: Option<&BenchmarkId>, is_acknowledged: bool) -> AlarmState {
        if self.is_out_of_service(place) {
            AlarmState::OutOfService
        } else if self.muted(place, None) == Some(AlarmState::Suppressed) {
            AlarmState::Suppressed
        } else if is_acknowledged {
            AlarmState::Acknowledged
        } else {
            AlarmState::Unacknowledged
        }
    }

    /// The alerts that have ended, are the newest of their place, and were not acknowledged.
    pub fn returned(&self) -> Vec<ReturnedAlert> {
        let unseen = self.newest.values().filter(|one| !one.is_acknowledged);
        let returned = unseen.filter_map(|one| {
            Some(ReturnedAlert {
                event: one.event.clone(),
                ended: one.ended?,
            })
        });
        returned.collect()
    }

    /// Whether there is nothing at `place`, or anywhere without it, that could be acknowledged.
    pub fn is_all_seen(&self, place: Option<&BenchmarkId>) -> bool {
        let here = (self.newest.iter()).filter(|(at, _)| place.is_none() || at.as_ref() == place);
        here.into_iter()
            .all(|(_, one)| one.has_ended() && one.is_acknowledged)
    }

    fn muted(
        &self,
        place: Option<&BenchmarkId>,
        newest: Option<&NewestAlert>,
    ) -> Option<AlarmState> {
        let mut found = None;
        for silence in &self.silences {
            let event = &silence.event;
            if event.benchmark.is_some() && event.benchmark.as_ref() != place {
                continue;
            }
            let EventKind::Order { order, .. } = &event.kind else {
                continue;
            };
            if *order == OrderKind::Silence {
                return Some(AlarmState::Suppressed);
            }
            // A level that was called after the order is higher than the one that it is of.
            let concerns = |alert: &Event| self.orders.concerns(silence, alert);
            let is_of_it = newest.is_none_or(|one| one.has_ended() || concerns(&one.event));
            found = found.or(is_of_it.then_some(AlarmState::Shelved));
        }
        found
    }
}

impl NewestAlert {
    fn level(&self) -> Option<Level> {
        level(&self.event)
    }
}

fn level(event: &Event) -> Option<Level> {
    if let EventKind::Alert { level, .. } = &event.kind {
        Some(*level)
    } else {
        None
    }
}

fn key(event: &Event) -> Option<&str> {
    if let EventKind::Alert { key, .. } = &event.kind {
        Some(key)
    } else {
        None
    }
}

/// Takes one alert event of the level `unknown`.
fn take_unknown(unknown: &mut BTreeMap<Option<BenchmarkId>, Event>, event: Event) {
    let EventKind::Alert { state, .. } = &event.kind else {
        return;
    };
    match state {
        AlertState::Firing => {
            unknown.insert(event.benchmark.clone(), event);
        }
        AlertState::Resolved => {
            let standing = unknown.get(&event.benchmark);
            if standing.is_some_and(|one| key(one) == key(&event)) {
                unknown.remove(&event.benchmark);
            }
        }
    }
}

/// Takes one alert event of another level.
fn take(newest: &mut BTreeMap<Option<BenchmarkId>, NewestAlert>, event: Event) {
    let EventKind::Alert { state, rule, .. } = &event.kind else {
        return;
    };
    match state {
        // Nobody is to acknowledge what is no longer watched.
        AlertState::Resolved if rule == REMOVED => {
            newest.remove(&event.benchmark);
        }
        AlertState::Firing => {
            let one = NewestAlert {
                ended: None,
                is_acknowledged: false,
                event,
            };
            newest.insert(one.event.benchmark.clone(), one);
        }
        AlertState::Resolved => {
            if let Some(one) = newest.get_mut(&event.benchmark)
                && key(&one.event) == key(&event)
            {
                one.ended = Some(event.time);
            }
        }
    }
}

/// Whether people have acknowledged this alert, or ended it.
fn is_seen(orders: &TakenOrders, alert: &Event) -> bool {
    orders.of(alert).any(|order| says_seen(&order.event))
}

/// Whether it says that people have seen the alerts that it is of: an acknowledgement, or that they ended them.
fn says_seen(order: &Event) -> bool {
    let EventKind::Order { order: kind, .. } = &order.kind else {
        return false;
    };
    matches!(kind, OrderKind::Acknowledge | OrderKind::Resolve)
}

/// Where maintenance was going on, by what was reported until `at`.
fn reported_maintenance(
    store: &Store,
    at: Timestamp,
    now: Timestamp,
) -> Result<Vec<Option<BenchmarkId>>, StoreError> {
    let mut declared = every(store, "declared")?;
    declared.retain(|event| event.time <= at && is_under_maintenance(event, now));
    Ok(declared.into_iter().map(|event| event.benchmark).collect())
}

/// Where maintenance goes on.
fn maintenance_in(declared: &[Declared], now: Timestamp) -> Vec<Option<BenchmarkId>> {
    let goes_on = declared.iter().filter(|one| one.is_maintenance_at(now));
    goes_on.map(|one| one.benchmark.clone()).collect()
}

/// Whether the declared maintenance of this event is going on.
fn is_under_maintenance(event: &Event, now: Timestamp) -> bool {
    let EventKind::Declared { at, until, .. } = &event.kind else {
        return false;
    };
    *at <= now && until.is_some_and(|until| now < until)
}
