//! Rules that a site declares beside the built-in ones: conditions, all or any of which hold for a time, call a level.

use super::policy::{Level, Policy};
use super::rules::{Cause, Evidence};
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What stands before a declared rule's name in an alert.
const PREFIX: &str = "rule:";

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
    /// Something that asks for a look has happened.
    Happened(Cause),
}

impl Condition {
    /// Whether it holds; `None` where the evidence does not show it.
    fn holds(&self, evidence: &Evidence) -> Option<bool> {
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
            Self::Happened(cause) if evidence.causes.contains(&cause) => Some(true),
            // Between two refits nothing is known of causes.
            Self::Happened(_) => evidence.chance_within_outlook.map(|_| false),
        }
    }

    /// In words, with the figure of the evidence where there is one.
    fn words(&self, evidence: Option<&Evidence>) -> String {
        let shown = |value: Option<f64>, unit: &str| {
            value.map_or_else(String::new, |value| format!(" ({value:.3}{unit})"))
        };
        let of = |figure: fn(&Evidence) -> Option<f64>| evidence.and_then(figure);
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
            Self::Happened(cause) => cause.words().to_owned(),
        }
    }
}

/// Degrees; 0 on a slope that moves backwards.
fn tangent_angle(evidence: &Evidence, steady_mm_per_day: f64) -> Option<f64> {
    let ratio = evidence.velocity_mm_per_day?.max(0.0) / steady_mm_per_day;
    Some(ratio.atan().to_degrees())
}

impl DeclaredRule {
    /// The rule in an alert: `rule:` and its name.
    pub fn id(&self) -> String {
        format!("{PREFIX}{}", self.name)
    }

