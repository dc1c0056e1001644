//! The level in force: it rises with the evidence, and falls on observed motion alone.
//!
//! A forecast that changes its mind does not lower a level. What does: the slope has slowed to half the
//! highest velocity seen at this level and the evidence has called for less ever since a whole
//! evacuation time; or it has held a velocity under the critical one, without gaining, for the stated time.

use super::policy::{Level, Policy};
use super::rules::{Call, Evidence};
use crate::reading::Timestamp;

/// A change of the level in force.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// The level that was entered or left.
    pub level: Level,
    /// Entered (true) or left.
    pub entered: Entered,
    /// When the level was entered: with the benchmark and the level, the alert's identity.
    pub since: Timestamp,
    /// The rule behind it.
    pub rule: &'static str,
}

/// Whether a transition enters its level or leaves it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entered {
    /// The level begins.
    Yes,
    /// The level ends.
    No,
}

/// The level in force for one benchmark.
#[derive(Debug, Clone)]
pub struct Latch {
    level: Level,
    since: Option<Timestamp>,
    peak_velocity: f64,
    /// Since when the evidence has called for less.
    below_since: Option<Timestamp>,
    /// Since when, and from which velocity on, the slope has been steady.
    steady: Option<Steady>,
}

/// A stretch of steady motion.
#[derive(Debug, Clone, Copy)]
struct Steady {
    since: Timestamp,
    velocity: f64,
    readings: usize,
}

/// Readings that make a stretch, however far apart.
const FEWEST_STEADY: usize = 4;
/// A steady slope does not gain more than this factor.
const STEADY_GAIN: f64 = 1.2;
/// Observed deceleration: this share of the highest velocity at the level.
const SLOWED_TO: f64 = 0.5;

impl Default for Latch {
    fn default() -> Self {
        Self {
            level: Level::Green,
            since: None,
            peak_velocity: 0.0,
            below_since: None,
            steady: None,
        }
    }
}

impl Latch {
    /// The level in force.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Takes the evidence of one reading and says how the level changes.
    pub fn update(&mut self, policy: &Policy, evidence: &Evidence) -> Vec<Transition> {
        let call = policy.call(evidence);
        self.observe(policy, evidence, &call);
        if call.level > self.level {
            return self.enter(evidence.now, &call);
        }
        match self.reason_to_fall(policy, evidence, &call) {
            Some(rule) => self.fall(evidence.now, &call, rule),
            None => Vec::new(),
        }
    }

    fn observe(&mut self, policy: &Policy, evidence: &Evidence, call: &Call) {
        if call.level >= self.level {
            self.below_since = None;
        } else if self.below_since.is_none() {
            self.below_since = Some(evidence.now);
        }
        let Some(velocity) = evidence.velocity_mm_per_day else {
            return;
        };
        self.peak_velocity = self.peak_velocity.max(velocity);
        if velocity >= policy.critical_velocity_mm_per_day || call.level >= self.level {
            self.steady = None;
            return;
        }
        let begin = Steady {
            since: evidence.now,
            velocity,
            readings: 0,
        };
        let holds = |steady: &Steady| velocity <= STEADY_GAIN * steady.velocity.max(0.0);
        let stretch = self.steady.filter(holds).unwrap_or(begin);
        self.steady = Some(Steady {
            readings: stretch.readings + 1,
            ..stretch
        });
    }

