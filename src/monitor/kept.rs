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
        let (mut days, mut reached) = (Vec::new(), 0.0);
        let mut due = (0..POINTS).map(|point| share * (f64::from(point) + 0.5));
        let mut next = due.next().filter(|_| share > 0.0);
        for (at, weight) in passage.times() {
            reached += weight;
            while next.is_some_and(|next| reached >= next && *at <= HORIZON_DAYS) {
                days.push(*at);
                next = due.next();
            }
        }
        Self { time, days, share }
    }

    /// What it says at `now`, without a failure since.
    pub(super) fn likelihood(&self, now: Timestamp) -> FailureTimeLikelihood {
        let times = self.days.iter().map(|days| (*days, self.share));
        FailureTimeLikelihood::of(
            &Passage::from_times(times.collect()),
            days_since(self.time, now),
        )
    }

    /// Chance of a failure within `days` from `now`, if none has come since the forecast.
    pub(super) fn chance_within(&self, now: Timestamp, days: f64) -> f64 {
        let since = days_since(self.time, now);
        let by = |end: f64| self.days.partition_point(|point| *point <= end) as f64 * self.share;
        let stands = 1.0 - by(since);
        if stands > 0.0 {
            ((by(since + days) - by(since)) / stands).clamp(0.0, 1.0)
        } else {
            1.0
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::after_days;

    #[test]
    fn what_has_not_come_yet_comes_the_more_likely_within_the_next_day() {
        let made: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
        let days = (1..=20).map(f64::from);
        let kept = KeptForecast::of(
            made,
            &Passage::from_times(days.map(|d| (d, 0.03)).collect()),
        );
        let at = |days: f64| kept.chance_within(after_days(made, days).unwrap(), 1.0);
        assert!((at(0.5) - 0.03).abs() < 0.01, "{}", at(0.5));
        assert!((at(18.5) - 0.03 / 0.46).abs() < 0.02, "{}", at(18.5));
        assert!(at(25.0) < 1e-12);
        let never = KeptForecast::of(made, &Passage::default());
        assert!(never.chance_within(made, 30.0) < 1e-12);
    }
}
