//! Why nothing can be said of a benchmark: one alert, however many reasons there are for it at once.

use super::DataQuality;
use crate::alert::{Level, another_since};
use crate::monitor::event::{AlertState, Event, EventKind, SUSPECT_ENDS};
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::{Suspicion, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Reason {
    /// It gives no readings.
    NoData,
    /// It repeats its last value.
    Stuck,
    /// Many of its readings cannot be true.
    Spoilt,
    /// It gives another quantity than the one that is monitored.
    SecondQuantity,
    /// Its readings hardly mean what was intended.
    Suspect(Suspicion),
}

impl Reason {
    /// The rule's name in the alert.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::NoData => "no-data",
            Self::Stuck => "stuck-sensor",
            Self::Spoilt => "spoilt-readings",
            Self::SecondQuantity => "second-quantity",
            Self::Suspect(Suspicion::Ahead) => "suspect-ahead",
            Self::Suspect(Suspicion::Mark) => "suspect-mark",
            Self::Suspect(Suspicion::Fall) => "suspect-fall",
            Self::Suspect(Suspicion::Scale) => "suspect-scale",
        }
    }
}

impl Reason {
    /// The kind of the fault that says its end.
    pub(super) fn end_name(self) -> String {
        format!("{}{SUSPECT_ENDS}", self.name())
    }
}

/// The reasons there are, and since when there is one.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Unknown {
    reasons: BTreeSet<Reason>,
    since: Option<Timestamp>,
    /// When the one before began, which has ended.
    #[serde(default)]
    before: Option<Timestamp>,
    /// The reason that the alert names.
    #[serde(default)]
    named: Option<Reason>,
    /// What is to be said of each.
    #[serde(default)]
    texts: BTreeMap<Reason, String>,
}

impl Unknown {
    pub(super) fn has(&self, reason: Reason) -> bool {
        self.reasons.contains(&reason)
    }

    /// Whether the alert is in force.
    pub(super) fn is_in_force(&self) -> bool {
        self.since.is_some()
    }
}

impl DataQuality {
    /// There is `reason` for it from now on, after the reading of `since`; the alert, where it is the first reason.
    pub(super) fn begins_unknown(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        since: Timestamp,
        reason: Reason,
        text: String,
    ) -> Option<Event> {
        let unknown = &mut self.unknown;
        let is_first = unknown.reasons.is_empty();
        unknown.reasons.insert(reason);
        unknown.texts.insert(reason, text.clone());
        if !is_first {
            return None;
        }
        unknown.named = Some(reason);
        // A sensor that is found stuck at the reading after which it was silent is another alert than the silence.
        let is_other = unknown.before.is_none_or(|before| since > before);
        let since = if is_other {
            since
        } else {
            another_since(unknown.before, now)
        };
        unknown.since = Some(since);
        let state = AlertState::Firing;
        Some(alert(record, now, since, state, reason, text))
    }

    /// `reason` has ended, which began after the reading of `since` where nothing else was the matter; the end of the
    /// alert, where there is no other, and another alert in its place where the one that it named is over: who is to mend something must know
    /// what.
    pub(super) fn ends_unknown(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        since: Timestamp,
        reason: Reason,
        text: String,
    ) -> Vec<Event> {
        let unknown = &mut self.unknown;
        unknown.reasons.remove(&reason);
        unknown.texts.remove(&reason);
        let other = unknown.reasons.first().copied();
        if other.is_some() && unknown.named != Some(reason) {
            return Vec::new();
        }
        let since = unknown.since.take().unwrap_or(since);
        unknown.before = Some(since);
        unknown.named = other;
        let state = AlertState::Resolved;
        let mut events = vec![alert(record, now, since, state, reason, text)];
        if let Some(other) = other {
            let since = another_since(Some(since), now);
            unknown.since = Some(since);
            let text = unknown.texts.get(&other).cloned().unwrap_or_default();
            events.push(alert(record, now, since, AlertState::Firing, other, text));
        }
        events
    }

