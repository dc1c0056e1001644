//! What a site asks for: the levels, their rules and the figures in them.

use super::declared::DeclaredRule;
use super::level::Level;
use crate::reading::SECONDS_PER_DAY;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Plain thresholds, a floor beside the model: the level is at least `level` while one is exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// The level that it calls.
    pub level: Level,
    /// Velocity, mm/day.
    pub velocity_mm_per_day: Option<f64>,
    /// Displacement since the first reading, mm.
    pub displacement_mm: Option<f64>,
    /// Acceleration, mm/day per day.
    pub acceleration_mm_per_day2: Option<f64>,
}

/// The figures in the level rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// How long it takes to bring everyone out.
    pub evacuation_time: SignedDuration,
    /// How far ahead orange and yellow look.
    pub outlook: SignedDuration,
    /// How far ahead red looks; without it [`Policy::red_within`] follows from the evacuation time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub red_within: Option<SignedDuration>,
    /// Passing this velocity is failure, mm/day.
    pub critical_velocity_mm_per_day: f64,
    /// Chance of collapse within [`Policy::red_within`] of the next reading that calls red, where its mean is [`Policy::red_mean_chance`] or more, or
    /// the chance itself [`Policy::red_at_once`] or more, or where red was in force within [`Policy::red_of_late`].
    pub red_chance: f64,
    /// Chance of collapse within the outlook that calls orange.
    pub orange_chance: f64,
    /// Chance of collapse within the outlook that calls yellow.
    pub yellow_chance: f64,
    /// Plain thresholds beside the model.
    pub thresholds: Vec<Threshold>,
    /// Rules of the site's own, beside the model too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rules: Vec<DeclaredRule>,
    /// How long a slope must hold a steady velocity before its level falls.
    pub steady_for: SignedDuration,
}

/// Red looks so many evacuation times ahead. A collapse that is sure to come within one is reported too late for an evacuation.
/// Set on simulated slopes: at the same share of collapses called a day before, a chance within one evacuation time called red
/// twice as often on slopes that stand as one within two.
const EVACUATIONS_AHEAD: i32 = 2;
/// A chance calls red by its course too: the mean of the ln of its odds, each earlier value counting the less the longer ago it was,
/// by a factor of e in this part of the evacuation time, has come to odds of this share of those that call red; unless the newest
/// has so many times these odds. Set on simulated slopes (docs/false-alarms.md): without it red was called 1.3 times as often on
/// slopes that stand and are read each hour, 1.9 times each ten minutes, and one collapse in a hundred more was called a day before.
const COURSE_PART: i32 = 2;
const MEAN_ODDS: f64 = 2.0 / 3.0;
const ODDS_AT_ONCE: f64 = 4.0;
/// After so many of these parts a value has lost all but a fiftieth of its weight.
const COURSES: i32 = 4;
/// Red that is pending calls orange when the mean has come to odds of this share.
const NEAR_ODDS: f64 = 1.0 / 7.0;
/// Red was in force of late within so many of the times that a slope must be steady. Slopes pause for 2 to 10 days before they collapse.
const OF_LATE: i32 = 2;
/// The next reading is taken to be no further away than this.
const FARTHEST_READING: SignedDuration = SignedDuration::from_hours(30 * 24);

/// `span`, counted from the next reading, which is `to_next_days` away: what this one does not call, that one may, and people act
/// then.
pub fn to_the_next_reading(span: SignedDuration, to_next_days: f64) -> SignedDuration {
    let to_next = SignedDuration::try_from_secs_f64(to_next_days * SECONDS_PER_DAY);
    let to_next = to_next.unwrap_or_default();
    span.saturating_add(to_next.min(FARTHEST_READING))
}

/// The chance whose odds are so many times those of `chance`.
fn with_odds_times(chance: f64, factor: f64) -> f64 {
    factor * chance / (1.0 - chance + factor * chance)
}

impl Policy {
    /// Whether a forecast is judged otherwise than under `before`, whatever thresholds and rules say.
    pub fn forecasts_otherwise(&self, before: &Self) -> bool {
        let alike = Self {
            thresholds: self.thresholds.clone(),
            rules: self.rules.clone(),
            ..before.clone()
        };
        alike != *self
    }

    /// How far ahead red looks.
    pub fn red_within(&self) -> SignedDuration {
        let twice = self.evacuation_time.saturating_mul(EVACUATIONS_AHEAD);
        self.red_within.unwrap_or(twice)
    }

    /// Over what time the mean chance is taken that calls red: each value counts the less by a factor of e after so long.
    pub fn red_course(&self) -> SignedDuration {
        self.evacuation_time / COURSE_PART
    }

    /// After so long a value hardly counts in that mean any more.
    pub fn red_course_fades(&self) -> SignedDuration {
        self.red_course().saturating_mul(COURSES)
    }

    /// The mean chance over [`Policy::red_course`] that calls red beside [`Policy::red_chance`].
    pub fn red_mean_chance(&self) -> f64 {
        with_odds_times(self.red_chance, MEAN_ODDS)
    }

    /// The mean chance that calls orange while red is pending.
    pub fn red_near_chance(&self) -> f64 {
        with_odds_times(self.red_chance, NEAR_ODDS)
    }

    /// For how long after red was in force a chance calls it again at once.
    pub fn red_of_late(&self) -> SignedDuration {
        self.steady_for.saturating_mul(OF_LATE)
    }

    /// The chance that calls red at once.
    pub fn red_at_once(&self) -> f64 {
        with_odds_times(self.red_chance, ODDS_AT_ONCE)
    }

    /// [`Policy::red_within`] in words.
    pub fn red_within_in_words(&self) -> &'static str {
        self.red_within
            .map_or("twice the evacuation time", |_| "red_within")
    }
}

impl Default for Policy {
    fn default() -> Self {
        Self {
            evacuation_time: SignedDuration::from_hours(24),
            outlook: SignedDuration::from_hours(30 * 24),
            red_within: None,
            critical_velocity_mm_per_day: 1000.0,
            red_chance: 0.27,
            orange_chance: 0.7,
            yellow_chance: 0.3,
            thresholds: Vec::new(),
            rules: Vec::new(),
            steady_for: SignedDuration::from_hours(7 * 24),
        }
    }
}
