//! Readings that hardly mean what was intended: said once with the evidence, and the benchmark is unknown while they are
//! the latest.

use super::Track;
use super::unknown::Reason;
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::reading::suspicion::{self, DatedSuspicion};
use crate::reading::{Suspicion, Timestamp};
use std::collections::BTreeSet;

/// The latest readings that are examined.
const INSPECTED: usize = 200;
/// A suspicion ends when so many of the latest readings give no rise to it.
const CALM: usize = 24;

impl Track {
    /// After the newest reading, of `time`.
    pub(super) fn suspect(&mut self, source: MeasuredAs, time: Timestamp) -> Vec<Event> {
        let unit = source.unit;
        let quantity = self.history.observations.quantity;
        let (values, name) = (
            self.history.values_as_read(unit, INSPECTED),
            unit.to_string(),
        );
        let mut found = Vec::new();
        if !suspicion::is_plain(&values, quantity, &name) {
            let readings = self.history.as_read(unit, INSPECTED);
            let since = readings.len().checked_sub(CALM);
            let is_late =
                |one: &DatedSuspicion| since.is_none_or(|since| one.at >= readings[since].0);
            found = suspicion::of_values(&readings, quantity, &name);
            found.retain(is_late);
        }
        let mut events = Vec::new();
        for kind in [Suspicion::Mark, Suspicion::Fall, Suspicion::Scale] {
            let evidence = found.iter().find(|one| one.kind == kind);
            events.extend(self.weigh(time, kind, evidence));
        }
        events
    }

    /// Whether the newest reading came while its time lay ahead of the clock, which said `clock`.
    pub(in crate::monitor) fn suspect_ahead(
        &mut self,
        now: Timestamp,
        (time, clock): (Timestamp, Timestamp),
    ) -> Vec<Event> {
        let evidence = suspicion::ahead(time, clock);
        self.weigh(now, Suspicion::Ahead, evidence.as_ref())
    }

    /// Goes by other suspicions that people have looked into.
    pub(in crate::monitor) fn accept(
        &mut self,
        now: Timestamp,
        accepted: BTreeSet<Suspicion>,
    ) -> Vec<Event> {
        self.accepted = accepted;
        let mut events = Vec::new();
        for kind in self.accepted.clone() {
            events.extend(self.weigh(now, kind, None));
        }
        events
    }

    /// Whether its times lie ahead of the clock.
    pub(in crate::monitor) fn is_ahead(&self) -> bool {
        self.unknown.has(Reason::Suspect(Suspicion::Ahead))
    }

    fn weigh(
        &mut self,
        now: Timestamp,
        kind: Suspicion,
        evidence: Option<&DatedSuspicion>,
    ) -> Vec<Event> {
        let reason = Reason::Suspect(kind);
        let evidence = evidence.filter(|_| !self.accepted.contains(&kind));
        let mut events = Vec::new();
        match (evidence, self.unknown.has(reason)) {
            (Some(evidence), false) => {
                let text = format!("benchmark {}: suspicion: {}", self.benchmark, evidence.text);
                events.push(self.fault(now, reason.name(), text.clone()));
                events.extend(self.begins_unknown((now, now), reason, text));
            }
            (None, true) => {
                let text = format!(
                    "benchmark {}: its latest readings give no rise to the suspicion {:?} any more",
                    self.benchmark,
                    kind.name()
                );
                events.push(self.fault(now, &reason.end_name(), text.clone()));
                events.extend(self.ends_unknown((now, now), reason, text));
            }
            (Some(_), true) | (None, false) => {}
        }
        events
    }
}
