//! What an explanation says, key for key as scripts read it: what is unbounded or missing is null.

use super::kind::{FaultKind, Form, Kind};
use super::known_load::KnownLoad;
use super::rival::Rival;
use crate::reading::{BenchmarkId, Quantity, Timestamp, Unit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// From a benchmark's residual to the effect that its law lacks.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Explanation {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// Displacement or velocity.
    pub quantity: Quantity,
    /// The readings' unit.
    pub unit: Unit,
    /// How many there are.
    pub readings: usize,
    /// The first one.
    pub first: Option<Timestamp>,
    /// The last one.
    pub last: Option<Timestamp>,
    /// The first effect accepted, or `unexplained` or `none`.
    pub verdict: Effect,
    /// How much of the residual's structure the effects account for.
    pub explained: Explained,
    /// The effects accepted after the verdict, in that order.
    pub also: Vec<Effect>,
    /// What was declared to be there, each with its judgement; missing where nothing was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub given: Vec<DeclaredEffect>,
    /// What explains the same within the margin: kinds, with the channel where there is one; `unexplained` is a load that changes over a while and
    /// that nothing measures.
    pub cannot_separate_from: Vec<Rival>,
    /// What is wrong with the data themselves.
    pub faults: Vec<Fault>,
    /// Misfit before and after, on the same data and under the same noise model.
    pub error: ErrorChange,
    /// What the effects change in the forecast.
    pub forecast: ForecastChange,
    /// Everything tried, best first, with why it was refused.
    pub candidates: Vec<Candidate>,
    /// In short, what is wrong with the data: `interpolated`, `repeated-rows`, `stuck`, `covariate-reset`.
    pub flags: Vec<String>,
    /// What a person should know, a sentence each.
    pub remarks: Vec<String>,
    /// The tests of the residual, before and after.
    pub residual: ResidualTests,
    /// The noise under which all was judged.
    pub noise: NoiseReport,
    /// What makes this run repeatable.
    pub settings: SettingsReport,
    /// The series behind the figures.
    #[serde(skip)]
    pub curves: Curves,
    /// The effects as a forecast uses them.
    #[serde(skip)]
    pub known_load: KnownLoad,
}

/// One effect inside the law.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct Effect {
    /// Its kind.
    pub effect: Kind,
    /// The covariate it works through.
    pub channel: Option<String>,
    /// Whether by the covariate's value or its rate of change.
    pub form: Option<Form>,
    /// Chance that the search finds as much without any effect, everything tried counted.
    pub p_value: Option<f64>,
    /// Mean of the response, days.
    pub lag_days: Option<f64>,
    /// By when 95 % of the response has passed (t95), days.
    pub memory_days: Option<f64>,
    /// Gain for one standard deviation of what enters: of a load the log-load, e-folds; of what acts in the reading in `unit`.
    pub gain_per_sd: Option<f64>,
    /// By which factor the velocity is higher where what enters is one standard deviation higher: the law's state answers to the load too.
    pub velocity_factor_per_sd: Option<f64>,
    /// Bounds of the 90 % interval (5 and 95 %) of `gain_per_sd`, in its unit; null where the readings leave it open.
    pub gain_interval: Option<[f64; 2]>,
    /// The strongest period, days.
    pub period_days: Option<f64>,
    /// When it happened.
    pub at: Option<Timestamp>,
    /// Between when and when it may have happened, 90 %.
    pub at_interval: Option<[Timestamp; 2]>,
    /// How large: of an offset in `unit`, of a step the log-load, of a reset the state's factor, and so on.
    pub size: Option<f64>,
    /// Bounds of the 90 % interval (5 and 95 %) of the `size` of what happened at a time, in its unit, that time and the delays of covariates held; null
    /// where the readings leave it open.
    pub size_interval: Option<[f64; 2]>,
    /// By which factor the velocity is higher since it happened in the ground than it would be without it, in the mean (of its ln) over the fitted
    /// readings since: the law's state answers as well. Null where the law without it fails within the record.
    pub velocity_factor: Option<f64>,
    /// The unit of `size`, and of `gain_per_sd` of what acts in the reading; null for a pure number.
    pub unit: Option<String>,
    /// The groups into which the benchmarks parted.
    pub groups: Option<Vec<Vec<BenchmarkId>>>,
    /// Fall of the BIC when it was added to what stood before.
    pub bic_gain: f64,
    /// rms of its own contribution over the readings, in the readings' unit.
    pub contribution_rms: Option<f64>,
}

