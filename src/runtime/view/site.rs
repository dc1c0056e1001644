//! The whole site at a moment: how each benchmark stands, what is in force, what was said last.

use super::{SiteReader, held, read};
use crate::alert::Level;
use crate::monitor::{CalledLevel, ChancesOfCollapse, Event, EventKind, FailureTime, KindShown};
use crate::reading::{BenchmarkId, Timestamp};
use crate::regime::Regime;
use crate::runtime::alarm_state::{AlarmState, Alarms};
use crate::runtime::standing::{InForce, TakenOrders, in_force};
use crate::runtime::vitals::VitalsPoint;
use crate::store::{LATEST, StoreError};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Alerts, faults and orders that are listed, the newest.
const LISTED: usize = 60;

/// How one benchmark stands.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct Standing {
    /// Its name.
    pub benchmark: BenchmarkId,
    /// The level in force.
    pub level: Level,
    /// Since when; `None` for green.
    pub since: Option<Timestamp>,
    /// How its alarm stands, by the names of ISA-18.2.
    pub alarm_state: AlarmState,
    /// Whether nothing can be said of it: beside the level, never instead of it.
    pub is_unknown: bool,
    /// Since when not.
    pub unknown_since: Option<Timestamp>,
    /// What people are asked to do: at the level in force, or because nothing can be said.
    pub recommended: &'static str,
    /// When its newest reading was measured.
    pub newest_reading: Option<Timestamp>,
    /// How long before the moment that was.
    pub silent_seconds: Option<i64>,
    /// When its newest forecast was made.
    pub forecast_at: Option<Timestamp>,
    /// The velocity then, mm/day.
    pub velocity_mm_per_day: Option<f64>,
    /// The regime then.
    pub regime: Option<Regime>,
    /// When it was forecast to collapse.
    pub failure_time: Option<FailureTime>,
    /// How likely it was then that a collapse comes at all.
    pub chances_of_collapse: Option<ChancesOfCollapse>,
    /// The chance of that within the evacuation time, as levels use it.
    pub chance_within_evacuation_time: Option<f64>,
    /// The chance of that within the outlook, as levels use it.
    pub chance_within_outlook: Option<f64>,
    /// The level that this forecast calls for, and the chances that levels are called by.
    pub called: Option<CalledLevel>,
    /// Where it stands: east, north and perhaps height, m.
    pub position: Option<Vec<f64>>,
}

/// The site.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct SiteView {
    /// Its name.
    pub site: String,
    /// The daemon's version.
    pub version: &'static str,
    /// The zone that people there live in.
    pub time_zone: String,
    /// What time it is there.
    pub now: Timestamp,
    /// The moment that is shown; `None`: now.
    pub at: Option<Timestamp>,
    /// The first reading of all.
    pub first: Option<Timestamp>,
    /// The last reading of all.
    pub last: Option<Timestamp>,
    /// In a replay: when the slope collapsed, once that is known.
    pub collapse: Option<Timestamp>,
    /// What is to be said of the positions, where they are not surveyed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub positions_are: Option<&'static str>,
    /// The number of the newest event that is in it.
    pub newest_event: i64,
    /// Whether orders are taken from here.
    pub takes_orders: bool,
    /// The whole site's level.
    pub level: Level,
    /// Since when nothing can be said of the site.
    pub unknown_since: Option<Timestamp>,
    /// Every benchmark.
    pub benchmarks: Vec<Standing>,
    /// The alerts in force, of the site as a whole too.
    pub alerts: Vec<Event>,
    /// Who has seen them.
    pub acknowledged: Vec<Event>,
    /// The newest acknowledgement of each alert in force that has one, by the alert's key.
    pub acknowledged_by: BTreeMap<String, Event>,
    /// The orders in force by which alerts are not reported.
    pub silences: Vec<Event>,
    /// What was said last, newest first: alerts, faults, orders.
    pub log: Vec<Event>,
    /// Whether the daemon cannot write the state: levels and newest readings are those that it knows, and the rest is as of the last write.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_not_written: bool,
}

