//! What people declare, as it acts on the readings of one benchmark.

use super::BenchmarkRecord;
use crate::monitor::declared::Declarations;
use crate::monitor::event::{Event, RESET_FOUND, RESET_RETURNED};
use crate::monitor::history::MeasuredAs;
use crate::reading::other_unit::BACK;
use crate::reading::{Reading, Timestamp, figure};

impl BenchmarkRecord {
    /// What takes effect with the reading of `time`.
    pub(in crate::monitor::track) fn declared_with(&mut self, time: Timestamp) -> Vec<Event> {
        let before = self.silence.newest();
        let reported = self.declared.take(before, time);
        let now = self.data_time(time);
        reported
            .iter()
            .map(|one| one.event(now, &self.benchmark, None))
            .collect()
    }

    /// Whether what is declared leaves a reading of that time out.
    pub(in crate::monitor::track) fn is_left_out(&self, time: Timestamp) -> bool {
        self.history.is_left_out(&self.declared, time)
    }

    /// Keeps a reading that is not to count; the resets over which it is the mean, or `None` where it shows nothing of the
    /// benchmark: one that cannot be true, or during maintenance.
    pub(in crate::monitor::track) fn leave_out(
        &mut self,
        source: MeasuredAs,
        reading: &Reading,
    ) -> Option<Vec<Event>> {
        if !self.history.set_aside(source, reading) {
            return None;
        }
        if self.declared.is_maintained(reading.time) {
            self.silence.continues(reading.time);
            return None;
        }
        let now = self.data_time(reading.time);
        let (from, to) = self.history.span(reading.time);
        let reported = self.declared.take_resets(from, to);
        let events = reported
            .iter()
            .map(|one| one.event(now, &self.benchmark, None));
        Some(events.collect())
    }

    /// The readings have been in another unit from `since` on and are in the former one again: what was read between is left out, as it would hide a
    /// later acceleration.
    pub(in crate::monitor::track) fn leave_out_other_unit(&mut self, since: Timestamp) {
        if let Some(until) = self.history.first_of_newest(BACK as usize) {
            self.declared.leave_out(since, until);
            self.history.sort_out(&self.declared);
        }
    }

    /// Takes what the readings jump by at declared resets off them.
    pub(in crate::monitor::track) fn reset(&mut self, now: Timestamp) -> Vec<Event> {
        let mut events = Vec::new();
        for (time, jump) in self.history.reset(&self.declared) {
            let reported = self.declared.take_resets(time, time);
            let reported = reported
                .iter()
                .map(|one| one.event(now, &self.benchmark, Some(jump)));
            events.extend(reported);
        }
        events
    }

    /// Takes off a fall too large for a slope that moves upslope and that the newest readings confirm: a reset that nobody declared. Where they come
    /// back that is a second one: neither the fall nor the return is motion, which would hide a later acceleration.
    pub(in crate::monitor::track) fn find_reset(&mut self, now: Timestamp) -> Option<Event> {
        if let Some((since, jump)) = self.declared.newest_found()
            && let Some(newest) = self.history.newest()
            && self.history.has_come_back((since, jump))
        {
            self.declared.find_reset(newest, -jump);
            self.history.reset(&self.declared);
            let text = format!(
                "benchmark {}: its readings came back by what they had fallen at {since}: an offset that has passed, no reset",
                self.benchmark
            );
            return Some(self.fault(now, RESET_RETURNED, text));
        }
        let (time, jump) = self.history.fallen_back()?;
        self.declared.find_reset(time, jump);
        self.history.reset(&self.declared);
        let (benchmark, by) = (&self.benchmark, -jump);
        let text = format!(
            "benchmark {benchmark}: its readings fell by {} mm at {time}, within one interval between readings, and went on \
             from there; no slope moves upslope by that much in that time, so it is taken for a reset of the instrument and is no \
             motion. Declare it with [[event]] kind = \"reset\"; if the slope did fall, set accept = [\"fall\"] for this benchmark",
            figure(by, 3)
        );
        Some(self.fault(now, RESET_FOUND, text))
    }

    /// Goes by other declarations from here on. Whether the readings that count are others then, and what of the resets takes
    /// effect; `None` where nothing is declared otherwise, or there is no reading yet.
    pub(in crate::monitor::track) fn redeclare(
        &mut self,
        declared: Declarations,
    ) -> Option<Redeclared> {
        self.declared.replace(declared)?;
        let is_sorted_out = self.history.sort_out(&self.declared);
        // Readings that count again may be newer than those that did.
        self.newest = self.newest.max(self.history.newest());
        let time = self.newest?;
        let events = self.reset(time);
        Some(Redeclared {
            time,
            is_other: is_sorted_out || !events.is_empty(),
            events,
        })
    }

    /// Whether a blast shook the instruments shortly before `time`.
    pub(in crate::monitor::track) fn is_shaken(&self, time: Timestamp) -> bool {
        self.declared.is_shaken(time)
    }

    /// When what would be due at `due`, counted from the reading of `newest`, is due: maintenance puts it off.
    pub(in crate::monitor::track) fn put_off(
        &self,
        newest: Timestamp,
        due: Timestamp,
    ) -> Timestamp {
        self.declared.put_off(newest, due)
    }
}

/// What other declarations have changed.
#[derive(Debug)]
pub(in crate::monitor::track) struct Redeclared {
    /// Of the newest reading.
    pub(in crate::monitor::track) time: Timestamp,
    /// Whether the readings that count are others than before.
    pub(in crate::monitor::track) is_other: bool,
    /// The resets that take effect.
    pub(in crate::monitor::track) events: Vec<Event>,
}

#[cfg(test)]
mod tests {
    use crate::monitor::declared::{Declaration, Declarations, Declared};
    use crate::monitor::track::fixture::{at, record};
    use crate::reading::BenchmarkId;

    #[test]
    fn a_reset_that_is_declared_later_is_taken_off_what_was_read_and_reported_once() {
        let mut record = record([0.0, 0.0, 0.0, 50.0, 50.0]);
        let declared = Declared {
            time: at(3),
            benchmark: None,
            kind: Declaration::Reset {
                size_mm: Some(50.0),
            },
        };
        let all = Declarations::of(&[declared], &BenchmarkId::new("a"));
        let changed = record.redeclare(all.clone()).unwrap();
        assert!(changed.is_other && changed.events.len() == 1);
        assert_eq!(changed.time, at(4));
        let values = &record.observations().values;
        assert!(
            values.iter().all(|one| one.value.abs() < 1e-9),
            "{values:?}"
        );
        assert!(record.redeclare(all).is_none());
    }
}
