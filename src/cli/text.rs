//! Events as lines for people.

use crate::alert::percent_in_words;
use crate::effects::{Kind, Rival};
use crate::monitor::{
    AlertState, Event, EventKind, FailureTime, SharedFailure, Summary, Unexplained,
};
pub(super) use crate::reading::plain;
use crate::reading::{BenchmarkId, Timestamp, figure};
use crate::runtime::site::BEFORE_ALL;
use jiff::tz::TimeZone;
use textwrap::{Options, WordSplitter};

/// One event on one line: when, where, what, by the clocks of `zone`.
pub(super) fn line(event: &Event, zone: &TimeZone) -> String {
    let place = event.benchmark.as_ref().map_or("site", |id| id.as_str());
    let text = format!("{}  {place}  {}", minute(event.time), what(&event.kind));
    local(&plain(&text), zone)
}

/// A line on as many lines of at most `columns` columns as its words need; those after the first begin with `indent`.
pub(super) fn wrapped(line: &str, columns: usize, indent: &str) -> String {
    let options = Options::new(columns).subsequent_indent(indent);
    textwrap::fill(line, options.word_splitter(WordSplitter::NoHyphenation))
}

/// The text with its times in UTC as the clocks of `zone` show them.
pub(super) fn local(text: &str, zone: &TimeZone) -> String {
    if *zone == TimeZone::UTC {
        return text.to_owned();
    }
    let mut out = String::with_capacity(text.len() + 8);
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let (shown, length) = match time_at(rest) {
            Some((time, length)) => (clock(time, zone), length),
            None => (letter.to_string(), letter.len_utf8()),
        };
        out.push_str(&shown);
        rest = &rest[length..];
    }
    out
}

/// The time in UTC with which `text` begins, and its length.
fn time_at(text: &str) -> Option<(Timestamp, usize)> {
    let is_like = |(byte, like): (u8, u8)| match like {
        b'0' => byte.is_ascii_digit(),
        b'T' => byte == b'T' || byte == b' ',
        other => byte == other,
    };
    let start = text.as_bytes().get(..MINUTE.len())?;
    if !start.iter().copied().zip(MINUTE.bytes()).all(is_like) {
        return None;
    }
    let rest = &text[MINUTE.len()..];
    let seconds = rest.find(|letter: char| !matches!(letter, ':' | '.' | '0'..='9'))?;
    let length = MINUTE.len() + seconds + 1;
    let is_utc = rest[seconds..].starts_with('Z');
    let seconds = if seconds == 0 {
        ":00"
    } else {
        &rest[..seconds]
    };
    let time = format!("{}{seconds}Z", &text[..MINUTE.len()])
        .parse()
        .ok()?;
    is_utc.then_some((time, length))
}

/// How a time begins.
const MINUTE: &str = "0000-00-00T00:00";

/// To the minute, as a clock there shows it.
pub(super) fn clock(time: Timestamp, zone: &TimeZone) -> String {
    if *zone == TimeZone::UTC || time <= BEFORE_ALL {
        return minute(time);
    }
    let local = time.to_zoned(zone.clone());
    local.strftime("%Y-%m-%d %H:%M %Z").to_string()
}

fn what(kind: &EventKind) -> String {
    match kind {
        EventKind::Refit {
            regime,
            failure_time,
            velocity_mm_per_day,
            ..
        } => {
            let velocity = velocity_mm_per_day.map_or_else(String::new, |velocity| {
                format!(", {} mm/day", figure(velocity, 3))
            });
            let failure = forecast(failure_time);
            format!("refit: {}{velocity}, {failure}", regime.label)
        }
        EventKind::RegimeFlip {
            from,
            to,
            probability,
        } => format!(
            "regime flip: {from} to {to} (probability {})",
            percent_in_words(*probability)
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
        EventKind::Order { .. } => ordered(kind),
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

fn ordered(kind: &EventKind) -> String {
    let EventKind::Order {
        order,
        until,
        given,
        ..
    } = kind
    else {
        return String::new();
    };
    let until = until.map_or_else(String::new, |until| format!(" until {}", minute(until)));
    let by = (given.by.as_ref()).map_or_else(String::new, |by| format!(" by {by}"));
    let why = (given.why.as_ref()).map_or_else(String::new, |why| format!(": {why}"));
    format!("{}{by}{until}{why}", order.name())
}

fn unexplained(what: &Unexplained) -> String {
    match what {
        Unexplained::Reading {
            surprise_nats,
            velocity_mm_per_day,
        } => {
            let velocity = velocity_mm_per_day
                .map_or_else(String::new, |v| format!(", {} mm/day", figure(v, 3)));
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
            Rival::listed(cannot_separate_from)
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
    let chance = percent_in_words(failure.probability);
    let horizon = failure.horizon_days;
    let bound = |time: Option<Timestamp>| time.map_or("later".to_owned(), minute);
    match failure.median.or(failure.low) {
        None => format!("no failure predicted ({chance} within {horizon:.0} days)"),
        Some(_) => format!(
            "failure {} ({} to {}, {chance} within {horizon:.0} days)",
            bound(failure.median),
            bound(failure.low),
            bound(failure.high)
        ),
    }
}

/// To the minute: people read this, and no forecast is finer.
fn minute(time: Timestamp) -> String {
    if time <= BEFORE_ALL {
        return "before any reading".to_owned();
    }
    time.strftime("%Y-%m-%d %H:%MZ").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_text_are_shown_by_the_clocks_of_the_zone_and_nothing_else_changes() {
        let rome = TimeZone::get("Europe/Rome").unwrap();
        for (text, shown) in [
            ("2017-06-05 01:00Z  P1", "2017-06-05 03:00 CEST  P1"),
            ("since 2017-01-05T23:30:00Z.", "since 2017-01-06 00:30 CET."),
            (
                "at 2017-06-05T01:00:00.25Z, é",
                "at 2017-06-05 03:00 CEST, é",
            ),
            ("2017-06-05T01:00:00+02:00", "2017-06-05T01:00:00+02:00"),
            ("2017-06-05 01:00", "2017-06-05 01:00"),
            ("x 2017-06-05é", "x 2017-06-05é"),
        ] {
            assert_eq!(local(text, &rome), shown);
            assert_eq!(local(text, &TimeZone::UTC), text);
        }
    }
}
