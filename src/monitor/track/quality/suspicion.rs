//! Readings that hardly mean what was intended: said once with the evidence, and the benchmark is unknown while they are
//! the latest.

use super::DataQuality;
use super::unknown::Reason;
use crate::monitor::event::Event;
use crate::monitor::history::{History, MeasuredAs};
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::other_unit::{self, OtherUnit};
use crate::reading::suspicion::{self, DatedSuspicion};
use crate::reading::{Suspicion, Timestamp, Unit};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// The latest readings that are examined.
const INSPECTED: usize = 200;
/// And those by which a slow slope shows that it moves as its unit says: work is bounded.
const OF_RECORD: usize = 20_000;
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
        if let Some(other) = &self.other_unit {
            found.push(other.suspicion(time, &name));
        }
        if !suspicion::is_plain(&values, quantity, &name) {
            let readings = history.as_read(unit, INSPECTED);
            let since = readings.len().checked_sub(CALM);
            let is_late =
                |one: &DatedSuspicion| since.is_none_or(|since| one.at >= readings[since].0);
            let all = suspicion::of_values(&readings, quantity, &name);
            found.extend(all.into_iter().filter(is_late).filter(|one| {
                one.kind != Suspicion::Scale || !holds_scale || !has_moved(history, unit, &name)
            }));
            // One step is no fall of the slope and another unit.
            let step = self.other_unit.as_ref().map(OtherUnit::at);
            found.retain(|one| one.kind != Suspicion::Fall || Some(one.at) != step);
        }
        let mut events = Vec::new();
        let evidence = |kind: Suspicion| found.iter().find(|one| one.kind == kind);
        let mut kinds = [Suspicion::Mark, Suspicion::Fall, Suspicion::Scale];
        // Where one suspicion takes the place of another the benchmark stays unknown, under another alert.
        kinds.sort_by_key(|kind| evidence(*kind).is_none());
        for kind in kinds {
            let evidence = evidence(kind);
            let stands = kind == Suspicion::Scale
                && holds_scale
                && evidence.is_none()
                && self.unknown.has(Reason::Suspect(kind));
            if stands
                && suspicion::may_still_have_another_scale(&values, &name)
                && !has_moved(history, unit, &name)
            {
                continue;
            }
            events.extend(self.weigh(record, time, kind, evidence));
        }
        events
    }

    /// After the newest reading: whether the readings are in another unit from some time on. Since when they were, where they no longer are: the
    /// newest [`other_unit::BACK`] are in the former one.
    pub(in crate::monitor::track) fn look_at_unit(
        &mut self,
        record: &BenchmarkRecord,
        unit: Unit,
    ) -> Option<Timestamp> {
        let stood = self.other_unit.take().filter(OtherUnit::is_confirmed);
        if self.is_accepted(Suspicion::Scale) {
            return None;
        }
        let history = record.history();
        let mut ended = None;
        let found = match stood {
            Some(mut stands) => {
                let newest = history.with_resets(unit, 1);
                let mut newest = newest.iter().map(|(_, value)| value * unit.factor());
                let goes_on = newest.all(|value| stands.goes_on(value));
                ended = (!goes_on).then(|| stands.at());
                goes_on.then_some(stands)
            }
            None => newly_in_other_unit(history, unit),
        };
        self.other_unit = found
            .filter(|other| !(other.may_be_a_reset() && history.is_reset_since(other.before())));
        ended
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

/// Whether the record shows motion that readings in a larger unit would not, though its latest readings lie close together.
fn has_moved(history: &History, unit: Unit, name: &str) -> bool {
    suspicion::have_moved(history.newest_first(unit).take(OF_RECORD), name)
}

fn newly_in_other_unit(history: &History, unit: Unit) -> Option<OtherUnit> {
    let quantity = unit.quantity();
    let readings = history.with_resets(unit, other_unit::gone_by(quantity));
    let found = OtherUnit::newly(&readings, quantity)?;
    Some(found.given_in(unit.factor()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::{at, record};

    #[test]
    fn a_slow_slope_read_finely_is_in_its_own_unit_once_its_record_shows_that_it_moves() {
        let value = |row: i64| 5.0 + 0.01 * row as f64 + 0.003 * (row * 7 % 5) as f64;
        let value = |row: i64| (value(row) * 1e3).round() / 1e3;
        let of = |count: i64| record((0..count).map(value));
        let suspect = |quality: &mut DataQuality, count: i64| {
            let source = crate::monitor::track::fixture::DISPLACEMENT;
            let events = quality.suspect(&of(count), source, at(count - 1), true);
            events.len()
        };
        let mut quality = DataQuality::default();
        assert_eq!(suspect(&mut quality, 100), 2, "it may be in metres");
        assert_eq!(suspect(&mut quality, 150), 0, "it still may");
        assert_eq!(suspect(&mut quality, 400), 2, "it has moved by 4 mm");
        assert!(!quality.is_unknown());
        let mut of_all = DataQuality::default();
        assert_eq!(suspect(&mut of_all, 1000), 0);
    }

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
