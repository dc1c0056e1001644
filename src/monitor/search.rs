//! A search for the effect that a benchmark's law lacks: asked for by the monitor, done outside it.
//!
//! The monitor never searches by itself: a step must not take seconds. It hands out a job; whoever runs the
//! monitor runs the job anywhere, and hands the answer in as [`Input::Found`](super::Input::Found)
//! right before the benchmark's first reading that is no earlier than [`SearchJob::due`]. So the answer takes
//! effect at a time that the data alone decide.

use super::undeclared::UndeclaredLoad;
use crate::effects::{Effect, Explained, KnownLoad, Options, Rival, explain};
use crate::reading::{BenchmarkId, Channel, Series, Timestamp};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Readings that a search looks at.
pub(super) const MOST_READINGS: usize = 600;
/// Covariates that it looks at.
pub(super) const MOST_CHANNELS: usize = 8;
/// Surrogates that judge what it finds.
const SURROGATES: usize = 199;
/// Data time that a search is given: live, readings need not wait for it.
const GRACE: SignedDuration = SignedDuration::from_hours(1);

/// A search that is to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SearchJob {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// The answer takes effect at the first reading from here on.
    pub due: Timestamp,
    series: Series,
    channels: Vec<Channel>,
    critical_velocity_mm_per_day: f64,
}

/// What a search came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SearchFinding {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// The effects that were accepted, the verdict first; none where the residual cannot be distinguished from noise or stays
    /// unexplained.
    pub effects: Vec<Effect>,
    /// How much of the structure they account for.
    pub explained: Explained,
    /// What would explain the same.
    pub cannot_separate_from: Vec<Rival>,
    /// The effects as forecasts use them.
    #[serde(rename = "fuller")]
    pub known_load: KnownLoad,
    /// The load that nobody declared, before and after them.
    #[serde(default)]
    pub undeclared_load: Option<Box<UndeclaredLoad>>,
}

impl SearchJob {
    pub(super) fn new(
        series: Series,
        channels: Vec<Channel>,
        asked: Timestamp,
        critical_velocity_mm_per_day: f64,
    ) -> Self {
        Self {
            benchmark: series.benchmark.clone(),
            due: asked.checked_add(GRACE).unwrap_or(asked),
            series,
            channels,
            critical_velocity_mm_per_day,
        }
    }

    /// Makes the search: seconds of work, bounded by count, the same wherever it is done.
    pub fn run(&self) -> SearchFinding {
        let options = Options {
            critical_velocity_mm_per_day: self.critical_velocity_mm_per_day,
            surrogates: SURROGATES,
            ..Options::default()
        };
        let said = explain(&self.series, &self.channels, &[], &options, &mut |_| {});
        let effects = std::iter::once(said.verdict).chain(said.also);
        SearchFinding {
            benchmark: said.benchmark,
            effects: effects.filter(|one| !one.effect.is_an_end()).collect(),
            explained: said.explained,
            cannot_separate_from: said.cannot_separate_from,
            known_load: said.known_load,
            undeclared_load: UndeclaredLoad::of(&said.curves),
        }
    }

    /// The answer of a search that broke off.
    pub fn broken_off(&self) -> SearchFinding {
        SearchFinding {
            benchmark: self.benchmark.clone(),
            effects: Vec::new(),
            explained: Explained::None,
            cannot_separate_from: Vec::new(),
            known_load: KnownLoad::default(),
            undeclared_load: None,
        }
    }
}
