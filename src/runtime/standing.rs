//! What stands at a moment, from the events in a site's state: alerts in force, orders, who has seen what.

use crate::alert::Level;
use crate::monitor::{
    AlertState, Event, EventKind, KindShown, Order, OrderKind, by_time, site_text,
};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::clock::TOLERANCE;
use crate::runtime::hook::{MessageState, state_name};
use crate::store::{AlertIdentity, Store, StoreError};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The alerts in force, by place and level.
pub type InForce = BTreeMap<(Option<BenchmarkId>, Level), Event>;

/// The alerts in force: by benchmark and level, of each benchmark the highest, and `unknown` beside it. That of the site names the benchmarks
/// that make its level now; others may have made it when it was called.
///
/// # Errors
/// [`StoreError`].
pub fn in_force(store: &Store, until: Option<Timestamp>) -> Result<InForce, StoreError> {
    let mut standing = InForce::new();
    for event in by_time(every(store, KindShown::ALERT.name)?) {
        if until.is_none_or(|until| event.time <= until) {
            note(&mut standing, &event);
        }
    }
    name_those_in_force(&mut standing);
    Ok(standing)
}

/// Has the site's alert name the benchmarks that make its level.
fn name_those_in_force(standing: &mut InForce) {
    let each = standing.keys().filter_map(|(place, level)| {
        let is_level = *level != Level::Unknown;
        place.clone().filter(|_| is_level).map(|id| (*level, id))
    });
    let mut raised: Vec<(Level, BenchmarkId)> = each.collect();
    raised.sort_by_key(|(level, _)| Reverse(*level));
    for ((place, level), event) in standing.iter_mut() {
        let reach = raised.iter().filter(|(own, _)| own >= level);
        let reach: Vec<&BenchmarkId> = reach.map(|(_, id)| id).collect();
        let is_named = place.is_none() && *level != Level::Unknown && !reach.is_empty();
        if let EventKind::Alert { text, .. } = &mut event.kind
            && is_named
        {
            *text = site_text(*level, &reach);
        }
    }
}

/// The call since which the alert with this key stands, under its own key: that of the past before a first start where it had called
/// the level already. `None` where no alert has the key.
///
/// # Errors
/// [`StoreError`].
pub(super) fn first_call(store: &Store, key: &str) -> Result<Option<Event>, StoreError> {
    let mut standing = InForce::new();
    for event in by_time(every(store, KindShown::ALERT.name)?) {
        note(&mut standing, &event);
        if let EventKind::Alert {
            key: own,
            state: AlertState::Firing,
            level,
            ..
        } = event.kind
            && own == key
        {
            return Ok(standing.remove(&(event.benchmark, level)));
        }
    }
    Ok(None)
}

/// Goes on by an alert that is called or ends.
fn note(standing: &mut InForce, event: &Event) {
    let EventKind::Alert {
        level, state, key, ..
    } = &event.kind
    else {
        return;
    };
    let (level, state, place) = (*level, *state, event.benchmark.clone());
    match state {
        AlertState::Firing => {
            let called = standing.get(&(place.clone(), level));
            let event = called.map_or_else(|| event.clone(), |called| gone_on_with(called, event));
            standing.retain(|(own, lower), _| {
                *own != place || (*lower == Level::Unknown) != (level == Level::Unknown)
            });
            standing.insert((place, level), event);
        }
        AlertState::Resolved => {
            // One that was called by readings from before its predecessor was resolved stands before that in time.
            let is_of = |standing: &Event| matches!(&standing.kind, EventKind::Alert { key: own, .. } if own == key);
            if standing.get(&(place.clone(), level)).is_some_and(is_of) {
                standing.remove(&(place, level));
            }
        }
    }
}

