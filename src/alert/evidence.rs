//! What is known of one benchmark after a reading, and what has happened there.

use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// What is known of one benchmark after a reading.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlertEvidence {
    /// Data time.
    pub now: Timestamp,
    /// Chance of a collapse within [`super::Policy::red_within`] of the next reading, where there is a forecast.
    pub chance_for_red: Option<f64>,
    /// What its course makes of that chance, where it is one that calls red.
    pub red: RedCourse,
    /// Whether red was in force of late.
    pub was_red: bool,
    /// The chance within the outlook.
    pub chance_within_outlook: Option<f64>,
    /// The chance within the outlook that is reported to people, of which levels may count less.
    pub reported_within_outlook: Option<f64>,
    /// Latest observed velocity, mm/day; `None` before the second reading.
    pub velocity_mm_per_day: Option<f64>,
    /// The median of the latest few, which neither an outlier nor a reset moves: what a level falls by.
    pub settled_velocity_mm_per_day: Option<f64>,
    /// Its standard error by the readings' own, mm/day; 0 where none is known.
    pub settled_error_mm_per_day: f64,
    /// What the slope has moved at least in the mean over the evacuation time before, mm/day; 0 where nothing stands clear of the error.
    pub moved_at_least_mm_per_day: f64,
    /// Displacement since the first reading, mm, for benchmarks that measure it.
    pub displacement_mm: Option<f64>,
    /// Latest observed acceleration, mm/day per day.
    pub acceleration_mm_per_day2: Option<f64>,
    /// What else calls for attention: a flip to instability, an intercept drifting in. Declared rules ask for it.
    pub causes: Vec<AlertCause>,
    /// The one of these that calls yellow: what happens again and again at a slope is usual there, and calls nothing.
    pub unusual: Option<AlertCause>,
    /// Whether the newest search has found an effect that the law lacked.
    pub has_effect: bool,
    /// Days from the newest reading to the 5 % quantile of the time of collapse; `None` where it lies beyond the horizon, or
    /// without a forecast.
    pub early_quantile_days: Option<f64>,
    /// Chances of a collapse within other spans, that declared rules ask for.
    pub chances: Vec<(SignedDuration, f64)>,
    /// Declared rules whose conditions have held for long enough, by their place in the policy.
    pub due: Vec<usize>,
}

impl AlertEvidence {
    /// Chance of a collapse within a span that a declared rule asks for.
    pub(super) fn chance_within(&self, span: SignedDuration) -> Option<f64> {
        let own = self.chances.iter().find(|(within, _)| *within == span);
        own.map(|(_, chance)| *chance)
    }
}

/// What the course of a chance makes of one that calls red.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RedCourse {
    /// It calls red.
    #[default]
    Agrees,
    /// It was under what calls red not long ago, and is not so large that it calls red at once: red is pending, and orange is called.
    IsNear,
    /// The same, and it was far under it: nothing is called by it.
    Pending,
}

/// What calls for attention although no chance is large.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlertCause {
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

impl AlertCause {
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
