//! Benchmarks of the config that have given no reading yet: unknown until they do.

use super::event::{AlertState, Event, EventKind, alert_key};
use crate::alert::Level;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Since when each of them is unknown.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Awaited(BTreeMap<BenchmarkId, Timestamp>);

impl Awaited {
    /// `benchmark` is unknown from now on, if it was not before.
    pub(super) fn begin(&mut self, now: Timestamp, benchmark: &BenchmarkId) -> Vec<Event> {
        if self.0.contains_key(benchmark) {
            return Vec::new();
        }
        self.0.insert(benchmark.clone(), now);
        let text = format!("benchmark {benchmark}: no reading so far");
        let fault = EventKind::Fault {
            kind: "no-data".to_owned(),
            text: text.clone(),
        };
        let alert = alert(benchmark, now, AlertState::Firing, text);
        [fault, alert]
            .into_iter()
            .map(|kind| Event {
                time: now,
                kind,
                benchmark: Some(benchmark.clone()),
            })
            .collect()
    }

    /// It has given a reading, or is no longer watched.
    pub(super) fn end(
        &mut self,
        now: Timestamp,
        benchmark: &BenchmarkId,
        why: &str,
    ) -> Option<Event> {
        let since = self.0.remove(benchmark)?;
        let text = format!("benchmark {benchmark} {why}");
        Some(Event {
            time: now,
            kind: alert(benchmark, since, AlertState::Resolved, text),
            benchmark: Some(benchmark.clone()),
        })
    }

    /// Those that are awaited, and since when.
    pub(super) fn benchmarks(&self) -> impl Iterator<Item = (&BenchmarkId, Timestamp)> + Clone {
        self.0.iter().map(|(id, since)| (id, *since))
    }
}

fn alert(benchmark: &BenchmarkId, since: Timestamp, state: AlertState, text: String) -> EventKind {
    EventKind::Alert {
        level: Level::Unknown,
        state,
        key: alert_key(benchmark, Level::Unknown, 0, since),
        rule: "no-data".to_owned(),
        text,
    }
}
