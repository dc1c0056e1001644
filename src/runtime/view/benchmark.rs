//! One benchmark at a moment: its readings, every forecast until then, what was found and called.

use super::site::Standing;
use super::thin::{self, ThinPoint};
use super::{SiteReader, held, read};
use crate::fit::{Observations, Rate, RateOptions};
use crate::forecast::InverseVelocityLine;
use crate::monitor::{
    CalledLevel, ChancesOfCollapse, Event, EventKind, FailureTime, KindShown, LevelStretch,
    levels_in,
};
use crate::reading::{
    BenchmarkId, Quantity, SECONDS_PER_DAY, Series, TimeSpan, Timestamp, days_since, unix_seconds,
};
use crate::runtime::alarm_state::Alarms;
use crate::runtime::standing::{TakenOrders, in_force};
use crate::store::{EARLIEST, LATEST, MOST_SHOWN, StoreError, Values};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};

/// Stretches of time of which each series keeps its extremes, at most.
const MOST_BUCKETS: usize = 2000;
const BUCKETS: usize = 400;
/// Velocities that are drawn.
const VELOCITIES: usize = 400;
/// Events of one kind that are listed, the newest.
const MOST_EVENTS: usize = 300;

/// What is asked for.
#[derive(Debug, Clone, Copy, Default)]
pub struct TimeWindow {
    /// The moment; `None`: now.
    pub at: Option<Timestamp>,
    /// From when on; `None`: all.
    pub from: Option<Timestamp>,
    /// Until when; `None`: all.
    pub to: Option<Timestamp>,
    /// Stretches of time of which each series keeps its extremes.
    pub buckets: Option<usize>,
}

/// A series by columns: seconds since 1970, and values.
#[derive(Debug, Clone, Default, PartialEq, JsonSchema, Serialize)]
pub struct ViewColumns {
    /// Seconds since 1970.
    pub t: Vec<f64>,
    /// Values: of readings mm or mm/day, of velocities mm/day, of a covariate in its `unit`.
    pub v: Vec<f64>,
}

impl ViewColumns {
    fn of(points: &[ThinPoint], buckets: usize) -> Self {
        let kept = thin::min_max(points, buckets);
        Self {
            t: kept.iter().map(|point| point.0).collect(),
            v: kept.iter().map(|point| point.1).collect(),
        }
    }
}

/// A covariate.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct Covariate {
    /// Its name.
    pub name: String,
    /// Its unit, where it has one.
    pub unit: Option<String>,
    /// Its samples.
    #[serde(flatten)]
    pub samples: ViewColumns,
}

/// One forecast, short.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct ForecastView {
    /// When it was made.
    pub time: Timestamp,
    /// When the slope collapses.
    pub failure_time: FailureTime,
    /// How likely it is that a collapse comes at all.
    pub chances_of_collapse: Option<ChancesOfCollapse>,
    /// The chance of that within the evacuation time, as levels use it.
    pub chance_within_evacuation_time: f64,
    /// The chance of that within the outlook, as levels use it.
    pub chance_within_outlook: f64,
    /// The level that it calls for, and the chances that levels are called by.
    pub called: Option<CalledLevel>,
    /// Of kappa above 0.
    pub probability_unstable: f64,
    /// Of r above 0.
    pub probability_accelerating: f64,
    /// The regime.
    pub regime: &'static str,
    /// r of the most probable law, 1/day.
    pub r_per_day: Option<f64>,
    /// kappa of the same law, 1/day.
    pub kappa_per_day: Option<f64>,
    /// The velocity then, mm/day.
    pub velocity_mm_per_day: Option<f64>,
    /// Where an effect is adopted: what the law says without it.
    pub without_effect: Option<FailureTime>,
}

/// One benchmark.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct BenchmarkView {
    /// The site's name.
    pub site: String,
    /// The daemon's version.
    pub version: &'static str,
    /// The zone that people there live in.
    pub time_zone: String,
    /// The number of the newest event that is in it.
    pub newest_event: i64,
    /// Whether orders are taken from here.
    pub takes_orders: bool,
    /// How it stands.
    pub standing: Standing,
    /// The moment that is shown; `None`: now.
    pub at: Option<Timestamp>,
    /// What time it is at the site.
    pub now: Timestamp,
    /// The first reading of all.
    pub first: Option<Timestamp>,
    /// The last reading of all, also after the moment.
    pub last: Option<Timestamp>,
    /// In a replay: when the slope collapsed, once that is known.
    pub collapse: Option<Timestamp>,
    /// What is measured.
    pub quantity: Quantity,
    /// Whether there are earlier readings in the window than could be looked at.
    pub is_cut: bool,
    /// Readings, mm or mm/day.
    pub readings: ViewColumns,
    /// Velocities in them, mm/day.
    pub velocities: ViewColumns,
    /// The straight line through the newest inverse velocities, from (seconds, day/mm) to zero.
    pub line: Option<[ThinPoint; 2]>,
    /// Every forecast, thinned.
    pub forecasts: Vec<ForecastView>,
    /// The newest refit whole.
    pub latest: Option<Event>,
    /// The levels in force.
    pub levels: Vec<LevelStretch>,
    /// When nothing could be said.
    pub unknown: Vec<LevelStretch>,
    /// Covariates.
    pub covariates: Vec<Covariate>,
    /// What was found, declared, ordered.
    pub marks: Vec<Event>,
    /// The letter of each kind of them on the axis of time.
    pub letters: BTreeMap<&'static str, char>,
    /// Alerts, newest first.
    pub alerts: Vec<Event>,
    /// Who has seen what is in force, on the whole site.
    pub acknowledged: Vec<Event>,
    /// The orders in force by which alerts are not reported, on the whole site.
    pub silences: Vec<Event>,
}