impl SiteReader {
    /// The site as it was known at `at`, or as it is.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn site(&self, at: Option<Timestamp>) -> Result<SiteView, StoreError> {
        let now = self.now()?;
        // Before all else is read: what comes meanwhile may be in it, and is not said to be.
        let newest_event = self.store.newest_event()?;
        let (at, moment) = (at.map(held), at.map_or(now, held));
        let levels = in_force(&self.store, at)?;
        let orders = TakenOrders::read(&self.store, at)?;
        let span = self.store.span(None)?;
        let unwritten = self.vitals.as_ref().filter(|vitals| {
            let health = vitals.health();
            at.is_none() && !health.is_store_writable && health.is_caught_up
        });
        let points = unwritten.map_or_else(BTreeMap::new, |vitals| vitals.points());
        let mut known = self.known()?;
        known.extend(points.keys().cloned());
        let known = known.into_iter();
        // What is known of one that is not watched any more is of the past.
        let benchmarks = known.filter(|one| at.is_some() || self.facts().watched.includes(one));
        let alarms = Alarms::read(&self.store, at, moment, &self.facts().declared)?;
        let benchmarks = benchmarks.map(|one| self.standing(one, &levels, &alarms, at, moment));
        let site_levels = levels.iter().filter(|((place, _), _)| place.is_none());
        let called = site_levels.map(|((_, level), _)| *level);
        let called = called.filter(|level| *level != Level::Unknown).max();
        // Before the first start nothing was called for the site.
        let of_benchmarks = levels.keys().filter(|(place, _)| place.is_some());
        let of_benchmarks = of_benchmarks.map(|(_, level)| *level);
        let called = called.or_else(|| {
            self.facts()
                .level
                .of(of_benchmarks)
                .filter(|_| at.is_some())
        });
        let mut benchmarks: Vec<Standing> = benchmarks.collect::<Result<_, _>>()?;
        let mut level = called.unwrap_or(Level::Green);
        if unwritten.is_some() {
            for one in &mut benchmarks {
                one.overlay(&points, moment);
            }
            let of_benchmarks = benchmarks.iter().map(|one| one.level);
            level = level.max(self.facts().level.of(of_benchmarks).unwrap_or(level));
        }
        Ok(SiteView {
            site: self.facts().name.clone(),
            version: env!("CARGO_PKG_VERSION"),
            time_zone: self.facts().time_zone.clone(),
            now,
            at,
            first: span.map(|span| span.from),
            last: span.map(|span| span.to),
            collapse: self.collapse(at, now),
            positions_are: self.facts().positions_are,
            newest_event,
            takes_orders: self.facts().takes_orders,
            level,
            is_not_written: unwritten.is_some(),
            unknown_since: levels.get(&(None, Level::Unknown)).map(|event| event.time),
            benchmarks,
            acknowledged: orders.acknowledged(&levels),
            acknowledged_by: orders.acknowledged_by(&levels),
            silences: orders.silences(moment),
            log: self.log(at)?,
            alerts: levels.into_values().collect(),
        })
    }

    /// Every benchmark that the config names or that has given a reading.
    pub(super) fn known(&self) -> Result<BTreeSet<BenchmarkId>, StoreError> {
        let mut known: BTreeSet<BenchmarkId> = self.store.benchmarks()?.into_keys().collect();
        known.extend(self.facts().watched.named.iter().cloned());
        Ok(known)
    }

    /// How a benchmark stands at `moment`, by what was known `at` then.
    pub(super) fn standing(
        &self,
        benchmark: BenchmarkId,
        levels: &InForce,
        alarms: &Alarms,
        at: Option<Timestamp>,
        moment: Timestamp,
    ) -> Result<Standing, StoreError> {
        let until = at.unwrap_or(LATEST);
        let newest = self.store.newest_reading(benchmark.as_str(), until)?;
        let own = levels
            .iter()
            .filter(|((place, _), _)| place.as_ref() == Some(&benchmark));
        let (unknown, called): (Vec<_>, Vec<_>) =
            own.partition(|((_, level), _)| *level == Level::Unknown);
        let highest = called.into_iter().max_by_key(|((_, level), _)| *level);
        let unknown_since = unknown.first().map(|(_, event)| event.time);
        let level = highest.map_or(Level::Green, |((_, level), _)| *level);
        let is_unknown = newest.is_none() || unknown_since.is_some();
        let asks = if is_unknown && level == Level::Green {
            Level::Unknown
        } else {
            level
        };
        let mut standing = Standing {
            level,
            since: highest.map(|(_, event)| event.in_force_since()),
            is_unknown,
            recommended: asks.recommended(),
            unknown_since,
            newest_reading: newest,
            silent_seconds: silent_seconds(newest, moment),
            position: self.facts().positions.get(&benchmark).cloned(),
            forecast_at: None,
            velocity_mm_per_day: None,
            regime: None,
            failure_time: None,
            chances_of_collapse: None,
            chance_within_evacuation_time: None,
            chance_within_outlook: None,
            called: None,
            alarm_state: AlarmState::Normal,
            benchmark,
        };
        let refit =
            self.store
                .event_at(standing.benchmark.as_str(), KindShown::REFIT.name, until)?;
        if let Some(body) = refit {
            standing.forecast(&read(&body)?);
        }
        standing.alarm_state = alarms.state(Some(&standing.benchmark), standing.called.as_ref());
        Ok(standing)
    }

    fn log(&self, at: Option<Timestamp>) -> Result<Vec<Event>, StoreError> {
        let mut log = Vec::new();
        for kind in EventKind::SHOWN.iter().filter(|kind| kind.is_listed) {
            for body in self
                .store
                .newest_events(kind.name, at.unwrap_or(LATEST), LISTED)?
            {
                log.push(read::<Event>(&body)?);
            }
        }
        log.sort_by_key(|event| std::cmp::Reverse(event.time));
        log.truncate(LISTED);
        Ok(log)
    }
}

