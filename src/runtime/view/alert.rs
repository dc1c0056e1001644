//! Everything of one alert: what called it, on which evidence, what it asks for, who got it, and who did what about it.

use super::{SiteReader, read};
use crate::alert::{Level, Policy};
use crate::monitor::{AlertState, Event, EventKind, KindShown, Settings};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::alarm_state::{AlarmState, Alarms};
use crate::runtime::clock;
use crate::runtime::standing::{
    NumberedEvent, TakenOrders, every, first_call, in_force, is_acknowledgement, numbered,
};
use crate::store::{DeliveryRow, LATEST, Store, StoreError};
use schemars::JsonSchema;
use serde::Serialize;

/// Where an alert is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum AlertLife {
    /// In force.
    Firing,
    /// A higher level of the same place has taken its place.
    Superseded,
    /// Ended.
    Resolved,
}

/// One alert.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct AlertView {
    /// Its idempotency key.
    pub key: String,
    /// The site's name.
    pub site: String,
    /// Where; `None`: the whole site.
    pub benchmark: Option<BenchmarkId>,
    /// Its level.
    pub level: Level,
    /// Whether it is in force.
    pub state: AlertLife,
    /// When it was called, data time; where the past before a first start had called its level already, then: its rule, its line and its
    /// evidence are of that time too.
    pub since: Timestamp,
    /// When it ended or was superseded, data time.
    pub ended: Option<Timestamp>,
    /// The rule that called it.
    pub rule: String,
    /// That rule's condition with the figures of the settings that were in force.
    pub condition: Option<String>,
    /// The alert's own line.
    pub text: String,
    /// The refit that it rests on: the newest one of its benchmark when it was called.
    pub evidence: Option<Event>,
    /// Of the whole site: the keys of the benchmarks' alerts that were in force with it.
    pub members: Vec<String>,
    /// What people are asked to do.
    pub recommended: &'static str,
    /// Until when its figures hold: an evacuation time after the newest refit of its benchmark. The level stands until it is
    /// ended, whatever the time. `None` of what is unknown.
    pub valid_until: Option<Timestamp>,
    /// Who was to get it.
    pub deliveries: Vec<DeliveryRow>,
    /// How it stands by the names of ISA-18.2.
    pub alarm_state: AlarmState,
    /// Whether somebody has acknowledged it.
    pub is_acknowledged: bool,
    /// What happened to it and what people did about it, oldest first.
    pub audit: Vec<Event>,
    /// The number of the step that called it, in the state.
    pub step: i64,
    /// The settings that were in force.
    #[serde(skip)]
    pub settings: Settings,
    /// The event that called it, as it stands in the state.
    #[serde(skip)]
    pub decision: String,
}

impl SiteReader {
    /// Everything of the alert with this key, or of the newest one whose key begins with it; `None` without one.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn alert(&self, key: &str) -> Result<Option<AlertView>, StoreError> {
        alert(&self.store, &self.facts().name, key)
    }
}

/// A change of the alert, with its place in the state.
struct StoredCall {
    event: Event,
    number: i64,
    step: i64,
    body: String,
}

/// How an alert stands by now.
struct AlertEnd {
    state: AlertLife,
    /// When it was over, data time.
    time: Option<Timestamp>,
    /// The number of the event by which it was over; `None` while it is in force.
    number: Option<i64>,
}

/// As [`SiteReader::alert`], for those who have the state at hand.
///
/// # Errors
/// [`StoreError`].
pub fn alert(store: &Store, site: &str, key: &str) -> Result<Option<AlertView>, StoreError> {
    let Some(call) = call(store, key)? else {
        return Ok(None);
    };
    let call = from_its_first(store, call)?;
    let EventKind::Alert {
        level,
        key,
        rule,
        text,
        ..
    } = call.event.kind.clone()
    else {
        return Ok(None);
    };
    let (since, benchmark) = (call.event.time, call.event.benchmark.clone());
    let alerts = numbered(store, KindShown::ALERT.name)?;
    let end = end(&alerts, &call);
    let (state, ended) = (end.state, end.time);
    let settings = store.settings_at(call.step)?.unwrap_or_default();
    let policy = benchmark
        .as_ref()
        .map_or(&settings.policy, |one| settings.policy(one));
    let audit = audit(store, &alerts, &call, &end)?;
    let is_acknowledged = audit.iter().any(is_acknowledgement);
    let members = if benchmark.is_none() {
        members(store, level, since)?
    } else {
        Vec::new()
    };
    Ok(Some(AlertView {
        site: site.to_owned(),
        level,
        state,
        since,
        ended,
        condition: policy.condition(&rule, level),
        rule,
        text,
        evidence: refit(store, benchmark.as_ref(), since)?,
        members,
        recommended: level.recommended(),
        valid_until: valid_until(store, level, ended, benchmark.as_ref(), since, policy)?,
        deliveries: store.deliveries_of(&key)?,
        alarm_state: alarm_state(store, &call.event, state, is_acknowledged)?,
        is_acknowledged,
        audit,
        step: call.step,
        settings,
        decision: call.body,
        benchmark,
        key,
    }))
}