/// One level stands since it was first called, also where the past before a first start called it, and for what was read then; its key
/// is that of the later event, which is the one that people have been notified of.
fn gone_on_with(called: &Event, event: &Event) -> Event {
    let mut first = called.clone();
    if let (EventKind::Alert { key: own, .. }, EventKind::Alert { key, .. }) =
        (&mut first.kind, &event.kind)
    {
        own.clone_from(key);
    }
    first
}

/// An event with its number in the state.
#[derive(Debug, Clone)]
pub(super) struct NumberedEvent {
    pub(super) number: i64,
    pub(super) event: Event,
}

/// Every event of a kind, oldest first.
///
/// # Errors
/// [`StoreError`].
pub fn every(store: &Store, kind: &str) -> Result<Vec<Event>, StoreError> {
    every_until(store, kind, i64::MAX)
}

/// Every event of a kind up to number `last`, oldest first.
///
/// # Errors
/// [`StoreError`].
pub(super) fn every_until(store: &Store, kind: &str, last: i64) -> Result<Vec<Event>, StoreError> {
    let numbered = numbered_between(store, kind, 0, last)?;
    Ok(numbered.into_iter().map(|one| one.event).collect())
}

/// Every event of a kind after number `after`, oldest first.
///
/// # Errors
/// [`StoreError`].
pub(super) fn every_since(store: &Store, kind: &str, after: i64) -> Result<Vec<Event>, StoreError> {
    let numbered = numbered_between(store, kind, after, i64::MAX)?;
    Ok(numbered.into_iter().map(|one| one.event).collect())
}

/// Every event of a kind with its number, oldest first.
///
/// # Errors
/// [`StoreError`].
pub(super) fn numbered(store: &Store, kind: &str) -> Result<Vec<NumberedEvent>, StoreError> {
    numbered_between(store, kind, 0, i64::MAX)
}

fn numbered_between(
    store: &Store,
    kind: &str,
    mut after: i64,
    last: i64,
) -> Result<Vec<NumberedEvent>, StoreError> {
    let mut all = Vec::new();
    loop {
        let events = store.events(after, Some(kind), None)?;
        let Some((newest, _)) = events.last() else {
            return Ok(all);
        };
        after = *newest;
        for (number, body) in &events {
            if *number > last {
                return Ok(all);
            }
            all.push(NumberedEvent {
                number: *number,
                event: read(body)?,
            });
        }
    }
}

/// The orders that were taken, and when among the events each alert was called.
///
/// An order is of what had been called when it was taken. Their order says that, not their times: an order stands at the data
/// time at which it was taken, and what a logger delivers late was measured before.
#[derive(Debug)]
pub struct TakenOrders {
    /// By number, oldest first.
    taken: Vec<NumberedEvent>,
    /// The number of the event that called an alert last, by its key.
    called: BTreeMap<String, i64>,
    /// Whether they are those of the past, whose clock was another.
    are_past: bool,
}