/// The kinds of event that are marked on the axis of time.
fn marked() -> impl Iterator<Item = KindShown> {
    let kinds = EventKind::SHOWN.into_iter();
    kinds.filter(|kind| kind.letter.is_some())
}

impl SiteReader {
    /// One benchmark as it was known at a moment; `None` where there is none of that name.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn benchmark(
        &self,
        name: &str,
        window: TimeWindow,
    ) -> Result<Option<BenchmarkView>, StoreError> {
        let id = BenchmarkId::new(name);
        if !self.known()?.contains(&id) {
            return Ok(None);
        }
        let now = self.now()?;
        let newest_event = self.store.newest_event()?;
        let (at, moment) = (window.at.map(held), window.at.map_or(now, held));
        let known = at.unwrap_or(LATEST);
        let shown_span = TimeSpan {
            from: window.from.map_or(EARLIEST, held),
            to: window.to.map_or(LATEST, held).min(known),
        };
        let buckets = window.buckets.unwrap_or(BUCKETS).clamp(10, MOST_BUCKETS);
        let all = self.series(name, known)?;
        let is_cut = all.readings.len() >= MOST_SHOWN;
        let shown = within(&all, shown_span);
        let latest = self.store.event_at(name, KindShown::REFIT.name, known)?;
        let latest: Option<Event> = latest.as_deref().map(read).transpose()?;
        let mut alerts =
            self.events(name, KindShown::ALERT.name, TimeSpan::new(EARLIEST, known))?;
        let course = all
            .readings
            .first()
            .map(|first| levels_in(&alerts, Some(&id), TimeSpan::new(first.time, moment)));
        let (levels, unknown) = course.unwrap_or_default();
        alerts.reverse();
        alerts.truncate(MOST_EVENTS);
        let levels_now = in_force(&self.store, at)?;
        let alarms = Alarms::read(&self.store, at, moment, &self.facts().declared)?;
        let span = self.store.span(Some(name))?;
        let orders = TakenOrders::read(&self.store, at)?;
        Ok(Some(BenchmarkView {
            site: self.facts().name.clone(),
            version: env!("CARGO_PKG_VERSION"),
            time_zone: self.facts().time_zone.clone(),
            newest_event,
            takes_orders: self.facts().takes_orders,
            acknowledged: orders.acknowledged(&levels_now),
            silences: orders.silences(moment),
            standing: self.standing(id, &levels_now, &alarms, at, moment)?,
            at,
            now,
            first: span.map(|span| span.from),
            last: span.map(|span| span.to),
            collapse: self.collapse(at, now),
            quantity: all.quantity(),
            is_cut,
            readings: ViewColumns::of(&points(&shown), buckets),
            velocities: velocities(&shown, VELOCITIES),
            line: line(&all, latest.as_ref()),
            forecasts: self.forecasts(name, shown_span, buckets)?,
            latest,
            levels,
            unknown,
            covariates: self.covariates(shown_span, known, buckets)?,
            marks: self.marks(name, known)?,
            letters: marked()
                .filter_map(|kind| Some((kind.name, kind.letter?)))
                .collect(),
            alerts,
        }))
    }

    /// The benchmark's readings in mm or mm/day until `known`, as they were known then.
    fn series(&self, name: &str, known: Timestamp) -> Result<Series, StoreError> {
        self.store.series(&Values {
            name,
            is_reading: true,
            from: EARLIEST,
            to: known,
            known,
            most: MOST_SHOWN,
        })
    }

    fn covariates(
        &self,
        span: TimeSpan,
        known: Timestamp,
        buckets: usize,
    ) -> Result<Vec<Covariate>, StoreError> {
        let mut covariates = Vec::new();
        for (name, unit) in self.store.channels()? {
            let samples = self.store.values(&Values {
                name: &name,
                is_reading: false,
                from: span.from,
                to: span.to,
                known,
                most: MOST_SHOWN,
            })?;
            let points: Vec<ThinPoint> = samples
                .iter()
                .map(|sample| (unix_seconds(sample.time), sample.value))
                .collect();
            covariates.push(Covariate {
                name,
                unit,
                samples: ViewColumns::of(&points, buckets),
            });
        }
        Ok(covariates)
    }

    /// Of each stretch of time the forecast with the greatest chance, and the last.
    fn forecasts(
        &self,
        name: &str,
        span: TimeSpan,
        buckets: usize,
    ) -> Result<Vec<ForecastView>, StoreError> {
        let (mut all, mut failure) = (Vec::new(), None);
        self.store.events_within(
            name,
            KindShown::REFIT.name,
            span,
            &mut |body| match read(body) {
                Ok(event) => all.extend(forecast(&event)),
                Err(error) => failure = Some(error),
            },
        )?;
        failure.map_or_else(|| Ok(thinned(all, buckets)), Err)
    }

    fn marks(&self, name: &str, until: Timestamp) -> Result<Vec<Event>, StoreError> {
        let mut marks = Vec::new();
        for kind in marked() {
            marks.extend(self.events(name, kind.name, TimeSpan::new(EARLIEST, until))?);
        }
        marks.sort_by_key(|event| event.time);
        Ok(marks)
    }

    /// The newest events of one kind, oldest first.
    fn events(&self, name: &str, kind: &str, span: TimeSpan) -> Result<Vec<Event>, StoreError> {
        let (mut events, mut failure) = (VecDeque::new(), None);
        self.store
            .events_within(name, kind, span, &mut |body| match read(body) {
                Ok(event) => {
                    events.push_back(event);
                    if events.len() > 10 * MOST_EVENTS {
                        events.pop_front();
                    }
                }
                Err(error) => failure = Some(error),
            })?;
        failure.map_or_else(|| Ok(events.into()), Err)
    }
}

