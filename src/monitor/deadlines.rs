//! When benchmarks are to be judged although no reading comes: each at one time at most.

use crate::reading::{BenchmarkId, Timestamp};
use std::collections::{BTreeMap, BTreeSet};

/// The next time of each benchmark that has one.
#[derive(Debug, Clone, Default)]
pub(super) struct Deadlines {
    of: BTreeMap<BenchmarkId, Timestamp>,
    by_time: BTreeSet<(Timestamp, BenchmarkId)>,
}

impl Deadlines {
    /// From here on `benchmark` is to be judged at `due`, and at no other time.
    pub(super) fn set(&mut self, benchmark: &BenchmarkId, due: Option<Timestamp>) {
        let before = match (self.of.get_mut(benchmark), due) {
            (Some(own), Some(due)) if *own == due => return,
            (Some(own), Some(due)) => Some(std::mem::replace(own, due)),
            (Some(_), None) => self.of.remove(benchmark),
            (None, Some(due)) => self.of.insert(benchmark.clone(), due),
            (None, None) => return,
        };
        let mut place = (before.unwrap_or_default(), benchmark.clone());
        if before.is_some() {
            self.by_time.remove(&place);
        }
        if let Some(due) = due {
            place.0 = due;
            self.by_time.insert(place);
        }
    }

    /// The benchmarks to be judged at `now`, by name.
    pub(super) fn due(&self, now: Timestamp) -> BTreeSet<BenchmarkId> {
        let due = self.by_time.iter().take_while(|(due, _)| *due <= now);
        due.map(|(_, benchmark)| benchmark.clone()).collect()
    }

    /// The next time at which one is to be judged.
    pub(super) fn next(&self) -> Option<Timestamp> {
        self.by_time.first().map(|(due, _)| *due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::ToSpan as _;

    #[test]
    fn a_benchmark_is_due_at_the_newest_time_that_was_set_and_at_no_earlier_one() {
        let hour = |hours: i64| Timestamp::UNIX_EPOCH + hours.hours();
        let [one, other] = ["p1", "p2"].map(BenchmarkId::new);
        let mut deadlines = Deadlines::default();
        deadlines.set(&one, Some(hour(5)));
        deadlines.set(&other, Some(hour(9)));
        deadlines.set(&one, Some(hour(7)));
        assert_eq!(deadlines.next(), Some(hour(7)));
        assert!(deadlines.due(hour(6)).is_empty());
        assert_eq!(deadlines.due(hour(8)), BTreeSet::from([one.clone()]));
        deadlines.set(&one, None);
        assert_eq!(deadlines.next(), Some(hour(9)));
        assert_eq!(deadlines.due(hour(9)), BTreeSet::from([other]));
    }
}
