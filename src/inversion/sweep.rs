//! The inversion over growing `t_max` from a fixed start: what would have been said, and when.

use super::report::{Alternatives, FittedFailureTime, FittedInverseVelocity, FittedRegime};
use super::{FitReport, Inversion, InversionOptions};
use crate::reading::{BenchmarkId, Quantity, SECONDS_PER_DAY, Series, Timestamp, Unit};
use schemars::JsonSchema;
use serde::Serialize;

/// Where `t_max` runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepOptions {
    /// The first `t_max`; by default after a quarter of the readings, and eight at least.
    pub first: Option<Timestamp>,
    /// The last `t_max`; by default the last reading.
    pub last: Option<Timestamp>,
    /// How many, evenly spaced in time.
    pub steps: usize,
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self {
            first: None,
            last: None,
            steps: 20,
        }
    }
}

/// A bound on the work of one sweep.
const MOST_STEPS: usize = 1000;
/// Readings before the first `t_max`, by default.
const FEWEST_READINGS: usize = 8;

/// A sweep.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct SweepReport {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// Displacement or velocity.
    pub quantity: Quantity,
    /// The readings' unit.
    pub unit: Unit,
    /// The first reading, where every row starts.
    pub first: Option<Timestamp>,
    /// One inversion a row, in increasing `t_max`.
    pub rows: Vec<SweepRow>,
}

/// The inversion up to one `t_max`.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct SweepRow {
    /// No later reading was used.
    pub t_max: Timestamp,
    /// How many were used.
    pub readings: usize,
    /// Which regime, with what probability, the load being constant.
    pub regime: FittedRegime,
    /// The same where the load may change undeclared: what the monitor uses. `None` with too few readings, and where m is given.
    pub regime_under_load: Option<FittedRegime>,
    /// Whether the velocity stood still over the last third of the readings; for the text.
    #[serde(skip)]
    pub has_stood_still: bool,
    /// m of the best fit.
    pub m: Option<f64>,
    /// Its initial state.
    pub x_i: Option<f64>,
    /// Inflection of its velocity.
    pub transition_time: Option<Timestamp>,
    /// When the slope collapses.
    pub failure_time: FittedFailureTime,
    /// The straight line through inverse velocity.
    pub inverse_velocity: FittedInverseVelocity,
    /// The distinct minima of the misfit, best first.
    pub alternatives: Alternatives,
    /// Root mean square residual of the best fit, in the readings' unit.
    pub rms: Option<f64>,
    /// Why the best fit ended.
    pub termination: String,
}

/// Inverts `series` up to each `t_max` in turn.
pub fn sweep(series: &Series, options: &InversionOptions, steps: &SweepOptions) -> SweepReport {
    sweep_showing(series, options, steps, &mut |_| {})
}

/// The same; `progress` is called with the share done, 0 to 1.
pub fn sweep_showing(
    series: &Series,
    options: &InversionOptions,
    steps: &SweepOptions,
    progress: &mut dyn FnMut(f64),
) -> SweepReport {
    let whole = Inversion::new(series, options);
    let t_maxes = t_maxes(whole.series(), steps);
    let rows = t_maxes.iter().enumerate().map(|(index, t_max)| {
        progress(index as f64 / t_maxes.len() as f64);
        let upto = InversionOptions {
            until: Some(*t_max),
            ..*options
        };
        let part = Inversion::new(whole.series(), &upto);
        let report = part.report(&part.least_squares(), 0.0);
        SweepRow::of(*t_max, report)
    });
    SweepReport {
        benchmark: whole.series().benchmark.clone(),
        quantity: whole.series().quantity(),
        unit: whole.series().unit,
        first: whole.series().readings.first().map(|reading| reading.time),
        rows: rows.collect(),
    }
}

/// The `t_max` of every row, none twice.
fn t_maxes(series: &Series, steps: &SweepOptions) -> Vec<Timestamp> {
    let readings = &series.readings;
    let (Some(start), Some(end)) = (readings.first(), readings.last()) else {
        return Vec::new();
    };
    let early = (readings.len() / 4)
        .max(FEWEST_READINGS)
        .min(readings.len())
        - 1;
    let first = steps.first.unwrap_or(readings[early].time).max(start.time);
    let last = steps.last.unwrap_or(end.time).min(end.time);
    let count = steps.steps.clamp(1, MOST_STEPS);
    let span = crate::reading::days_since(first, last);
    if span < 0.0 {
        return Vec::new();
    }
    let at = |index: usize| {
        if index + 1 == count {
            return Some(last);
        }
        let days = span * index as f64 / (count - 1) as f64;
        // Whole seconds read better, and no reading is missed by less.
        let seconds = (days * SECONDS_PER_DAY).ceil() / SECONDS_PER_DAY;
        crate::reading::after_days(first, seconds).map(|time| time.min(last))
    };
    let mut all: Vec<Timestamp> = (0..count).filter_map(at).collect();
    all.dedup();
    all
}

impl SweepRow {
    fn of(t_max: Timestamp, report: FitReport) -> Self {
        Self {
            t_max,
            readings: report.readings,
            regime: report.regime,
            has_stood_still: report.has_stood_still,
            regime_under_load: report.regime_under_load,
            m: report.parameters.m.best,
            x_i: report.parameters.x_i.best,
            transition_time: report.transition_time,
            failure_time: report.failure_time,
            inverse_velocity: report.inverse_velocity,
            alternatives: report.alternatives,
            rms: report.rms,
            termination: report.termination,
        }
    }
}
