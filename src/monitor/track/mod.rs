//! One benchmark: each new reading grows t_max, refits, and may change regime, intercept and level.

mod adopted;
mod ahead;
mod call;
mod declared;
mod forecast;
mod lookback;
mod overdue;
mod pace;
mod past;
mod prepared;
mod queued;
mod refit;
mod resolved;
mod sensor;
mod suspicion;
mod unknown;
mod watch;

use super::Explain;
use super::covariates::Covariates;
use super::declared::Declarations;
use super::drift::Drift;
use super::event::{AlertState, Event, EventKind};
use super::history::{History, MeasuredAs, Taken};
use super::kept::KeptForecast;
use super::silence::Silence;
use crate::alert::{AlertCause, Held, Latch, Level, Policy};
use crate::fit::Rate;
use crate::forecast::LawForecaster;
use crate::reading::{BenchmarkId, Reading, SECONDS_PER_DAY, Suspicion, Timestamp, days_since};
use crate::regime::Tracker;
use adopted::Adopted;
use ahead::HeldReading;
use forecast::Forecast;
use jiff::SignedDuration;
use lookback::{Levels, Lookback};
use overdue::Overdue;
use pace::Pace;
use past::PastReview;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use unknown::{Reason, Unknown};
use watch::Watch;

pub(super) use past::{PAST, PastReplay};
pub(super) use prepared::Prepared;

/// So many readings in a row with one value are a stuck sensor, or a resolution too coarse to show it.
const STUCK: usize = 24;

/// What a step of a benchmark depends on beside its readings.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepContext<'a> {
    pub(super) phase: Phase,
    pub(super) covariates: &'a Covariates,
}

/// What holds for all benchmarks at one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phase {
    pub(super) explain: Explain,
    /// Data time.
    pub(super) now: Timestamp,
    /// Whether what comes late is judged when all that came with it has been taken.
    pub(super) in_batches: bool,
    /// Whether the past is being read: nothing is judged until it has been.
    pub(super) is_past: bool,
    /// Whether readings come faster than they can be judged: each benchmark is judged for its newest.
    pub(super) is_queue: bool,
}

/// Everything the monitor knows of one benchmark.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Track {
    benchmark: BenchmarkId,
    history: History,
    panel: LawForecaster,
    regime: Tracker,
    intercept: Drift,
    transition: Drift,
    latch: Latch,
    /// Since when the site's own rules have held.
    #[serde(default)]
    held: Held,
    silence: Silence,
    /// Until when something that happened calls for attention, and what.
    look: Option<(Timestamp, AlertCause)>,
    faulted: bool,
    backwards: bool,
    newest: Option<Timestamp>,
    #[serde(default)]
    pace: Pace,
    watch: Watch,
    /// The law under the known load that forecasts and levels go by.
    adopted: Option<Adopted>,
    /// What people declare for it.
    #[serde(default)]
    declared: Declarations,
    #[serde(default)]
    levels: Levels,
    /// What came late and is to be looked back on with the next newest reading.
    #[serde(default)]
    lookback: Option<Lookback>,
    /// What makes it unknown.
    #[serde(default)]
    unknown: Unknown,
    /// A reading that lies far ahead of all others.
    #[serde(default)]
    ahead: Option<HeldReading>,
    /// By how much its readings jump to and fro, where they are spoilt.
    #[serde(default)]
    spoilt_by: Option<f64>,
    /// Readings of a second quantity in a row.
    #[serde(default)]
    others: u32,
    /// Something came late and has not been judged.
    #[serde(default)]
    owes: bool,
    /// The first reading of a queue that has not been judged, nor has one after it.
    #[serde(default)]
    queued_since: Option<Timestamp>,
    /// The newest forecast, while a level is in force.
    #[serde(default)]
    kept: Option<KeptForecast>,
    /// What that leaves to the time after it.
    #[serde(default)]
    overdue: Option<Overdue>,
    /// Suspicions that people have looked into, and that do not hold.
    #[serde(default)]
    accepted: BTreeSet<Suspicion>,
    /// Whether its past has been gone through.
    #[serde(default)]
    record: PastReview,
    /// Forecasts computed ahead, for the next reading alone.
    #[serde(skip)]
    prepared: Prepared,
}