    fn reason_to_fall(
        &self,
        policy: &Policy,
        evidence: &Evidence,
        call: &Call,
    ) -> Option<&'static str> {
        if call.level >= self.level {
            return None;
        }
        let velocity = evidence.velocity_mm_per_day?;
        let for_long = |since: Timestamp, span| evidence.now.duration_since(since) >= span;
        let below = self
            .below_since
            .is_some_and(|since| for_long(since, policy.evacuation_time));
        if below && velocity <= SLOWED_TO * self.peak_velocity {
            return Some("decelerated");
        }
        let steady = self.steady.is_some_and(|stretch| {
            stretch.readings >= FEWEST_STEADY && for_long(stretch.since, policy.steady_for)
        });
        steady.then_some("steady")
    }

    fn enter(&mut self, now: Timestamp, call: &Call) -> Vec<Transition> {
        *self = Self {
            level: call.level,
            since: Some(now),
            peak_velocity: self.peak_velocity,
            ..Self::default()
        };
        vec![Transition {
            level: call.level,
            entered: Entered::Yes,
            since: now,
            rule: call.rule,
        }]
    }

    fn fall(&mut self, now: Timestamp, call: &Call, rule: &'static str) -> Vec<Transition> {
        let since = self.since.unwrap_or(now);
        let left = Transition {
            level: self.level,
            entered: Entered::No,
            since,
            rule,
        };
        *self = Self {
            level: call.level,
            since: Some(now),
            ..Self::default()
        };
        if call.level == Level::Green {
            return vec![left];
        }
        vec![
            left,
            Transition {
                level: call.level,
                entered: Entered::Yes,
                since: now,
                rule: call.rule,
            },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Threshold;
    use super::*;
    use jiff::ToSpan;

    fn evidence(hours: i64, chance: f64, velocity: f64) -> Evidence {
        let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
        Evidence {
            now: start + hours.hours(),
            chance_within_evacuation_time: Some(chance),
            chance_within_outlook: Some(chance),
            velocity_mm_per_day: Some(velocity),
            displacement_mm: None,
            acceleration_mm_per_day2: None,
            causes: Vec::new(),
        }
    }

    fn red_at_hundred() -> (Policy, Latch) {
        let (policy, mut latch) = (Policy::default(), Latch::default());
        assert_eq!(
            latch.update(&policy, &evidence(0, 0.2, 100.0))[0].level,
            Level::Red
        );
        (policy, latch)
    }

    #[test]
    fn a_forecast_that_changes_its_mind_does_not_lower_a_level() {
        let (policy, mut latch) = red_at_hundred();
        for hour in 1..24 * 6 {
            let velocity = 100.0 + f64::from(i32::try_from(hour).unwrap());
            latch.update(&policy, &evidence(hour, 0.0, velocity));
            assert_eq!(latch.level(), Level::Red, "hour {hour}");
        }
    }

    #[test]
    fn observed_deceleration_lowers_it_after_an_evacuation_time() {
        let (policy, mut latch) = red_at_hundred();
        for hour in 1..=24 {
            assert!(
                latch.update(&policy, &evidence(hour, 0.0, 30.0)).is_empty(),
                "hour {hour}"
            );
        }
        let fall = latch.update(&policy, &evidence(25, 0.0, 30.0));
        assert_eq!((fall[0].level, fall[0].rule), (Level::Red, "decelerated"));
        assert_eq!(latch.level(), Level::Green);
    }

    #[test]
    fn a_steady_velocity_lowers_it_after_the_stated_time() {
        let (policy, mut latch) = red_at_hundred();
        for hour in 1..=7 * 24 {
            assert!(
                latch.update(&policy, &evidence(hour, 0.0, 95.0)).is_empty(),
                "hour {hour}"
            );
        }
        let fall = latch.update(&policy, &evidence(7 * 24 + 1, 0.0, 95.0));
        assert_eq!(fall[0].rule, "steady");
    }

    #[test]
    fn a_plain_threshold_is_a_floor_beside_the_model() {
        let mut policy = Policy::default();
        policy.thresholds.push(Threshold {
            level: Level::Orange,
            velocity_mm_per_day: Some(50.0),
            displacement_mm: None,
            acceleration_mm_per_day2: None,
        });
        let mut latch = Latch::default();
        let rise = latch.update(&policy, &evidence(0, 0.0, 60.0));
        assert_eq!(
            (rise[0].level, rise[0].rule),
            (Level::Orange, "velocity-threshold")
        );
        assert_eq!(
            latch.update(&policy, &evidence(1, 0.2, 60.0))[0].level,
            Level::Red
        );
    }
}
