//! A benchmark's readings and the covariates beside them, in time order.

use super::{BenchmarkId, Quantity, Timestamp, Unit};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One reading of one benchmark, in the unit of its series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// When it was measured.
    pub time: Timestamp,
    /// The value, finite, in the unit of its series.
    pub value: f64,
    /// Its standard error, positive, in the same unit, where the source gives one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sigma: Option<f64>,
}

/// All readings of one quantity of one benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// Their unit, which also says the quantity.
    pub unit: Unit,
    /// For velocities: the span before the time stamp over which each is the mean.
    pub averaging: Option<SignedDuration>,
    /// The readings, in strictly increasing time.
    pub readings: Vec<Reading>,
}

impl Series {
    /// Displacement or velocity.
    pub fn quantity(&self) -> Quantity {
        self.unit.quantity()
    }
}

/// One value of a covariate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// When it was measured.
    pub time: Timestamp,
    /// The value, finite, in the unit of its channel.
    pub value: f64,
}

/// A covariate: rain, a reservoir level, a river's flow, a temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// The full column name, unit included: `lake_level_m`.
    pub name: String,
    /// The unit at the name's end, where it is one that is known.
    pub unit: Option<String>,
    /// The values, in strictly increasing time.
    pub samples: Vec<Sample>,
}

/// What putting rows in order met.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Disorder {
    /// Rows that repeated an earlier row exactly.
    pub repeated: usize,
    /// Rows that gave another value for a time already read; the later row stands.
    pub corrected: usize,
    /// Rows that stood before an earlier time.
    pub out_of_order: usize,
}

/// Everything one or more files hold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// The benchmarks' readings, by benchmark, then quantity.
    pub series: Vec<Series>,
    /// The covariates, by name.
    pub channels: Vec<Channel>,
    /// Where the data come from, as the file's own metadata say.
    pub provenance: BTreeMap<String, String>,
}
