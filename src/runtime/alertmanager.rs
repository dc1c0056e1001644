//! One alert as Prometheus Alertmanager takes it at `POST /api/v2/alerts`.

use super::hook::{Alert, MessageState};
use super::site::BEFORE_ALL;
use crate::monitor::EventKind;
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde_json::json;

/// Alertmanager ends an alert that states no end and is not repeated, after five minutes. Ours stands until we say that it has
/// ended, so it states an end that no crisis reaches.
const STANDS_FOR: SignedDuration = SignedDuration::from_hours(365 * 24);

/// A list of this one alert. Its labels are the same when it fires and when it ends: by these it is known.
pub(super) fn body(alert: &Alert, link: Option<&str>) -> Result<Vec<u8>, serde_json::Error> {
    let (mut rule, mut text) = ("", "");
    if let EventKind::Alert {
        rule: own_rule,
        text: own_text,
        ..
    } = &alert.event.kind
    {
        (rule, text) = (own_rule, own_text);
    }
    let time = alert.event.time;
    let (starts_at, ends_at) = match alert.state {
        MessageState::Firing => (time, time.checked_add(STANDS_FOR).ok()),
        MessageState::Resolved | MessageState::Correction => {
            let called = alert.called.or_else(|| since(alert)).unwrap_or(time);
            (called.min(time), Some(time))
        }
    };
    let benchmark = alert.event.benchmark.as_ref();
    let benchmark = benchmark.map_or_else(String::new, ToString::to_string);
    // A label without text is the same to it as no label.
    serde_json::to_vec(&json!([{
        "labels": {
            "alertname": "slipwatch",
            "site": alert.site,
            "benchmark": benchmark,
            "level": alert.level.name(),
            "status": alert.status.name(),
            "key": alert.key,
        },
        "annotations": {
            "summary": text,
            "rule": rule,
            "recommended": alert.level.recommended(),
            "acknowledge_url": link.unwrap_or_default(),
            "failure_time": alert.failure_time.map(|time| time.to_string()).unwrap_or_default(),
        },
        "startsAt": starts_at,
        "endsAt": ends_at,
    }]))
}

/// When it was called: the end of its key, where it was not called before there was any reading.
fn since(alert: &Alert) -> Option<Timestamp> {
    let time = alert.key.rsplit_once('/')?.1.parse().ok();
    time.filter(|time| *time > BEFORE_ALL)
}