    /// Whether its conditions hold; `None` where the evidence does not decide it.
    fn holds(&self, evidence: &Evidence) -> Option<bool> {
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
    pub fn words(&self, evidence: Option<&Evidence>) -> String {
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

impl Policy {
    /// The declared rule that an alert names.
    pub fn declared_rule(&self, id: &str) -> Option<&DeclaredRule> {
        let name = id.strip_prefix(PREFIX)?;
        self.rules.iter().find(|rule| rule.name == name)
    }

    /// The spans within which declared rules ask for the chance of collapse.
    pub fn spans(&self) -> impl Iterator<Item = SignedDuration> + '_ {
        let conditions = self.rules.iter().flat_map(|rule| &rule.conditions);
        conditions.filter_map(|condition| match condition {
            Condition::Chance { within, .. } => Some(*within),
            Condition::Velocity(_)
            | Condition::Acceleration(_)
            | Condition::Displacement(_)
            | Condition::TangentAngle { .. }
            | Condition::Happened(_) => None,
        })
    }

    /// Whether thresholds or declared rules look at velocities or accelerations.
    pub fn needs_rates(&self) -> bool {
        let by_threshold = self.thresholds.iter().any(|threshold| {
            threshold.velocity_mm_per_day.is_some() || threshold.acceleration_mm_per_day2.is_some()
        });
        let mut conditions = self.rules.iter().flat_map(|rule| &rule.conditions);
        by_threshold
            || conditions.any(|condition| match condition {
                Condition::Velocity(_)
                | Condition::Acceleration(_)
                | Condition::TangentAngle { .. } => true,
                Condition::Displacement(_) | Condition::Chance { .. } | Condition::Happened(_) => {
                    false
                }
            })
    }
}

/// Since when the conditions of each declared rule have held at every reading, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Held(BTreeMap<String, Timestamp>);

impl Held {
    /// Whether nothing holds.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Takes the evidence of one reading and notes in it which rules have held for long enough.
    pub fn update(&mut self, policy: &Policy, evidence: &mut Evidence) {
        self.0
            .retain(|name, _| policy.rules.iter().any(|rule| rule.name == *name));
        for (index, rule) in policy.rules.iter().enumerate() {
            match rule.holds(evidence) {
                Some(true) => {
                    let since = *self.0.entry(rule.name.clone()).or_insert(evidence.now);
                    if evidence.now.duration_since(since) >= rule.lasting {
                        evidence.due.push(index);
                    }
                }
                Some(false) => {
                    self.0.remove(&rule.name);
                }
                None => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::ToSpan;

    fn rule(combination: Combination, conditions: &[Condition], hours: i64) -> Policy {
        let rule = DeclaredRule {
            name: "near".to_owned(),
            level: Level::Orange,
            combination,
            conditions: conditions.to_vec(),
            lasting: SignedDuration::from_hours(hours),
        };
        Policy {
            rules: vec![rule],
            ..Policy::default()
        }
    }

    const DAY: SignedDuration = SignedDuration::from_hours(24);
    const FAST: Condition = Condition::Velocity(20.0);
    const LIKELY: Condition = Condition::Chance {
        at_least: 0.2,
        within: DAY,
    };

    fn evidence(hours: i64, velocity: f64, chance: Option<f64>) -> Evidence {
        Evidence {
            now: Timestamp::UNIX_EPOCH + hours.hours(),
            chance_within_outlook: chance,
            velocity_mm_per_day: Some(velocity),
            chances: chance.map(|chance| (DAY, chance)).into_iter().collect(),
            ..Evidence::default()
        }
    }

    fn called(policy: &Policy, held: &mut Held, mut evidence: Evidence) -> (Level, String) {
        held.update(policy, &mut evidence);
        let call = policy.call(&evidence);
        (call.level, call.rule.into_owned())
    }

    #[test]
    fn all_conditions_must_hold_or_any_is_enough_and_what_is_not_shown_decides_nothing() {
        let held = || Held::default();
        let near = || (Level::Orange, "rule:near".to_owned());
        let all = rule(Combination::All, &[FAST, LIKELY], 0);
        assert_eq!(
            called(&all, &mut held(), evidence(0, 20.0, Some(0.2))),
            near()
        );
        for one in [
            evidence(0, 19.9, Some(0.2)),
            evidence(0, 20.0, Some(0.19)),
            evidence(0, 20.0, None),
        ] {
            assert_eq!(called(&all, &mut held(), one).0, Level::Green);
        }
        let any = rule(Combination::Any, &[FAST, LIKELY], 0);
        assert_eq!(called(&any, &mut held(), evidence(0, 20.0, None)), near());
        assert_eq!(
            called(&any, &mut held(), evidence(0, 1.0, Some(0.3))),
            near()
        );
        assert_eq!(
            called(&any, &mut held(), evidence(0, 1.0, Some(0.1))).0,
            Level::Green
        );
    }

    #[test]
    fn conditions_must_have_held_at_each_reading_for_the_time_that_is_asked_for() {
        let policy = rule(Combination::All, &[FAST, LIKELY], 2);
        let mut held = Held::default();
        // The third is a reading between two refits: its chance is not known, and breaks nothing.
        let course = [
            (0, 30.0, Some(0.5), Level::Green),
            (1, 30.0, Some(0.5), Level::Green),
            (2, 30.0, None, Level::Green),
            (3, 30.0, Some(0.5), Level::Orange),
            (4, 1.0, Some(0.5), Level::Green),
            (5, 30.0, Some(0.5), Level::Green),
            (6, 30.0, Some(0.5), Level::Green),
            (7, 30.0, Some(0.5), Level::Orange),
        ];
        for (hours, velocity, chance, level) in course {
            let one = evidence(hours, velocity, chance);
            assert_eq!(called(&policy, &mut held, one).0, level, "{hours}");
        }
    }

    #[test]
    fn the_tangent_angle_is_45_degrees_in_uniform_creep_and_a_rule_is_said_with_its_figures() {
        let steep = Condition::TangentAngle {
            degrees: 80.0,
            steady_mm_per_day: 5.0,
        };
        let policy = rule(Combination::Any, &[steep], 0);
        let angle = tangent_angle(&evidence(0, 5.0, None), 5.0).unwrap();
        assert!((angle - 45.0).abs() < 1e-12);
        // tan 80 degrees is 5.67.
        let mut held = Held::default();
        assert_eq!(
            called(&policy, &mut held, evidence(0, 28.0, None)).0,
            Level::Green
        );
        assert_eq!(
            called(&policy, &mut held, evidence(0, 28.4, None)).0,
            Level::Orange
        );
        let words = policy.rules[0].words(Some(&evidence(0, 28.4, None)));
        assert_eq!(
            words,
            "tangent angle of 80 degrees or more for uniform creep of 5 mm/day (80.015 degrees)"
        );
    }
}
