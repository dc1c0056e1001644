//! One benchmark: each new reading grows t_max, refits, and may change regime, intercept and level.

mod adopted;
mod call;
mod declared;
mod forecast;
mod lookback;
mod motion;
mod pace;
mod refit;
mod watch;

use super::Explain;
use super::covariates::Covariates;
use super::declared::Declarations;
use super::drift::Drift;
use super::event::{AlertState, Event, EventKind};
use super::history::{History, Source, Taken};
use super::silence::Silence;
use crate::alert::{Cause, Latch, Level, Policy};
use crate::forecast::Panel;
use crate::reading::{BenchmarkId, Reading, SECONDS_PER_DAY, Timestamp};
use crate::regime::Tracker;
use adopted::Adopted;
use forecast::Forecast;
use jiff::SignedDuration;
use lookback::{Levels, Lookback};
use pace::Pace;
use serde::{Deserialize, Serialize};
use watch::Watch;

pub(super) use motion::settled;

/// So many readings in a row with one value are a stuck sensor, or a resolution too coarse to tell.
const STUCK: usize = 24;

/// What lies beside a benchmark's readings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside<'a> {
    pub(super) covariates: &'a Covariates,
    pub(super) explain: Explain,
}

/// Everything the monitor knows of one benchmark.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Track {
    benchmark: BenchmarkId,
    history: History,
    panel: Panel,
    regime: Tracker,
    intercept: Drift,
    transition: Drift,
    latch: Latch,
    silence: Silence,
    /// Until when something that happened asks for a look, and what.
    look: Option<(Timestamp, Cause)>,
    faulted: bool,
    backwards: bool,
    newest: Option<Timestamp>,
    #[serde(default)]
    pace: Pace,
    watch: Watch,
    /// The fuller law that forecasts and levels go by.
    adopted: Option<Adopted>,
    /// What people declare for it.
    #[serde(default)]
    declared: Declarations,
    #[serde(default)]
    levels: Levels,
    /// What came late and is to be looked back on with the next newest reading.
    #[serde(default)]
    lookback: Option<Lookback>,
}

impl Track {
    pub(super) fn new(
        benchmark: BenchmarkId,
        source: Source,
        epoch: Timestamp,
        declared: Declarations,
    ) -> Self {
        Self {
            declared,
            levels: Levels::default(),
            lookback: None,
            benchmark,
            history: History::new(source, epoch),
            panel: Panel::default(),
            regime: Tracker::default(),
            intercept: Drift::default(),
            transition: Drift::default(),
            latch: Latch::default(),
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
        let (newest, due) = (self.silence.newest()?, self.silence.deadline()?);
        Some(self.declared.put_off(newest, due))
    }

    /// Takes one reading.
    pub(super) fn take(
        &mut self,
        policy: &Policy,
        source: Source,
        reading: &Reading,
        beside: &Beside<'_>,
    ) -> Vec<Event> {
        let mut events = self.declared_with(reading.time);
        if self.history.is_left_out(&self.declared, reading.time) {
            events.extend(self.leave_out(source, reading));
            return events;
        }
        // For the look back, which begins with the first that comes late.
        let is_late = self.newest.is_some_and(|newest| reading.time <= newest);
        let before =
            (is_late && self.lookback.is_none()).then(|| self.history.observations.clone());
        let taken = self.history.take(source, reading);
        events.extend(self.complaint(taken, reading.time));
        match taken {
            Taken::Known | Taken::OtherQuantity | Taken::OutOfRange(_) => return events,
            Taken::Newest => {
                self.newest = Some(reading.time);
                self.watch.count();
            }
            // What came late or was corrected is judged at once, as of the newest reading.
            Taken::Late | Taken::Corrected(_) => self.note_late(reading.time, before),
        }
        let time = self.newest.unwrap_or(reading.time);
        events.extend(self.reset(time));
        events.extend(self.reads_again(time, reading.time));
        if taken == Taken::Newest {
            events.extend(self.look_back(policy, time));
        }
        if !self.is_refit_due(policy, taken, reading.time) {
            events.extend(self.raise(policy, time));
            return events;
        }
        let forecast = self.forecast(policy.critical_velocity_mm_per_day, beside);
        if let Some(forecast) = &forecast {
            events.extend(self.refit(policy, time, forecast));
            events.extend(self.watch(policy, time, forecast, beside));
        }
        events.extend(self.alert(policy, time, forecast.as_ref()));
        events
    }

    /// What the laws foretell after the newest reading.
    fn forecast(&mut self, critical: f64, beside: &Beside<'_>) -> Option<Forecast> {
        let plain = self.panel.update(&self.history.observations, critical)?;
        let history = &self.history;
        let fuller = self.adopted.as_mut().and_then(|adopted| {
            let channels = beside.covariates.list();
            adopted.forecast(history, &channels, (critical, &plain.rates))
        });
        Some(Forecast { plain, fuller })
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
    pub(super) fn pass(&mut self, now: Timestamp, fault: Option<&str>) -> Vec<Event> {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Vec::new();
        }
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
        vec![
            self.fault(now, "no-data", text.clone()),
            self.unknown((now, newest), AlertState::Firing, text),
        ]
    }

    /// The benchmark is no longer watched: what is in force at it ends.
    pub(super) fn close(&mut self, now: Timestamp) -> Vec<Event> {
        let text = format!("benchmark {} is no longer watched", self.benchmark);
        let mut events = Vec::new();
        if let Some(since) = self.silence.end() {
            events.push(self.unknown((now, since), AlertState::Resolved, text.clone()));
        }
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

    fn look_until(&mut self, policy: &Policy, time: Timestamp, cause: Cause) {
        self.look = time
            .checked_add(policy.steady_for)
            .ok()
            .map(|until| (until, cause));
    }

    /// A silence that began after the reading of `since`: part of the key, so that each is told anew.
    fn unknown(
        &self,
        (time, since): (Timestamp, Timestamp),
        state: AlertState,
        text: String,
    ) -> Event {
        let kind = EventKind::Alert {
            level: Level::Unknown,
            state,
            key: format!("{}/{}/{since}", self.benchmark, Level::Unknown),
            rule: "no-data".to_owned(),
            text,
        };
        self.event(time, kind)
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
