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
mod tests {
    use super::super::Threshold;
    use super::*;
    use jiff::ToSpan;

    fn evidence(hours: i64, chance: f64, velocity: f64) -> AlertEvidence {
        let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
        AlertEvidence {
            now: start + hours.hours(),
            chance_for_red: Some(chance),
            chance_within_outlook: Some(chance),
            velocity_mm_per_day: Some(velocity),
            settled_velocity_mm_per_day: Some(velocity),
            ..AlertEvidence::default()
        }
    }

    fn red_at_hundred() -> (Policy, Latch) {
        let (policy, mut latch) = (Policy::default(), Latch::default());
        assert_eq!(
            latch.update(&policy, &evidence(0, 0.3, 100.0))[0].level,
            Level::Red
        );
        (policy, latch)
    }

    #[test]
    fn what_was_measured_before_a_level_was_called_does_not_end_it_and_other_units_do_not_hold_it()
    {
        let (policy, latch) = red_at_hundred();
        assert!(!latch.has_ended(Level::Red));
        // As where the readings were metres taken for millimetres, and all come again.
        let mut latch = latch.measured_otherwise();
        for hours in -200..0 {
            let events = latch.update(&policy, &evidence(hours, 0.0, 0.1));
            assert_eq!((latch.level(), events.len()), (Level::Red, 0), "{hours} h");
        }
        let ended = (0..200).find(|hours| {
            let events = latch.update(&policy, &evidence(*hours, 0.0, 0.1));
            !events.is_empty()
        });
        // No sooner than motion without a gain ends a level, and no later.
        let steady = policy.steady_for.as_hours();
        assert_eq!((ended, latch.level()), (Some(steady), Level::Green));
        assert!(latch.has_ended(Level::Red) && latch.has_ended(Level::Orange));
    }

    #[test]
    fn a_level_that_is_called_again_at_the_time_of_an_ended_one_is_another_alert_whatever_stood_between()
     {
        let (_, mut latch) = red_at_hundred();
        let red = latch.in_force().unwrap().1;
        latch.resolve(evidence(0, 0.0, 0.0).now);
        let call = |level| Call {
            level,
            rule: "displacement".into(),
        };
        let mut seen = vec![red];
        for level in [Level::Orange, Level::Red, Level::Red] {
            let entered = latch.enter(&evidence(0, 0.0, 50.0), &call(level));
            if level == Level::Red {
                assert!(!seen.contains(&entered.since), "{seen:?} {entered:?}");
                seen.push(entered.since);
                let kept: Latch =
                    serde_json::from_value(serde_json::to_value(&latch).unwrap()).unwrap();
                latch = kept;
                latch.resolve(evidence(0, 0.0, 0.0).now);
                latch.enter(&evidence(0, 0.0, 50.0), &call(Level::Orange));
            }
        }
        // A later one begins when it does.
        let later = latch.enter(&evidence(1, 0.0, 50.0), &call(Level::Red));
        assert_eq!(later.since, evidence(1, 0.0, 0.0).now);
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
        assert_eq!((fall[0].level, &*fall[0].rule), (Level::Red, "decelerated"));
        assert_eq!(latch.level(), Level::Green);
    }

    #[test]
    fn a_pause_does_not_end_red_while_the_chance_within_the_outlook_calls_orange() {
        let (policy, mut latch) = red_at_hundred();
        let pausing = |hour: i64, outlook: f64| AlertEvidence {
            chance_within_outlook: Some(outlook),
            ..evidence(hour, 0.1, 20.0)
        };
        for hour in 1..=5 * 24 {
            latch.update(&policy, &pausing(hour, 0.8));
            assert_eq!(latch.level(), Level::Red, "hour {hour}");
        }
        for hour in 5 * 24 + 1..=6 * 24 + 2 {
            latch.update(&policy, &pausing(hour, 0.4));
        }
        assert_eq!(latch.level(), Level::Yellow);
    }