impl TakenOrders {
    /// Those of the events until `at`, of all without it.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn read(store: &Store, at: Option<Timestamp>) -> Result<Self, StoreError> {
        let is_known = |one: &NumberedEvent| at.is_none_or(|at| one.event.time <= at);
        let mut taken = numbered(store, KindShown::ORDER.name)?;
        taken.retain(is_known);
        let mut called = BTreeMap::new();
        if !taken.is_empty() {
            for NumberedEvent { number, event } in numbered(store, KindShown::ALERT.name)?
                .into_iter()
                .filter(is_known)
            {
                if let EventKind::Alert {
                    state: AlertState::Firing,
                    key,
                    ..
                } = event.kind
                {
                    called.insert(key, number);
                }
            }
        }
        Ok(Self {
            taken,
            called,
            are_past: at.is_some(),
        })
    }

    /// The orders that are of this alert, with their numbers, oldest first.
    pub(super) fn of<'a>(&'a self, alert: &'a Event) -> impl Iterator<Item = &'a NumberedEvent> {
        let taken = self.taken.iter();
        taken.filter(move |order| self.concerns(order, alert))
    }

    /// Whether the order is of this alert: it had been called when the order was given and taken, and the order names it or all at
    /// its place.
    pub(super) fn concerns(&self, order: &NumberedEvent, alert: &Event) -> bool {
        let (number, order) = (order.number, &order.event);
        let EventKind::Alert { key, .. } = &alert.kind else {
            return false;
        };
        let EventKind::Order {
            alert: only, given, ..
        } = &order.kind
        else {
            return false;
        };
        let is_here = order.benchmark.is_none() || order.benchmark == alert.benchmark;
        let is_called = self.called.get(key).is_some_and(|called| *called < number);
        let is_seen = is_called && !given.called_since.contains(key);
        is_here && is_seen && only.as_ref().is_none_or(|only| only == key)
    }

    /// Those in force at `now` by which no hook is run, as they were given.
    pub fn silences(&self, now: Timestamp) -> Vec<Event> {
        let standing = self.numbered_silences(now).into_iter();
        standing.map(|one| one.event).collect()
    }

    pub(super) fn numbered_silences(&self, now: Timestamp) -> Vec<NumberedEvent> {
        let mut standing: Vec<NumberedEvent> = Vec::new();
        for taken in &self.taken {
            let event = &taken.event;
            let EventKind::Order {
                order,
                until,
                given,
                ..
            } = &event.kind
            else {
                continue;
            };
            let given_at = given.given_at.filter(|_| !self.are_past);
            if *order == OrderKind::Unsilence {
                let place = &event.benchmark;
                standing.retain(|one| place.is_some() && one.event.benchmark != *place);
                continue;
            }
            // The newest of a kind says how long, also when its own time is over.
            if until.is_some() {
                let is_other = |one: &NumberedEvent| {
                    one.event.benchmark != event.benchmark
                        || !matches!(&one.event.kind, EventKind::Order { order: own, .. } if own == order)
                };
                standing.retain(is_other);
            }
            if until.is_some_and(|until| lasts((given_at, until), now)) {
                standing.push(taken.clone());
            }
        }
        standing
    }

    /// Who has seen what is in force.
    pub fn acknowledged(&self, in_force: &InForce) -> Vec<Event> {
        let is_of_one = |order: &&NumberedEvent| {
            is_acknowledgement(&order.event)
                && (in_force.values()).any(|alert| self.concerns(order, alert))
        };
        let seen = self.taken.iter().filter(is_of_one);
        seen.map(|order| order.event.clone()).collect()
    }

    /// The newest acknowledgement of each alert in force that has one, by the alert's key.
    pub(super) fn acknowledged_by(&self, in_force: &InForce) -> BTreeMap<String, Event> {
        let each = in_force.values().filter_map(|alert| {
            let EventKind::Alert { key, .. } = &alert.kind else {
                return None;
            };
            let seen = self.of(alert).filter(|one| is_acknowledgement(&one.event));
            Some((key.clone(), seen.last()?.event.clone()))
        });
        each.collect()
    }
}

/// Whether an order lasts at `now`: until its end, by the clock by which it was given. Where that says that it is earlier than
/// then, it has been set back since, and nobody knows how long ago that was.
pub(super) fn lasts((given_at, until): (Option<Timestamp>, Timestamp), now: Timestamp) -> bool {
    // Those of a replay that is shown as if it were live end at data times.
    let given_at = given_at.filter(|given_at| *given_at < until);
    let is_set_back = given_at.is_some_and(|at| at.duration_since(now) > TOLERANCE);
    until > now && !is_set_back
}

/// The level in force at a place, and whether it is unknown beside it, once a level has been entered or left there.
pub(super) fn after_alert(
    (in_force, is_unknown): (Level, bool),
    level: Level,
    state: AlertState,
) -> (Level, bool) {
    match (level, state) {
        (Level::Unknown, _) => (in_force, state == AlertState::Firing),
        (_, AlertState::Firing) => (level, is_unknown),
        // The end of a level that another one has superseded says nothing of that one.
        (_, AlertState::Resolved) if in_force == level => (Level::Green, is_unknown),
        (_, AlertState::Resolved) => (in_force, is_unknown),
    }
}