impl Track {
    pub(super) fn new(
        benchmark: BenchmarkId,
        source: MeasuredAs,
        epoch: Timestamp,
        declared: Declarations,
    ) -> Self {
        Self {
            declared,
            levels: Levels::default(),
            lookback: None,
            unknown: Unknown::default(),
            ahead: None,
            spoilt_by: None,
            others: 0,
            owes: false,
            queued_since: None,
            kept: None,
            overdue: None,
            accepted: BTreeSet::new(),
            record: PastReview::Known,
            prepared: Prepared::default(),
            benchmark,
            history: History::new(source, epoch),
            panel: LawForecaster::default(),
            regime: Tracker::default(),
            intercept: Drift::default(),
            transition: Drift::default(),
            latch: Latch::default(),
            held: Held::default(),
            silence: Silence::default(),
            look: None,
            faulted: false,
            backwards: false,
            newest: None,
            pace: Pace::default(),
            watch: Watch::default(),
            adopted: None,
        }
    }

    pub(super) fn level(&self) -> Level {
        self.latch.level()
    }

    pub(super) fn deadline(&self) -> Option<Timestamp> {
        let each = [self.silent_at(), self.overdue_at()];
        each.into_iter().flatten().min()
    }

    fn silent_at(&self) -> Option<Timestamp> {
        let (newest, due) = (self.silence.newest()?, self.silence.deadline()?);
        Some(self.declared.put_off(newest, due))
    }

    /// Takes one reading, and the one before it that waited for this.
    pub(super) fn take(
        &mut self,
        policy: &Policy,
        source: MeasuredAs,
        reading: &Reading,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let mut events = self.judge_ahead(policy, reading.time, context);
        events.extend(self.take_one(policy, source, reading, context));
        self.prepared = Prepared::default();
        if self.record == PastReview::Owed {
            events.retain(|event| !event.kind.is_of_the_record());
        }
        events
    }

    fn take_one(
        &mut self,
        policy: &Policy,
        source: MeasuredAs,
        reading: &Reading,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let mut events = self.declared_with(reading.time);
        if self.history.is_left_out(&self.declared, reading.time) {
            events.extend(self.leave_out(source, reading));
            return events;
        }
        if self.unknown.has(Reason::Stuck) && self.history.is_repeated_by(source, reading) {
            events.extend(self.go_on_stuck(reading.time));
            return events;
        }
        // For the look back, which begins with the first that comes late.
        let is_late = self.newest.is_some_and(|newest| reading.time <= newest);
        let before =
            (is_late && self.lookback.is_none()).then(|| self.history.observations.clone());
        let taken = self.history.take(source, reading);
        events.extend(self.complaint(taken, reading.time));
        match taken {
            Taken::OtherQuantity => {
                events.extend(self.count_other(reading.time));
                return events;
            }
            Taken::Known | Taken::OutOfRange(_) => return events,
            Taken::Newest => {
                self.newest = Some(reading.time);
                self.watch.count();
                events.extend(self.unstick(reading.time));
            }
            // What came late or was corrected is judged at once, as of the newest reading.
            Taken::Late | Taken::Corrected(_) => self.note_late(reading.time, before),
        }
        events.extend(self.count_own(reading.time));
        let time = self.newest.unwrap_or(reading.time);
        events.extend(self.reset(time));
        events.extend(self.reads_again(time, reading.time));
        events.extend(self.leave_out_clockless(time));
        if taken == Taken::Newest {
            events.extend(self.find_reset(time));
            events.extend(self.judge_sensor(time));
            events.extend(self.suspect(source, time));
            if !context.phase.in_batches {
                events.extend(self.look_back(policy, time));
            }
        }
        let is_owed = context.phase.in_batches && taken != Taken::Newest;
        self.owes |= is_owed;
        if context.phase.is_past {
            return events;
        }
        let is_stuck = self.unknown.has(Reason::Stuck);
        if is_owed
            || is_stuck
            || !self.is_refit_due(policy, taken, reading.time)
            || context.phase.is_queue && self.waits(policy, time)
        {
            events.extend(self.raise(policy, time));
            return events;
        }
        events.extend(self.judge(policy, time, context));
        events
    }

