//! What is measured: benchmarks, quantities, units, readings, channels.
//!
//! Values keep the unit in which they were measured, so that a recording converted there and back
//! is the same readings; the science converts to millimetres and days where it takes them.

mod conventions;
mod covariate;
mod dialect;
mod figure;
mod leading_zeros;
mod line_fit;
mod local_times;
mod median;
mod normal;
pub mod other_unit;
mod plain;
mod recording;
mod resolution;
mod running_total;
mod series;
pub mod suspicion;
mod time_span;
mod unit;

pub use conventions::{Conventions, LocalClock, MissingValues, SummerTime, TimeFault};
pub use covariate::CovariateKind;
pub use dialect::{DecimalMark, Delimiter, Dialect, MOST_SKIPPED, ThousandsMark, TimeFormat};
pub use figure::{counted, figure, shortest, whole_figure};
pub use jiff::Timestamp;
pub use line_fit::LineFit;
pub use local_times::{clock, local};
pub use median::{upper_median, upper_median_by};
pub use normal::{
    CHI_SQUARED_90, DEVIATION_PER_MEDIAN, HALF_WIDTH_90, HALF_WIDTH_95, NORMAL_MEDIAN,
};
pub use plain::plain;
pub use recording::{MergeError, Recording, SelectError};
pub use resolution::rounding_error;
pub use running_total::RunningTotal;
pub use series::{Channel, Disorder, Reading, Sample, Series};
pub use suspicion::Suspicion;
pub use time_span::TimeSpan;
pub use unit::{LengthUnit, Quantity, TimeUnit, Unit, UnitError, bracketed, in_brackets};

use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Seconds in a day, the unit of time inside the science.
pub const SECONDS_PER_DAY: f64 = 86_400.0;
/// Days in a year.
pub const DAYS_PER_YEAR: f64 = 365.25;

/// Before all readings: the data time of what is said before there is one.
pub const BEFORE_ALL: Timestamp = Timestamp::constant(-9_223_372_036, 0);

/// To the minute, in UTC: people read this, and no forecast is finer.
pub fn minute(time: Timestamp) -> String {
    if time <= BEFORE_ALL {
        return "before any reading".to_owned();
    }
    time.strftime("%Y-%m-%d %H:%MZ").to_string()
}

/// The name of one measured point on a slope.
#[derive(
    Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct BenchmarkId(String);

impl BenchmarkId {
    /// Wraps a name as it stands in the file or the config.
    pub fn new(name: impl Into<String>) -> Self {
        Self(name.into())
    }

    /// The name itself.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for BenchmarkId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// A span in days.
pub fn days_of(span: SignedDuration) -> f64 {
    span.as_secs_f64() / SECONDS_PER_DAY
}

/// Seconds since 1970, to the millisecond.
pub fn unix_seconds(time: Timestamp) -> f64 {
    time.as_millisecond() as f64 / 1e3
}

/// Days from `epoch` to `time`, negative before it.
pub fn days_since(epoch: Timestamp, time: Timestamp) -> f64 {
    let nanoseconds = time.as_nanosecond() - epoch.as_nanosecond();
    nanoseconds as f64 / 1e9 / SECONDS_PER_DAY
}

/// The instant `days` after `epoch`, to the nearest second (no forecast is finer); `None` outside
/// the calendar.
pub fn after_days(epoch: Timestamp, days: f64) -> Option<Timestamp> {
    let seconds = (days * SECONDS_PER_DAY).round();
    if !seconds.is_finite() || seconds.abs() > 1e14 {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "bounded by 1e14 just above"
    )]
    let seconds = seconds as i64;
    epoch
        .checked_add(jiff::SignedDuration::from_secs(seconds))
        .ok()
}

/// The instant `days` after `epoch`, to the nanosecond; `None` outside the calendar.
pub fn instant_after_days(epoch: Timestamp, days: f64) -> Option<Timestamp> {
    let nanoseconds = (days * SECONDS_PER_DAY * 1e9).round();
    if !nanoseconds.is_finite() {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float fits, or is cut off far outside the calendar"
    )]
    let since = nanoseconds as i128;
    let whole = epoch.as_nanosecond().checked_add(since)?;
    Timestamp::from_nanosecond(whole).ok()
}
