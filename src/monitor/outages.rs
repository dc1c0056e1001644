//! What keeps readings from coming, or from being trusted, at the whole site: sensors at fault, benchmarks that never gave a
//! reading, a wrong clock.

use super::awaited::Awaited;
use super::event::Event;
use super::sensor::Sensors;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};

/// What is known of them.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Outages {
    sensors: Sensors,
    /// Benchmarks of the config that have given no reading.
    #[serde(default)]
    awaited: Awaited,
    /// Since when the host's clock is wrong.
    #[serde(default)]
    clock_wrong: Option<Timestamp>,
}

impl Outages {
    /// The sensor of this benchmark gave a reading.
    pub(super) fn note_reading(&mut self, benchmark: &BenchmarkId, time: Timestamp) {
        self.sensors.reads(benchmark, time);
    }

    /// It gave `what` instead of a reading; whether a run of that begins.
    pub(super) fn note_missing(
        &mut self,
        benchmark: &BenchmarkId,
        time: Timestamp,
        what: &str,
    ) -> bool {
        self.sensors.fails(benchmark, time, what)
    }

    /// What the sensor gives instead of readings.
    pub(super) fn sensor_fault(&self, benchmark: &BenchmarkId) -> Option<&str> {
        self.sensors.fault(benchmark)
    }

    /// A benchmark of the config has given no reading so far: it is unknown from now on.
    pub(super) fn begin_awaiting(&mut self, now: Timestamp, benchmark: &BenchmarkId) -> Vec<Event> {
        self.awaited.begin(now, benchmark)
    }

    /// It has given a reading, or is no longer watched: `why` says which.
    pub(super) fn end_awaiting(
        &mut self,
        now: Timestamp,
        benchmark: &BenchmarkId,
        why: &str,
    ) -> Option<Event> {
        self.awaited.end(now, benchmark, why)
    }

    /// The benchmarks that are unknown because they have given no reading, and since when.
    pub(super) fn awaited(&self) -> impl Iterator<Item = (&BenchmarkId, Timestamp)> + Clone {
        self.awaited.benchmarks()
    }

    /// The host's clock is wrong; since when.
    pub(super) fn begin_clock_wrong(&mut self, now: Timestamp) -> Timestamp {
        *self.clock_wrong.get_or_insert(now)
    }

    /// The host's clock is right again; since when it was wrong.
    pub(super) fn end_clock_wrong(&mut self) -> Option<Timestamp> {
        self.clock_wrong.take()
    }

    /// Since when the host's clock is wrong.
    pub(super) fn clock_wrong(&self) -> Option<Timestamp> {
        self.clock_wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_is_wrong_since_it_was_first_found_to_be() {
        let at = |second| Timestamp::from_second(second).unwrap();
        let mut outages = Outages::default();
        assert_eq!(outages.begin_clock_wrong(at(1)), at(1));
        assert_eq!(outages.begin_clock_wrong(at(2)), at(1));
        assert_eq!(outages.clock_wrong(), Some(at(1)));
        assert_eq!(outages.end_clock_wrong(), Some(at(1)));
        assert_eq!(outages.end_clock_wrong(), None);
    }

    #[test]
    fn a_benchmark_is_awaited_from_the_first_time_that_is_said_to_its_first_reading() {
        let (at, id) = (Timestamp::UNIX_EPOCH, BenchmarkId::new("a"));
        let mut outages = Outages::default();
        assert_eq!(outages.begin_awaiting(at, &id).len(), 2);
        assert!(outages.begin_awaiting(at, &id).is_empty());
        assert_eq!(outages.awaited().count(), 1);
        assert!(outages.end_awaiting(at, &id, "reads").is_some());
        assert!(outages.end_awaiting(at, &id, "reads").is_none());
    }
}