    /// What follows from the readings as they are now.
    fn judge(&mut self, policy: &Policy, time: Timestamp, context: &StepContext<'_>) -> Vec<Event> {
        let mut events = Vec::new();
        (self.owes, self.queued_since) = (false, None);
        let forecast = self.forecast(policy.critical_velocity_mm_per_day, context);
        if let Some(forecast) = &forecast {
            events.extend(self.refit(policy, time, forecast));
            events.extend(self.watch(policy, time, forecast, context));
        }
        self.decide(policy, time, forecast, &mut events);
        events
    }

    /// The level that follows from a forecast, and what the forecast leaves to the time after it. Where the level may not fall,
    /// because the readings are doubtful, neither it nor what the forecast before left is changed.
    fn decide(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: Option<Forecast>,
        events: &mut Vec<Event>,
    ) {
        let may_fall = self.may_fall();
        let (latch, levels) = (self.latch.clone(), self.levels.clone());
        let mut alerts = self.alert(policy, time, forecast.as_ref(), events);
        if !may_fall && self.latch.level() < latch.level() {
            (self.latch, self.levels) = (latch, levels);
            alerts.retain(|event| !matches!(event.kind, EventKind::Alert { .. }));
            events.append(&mut alerts);
            return;
        }
        events.append(&mut alerts);
        match &forecast {
            Some(forecast) => self.await_red(policy, time, forecast),
            None => self.overdue = None,
        }
        let is_kept = self.latch.level() > Level::Green;
        self.kept = forecast.filter(|_| is_kept).map(|forecast| {
            let outlook = forecast.in_force(days(policy.outlook));
            KeptForecast::of(time, &outlook.collapse)
        });
    }

    /// The newest forecast, while a level is in force.
    pub(super) fn kept_forecast(&self) -> Option<&KeptForecast> {
        self.kept.as_ref()
    }

    /// Rates of the whole record, and `now` on its clock, days.
    pub(super) fn rates_at(&self, now: Timestamp) -> (Vec<Rate>, f64) {
        let now_days = days_since(self.history.epoch, now);
        (self.history.rates(), now_days)
    }

    /// What comes now was measured long before `time`, which it is by the clock.
    pub(super) fn is_behind(&mut self, time: Timestamp) {
        self.silence.is_behind(time);
    }

    /// Whether something that came late is still to be looked back on.
    pub(super) fn owes_look_back(&self) -> bool {
        self.lookback.is_some()
    }

    /// One more reading of a stuck sensor: it is none, but the benchmark is not silent.
    fn go_on_stuck(&mut self, time: Timestamp) -> Option<Event> {
        self.newest = Some(time);
        self.reads_again(time, time)
    }

    /// What the laws predict after the newest reading.
    fn forecast(&mut self, critical: f64, context: &StepContext<'_>) -> Option<Forecast> {
        let (history, prepared) = (&self.history, &mut self.prepared);
        let by = |readings: &_, critical| prepared.outlook(readings, critical);
        let plain = (self.panel).update_by(&history.observations, critical, by)?;
        let known_load = self.adopted.as_mut().and_then(|adopted| {
            let channels = context.covariates.list();
            adopted.forecast(history, &channels, critical, &plain, prepared)
        });
        Some(Forecast { plain, known_load })
    }

