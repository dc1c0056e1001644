//! Events as lines for people.

use crate::monitor::{AlertState, Event, EventKind, FailureTime, Summary};
use crate::reading::Timestamp;

/// One event on one line: when, where, what.
pub(super) fn line(event: &Event) -> String {
    let place = event.benchmark.as_ref().map_or("site", |id| id.as_str());
    format!("{}  {place}  {}", minute(event.time), what(&event.kind))
}

fn what(kind: &EventKind) -> String {
    match kind {
        EventKind::Refit {
            regime,
            failure_time,
            velocity_mm_per_day,
            ..
        } => {
            let velocity = velocity_mm_per_day
                .map_or_else(String::new, |velocity| format!(", {velocity:.3} mm/day"));
            let failure = forecast(failure_time);
            format!("refit: {}{velocity}, {failure}", regime.label)
        }
        EventKind::RegimeFlip {
            from,
            to,
            probability,
        } => format!(
            "regime flip: {from} to {to} (probability {:.0} %)",
            100.0 * probability
        ),
        EventKind::InterceptDrift {
            from,
            to,
            drift_days_per_day,
            expected_days_per_day,
        } => {
            let expected = expected_days_per_day.map_or_else(String::new, |drift| {
                format!("; the fitted law expects {drift:+.2}")
            });
            drift(
                "inverse-velocity intercept",
                (*from, *to),
                *drift_days_per_day,
            ) + &expected
        }
        EventKind::TransitionDrift {
            from,
            to,
            drift_days_per_day,
        } => drift("transition time", (*from, *to), *drift_days_per_day),
        EventKind::UnexplainedResidual {
            surprise_nats,
            velocity_mm_per_day,
        } => {
            let velocity =
                velocity_mm_per_day.map_or_else(String::new, |v| format!(", {v:.3} mm/day"));
            format!(
                "unexplained residual: e^{surprise_nats:.0} times less likely than the usual reading{velocity}"
            )
        }
        EventKind::Alert {
            level, state, text, ..
        } => {
            let state = match state {
                AlertState::Firing => "firing",
                AlertState::Resolved => "resolved",
            };
            format!("ALERT {level} {state}: {text}")
        }
        EventKind::Fault { kind, text } => format!("fault {kind}: {text}"),
        EventKind::Summary(Summary {
            readings,
            refits,
            alerts,
        }) => format!("summary: {readings} readings, {refits} refits, {alerts} alerts"),
    }
}

fn drift(name: &str, (from, to): (Timestamp, Timestamp), days_per_day: f64) -> String {
    let (from, to) = (minute(from), minute(to));
    format!("{name} drifts: {from} to {to} ({days_per_day:+.2} days a day)")
}

fn forecast(failure: &FailureTime) -> String {
    let chance = 100.0 * failure.probability;
    let horizon = failure.horizon_days;
    let bound = |time: Option<Timestamp>| time.map_or("later".to_owned(), minute);
    match failure.median.or(failure.low) {
        None => format!("no failure foreseen ({chance:.0} % within {horizon:.0} days)"),
        Some(_) => format!(
            "failure {} ({} to {}, {chance:.0} % within {horizon:.0} days)",
            bound(failure.median),
            bound(failure.low),
            bound(failure.high)
        ),
    }
}

/// To the minute: people read this, and no forecast is finer.
fn minute(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d %H:%MZ").to_string()
}
