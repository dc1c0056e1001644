//! What is expected of a slope: the collapse by what slopes of many kinds did, and, by the law under an undeclared
//! load averaged over its shapes and its starts, the regime and the passage of a critical velocity.

use super::excursions::without_excursions;
use super::isolated_step::without_isolated_steps;
use super::law_passages::passages;
use super::surprise::Surprise;
use super::{Indicators, Members, Passage};
use crate::fit::{Ensemble, LoadPosterior, Observation, Observations, Rate, RateOptions};
use crate::model::{Accuracy, Law, Trajectory};
use crate::reading::Quantity;
use crate::regime::Regime;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Fewest readings before anything is forecast: below it the priors would decide, not the slope.
pub const FEWEST_READINGS: usize = 10;
/// A reading is predicted within so many standard deviations of where the law puts it.
const WITHIN: f64 = 4.0;

/// What the panel says after its newest reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlook {
    /// The newest reading, days.
    pub now_days: f64,
    /// Days to the collapse, from the newest reading: whose quantiles are reported, put sooner than is expected.
    pub collapse: Passage,
    /// The same as it is expected: whose chances are reported.
    pub expected: Passage,
    /// The same as far as the slope is sure to accelerate: what levels go by.
    pub chances: Passage,
    /// Days to the critical velocity by the law, from the newest reading, as far as the slope is sure to accelerate.
    pub passage: Passage,
    /// Probability that the slope accelerates, against steady motion under its usual fluctuations.
    pub accelerating: f64,
    /// From the newest reading to the next one, as the newest few spans have it, days.
    pub to_next_days: f64,
    /// How much less likely the newest reading was than usual, ln, where that stands out.
    pub surprise_nats: Option<f64>,
    /// Probability of each regime.
    pub regimes: BTreeMap<Regime, f64>,
    /// The most probable law; `None` with too few rates.
    pub law: Option<Law>,
    /// Rates of the whole record, oldest first.
    pub rates: Vec<Rate>,
}

/// Weight of the forecast without the effects that were found, beside that with them. Of 0 and .25, on 16 simulated slopes under rain
/// or a lake, both lose the same; measured slopes that stand lose less with .25. See docs/adoption.md.
const PLAIN_SHARE: f64 = 0.25;

/// What one benchmark is expected to do, and how well that was met.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct LawForecaster {
    expected: Option<Ensemble>,
    scored_to_days: Option<f64>,
    surprise: Surprise,
    #[serde(default)]
    seen: Option<NewestReading>,
}

/// The newest reading as of the last update.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct NewestReading {
    t_days: f64,
    /// mm or mm/day.
    value: f64,
    /// Standard deviation of its noise and the next one's: of a difference of displacements, or of a velocity.
    noise: f64,
}

impl LawForecaster {
    /// Weighs the newest reading against what was expected, refits, and says what is to be expected now of
    /// passing `critical` mm/day; `None` with too few readings to go on.
    pub fn update(&mut self, observations: &Observations, critical: f64) -> Option<Outlook> {
        self.update_by(observations, critical, outlook)
    }

    /// The same, with `outlook` in place of the function of this name, which it may have called before.
    pub(crate) fn update_by(
        &mut self,
        observations: &Observations,
        critical: f64,
        outlook: impl FnOnce(&Observations, f64) -> Option<(Outlook, Option<Ensemble>)>,
    ) -> Option<Outlook> {
        let surprise_nats = self.surprise(observations);
        let (outlook, expected) = outlook(observations, critical)?;
        self.expected = expected;
        self.seen = NewestReading::of(observations);
        Some(Outlook {
            surprise_nats,
            ..outlook
        })
    }

    /// By how many standard deviations the newest reading is faster than what was expected of it; `None` where
    /// nothing was. To be asked before [`LawForecaster::update`] takes that reading.
    pub fn excess(&self, observations: &Observations) -> Option<f64> {
        let [.., before, newest] = observations.values.as_slice() else {
            return None;
        };
        let newest = Newest::of(observations, before, newest);
        newest.excess(self.expected.as_ref()?)
    }

    /// Whether the newest reading lies where the most probable law of the last update puts it, within the noise and
    /// the law's own scatter. Without a law the slope is expected to stand still, without an update nothing is.
    pub fn predicts(&self, observations: &Observations) -> bool {
        let (Some(seen), Some(newest)) = (self.seen, observations.values.last()) else {
            return false;
        };
        let (mut velocity, mut scatter) = (0.0, 0.0);
        if let Some(ensemble) = &self.expected
            && let Some(sample) = ensemble.samples.first()
        {
            let from = match observations.quantity {
                Quantity::Displacement => seen.t_days,
                Quantity::Velocity => newest.t_days - observations.averaging_days,
            };
            let (from, to) = (from - ensemble.now_days, newest.t_days - ensemble.now_days);
            let Some(predicted) = mean_velocity(&sample.law, from, to) else {
                return false;
            };
            (velocity, scatter) = (predicted, ensemble.scatter);
        }
        let (from, motion) = match observations.quantity {
            Quantity::Displacement => (seen.value, velocity * (newest.t_days - seen.t_days)),
            Quantity::Velocity => (0.0, velocity),
        };
        let spread = seen.noise.hypot(scatter * motion);
        (newest.value - from - motion).abs() <= WITHIN * spread
    }

