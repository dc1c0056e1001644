//! How sure it is that a slope accelerates: Bayes factors against steady motion under its usual fluctuations.
//!
//! At each scale of [`Scales`] the newest change of velocity is compared with what such changes were before. Under steady
//! motion it has Student's t with the degrees of freedom of that comparison; under an acceleration it is
//! [`SPREAD`] times as wide, and above 0. The ratio of the two has mean 1 under steady motion. The prior chance that an
//! acceleration began within the newest block is proportional to the block's length, so that looking often does not
//! cost: at a scale of D days one independent look is made in D days, each passes odds of c by chance with probability
//! at most (prior rate) D / c (Markov), and all of them together pass it at most (prior rate) / c times a year, however
//! often the slope is looked at in between. Summed over the scales, sixteen of a record of years read by the hour, the prior rate is at most 4.8 a year.

use super::Scales;
use super::scales::{Scale, VelocityChange};
use crate::fit::Observations;
use crate::reading::DAYS_PER_YEAR;

/// Prior rate of accelerations, a year, at one scale.
const RATE_OF_A_SCALE: f64 = 0.3;
/// How much wider changes are while a slope accelerates.
const SPREAD: f64 = 8.0;
/// One reading, ln, can add no more than this: the chance of a reading gone wrong is not smaller.
const ONE_READING: f64 = 2.5;
/// A daily wave is known by the days in which it was seen: degrees of freedom of blocks between these lengths, days, are
/// no more than the first figure plus the second one a day.
const DAILY_BLOCKS: (f64, f64) = (1.0 / 12.0, 2.0);
const DAILY_FREEDOM: (f64, f64) = (2.0, 1.5);
/// Within the first day of a record a wave that nobody has seen whole is in all shorter blocks as well: a still night, and then the
/// morning. Over about so many days, with this power, that ends.
const FIRST_DAY: (f64, i32) = (0.8, 8);
/// Blocks of so many times a span show an acceleration that ends within it.
const SHOWN: f64 = 4.0;
/// ln of a Bayes factor beyond which nothing changes.
const SURE: f64 = 600.0;

/// The probability of odds whose logarithm is `ln_odds`.
pub(super) fn probability(ln_odds: f64) -> f64 {
    1.0 / (1.0 + (-ln_odds).exp())
}

/// ln of the odds that the slope accelerates, by the scales of a record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evidence {
    /// (block, days; ln of the odds by this scale and all shorter ones), shortest first.
    up_to: Vec<(f64, f64)>,
}

impl Evidence {
    /// After all of `observations`, of which `scales` are the scales.
    pub(super) fn of(observations: &Observations, scales: &Scales) -> Self {
        let mut up_to = summed(scales);
        let before = Scales::at(observations, observations.values.len().saturating_sub(1));
        let before = before.map_or_else(Vec::new, |before| summed(&before));
        for (index, (_, ln_odds)) in up_to.iter_mut().enumerate() {
            if let Some((_, before)) = before.get(index).or(before.last()) {
                *ln_odds = ln_odds.min(before + ONE_READING);
            }
        }
        Self { up_to }
    }

    /// By all scales.
    pub(super) fn ln_odds(&self) -> f64 {
        self.up_to.last().map_or(f64::NEG_INFINITY, |(_, ln)| *ln)
    }

    /// By the scales at which an acceleration shows that ends within `days`: a line in inverse velocity that meets zero then
    /// has doubled its velocity within the same span before. What only longer blocks show is not over so soon.
    pub(super) fn ln_odds_within(&self, days: f64) -> f64 {
        let count = self
            .up_to
            .partition_point(|(block, _)| *block <= SHOWN * days);
        let last = self.up_to.get(count.saturating_sub(1));
        last.map_or(f64::NEG_INFINITY, |(_, ln)| *ln)
    }
}

/// For each scale the ln of the sum of the odds up to it.
fn summed(scales: &Scales) -> Vec<(f64, f64)> {
    let each = scales.each.iter().scan(0.0_f64, |sum, scale| {
        *sum += odds(scales, scale);
        Some((scale.days, sum.max(f64::MIN_POSITIVE).ln()))
    });
    each.collect()
}

