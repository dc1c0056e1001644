//! What the monitor says: one JSON object a line, in data time, nothing from the wall clock.

use super::given::{Given, OrderKind};
use super::undeclared::UndeclaredLoad;
use crate::alert::Level;
use crate::effects::{Explained, Form, Kind, Rival};
use crate::reading::{BenchmarkId, Timestamp};
use crate::regime::Regime;
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One thing that the monitor says.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct Event {
    /// Data time: that of the newest reading, or that at which something was due without one (`no-data`). Of an order it is this time too, not the
    /// time at which it was given. Before the first reading it is 1677-09-21T00:12:44Z; a hook is given the clock's time instead.
    pub time: Timestamp,
    /// What happened.
    #[serde(flatten)]
    pub kind: EventKind,
    /// To which benchmark; `None` for the site as a whole.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub benchmark: Option<BenchmarkId>,
}

/// The kinds of event.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum EventKind {
    /// The law was fitted again with a larger `t_max`.
    Refit {
        /// The newest reading used.
        t_max: Timestamp,
        /// Which regime, with what probability.
        regime: RegimeReport,
        /// When the slope collapses: for people who have to be ready for it, put sooner than the chances have it.
        failure_time: FailureTime,
        /// How likely it is that a collapse comes at all. Absent in states of older versions.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        chances_of_collapse: Option<Box<ChancesOfCollapse>>,
        /// When the critical velocity is passed.
        #[serde(default)]
        critical_velocity_time: Box<FailureTime>,
        /// Probability that the slope accelerates, against steady motion.
        #[serde(default)]
        probability_of_acceleration: f64,
        /// The straight line through inverse velocity.
        inverse_velocity: InverseVelocity,
        /// Inflection of the fitted velocity.
        transition_time: Option<Timestamp>,
        /// The velocity now, mm/day.
        velocity_mm_per_day: Option<f64>,
        /// Chance of collapse within the evacuation time, as levels use it.
        chance_within_evacuation_time: f64,
        /// Chance of collapse within the outlook, as levels use it.
        chance_within_outlook: f64,
        /// The level that this forecast calls for, and the chances that the levels are called by. Absent in states of older
        /// versions.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        called: Option<Box<CalledLevel>>,
        /// What the law under a constant load says by itself, where an effect is adopted.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        plain: Option<Box<Plain>>,
    },
    /// The regime in force changed: another one had a probability of 0.8 or more at two refits in a row.
    RegimeFlip {
        /// The regime before.
        from: Regime,
        /// The regime after.
        to: Regime,
        /// The probability of the new one.
        probability: f64,
    },
    /// The inverse-velocity intercept moved over successive refits.
    InterceptDrift {
        /// The intercept last announced.
        from: Timestamp,
        /// The intercept now.
        to: Timestamp,
        /// How fast it moves, days a day of new readings; below 0 to an earlier time.
        drift_days_per_day: f64,
        /// How fast it would move if the fitted law held, days a day of new readings; below 0 to an earlier time. Null where the law says nothing
        /// of it.
        expected_days_per_day: Option<f64>,
    },
    /// The transition time moved with `t_max`.
    TransitionDrift {
        /// The transition time last announced.
        from: Timestamp,
        /// The transition time now.
        to: Timestamp,
        /// How fast it moves, days a day of new readings; below 0 to an earlier time.
        drift_days_per_day: f64,
    },
    /// What the readings show and the law in force does not explain.
    UnexplainedResidual(Unexplained),
    /// A search found what the law lacks; one event for each effect.
    EffectFound {
        /// Its kind.
        effect: Kind,
        /// The covariate that it works through.
        channel: Option<String>,
        /// By the covariate's value or by its rate.
        form: Option<Form>,
        /// When it happened, for what happened once.
        at: Option<Timestamp>,
        /// Mean delay of the response, days.
        lag_days: Option<f64>,
        /// By how much the BIC fell.
        bic_gain: f64,
        /// Chance that the search finds as much in nothing.
        p_value: Option<f64>,
        /// How much of the structure all effects together account for.
        explained: Explained,
        /// What would explain the same.
        cannot_separate_from: Vec<Rival>,
        /// Whether forecasts and levels go by it from here on.
        adopted: bool,
        /// The load that nobody declared, before and after all effects that were found.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        undeclared_load: Option<Box<UndeclaredLoad>>,
    },
    /// A later search no longer finds an effect that forecasts went by.
    EffectDropped {
        /// Its kind.
        effect: Kind,
        /// The covariate that it worked through.
        channel: Option<String>,
    },
    /// A level was entered or left.
    Alert {
        /// The level.
        level: Level,
        /// Firing or resolved.
        state: AlertState,
        /// Stable over retries, restarts and replays.
        key: String,
        /// The rule that called it.
        rule: String,
        /// One line for a person.
        text: String,
    },
    /// Benchmarks in alarm that share one failure time, where that is other than last reported; none any more where the
    /// list is empty.
    Together {
        /// Each of at least two benchmarks.
        groups: Vec<SharedFailure>,
    },
    /// The monitor cannot rely on what it is given.
    Fault {
        /// `no-data`, `out-of-range`, `out-of-order`, ...
        kind: String,
        /// One line for a person.
        text: String,
    },
    /// Something that people declared takes effect at a benchmark.
    Declared {
        /// `reset`, `maintenance` or `blast`.
        kind: String,
        /// When it was, or began.
        at: Timestamp,
        /// The end of maintenance.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        until: Option<Timestamp>,
        /// What a reset made the readings jump by, mm.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        size_mm: Option<f64>,
        /// One line for a person.
        text: String,
    },
    /// Readings that came late, or were corrected, would have called another level in the past.
    Correction {
        /// The earliest of them.
        since: Timestamp,
        /// The highest level that was in force from then on.
        level_then: Level,
        /// The highest level that would have been called.
        level_now: Level,
        /// The keys of the benchmark's alerts that were in force from then on, the oldest first; none where no level was.
        #[serde(skip_serializing_if = "Vec::is_empty", default)]
        alerts: Vec<String>,
        /// One line for a person.
        text: String,
    },
    /// People asked for something.
    Order {
        /// What they asked for.
        order: OrderKind,
        /// Until when, by the wall clock.
        until: Option<Timestamp>,
        /// The key of the only alert that it is of; `None`: of everything in its place.
        #[serde(skip_serializing_if = "Option::is_none", default)]
        alert: Option<String>,
        /// Who, why, by which way.
        #[serde(flatten)]
        given: Given,
    },
    /// The end of a replay.
    Summary(Summary),
}