fn points(series: &Series) -> Vec<ThinPoint> {
    let readings = series.readings.iter();
    readings
        .map(|reading| (unix_seconds(reading.time), reading.value))
        .collect()
}

fn within(series: &Series, span: TimeSpan) -> Series {
    let mut part = series.clone();
    part.readings
        .retain(|reading| (span.from..=span.to).contains(&reading.time));
    part
}

/// Velocities in the readings, `most` at most; of readings that are velocities the readings themselves.
fn velocities(series: &Series, most: usize) -> ViewColumns {
    if series.quantity() == Quantity::Velocity {
        return ViewColumns::of(&points(series), most / 4);
    }
    let Some(first) = series.readings.first() else {
        return ViewColumns::default();
    };
    let rates = rates(series, RateOptions { most });
    let second = |rate: &Rate| SECONDS_PER_DAY.mul_add(rate.middle(), unix_seconds(first.time));
    ViewColumns {
        t: rates.iter().map(second).collect(),
        v: rates.iter().map(|rate| rate.velocity).collect(),
    }
}

fn rates(series: &Series, options: RateOptions) -> Vec<Rate> {
    let observations = Observations::of(series);
    let all = 0..observations.values.len();
    observations.rates(all, options)
}

/// The line of the newest refit, where these readings give it.
fn line(series: &Series, latest: Option<&Event>) -> Option<[ThinPoint; 2]> {
    let latest = latest?;
    let EventKind::Refit {
        inverse_velocity,
        t_max,
        ..
    } = &latest.kind
    else {
        return None;
    };
    let start = series.readings.first()?.time;
    let until = within(series, TimeSpan::new(start, *t_max));
    let zero = days_since(start, inverse_velocity.failure_time?);
    let rates = rates(&until, RateOptions::default());
    let segment = InverseVelocityLine::segment(InverseVelocityLine::newest(&rates), zero)?;
    Some(segment.map(|(day, height)| (SECONDS_PER_DAY.mul_add(day, unix_seconds(start)), height)))
}

fn forecast(event: &Event) -> Option<ForecastView> {
    let EventKind::Refit {
        regime,
        failure_time,
        chances_of_collapse,
        velocity_mm_per_day,
        chance_within_evacuation_time,
        chance_within_outlook,
        called,
        plain,
        ..
    } = &event.kind
    else {
        return None;
    };
    Some(ForecastView {
        time: event.time,
        failure_time: *failure_time,
        chances_of_collapse: chances_of_collapse.as_deref().copied(),
        chance_within_evacuation_time: *chance_within_evacuation_time,
        chance_within_outlook: *chance_within_outlook,
        called: called.as_deref().cloned(),
        probability_unstable: regime.probability_unstable,
        probability_accelerating: regime.probability_accelerating,
        regime: regime.label.label(),
        r_per_day: regime.r_per_day,
        kappa_per_day: regime.kappa_per_day,
        velocity_mm_per_day: *velocity_mm_per_day,
        without_effect: plain.as_ref().map(|plain| plain.failure_time),
    })
}

fn thinned(all: Vec<ForecastView>, buckets: usize) -> Vec<ForecastView> {
    if all.len() <= 2 * buckets {
        return all;
    }
    let size = all.len().div_ceil(buckets);
    let mut kept = Vec::new();
    for part in all.chunks(size) {
        let chance = |one: &&ForecastView| one.chance_within_evacuation_time;
        let greatest = part
            .iter()
            .rev()
            .max_by(|a, b| chance(a).total_cmp(&chance(b)));
        let last = part.last();
        kept.extend(greatest.filter(|one| last.is_some_and(|last| last.time > one.time)));
        kept.extend(last);
    }
    kept.into_iter().cloned().collect()
}
