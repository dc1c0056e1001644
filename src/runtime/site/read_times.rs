//! Up to when the readings of each benchmark are known, and since when they are live.

use crate::reading::{BenchmarkId, Timestamp};
use std::collections::{BTreeMap, BTreeSet};

/// The times of what has been read.
#[derive(Debug, Default)]
pub(super) struct ReadTimes {
    newest: BTreeMap<BenchmarkId, Timestamp>,
    /// The latest of the readings of a benchmark that lay ahead of data time when they were taken.
    ahead: BTreeMap<BenchmarkId, Timestamp>,
    /// Up to which step the state has readings of a benchmark that do not count any more: they come again, and are new then.
    read_anew: BTreeMap<BenchmarkId, i64>,
    /// Benchmarks that had given readings when everything there was had been read: what comes of them now is live.
    at_rest: BTreeSet<BenchmarkId>,
}

/// What of it the memory keeps: the newest readings, those ahead, and the steps up to which readings are read anew.
pub(super) type RememberedTimes = (
    BTreeMap<BenchmarkId, Timestamp>,
    BTreeMap<BenchmarkId, Timestamp>,
    BTreeMap<BenchmarkId, i64>,
);

impl ReadTimes {
    /// As the memory has them: nothing is live yet.
    pub(super) fn remembered((newest, ahead, read_anew): RememberedTimes) -> Self {
        Self {
            newest,
            ahead,
            read_anew,
            at_rest: BTreeSet::new(),
        }
    }

    /// For the memory.
    pub(super) fn to_remember(&self) -> RememberedTimes {
        let newest = self.newest.clone();
        (newest, self.ahead.clone(), self.read_anew.clone())
    }

    /// Notes a reading that is taken while data time is `now`. One that lies ahead of it waits until another one confirms it.
    pub(super) fn note(&mut self, benchmark: &BenchmarkId, time: Timestamp, now: Timestamp) {
        let known = if time <= now {
            &mut self.newest
        } else {
            &mut self.ahead
        };
        let latest = known.entry(benchmark.clone()).or_insert(time);
        *latest = time.max(*latest);
    }

    /// The only reading of a benchmark waits from here on.
    pub(super) fn first_waits(&mut self, benchmark: &BenchmarkId) {
        if let Some(first) = self.newest.remove(benchmark) {
            self.ahead.insert(benchmark.clone(), first);
        }
    }

    /// Keeps what is known of the benchmarks that stay: the readings of the others come again, and are new to what is known
    /// from here on.
    pub(super) fn retain(&mut self, stays: impl Fn(&BenchmarkId) -> bool) {
        self.newest.retain(|id, _| stays(id));
        self.ahead.retain(|id, _| stays(id));
    }

    /// The benchmarks with a reading, those among them of which all lie ahead of data time.
    pub(super) fn of_any(&self) -> BTreeSet<BenchmarkId> {
        self.newest
            .keys()
            .chain(self.ahead.keys())
            .cloned()
            .collect()
    }

    /// The readings of a benchmark up to step number `last` do not count any more.
    pub(super) fn forget_read(&mut self, benchmark: BenchmarkId, last: i64) {
        self.read_anew.insert(benchmark, last);
    }

    /// The last step of which the readings of a benchmark do not count any more; 0 where all do.
    pub(super) fn anew_after(&self, benchmark: Option<&BenchmarkId>) -> i64 {
        let last = benchmark.and_then(|one| self.read_anew.get(one));
        last.copied().unwrap_or(0)
    }

    /// The newest reading of a benchmark that does not wait for another one.
    pub(super) fn newest(&self, benchmark: &BenchmarkId) -> Option<Timestamp> {
        self.newest.get(benchmark).copied()
    }

    /// The same, of each.
    pub(super) fn each(&self) -> impl Iterator<Item = (&BenchmarkId, Timestamp)> {
        self.newest.iter().map(|(id, time)| (id, *time))
    }

    /// The newest of all benchmarks.
    pub(super) fn newest_of_all(&self) -> Option<Timestamp> {
        self.newest.values().max().copied()
    }

    /// How many benchmarks have given one.
    pub(super) fn count(&self) -> usize {
        self.newest.len()
    }

    /// Whether the benchmark has given no reading as late as this one, of those that do not wait for another one.
    pub(super) fn is_newest(&self, benchmark: &BenchmarkId, time: Timestamp) -> bool {
        self.newest(benchmark).is_none_or(|newest| newest < time)
    }

    /// Whether nothing as late as this reading has been taken at all: it cannot be known then.
    pub(super) fn is_latest(&self, benchmark: &BenchmarkId, time: Timestamp) -> bool {
        let ahead = self.ahead.get(benchmark);
        self.is_newest(benchmark, time) && ahead.is_none_or(|ahead| *ahead < time)
    }

    /// Everything there is has been read: what comes of these benchmarks from now on is live.
    pub(super) fn rest(&mut self) {
        if self.at_rest.len() != self.newest.len() {
            self.at_rest = self.newest.keys().cloned().collect();
        }
    }

    /// Whether what comes of a benchmark now is live.
    pub(super) fn is_live(&self, benchmark: &BenchmarkId) -> bool {
        self.at_rest.contains(benchmark)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hour(hour: i64) -> Timestamp {
        Timestamp::constant(hour * 3600, 0)
    }

    #[test]
    fn a_reading_ahead_of_data_time_is_known_and_is_not_the_newest() {
        let (mut times, id) = (ReadTimes::default(), BenchmarkId::new("5"));
        times.note(&id, hour(3), hour(3));
        times.note(&id, hour(90), hour(3));
        assert_eq!(times.newest(&id), Some(hour(3)));
        assert!(times.is_newest(&id, hour(4)) && !times.is_latest(&id, hour(4)));
        assert!(times.is_latest(&id, hour(91)));
        times.first_waits(&id);
        assert_eq!((times.newest(&id), times.count()), (None, 0));
        assert_eq!(times.of_any().len(), 1);
    }

    #[test]
    fn what_has_given_a_reading_by_the_time_everything_has_been_read_is_live() {
        let mut times = ReadTimes::default();
        let (early, late) = (BenchmarkId::new("early"), BenchmarkId::new("late"));
        times.note(&early, hour(1), hour(1));
        times.rest();
        times.note(&late, hour(2), hour(2));
        assert!(times.is_live(&early) && !times.is_live(&late));
        times.rest();
        assert!(times.is_live(&late));
    }

    #[test]
    fn readings_that_end_with_the_settings_are_new_when_they_come_again() {
        let (mut times, id) = (ReadTimes::default(), BenchmarkId::new("5"));
        times.note(&id, hour(3), hour(3));
        assert_eq!(times.anew_after(Some(&id)), 0);
        times.forget_read(id.clone(), 17);
        times.retain(|_| false);
        assert_eq!(times.anew_after(Some(&id)), 17);
        assert!(times.is_latest(&id, hour(1)));
    }
}