/// The rule by which what is in force ends at a benchmark that is no longer watched.
pub const REMOVED: &str = "removed";

/// What the keys of alerts of the whole site begin with.
pub(super) const SITE: &str = "site";

/// The key of a benchmark's alert in force since `since`, whose readings have been dropped so often: no other one of this benchmark has it, an earlier
/// one of the same readings neither, nor one of the whole site where the benchmark bears its name.
pub(super) fn alert_key(
    benchmark: &BenchmarkId,
    level: Level,
    dropped: u32,
    since: Timestamp,
) -> String {
    match dropped {
        0 if benchmark.as_str() != SITE => format!("{benchmark}/{level}/{since}"),
        times => format!("{benchmark}/{level}/{}/{since}", times.saturating_add(1)),
    }
}

/// How the kind of a fault begins that says a suspicion of readings, and how that of its end ends.
pub const SUSPECT: &str = "suspect-";
/// The kind of a fault that says that a reset was found which nobody declared.
pub const RESET_FOUND: &str = "reset-found";
/// The kind of a fault that says that it was none: the readings came back.
pub(super) const RESET_RETURNED: &str = "reset-returned";
/// See [`SUSPECT`].
pub const SUSPECT_ENDS: &str = "-ends";

/// What is not explained.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Unexplained {
    /// The newest reading is one that nobody expected: a step, a load that was not declared, a fault.
    Reading {
        /// How much less likely it was than the usual reading, ln.
        surprise_nats: f64,
        /// The velocity that it implies, mm/day.
        velocity_mm_per_day: Option<f64>,
    },
    /// The residual of the whole record has structure, as a load would bring it.
    Structure {
        /// Fall of the BIC if a random load is let into the noise.
        bic_gain: f64,
        /// Standard deviation of that load, e-folds of velocity.
        load_sd: f64,
        /// From when it stands out.
        since: Timestamp,
    },
}

/// The level that one forecast calls for, before any level in force is held.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct CalledLevel {
    /// The level. One in force that is higher is held until the slope slows down.
    pub level: Level,
    /// The rule that calls it; `quiet` where none does.
    pub rule: String,
    /// The site's own rules whose conditions hold, and have not held for long enough yet; the rule of red, where its chance has not.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub pending: Vec<String>,
    /// What red is called by.
    pub red: LevelChance,
    /// What orange is called by.
    pub orange: LevelChance,
    /// What yellow is called by.
    pub yellow: LevelChance,
}

