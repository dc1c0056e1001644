//! Rules that a site declares beside the built-in ones: conditions, all or any of which hold for a time, call a level.

use super::evidence::{AlertCause, AlertEvidence};
use super::level::Level;
use crate::reading::{SECONDS_PER_DAY, figure};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// What stands before a declared rule's name in an alert.
pub(super) const PREFIX: &str = "rule:";

/// A rule of the site's own: a floor beside the model, as a threshold is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeclaredRule {
    /// Its name, once in a policy.
    pub name: String,
    /// The level that it calls.
    pub level: Level,
    /// How many of its conditions must hold.
    pub combination: Combination,
    /// At least one.
    pub conditions: Vec<Condition>,
    /// For how long they must have held at each reading.
    pub lasting: SignedDuration,
}

/// How many conditions must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Combination {
    /// Each.
    All,
    /// One is enough.
    Any,
}

/// What a declared rule asks of the evidence; each figure is reached or exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// Latest velocity, mm/day.
    Velocity(f64),
    /// Latest acceleration, mm/day per day.
    Acceleration(f64),
    /// Displacement since the first reading, mm.
    Displacement(f64),
    /// The improved tangent angle (Xu et al. 2009): that of the velocity over the one of uniform creep, which people state.
    TangentAngle {
        /// Degrees, 45 in uniform creep.
        degrees: f64,
        /// Velocity of uniform creep, mm/day.
        steady_mm_per_day: f64,
    },
    /// Chance of collapse.
    Chance {
        /// From 0 to 1.
        at_least: f64,
        /// From the newest reading; the time until the next one is added.
        within: SignedDuration,
    },
    /// The 5 % quantile of the time of collapse, as `failure_time.low` reports it, comes within this time of the newest reading.
    EarlyQuantile {
        /// From the newest reading.
        within: SignedDuration,
    },
    /// Something that calls for attention has happened.
    Happened(AlertCause),
    /// The newest search has found an effect that the law lacked; by itself that calls no level.
    EffectFound,
}

impl Condition {
    /// Whether it holds; `None` where the evidence does not show it.
    fn holds(&self, evidence: &AlertEvidence) -> Option<bool> {
        let figure = |value: Option<f64>, limit: f64| Some(value? >= limit);
        match *self {
            Self::Velocity(limit) => figure(evidence.velocity_mm_per_day, limit),
            Self::Acceleration(limit) => figure(evidence.acceleration_mm_per_day2, limit),
            Self::Displacement(limit) => figure(evidence.displacement_mm, limit),
            Self::TangentAngle {
                degrees,
                steady_mm_per_day,
            } => figure(tangent_angle(evidence, steady_mm_per_day), degrees),
            Self::Chance { at_least, within } => figure(evidence.chance_within(within), at_least),
            // Beyond the horizon is a judgement too, where there is a forecast.
            Self::EarlyQuantile { within } => {
                let is_near = |days: f64| days * SECONDS_PER_DAY <= within.as_secs_f64();
                evidence.chance_within_outlook?;
                Some(evidence.early_quantile_days.is_some_and(is_near))
            }
            Self::Happened(cause) if evidence.causes.contains(&cause) => Some(true),
            // Between two refits nothing is known of causes.
            Self::Happened(_) => evidence.chance_within_outlook.map(|_| false),
            Self::EffectFound => Some(evidence.has_effect),
        }
    }

    /// In words, with the figure of the evidence where there is one.
    fn words(&self, evidence: Option<&AlertEvidence>) -> String {
        let shown = |value: Option<f64>, unit: &str| {
            value.map_or_else(String::new, |value| {
                format!(" ({}{unit})", figure(value, 3))
            })
        };
        let of = |figure: fn(&AlertEvidence) -> Option<f64>| evidence.and_then(figure);
        match *self {
            Self::Velocity(limit) => format!(
                "velocity of {limit} mm/day or more{}",
                shown(of(|one| one.velocity_mm_per_day), " mm/day")
            ),
            Self::Acceleration(limit) => format!(
                "acceleration of {limit} mm/day per day or more{}",
                shown(of(|one| one.acceleration_mm_per_day2), " mm/day per day")
            ),
            Self::Displacement(limit) => format!(
                "displacement since the first reading of {limit} mm or more{}",
                shown(of(|one| one.displacement_mm), " mm")
            ),
            Self::TangentAngle {
                degrees,
                steady_mm_per_day,
            } => format!(
                "tangent angle of {degrees} degrees or more for uniform creep of {steady_mm_per_day} mm/day{}",
                shown(
                    evidence.and_then(|one| tangent_angle(one, steady_mm_per_day)),
                    " degrees"
                )
            ),
            Self::Chance { at_least, within } => format!(
                "chance of collapse of {at_least} or more within {within:#} and until the next reading{}",
                shown(evidence.and_then(|one| one.chance_within(within)), "")
            ),
            Self::EarlyQuantile { within } => format!(
                "5 % quantile of the time of collapse within {within:#}{}",
                shown(of(|one| one.early_quantile_days), " days")
            ),
            Self::Happened(cause) => cause.words().to_owned(),
            Self::EffectFound => "an effect that the law lacked has been found".to_owned(),
        }
    }
}

/// Degrees; 0 on a slope that moves backwards.
pub(super) fn tangent_angle(evidence: &AlertEvidence, steady_mm_per_day: f64) -> Option<f64> {
    let ratio = evidence.velocity_mm_per_day?.max(0.0) / steady_mm_per_day;
    Some(ratio.atan().to_degrees())
}

impl DeclaredRule {
    /// The rule in an alert: `rule:` and its name.
    pub fn id(&self) -> String {
        format!("{PREFIX}{}", self.name)
    }

    /// Whether its conditions hold; `None` where the evidence does not decide it.
    pub(super) fn holds(&self, evidence: &AlertEvidence) -> Option<bool> {
        let decisive = self.combination == Combination::Any;
        let mut is_open = false;
        for condition in &self.conditions {
            match condition.holds(evidence) {
                Some(holds) if holds == decisive => return Some(decisive),
                Some(_) => {}
                None => is_open = true,
            }
        }
        (!is_open).then_some(!decisive)
    }

    /// Its conditions in words, with the figures of the evidence where it is given.
    pub fn words(&self, evidence: Option<&AlertEvidence>) -> String {
        let joint = match self.combination {
            Combination::All => " and ",
            Combination::Any => " or ",
        };
        let conditions: Vec<String> =
            (self.conditions.iter().map(|one| one.words(evidence))).collect();
        let lasting = if self.lasting.is_zero() {
            String::new()
        } else {
            format!(", for {:#}", self.lasting)
        };
        conditions.join(joint) + &lasting
    }
}
