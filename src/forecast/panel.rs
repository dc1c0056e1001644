//! The panel: the law and the inverse-velocity line over several starts, weighted by how each foretold
//! the readings that came next, so that no one confident member silences the rest.
//!
//! A member need only offer an ensemble of laws in present coordinates; a filter that carries an
//! undeclared load is one more such ensemble.

use super::Passage;
use super::filter::Filter;
use super::surprise::Surprise;
use crate::fit::{Curvature, Ensemble, Observation, Observations, Posterior, Rate, RateOptions};
use crate::model::{Accuracy, Law, Trajectory};
use crate::reading::Quantity;
use crate::regime::Regime;
use std::collections::BTreeMap;

/// Which part of the record a member fits, and with what.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Role {
    curvature: Curvature,
    /// Share of the rates, newest last.
    share: f64,
    /// Fewest rates that it works with.
    fewest: usize,
}

const fn role(curvature: Curvature, share: f64, fewest: usize) -> Role {
    Role {
        curvature,
        share,
        fewest,
    }
}

const ROLES: [Role; 5] = [
    role(Curvature::Free, 1.0, 8),
    role(Curvature::Free, 0.5, 16),
    role(Curvature::Zero, 1.0, 16),
    role(Curvature::Zero, 0.5, 16),
    role(Curvature::Zero, 0.25, 16),
];

/// The filter's say: the one member that knows that the load may change is never outvoted.
const FILTER_SHARE: f64 = 0.75;
/// Fewest readings before anything is forecast: below it the priors would speak, not the slope.
pub const FEWEST_READINGS: usize = 8;
/// Fewest rates before the fitted windows have a say in the forecast.
const FEWEST_RATES: usize = 24;
/// A slope at 50 m/day has failed by any account, mm/day.
const FASTEST_CRITICAL: f64 = 5e4;
/// How far the forecast looks, days.
pub const HORIZON_DAYS: f64 = 400.0;
/// No window's share among the windows falls below this, however it scored.
const LEAST_SHARE: f64 = 0.05;
/// Memory of a score: a reading this many readings ago counts 1/e.
const SCORE_MEMORY: f64 = 12.0;
/// A prediction is never worse than this in log score: one outlier does not decide.
const WORST_LOG_SCORE: f64 = -6.0;

#[derive(Debug, Clone)]
struct Member {
    role: Role,
    posterior: Option<Posterior>,
    score: f64,
}

/// What the panel says after its newest reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlook {
    /// The newest reading, days.
    pub now_days: f64,
    /// Days to the critical velocity, from the newest reading.
    pub passage: Passage,
    /// How much less likely the newest reading was than usual, ln, where that stands out.
    pub surprise_nats: Option<f64>,
    /// Probability of each regime.
    pub regimes: BTreeMap<Regime, f64>,
    /// The most probable law over the longest window, t = 0 now; `None` with too few rates.
    pub law: Option<Law>,
    /// Rates of the whole record, oldest first.
    pub rates: Vec<Rate>,
}

/// The members of one benchmark.
#[derive(Debug, Clone)]
pub struct Panel {
    members: Vec<Member>,
    scored_to_days: f64,
    filter: Filter,
    surprise: Surprise,
}

impl Panel {
    /// A panel that has seen nothing; `seed` feeds the filter's generator.
    pub fn new(seed: u64) -> Self {
        let members = ROLES.map(|role| Member {
            role,
            posterior: None,
            score: 0.0,
        });
        Self {
            members: members.to_vec(),
            scored_to_days: f64::NEG_INFINITY,
            filter: Filter::new(seed),
            surprise: Surprise::default(),
        }
    }

    /// Scores every member on the newest reading, refits it, and says what they expect together of
    /// passing `critical` mm/day; `None` with too few readings to go on.
    pub fn update(&mut self, observations: &Observations, critical: f64) -> Option<Outlook> {
        self.score(observations);
        let surprise = self
            .filter
            .update(observations)
            .and_then(|log_density| self.surprise.of(log_density));
        let rates = observations.rates(0..observations.values.len(), RateOptions::default());
        for member in &mut self.members {
            let window = window(&rates, member.role);
            let warm = member.posterior.take();
            member.posterior = window
                .and_then(|window| Posterior::fit(window, member.role.curvature, warm.as_ref()));
        }
        if observations.spaced(FEWEST_READINGS).len() < FEWEST_READINGS {
            return None;
        }
        let now_days = observations.values.last()?.t_days;
        let weighed = self.weights();
        let regimes = regimes(&weighed);
        let law = self.longest_law();
        let passage = if measurably_moves(&rates) {
            let windows = if rates.len() >= FEWEST_RATES {
                weighed
            } else {
                Vec::new()
            };
            let critical = critical.min(FASTEST_CRITICAL);
            let mut parts = passages(&windows, critical, now_days);
            let filtered = self.filter.passage(critical, HORIZON_DAYS, now_days);
            parts.push((filtered, FILTER_SHARE));
            Passage::mixture(&parts)
        } else {
            Passage::default()
        };
        Some(Outlook {
            now_days,
            passage,
            surprise_nats: surprise,
            regimes,
            law,
            rates,
        })
    }