/// The chance of collapse that a level is called by.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct LevelChance {
    /// The chance.
    pub chance: f64,
    /// Within how many hours of the newest reading: for red `red_within` and the time until the next reading, for
    /// orange and yellow the outlook, or five times the record's length where that is shorter.
    pub within_hours: f64,
    /// From which chance on the level is called.
    pub at_least: f64,
}

impl LevelChance {
    /// The time that it is for.
    pub fn within(&self) -> SignedDuration {
        let seconds = (3600.0 * self.within_hours).round();
        SignedDuration::try_from_secs_f64(seconds).unwrap_or(SignedDuration::MAX)
    }
}

/// The forecast of the law under a constant load, beside that of the law under the known load.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct Plain {
    /// Which regime, with what probability.
    pub regime: RegimeReport,
    /// When the slope collapses.
    pub failure_time: FailureTime,
    /// Whether the law under the known load explains the present velocity. While it does not, the larger of both chances
    /// decides the level.
    pub is_explained: bool,
}

/// Where an alert is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AlertState {
    /// The level is in force.
    Firing,
    /// The level is no longer in force.
    Resolved,
}

/// The regime's label and all probabilities.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct RegimeReport {
    /// The regime, or `undetermined`.
    pub label: Regime,
    /// Probability of kappa > 0.
    pub probability_unstable: f64,
    /// Probability of r > 0.
    pub probability_accelerating: f64,
    /// Every regime's probability.
    pub probabilities: BTreeMap<Regime, f64>,
    /// r of the most probable law, 1/day: where it stands in the regime plane. Absent without a law.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub r_per_day: Option<f64>,
    /// kappa of the same law, 1/day.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub kappa_per_day: Option<f64>,
}

/// The chances that a collapse comes within so many days of the newest reading. `failure_time` says when, if one does, and is put sooner; levels are
/// called by less, by what the readings show beyond doubt ([`LevelChance`]).
#[derive(Debug, Clone, Copy, Default, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct ChancesOfCollapse {
    /// Within a day.
    pub within_1_day: f64,
    /// Within two days.
    pub within_2_days: f64,
    /// Within a week.
    pub within_7_days: f64,
    /// Within thirty days.
    pub within_30_days: f64,
}

/// The time of a collapse, or of the first passage of the critical velocity; quantiles are unconditional.
#[derive(Debug, Clone, Copy, Default, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct FailureTime {
    /// 5 % quantile, `None` when not reached within the horizon.
    pub low: Option<Timestamp>,
    /// Median.
    pub median: Option<Timestamp>,
    /// 95 % quantile.
    pub high: Option<Timestamp>,
    /// Chance of passage within the horizon.
    pub probability: f64,
    /// How far the forecast looks, days.
    pub horizon_days: f64,
}

/// Benchmarks that share one failure time.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct SharedFailure {
    /// Which.
    pub benchmarks: Vec<BenchmarkId>,
    /// How probably each fails with the others, in the same order.
    pub probabilities: Vec<f64>,
    /// When they collapse together.
    pub failure_time: FailureTime,
    /// The chance of that within the site's evacuation time.
    pub chance_within_evacuation_time: f64,
}

/// The straight line through 1/v.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct InverseVelocity {
    /// Where the line meets zero, `None` when it does not fall.
    pub failure_time: Option<Timestamp>,
    /// Of the line, `None` when there is none.
    pub r_squared: Option<f64>,
}

/// Counts at the end of a replay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
pub struct Summary {
    /// Readings taken in.
    pub readings: u64,
    /// Refits made.
    pub refits: u64,
    /// Alerts that fired.
    pub alerts: u64,
}

impl Summary {
    /// Counts one event; an alert of the whole site repeats what its benchmarks called.
    pub(super) fn count(&mut self, event: &Event) {
        let fires = matches!(
            event.kind,
            EventKind::Alert {
                state: AlertState::Firing,
                ..
            }
        );
        if matches!(event.kind, EventKind::Refit { .. }) {
            self.refits += 1;
        } else if fires && event.benchmark.is_some() {
            self.alerts += 1;
        }
    }
}

/// Since when the alert of this key is in force: its end.
pub fn since_by_key(key: &str) -> Option<Timestamp> {
    key.rsplit_once('/')?.1.parse().ok()
}
