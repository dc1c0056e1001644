//! The level in force: it rises with the evidence, and falls where motion that was measured and what is called both allow it.
//!
//! A lower forecast alone does not lower a level. What does: the slope has slowed to half the
//! highest velocity seen at this level, without gaining, for a whole evacuation time in which the evidence
//! called for less, and no chance calls orange where it is red; or it has been seen to hold a velocity under the critical one, without gaining, for the
//! stated time, and is no faster than when the level was called, or than half of the highest velocity while no chance calls orange, or nothing is called any
//! more, or where it is red no more than yellow. What lies within the error of a velocity is no gain, and motion that never stood out of it has not to slow down.

use super::evidence::AlertEvidence;
use super::level::Level;
use super::policy::Policy;
use super::rules::Call;
use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A change of the level in force.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// The level that was entered or left.
    pub level: Level,
    /// Entered or left.
    pub entered: Entered,
    /// When the level was entered: with the benchmark and the level, the alert's identity.
    pub since: Timestamp,
    /// The rule behind it.
    pub rule: Cow<'static, str>,
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
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Latch {
    level: Level,
    since: Option<Timestamp>,
    /// Settled velocity at which the level was entered, and the highest since that stood out of its error, 0 where none
    /// did, mm/day.
    #[serde(default)]
    first_velocity: f64,
    peak_velocity: f64,
    /// While the evidence calls for less: the motion at half the peak velocity or under.
    slow: Option<SteadyStretch>,
    /// While the evidence calls for less: the motion under the critical velocity.
    steady: Option<SteadyStretch>,
    /// Since when each level was in force that was the newest of it: that is in its key. None in states of earlier versions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    newest: BTreeMap<Level, Timestamp>,
}

/// A stretch of motion that does not gain.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct SteadyStretch {
    since: Timestamp,
    velocity: f64,
    readings: usize,
    /// The newest reading of it, and the longest time without one. None in states of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    newest: Option<Timestamp>,
    #[serde(default, skip_serializing_if = "SignedDuration::is_zero")]
    longest_gap: SignedDuration,
}

/// Readings that make a stretch, however far apart.
const FEWEST_READINGS: usize = 4;
/// No gap between two of them is longer than the stretch over this.
const SEEN: i32 = 2;
/// Motion that does not gain stays under this factor of what it was when the stretch began.
const STEADY_GAIN: f64 = 1.2;
/// A settled velocity differs from another, or from rest, that is so many times its standard error.
const CLEAR_ERRORS: f64 = 4.0;
/// Observed deceleration: this share of the highest velocity at the level, and under that at which the level was entered. After a
/// part has failed the rest may creep on at a tenth of the highest velocity, and faster than when people were called out.
const SLOWED_TO: f64 = 0.5;

impl Default for Latch {
    fn default() -> Self {
        Self {
            level: Level::Green,
            since: None,
            first_velocity: 0.0,
            peak_velocity: 0.0,
            slow: None,
            steady: None,
            newest: BTreeMap::new(),
        }
    }
}

impl SteadyStretch {
    /// One more reading of the stretch, or a new one, or none where `holds` is not the case.
    fn go_on(
        stretch: Option<Self>,
        holds: Holds,
        now: Timestamp,
        (velocity, error): (f64, f64),
    ) -> Option<Self> {
        if holds == Holds::No {
            return None;
        }
        let begin = Self {
            since: now,
            velocity,
            readings: 0,
            newest: None,
            longest_gap: SignedDuration::ZERO,
        };
        let most = |stretch: &Self| STEADY_GAIN * stretch.velocity + CLEAR_ERRORS * error;
        let going_on = stretch.filter(|stretch| velocity <= most(stretch));
        let stretch = going_on.unwrap_or(begin);
        let gap = stretch.newest.map(|newest| now.duration_since(newest));
        Some(Self {
            readings: stretch.readings + 1,
            newest: Some(now),
            longest_gap: stretch.longest_gap.max(gap.unwrap_or_default()),
            ..stretch
        })
    }

