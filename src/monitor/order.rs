//! What people order of the monitor: it keeps them as it keeps readings, so that a replay has them too.

use super::Monitor;
use super::event::{Event, EventKind};
use super::given::{Given, OrderKind};
use crate::reading::{BenchmarkId, Timestamp};
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An order from people. It changes who is notified and may end a level, never what is found.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(tag = "order", rename_all = "kebab-case")]
pub enum Order {
    /// Somebody has seen what is in force: it is not tried any further.
    Acknowledge {
        /// Where; `None`: everywhere, or the whole site's where there is `alert`.
        benchmark: Option<BenchmarkId>,
        /// The key of the only alert that has been seen; `None`: all that is in force there.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        alert: Option<String>,
        /// Who, why, by which way.
        #[serde(flatten)]
        given: Given,
    },
    /// The level in force at a benchmark, and lower ones, are not reported until then; a higher one is, at once.
    Shelve {
        /// Where.
        benchmark: BenchmarkId,
        /// Until when, by the wall clock.
        until: Timestamp,
        /// Who, why, by which way.
        #[serde(flatten)]
        given: Given,
    },
    /// Nothing is reported until then; what is in force at its end is reported at its end.
    Silence {
        /// Where; `None`: everywhere.
        benchmark: Option<BenchmarkId>,
        /// Until when, by the wall clock.
        until: Timestamp,
        /// Who, why, by which way.
        #[serde(flatten)]
        given: Given,
    },
    /// The level in force ends, because people know that it is over. The next reading that calls for it calls it again.
    Resolve {
        /// Where; `None`: everywhere.
        benchmark: Option<BenchmarkId>,
        /// Who, why, by which way.
        #[serde(flatten)]
        given: Given,
    },
    /// What was shelved or silenced is reported again from now on.
    Unsilence {
        /// Where; `None`: everywhere.
        benchmark: Option<BenchmarkId>,
        /// Who, why, by which way.
        #[serde(flatten)]
        given: Given,
    },
}

impl Order {
    /// Nothing is shelved for longer than this.
    pub const LONGEST_SHELVE: SignedDuration = SignedDuration::from_hours(30 * 24);
    /// Nothing is silenced for longer than this: a red is not reported meanwhile.
    pub const LONGEST_SILENCE: SignedDuration = SignedDuration::from_hours(7 * 24);

    /// That it was given.
    pub(super) fn event(&self, time: Timestamp) -> Event {
        let (order, until, given) = match self {
            Self::Acknowledge { given, .. } => (OrderKind::Acknowledge, None, given),
            Self::Shelve { until, given, .. } => (OrderKind::Shelve, Some(*until), given),
            Self::Silence { until, given, .. } => (OrderKind::Silence, Some(*until), given),
            Self::Resolve { given, .. } => (OrderKind::Resolve, None, given),
            Self::Unsilence { given, .. } => (OrderKind::Unsilence, None, given),
        };
        let alert = match self {
            Self::Acknowledge { alert, .. } => alert.clone(),
            Self::Shelve { .. }
            | Self::Silence { .. }
            | Self::Resolve { .. }
            | Self::Unsilence { .. } => None,
        };
        Event {
            time,
            benchmark: self.benchmark().cloned(),
            kind: EventKind::Order {
                order,
                until,
                alert,
                given: given.clone(),
            },
        }
    }

    /// It was given before the alerts with these keys were called. What names an alert is of that, and what silences is of
    /// whatever comes.
    pub fn note_called_since(&mut self, keys: Vec<String>) {
        match self {
            Self::Acknowledge {
                alert: None, given, ..
            }
            | Self::Shelve { given, .. }
            | Self::Resolve { given, .. } => given.called_since = keys,
            Self::Acknowledge { alert: Some(_), .. }
            | Self::Silence { .. }
            | Self::Unsilence { .. } => {}
        }
    }

    /// Whether it says that what is in force at this benchmark has been seen.
    pub fn acknowledges(&self, benchmark: &str) -> bool {
        let place = self.benchmark().map(BenchmarkId::as_str);
        matches!(self, Self::Acknowledge { .. }) && place == Some(benchmark)
    }

    /// Whom it concerns; `None`: the whole site.
    pub fn benchmark(&self) -> Option<&BenchmarkId> {
        match self {
            Self::Acknowledge { benchmark, .. }
            | Self::Silence { benchmark, .. }
            | Self::Resolve { benchmark, .. }
            | Self::Unsilence { benchmark, .. } => benchmark.as_ref(),
            Self::Shelve { benchmark, .. } => Some(benchmark),
        }
    }
}

impl Monitor {
    /// Takes an order at `now`: that it was given, and what ends by it.
    pub(super) fn take_order(&mut self, now: Timestamp, order: &Order) -> Vec<Event> {
        let mut events = vec![order.event(now)];
        let Order::Resolve { benchmark, given } = order else {
            return events;
        };
        let mut resolved = Vec::new();
        for (id, track) in self.benchmarks.each_mut() {
            if benchmark.as_ref().is_some_and(|only| only != id) {
                continue;
            }
            if let Some(event) = track.resolve(now, given) {
                events.push(event);
                resolved.push(id.clone());
            }
        }
        for id in &resolved {
            self.benchmarks.note_changed(id);
        }
        events
    }
}