/// The event that called the alert: that of the key, or the newest whose key goes on with a slash.
fn call(store: &Store, asked: &str) -> Result<Option<StoredCall>, StoreError> {
    let mut found: Option<StoredCall> = None;
    for placed in store.placed_events(KindShown::ALERT.name)? {
        let event: Event = read(&placed.body)?;
        let EventKind::Alert { key, state, .. } = &event.kind else {
            continue;
        };
        let is_it = key == asked;
        // A benchmark is named in full, so that P1 is not P10; what stands after it need not be.
        let begins = key
            .strip_prefix(asked)
            .is_some_and(|rest| rest.starts_with('/') || asked.contains('/'));
        if *state != AlertState::Firing || !is_it && !begins {
            continue;
        }
        let is_newer = found
            .as_ref()
            .is_none_or(|had| had.event.time <= event.time);
        if is_it || is_newer {
            found = Some(StoredCall {
                event,
                number: placed.seq,
                step: placed.step,
                body: placed.body,
            });
        }
        if is_it {
            break;
        }
    }
    Ok(found)
}

/// The call since which the alert stands, with its key: the past before a first start may have called the level already, by the figures
/// of then.
fn from_its_first(store: &Store, call: StoredCall) -> Result<StoredCall, StoreError> {
    let EventKind::Alert { key, .. } = &call.event.kind else {
        return Ok(call);
    };
    let Some(first) = first_call(store, key)?.filter(|first| first.time < call.event.time) else {
        return Ok(call);
    };
    for placed in store.placed_events(KindShown::ALERT.name)? {
        let event: Event = read(&placed.body)?;
        if is_same_call(&event, &first) {
            return Ok(StoredCall {
                event: first,
                // Orders are of what had been called, by whichever of both came first.
                number: call.number.min(placed.seq),
                step: placed.step,
                body: placed.body,
            });
        }
    }
    Ok(call)
}

/// Whether both are one call, whatever their keys.
fn is_same_call(one: &Event, other: &Event) -> bool {
    let words = |event: &Event| {
        if let EventKind::Alert {
            level, state, text, ..
        } = &event.kind
        {
            Some((*level, *state, text.clone()))
        } else {
            None
        }
    };
    (one.time, &one.benchmark) == (other.time, &other.benchmark) && words(one) == words(other)
}

/// How the alert stands by now, and since when it is over.
fn end(alerts: &[NumberedEvent], call: &StoredCall) -> AlertEnd {
    let mut end = AlertEnd {
        state: AlertLife::Resolved,
        time: None,
        number: None,
    };
    let EventKind::Alert {
        key: own_key,
        level: own_level,
        ..
    } = &call.event.kind
    else {
        return end;
    };
    end.state = AlertLife::Firing;
    let called = call.event.time;
    for NumberedEvent { number, event } in alerts {
        let EventKind::Alert {
            key, level, state, ..
        } = &event.kind
        else {
            continue;
        };
        if key == own_key && *state == AlertState::Resolved {
            end.state = AlertLife::Resolved;
            // The end that a backlog brings is of readings from before the beginning.
            end.time = Some(event.time.max(called));
            end.number = Some(*number);
            return end;
        }
        let is_beside = (*level == Level::Unknown) != (*own_level == Level::Unknown);
        let replaces = event.benchmark == call.event.benchmark
            && !is_beside
            && *state == AlertState::Firing
            && key != own_key
            && (level > own_level && event.time >= called
                || level == own_level && event.time > called);
        if replaces {
            end.state = AlertLife::Superseded;
            end.time = Some(end.time.map_or(event.time, |known| known.min(event.time)));
            end.number = end.number.or(Some(*number));
        }
    }
    end
}

