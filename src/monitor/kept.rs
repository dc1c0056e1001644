//! The newest forecast of a benchmark, kept while a level is in force.

use crate::forecast::{FailureTimeLikelihood, HORIZON_DAYS, Passage};
use crate::reading::{Timestamp, days_since};
use serde::{Deserialize, Serialize};

/// Points that a forecast is kept by.
const POINTS: u32 = 64;

/// The newest forecast of one benchmark, as so many points of equal probability.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct KeptForecast {
    time: Timestamp,
    /// Days from `time`.
    days: Vec<f64>,
    /// Probability of each.
    share: f64,
}

impl KeptForecast {
    /// `passage`, made at `time`.
    pub(super) fn of(time: Timestamp, passage: &Passage) -> Self {
        let share = passage.chance_within(HORIZON_DAYS) / f64::from(POINTS);
        let at = |point: u32| passage.quantile(share * (f64::from(point) + 0.5), HORIZON_DAYS);
        Self {
            time,
            days: (0..POINTS).filter_map(at).collect(),
            share,
        }
    }

    /// What it says at `now`, without a failure since.
    pub(super) fn likelihood(&self, now: Timestamp) -> FailureTimeLikelihood {
        let times = self.days.iter().map(|days| (*days, self.share));
        FailureTimeLikelihood::of(
            &Passage::from_times(times.collect()),
            days_since(self.time, now),
        )
    }

    /// When it was made.
    pub(super) fn time(&self) -> Timestamp {
        self.time
    }

    /// Days from `now` to its median; `None` where it gives a failure less than one half.
    pub(super) fn left_days(&self, now: Timestamp) -> Option<f64> {
        let needed = 0.5 / self.share;
        let mut counted = self.days.iter().zip(1u32..);
        let (median, _) = counted.find(|(_, count)| f64::from(*count) >= needed)?;
        Some(median - days_since(self.time, now))
    }
}
