//! The distribution of the first passage of a critical velocity, with the chance that it never comes.

/// Times to first passage, days from now, each with its probability; what is missing to 1 never passes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Passage {
    /// (days from now, probability), in increasing time.
    times: Vec<(f64, f64)>,
    /// The probability of passing by each of them.
    by: Vec<f64>,
}

/// What a chance that is sure lacks, at least, so that it has odds.
const LEAST_MISSING: f64 = 1e-12;

impl Passage {
    /// From (days, probability) pairs in any order.
    pub fn from_times(mut times: Vec<(f64, f64)>) -> Self {
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self::of_sorted(times)
    }

    fn of_sorted(times: Vec<(f64, f64)>) -> Self {
        let summed = times.iter().scan(0.0, |sum, (_, share)| {
            *sum += share;
            Some(*sum)
        });
        let by = summed.collect();
        Self { times, by }
    }

    /// The same, every time `pace` times as soon.
    #[must_use]
    pub fn sooner(&self, pace: f64) -> Self {
        let times = self.times.iter().map(|(days, share)| (days / pace, *share));
        Self::from_times(times.collect())
    }

    /// This and `other`, which has that share of the weight.
    #[must_use]
    pub fn pooled(&self, other: &Self, share: f64) -> Self {
        let own = self.times.iter();
        let own = own.map(|(days, chance)| (*days, (1.0 - share) * chance));
        let others = other.times.iter();
        let others = others.map(|(days, chance)| (*days, share * chance));
        Self::from_times(own.chain(others).collect())
    }

    /// The chance within each time that is the larger of this one's and the other's.
    #[must_use]
    pub fn at_least(&self, other: &Self) -> Self {
        let mut days: Vec<f64> = self
            .times
            .iter()
            .chain(&other.times)
            .map(|one| one.0)
            .collect();
        days.sort_by(f64::total_cmp);
        days.dedup();
        let mut before = 0.0;
        let times = days.into_iter().map(|days| {
            let chance = self.chance_within(days).max(other.chance_within(days));
            let share = chance - before;
            before = chance;
            (days, share)
        });
        Self::of_sorted(times.collect())
    }

    /// The same, the odds of each chance within a time raised to `power` and e^`ln_factor` times as large.
    #[must_use]
    pub fn by_odds(&self, power: f64, ln_factor: f64) -> Self {
        let mut before = 0.0;
        let times = self.times.iter().zip(&self.by).map(|((days, _), by)| {
            let odds = by / (1.0 - by).max(LEAST_MISSING);
            let odds = odds.powf(power) * ln_factor.exp();
            // By rounding it may fall where the chance hardly grows.
            let within = (odds / (1.0 + odds)).max(before);
            let share = within - before;
            before = within;
            (*days, share)
        });
        Self::of_sorted(times.collect())
    }

    /// (days from now, probability), in increasing time; what is missing to 1 never passes.
    pub fn times(&self) -> &[(f64, f64)] {
        &self.times
    }

    /// The chance of passage within `days`.
    pub fn chance_within(&self, days: f64) -> f64 {
        let count = self.times.partition_point(|(time, _)| *time <= days);
        let within = self.by[..count].last();
        within.map_or(0.0, |by| by.min(1.0))
    }

    /// Days to the unconditional `share` quantile; `None` when it is not reached within `horizon_days`.
    pub fn quantile(&self, share: f64, horizon_days: f64) -> Option<f64> {
        let first = self.by.iter().position(|by| *by >= share)?;
        let days = self.times[first].0;
        (days <= horizon_days).then_some(days)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_passages_the_larger_chance_counts_within_each_time() {
        let soon = Passage::from_times(vec![(1.0, 0.3), (9.0, 0.1)]);
        let sure = Passage::from_times(vec![(5.0, 0.9)]);
        let both = soon.at_least(&sure);
        for (days, chance) in [(0.5, 0.0), (2.0, 0.3), (6.0, 0.9), (20.0, 0.9)] {
            assert!((both.chance_within(days) - chance).abs() < 1e-12, "{days}");
        }
        assert_eq!(both, sure.at_least(&soon));
    }

    #[test]
    fn chances_by_other_odds_keep_their_times_and_grow_within_each() {
        let passage = Passage::from_times(vec![(1.0, 0.1), (2.0, 0.1), (90.0, 0.8)]);
        let sooner = passage.by_odds(0.5, 3.0_f64.ln());
        // Odds of 1/9 and of 1/4 become 1 and 3/2.
        assert!((sooner.chance_within(1.0) - 0.5).abs() < 1e-12);
        assert!((sooner.chance_within(2.0) - 0.6).abs() < 1e-12);
        assert!((sooner.chance_within(90.0) - 1.0).abs() < 1e-5);
        let same = passage.by_odds(1.0, 0.0);
        assert!((same.chance_within(2.0) - 0.2).abs() < 1e-12);
        assert_eq!(same.times().len(), 3);
    }

    #[test]
    fn quantiles_are_unconditional_and_stop_at_the_horizon() {
        let passage = Passage::from_times(vec![(1.0, 0.2), (2.0, 0.2), (90.0, 0.2)]);
        assert_eq!(passage.quantile(0.05, 30.0), Some(1.0));
        assert_eq!(passage.quantile(0.5, 30.0), None);
        assert_eq!(passage.quantile(0.5, 100.0), Some(90.0));
        assert_eq!(passage.quantile(0.95, 100.0), None);
        assert!((passage.chance_within(2.0) - 0.4).abs() < 1e-12);
    }
}
