//! How the panel makes one forecast of its members': weights that depend on how sure the law is and on how each line
//! has done so far, and a recalibration of the mixture. The figures are learnt on simulated slopes alone.

use super::members::{FEATURES, MEMBERS, Members};
use crate::fit::FINEST_DAYS;

/// Standard deviation of ln of the time to failure that a line is taken to have.
pub const LINE_SPREAD: f64 = 0.25;
/// Quantiles that stand for a line's distribution: standard normal, at the middles of ten equal shares.
const NORMAL: [f64; 10] = [
    -1.644_854, -1.036_433, -0.674_490, -0.385_320, -0.125_661, 0.125_661, 0.385_320, 0.674_490,
    1.036_433, 1.644_854,
];
/// Levels of the recalibration.
pub const LEVELS: usize = 21;
/// Situations of the recalibration: ln of the median time to failure over the sampling interval, at 0, 1, 2 and 3, the
/// last for all beyond. Farther off the share of simulated slopes that fail would decide, which is nobody's slope's.
pub const SITUATIONS: usize = 4;

/// What is learnt.
#[derive(Debug, Clone, PartialEq)]
pub struct Weighing {
    /// Of each member but the law, ln of its weight over the law's, by feature.
    pub gates: [[f64; FEATURES]; MEMBERS - 1],
    /// What a member's recent miss takes from ln of its weight.
    pub harshness: f64,
    /// For each situation, how often a failure had come by the time at which the mixture gave it each probability.
    pub recalibration: [[f64; LEVELS]; SITUATIONS],
}

impl Weighing {
    /// The weights of the members; they sum to 1.
    pub fn weights(&self, members: &Members) -> [f64; MEMBERS] {
        let (features, room) = (members.features(), members.room());
        let mut weights = [0.0; MEMBERS];
        for (index, weight) in weights.iter_mut().enumerate() {
            let gate = index.checked_sub(1).map_or(0.0, |gate| {
                let terms = self.gates[gate].iter().zip(&features);
                terms.map(|(by, feature)| by * feature).sum::<f64>()
            });
            *weight = gate - self.harshness * members.misses[index] + room[index].ln();
        }
        let most = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = weights.iter().map(|weight| (weight - most).exp()).sum();
        weights.map(|weight| (weight - most).exp() / total)
    }

    /// The mixture, not recalibrated: (days from now, probability), in increasing time.
    pub fn mixture(&self, members: &Members) -> Vec<(f64, f64)> {
        let weights = self.weights(members);
        let law = members.law.iter();
        let mut times: Vec<(f64, f64)> = law
            .map(|(days, share)| (*days, share * weights[0]))
            .collect();
        for (index, days) in members.lines.iter().enumerate() {
            let Some(days) = days else { continue };
            let share = weights[1 + index] / NORMAL.len() as f64;
            times.extend(NORMAL.map(|z| (days * (LINE_SPREAD * z).exp(), share)));
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        times
    }

    /// The panel's forecast: (days from now, probability), in increasing time.
    pub fn forecast(&self, members: &Members) -> Vec<(f64, f64)> {
        let mut times = self.mixture(members);
        let total: f64 = times.iter().map(|(_, share)| share).sum();
        if total <= 0.0 {
            return Vec::new();
        }
        let levels = self.levels(situation(&times, total, members.interval_days));
        let (mut reached, mut before) = (0.0, 0.0);
        for (_, share) in &mut times {
            reached += *share;
            let level = at(&levels, reached.min(1.0));
            *share = level - before;
            before = level;
        }
        times
    }

    fn levels(&self, situation: f64) -> [f64; LEVELS] {
        let (first, share) = knot(situation, SITUATIONS);
        let (low, high) = (&self.recalibration[first], &self.recalibration[first + 1]);
        std::array::from_fn(|level| low[level] + share * (high[level] - low[level]))
    }
}

/// Where on the scale of situations a mixture lies; beyond the last it is as in the last.
pub fn situation(times: &[(f64, f64)], total: f64, interval_days: f64) -> f64 {
    let mut reached = 0.0;
    let median = times.iter().find(|(_, share)| {
        reached += share;
        reached >= 0.5 * total
    });
    let days = median.map_or(FINEST_DAYS, |(days, _)| days.max(FINEST_DAYS));
    (days / interval_days).ln().max(0.0)
}

/// The knot below `x` of `count` at 0, 1, 2, ..., and how far it is to the next.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small positive number"
)]
fn knot(x: f64, count: usize) -> (usize, f64) {
    let first = (x.max(0.0) as usize).min(count - 2);
    (first, (x - first as f64).clamp(0.0, 1.0))
}

/// The value at a share of the way along `levels`.
fn at(levels: &[f64; LEVELS], share: f64) -> f64 {
    let (first, rest) = knot(share * (LEVELS - 1) as f64, LEVELS);
    levels[first] + rest * (levels[first + 1] - levels[first])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast::members::LINES;

    fn members() -> Members {
        let mut lines = [None; LINES.len()];
        lines[2] = Some(20.0);
        Members {
            law: (1..=10).map(|day| (f64::from(day), 0.08)).collect(),
            lines,
            misses: [0.0; MEMBERS],
            interval_days: 1.0,
        }
    }

    fn indifferent() -> Weighing {
        Weighing {
            gates: [[0.0; FEATURES]; MEMBERS - 1],
            harshness: 0.0,
            recalibration: [std::array::from_fn(|level| level as f64 / (LEVELS - 1) as f64);
                SITUATIONS],
        }
    }

    #[test]
    fn an_indifferent_panel_gives_each_member_its_share_and_none_is_lost() {
        let forecast = indifferent().forecast(&members());
        let total: f64 = forecast.iter().map(|(_, share)| share).sum();
        let weights = indifferent().weights(&members());
        assert!(
            (weights[0] * 0.8 + weights[3] - total).abs() < 1e-12,
            "{total}"
        );
        // A line is heard as far as the law sees a failure possible by then.
        assert!((weights[3] / weights[0] - 0.8).abs() < 1e-12, "{weights:?}");
        assert!(forecast.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn a_line_that_missed_lately_is_heard_less() {
        let harsh = Weighing {
            harshness: 2.0,
            ..indifferent()
        };
        let mut missed = members();
        missed.misses[3] = 1.0;
        assert!(harsh.weights(&missed)[3] < 0.2 * harsh.weights(&members())[3]);
    }

    #[test]
    fn recalibration_takes_each_probability_to_how_often_it_came_true() {
        let mut rarer = indifferent();
        for levels in &mut rarer.recalibration {
            for (level, share) in levels.iter_mut().enumerate() {
                *share = (level as f64 / (LEVELS - 1) as f64).powi(2);
            }
        }
        let total = |forecast: &[(f64, f64)]| forecast.iter().map(|(_, share)| share).sum::<f64>();
        let (before, after) = (
            indifferent().forecast(&members()),
            rarer.forecast(&members()),
        );
        assert!((total(&before).powi(2) - total(&after)).abs() < 0.01);
        assert!(after[0].1 < 0.5 * before[0].1);
    }
}
