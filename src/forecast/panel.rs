//! The panel: the law and the inverse-velocity line over several starts, weighted by how each foretold
//! the readings that came next, so that no one confident member silences the rest.
//!
//! A member need only offer an ensemble of laws in present coordinates; a filter that carries an
//! undeclared load is one more such ensemble.

use super::Passage;
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

const ROLES: [Role; 7] = [
    role(Curvature::Free, 1.0, 8),
    role(Curvature::Free, 0.5, 12),
    role(Curvature::Free, 0.25, 16),
    role(Curvature::Zero, 1.0, 8),
    role(Curvature::Zero, 0.5, 8),
    role(Curvature::Zero, 0.25, 8),
    role(Curvature::Zero, 0.125, 8),
];

/// No member's say falls below this share, however it scored.
const LEAST_SHARE: f64 = 0.04;
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
    /// Days to the critical velocity, from the newest reading.
    pub passage: Passage,
    /// Probability of each regime.
    pub regimes: BTreeMap<Regime, f64>,
    /// The velocity now, mm/day, by the panel's median.
    pub velocity_mm_per_day: f64,
    /// The most probable law over the longest window, t = 0 now.
    pub law: Law,
    /// Rates of the whole record, oldest first.
    pub rates: Vec<Rate>,
}

/// The members of one benchmark.
#[derive(Debug, Clone)]
pub struct Panel {
    members: Vec<Member>,
    scored_to_days: f64,
    pub filter: super::filter::Filter,
}

impl Default for Panel {
    fn default() -> Self {
        let members = ROLES.map(|role| Member {
            role,
            posterior: None,
            score: 0.0,
        });
        Self {
            members: members.to_vec(),
            scored_to_days: f64::NEG_INFINITY,
            filter: super::filter::Filter::new(1),
        }
    }
}

impl Panel {
    /// Scores every member on the newest reading, refits it, and says what they expect together;
    /// `None` with too few readings to go on.
    pub fn update(&mut self, observations: &Observations, critical: f64) -> Option<Outlook> {
        self.score(observations);
        self.filter.update(observations);
        let rates = observations.rates(0..observations.values.len(), RateOptions::default());
        let mut fitted = 0;
        for member in &mut self.members {
            let window = window(&rates, member.role);
            let warm = member.posterior.take();
            member.posterior = window
                .and_then(|window| Posterior::fit(window, member.role.curvature, warm.as_ref()));
            fitted += usize::from(member.posterior.is_some());
        }
        if fitted == 0 {
            return None;
        }
        Some(self.outlook(rates, critical))
    }

    fn outlook(&self, rates: Vec<Rate>, critical: f64) -> Outlook {
        let weighed = self.weights();
        let parts: Vec<(Passage, f64)> = weighed
            .iter()
            .map(|(p, weight)| (Passage::of(&p.ensemble, critical, 0.0), *weight))
            .collect();
        let velocity = weighted_median(weighed.iter().flat_map(|(p, weight)| {
            p.ensemble
                .samples
                .iter()
                .map(move |sample| (sample.law.v_i, sample.weight * weight))
        }));
        Outlook {
            passage: Passage::mixture(&parts),
            regimes: self.regimes(),
            velocity_mm_per_day: velocity,
            law: self.longest_law(),
            rates,
        }
    }

    /// The best sample of the law over the longest window that has one.
    fn longest_law(&self) -> Law {
        let posterior = self
            .members
            .iter()
            .find_map(|member| member.posterior.as_ref());
        let best = posterior.and_then(|p| {
            p.ensemble
                .samples
                .iter()
                .max_by(|a, b| a.weight.total_cmp(&b.weight))
        });
        best.map_or_else(|| Law::from_fit(1.0, 0.0, 0.0, 0.0), |sample| sample.law)
    }

    /// Members and their say: scores through a softmax, with a floor.
    fn weights(&self) -> Vec<(&Posterior, f64)> {
        let present = self
            .members
            .iter()
            .filter_map(|m| m.posterior.as_ref().map(|p| (p, m.score)));
        let present: Vec<(&Posterior, f64)> = present.collect();
        let best = present
            .iter()
            .map(|(_, score)| *score)
            .fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = present.iter().map(|(_, score)| (score - best).exp()).sum();
        let free = 1.0 - LEAST_SHARE * present.len() as f64;
        let share = |score: f64| LEAST_SHARE + free * (score - best).exp() / total;
        present
            .into_iter()
            .map(|(p, score)| (p, share(score)))
            .collect()
    }

