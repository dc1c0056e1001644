//! Why nothing can be said of a benchmark: one alert, however many reasons there are for it at once.

use super::Track;
use crate::alert::Level;
use crate::monitor::event::{AlertState, Event, EventKind, SUSPECT_ENDS};
use crate::reading::{Suspicion, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

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
pub(super) struct Unknown {
    reasons: BTreeSet<Reason>,
    since: Option<Timestamp>,
    /// When the one before began, which has ended.
    #[serde(default)]
    before: Option<Timestamp>,
}

impl Unknown {
    pub(super) fn has(&self, reason: Reason) -> bool {
        self.reasons.contains(&reason)
    }
}

impl Track {
    /// Whether nothing can be said of it now.
    pub(in crate::monitor) fn is_unknown(&self) -> bool {
        self.unknown.since.is_some() || self.silence.is_silent()
    }

    /// Whether it gives no readings.
    pub(in crate::monitor) fn is_silent(&self) -> bool {
        self.silence.is_silent()
    }

    /// There is `reason` for it from now on, after the reading of `since`; the alert, where it is the first reason.
    pub(super) fn begins_unknown(
        &mut self,
        (now, since): (Timestamp, Timestamp),
        reason: Reason,
        text: String,
    ) -> Option<Event> {
        let is_first = self.unknown.reasons.is_empty();
        self.unknown.reasons.insert(reason);
        if !is_first {
            return None;
        }
        // A sensor that is found stuck at the reading after which it was silent is another alert than the silence.
        let is_other = self.unknown.before.is_none_or(|before| since > before);
        let since = if is_other { since } else { now };
        self.unknown.since = Some(since);
        Some(self.unknown_alert((now, since), AlertState::Firing, reason, text))
    }

    /// `reason` has ended, which began after the reading of `since` where nothing else was the matter; the end of the
    /// alert, where there is no other.
    pub(super) fn ends_unknown(
        &mut self,
        (now, since): (Timestamp, Timestamp),
        reason: Reason,
        text: String,
    ) -> Option<Event> {
        self.unknown.reasons.remove(&reason);
        if !self.unknown.reasons.is_empty() {
            return None;
        }
        let since = self.unknown.since.take().unwrap_or(since);
        self.unknown.before = Some(since);
        Some(self.unknown_alert((now, since), AlertState::Resolved, reason, text))
    }

    /// Everything ends; `None` where nothing was the matter.
    pub(super) fn ends_all_unknown(&mut self, now: Timestamp, text: &str) -> Option<Event> {
        let silent = self.silence.end();
        let reason = self.unknown.reasons.first().copied();
        self.unknown.reasons.clear();
        let since = self.unknown.since.take().or(silent)?;
        self.unknown.before = Some(since);
        let reason = reason.unwrap_or(Reason::NoData);
        Some(self.unknown_alert((now, since), AlertState::Resolved, reason, text.to_owned()))
    }

    /// When it began is part of the key, so that each time is reported again.
    fn unknown_alert(
        &self,
        (time, since): (Timestamp, Timestamp),
        state: AlertState,
        reason: Reason,
        text: String,
    ) -> Event {
        let kind = EventKind::Alert {
            level: Level::Unknown,
            state,
            key: format!("{}/{}/{since}", self.benchmark, Level::Unknown),
            rule: reason.name().to_owned(),
            text,
        };
        self.event(time, kind)
    }
}