    fn lasts(stretch: Option<Self>, now: Timestamp, span: SignedDuration) -> Holds {
        let lasts = stretch.is_some_and(|stretch| {
            let length = now.duration_since(stretch.since);
            // Nobody has seen how the slope moved in a gap.
            let is_seen = stretch.longest_gap.saturating_mul(SEEN) <= length;
            stretch.readings >= FEWEST_READINGS && length >= span && is_seen
        });
        Holds::from(lasts)
    }
}

/// Whether a condition is met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Holds {
    Yes,
    No,
}

impl From<bool> for Holds {
    fn from(met: bool) -> Self {
        if met { Self::Yes } else { Self::No }
    }
}

/// Since when a level is in force that is called at `now`, of which an earlier one was in force since `before`: it has another
/// beginning, and so another key.
pub(crate) fn another_since(before: Option<Timestamp>, now: Timestamp) -> Timestamp {
    match before {
        Some(before) if before >= now => before
            .checked_add(SignedDuration::from_secs(1))
            .unwrap_or(before),
        _ => now,
    }
}

impl Latch {
    /// The level in force.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Whether a level, or a higher one, has been called and is in force no more.
    pub fn has_ended(&self, level: Level) -> bool {
        self.level < level && self.newest.keys().any(|called| *called >= level)
    }

    /// The level above green that is in force, and since when.
    pub fn in_force(&self) -> Option<(Level, Timestamp)> {
        (self.level > Level::Green).then_some((self.level, self.since?))
    }

    /// Takes the evidence of one reading and says how the level changes.
    pub fn update(&mut self, policy: &Policy, evidence: &AlertEvidence) -> Vec<Transition> {
        let call = policy.call(evidence);
        if call.level > self.level {
            return vec![self.enter(evidence, &call)];
        }
        // How the slope moved before the level was called is no reason to end it: readings may be taken anew from the first.
        if self
            .in_force()
            .is_some_and(|(_, since)| evidence.now < since)
        {
            return Vec::new();
        }
        self.observe(policy, evidence, &call);
        match self.reason_to_fall(policy, evidence, &call) {
            Some(rule) => self.fall(evidence, &call, rule),
            None => Vec::new(),
        }
    }

    /// Ends the level in force at `now`, without evidence: people say that it is over.
    pub fn resolve(&mut self, now: Timestamp) {
        *self = Self {
            since: self.since.max(Some(now)),
            newest: std::mem::take(&mut self.newest),
            ..Self::default()
        };
    }

    /// The same level in force, its velocities forgotten: they are measured in another way from here on.
    pub(crate) fn measured_otherwise(self) -> Self {
        Self {
            first_velocity: 0.0,
            peak_velocity: 0.0,
            slow: None,
            steady: None,
            ..self
        }
    }

    /// Takes evidence without a forecast, by which the level may rise and nothing else.
    pub fn raise(&mut self, policy: &Policy, evidence: &AlertEvidence) -> Option<Transition> {
        let call = policy.call(evidence);
        (call.level > self.level).then(|| self.enter(evidence, &call))
    }

