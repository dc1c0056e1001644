//! The report of one inversion, key for key as scripts read it: what is unbounded or missing is null.

use super::estimate::{self, Estimate, Parameters};
use super::{Inversion, InversionOptions};
use crate::fit::{ConstantLoad, Ensemble, LawDraws, OtherPrior};
use crate::forecast::{HORIZON_DAYS, Outlook, Passage};
use crate::reading::{BenchmarkId, Quantity, SECONDS_PER_DAY, Timestamp, Unit, after_days};
use crate::regime::{Regime, label};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// One inversion.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct FitReport {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// Displacement or velocity.
    pub quantity: Quantity,
    /// The readings' unit.
    pub unit: Unit,
    /// How many were used.
    pub readings: usize,
    /// The first one used.
    pub first: Option<Timestamp>,
    /// The last one used.
    pub last: Option<Timestamp>,
    /// Since when the law holds, by the posterior's median; before that the velocity follows no law.
    pub onset: Option<Timestamp>,
    /// 5 % quantile.
    pub onset_low: Option<Timestamp>,
    /// 95 % quantile.
    pub onset_high: Option<Timestamp>,
    /// Which regime, with what probability, under a load that never changed; where m is given, of the laws with about this m, and null with too
    /// few of them.
    pub regime: FittedRegime,
    /// The same where the load may change undeclared: what the monitor uses. `None` with too few readings, and where m is given.
    pub regime_under_load: Option<FittedRegime>,
    /// The law's parameters; without intervals where the laws drawn do not suffice for any, which `remarks` says.
    pub parameters: Parameters,
    /// The distinct minima of the misfit, best first.
    pub alternatives: Alternatives,
    /// Inflection of the best fit's velocity.
    pub transition_time: Option<Timestamp>,
    /// When the slope collapses.
    pub failure_time: FittedFailureTime,
    /// When the critical velocity is passed.
    pub critical_velocity_time: FittedFailureTime,
    /// What the law alone would say under this prior and under others.
    pub prior_sensitivity: Vec<UnderPrior>,
    /// The straight line through inverse velocity.
    pub inverse_velocity: FittedInverseVelocity,
    /// Root mean square residual of the best fit, in the readings' unit.
    pub rms: Option<f64>,
    /// Laws solved for the best fit.
    pub evaluations: usize,
    /// What the best fit took.
    pub seconds: f64,
    /// Why it ended.
    pub termination: String,
    /// What a person should know, a paragraph each.
    pub remarks: Vec<String>,
    /// Whether the velocity stood still over the last third of the record; for the text.
    #[serde(skip)]
    pub has_stood_still: bool,
}

/// What the constant-load law's posterior says under one prior; the panel's forecast is not in it.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct UnderPrior {
    /// The prior, in words.
    pub prior: &'static str,
    /// Every regime's probability.
    pub probabilities: BTreeMap<Regime, f64>,
    /// Chance that the critical velocity is passed within the horizon: not that of a collapse.
    pub failure_probability: f64,
    /// When the chance that the critical velocity has been passed comes to 50 %, unconditional; null where it does not within the horizon.
    pub failure_median: Option<Timestamp>,
}

/// A minimum of the misfit.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize)]
pub struct Alternative {
    /// m = B/A.
    pub m: Option<f64>,
    /// Initial state; `None` at m = 1.
    pub x_i: Option<f64>,
    /// T, days.
    pub t_unit_days: Option<f64>,
    /// D, in the readings' velocity unit (for displacements, their length per day).
    pub d: Option<f64>,
    /// Root mean square residual, in the readings' unit.
    pub rms: Option<f64>,
    /// Its regime.
    pub regime: Regime,
}

/// The minima, best first.
#[derive(Debug, Clone, Default, PartialEq, JsonSchema, Serialize)]
#[serde(transparent)]
pub struct Alternatives(pub Vec<Alternative>);

/// The regime by the posterior.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct FittedRegime {
    /// The regime, or `undetermined` under 60 %.
    pub label: Regime,
    /// Probability of kappa > 0; `None` with too few readings for a posterior.
    pub probability_unstable: Option<f64>,
    /// Probability of r > 0 at the last reading.
    pub probability_accelerating: Option<f64>,
    /// Every regime's probability.
    pub probabilities: BTreeMap<Regime, Option<f64>>,
}

/// When the slope collapses, or passes the critical velocity, by the field that it stands in; quantiles are unconditional.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize)]
pub struct FittedFailureTime {
    /// 5 % quantile.
    pub low: Option<Timestamp>,
    /// Median.
    pub median: Option<Timestamp>,
    /// 95 % quantile.
    pub high: Option<Timestamp>,
    /// Chance of it within the horizon; `None` with too few readings for a forecast.
    pub probability: Option<f64>,
    /// How far the forecast looks, days.
    pub horizon_days: f64,
    /// Chance of it within the evacuation time; for the text.
    #[serde(skip)]
    pub chance_within_evacuation_time: Option<f64>,
}

/// The straight line through 1/v, and the exponent that would straighten it.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize)]
pub struct FittedInverseVelocity {
    /// Where the line through the trailing quarter meets zero.
    pub failure_time: Option<Timestamp>,
    /// Its coefficient of determination.
    pub r_squared: Option<f64>,
    /// Exponent of dv/dt = A v^alpha over the record; `None` where it does not accelerate.
    pub alpha: Option<Estimate>,
}

impl Alternatives {
    pub(super) fn of(inversion: &Inversion, least_squares: &ConstantLoad) -> Self {
        let one = |solution: &crate::fit::Solution| {
            let best = estimate::best(inversion, Some(solution));
            Alternative {
                m: best.m,
                x_i: best.x_i,
                t_unit_days: best.t_unit_days,
                d: best.d,
                rms: Some(solution.rms).filter(|rms| rms.is_finite()),
                regime: solution.law.regime(),
            }
        };
        Self(least_squares.minima.iter().map(one).collect())
    }

