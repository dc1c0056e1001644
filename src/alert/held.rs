//! Which rules are due that ask for some time: since when their conditions have held.

use super::declared::{Condition, DeclaredRule, PREFIX};
use super::evidence::{AlertEvidence, RedCourse};
use super::policy::Policy;
use super::rules::RED_CHANCE;
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

impl Policy {
    /// The declared rule that an alert names.
    pub fn declared_rule(&self, id: &str) -> Option<&DeclaredRule> {
        self.rule_named(id.strip_prefix(PREFIX)?)
    }

    fn rule_named(&self, name: &str) -> Option<&DeclaredRule> {
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
            | Condition::EarlyQuantile { .. }
            | Condition::Happened(_)
            | Condition::EffectFound => None,
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
                Condition::Displacement(_)
                | Condition::Chance { .. }
                | Condition::EarlyQuantile { .. }
                | Condition::Happened(_)
                | Condition::EffectFound => false,
            })
    }
}

/// Chances under the one and over the other count for their course as these: what is next to impossible for years leaves no lasting
/// mark.
const COUNTED: (f64, f64) = (0.01, 0.99);

/// Since when conditions have held at every reading, and the course of the chance that calls red.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Of each declared rule, by name.
    #[serde(default)]
    rules: BTreeMap<String, Timestamp>,
    /// The course of the chance that calls red.
    #[serde(default)]
    red: Option<Course>,
}

/// The course of a chance up to a reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Course {
    at: Timestamp,
    /// Mean ln of its odds, the newest counting most.
    ln_odds: f64,
}

impl Held {
    /// Begins with the course of the chance that calls red as `earlier` has it.
    pub fn begin_course(&mut self, earlier: &Self) {
        self.red = earlier.red;
    }

    /// The rules whose conditions hold, and have not held for long enough yet.
    pub fn pending(&self, policy: &Policy, evidence: &AlertEvidence) -> Vec<String> {
        let is_pending = |(index, rule): &(usize, &DeclaredRule)| {
            self.rules.contains_key(&rule.name) && !evidence.due.contains(index)
        };
        let rules = policy.rules.iter().enumerate().filter(is_pending);
        let is_pending = evidence.red != RedCourse::Agrees;
        let red = is_pending.then(|| RED_CHANCE.to_owned());
        red.into_iter()
            .chain(rules.map(|(_, rule)| rule.id()))
            .collect()
    }

    /// Forgets since when a rule has held that is another one now, though by the same name.
    pub fn forget_changed(&mut self, before: &Policy, now: &Policy) {
        self.rules
            .retain(|name, _| before.rule_named(name) == now.rule_named(name));
    }

    /// Takes the evidence of one reading and notes in it which rules have held for long enough.
    pub fn update(&mut self, policy: &Policy, evidence: &mut AlertEvidence) {
        self.update_red(policy, evidence);
        self.rules
            .retain(|name, _| policy.rules.iter().any(|rule| rule.name == *name));
        for (index, rule) in policy.rules.iter().enumerate() {
            match rule.holds(evidence) {
                Some(true) => {
                    let since = *self.rules.entry(rule.name.clone()).or_insert(evidence.now);
                    if evidence.now.duration_since(since) >= rule.lasting {
                        evidence.due.push(index);
                    }
                }
                Some(false) => {
                    self.rules.remove(&rule.name);
                }
                None => {}
            }
        }
    }

    /// A chance that one reading alone gives calls no red: where readings come often, each is one more chance to be wrong.
    fn update_red(&mut self, policy: &Policy, evidence: &mut AlertEvidence) {
        let Some(chance) = evidence.chance_for_red else {
            return;
        };
        let newest = ln_odds(chance);
        let mean = self.red.map_or(newest, |course| {
            let since = evidence.now.duration_since(course.at).as_secs_f64();
            let kept = (-since.max(0.0) / policy.red_course().as_secs_f64()).exp();
            newest + (course.ln_odds - newest) * kept
        });
        self.red = Some(Course {
            at: evidence.now,
            ln_odds: mean,
        });
        let agrees = chance >= policy.red_at_once() || mean >= ln_odds(policy.red_mean_chance());
        evidence.red = if chance < policy.red_chance || agrees || evidence.was_red {
            // A slope that was red of late and pauses has shown already that it can run away.
            RedCourse::Agrees
        } else if mean >= ln_odds(policy.red_near_chance()) {
            RedCourse::IsNear
        } else {
            RedCourse::Pending
        };
    }
}

