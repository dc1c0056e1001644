//! What a replay said, beside the readings that it was given, as one MCAP file: fits, forecasts, levels, alerts.
//!
//! Readings stand as in any recording, so that the file can be replayed again. Times that lie ahead stand twice: as
//! they are, and as days from the message, which can be drawn. What does not exist is left out of a message, because
//! few readers of MCAP know schemas in which a number may be null.

mod schemas;

use super::ingest::{EventTopic, IngestError, escape, write_mcap_with};
use crate::alert::Level;
use crate::monitor::{Event, EventKind, FailureTime, Input, LevelStretch, Measured, levels_in};
use crate::reading::{BenchmarkId, Channel, Quantity, Recording, Series, Timestamp, days_since};
use crate::store::{Store, StoreError};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Writes `recording` and the `events` that followed from it into `file`; `words` gives an event's line for a person.
///
/// # Errors
/// As [`super::ingest::write_mcap`].
pub fn write(
    file: &Path,
    recording: &Recording,
    events: &[Event],
    words: &dyn Fn(&Event) -> String,
) -> Result<(), IngestError> {
    // A daemon judges what is current before the past.
    let mut events = events.to_vec();
    events.sort_by_key(|event| event.time);
    let events = &events[..];
    let mut topics = refits(events);
    topics.extend(levels(recording, events));
    topics.push(EventTopic {
        name: "/alerts".to_owned(),
        schema: schemas::alert(),
        messages: events.iter().filter_map(alert).collect(),
    });
    topics.push(EventTopic {
        name: "/log".to_owned(),
        schema: schemas::log(),
        messages: events
            .iter()
            .filter_map(|event| log(event, words))
            .collect(),
    });
    topics.retain(|topic| !topic.messages.is_empty());
    write_mcap_with(recording, &topics, file)
}

/// Everything measured that a daemon took in, up to `until`.
///
/// # Errors
/// [`StoreError`].
pub fn taken_in(store: &Store, until: Option<Timestamp>) -> Result<Recording, StoreError> {
    let mut series: BTreeMap<(BenchmarkId, Quantity), Series> = BTreeMap::new();
    let mut channels: BTreeMap<String, Channel> = BTreeMap::new();
    let mut after = 0;
    loop {
        let rows = store.steps(after)?;
        let Some(last) = rows.last() else { break };
        after = last.seq;
        for row in rows {
            if until.is_none_or(|until| row.now <= until) {
                take(&row.input, &mut series, &mut channels);
            }
        }
    }
    let mut recording = Recording {
        series: series.into_values().collect(),
        channels: channels.into_values().collect(),
        ..Recording::default()
    };
    for series in &mut recording.series {
        series.put_in_order();
    }
    for channel in &mut recording.channels {
        channel.put_in_order();
    }
    Ok(recording)
}

fn take(
    input: &Input,
    series: &mut BTreeMap<(BenchmarkId, Quantity), Series>,
    channels: &mut BTreeMap<String, Channel>,
) {
    match input.measured() {
        Some(Measured::Reading {
            benchmark,
            unit,
            averaging,
            reading,
        }) => {
            let place = (benchmark.clone(), unit.quantity());
            let one = series.entry(place).or_insert_with(|| Series {
                benchmark: benchmark.clone(),
                unit,
                averaging,
                readings: Vec::new(),
            });
            // A source may have changed its unit; a topic has one.
            let factor = unit.factor() / one.unit.factor();
            let mut reading = *reading;
            if unit != one.unit {
                reading.value *= factor;
                reading.sigma = reading.sigma.map(|sigma| sigma * factor);
            }
            one.readings.push(reading);
        }
        Some(Measured::Sample {
            channel,
            unit,
            sample,
        }) => {
            let one = (channels.entry(channel.to_owned())).or_insert_with_key(|name| Channel {
                name: name.clone(),
                unit: unit.map(str::to_owned),
                samples: Vec::new(),
            });
            one.samples.push(*sample);
        }
        None => {}
    }
}

fn topic_of(benchmark: &BenchmarkId, what: &str) -> String {
    format!("/benchmarks/{}/{what}", escape(benchmark.as_str()))
}

/// For each benchmark its fits and its forecasts.
fn refits(events: &[Event]) -> Vec<EventTopic> {
    let mut fits: BTreeMap<&BenchmarkId, Vec<(Timestamp, Value)>> = BTreeMap::new();
    let mut forecasts = fits.clone();
    for event in events {
        let Some(benchmark) = &event.benchmark else {
            continue;
        };
        if let Some((fit, forecast)) = refit(event) {
            fits.entry(benchmark).or_default().push((event.time, fit));
            let forecasts = forecasts.entry(benchmark).or_default();
            forecasts.push((event.time, forecast));
        }
    }
    let fits = fits.into_iter().map(|(benchmark, messages)| EventTopic {
        name: topic_of(benchmark, "fit"),
        schema: schemas::fit(),
        messages,
    });
    let forecasts = forecasts
        .into_iter()
        .map(|(benchmark, messages)| EventTopic {
            name: topic_of(benchmark, "forecast"),
            schema: schemas::forecast(),
            messages,
        });
    fits.chain(forecasts).collect()
}

