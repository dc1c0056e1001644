//! Readings that hardly mean what was intended: said once with the evidence, and the benchmark is unknown while they are
//! the latest.

use super::DataQuality;
use super::unknown::Reason;
use crate::monitor::event::Event;
use crate::monitor::history::MeasuredAs;
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::suspicion::{self, DatedSuspicion};
use crate::reading::{Suspicion, Timestamp, Unit};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// The latest readings that are examined.
const INSPECTED: usize = 200;
/// A suspicion ends when so many of the latest readings give no rise to it.
const CALM: usize = 24;

impl DataQuality {
    /// After the newest reading, of `time`. `holds_scale`: a suspicion of another scale goes on until the readings contradict it.
    pub(in crate::monitor::track) fn suspect(
        &mut self,
        record: &BenchmarkRecord,
        source: MeasuredAs,
        time: Timestamp,
        holds_scale: bool,
    ) -> Vec<Event> {
        let (unit, history) = (source.unit, record.history());
        let quantity = history.observations.quantity;
        let values = history.values_as_read(unit, INSPECTED);
        let name = match unit {
            Unit::Length(length) => Cow::Borrowed(length.symbol()),
            Unit::Rate(..) => Cow::Owned(unit.to_string()),
        };
        let mut found = Vec::new();
        if !suspicion::is_plain(&values, quantity, &name) {
            let readings = history.as_read(unit, INSPECTED);
            let since = readings.len().checked_sub(CALM);
            let is_late =
                |one: &DatedSuspicion| since.is_none_or(|since| one.at >= readings[since].0);
            found = suspicion::of_values(&readings, quantity, &name);
            found.retain(is_late);
        }
        let mut events = Vec::new();
        for kind in [Suspicion::Mark, Suspicion::Fall, Suspicion::Scale] {
            let evidence = found.iter().find(|one| one.kind == kind);
            let stands = kind == Suspicion::Scale
                && holds_scale
                && evidence.is_none()
                && self.unknown.has(Reason::Suspect(kind));
            if stands && suspicion::may_still_have_another_scale(&values, &name) {
                continue;
            }
            events.extend(self.weigh(record, time, kind, evidence));
        }
        events
    }

    /// Whether the newest reading came while its time lay ahead of the clock, which said `clock`.
    pub(in crate::monitor::track) fn suspect_ahead(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        time: Timestamp,
        clock: Timestamp,
    ) -> Vec<Event> {
        let evidence = suspicion::ahead(time, clock);
        self.weigh(record, now, Suspicion::Ahead, evidence.as_ref())
    }

    /// Goes by other suspicions that people have looked into.
    pub(in crate::monitor::track) fn accept(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        accepted: BTreeSet<Suspicion>,
    ) -> Vec<Event> {
        self.accepted.clone_from(&accepted);
        let mut events = Vec::new();
        for kind in accepted {
            events.extend(self.weigh(record, now, kind, None));
        }
        events
    }

    fn weigh(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        kind: Suspicion,
        evidence: Option<&DatedSuspicion>,
    ) -> Vec<Event> {
        let reason = Reason::Suspect(kind);
        let evidence = evidence.filter(|_| !self.is_accepted(kind));
        let benchmark = record.benchmark();
        let mut events = Vec::new();
        match (evidence, self.unknown.has(reason)) {
            (Some(evidence), false) => {
                let text = format!("benchmark {benchmark}: suspicion: {}", evidence.text);
                events.push(record.fault(now, reason.name(), text.clone()));
                events.extend(self.begins_unknown(record, now, now, reason, text));
            }
            (None, true) => {
                let text = format!(
                    "benchmark {benchmark}: its latest readings give no rise to the suspicion {:?} any more",
                    kind.name()
                );
                events.push(record.fault(now, &reason.end_name(), text.clone()));
                events.extend(self.ends_unknown(record, now, now, reason, text));
            }
            (Some(_), true) | (None, false) => {}
        }
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::{at, record};

    #[test]
    fn a_suspicion_that_people_accept_ends_and_does_not_come_back() {
        let (mut quality, record) = (DataQuality::default(), record([0.0]));
        let ahead = |quality: &mut DataQuality| {
            let events = quality.suspect_ahead(&record, at(9), at(9), at(1));
            events.len()
        };
        assert_eq!(ahead(&mut quality), 2, "the fault and the alert");
        assert!(quality.is_ahead());
        assert_eq!(ahead(&mut quality), 0);
        let accepted = BTreeSet::from([Suspicion::Ahead]);
        assert_eq!(quality.accept(&record, at(9), accepted).len(), 2);
        assert_eq!(ahead(&mut quality), 0);
        assert!(!quality.is_unknown());
    }
}