    /// The best sample of the law over the longest window that has one.
    fn longest_law(&self) -> Option<Law> {
        let posterior = self
            .members
            .iter()
            .find_map(|member| member.posterior.as_ref())?;
        let samples = posterior.ensemble.samples.iter();
        samples
            .max_by(|a, b| a.weight.total_cmp(&b.weight))
            .map(|sample| sample.law)
    }

    /// Members and their say: scores through a softmax, with a floor.
    fn weights(&self) -> Vec<Weighed<'_>> {
        let present = self.members.iter().filter_map(|member| {
            member
                .posterior
                .as_ref()
                .map(|posterior| (member, posterior))
        });
        let present: Vec<(&Member, &Posterior)> = present.collect();
        let best = present
            .iter()
            .map(|(member, _)| member.score)
            .fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = present
            .iter()
            .map(|(member, _)| (member.score - best).exp())
            .sum();
        let free = 1.0 - LEAST_SHARE * present.len() as f64;
        let share = |score: f64| LEAST_SHARE + free * (score - best).exp() / total;
        let weigh = |(member, posterior): (&'_ Member, _)| Weighed {
            curvature: member.role.curvature,
            posterior,
            weight: share(member.score),
        };
        present.into_iter().map(weigh).collect()
    }

    fn score(&mut self, observations: &Observations) {
        let [.., before, newest] = observations.values.as_slice() else {
            return;
        };
        let apart = newest.t_days - self.scored_to_days;
        if apart <= 0.0 || apart < 0.5 * observations.averaging_days * 0.999 {
            return;
        }
        self.scored_to_days = newest.t_days;
        let newest = Newest::of(observations, before, newest);
        for member in &mut self.members {
            let Some(posterior) = &member.posterior else {
                continue;
            };
            let log_score = newest.log_score(&posterior.ensemble);
            member.score =
                member.score * (1.0 - 1.0 / SCORE_MEMORY) + log_score.max(WORST_LOG_SCORE);
        }
    }
}

/// A fitted window and its say among the windows.
struct Weighed<'a> {
    curvature: Curvature,
    posterior: &'a Posterior,
    weight: f64,
}

/// The regimes' probabilities, by the windows that fit the full law.
fn regimes(weighed: &[Weighed<'_>]) -> BTreeMap<Regime, f64> {
    let mut regimes: BTreeMap<Regime, f64> = Regime::KNOWN.into_iter().map(|r| (r, 0.0)).collect();
    let laws = || {
        weighed
            .iter()
            .filter(|one| one.curvature == Curvature::Free)
    };
    let total: f64 = laws().map(|one| one.weight).sum();
    for one in laws() {
        for sample in &one.posterior.ensemble.samples {
            *regimes.entry(sample.law.regime()).or_default() += sample.weight * one.weight / total;
        }
    }
    regimes
}

/// What each window says of passing `critical` mm/day, days from `now_days`, with its say in the whole.
fn passages(weighed: &[Weighed<'_>], critical: f64, now_days: f64) -> Vec<(Passage, f64)> {
    let one = |one: &Weighed<'_>| {
        let ensemble = &one.posterior.ensemble;
        let passage = Passage::of(ensemble, critical, now_days - ensemble.now_days);
        (passage, one.weight * (1.0 - FILTER_SHARE))
    };
    weighed.iter().map(one).collect()
}

/// The seed of a benchmark's panel, FNV-1a of its name: every benchmark draws its own numbers, the same
/// in every run.
pub fn seed_of(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// Whether any of the newest rates stands clear of its noise: where none does, a forecast would be the
/// prior's and not the slope's.
fn measurably_moves(rates: &[Rate]) -> bool {
    let newest = &rates[rates.len().saturating_sub(6)..];
    newest
        .iter()
        .any(|rate| rate.velocity > 2.0 * rate.sigma && rate.velocity > 0.0)
}

fn window(rates: &[Rate], role: Role) -> Option<&[Rate]> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count within the slice"
    )]
    let wanted = ((rates.len() as f64 * role.share).round() as usize).max(role.fewest);
    (rates.len() >= role.fewest).then(|| &rates[rates.len().saturating_sub(wanted)..])
}

/// The newest reading as the velocity that members are scored on.
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
                stated,
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
