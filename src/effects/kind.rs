//! The kinds of effects that the law under a constant load lacks, by their names, and of faults of data.

use super::act::Act;
use super::definition::{EffectDefinition, LiesIn, Support, Trying};
use super::known::{self, EFFECTS};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};

/// What may be missing from the law under a constant load, or from the reading of it: an effect by its definition. In output
/// and in what is stored it is its name, and only what stands in the table is read back.
#[derive(Clone, Copy)]
pub struct Kind(&'static EffectDefinition);

/// Those that the law's own code, or a study, names: one more needs no line here.
impl Kind {
    /// A covariate's delayed response in the log-load.
    pub const HYDROLOGICAL: Self = Self(&known::HYDROLOGICAL);
    /// Harmonics of one year in the log-load.
    pub const SEASONAL: Self = Self(&known::SEASONAL);
    /// Harmonics of the tide's periods in the log-load.
    pub const TIDE: Self = Self(&known::TIDE);
    /// The log-load steps, and stays.
    pub const LOAD_STEP: Self = Self(&known::LOAD_STEP);
    /// The contacts' state is multiplied by a factor.
    pub const STATE_RESET: Self = Self(&known::STATE_RESET);
    /// The friction's parameters change.
    pub const FRICTION_CHANGE: Self = Self(&known::FRICTION_CHANGE);
    /// The load falls with the velocity.
    pub const RATE_LIMIT: Self = Self(&known::RATE_LIMIT);
    /// The load falls with the slip.
    pub const GEOMETRY: Self = Self(&known::GEOMETRY);
    /// Benchmarks that moved as one move as groups.
    pub const PARTITION: Self = Self(&known::PARTITION);
    /// The reading jumps and the slope does not.
    pub const OFFSET: Self = Self(&known::OFFSET);
    /// Harmonics of one year in the reading.
    pub const SEASONAL_READING: Self = Self(&known::SEASONAL_READING);
    /// Temperature in the reading.
    pub const THERMAL: Self = Self(&known::THERMAL);
    /// Velocity readings are means over an interval.
    pub const INTERVAL_MEAN: Self = Self(&known::INTERVAL_MEAN);
    /// Time-correlated noise of the readings.
    pub const CORRELATED_NOISE: Self = Self(&known::CORRELATED_NOISE);
    /// Structure is there, and nothing known explains it.
    pub const UNEXPLAINED: Self = Self(&known::UNEXPLAINED);
    /// The residual cannot be distinguished from noise.
    pub const NONE: Self = Self(&known::NONE);
}

impl Kind {
    /// The kind of effects with this definition.
    pub const fn of(definition: &'static EffectDefinition) -> Self {
        Self(definition)
    }

    /// Every one of the table, in its order.
    pub fn all() -> impl Iterator<Item = Self> {
        EFFECTS.iter().map(|definition| Self(definition))
    }

    /// The one of the table with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|kind| kind.name() == name)
    }

    /// What it is.
    pub fn definition(self) -> &'static EffectDefinition {
        self.0
    }

    /// As it stands in output and config.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// Whether the velocity itself jumps by it.
    pub(super) fn jumps(self) -> bool {
        let mut acts = self.0.once().iter();
        acts.any(|act| matches!(act, Act::Step | Act::Reset))
    }

    /// Whether it happens once, and in the ground.
    pub(super) fn is_event_of_the_ground(self) -> bool {
        matches!(self.0.trying, Trying::Once(_))
    }

    /// Whether it works through a covariate.
    pub fn has_channel(self) -> bool {
        matches!(
            self.0.trying,
            Trying::CovariateInLoad(_) | Trying::CovariateInReading(_)
        )
    }

    /// Whether it happens once, so that it has a time.
    pub fn has_time(self) -> bool {
        matches!(self.0.trying, Trying::Once(_) | Trying::JumpOfReading)
    }

    /// Whether one can declare it to be there: it is a term of the law, or of the reading, of one benchmark.
    pub fn can_be_declared(self) -> bool {
        !matches!(self.0.trying, Trying::Elsewhere)
    }

    /// Whether it lies in the instrument or its noise and not in the ground.
    pub fn is_of_the_reading(self) -> bool {
        self.0.lies_in == LiesIn::Reading
    }

    /// Whether it says that no effect was found.
    pub fn is_an_end(self) -> bool {
        self.0.lies_in == LiesIn::Nothing
    }

    /// Whether it is recognised by the shape of the readings alone, without a covariate or a date of its own: such a kind follows
    /// almost any bend, so it must account for everything that is left, or it explains nothing.
    pub(super) fn fits_any_bend(self) -> bool {
        self.0.support == Support::Nothing
    }

    /// Whether a covariate or known astronomy supports it, and not the shape of the curve alone.
    pub(super) fn has_independent_evidence(self) -> bool {
        matches!(self.0.support, Support::Covariate | Support::Astronomy)
    }

    /// Where it stands in the table; what does not stand there follows, by name.
    fn place(self) -> (usize, &'static str) {
        let place = EFFECTS.iter().position(|one| *one == self.0);
        (place.unwrap_or(EFFECTS.len()), self.0.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl Eq for Kind {}

impl Hash for Kind {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.name.hash(state);
    }
}

impl PartialOrd for Kind {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Kind {
    fn cmp(&self, other: &Self) -> Ordering {
        self.place().cmp(&other.place())
    }
}

impl fmt::Debug for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.name)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.0.name)
    }
}

impl Serialize for Kind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name)
    }
}

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::custom(format!("{name:?} is no kind of effect")))
    }
}

impl JsonSchema for Kind {
    fn schema_name() -> Cow<'static, str> {
        "Kind".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let each = Self::all().map(|kind| {
            json!({
                "type": "string",
                "const": kind.name(),
                "description": kind.definition().what,
            })
        });
        let each: Vec<Value> = each.collect();
        json_schema!({
            "oneOf": each,
            "description": "What may be missing from the law under a constant load, or from the reading of it.",
        })
    }
}

/// How a covariate acts.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// Its value.
    Level,
    /// Its change per day.
    Rate,
}

impl Form {
    /// As it stands in output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Level => "level",
            Self::Rate => "rate",
        }
    }
}

/// What is wrong with data, not with the slope.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// A covariate's zero jumped: its sensor was moved or set again.
    Reset,
    /// Rows that repeat earlier rows.
    RepeatedRows,
    /// The same value over and over.
    Stuck,
    /// Smooth beyond any instrument.
    Interpolated,
    /// One value far from its neighbours.
    Outlier,
    /// A value its unit does not allow, or a logger's code for no value.
    OutOfRange,
    /// From here on all values are so many times as large: they are in another unit.
    UnitSlip,
}

impl FaultKind {
    /// As it stands in output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reset => "reset",
            Self::RepeatedRows => "repeated-rows",
            Self::Stuck => "stuck",
            Self::Interpolated => "interpolated",
            Self::Outlier => "outlier",
            Self::OutOfRange => "out-of-range",
            Self::UnitSlip => "unit-slip",
        }
    }
}