    /// The lowest and the highest m among them.
    pub fn range_of_m(&self) -> Option<(f64, f64)> {
        let ms = || self.0.iter().filter_map(|one| one.m);
        let low = ms().min_by(f64::total_cmp)?;
        let high = ms().max_by(f64::total_cmp)?;
        Some((low, high))
    }
}

/// From this difference of two chances of m > 1 on, two regimes say something else.
const DISAGREE: f64 = 0.5;

impl FittedRegime {
    /// Whether the regime under a constant load and that where it may change say something else.
    pub fn differs_from(&self, under_load: Option<&Self>) -> bool {
        let unstable = under_load.and_then(|regime| regime.probability_unstable);
        let both = self.probability_unstable.zip(unstable);
        both.is_some_and(|(constant, load)| (constant - load).abs() > DISAGREE)
    }

    pub(super) fn of(posterior: Option<&LawDraws>) -> Self {
        let Some(posterior) = posterior else {
            return Self {
                label: Regime::Undetermined,
                probability_unstable: None,
                probability_accelerating: None,
                probabilities: Regime::KNOWN.into_iter().map(|r| (r, None)).collect(),
            };
        };
        let samples = &posterior.ensemble.samples;
        let share = |wanted: &dyn Fn(Regime) -> bool| {
            let met = samples.iter().filter(|one| wanted(one.law.regime()));
            met.fold(0.0, |sum, one| sum + one.weight).min(1.0)
        };
        Self::from_each(|regime| share(&|one| one == regime))
    }

    /// By the law under an undeclared load.
    pub(super) fn under_load(outlook: &Outlook) -> Self {
        Self::from_each(|regime| outlook.regimes.get(&regime).copied().unwrap_or(0.0))
    }

    fn from_each(probability: impl Fn(Regime) -> f64) -> Self {
        let known: BTreeMap<Regime, f64> = Regime::KNOWN
            .into_iter()
            .map(|regime| (regime, probability(regime)))
            .collect();
        let [unstable, stable, slowing, _] = Regime::KNOWN.map(|regime| known[&regime]);
        Self {
            label: label(&known),
            probability_unstable: Some((unstable + slowing).min(1.0)),
            probability_accelerating: Some((unstable + stable).min(1.0)),
            probabilities: known.into_iter().map(|(r, p)| (r, Some(p))).collect(),
        }
    }
}

impl UnderPrior {
    /// The stated prior first, then the others.
    pub(super) fn each(inversion: &Inversion, posterior: Option<&LawDraws>) -> Vec<Self> {
        let Some(posterior) = posterior else {
            return Vec::new();
        };
        let stated = Self::of(inversion, "as stated", &posterior.ensemble);
        let others = OtherPrior::ALL
            .into_iter()
            .map(|other| Self::of(inversion, other.label(), &posterior.under(other)));
        std::iter::once(stated).chain(others).collect()
    }

    fn of(inversion: &Inversion, prior: &'static str, ensemble: &Ensemble) -> Self {
        let mut probabilities: BTreeMap<Regime, f64> = Regime::KNOWN
            .into_iter()
            .map(|regime| (regime, 0.0))
            .collect();
        for sample in &ensemble.samples {
            *probabilities.entry(sample.law.regime()).or_default() += sample.weight;
        }
        let options = &inversion.options;
        let horizon_days = options
            .horizon_days
            .clamp(0.0, crate::forecast::HORIZON_DAYS);
        let critical = options.critical_velocity_mm_per_day;
        let passes = ensemble
            .samples
            .iter()
            .filter_map(|one| Some((one.law.days_to_velocity(critical)?, one.weight)));
        let passage = Passage::from_times(passes.collect());
        let median = passage.quantile(0.5, horizon_days);
        Self {
            prior,
            probabilities,
            failure_probability: passage.chance_within(horizon_days) + 0.0,
            failure_median: median.and_then(|days| inversion.time_at(ensemble.now_days + days)),
        }
    }

    /// The chance that kappa > 0.
    pub fn probability_unstable(&self) -> f64 {
        let of = |regime| self.probabilities.get(&regime).copied().unwrap_or(0.0);
        of(Regime::UnstableAccelerating) + of(Regime::UnstableDecelerating)
    }
}

impl FittedFailureTime {
    /// As seen at the newest reading; `None`: there is no forecast.
    pub(super) fn of(inversion: &Inversion, passage: Option<&Passage>) -> Self {
        let now = inversion.series.readings.last().map(|reading| reading.time);
        Self::from_passage(&inversion.options, now.zip(passage))
    }

    /// What a passage says as seen at a time; `None`: there is no forecast.
    pub(super) fn from_passage(
        options: &InversionOptions,
        seen: Option<(Timestamp, &Passage)>,
    ) -> Self {
        let horizon_days = options.horizon_days.clamp(0.0, HORIZON_DAYS);
        let at = |share: f64| {
            let (now, passage) = seen?;
            after_days(now, passage.quantile(share, horizon_days)?)
        };
        let chance = |days: f64| {
            // An empty sum is -0.
            seen.map(|(_, passage)| passage.chance_within(days) + 0.0)
        };
        let evacuation = options.evacuation_time.as_secs_f64();
        Self {
            low: at(0.05),
            median: at(0.5),
            high: at(0.95),
            probability: chance(horizon_days),
            horizon_days,
            chance_within_evacuation_time: chance(evacuation / SECONDS_PER_DAY),
        }
    }
}