fn odds(scales: &Scales, scale: &Scale) -> f64 {
    let most = most_freedom(scales.length_days, scale.days);
    let factor = |change: &VelocityChange| ln_bayes_factor(change, most).min(SURE).exp();
    let prior = RATE_OF_A_SCALE / DAYS_PER_YEAR * scale.days;
    prior * f64::midpoint(factor(&scale.near), factor(&scale.far))
}

/// The most degrees of freedom of blocks of so many days in a record of so many.
fn most_freedom(length_days: f64, block_days: f64) -> f64 {
    let a_day = DAILY_FREEDOM.1 * length_days;
    if block_days >= DAILY_BLOCKS.1 {
        f64::INFINITY
    } else if block_days >= DAILY_BLOCKS.0 {
        DAILY_FREEDOM.0 + a_day
    } else {
        let over = (length_days / FIRST_DAY.0).powi(FIRST_DAY.1);
        DAILY_FREEDOM.0 + a_day * (1.0 + over)
    }
}

/// ln of the density of a change that is [`SPREAD`] times as wide as usual and above 0, over that of a usual one; the
/// side is smooth, so that no reading switches it.
fn ln_bayes_factor(change: &VelocityChange, most_freedom: f64) -> f64 {
    let z = change.newest / change.usual;
    let freedom = change.freedom.min(most_freedom);
    let wide = 1.0 + SPREAD * SPREAD;
    let tails = (z * z / freedom).ln_1p() - (z * z / (freedom * wide)).ln_1p();
    // The normal distribution function within .0002 is a logistic one of this cubic.
    let above = 2.0 / (1.0 + (-1.597_6 * z - 0.070_56 * z.powi(3)).exp());
    0.5 * (freedom + 1.0) * tails - 0.5 * wide.ln() + above.max(f64::MIN_POSITIVE).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(z: f64, freedom: f64) -> f64 {
        let change = VelocityChange {
            newest: z,
            usual: 1.0,
            freedom,
            largest: 0.0,
        };
        ln_bayes_factor(&change, f64::INFINITY).exp()
    }

    /// Density of Student's t by its definition, the constant by quadrature.
    fn mean_under_steady_motion(freedom: f64) -> f64 {
        let density = |z: f64| (1.0 + z * z / freedom).powf(-0.5 * (freedom + 1.0));
        let (mut mass, mut mean) = (0.0, 0.0);
        // Equal steps of asinh z, so that the tails are there.
        let steps = 400_000;
        for index in 0..steps {
            let s = 40.0 * (f64::from(index) + 0.5) / f64::from(steps) - 20.0;
            let (z, width) = (s.sinh(), s.cosh());
            mass += density(z) * width;
            mean += density(z) * width * factor(z, freedom);
        }
        mean / mass
    }

    #[test]
    fn the_mean_bayes_factor_of_steady_motion_is_one_at_any_degrees_of_freedom() {
        for freedom in [2.0, 5.0, 30.0, 300.0] {
            let mean = mean_under_steady_motion(freedom);
            assert!((mean - 1.0).abs() < 0.02, "{freedom}: {mean}");
        }
    }

    #[test]
    fn few_degrees_of_freedom_need_more_of_a_change() {
        assert!(factor(6.0, 200.0) > 1e5);
        assert!(factor(6.0, 3.0) < 100.0);
        assert!(factor(-6.0, 200.0) < 1.0);
    }

    #[test]
    fn the_first_morning_of_a_record_is_hardly_evidence_and_after_two_days_short_blocks_are() {
        let morning = most_freedom(0.35, 0.02);
        assert!(factor(50.0, morning) < 1000.0, "{morning}");
        assert!(most_freedom(2.0, 0.02) > 1000.0);
        assert!(most_freedom(2.0, 0.5) < 6.0 && most_freedom(2.0, 4.0).is_infinite());
    }
}
