//! The rules: which level the evidence calls for, before any memory.

use super::policy::{Level, Policy, Threshold};
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What is known of one benchmark after a reading.
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// Chances of a collapse within other spans, that declared rules ask for.
    pub chances: Vec<(SignedDuration, f64)>,
    /// Declared rules whose conditions have held for long enough, by their place in the policy.
    pub due: Vec<usize>,
}

impl Evidence {
    /// Chance of a collapse within a span that a declared rule asks for.
    pub(super) fn chance_within(&self, span: SignedDuration) -> Option<f64> {
        let own = self.chances.iter().find(|(within, _)| *within == span);
        own.map(|(_, chance)| *chance)
    }
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
    /// Each.
    pub const ALL: [Self; 5] = [
        Self::RegimeFlip,
        Self::InterceptDriftingIn,
        Self::TransitionDriftingIn,
        Self::UnexplainedResidual,
        Self::MovesBackwards,
    ];

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

    /// What has happened, in words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::RegimeFlip => "the regime turned unstable",
            Self::InterceptDriftingIn => "the inverse-velocity line's intercept comes nearer",
            Self::TransitionDriftingIn => "the transition time comes nearer",
            Self::UnexplainedResidual => "readings that the law in force does not explain",
            Self::MovesBackwards => "the slope moves upslope",
        }
    }

    /// The cause of this name.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|cause| cause.name() == name)
    }
}

/// The level that the evidence calls for, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// The level.
    pub level: Level,
    /// The rule's short name.
    pub rule: Cow<'static, str>,
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
                rule: "critical-velocity".into(),
            }
        } else if reaches(evidence.chance_within_evacuation_time, self.red_chance) {
            Call {
                level: Level::Red,
                rule: "chance-within-evacuation-time".into(),
            }
        } else if reaches(evidence.chance_within_outlook, self.orange_chance) {
            Call {
                level: Level::Orange,
                rule: "chance-within-outlook".into(),
            }
        } else if reaches(evidence.chance_within_outlook, self.yellow_chance) {
            Call {
                level: Level::Yellow,
                rule: "chance-within-outlook".into(),
            }
        } else if let Some(cause) = evidence.causes.first() {
            Call {
                level: Level::Yellow,
                rule: cause.name().into(),
            }
        } else {
            Call {
                level: Level::Green,
                rule: "quiet".into(),
            }
        };
        for threshold in &self.thresholds {
            if let Some(rule) = threshold.exceeded(evidence)
                && threshold.level > call.level
            {
                call = Call {
                    level: threshold.level,
                    rule: rule.into(),
                };
            }
        }
        for rule in evidence.due.iter().filter_map(|at| self.rules.get(*at)) {
            if rule.level > call.level {
                call = Call {
                    level: rule.level,
                    rule: rule.id().into(),
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
