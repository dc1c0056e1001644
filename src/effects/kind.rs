//! The names of the effects that the law under a constant load lacks, and of the faults of data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What may be missing from the law under a constant load, or from the reading of it.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A covariate's delayed response in the log-load: water, rain, a reservoir.
    Hydrological,
    /// Harmonics of one year in the log-load.
    Seasonal,
    /// Harmonics of the tide's periods in the log-load.
    Tide,
    /// The log-load steps, and stays.
    LoadStep,
    /// The contacts' state is multiplied by a factor: a new sliding surface, an earthquake.
    StateReset,
    /// The friction's parameters change.
    FrictionChange,
    /// The load falls with the velocity: radiation damping, inertia.
    RateLimit,
    /// The load falls with the slip: the slope flattens under the block.
    Geometry,
    /// Benchmarks that moved as one move as groups.
    Partition,
    /// The reading jumps and the slope does not: a prism reset, a bumped instrument.
    Offset,
    /// Temperature in the reading.
    Thermal,
    /// Velocity readings are means over an interval.
    IntervalMean,
    /// Noise of the reading that remembers: AR(1), or a monument's random walk.
    CorrelatedNoise,
    /// Structure is there, and nothing known explains it.
    Unexplained,
    /// The residual cannot be distinguished from noise.
    None,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 15] = [
        Self::Hydrological,
        Self::Seasonal,
        Self::Tide,
        Self::LoadStep,
        Self::StateReset,
        Self::FrictionChange,
        Self::RateLimit,
        Self::Geometry,
        Self::Partition,
        Self::Offset,
        Self::Thermal,
        Self::IntervalMean,
        Self::CorrelatedNoise,
        Self::Unexplained,
        Self::None,
    ];

    /// As it stands in output and config.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hydrological => "hydrological",
            Self::Seasonal => "seasonal",
            Self::Tide => "tide",
            Self::LoadStep => "load-step",
            Self::StateReset => "state-reset",
            Self::FrictionChange => "friction-change",
            Self::RateLimit => "rate-limit",
            Self::Geometry => "geometry",
            Self::Partition => "partition",
            Self::Offset => "offset",
            Self::Thermal => "thermal",
            Self::IntervalMean => "interval-mean",
            Self::CorrelatedNoise => "correlated-noise",
            Self::Unexplained => "unexplained",
            Self::None => "none",
        }
    }

    /// Whether the velocity itself jumps by it.
    pub(super) fn jumps(self) -> bool {
        matches!(self, Self::LoadStep | Self::StateReset)
    }

    /// Whether it happens once, and in the ground.
    pub(super) fn is_event_of_the_ground(self) -> bool {
        matches!(
            self,
            Self::LoadStep | Self::StateReset | Self::FrictionChange
        )
    }

    /// Whether it works through a covariate.
    pub fn has_channel(self) -> bool {
        matches!(self, Self::Hydrological | Self::Thermal)
    }

    /// Whether it happens once, so that it has a time.
    pub fn has_time(self) -> bool {
        self.is_event_of_the_ground() || self == Self::Offset
    }

    /// Whether one can declare it to be there: it is a term of the law, or of the reading, of one benchmark.
    pub fn can_be_declared(self) -> bool {
        match self {
            Self::Hydrological
            | Self::Seasonal
            | Self::Tide
            | Self::LoadStep
            | Self::StateReset
            | Self::FrictionChange
            | Self::RateLimit
            | Self::Geometry
            | Self::Offset
            | Self::Thermal
            | Self::IntervalMean => true,
            Self::Partition | Self::CorrelatedNoise | Self::Unexplained | Self::None => false,
        }
    }

    /// Whether it lies in the instrument or its noise and not in the ground.
    pub fn is_of_the_reading(self) -> bool {
        matches!(
            self,
            Self::Offset | Self::Thermal | Self::IntervalMean | Self::CorrelatedNoise
        )
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
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
        }
    }
}
