//! The state machine that owns every benchmark: readings in, events out, no clock and no files.

mod drift;
mod event;
mod history;
mod silence;
mod track;

pub use event::{
    AlertState, Event, EventKind, FailureTime, InverseVelocity, RegimeReport, Summary,
};

use crate::alert::{Level, Policy};
use crate::reading::{BenchmarkId, Reading, Sample, Timestamp, Unit};
use jiff::SignedDuration;
use std::collections::BTreeMap;
use track::Track;

/// What the monitor is told.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// A reading of a benchmark.
    Reading {
        /// Whose.
        benchmark: BenchmarkId,
        /// Its unit, which also says the quantity.
        unit: Unit,
        /// For a velocity: the span before its time stamp over which it is the mean.
        averaging: Option<SignedDuration>,
        /// The reading itself.
        reading: Reading,
    },
    /// A value of a covariate.
    Sample {
        /// The channel's full name.
        channel: String,
        /// The value.
        sample: Sample,
    },
    /// Time has passed and nothing came.
    Tick,
}

/// What a monitor needs to know of its site.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// The alert policy.
    pub policy: Policy,
    /// Policies of single benchmarks, where they differ from the site's.
    pub benchmarks: BTreeMap<BenchmarkId, Policy>,
}

impl Settings {
    /// The policy in force for a benchmark.
    pub fn policy(&self, benchmark: &BenchmarkId) -> &Policy {
        self.benchmarks.get(benchmark).unwrap_or(&self.policy)
    }
}

/// The monitor: pure, deterministic, the same in a live run and in a replay.
#[derive(Debug)]
pub struct Monitor {
    settings: Settings,
    tracks: BTreeMap<BenchmarkId, Track>,
    summary: Summary,
    last_time: Option<Timestamp>,
}

impl Monitor {
    /// A monitor that has seen nothing.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            tracks: BTreeMap::new(),
            summary: Summary::default(),
            last_time: None,
        }
    }

    /// Takes one input at `now` (data time, never going back) and says what follows from it.
    pub fn step(&mut self, now: Timestamp, input: &Input) -> Vec<Event> {
        self.last_time = Some(now);
        let events = match input {
            Input::Reading {
                benchmark,
                unit,
                averaging,
                reading,
            } => {
                self.summary.readings += 1;
                let policy = self.settings.policy(benchmark);
                let source = history::Source {
                    unit: *unit,
                    averaging: *averaging,
                };
                let track = self
                    .tracks
                    .entry(benchmark.clone())
                    .or_insert_with(|| Track::new(benchmark.clone(), source, reading.time));
                track.take(policy, source, reading)
            }
            // Covariates are kept for the search of missing effects; no rule looks at them yet.
            Input::Sample { .. } => Vec::new(),
            Input::Tick => self
                .tracks
                .values_mut()
                .flat_map(|track| track.pass(now))
                .collect(),
        };
        for event in &events {
            self.summary.count(&event.kind);
        }
        events
    }

    /// When the monitor wants a [`Input::Tick`] if nothing else comes before.
    pub fn next_deadline(&self) -> Option<Timestamp> {
        self.tracks.values().filter_map(Track::deadline).min()
    }

    /// The level in force for a benchmark that has given readings.
    pub fn level(&self, benchmark: &BenchmarkId) -> Option<Level> {
        self.tracks.get(benchmark).map(Track::level)
    }

    /// The last line of a replay: what was taken in and said so far.
    pub fn summary(&self) -> Option<Event> {
        Some(Event {
            time: self.last_time?,
            benchmark: None,
            kind: EventKind::Summary(self.summary),
        })
    }
}
