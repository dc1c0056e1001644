//! The messages that one event becomes.
//!
//! Times that lie ahead stand twice: as they are, and as days from the message, which can be drawn. What does not exist
//! is left out of a message, because few readers of MCAP know schemas in which a number may be null.

use super::schemas;
use crate::alert::Level;
use crate::monitor::{Event, EventKind, FailureTime};
use crate::reading::{BenchmarkId, Timestamp, days_since};
use serde_json::{Map, Value, json};

/// A fit and the forecast that rests on it; `None` of another event.
pub(super) fn refit(event: &Event) -> Option<(Value, Value)> {
    let EventKind::Refit {
        t_max,
        regime,
        failure_time,
        chances_of_collapse,
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
    if let Some(chances) = chances_of_collapse {
        forecast.insert(
            "chance_within_2_days".to_owned(),
            json!(chances.within_2_days),
        );
        forecast.insert(
            "chance_within_30_days".to_owned(),
            json!(chances.within_30_days),
        );
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

/// The level in force from `time` on.
pub(super) fn level(time: Timestamp, level: Level, is_unknown: bool) -> Value {
    json!({
        "time": time,
        "level": level,
        "number": number(level),
        "is_unknown": is_unknown,
    })
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

/// A level that was entered or left; `None` of another event.
pub(super) fn alert(event: &Event) -> Option<Value> {
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
    Some(present(json!({
        "time": event.time,
        "benchmark": event.benchmark,
        "level": level,
        "state": state,
        "key": key,
        "rule": rule,
        "text": text,
    })))
}

/// As Foxglove's log panel shows it, with `words` for a person; `None` of what stands on topics of its own.
pub(super) fn log(event: &Event, words: &str) -> Option<Value> {
    if matches!(event.kind, EventKind::Refit { .. } | EventKind::Summary(_)) {
        return None;
    }
    let severity = if let EventKind::Alert { level, .. } = &event.kind {
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
    Some(json!({
        "timestamp": {
            "sec": i64::try_from(nanosecond.div_euclid(1_000_000_000)).unwrap_or_default(),
            "nsec": u32::try_from(nanosecond.rem_euclid(1_000_000_000)).unwrap_or_default(),
        },
        "level": severity,
        "message": words,
        "name": of,
        "file": event.kind.name(),
        "line": 0,
    }))
}
