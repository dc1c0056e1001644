//! What stands at a moment, from the events in a site's state: alerts in force, orders, who has seen what.

use crate::alert::Level;
use crate::monitor::{AlertState, Event, EventKind, Order, OrderKind, by_time};
use crate::reading::{BenchmarkId, Timestamp};
use crate::store::{Store, StoreError};
use std::collections::BTreeMap;

/// The alerts in force, by place and level.
pub type InForce = BTreeMap<(Option<BenchmarkId>, Level), Event>;

/// The alerts in force: by benchmark and level, of each benchmark the highest, and `unknown` beside it.
///
/// # Errors
/// [`StoreError`].
pub fn in_force(store: &Store, until: Option<Timestamp>) -> Result<InForce, StoreError> {
    let mut standing = InForce::new();
    for event in by_time(every(store, "alert")?) {
        if until.is_none_or(|until| event.time <= until) {
            note(&mut standing, &event);
        }
    }
    Ok(standing)
}

/// The call since which the alert with this key stands, under its own key: that of the past before a first start where it had called
/// the level already. `None` where no alert has the key.
///
/// # Errors
/// [`StoreError`].
pub(super) fn first_call(store: &Store, key: &str) -> Result<Option<Event>, StoreError> {
    let mut standing = InForce::new();
    for event in by_time(every(store, "alert")?) {
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
    let mut all = Vec::new();
    let mut after = 0;
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
            all.push(read(body)?);
        }
    }
}

/// Every order that was taken, oldest first.
///
/// # Errors
/// [`StoreError`].
pub fn orders(store: &Store) -> Result<Vec<Event>, StoreError> {
    every(store, "order")
}

/// The orders in force at `now` by which no hook is run, as they were given.
pub fn silences(orders: &[Event], now: Timestamp) -> Vec<Event> {
    let mut standing: Vec<Event> = Vec::new();
    for event in orders {
        let EventKind::Order { order, until, .. } = &event.kind else {
            continue;
        };
        if *order == OrderKind::Unsilence {
            let place = &event.benchmark;
            standing.retain(|one| place.is_some() && one.benchmark != *place);
        } else if until.is_some_and(|until| until > now) {
            standing.push(event.clone());
        }
    }
    standing
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
    let standing = silences(&orders(store)?, now);
    Ok(standing.into_iter().find(|one| one.benchmark.is_none()))
}

/// Who has seen what is in force: acknowledgements since its alert was called.
pub fn acknowledged(orders: &[Event], in_force: &InForce) -> Vec<Event> {
    let is_of = |ack: &Event, place: &Option<BenchmarkId>, alert: &Event| {
        let is_here = ack.benchmark.is_none() || ack.benchmark == *place;
        is_here && ack.time >= alert.time && may_be_of(ack, alert)
    };
    let is_one = |event: &&Event| {
        let is_ack = matches!(
            &event.kind,
            EventKind::Order {
                order: OrderKind::Acknowledge,
                ..
            }
        );
        is_ack
            && in_force
                .iter()
                .any(|((place, _), alert)| is_of(event, place, alert))
    };
    orders.iter().filter(is_one).cloned().collect()
}

/// Whether an order names this alert, or none.
pub(super) fn may_be_of(order: &Event, alert: &Event) -> bool {
    match (&order.kind, &alert.kind) {
        (
            EventKind::Order {
                alert: Some(only), ..
            },
            EventKind::Alert { key, .. },
        ) => only == key,
        _ => true,
    }
}

/// The alerts in force that a hook did not take and will not: it left the config, or does not ask for them any more.
///
/// # Errors
/// [`StoreError`].
pub fn closed(store: &Store, in_force: &InForce) -> Result<Vec<Event>, StoreError> {
    let mut found = Vec::new();
    for [hook, closed_key, closed_level, state] in store.closed_deliveries()? {
        let is_it = |event: &&Event| {
            matches!(&event.kind, EventKind::Alert { key, level, .. }
                if *key == closed_key && level.name() == closed_level)
        };
        let Some(alert) = in_force.values().find(is_it).filter(|_| state == "firing") else {
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