    /// The regimes' probabilities, by the members that fit the full law.
    fn regimes(&self) -> BTreeMap<Regime, f64> {
        let mut regimes: BTreeMap<Regime, f64> =
            Regime::KNOWN.into_iter().map(|r| (r, 0.0)).collect();
        let weighed = self.weights();
        let is_law = |p: &Posterior| {
            self.members.iter().any(|m| {
                m.role.curvature == Curvature::Free
                    && m.posterior.as_ref().is_some_and(|q| std::ptr::eq(p, q))
            })
        };
        let laws: Vec<&(&Posterior, f64)> = weighed.iter().filter(|(p, _)| is_law(p)).collect();
        let total: f64 = laws.iter().map(|(_, weight)| weight).sum();
        for (posterior, weight) in laws {
            for sample in &posterior.ensemble.samples {
                *regimes.entry(sample.law.regime()).or_default() += sample.weight * weight / total;
            }
        }
        regimes
    }

    /// debug
    pub fn debug2(&mut self) -> String {
        let p = self.filter.passage(1000.0, 400.0);
        let q = |s| {
            p.quantile(s, 400.0)
                .map_or("-".into(), |d: f64| format!("{:.2}", d))
        };
        format!(
            "F v={:.2} P12h={:.3} P24h={:.3} P3d={:.3} P30={:.3} P400={:.2} q=[{} {} {}]",
            self.filter.velocity().unwrap_or(0.0),
            p.chance_within(0.5),
            p.chance_within(1.0),
            p.chance_within(3.0),
            p.chance_within(30.0),
            p.chance_within(400.0),
            q(0.05),
            q(0.5),
            q(0.95)
        )
    }
    /// debug
    pub fn debug(&self) -> String {
        self.weights()
            .iter()
            .map(|(p, w)| {
                let q = Passage::of(&p.ensemble, 1000.0, 0.0);
                format!(
                    "{w:.2}:{:.2}/{}/c{:.2}",
                    q.chance_within(4000.0),
                    q.quantile(0.5, 4000.0)
                        .map_or("-".into(), |d| format!("{d:.2}")),
                    p.ensemble.scatter
                )
            })
            .collect::<Vec<_>>()
            .join(" ")
    }

    fn score(&mut self, observations: &Observations) {
        let [.., before, newest] = observations.values.as_slice() else {
            return;
        };
        let apart = newest.t_days - self.scored_to_days;
        if apart < 0.5 * observations.averaging_days * 0.999 {
            return;
        }
        self.scored_to_days = newest.t_days;
        for member in &mut self.members {
            let Some(posterior) = &member.posterior else {
                continue;
            };
            let log_score = log_score(&posterior.ensemble, observations, (before, newest));
            member.score =
                member.score * (1.0 - 1.0 / SCORE_MEMORY) + log_score.max(WORST_LOG_SCORE);
        }
    }
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

/// ln of the predictive density of the newest reading's velocity, relative to that velocity.
fn log_score(
    ensemble: &Ensemble,
    observations: &Observations,
    pair: (&Observation, &Observation),
) -> f64 {
    let (before, newest) = pair;
    let sigma_one = newest.sigma.unwrap_or(0.0);
    let (from, observed, sigma) = match observations.quantity {
        Quantity::Velocity => (
            newest.t_days - observations.averaging_days,
            newest.value,
            sigma_one,
        ),
        Quantity::Displacement => {
            let span = newest.t_days - before.t_days;
            let noise =
                crate::fit::displacement_sigma(&observations.values) * std::f64::consts::SQRT_2;
            (
                before.t_days,
                (newest.value - before.value) / span,
                sigma_one.max(noise) / span,
            )
        }
    };
    let mut density = 0.0;
    for sample in &ensemble.samples {
        let Some(predicted) = mean_velocity(
            &sample.law,
            from - ensemble.now_days,
            newest.t_days - ensemble.now_days,
        ) else {
            continue;
        };
        let spread = sigma.hypot(ensemble.scatter * predicted).max(1e-12);
        let z = (observed - predicted) / spread;
        density += sample.weight * (-3.5 * (z * z / 6.0).ln_1p()).exp() / spread;
    }
    let scale = observed.abs().max(sigma).max(1e-12);
    (density * scale).max(1e-300).ln()
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

fn weighted_median(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut values: Vec<(f64, f64)> = values.collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|(_, w)| w).sum::<f64>() / 2.0;
    let mut reached = 0.0;
    for (value, weight) in &values {
        reached += weight;
        if reached >= half {
            return *value;
        }
    }
    f64::NAN
}