    fn surprise(&mut self, observations: &Observations) -> Option<f64> {
        let [.., before, newest] = observations.values.as_slice() else {
            return None;
        };
        let apart = newest.t_days - self.scored_to_days.unwrap_or(f64::NEG_INFINITY);
        if apart < 0.999 * observations.spacing_days() {
            return None;
        }
        self.scored_to_days = Some(newest.t_days);
        let expected = self.expected.as_ref()?;
        let newest = Newest::of(observations, before, newest);
        self.surprise.of(newest.log_score(expected))
    }
}

/// `observations` without what is no motion of a slope.
pub(crate) fn of_motion(observations: &Observations) -> Cow<'_, Observations> {
    without_isolated_steps(without_excursions(observations))
}

/// What `observations` give by themselves, with `critical` in mm/day, and the laws they leave open; `None` with too few
/// readings.
pub(crate) fn outlook(
    observations: &Observations,
    critical: f64,
) -> Option<(Outlook, Option<Ensemble>)> {
    if observations.spaced(FEWEST_READINGS).len() < FEWEST_READINGS {
        return None;
    }
    let observations = &*of_motion(observations);
    let now_days = observations.values.last()?.t_days;
    let rates = observations.rates(0..observations.values.len(), RateOptions::default());
    let posterior = LoadPosterior::fit(&rates);
    let indicators = Indicators::of(observations)?;
    let accelerating = indicators.accelerating();
    let members = Members::by(&rates, posterior.as_ref(), now_days);
    let collapse = indicators.collapse(&members);
    let law = members.law_to(critical).map_or_else(
        || passages(&rates, posterior.as_ref(), critical, now_days),
        <[(f64, f64)]>::to_vec,
    );
    // What is past the critical velocity already need not accelerate to it.
    let passed = law.iter().map(|(days, share)| {
        let counts = if *days > 0.0 { accelerating } else { 1.0 };
        (*days, share * counts)
    });
    let passed = passed.collect();
    let expected = posterior.as_ref().map(LoadPosterior::ensemble);
    let likeliest = expected
        .as_ref()
        .and_then(|ensemble| ensemble.samples.first());
    let outlook = Outlook {
        now_days,
        passage: Passage::from_times(passed),
        collapse: collapse.passage,
        expected: collapse.expected,
        chances: collapse.sure,
        accelerating,
        to_next_days: indicators.to_next_days(),
        surprise_nats: None,
        regimes: posterior
            .as_ref()
            .map_or_else(unknown, LoadPosterior::regimes),
        law: likeliest.map(|sample| sample.law),
        rates,
    };
    Some((outlook, expected))
}

/// What the law alone gives of passing `critical` mm/day; `None` with too few readings.
pub fn by_the_law(observations: &Observations, critical: f64) -> Option<Passage> {
    if observations.spaced(FEWEST_READINGS).len() < FEWEST_READINGS {
        return None;
    }
    let now_days = observations.values.last()?.t_days;
    let rates = observations.rates(0..observations.values.len(), RateOptions::default());
    let posterior = LoadPosterior::fit(&rates);
    let law = passages(&rates, posterior.as_ref(), critical, now_days);
    Some(Passage::from_times(law))
}

impl Outlook {
    /// This forecast, which knows a load that was found, with `plain` beside it, which knows none. What was found may be wrong, and
    /// then it is wrong with confidence: a quarter of the weight stays with the law that went without. Where the motion is not
    /// `explained` by the load, no chance is under that of the law that went without, as far as the slope accelerates by the load's clock too.
    pub(crate) fn beside(self, plain: &Self, is_explained: bool) -> Self {
        let mut regimes = BTreeMap::new();
        for (outlook, share) in [(&self, 1.0 - PLAIN_SHARE), (plain, PLAIN_SHARE)] {
            for (regime, chance) in &outlook.regimes {
                *regimes.entry(*regime).or_insert(0.0) += share * chance;
            }
        }
        let accelerating =
            (1.0 - PLAIN_SHARE) * self.accelerating + PLAIN_SHARE * plain.accelerating;
        let unaccounted = if is_explained { 0.0 } else { self.accelerating };
        let unaccounted = Passage::default().pooled(&plain.chances, unaccounted);
        let pooled =
            |own: &Passage, plain: &Passage| own.pooled(plain, PLAIN_SHARE).at_least(&unaccounted);
        Self {
            passage: self.passage.pooled(&plain.passage, PLAIN_SHARE),
            collapse: pooled(&self.collapse, &plain.collapse),
            expected: pooled(&self.expected, &plain.expected),
            chances: pooled(&self.chances, &plain.chances),
            accelerating,
            regimes,
            ..self
        }
    }

