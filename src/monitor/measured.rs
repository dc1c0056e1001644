//! What of an input was measured: a reading of a benchmark, or a value of a covariate.

use super::Input;
use crate::reading::{BenchmarkId, Reading, Sample, Timestamp, Unit};
use jiff::SignedDuration;

/// A measured value, with what it is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measured<'a> {
    /// Of a benchmark.
    Reading {
        /// Which.
        benchmark: &'a BenchmarkId,
        /// Its unit.
        unit: Unit,
        /// For a velocity: the span before its time stamp over which it is the mean.
        averaging: Option<SignedDuration>,
        /// The reading.
        reading: &'a Reading,
    },
    /// Of a covariate.
    Sample {
        /// The channel's full name.
        channel: &'a str,
        /// The unit at the name's end, where it is one that is known.
        unit: Option<&'a str>,
        /// The value.
        sample: &'a Sample,
    },
}

impl Measured<'_> {
    /// When it was measured.
    pub fn time(&self) -> Timestamp {
        match self {
            Self::Reading { reading, .. } => reading.time,
            Self::Sample { sample, .. } => sample.time,
        }
    }

    /// The number, in the unit in which it was read.
    pub fn value(&self) -> f64 {
        match self {
            Self::Reading { reading, .. } => reading.value,
            Self::Sample { sample, .. } => sample.value,
        }
    }

    /// Its standard error, in the same unit, where one is stated.
    pub fn sigma(&self) -> Option<f64> {
        match self {
            Self::Reading { reading, .. } => reading.sigma,
            Self::Sample { .. } => None,
        }
    }
}

impl Input {
    /// The measured value; `None` for what is none.
    pub fn measured(&self) -> Option<Measured<'_>> {
        match self {
            Self::Reading {
                benchmark,
                unit,
                averaging,
                reading,
            } => Some(Measured::Reading {
                benchmark,
                unit: *unit,
                averaging: *averaging,
                reading,
            }),
            Self::Sample {
                channel,
                unit,
                sample,
            } => Some(Measured::Sample {
                channel,
                unit: unit.as_deref(),
                sample,
            }),
            Self::Missing { .. }
            | Self::Trouble { .. }
            | Self::Settings(_)
            | Self::Order(_)
            | Self::Found(_)
            | Self::Notice(_)
            | Self::Tick => None,
        }
    }

    /// The benchmark that it is a reading of, taken or missing.
    pub fn read_benchmark(&self) -> Option<&BenchmarkId> {
        match self {
            Self::Reading { benchmark, .. } | Self::Missing { benchmark, .. } => Some(benchmark),
            Self::Sample { .. }
            | Self::Trouble { .. }
            | Self::Settings(_)
            | Self::Order(_)
            | Self::Found(_)
            | Self::Notice(_)
            | Self::Tick => None,
        }
    }

    /// The name of the benchmark or covariate that a value is of; empty where there is none.
    pub fn series_name(&self) -> &str {
        match (self.read_benchmark(), self) {
            (Some(benchmark), _) => benchmark.as_str(),
            (None, Self::Sample { channel, .. }) => channel,
            (None, _) => "",
        }
    }
}
