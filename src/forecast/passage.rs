//! The distribution of the first passage of a critical velocity, with the chance that it never comes.

use super::HORIZON_DAYS;
use crate::fit::{FINEST_DAYS, LoadPosterior};

/// How wide, in ln of the time, a forecast is to be against what the posterior says: it takes every slope to
/// wander from the law, and simulated ones, which do not, fall into 90 % intervals too often without it.
const SPREAD: f64 = 0.7;
/// And how much earlier: the median over simulated slopes then errs to neither side.
const EARLIER: f64 = 0.98;
/// And no time moves by more than this factor: laws that fail much sooner than most are a warning of their own.
const FARTHEST: f64 = 1.5;

/// Times to first passage, days from now, each with its probability; what is missing to 1 never passes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Passage {
    /// (days from now, probability), in increasing time.
    times: Vec<(f64, f64)>,
}

impl Passage {
    /// What the law under an undeclared load says of passing `critical` mm/day, as seen at `now_days`.
    pub fn of(posterior: &LoadPosterior, critical: f64, now_days: f64) -> Self {
        let later = now_days - posterior.now_days;
        let times = posterior.passages(critical, HORIZON_DAYS / SPREAD + later);
        let drawn_in = Self::from_times(times).drawn_in();
        let since = drawn_in.times.into_iter();
        Self::from_times(
            since
                .map(|(days, share)| ((days - later).max(0.0), share))
                .collect(),
        )
    }

    /// The same with ln of every time drawn towards that of the median.
    fn drawn_in(self) -> Self {
        let total: f64 = self.times.iter().map(|(_, share)| share).sum();
        let Some(median) = self.quantile(0.5 * total, f64::INFINITY) else {
            return self;
        };
        let median = median.max(FINEST_DAYS);
        let draw = |(days, share): (f64, f64)| {
            let drawn = median * (days / median).powf(SPREAD);
            (
                EARLIER * drawn.clamp(days / FARTHEST, days * FARTHEST),
                share,
            )
        };
        Self::from_times(self.times.into_iter().map(draw).collect())
    }

    /// From (days, probability) pairs in any order.
    pub fn from_times(mut times: Vec<(f64, f64)>) -> Self {
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { times }
    }

    /// The same, every time `pace` times as soon.
    #[must_use]
    pub fn sooner(&self, pace: f64) -> Self {
        let times = self.times.iter().map(|(days, share)| (days / pace, *share));
        Self::from_times(times.collect())
    }

    /// (days from now, probability), in increasing time; what is missing to 1 never passes.
    pub fn times(&self) -> &[(f64, f64)] {
        &self.times
    }

    /// The chance of passage within `days`.
    pub fn chance_within(&self, days: f64) -> f64 {
        let within = self.times.iter().take_while(|(time, _)| *time <= days);
        within.fold(0.0, |sum, (_, share)| sum + share).min(1.0)
    }

    /// Days to the unconditional `share` quantile; `None` when it is not reached within `horizon_days`.
    pub fn quantile(&self, share: f64, horizon_days: f64) -> Option<f64> {
        let mut reached = 0.0;
        for (days, weight) in &self.times {
            reached += weight;
            if reached >= share {
                return (*days <= horizon_days).then_some(*days);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_unconditional_and_stop_at_the_horizon() {
        let passage = Passage {
            times: vec![(1.0, 0.2), (2.0, 0.2), (90.0, 0.2)],
        };
        assert_eq!(passage.quantile(0.05, 30.0), Some(1.0));
        assert_eq!(passage.quantile(0.5, 30.0), None);
        assert_eq!(passage.quantile(0.5, 100.0), Some(90.0));
        assert_eq!(passage.quantile(0.95, 100.0), None);
        assert!((passage.chance_within(2.0) - 0.4).abs() < 1e-12);
    }
}