    /// Everything ends, the silence and each suspicion too; nothing where nothing was the matter.
    pub(in crate::monitor::track) fn ends_all_unknown(
        &mut self,
        record: &mut BenchmarkRecord,
        now: Timestamp,
        text: &str,
    ) -> Vec<Event> {
        let silent = record.end_silence();
        let unknown = &mut self.unknown;
        let reasons = std::mem::take(&mut unknown.reasons);
        unknown.texts.clear();
        let suspicions = reasons.iter().filter_map(|reason| {
            let ended = matches!(reason, Reason::Suspect(_)).then(|| reason.end_name());
            ended.map(|ended| record.fault(now, &ended, text.to_owned()))
        });
        let mut events: Vec<Event> = suspicions.collect();
        if let Some(since) = unknown.since.take().or(silent) {
            unknown.before = Some(since);
            let named = unknown.named.take();
            let reason = named.or(reasons.first().copied()).unwrap_or(Reason::NoData);
            let (state, text) = (AlertState::Resolved, text.to_owned());
            events.push(alert(record, now, since, state, reason, text));
        }
        events
    }
}

/// When it began is part of the key, so that each time is reported again.
fn alert(
    record: &BenchmarkRecord,
    time: Timestamp,
    since: Timestamp,
    state: AlertState,
    reason: Reason,
    text: String,
) -> Event {
    let kind = EventKind::Alert {
        level: Level::Unknown,
        state,
        key: record.alert_key(Level::Unknown, since),
        rule: reason.name().to_owned(),
        text,
    };
    record.event(time, kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::{at, record};

    #[test]
    fn of_two_reasons_the_alert_names_one_that_lasts_and_ends_with_the_second_of_them() {
        let (mut quality, record) = (DataQuality::default(), record([0.0]));
        let (stuck, spoilt) = (Reason::Stuck, Reason::Spoilt);
        let begin = |quality: &mut DataQuality, hour, reason: Reason| {
            let text = reason.name().to_owned();
            quality.begins_unknown(&record, at(hour), at(hour), reason, text)
        };
        let end = |quality: &mut DataQuality, hour, reason| {
            let events = quality.ends_unknown(&record, at(hour), at(hour), reason, String::new());
            events.iter().map(shown).collect::<Vec<String>>()
        };
        let key = |hour| record.alert_key(Level::Unknown, at(hour));
        let first = begin(&mut quality, 1, stuck).unwrap();
        assert_eq!(
            shown(&first),
            format!("stuck-sensor Firing {}: stuck-sensor", key(1))
        );
        assert!(begin(&mut quality, 2, spoilt).is_none());
        let instead = end(&mut quality, 3, stuck);
        let expected = [
            format!("stuck-sensor Resolved {}: ", key(1)),
            format!("spoilt-readings Firing {}: spoilt-readings", key(3)),
        ];
        assert_eq!(instead, expected);
        // What is not named comes and goes without a word.
        assert!(begin(&mut quality, 4, stuck).is_none());
        assert!(end(&mut quality, 5, stuck).is_empty() && quality.is_unknown());
        let last = end(&mut quality, 6, spoilt);
        assert_eq!(last, [format!("spoilt-readings Resolved {}: ", key(3))]);
        assert!(!quality.is_unknown());
        // What begins again no later than the one before began is another alert: its key has the time at which it is found.
        let again = quality.begins_unknown(&record, at(7), at(1), stuck, String::new());
        assert_eq!(
            again.as_ref().map(shown),
            Some(format!("stuck-sensor Firing {}: ", key(7)))
        );
    }

    fn shown(event: &Event) -> String {
        let EventKind::Alert {
            state,
            key,
            rule,
            text,
            ..
        } = &event.kind
        else {
            panic!("{event:?}");
        };
        format!("{rule} {state:?} {key}: {text}")
    }
}