    #[test]
    fn one_slow_reading_or_a_backward_one_lowers_nothing() {
        let (policy, mut latch) = red_at_hundred();
        for hour in 1..24 * 6 {
            let velocity = if hour % 30 == 0 {
                -60.0
            } else {
                100.0 + 2.0 * f64::from(i32::try_from(hour).unwrap())
            };
            latch.update(&policy, &evidence(hour, 0.0, velocity));
            assert_eq!(latch.level(), Level::Red, "hour {hour}");
        }
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
    fn a_slope_that_is_twice_as_fast_as_at_the_call_is_over_it_only_where_nothing_is_called_or_in_red_no_more_than_yellow()
     {
        let (policy, latch) = red_at_hundred();
        let after = |first: Level, chance: f64| {
            let mut latch = latch.clone();
            latch.level = first;
            for hour in 1..20 * 24 {
                let creeps = 200.0 + 0.1 * f64::from(u8::try_from(hour / 24).unwrap());
                let outlook = AlertEvidence {
                    chance_within_outlook: Some(chance),
                    ..evidence(hour, 0.0, creeps)
                };
                latch.update(&policy, &outlook);
            }
            latch.level()
        };
        assert_eq!(after(Level::Red, 0.75), Level::Red);
        assert_eq!(after(Level::Red, 0.5), Level::Yellow);
        assert_eq!(after(Level::Orange, 0.5), Level::Orange);
        assert_eq!(after(Level::Orange, 0.0), Level::Green);
        assert_eq!(after(Level::Red, 0.0), Level::Green);
    }

    #[test]
    fn a_surge_that_slows_down_is_over_once_it_has_been_at_half_of_its_peak_for_the_stated_time() {
        let (policy, latch) = red_at_hundred();
        let days = |first: Level, chance: f64, slow: f64| {
            let mut latch = latch.clone();
            latch.level = first;
            let level = |hour: i64| {
                let velocity = if hour < 5 * 24 { 400.0 } else { slow };
                let outlook = AlertEvidence {
                    chance_within_outlook: Some(chance),
                    ..evidence(hour, 0.0, velocity)
                };
                latch.update(&policy, &outlook);
                latch.level()
            };
            let levels = (1..20 * 24).map(level);
            levels.filter(|level| *level == first).count() / 24
        };
        assert_eq!(days(Level::Orange, 0.5, 150.0), 11);
        // It is no slower than half, or the outlook calls orange.
        assert_eq!(days(Level::Orange, 0.5, 250.0), 19);
        assert_eq!(days(Level::Orange, 0.75, 150.0), 19);
        // Red is over sooner: it has not gained for the stated time, and no more than yellow is called.
        assert_eq!(days(Level::Red, 0.5, 250.0), 7);
        assert_eq!(days(Level::Red, 0.75, 150.0), 19);
    }

    #[test]
    fn a_gap_in_the_readings_is_no_steady_motion() {
        let (policy, mut latch) = red_at_hundred();
        for hour in (1..=24).chain(12 * 24..15 * 24) {
            latch.update(&policy, &evidence(hour, 0.0, 95.0));
            assert_eq!(latch.level(), Level::Red, "hour {hour}");
        }
        for hour in 15 * 24..24 * 24 {
            latch.update(&policy, &evidence(hour, 0.0, 95.0));
        }
        assert_eq!(latch.level(), Level::Green);
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
            (rise[0].level, &*rise[0].rule),
            (Level::Orange, "velocity-threshold")
        );
        assert_eq!(
            latch.update(&policy, &evidence(1, 0.3, 60.0))[0].level,
            Level::Red
        );
    }

    #[test]
    fn what_goes_on_after_a_part_has_failed_faster_than_at_the_call_has_not_slowed_down() {
        let (policy, mut latch) = (Policy::default(), Latch::default());
        latch.update(&policy, &evidence(0, 0.3, 10.0));
        latch.update(&policy, &evidence(1, 0.3, 120.0));
        for hour in 2..=7 * 24 {
            latch.update(&policy, &evidence(hour, 0.0, 25.0));
            assert_eq!(latch.level(), Level::Red, "hour {hour}");
        }
        let mut slower = latch.clone();
        for hour in 0..=25 {
            slower.update(&policy, &evidence(7 * 24 + hour, 0.0, 8.0));
        }
        assert_eq!(slower.level(), Level::Green);
    }

    #[test]
    fn readings_that_are_spoilt_raise_no_peak_from_which_motion_seems_to_slow_down() {
        let (policy, mut latch) = red_at_hundred();
        for hour in 1..7 * 24 {
            let wild = [9000.0, -4000.0, 300.0, -2000.0][usize::try_from(hour % 4).unwrap()];
            let spoilt = AlertEvidence {
                settled_error_mm_per_day: if hour < 12 { 3000.0 } else { 300.0 },
                ..evidence(hour, 0.0, if hour < 40 { wild } else { wild / 4.0 })
            };
            latch.update(&policy, &spoilt);
            assert_eq!(latch.level(), Level::Red, "hour {hour}");
        }
    }

    #[test]
    fn noise_neither_breaks_a_deceleration_nor_is_it_motion_that_has_to_slow_down() {
        let (policy, mut latch) = red_at_hundred();
        let noisy = |hour: i64, chance, velocity: f64| AlertEvidence {
            settled_error_mm_per_day: 1.0,
            ..evidence(
                hour,
                chance,
                velocity + 1.5 * f64::from(u8::from(hour % 3 == 0)),
            )
        };
        let mut fallen = None;
        for hour in 1..60 {
            let left = latch.update(&policy, &noisy(hour, 0.0, 2.0));
            if fallen.is_none() && !left.is_empty() {
                fallen = Some(hour);
            }
        }
        assert_eq!(fallen, Some(25));
        let mut latch = Latch::default();
        latch.update(&policy, &noisy(0, 0.3, 0.5));
        assert_eq!(latch.level(), Level::Red);
        for hour in 1..30 {
            latch.update(&policy, &noisy(hour, 0.0, 0.5));
        }
        assert_eq!(latch.level(), Level::Green);
    }
}
