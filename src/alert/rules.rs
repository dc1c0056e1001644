//! The rules: which level the evidence calls for, before any memory.

use super::policy::{Level, Policy, Threshold};
use crate::reading::Timestamp;
use serde::{Deserialize, Serialize};

/// What is known of one benchmark after a reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Data time.
    pub now: Timestamp,
    /// Chance of a collapse before an evacuation that the next reading calls would end, where there is a forecast.
    pub chance_within_evacuation_time: Option<f64>,
    /// The same within the outlook.
    pub chance_within_outlook: Option<f64>,
    /// Latest observed velocity, mm/day; `None` before the second reading.
    pub velocity_mm_per_day: Option<f64>,
    /// The median of the latest few, which neither an outlier nor a reset moves: what a level falls by.
    pub settled_velocity_mm_per_day: Option<f64>,
    /// Displacement since the first reading, mm, for benchmarks that measure it.
    pub displacement_mm: Option<f64>,
    /// Latest observed acceleration, mm/day per day.
    pub acceleration_mm_per_day2: Option<f64>,
    /// What else asks for a look: a flip to instability, an intercept drifting in.
    pub causes: Vec<Cause>,
}

/// What asks for a look although no chance is large.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// The regime turned unstable.
    RegimeFlip,
    /// The inverse-velocity intercept comes nearer.
    InterceptDriftingIn,
    /// The transition time comes nearer.
    TransitionDriftingIn,
    /// Readings that the law in force does not explain.
    UnexplainedResidual,
    /// The slope moves upslope: its sign may be wrong.
    MovesBackwards,
}

impl Cause {
    /// The rule's name in an alert.
    pub fn name(self) -> &'static str {
        match self {
            Self::RegimeFlip => "regime-flip",
            Self::InterceptDriftingIn => "intercept-drifting-in",
            Self::TransitionDriftingIn => "transition-drifting-in",
            Self::UnexplainedResidual => "unexplained-residual",
            Self::MovesBackwards => "moves-backwards",
        }
    }
}

/// The level that the evidence calls for, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// The level.
    pub level: Level,
    /// The rule's short name.
    pub rule: &'static str,
}

impl Policy {
    /// The gravest call that the evidence makes.
    pub fn call(&self, evidence: &Evidence) -> Call {
        let reaches =
            |chance: Option<f64>, limit: f64| chance.is_some_and(|chance| chance >= limit);
        let is_past = evidence
            .settled_velocity_mm_per_day
            .is_some_and(|velocity| velocity >= self.critical_velocity_mm_per_day);
        let mut call = if is_past {
            Call {
                level: Level::Red,
                rule: "critical-velocity",
            }
        } else if reaches(evidence.chance_within_evacuation_time, self.red_chance) {
            Call {
                level: Level::Red,
                rule: "chance-within-evacuation-time",
            }
        } else if reaches(evidence.chance_within_outlook, self.orange_chance) {
            Call {
                level: Level::Orange,
                rule: "chance-within-outlook",
            }
        } else if reaches(evidence.chance_within_outlook, self.yellow_chance) {
            Call {
                level: Level::Yellow,
                rule: "chance-within-outlook",
            }
        } else if let Some(cause) = evidence.causes.first() {
            Call {
                level: Level::Yellow,
                rule: cause.name(),
            }
        } else {
            Call {
                level: Level::Green,
                rule: "quiet",
            }
        };
        for threshold in &self.thresholds {
            if let Some(rule) = threshold.exceeded(evidence)
                && threshold.level > call.level
            {
                call = Call {
                    level: threshold.level,
                    rule,
                };
            }
        }
        call
    }
}

impl Threshold {
    fn exceeded(&self, evidence: &Evidence) -> Option<&'static str> {
        let over = |value: Option<f64>, limit: Option<f64>| match (value, limit) {
            (Some(value), Some(limit)) => value >= limit,
            (None, _) | (_, None) => false,
        };
        let checks = [
            (
                "velocity-threshold",
                evidence.velocity_mm_per_day,
                self.velocity_mm_per_day,
            ),
            (
                "displacement-threshold",
                evidence.displacement_mm,
                self.displacement_mm,
            ),
            (
                "acceleration-threshold",
                evidence.acceleration_mm_per_day2,
                self.acceleration_mm_per_day2,
            ),
        ];
        checks
            .into_iter()
            .find(|(_, value, limit)| over(*value, *limit))
            .map(|(rule, ..)| rule)
    }
}
