//! What others expect of a slope, which the network of [`super::collapse`] weighs: the law, and straight lines through inverse
//! velocity.

use super::free_exponent::FreeExponent;
use super::law_passages::passages;
use super::{InverseVelocityLine, Passage};
use crate::fit::{LoadPosterior, Observations, Rate, RateOptions};

/// The velocity whose passage by the law is one of them, mm/day: the same wherever a site draws its own line.
const PASSED: f64 = 1000.0;
/// Newest rates through whose inverses straight lines are drawn.
const LINES: [usize; 3] = [8, 16, 32];
/// How far the time of a collapse is the law's where the law is sure that one comes and all lines through inverse velocity
/// meet zero when it does; and the standard deviation of ln of these times by which 1 - 1/e of that is lost. Set on simulated
/// slopes of all kinds that fail: a share that did not ask for agreement put the collapse of those that keep no straight line
/// (exponential, levelled) at half of the time that remained.
const TIMED: f64 = 0.8;
const APART_LN_TIME: f64 = 0.3;
/// How far the time of a collapse is that of Voight's relation where that is kept to the letter.
const BY_VOIGHT: f64 = 0.8;
/// How much less of it counts where law and lines agree already.
const AGREED: f64 = 0.5;
/// Inputs lie between plus and minus this.
pub(super) const LARGEST_INPUT: f64 = 3.0;
/// The longest span that is asked for, days.
pub(super) const LONGEST_DAYS: f64 = 1200.0;

/// What others expect, which the network weighs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Members {
    /// Days to [`PASSED`] by the law.
    pub(super) law: Passage,
    /// Of the straight line through the inverses of the newest rates: one over the days from the newest reading to
    /// where it meets zero; below 0 where it rises.
    lines: [f64; LINES.len()],
    /// By Voight's relation with any exponent.
    free: Option<FreeExponent>,
}

impl Members {
    /// What they expect after `observations`.
    pub fn of(observations: &Observations) -> Self {
        let Some(newest) = observations.values.last() else {
            return Self::default();
        };
        let rates = observations.rates(0..observations.values.len(), RateOptions::default());
        let posterior = LoadPosterior::fit(&rates);
        Self::by(&rates, posterior.as_ref(), newest.t_days)
    }

    /// The same from the rates and the posterior of the law.
    pub(super) fn by(rates: &[Rate], posterior: Option<&LoadPosterior>, now_days: f64) -> Self {
        let law = passages(rates, posterior, PASSED, now_days);
        let line = |count: usize| {
            let newest = &rates[rates.len().saturating_sub(count)..];
            InverseVelocityLine::approach(newest, now_days).unwrap_or(0.0)
        };
        Self {
            law: Passage::from_times(law),
            lines: LINES.map(line),
            free: FreeExponent::fit(rates, now_days),
        }
    }

    /// (days, probability) of passing `critical` mm/day by the law, where that is the velocity asked of it here.
    pub(super) fn law_to(&self, critical: f64) -> Option<&[(f64, f64)]> {
        (critical.to_bits() == PASSED.to_bits()).then(|| self.law.times())
    }

    /// `network` with a part of it where Voight's relation puts that, the larger the better it is kept, and then a part where the law
    /// does, the larger the better law and lines are [agreed](Self::agreed): they are the sharper where a slope keeps
    /// them, and have no say in whether a collapse comes.
    pub(super) fn timed(&self, network: &Passage, agreed: f64) -> Passage {
        let by_voight = match &self.free {
            Some(free) => {
                let share = BY_VOIGHT * free.is_kept * (1.0 - AGREED * agreed);
                moved(network, &free.passage, share)
            }
            None => network.clone(),
        };
        moved(&by_voight, &self.law, TIMED * agreed)
    }

    /// How sure it is when a collapse comes, if one does, 0 to 1: where law and lines are [agreed](Self::agreed), or
    /// Voight's relation is kept.
    pub(super) fn is_timed(&self, agreed: f64) -> f64 {
        let kept = self.free.as_ref().map_or(0.0, |free| free.is_kept);
        agreed.max(kept)
    }

    /// How sure the law is of a collapse whose time the lines agree with, 0 to 1.
    pub(super) fn agreed(&self) -> f64 {
        let sure = self.law.chance_within(LONGEST_DAYS);
        if sure <= 0.0 {
            return 0.0;
        }
        self.agreement(sure) * sure
    }

    /// How well the law, which puts a collapse into its future with the chance `sure`, and the lines agree on its time: 1 where
    /// they do, 0 where a line meets no zero.
    fn agreement(&self, sure: f64) -> f64 {
        let median = self.law.quantile(0.5 * sure, LONGEST_DAYS);
        let Some(median) = median.filter(|days| *days > 0.0) else {
            return 0.0;
        };
        if self.lines.iter().any(|line| *line <= 0.0) {
            return 0.0;
        }
        let times = || std::iter::once(median.ln()).chain(self.lines.iter().map(|line| -line.ln()));
        let count = (1 + LINES.len()) as f64;
        let mean = times().sum::<f64>() / count;
        let square: f64 = times().map(|time| (time - mean).powi(2)).sum();
        (-square / ((count - 1.0) * APART_LN_TIME * APART_LN_TIME)).exp()
    }

    pub(super) fn expect(&self, days: f64, inputs: &mut Vec<f64>) {
        let within = [0.5 * days, days, 2.0 * days, f64::INFINITY];
        for chance in within.map(|span| self.law.chance_within(span)) {
            inputs.push(0.4 * ((chance + 0.01) / (1.01 - chance)).ln());
        }
        for line in self.lines {
            inputs.push((0.6 * (2.0 * days * line).asinh()).clamp(-LARGEST_INPUT, LARGEST_INPUT));
        }
    }
}

/// `network` with that share of its chances at the times of `to`.
fn moved(network: &Passage, to: &Passage, share: f64) -> Passage {
    let sure = to.chance_within(LONGEST_DAYS);
    if share <= 0.0 || sure <= 0.0 {
        return network.clone();
    }
    let own = network.times().iter();
    let own = own.map(|(days, chance)| (*days, (1.0 - share) * chance));
    let moved = share * network.chance_within(LONGEST_DAYS) / sure;
    let soon = to.times().iter();
    let soon = soon.take_while(|(days, _)| *days <= LONGEST_DAYS);
    let times = soon.map(|(days, chance)| (*days, moved * chance));
    Passage::from_times(own.chain(times).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::ReadingError;

    #[test]
    fn the_approach_of_a_line_is_one_over_the_days_left_and_has_no_break_at_a_level_one() {
        let rates = |gain: f64| -> Vec<Rate> {
            let days = (0..12).map(f64::from);
            let rate = days.map(|from| Rate {
                from,
                to: from + 1.0,
                velocity: 1.0 / (0.1 - gain * (from + 0.5)),
                sigma: 0.0,
                readings: 1,
                error: ReadingError::Own,
            });
            rate.collect()
        };
        let left = 1.0 / InverseVelocityLine::approach(&rates(0.005), 12.0).unwrap();
        assert!((left - 8.0).abs() < 1e-9, "{left}");
        for gain in [-1e-9, 0.0, 1e-9] {
            assert!(
                InverseVelocityLine::approach(&rates(gain), 12.0)
                    .unwrap()
                    .abs()
                    < 1e-6
            );
        }
    }
}