impl Explanation {
    /// The verdict, and what stands beside it.
    pub fn effects(&self) -> impl Iterator<Item = &Effect> + Clone {
        [&self.verdict].into_iter().chain(&self.also)
    }
}

impl Effect {
    /// An effect of that kind of which nothing more is known yet.
    pub fn of(kind: Kind) -> Self {
        Self {
            effect: kind,
            channel: None,
            form: None,
            p_value: None,
            lag_days: None,
            memory_days: None,
            gain_per_sd: None,
            velocity_factor_per_sd: None,
            gain_interval: None,
            period_days: None,
            at: None,
            at_interval: None,
            size: None,
            size_interval: None,
            velocity_factor: None,
            unit: None,
            groups: None,
            bic_gain: 0.0,
            contribution_rms: None,
        }
    }
}

/// An effect that people declare to be there, put into the law with all others that they declare, and judged.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct DeclaredEffect {
    /// As it was declared: `KIND[:CHANNEL][@TIME]`.
    pub declared: String,
    /// As it was fitted; null where it cannot be put into the law of this record.
    pub effect: Option<Effect>,
    /// Ratio of the root mean square errors over the held-out readings: with it, over that of the law with all others that were declared. Below 1 it
    /// predicts them better. Null where that is not asked of it.
    pub held_out: Option<f64>,
    /// Why it does not stand; null where it does.
    pub rejected_because: Option<String>,
}

/// How much of the structure is accounted for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Explained {
    /// The residual after it cannot be distinguished from noise.
    Full,
    /// Structure is left, or another channel would do as well.
    Partly,
    /// No effect was accepted.
    None,
}

/// A fault of the data.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Fault {
    /// Its kind.
    pub kind: FaultKind,
    /// The covariate; null where it is the benchmark's own readings.
    pub channel: Option<String>,
    /// Where it begins.
    pub at: Timestamp,
    /// Where it ends, where it is no instant.
    pub until: Option<Timestamp>,
    /// The value, in `unit`; of a reset what has to be added to all that follows, of a change of the unit how many times as large the values
    /// are from there on.
    pub size: Option<f64>,
    /// The unit of `size`.
    pub unit: Option<String>,
    /// How many values it touches.
    pub values: usize,
    /// Where the values were copied from.
    pub copy_of: Option<Timestamp>,
}

/// A figure of the plain law and of the law under the known load.
#[derive(Debug, Clone, Copy, PartialEq, Default, JsonSchema, Serialize)]
pub struct Change<T = Option<f64>> {
    /// Under the law with a constant load.
    pub before: T,
    /// With the effects.
    pub after: T,
}

/// Root mean square errors.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct ErrorChange {
    /// The readings' unit.
    pub unit: Unit,
    /// Over all readings.
    pub fit: Change,
    /// Over a later block that the fit did not see: extrapolated over all of it.
    pub held_out: Change,
    /// Over the same block, each reading predicted from those before it: the effects as they were learned before the block, the
    /// law fitted to all readings with them and without.
    pub held_out_step: Change,
    /// The first reading of that block.
    pub held_out_from: Option<Timestamp>,
    /// Why the held-out figure means little, where it does.
    pub caveat: Option<String>,
}

impl ErrorChange {
    /// Nothing is known yet.
    pub(super) fn none(unit: Unit) -> Self {
        Self {
            unit,
            fit: Change::default(),
            held_out: Change::default(),
            held_out_step: Change::default(),
            held_out_from: None,
            caveat: None,
        }
    }
}

/// What the effects change in the regime and in the time of failure.
#[derive(Debug, Clone, PartialEq, Default, JsonSchema, Serialize)]
pub struct ForecastChange {
    /// Probability of m > 1, the load free; null with too few readings.
    pub probability_unstable: Change,
    /// Chance of passing the critical velocity within the horizon.
    pub probability_of_failure: Change,
    /// Median of the time of passage, unconditional.
    pub failure_time: Change<Option<Timestamp>>,
}