fn ln_odds(chance: f64) -> f64 {
    let (least, most) = COUNTED;
    let chance = chance.clamp(least, most);
    (chance / (1.0 - chance)).ln()
}

#[cfg(test)]
mod tests {
    use super::super::declared::{Combination, tangent_angle};
    use super::super::level::Level;
    use super::*;
    use crate::alert::DeclaredRule;
    use jiff::SignedDuration;
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

    fn evidence(hours: i64, velocity: f64, chance: Option<f64>) -> AlertEvidence {
        AlertEvidence {
            now: Timestamp::UNIX_EPOCH + hours.hours(),
            chance_within_outlook: chance.map(|_| 0.0),
            velocity_mm_per_day: Some(velocity),
            chances: chance.map(|chance| (DAY, chance)).into_iter().collect(),
            ..AlertEvidence::default()
        }
    }

    fn called(policy: &Policy, held: &mut Held, mut evidence: AlertEvidence) -> (Level, String) {
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
    fn a_chance_calls_red_by_its_course_over_half_an_evacuation_time_or_where_it_is_large() {
        let policy = Policy::default();
        let mut held = Held::default();
        let mut level = |minutes: i64, chance: f64| {
            let mut one = AlertEvidence {
                now: Timestamp::UNIX_EPOCH + minutes.minutes(),
                chance_for_red: Some(chance),
                ..AlertEvidence::default()
            };
            held.update(&policy, &mut one);
            let pending = held.pending(&policy, &one);
            (policy.call(&one).level, pending.len())
        };
        // Nothing lower is known of: the first reading is believed.
        assert_eq!(level(0, 0.3), (Level::Red, 0));
        // After a quiet day it takes a while, the less the higher it is.
        assert_eq!(level(24 * 60, 0.02), (Level::Green, 0));
        for minutes in (24 * 60 + 10..40 * 60).step_by(10) {
            // Orange after some three hours: red is near.
            let meanwhile = if minutes < 27 * 60 - 10 {
                Level::Green
            } else {
                Level::Orange
            };
            assert_eq!(level(minutes, 0.3), (meanwhile, 1), "{minutes}");
        }
        assert_eq!(level(45 * 60, 0.4), (Level::Red, 0));
        assert_eq!(level(72 * 60, 0.02), (Level::Green, 0));
        assert_eq!(level(72 * 60 + 10, 0.59), (Level::Green, 1));
        assert_eq!(level(72 * 60 + 20, 0.6), (Level::Red, 0));
        // A dip does not begin it anew.
        assert_eq!(level(90 * 60, 0.5), (Level::Red, 0));
        assert_eq!(level(90 * 60 + 10, 0.1), (Level::Green, 0));
        assert_eq!(level(90 * 60 + 20, 0.3), (Level::Red, 0));
        // Readings that are further apart have no others between them.
        assert_eq!(level(114 * 60, 0.02), (Level::Green, 0));
        assert_eq!(level(138 * 60, 0.3), (Level::Red, 0));
    }

    #[test]
    fn a_chance_calls_red_at_once_where_red_was_in_force_of_late() {
        let (policy, mut held) = (Policy::default(), Held::default());
        let mut level = |minutes: i64, chance: f64, was_red: bool| {
            let mut one = AlertEvidence {
                now: Timestamp::UNIX_EPOCH + minutes.minutes(),
                chance_for_red: Some(chance),
                was_red,
                ..AlertEvidence::default()
            };
            held.update(&policy, &mut one);
            policy.call(&one).level
        };
        assert_eq!(level(0, 0.001, true), Level::Green);
        assert_eq!(level(10, 0.3, false), Level::Green);
        assert_eq!(level(20, 0.3, true), Level::Red);
    }

    #[test]
    fn what_calls_red_at_once_and_in_the_mean_goes_by_the_odds() {
        let policy = Policy::default();
        let is_near = |one: f64, other: f64| (one - other).abs() < 5e-4;
        assert!(is_near(policy.red_mean_chance(), 0.198));
        assert!(is_near(policy.red_at_once(), 0.597));
        for red_chance in [0.0, 0.01, 0.5, 0.99, 1.0] {
            let policy = Policy {
                red_chance,
                ..Policy::default()
            };
            assert!(policy.red_mean_chance() <= red_chance, "{red_chance}");
            assert!((red_chance..=1.0).contains(&policy.red_at_once()));
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