fn refit(event: &Event) -> Option<(Value, Value)> {
    let EventKind::Refit {
        t_max,
        regime,
        failure_time,
        critical_velocity_time,
        probability_of_acceleration,
        inverse_velocity,
        transition_time,
        velocity_mm_per_day,
        chance_within_evacuation_time,
        chance_within_outlook,
        ..
    } = &event.kind
    else {
        return None;
    };
    let line = inverse_velocity.failure_time;
    let fit = present(json!({
        "time": event.time,
        "t_max": t_max,
        "regime": regime.label,
        "probability_unstable": regime.probability_unstable,
        "probability_accelerating": regime.probability_accelerating,
        "probability_of_acceleration": probability_of_acceleration,
        "velocity_mm_per_day": velocity_mm_per_day,
        "transition_time": transition_time,
        "inverse_velocity_failure_time": line,
        "inverse_velocity_failure_days": line.map(|line| days_since(event.time, line)),
        "inverse_velocity_r_squared": inverse_velocity.r_squared,
    }));
    let mut forecast = quantiles(event.time, failure_time, "");
    forecast.extend(quantiles(
        event.time,
        critical_velocity_time,
        "critical_velocity_",
    ));
    forecast.insert("time".to_owned(), json!(event.time));
    for (key, chance) in [
        (
            "chance_within_evacuation_time",
            chance_within_evacuation_time,
        ),
        ("chance_within_outlook", chance_within_outlook),
    ] {
        forecast.insert(key.to_owned(), json!(chance));
    }
    Some((fit, present(Value::Object(forecast))))
}

fn quantiles(now: Timestamp, time: &FailureTime, before: &str) -> Map<String, Value> {
    let days = |at: Option<Timestamp>| at.map(|at| days_since(now, at));
    let all = [
        ("low", json!(time.low)),
        ("median", json!(time.median)),
        ("high", json!(time.high)),
        ("low_days", json!(days(time.low))),
        ("median_days", json!(days(time.median))),
        ("high_days", json!(days(time.high))),
        ("probability", json!(time.probability)),
        ("horizon_days", json!(time.horizon_days)),
    ];
    all.map(|(key, value)| (format!("{before}{key}"), value))
        .into_iter()
        .collect()
}

/// Without what does not exist.
fn present(mut message: Value) -> Value {
    if let Some(members) = message.as_object_mut() {
        members.retain(|_, value| !value.is_null());
    }
    message
}

/// For each benchmark, and for the site where it has one, the level at its beginning and at each change.
fn levels(recording: &Recording, events: &[Event]) -> Vec<EventTopic> {
    let times = || recording.series.iter().flat_map(|series| &series.readings);
    let (Some(first), Some(last)) = (
        times().map(|reading| reading.time).min(),
        times().map(|reading| reading.time).max(),
    ) else {
        return Vec::new();
    };
    let benchmarks: BTreeSet<Option<&BenchmarkId>> = recording
        .series
        .iter()
        .map(|series| Some(&series.benchmark))
        .chain(
            events
                .iter()
                .filter(|event| alert(event).is_some())
                .map(|event| event.benchmark.as_ref()),
        )
        .collect();
    let one = |benchmark: Option<&BenchmarkId>| EventTopic {
        name: benchmark.map_or_else(|| "/site/level".to_owned(), |id| topic_of(id, "level")),
        schema: schemas::level(),
        messages: changes(&levels_in(events, benchmark, (first, last)), last),
    };
    benchmarks.into_iter().map(one).collect()
}

/// The level, and whether it is unknown, at each time at which one of them changes.
fn changes(
    (levels, unknown): &(Vec<LevelStretch>, Vec<LevelStretch>),
    last: Timestamp,
) -> Vec<(Timestamp, Value)> {
    let starts = levels.iter().chain(unknown).map(|one| one.from);
    let ends = unknown.iter().map(|one| one.to).filter(|to| *to < last);
    let times: BTreeSet<Timestamp> = starts.chain(ends).collect();
    let at = |time: Timestamp| {
        let level = levels.iter().rev().find(|one| one.from <= time);
        let level = level.map_or(Level::Green, |one| one.level);
        let is_unknown = unknown
            .iter()
            .any(|one| one.from <= time && (time < one.to || one.to == last));
        let message = json!({
            "time": time,
            "level": level,
            "number": number(level),
            "is_unknown": is_unknown,
        });
        (time, message)
    };
    times.into_iter().map(at).collect()
}

/// The level as something that can be drawn.
fn number(level: Level) -> u8 {
    match level {
        Level::Green | Level::Unknown => 0,
        Level::Yellow => 1,
        Level::Orange => 2,
        Level::Red => 3,
    }
}

fn alert(event: &Event) -> Option<(Timestamp, Value)> {
    let EventKind::Alert {
        level,
        state,
        key,
        rule,
        text,
    } = &event.kind
    else {
        return None;
    };
    let message = present(json!({
        "time": event.time,
        "benchmark": event.benchmark,
        "level": level,
        "state": state,
        "key": key,
        "rule": rule,
        "text": text,
    }));
    Some((event.time, message))
}

/// As Foxglove's log panel shows it.
fn log(event: &Event, words: &dyn Fn(&Event) -> String) -> Option<(Timestamp, Value)> {
    if matches!(event.kind, EventKind::Refit { .. } | EventKind::Summary(_)) {
        return None;
    }
    let gravity = if let EventKind::Alert { level, .. } = &event.kind {
        match level {
            Level::Green => schemas::INFO,
            Level::Yellow | Level::Unknown => schemas::WARNING,
            Level::Orange => schemas::ERROR,
            Level::Red => schemas::FATAL,
        }
    } else if event.kind.is_of_data() {
        schemas::WARNING
    } else {
        schemas::INFO
    };
    let of = event.benchmark.as_ref().map_or("site", BenchmarkId::as_str);
    let nanosecond = event.time.as_nanosecond();
    let message = json!({
        "timestamp": {
            "sec": i64::try_from(nanosecond.div_euclid(1_000_000_000)).unwrap_or_default(),
            "nsec": u32::try_from(nanosecond.rem_euclid(1_000_000_000)).unwrap_or_default(),
        },
        "level": gravity,
        "message": words(event),
        "name": of,
        "file": event.kind.name(),
        "line": 0,
    });
    Some((event.time, message))
}