/// How long before `moment` the newest reading was measured.
fn silent_seconds(newest: Option<Timestamp>, moment: Timestamp) -> Option<i64> {
    newest.map(|newest| moment.duration_since(newest).as_secs().max(0))
}

impl Standing {
    /// As the daemon knows it, which could not write it.
    fn overlay(&mut self, points: &BTreeMap<BenchmarkId, VitalsPoint>, moment: Timestamp) {
        let Some(point) = points.get(&self.benchmark) else {
            return;
        };
        if self.level != point.level {
            (self.level, self.since) = (point.level, None);
            if self.alarm_state == AlarmState::Normal {
                self.alarm_state = AlarmState::Unacknowledged;
            }
        }
        if self.is_unknown != point.is_unknown {
            (self.is_unknown, self.unknown_since) = (point.is_unknown, None);
        }
        self.newest_reading = point.newest.max(self.newest_reading);
        self.silent_seconds = silent_seconds(self.newest_reading, moment);
    }

    fn forecast(&mut self, refit: &Event) {
        let EventKind::Refit {
            regime,
            failure_time,
            chances_of_collapse,
            velocity_mm_per_day,
            chance_within_evacuation_time,
            chance_within_outlook,
            called,
            ..
        } = &refit.kind
        else {
            return;
        };
        self.forecast_at = Some(refit.time);
        self.velocity_mm_per_day = *velocity_mm_per_day;
        self.regime = Some(regime.label);
        self.failure_time = Some(*failure_time);
        self.chances_of_collapse = chances_of_collapse.as_deref().copied();
        self.chance_within_evacuation_time = Some(*chance_within_evacuation_time);
        self.chance_within_outlook = Some(*chance_within_outlook);
        self.called = called.as_deref().cloned();
    }
}
