//! The distribution of the first passage of a critical velocity, with the chance that it never comes.

use crate::fit::Ensemble;

/// Times to first passage, days from now, each with its probability; what is missing to 1 never passes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Passage {
    /// (days from now, probability), in increasing time.
    times: Vec<(f64, f64)>,
}

impl Passage {
    /// What an ensemble says of passing `critical` mm/day, as seen `later_days` after its last reading.
    pub fn of(ensemble: &Ensemble, critical: f64, later_days: f64) -> Self {
        let passes = ensemble.samples.iter().filter_map(|sample| {
            let days = sample.law.days_to_velocity(critical)?;
            Some(((days - later_days).max(0.0), sample.weight))
        });
        Self::from_times(passes.collect())
    }

    /// From (days, probability) pairs in any order.
    pub fn from_times(mut times: Vec<(f64, f64)>) -> Self {
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { times }
    }

    /// The mixture of several distributions; weights need not sum to 1.
    pub fn mixture(parts: &[(Self, f64)]) -> Self {
        let total: f64 = parts.iter().map(|(_, weight)| weight).sum();
        if total <= 0.0 {
            return Self::default();
        }
        let scaled = parts.iter().flat_map(|(part, weight)| {
            part.times
                .iter()
                .map(move |(days, share)| (*days, share * weight / total))
        });
        Self::from_times(scaled.collect())
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
