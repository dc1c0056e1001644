//! The rules: which level the evidence calls for, before any memory.

use super::evidence::{AlertEvidence, RedCourse};
use super::level::Level;
use super::policy::{Policy, Threshold};
use std::borrow::Cow;

/// The rule by which the chance of a collapse calls red.
pub(super) const RED_CHANCE: &str = "chance-within-evacuation-time";

/// The rule by which a chance that is reported, and of which levels count little, calls yellow: what people read is never beside green.
pub const REPORTED_CHANCE: &str = "reported-chance";

/// The level that the evidence calls for, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// The level.
    pub level: Level,
    /// The rule's short name.
    pub rule: Cow<'static, str>,
}

impl Policy {
    /// The rule by which a chance calls orange: the one within the outlook, or that for red while red is pending.
    pub(super) fn orange_by_chance(&self, evidence: &AlertEvidence) -> Option<&'static str> {
        let outlook = evidence.chance_within_outlook;
        if outlook.is_some_and(|chance| chance >= self.orange_chance) {
            return Some("chance-within-outlook");
        }
        (evidence.red == RedCourse::IsNear).then_some(RED_CHANCE)
    }

    /// The most severe call that the evidence makes.
    pub fn call(&self, evidence: &AlertEvidence) -> Call {
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
        } else if reaches(evidence.chance_for_red, self.red_chance)
            && evidence.red == RedCourse::Agrees
        {
            Call {
                level: Level::Red,
                rule: RED_CHANCE.into(),
            }
        } else if let Some(rule) = self.orange_by_chance(evidence) {
            Call {
                level: Level::Orange,
                rule: rule.into(),
            }
        } else if reaches(evidence.chance_within_outlook, self.yellow_chance) {
            Call {
                level: Level::Yellow,
                rule: "chance-within-outlook".into(),
            }
        } else if reaches(evidence.reported_within_outlook, self.orange_chance) {
            Call {
                level: Level::Yellow,
                rule: REPORTED_CHANCE.into(),
            }
        } else if let Some(cause) = evidence.unusual {
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
    fn exceeded(&self, evidence: &AlertEvidence) -> Option<&'static str> {
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

/// Whether a rule rests on motion that was measured, and on no forecast.
pub fn is_observed(rule: &str) -> bool {
    [
        "critical-velocity",
        "velocity-threshold",
        "displacement-threshold",
        "acceleration-threshold",
    ]
    .contains(&rule)
}
