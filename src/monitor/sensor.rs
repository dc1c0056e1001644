//! Sensors that say they have no value: each run of that is reported once, and ends with a reading.

use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The benchmarks whose sensors are at fault, and what they give instead of readings.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Sensors {
    faulty: BTreeMap<BenchmarkId, String>,
    newest: BTreeMap<BenchmarkId, Timestamp>,
}

impl Sensors {
    /// The sensor gave a reading.
    pub(super) fn reads(&mut self, benchmark: &BenchmarkId, time: Timestamp) {
        if self.is_newest(benchmark, time) {
            self.faulty.remove(benchmark);
        }
    }

    /// The sensor gave `what`; says whether a run of faults begins with it. What lies before the newest
    /// reading is over already.
    pub(super) fn fails(&mut self, benchmark: &BenchmarkId, time: Timestamp, what: &str) -> bool {
        let begins = self.is_newest(benchmark, time) && !self.faulty.contains_key(benchmark);
        if begins {
            self.faulty.insert(benchmark.clone(), what.to_owned());
        }
        begins
    }

    /// What the sensor gives instead of readings.
    pub(super) fn fault(&self, benchmark: &BenchmarkId) -> Option<&str> {
        self.faulty.get(benchmark).map(String::as_str)
    }

    fn is_newest(&mut self, benchmark: &BenchmarkId, time: Timestamp) -> bool {
        match self.newest.get_mut(benchmark) {
            Some(newest) if time < *newest => false,
            Some(newest) => {
                *newest = time;
                true
            }
            None => {
                self.newest.insert(benchmark.clone(), time);
                true
            }
        }
    }
}
