//! Events as lines for people.

use crate::effects::Kind;
use crate::monitor::{
    AlertState, Event, EventKind, FailureTime, SharedFailure, Summary, Unexplained,
};
use crate::reading::{BenchmarkId, Timestamp};

/// One event on one line: when, where, what.
pub(super) fn line(event: &Event) -> String {
    let place = event.benchmark.as_ref().map_or("site", |id| id.as_str());
    let text = format!("{}  {place}  {}", minute(event.time), what(&event.kind));
    plain(&text)
}

/// The text with its control characters written out: a name with a line break in it forges no line.
pub(super) fn plain(text: &str) -> String {
    if !text.chars().any(char::is_control) {
        return text.to_owned();
    }
    let mut plain = String::with_capacity(text.len() + 8);
    for letter in text.chars() {
        if letter.is_control() {
            plain.extend(letter.escape_default());
        } else {
            plain.push(letter);
        }
    }
    plain
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
        EventKind::UnexplainedResidual(what) => unexplained(what),
        EventKind::EffectFound { .. } => effect_found(kind),
        EventKind::EffectDropped { effect, channel } => format!(
            "effect dropped: {}; forecasts go without it",
            through(*effect, channel.as_deref())
        ),
        EventKind::Alert {
            level, state, text, ..
        } => {
            let state = match state {
                AlertState::Firing => "firing",
                AlertState::Resolved => "resolved",
            };
            format!("ALERT {level} {state}: {text}")
        }
        EventKind::Together { groups } => together(groups),
        EventKind::Fault { kind, text } => format!("fault {kind}: {text}"),
        EventKind::Declared { text, .. } => format!("declared: {text}"),
        EventKind::Correction { text, .. } => format!("correction: {text}"),
        EventKind::Order { order, until, by } => ordered(order, *until, by.as_deref()),
        EventKind::Summary(Summary {
            readings,
            refits,
            alerts,
        }) => format!("summary: {readings} readings, {refits} refits, {alerts} alerts"),
    }
}

fn together(groups: &[SharedFailure]) -> String {
    if groups.is_empty() {
        return "no benchmarks share a failure time any more".to_owned();
    }
    let each = groups.iter().map(|group| {
        let names: Vec<&str> = group.benchmarks.iter().map(BenchmarkId::as_str).collect();
        let names = names.join(", ");
        format!("{names} share one: {}", forecast(&group.failure_time))
    });
    format!("failure times: {}", each.collect::<Vec<_>>().join("; "))
}

fn ordered(order: &str, until: Option<Timestamp>, by: Option<&str>) -> String {
    let until = until.map_or_else(String::new, |until| format!(" until {}", minute(until)));
    let by = by.map_or_else(String::new, |by| format!(" by {by}"));
    format!("{order}{by}{until}")
}

fn unexplained(what: &Unexplained) -> String {
    match what {
        Unexplained::Reading {
            surprise_nats,
            velocity_mm_per_day,
        } => {
            let velocity =
                velocity_mm_per_day.map_or_else(String::new, |v| format!(", {v:.3} mm/day"));
            format!(
                "unexplained residual: e^{surprise_nats:.0} times less likely than the usual reading{velocity}"
            )
        }
        Unexplained::Structure {
            bic_gain,
            load_sd,
            since,
        } => format!(
            "unexplained residual since {}: as under a load of {load_sd:.2} e-folds of velocity (BIC {bic_gain:.0})",
            minute(*since)
        ),
    }
}

fn through(effect: Kind, channel: Option<&str>) -> String {
    channel.map_or_else(
        || effect.to_string(),
        |channel| format!("{effect} {channel}"),
    )
}

fn effect_found(kind: &EventKind) -> String {
    let EventKind::EffectFound {
        effect,
        channel,
        form,
        at,
        lag_days,
        bic_gain,
        p_value,
        cannot_separate_from,
        adopted,
        ..
    } = kind
    else {
        return String::new();
    };
    let form = form.map_or_else(String::new, |form| format!(" by its {}", form.name()));
    let at = at.map_or_else(String::new, |at| format!(" at {}", minute(at)));
    let lag = lag_days.map_or_else(String::new, |lag| format!(", {lag:.1} days later"));
    let p = p_value.map_or_else(String::new, |p| format!(", p {p:.3}"));
    let rivals = if cannot_separate_from.is_empty() {
        String::new()
    } else {
        format!(
            ", cannot be separated from {}",
            cannot_separate_from.join(", ")
        )
    };
    let use_of = if *adopted {
        "forecasts go by it"
    } else {
        "forecasts go without it"
    };
    let name = through(*effect, channel.as_deref());
    format!(
        "effect found: consistent with {name}{form}{at}{lag} (BIC {bic_gain:.0}{p}{rivals}); {use_of}"
    )
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
pub(super) fn minute(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d %H:%MZ").to_string()
}