    fn observe(&mut self, policy: &Policy, evidence: &AlertEvidence, call: &Call) {
        // Backwards is motion too: a reading that fell back is no deceleration.
        let Some(velocity) = evidence.settled_velocity_mm_per_day.map(f64::abs) else {
            return;
        };
        // A slope that moves in slips rests at most readings: it has slowed down where it has in the mean as well.
        let velocity = velocity.max(evidence.moved_at_least_mm_per_day);
        let less = call.level < self.level;
        let error = evidence.settled_error_mm_per_day;
        // What is no larger than its error is no peak: readings that are spoilt would raise it, and then seem to slow down.
        if velocity > CLEAR_ERRORS * error {
            self.peak_velocity = self.peak_velocity.max(velocity);
            if self.first_velocity <= 0.0 && self.level > Level::Green {
                self.first_velocity = velocity;
            }
        }
        // Motion that never stood out of its error has not to slow down.
        let is_slow = self.has_slowed_to(velocity, error) || self.peak_velocity <= 0.0;
        // Many a slope pauses before it collapses: while a chance calls orange red is not over because it has.
        let is_likely = policy.orange_by_chance(evidence).is_some();
        let pauses = self.level == Level::Red && is_likely;
        let slowed = less && is_slow && !pauses;
        // A slope that has become faster since the level was called is not over it while more than nothing is called, in red more than yellow, until it has
        // slowed down to half of its highest velocity and no chance calls orange.
        let is_no_faster = velocity <= STEADY_GAIN * self.first_velocity + CLEAR_ERRORS * error;
        let is_past_its_peak = self.is_at_half_of_its_peak(velocity, error) && !is_likely;
        let is_over = is_no_faster
            || is_past_its_peak
            || self.first_velocity <= 0.0
            || call.level == Level::Green
            || self.level == Level::Red && call.level == Level::Yellow;
        let steady = less && is_over && !pauses && velocity < policy.critical_velocity_mm_per_day;
        let motion = (velocity, error);
        self.slow = SteadyStretch::go_on(self.slow, slowed.into(), evidence.now, motion);
        self.steady = SteadyStretch::go_on(self.steady, steady.into(), evidence.now, motion);
    }

    fn has_slowed_to(&self, velocity: f64, error: f64) -> bool {
        // States of earlier versions do not have the first velocity.
        let is_under_first =
            self.first_velocity <= 0.0 || velocity <= self.first_velocity + CLEAR_ERRORS * error;
        self.is_at_half_of_its_peak(velocity, error) && is_under_first
    }

    fn is_at_half_of_its_peak(&self, velocity: f64, error: f64) -> bool {
        // What the error is larger than has not been seen to slow down.
        velocity + error <= SLOWED_TO * self.peak_velocity
    }

    fn reason_to_fall(
        &self,
        policy: &Policy,
        evidence: &AlertEvidence,
        call: &Call,
    ) -> Option<&'static str> {
        if call.level >= self.level {
            return None;
        }
        if SteadyStretch::lasts(self.slow, evidence.now, policy.evacuation_time) == Holds::Yes {
            return Some("decelerated");
        }
        (SteadyStretch::lasts(self.steady, evidence.now, policy.steady_for) == Holds::Yes)
            .then_some("steady")
    }

    fn enter(&mut self, evidence: &AlertEvidence, call: &Call) -> Transition {
        // What has ended may be called again by what was measured before, or by a correction: as another alert.
        let ended = self.since.filter(|_| self.level == Level::Green);
        let before = self.newest.get(&call.level).copied().max(ended);
        let since = another_since(before, evidence.now);
        self.newest.insert(call.level, since);
        self.begin(evidence, call.level);
        self.since = Some(since);
        Transition {
            level: call.level,
            entered: Entered::Yes,
            since,
            rule: call.rule.clone(),
        }
    }

    fn fall(
        &mut self,
        evidence: &AlertEvidence,
        call: &Call,
        rule: &'static str,
    ) -> Vec<Transition> {
        let now = evidence.now;
        let left = Transition {
            level: self.level,
            entered: Entered::No,
            since: self.since.unwrap_or(now),
            rule: rule.into(),
        };
        if call.level == Level::Green {
            self.begin(evidence, Level::Green);
            return vec![left];
        }
        vec![left, self.enter(evidence, call)]
    }

    fn begin(&mut self, evidence: &AlertEvidence, level: Level) {
        let velocity = evidence.settled_velocity_mm_per_day.map_or(0.0, f64::abs);
        let has_stood_out = velocity > CLEAR_ERRORS * evidence.settled_error_mm_per_day;
        *self = Self {
            level,
            since: Some(evidence.now),
            first_velocity: velocity,
            peak_velocity: if has_stood_out { velocity } else { 0.0 },
            newest: std::mem::take(&mut self.newest),
            ..Self::default()
        };
    }
}

#[cfg(test)]
mod tests;