/// One thing tried.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Candidate {
    /// Its kind.
    pub effect: Kind,
    /// The covariate.
    pub channel: Option<String>,
    /// Level or rate.
    pub form: Option<Form>,
    /// When, for what has a time.
    pub at: Option<Timestamp>,
    /// Mean of the response, days.
    pub lag_days: Option<f64>,
    /// Fall of the BIC, against what stood when it was tried.
    pub bic_gain: f64,
    /// As in [`Effect`]; null where it was not reached.
    pub p_value: Option<f64>,
    /// Ratio of the root mean square errors over the held-out readings: with it over that without. Below 1 it predicts them better. Null where it was
    /// not reached or says nothing.
    pub held_out: Option<f64>,
    /// Why not; null for what was accepted.
    pub rejected_because: Option<String>,
}

/// Whether the residual can be distinguished from noise.
#[derive(Debug, Clone, PartialEq, Default, JsonSchema, Serialize)]
pub struct ResidualTests {
    /// p-value of the runs test of the innovations.
    pub runs: Change,
    /// p-value of the Stoffer-Toloi test (Ljung-Box that knows gaps).
    pub stoffer_toloi: Change,
    /// Fall of the BIC that an undeclared random load still brings.
    pub undeclared_load_bic_gain: Change,
    /// Standard deviation of that load, e-folds of velocity.
    pub undeclared_load_sd: Change,
    /// Where what is left stands out most.
    pub structure: Vec<Structure>,
}

/// A stretch in which the undeclared load stands clear of its error.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Structure {
    /// From when.
    pub from: Timestamp,
    /// To when.
    pub until: Timestamp,
    /// Its most extreme log-load there, e-folds: ln of the factor by which it multiplies the velocity.
    pub log_load: f64,
    /// The same in standard errors of it.
    pub z: f64,
}

/// The noise model.
#[derive(Debug, Clone, PartialEq, Default, JsonSchema, Serialize)]
pub struct NoiseReport {
    /// White noise of a reading, in its unit (for velocities read with a relative error, of the typical one).
    pub white: f64,
    /// Correlated noise of a reading, in its unit.
    pub correlated: f64,
    /// Its memory, days.
    pub memory_days: Option<f64>,
}

/// What makes a run repeatable.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct SettingsReport {
    /// Of slipwatch.
    pub version: String,
    /// Of the generators.
    pub seed: u64,
    /// Surrogates behind the p-values.
    pub surrogates: usize,
    /// Fall of the BIC that is asked for.
    pub bic_margin: f64,
    /// FNV-1a of the readings and channels.
    pub data_hash: String,
}

/// The series behind the figures, all at `times`, in the readings' unit where nothing else is said.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curves {
    /// When the readings were taken.
    pub times: Vec<Timestamp>,
    /// The readings, faults taken out.
    pub readings: Vec<f64>,
    /// The plain law.
    pub before: Vec<f64>,
    /// The law under the known load.
    pub after: Vec<f64>,
    /// The plain law fitted without the held-out block, over all times.
    pub before_held_out: Vec<f64>,
    /// The law under the known load fitted without it.
    pub after_held_out: Vec<f64>,
    /// Posterior mean and standard deviation of the undeclared log-load before.
    pub load_before: Vec<(f64, f64)>,
    /// The same after.
    pub load_after: Vec<(f64, f64)>,
    /// Autocorrelation of the innovations, by lag 0, 1, ... of the median spacing.
    pub autocorrelation: Change<Vec<f64>>,
    /// Days of one lag.
    pub lag_days: f64,
    /// What each effect, by its title, adds to the prediction.
    pub contributions: BTreeMap<String, Vec<f64>>,
    /// What each effect adds to the log-load, where it acts there.
    pub log_loads: BTreeMap<String, Vec<f64>>,
}

impl Curves {
    /// The readings less the law under the known load.
    pub(super) fn residual(&self) -> Vec<f64> {
        let both = self.readings.iter().zip(&self.after);
        both.map(|(reading, after)| reading - after).collect()
    }
}