/// Whether it is an order that says that somebody has seen an alert.
pub(super) fn is_acknowledgement(event: &Event) -> bool {
    matches!(
        &event.kind,
        EventKind::Order {
            order: OrderKind::Acknowledge,
            ..
        }
    )
}

/// The silence of the whole site that stands at `now` where `order` ends that of one benchmark alone: it would change nothing.
///
/// # Errors
/// [`StoreError`].
pub fn silence_of_the_site(
    store: &Store,
    order: &Order,
    now: Timestamp,
) -> Result<Option<Event>, StoreError> {
    let Order::Unsilence {
        benchmark: Some(_), ..
    } = order
    else {
        return Ok(None);
    };
    let standing = TakenOrders::read(store, None)?.silences(now);
    Ok(standing.into_iter().find(|one| one.benchmark.is_none()))
}

/// The alerts in force that a hook did not take and will not: it left the config, or does not ask for them any more.
///
/// # Errors
/// [`StoreError`].
pub fn closed(store: &Store, in_force: &InForce) -> Result<Vec<Event>, StoreError> {
    let mut found = Vec::new();
    for [hook, closed_key, closed_level, state] in store.closed_deliveries()? {
        let delivered = AlertIdentity {
            key: &closed_key,
            level: &closed_level,
            state: &state,
        };
        let is_it = |event: &&Event| {
            matches!(&event.kind, EventKind::Alert { key, level, .. } if delivered == AlertIdentity {
                key,
                level: level.name(),
                state: state_name(MessageState::Firing),
            })
        };
        let Some(alert) = in_force.values().find(is_it) else {
            continue;
        };
        found.push(Event {
            time: alert.time,
            benchmark: alert.benchmark.clone(),
            kind: EventKind::Fault {
                kind: "delivery-closed".to_owned(),
                text: format!(
                    "hook {hook:?} has not taken the {closed_level} alert {closed_key}, and will not: \
                     the config has no such hook any more, or it does not ask for such an alert"
                ),
            },
        });
    }
    Ok(found)
}

fn read(body: &str) -> Result<Event, StoreError> {
    serde_json::from_str(body).map_err(|error| StoreError::Unreadable(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alert(benchmark: Option<&str>, level: Level, state: AlertState) -> Event {
        let place = benchmark.unwrap_or("site");
        Event {
            time: "2020-01-01T00:00:00Z".parse().unwrap(),
            benchmark: benchmark.map(BenchmarkId::new),
            kind: EventKind::Alert {
                level,
                state,
                key: format!("{place}/{level}/2020-01-01T00:00:00Z"),
                rule: "chance".to_owned(),
                text: "as it was called".to_owned(),
            },
        }
    }

    #[test]
    fn the_alert_of_the_site_names_the_benchmarks_that_make_its_level_now() {
        let (mut standing, firing) = (InForce::new(), AlertState::Firing);
        for event in [
            alert(Some("a"), Level::Red, firing),
            alert(None, Level::Red, firing),
            alert(Some("b"), Level::Red, firing),
            alert(Some("c"), Level::Orange, firing),
            alert(Some("a"), Level::Red, AlertState::Resolved),
        ] {
            note(&mut standing, &event);
        }
        name_those_in_force(&mut standing);
        let text = |place: Option<&str>, level| {
            let place = place.map(BenchmarkId::new);
            let EventKind::Alert { text, .. } = &standing[&(place, level)].kind else {
                panic!("no alert");
            };
            text.clone()
        };
        assert_eq!(text(None, Level::Red), "the site: red (benchmarks b)");
        assert_eq!(text(Some("b"), Level::Red), "as it was called");
    }
}