    /// The same with everything to come `pace` times as soon.
    #[must_use]
    pub(crate) fn sooner(self, pace: f64) -> Self {
        Self {
            passage: self.passage.sooner(pace),
            collapse: self.collapse.sooner(pace),
            expected: self.expected.sooner(pace),
            chances: self.chances.sooner(pace),
            to_next_days: self.to_next_days / pace,
            ..self
        }
    }
}

impl NewestReading {
    fn of(observations: &Observations) -> Option<Self> {
        let newest = observations.values.last()?;
        let stated = newest.sigma.unwrap_or(0.0);
        let noise = match observations.quantity {
            Quantity::Displacement => {
                let seen = crate::fit::displacement_sigma(&observations.values);
                stated.max(seen) * std::f64::consts::SQRT_2
            }
            Quantity::Velocity => velocity_noise(observations, newest),
        };
        Some(Self {
            t_days: newest.t_days,
            value: newest.value,
            noise,
        })
    }
}

/// The standard error of a velocity, mm/day: as stated, or as the readings scatter.
fn velocity_noise(observations: &Observations, reading: &Observation) -> f64 {
    let seen = || crate::fit::velocity_sigma(&observations.values);
    reading.sigma.unwrap_or_else(seen)
}

fn unknown() -> BTreeMap<Regime, f64> {
    Regime::KNOWN
        .into_iter()
        .map(|regime| (regime, 0.0))
        .collect()
}

/// The newest reading as the velocity that what was expected is scored on.
struct Newest {
    from_days: f64,
    to_days: f64,
    velocity: f64,
    sigma: f64,
}

impl Newest {
    fn of(observations: &Observations, before: &Observation, newest: &Observation) -> Self {
        let stated = newest.sigma.unwrap_or(0.0);
        let (from_days, velocity, sigma) = match observations.quantity {
            Quantity::Velocity => (
                newest.t_days - observations.averaging_days,
                newest.value,
                velocity_noise(observations, newest),
            ),
            Quantity::Displacement => {
                let span = newest.t_days - before.t_days;
                let noise =
                    crate::fit::displacement_sigma(&observations.values) * std::f64::consts::SQRT_2;
                (
                    before.t_days,
                    (newest.value - before.value) / span,
                    stated.max(noise) / span,
                )
            }
        };
        Self {
            from_days,
            to_days: newest.t_days,
            velocity,
            sigma,
        }
    }

    /// Standard deviations above the mean of what the laws expect; a law past its failure expects anything.
    fn excess(&self, ensemble: &Ensemble) -> Option<f64> {
        let from = self.from_days - ensemble.now_days;
        let to = self.to_days - ensemble.now_days;
        let (mut weight, mut mean, mut square) = (0.0, 0.0, 0.0);
        for sample in &ensemble.samples {
            let Some(predicted) = mean_velocity(&sample.law, from, to) else {
                continue;
            };
            weight += sample.weight;
            mean += sample.weight * predicted;
            let spread = ensemble.scatter * predicted;
            square += sample.weight * (predicted * predicted + spread * spread);
        }
        if weight <= 0.0 {
            return None;
        }
        let (mean, square) = (mean / weight, square / weight);
        let spread = (square - mean * mean).max(0.0) + self.sigma * self.sigma;
        Some((self.velocity - mean) / spread.sqrt().max(1e-12))
    }

    /// ln of the predictive density of this velocity, relative to its size.
    fn log_score(&self, ensemble: &Ensemble) -> f64 {
        let from = self.from_days - ensemble.now_days;
        let to = self.to_days - ensemble.now_days;
        let mut density = 0.0;
        for sample in &ensemble.samples {
            let Some(predicted) = mean_velocity(&sample.law, from, to) else {
                continue;
            };
            let spread = self.sigma.hypot(ensemble.scatter * predicted).max(1e-12);
            let z = (self.velocity - predicted) / spread;
            density += sample.weight * (-3.5 * (z * z / 6.0).ln_1p()).exp() / spread;
        }
        let scale = self.velocity.abs().max(self.sigma).max(1e-12);
        (density * scale).max(1e-300).ln()
    }
}

/// Mean velocity of a law between two times about its t = 0; `None` past its failure.
fn mean_velocity(law: &Law, from: f64, to: f64) -> Option<f64> {
    let displacement = |t: f64| {
        if t >= 0.0 {
            Trajectory::solve(law, t, Accuracy::Fit)
                .at(t)
                .map(|m| m.displacement)
        } else {
            let back = Trajectory::solve(&law.reversed(), -t, Accuracy::Fit);
            back.at(-t).map(|m| -m.displacement)
        }
    };
    if to > from {
        return Some((displacement(to)? - displacement(from)?) / (to - from));
    }
    let step = to.abs().max(1e-3) * 1e-4;
    Some((displacement(to)? - displacement(to - step)?) / step)
}