/// Changes of the alert, orders that concern it and corrections of what it rests on.
fn audit(
    store: &Store,
    alerts: &[NumberedEvent],
    call: &StoredCall,
    end: &AlertEnd,
) -> Result<Vec<Event>, StoreError> {
    let EventKind::Alert { key: own_key, .. } = &call.event.kind else {
        return Ok(Vec::new());
    };
    let is_own = |event: &&Event| {
        matches!(&event.kind, EventKind::Alert { key, .. } if key == own_key)
            || is_same_call(event, &call.event)
    };
    let each = alerts.iter().map(|one| &one.event);
    let mut audit: Vec<Event> = each.filter(is_own).cloned().collect();
    for NumberedEvent { number, event } in TakenOrders::read(store, None)?.of(&call.event) {
        let is_in_time = end.number.is_none_or(|end| *number <= end);
        if is_in_time || is_acknowledgement(event) && is_before_the_next(alerts, call, *number) {
            audit.push(event.clone());
        }
    }
    for event in every(store, KindShown::CORRECTION.name)? {
        if event.benchmark == call.event.benchmark && event.time >= call.event.time {
            audit.push(event);
        }
    }
    audit.sort_by_key(|event| event.time);
    Ok(audit)
}

/// Whether the event with this number came before another alert was called in the place of this one.
fn is_before_the_next(alerts: &[NumberedEvent], call: &StoredCall, number: i64) -> bool {
    let is_next = |NumberedEvent { number, event }: &&NumberedEvent| {
        matches!(&event.kind, EventKind::Alert { state: AlertState::Firing, level, .. } if *level != Level::Unknown)
            && event.benchmark == call.event.benchmark
            && *number > call.number
            && event.time >= call.event.time
    };
    let next = alerts.iter().find(is_next);
    next.is_none_or(|next| number < next.number)
}

fn alarm_state(
    store: &Store,
    call: &Event,
    life: AlertLife,
    is_acknowledged: bool,
) -> Result<AlarmState, StoreError> {
    let now = store.settings_at(store.last_step())?.unwrap_or_default();
    let alarms = Alarms::read(store, None, clock::now(), &now.declared)?;
    let newest = refit(store, call.benchmark.as_ref(), LATEST)?;
    let called = newest.and_then(|event| {
        if let EventKind::Refit { called, .. } = event.kind {
            called
        } else {
            None
        }
    });
    if life == AlertLife::Superseded {
        // It has not ended: another level has taken its place.
        return Ok(alarms.state(call.benchmark.as_ref(), called.as_deref()));
    }
    Ok(alarms.state_of(call, is_acknowledged, called.as_deref()))
}

fn members(store: &Store, level: Level, since: Timestamp) -> Result<Vec<String>, StoreError> {
    let standing = in_force(store, Some(since))?;
    let of_benchmarks = standing.into_iter().filter(|((place, own), _)| {
        place.is_some() && (*own == Level::Unknown) == (level == Level::Unknown) && *own >= level
    });
    let mut keys = Vec::new();
    for (_, event) in of_benchmarks {
        if let EventKind::Alert { key, .. } = event.kind {
            keys.push(key);
        }
    }
    Ok(keys)
}

fn refit(
    store: &Store,
    benchmark: Option<&BenchmarkId>,
    until: Timestamp,
) -> Result<Option<Event>, StoreError> {
    let Some(benchmark) = benchmark else {
        return Ok(None);
    };
    let body = store.event_at(benchmark.as_str(), KindShown::REFIT.name, until)?;
    body.as_deref().map(read).transpose()
}

fn valid_until(
    store: &Store,
    level: Level,
    ended: Option<Timestamp>,
    benchmark: Option<&BenchmarkId>,
    since: Timestamp,
    policy: &Policy,
) -> Result<Option<Timestamp>, StoreError> {
    if ended.is_some() || level == Level::Unknown {
        return Ok(ended);
    }
    let newest = refit(store, benchmark, LATEST)?.map_or(since, |event| event.time);
    Ok(newest.max(since).checked_add(policy.evacuation_time).ok())
}