    /// What is wrong with a reading, where something is.
    fn complaint(&mut self, taken: Taken, time: Timestamp) -> Option<Event> {
        let (kind, text) = match taken {
            Taken::Newest if self.history.identical() == STUCK => {
                let text = format!(
                    "benchmark {}: {STUCK} readings in a row are the same",
                    self.benchmark
                );
                ("stuck", text)
            }
            Taken::Newest | Taken::Known => return None,
            Taken::Late => (
                "out-of-order",
                format!("the reading of {time} came after later ones"),
            ),
            Taken::Corrected(before) => {
                let text = format!(
                    "the reading of {time} was corrected; it was {before} {}",
                    self.unit()
                );
                ("corrected", text)
            }
            Taken::OutOfRange(value) => {
                let text = format!(
                    "the reading of {time} is {value:e} {}: no slope does that",
                    self.unit()
                );
                ("out-of-range", text)
            }
            Taken::OtherQuantity if self.faulted => return None,
            Taken::OtherQuantity => {
                self.faulted = true;
                let text = format!(
                    "benchmark {} gives a second quantity; only the first is monitored",
                    self.benchmark
                );
                ("second-quantity", text)
            }
        };
        Some(self.fault(
            self.newest.map_or(time, |newest| newest.max(time)),
            kind,
            text,
        ))
    }

    /// Data time has come to `now` without a reading; `fault` is what the sensor gives instead.
    pub(super) fn pass(
        &mut self,
        policy: &Policy,
        now: Timestamp,
        fault: Option<&str>,
    ) -> Vec<Event> {
        let mut events: Vec<Event> = self.judge_overdue(policy, now).into_iter().collect();
        if self.silent_at().is_some_and(|due| due <= now) {
            events.extend(self.falls_silent(now, fault));
        }
        events
    }

    fn falls_silent(&mut self, now: Timestamp, fault: Option<&str>) -> Vec<Event> {
        let Some(newest) = self.silence.begins() else {
            return Vec::new();
        };
        let latched = match self.latch.level() {
            Level::Green | Level::Unknown => String::new(),
            level @ (Level::Yellow | Level::Orange | Level::Red) => {
                format!("; {level} stays in force")
            }
        };
        let fault = fault.map_or_else(String::new, |what| format!("; the sensor gives {what}"));
        let text = format!(
            "benchmark {}: no reading since {newest}{fault}{latched}",
            self.benchmark
        );
        let mut events = vec![self.fault(now, "no-data", text.clone())];
        events.extend(self.begins_unknown((now, newest), Reason::NoData, text));
        events
    }

    /// The benchmark is no longer watched: what is in force at it ends.
    pub(super) fn close(&mut self, now: Timestamp) -> Vec<Event> {
        let text = format!("benchmark {} is no longer watched", self.benchmark);
        let mut events: Vec<Event> = self.ends_all_unknown(now, &text).into_iter().collect();
        if let Some((level, since)) = self.latch.in_force() {
            let kind = EventKind::Alert {
                level,
                state: AlertState::Resolved,
                key: format!("{}/{level}/{since}", self.benchmark),
                rule: "removed".to_owned(),
                text,
            };
            events.push(self.event(now, kind));
        }
        events
    }

    fn look_until(&mut self, policy: &Policy, time: Timestamp, cause: AlertCause) {
        self.look = time
            .checked_add(policy.steady_for)
            .ok()
            .map(|until| (until, cause));
    }

    fn fault(&self, time: Timestamp, kind: &str, text: String) -> Event {
        self.event(
            time,
            EventKind::Fault {
                kind: kind.to_owned(),
                text,
            },
        )
    }

    fn event(&self, time: Timestamp, kind: EventKind) -> Event {
        Event {
            time,
            kind,
            benchmark: Some(self.benchmark.clone()),
        }
    }

    fn unit(&self) -> &'static str {
        match self.history.observations.quantity {
            crate::reading::Quantity::Displacement => "mm",
            crate::reading::Quantity::Velocity => "mm/day",
        }
    }
}

fn days(span: SignedDuration) -> f64 {
    span.as_secs_f64() / SECONDS_PER_DAY
}
