//! Looking back after late readings: would another level have been called?

use super::Pending;
use crate::alert::{AlertEvidence, Held, Latch, Level, Policy};
use crate::fit::Observations;
use crate::forecast::LawForecaster;
use crate::monitor::event::{Event, EventKind};
use crate::monitor::history::History;
use crate::monitor::motion::observed;
use crate::monitor::track::alarm::Levels;
use crate::monitor::track::forecast::{Forecast, LookAhead};
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::{Timestamp, days_of};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Forecasts of one look back, over the readings as they were and as they are.
const MOST_FORECASTS: usize = 64;
/// Forecasts by which the mean chance that calls red begins.
const MOST_BEFORE: usize = 24;

/// What came late since the last newest reading.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Lookback {
    /// The earliest of it.
    since: Timestamp,
    /// The readings before any of it came.
    before: Observations,
    /// As they were before any of it came.
    levels: Levels,
}

impl Pending {
    /// Whether what came late is still to be looked back on.
    pub(in crate::monitor::track) fn has_look_back(&self) -> bool {
        self.lookback.is_some()
    }

    /// A reading of `time` came late, or was corrected; `before` are the readings without it, where it is the first, and
    /// `levels` those that were in force.
    pub(in crate::monitor::track) fn note_late(
        &mut self,
        time: Timestamp,
        before: Option<Observations>,
        levels: &Levels,
    ) {
        if let Some(lookback) = &mut self.lookback {
            lookback.since = lookback.since.min(time);
        } else if let Some(before) = before {
            self.lookback = Some(Lookback {
                since: time,
                before,
                levels: levels.clone(),
            });
        }
    }

    /// Whether the level in force would have been another one, had everything come in time.
    ///
    /// The same rules go over the readings as they were known and as they are now, each by a scratch latch: what
    /// these leave out (an adopted effect, a regime's flip) is left out of both, and makes no difference.
    pub(in crate::monitor::track) fn look_back(
        &mut self,
        record: &BenchmarkRecord,
        policy: &Policy,
        time: Timestamp,
    ) -> Option<Event> {
        let Lookback {
            since,
            before,
            levels,
        } = self.lookback.take()?;
        let (benchmark, history) = (record.benchmark(), record.history());
        let level_then = levels.highest_since(since);
        let known_then = highest(policy, history, &before, since);
        // Without the newest reading: that is judged by itself.
        let mut now = history.observations.clone();
        let newest = before.values.last()?.t_days;
        now.values.retain(|one| one.t_days <= newest);
        let level_now = highest(policy, history, &now, since);
        if level_now == known_then || level_now == level_then {
            return None;
        }
        let text = format!(
            "benchmark {benchmark}: with the readings since {since} that came late or were corrected, {level_now} would have \
             been called; {level_then} was in force"
        );
        let alerts = levels
            .since(since)
            .filter(|(_, level)| *level > Level::Green)
            .map(|(called, level)| record.alert_key(level, called));
        let kind = EventKind::Correction {
            since,
            level_then,
            level_now,
            alerts: alerts.collect(),
            text,
        };
        Some(record.event(time, kind))
    }
}

/// The highest level that forecasts after readings from `since` on would have called. The mean chance that calls red begins with the readings
/// before, as it did then.
fn highest(
    policy: &Policy,
    history: &History,
    observations: &Observations,
    since: Timestamp,
) -> Level {
    let values = &observations.values;
    let since = history.days(since);
    let first = values.partition_point(|one| one.t_days < since);
    let (mut latch, mut held) = (Latch::default(), Held::default());
    let mut highest = Level::Green;
    let mut after = |index: usize, is_judged: bool| {
        let known = Observations {
            values: values[..=index].to_vec(),
            ..observations.clone()
        };
        let Some(now) = history.time(values[index].t_days) else {
            return;
        };
        let mut evidence = evidence(policy, &known, now);
        held.update(policy, &mut evidence);
        if is_judged {
            latch.update(policy, &evidence);
            highest = highest.max(latch.level());
        }
    };
    let course = days_of(policy.red_course_fades());
    let begins = values.partition_point(|one| one.t_days < since - course);
    for index in newest_of(begins..first, MOST_BEFORE) {
        after(index, false);
    }
    for index in newest_of(first..values.len(), MOST_FORECASTS) {
        after(index, true);
    }
    highest
}

/// At most so many of these places, evenly: counted from the newest on, which has the most to say.
fn newest_of(places: Range<usize>, most: usize) -> impl Iterator<Item = usize> {
    let every = places.len().div_ceil(most).max(1);
    let chosen: Vec<usize> = places.rev().step_by(every).collect();
    chosen.into_iter().rev()
}

fn evidence(policy: &Policy, observations: &Observations, now: Timestamp) -> AlertEvidence {
    let outlook =
        LawForecaster::default().update(observations, policy.critical_velocity_mm_per_day);
    let forecast = outlook.map(|plain| Forecast {
        plain,
        known_load: None,
    });
    let forecast = forecast.as_ref();
    let rates = forecast.map_or(&[][..], |forecast| &forecast.plain.rates);
    let evacuation_days = days_of(policy.evacuation_time);
    let observed = observed(observations, rates, now, evacuation_days);
    LookAhead::of(policy, forecast).evidence(policy, forecast, observed)
}
