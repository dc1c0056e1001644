//! An alert, and what ends with it, as Prometheus Alertmanager takes them at `POST /api/v2/alerts`.

use super::hook::{Alert, MessageState};
use crate::alert::Level;
use crate::monitor::{EventKind, since_by_key};
use crate::reading::{BEFORE_ALL, BenchmarkId, TimeSpan, Timestamp};
use jiff::SignedDuration;
use serde_json::json;

/// Alertmanager ends an alert that states no end and is not repeated, after five minutes. Ours is repeated, but it stands until we say
/// that it has ended, also while the daemon does not run: it states an end that no crisis reaches.
const STANDS_FOR: SignedDuration = SignedDuration::from_hours(365 * 24);

/// A list of this alert and of what ends with it: the lower levels that it has superseded, and at the end of what was reported
/// together each of these. The labels are the same when an alert fires and when it ends: by these it is known. `levels`:
/// what the receiver asks for.
pub(super) fn body(
    alert: &Alert,
    levels: &[Level],
    link: Option<&str>,
) -> Result<Vec<u8>, serde_json::Error> {
    serde_json::to_vec(&entries(alert, levels, link))
}

/// A list of alerts that were sent before, with their links: those in force, and such as have ended of late.
pub(super) fn again<'a>(
    alerts: impl Iterator<Item = (&'a Alert, &'a Option<String>)>,
    levels: &[Level],
) -> Result<Vec<u8>, serde_json::Error> {
    let all = alerts.flat_map(|(alert, link)| {
        let mut entries = entries(alert, levels, link.as_deref());
        if alert.state == MessageState::Firing {
            // What it superseded has ended at it before.
            entries.truncate(1);
        }
        entries
    });
    serde_json::to_vec(&all.collect::<Vec<_>>())
}

fn entries(alert: &Alert, levels: &[Level], link: Option<&str>) -> Vec<serde_json::Value> {
    let time = alert.event.time;
    let lasts = match alert.state {
        MessageState::Firing => TimeSpan::new(time, time.checked_add(STANDS_FOR).unwrap_or(time)),
        MessageState::Resolved | MessageState::Correction => {
            let called = alert.called.or_else(|| since(&alert.key)).unwrap_or(time);
            TimeSpan::new(called.min(time), time)
        }
    };
    let benchmark = alert.event.benchmark.as_ref();
    let own = (benchmark, alert.level, alert.key.as_str());
    let mut all = vec![entry(alert, own, lasts, link)];
    let earlier = (alert.earlier.iter()).filter(|one| levels.contains(&one.level));
    let earlier = earlier.map(|one| (one.benchmark.as_ref(), one.level, one.key.as_str()));
    let members = (alert.many.iter().flat_map(|many| &many.members))
        .filter(|_| alert.state == MessageState::Resolved);
    let members = members.map(|one| (one.benchmark.as_ref(), alert.level, one.key.as_str()));
    for one in earlier.chain(members) {
        let called = since(one.2).unwrap_or(time);
        all.push(entry(
            alert,
            one,
            TimeSpan::new(called.min(time), time),
            None,
        ));
    }
    all
}

/// An alert by its benchmark, level and key, with what `alert` says.
fn entry(
    alert: &Alert,
    (benchmark, level, key): (Option<&BenchmarkId>, Level, &str),
    lasts: TimeSpan,
    link: Option<&str>,
) -> serde_json::Value {
    let (mut rule, mut text) = ("", "");
    if let EventKind::Alert {
        rule: own_rule,
        text: own_text,
        ..
    } = &alert.event.kind
    {
        (rule, text) = (own_rule, own_text);
    }
    // A label without text is the same to it as no label.
    json!({
        "labels": {
            "alertname": "slipwatch",
            "site": alert.site,
            "benchmark": benchmark.map_or_else(String::new, ToString::to_string),
            "level": level.name(),
            "status": alert.status.name(),
            "key": key,
        },
        "annotations": {
            "summary": text,
            "rule": rule,
            "recommended": alert.status.marked(level.recommended_beside(alert.beside)),
            "acknowledge_url": link.unwrap_or_default(),
            "failure_time": alert.failure_time.map(|time| time.to_string()).unwrap_or_default(),
        },
        "startsAt": lasts.from,
        "endsAt": lasts.to,
    })
}

/// When it was called, where it was not called before there was any reading.
fn since(key: &str) -> Option<Timestamp> {
    since_by_key(key).filter(|time| *time > BEFORE_ALL)
}
