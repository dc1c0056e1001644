//! One alert in plain words.

use crate::alert::{percent_in_words, span_in_words};
use crate::cli::text;
use crate::monitor::{Event, EventKind, FailureTime};
use crate::reading::{Timestamp, counted, figure};
use crate::runtime::view::{AlertLife, AlertView};
use crate::store::DeliveryRow;
use jiff::tz::TimeZone;
use std::fmt::Write as _;

/// All of it, a paragraph each.
pub(super) fn shown(alert: &AlertView, zone: &TimeZone) -> String {
    let clock = |time: Timestamp| text::clock(time, zone);
    let place = match &alert.benchmark {
        Some(benchmark) => format!("benchmark {}", text::plain(benchmark.as_str())),
        None => "the whole site".to_owned(),
    };
    let mut out = String::new();
    let mut line = |name: &str, what: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{name:<13}{what}");
    };
    line("alert", &text::plain(&alert.key));
    line("site", &text::plain(&alert.site));
    line("where", &place);
    line("level", alert.level.name());
    line("state", &state(alert, &clock));
    line(
        "alarm state",
        &format!("{} (ISA-18.2)", alert.alarm_state.name()),
    );
    line("said", &text::local(&text::plain(&alert.text), zone));
    let condition = alert.condition.as_ref();
    let condition = condition.map_or_else(String::new, |condition| format!(": {condition}"));
    line("rule", &format!("{}{condition}", alert.rule));
    for found in evidence(alert, &clock) {
        line("evidence", &found);
    }
    line("recommended", alert.recommended);
    line("valid until", &valid(alert, &clock));
    let settings = &alert.settings;
    let policy = (alert.benchmark.as_ref()).map_or(&settings.policy, |one| settings.policy(one));
    let is_in_force = alert.benchmark.is_some() && alert.state == AlertLife::Firing;
    let ends = policy.end_in_words(alert.level).filter(|_| is_in_force);
    if let Some(ends) = ends {
        line("ends when", &ends);
    }
    line(
        "evacuation",
        &format!(
            "takes {}, by the settings then",
            span_in_words(policy.evacuation_time)
        ),
    );
    out += &deliveries(&alert.deliveries);
    out += if alert.is_acknowledged {
        "acknowledged yes\n"
    } else {
        "acknowledged no\n"
    };
    out += "audit trail\n";
    for event in &alert.audit {
        let _ = writeln!(out, "  {}", text::line(event, zone));
    }
    out
}

fn state(alert: &AlertView, clock: &dyn Fn(Timestamp) -> String) -> String {
    let since = clock(alert.since);
    let ended = alert.ended.map(clock).unwrap_or_default();
    match alert.state {
        AlertLife::Firing => format!("in force since {since}"),
        AlertLife::Superseded => {
            format!("in force from {since}, superseded by a higher level at {ended}")
        }
        AlertLife::Resolved => format!("in force from {since}, ended at {ended}"),
    }
}

fn evidence(alert: &AlertView, clock: &dyn Fn(Timestamp) -> String) -> Vec<String> {
    if alert.benchmark.is_none() {
        let keys = alert.members.iter().map(|key| text::plain(key));
        return vec![format!("alerts {}", keys.collect::<Vec<_>>().join(", "))];
    }
    let Some(Event {
        time,
        kind:
            EventKind::Refit {
                regime,
                failure_time,
                chances_of_collapse,
                inverse_velocity,
                velocity_mm_per_day,
                chance_within_evacuation_time,
                chance_within_outlook,
                called,
                ..
            },
        ..
    }) = &alert.evidence
    else {
        return vec!["no refit had been made".to_owned()];
    };
    let mut found = vec![format!("refit with the readings until {}", clock(*time))];
    if let Some(velocity) = velocity_mm_per_day {
        found.push(format!("velocity {} mm/day", figure(*velocity, 3)));
    }
    found.push(format!(
        "chance of collapse within the evacuation time {}, within the outlook {}",
        percent_in_words(*chance_within_evacuation_time),
        percent_in_words(*chance_within_outlook)
    ));
    if let Some(called) = called {
        found.push(format!(
            "chance of collapse by which red is called {} within {:.0} h, red from {}",
            percent_in_words(called.red.chance),
            called.red.within_hours,
            percent_in_words(called.red.at_least)
        ));
    }
    found.push(format!(
        "regime {}, unstable with probability {}",
        regime.label,
        percent_in_words(regime.probability_unstable)
    ));
    found.push(collapse(failure_time, clock));
    if let Some(chances) = chances_of_collapse {
        found.push(format!(
            "chance that a collapse comes: {} within 2 days, {} within 30 days",
            percent_in_words(chances.within_2_days),
            percent_in_words(chances.within_30_days)
        ));
    }
    if let Some(intercept) = inverse_velocity.failure_time {
        found.push(format!(
            "the inverse-velocity line meets zero at {}",
            clock(intercept)
        ));
    }
    found
}

fn collapse(failure: &FailureTime, clock: &dyn Fn(Timestamp) -> String) -> String {
    let bound = |time: Option<Timestamp>| {
        time.map_or_else(
            || format!("not within {:.0} days", failure.horizon_days),
            clock,
        )
    };
    format!(
        "time of collapse: 5 % {}, median {} (on the early side: the chance before it may be under one half), 95 % {}; {:.1} % within {:.0} days",
        bound(failure.low),
        bound(failure.median),
        bound(failure.high),
        100.0 * failure.probability,
        failure.horizon_days
    )
}

fn valid(alert: &AlertView, clock: &dyn Fn(Timestamp) -> String) -> String {
    match (alert.state, alert.valid_until) {
        (AlertLife::Firing, Some(until)) => format!(
            "{} for its figures, which each refit renews; the level stands until it is ended",
            clock(until)
        ),
        (AlertLife::Firing, None) => "readings come again".to_owned(),
        (AlertLife::Superseded | AlertLife::Resolved, until) => {
            format!("{}: it is over", until.map(clock).unwrap_or_default())
        }
    }
}

fn deliveries(rows: &[DeliveryRow]) -> String {
    if rows.is_empty() {
        return "deliveries   none: no hook asks for it, or its newest reading was long past when it was read (nobody is notified of that), or they have been removed with time\n"
            .to_owned();
    }
    let mut out = "deliveries\n".to_owned();
    for row in rows {
        let meaning = match row.status.as_str() {
            "waiting" if row.attempts == 0 => "has not been run yet",
            "acknowledged" if row.attempts == 0 => "was not run: somebody acknowledged it in time",
            "acknowledged" => "did not take it and is not tried again: somebody acknowledged it",
            "silenced" => "was not run: it was silenced or shelved before it was due",
            "waiting" => "is still tried",
            "delivered" => "has taken it",
            "over" => "did not get it: it was over, superseded or reported together with others",
            "dead" => "was given up",
            "closed" => "was closed: the config has no such hook any more",
            _ => "",
        };
        let _ = writeln!(
            out,
            "  {} {}: {} {meaning} ({}, {})",
            row.level,
            row.state,
            text::plain(&row.hook),
            row.status,
            counted(row.attempts, "attempt", "attempts")
        );
    }
    out
}
