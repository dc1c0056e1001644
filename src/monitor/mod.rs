//! The state machine that owns every benchmark: readings in, events out, no clock and no files.

mod event;

pub use event::{
    AlertState, Event, EventKind, FailureTime, InverseVelocity, RegimeReport, Summary,
};

use crate::alert::Policy;
use crate::reading::{BenchmarkId, Reading, Sample, Timestamp, Unit};
use jiff::SignedDuration;
use std::collections::BTreeMap;

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

/// The monitor: pure, deterministic, the same in a live run and in a replay.
#[derive(Debug)]
pub struct Monitor {
    settings: Settings,
    summary: Summary,
    last_time: Option<Timestamp>,
}

impl Monitor {
    /// A monitor that has seen nothing.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            summary: Summary::default(),
            last_time: None,
        }
    }

    /// Takes one input at `now` (data time) and says what follows from it.
    pub fn step(&mut self, now: Timestamp, input: &Input) -> Vec<Event> {
        self.last_time = Some(now);
        let _ = (&self.settings, input);
        Vec::new()
    }

    /// When the monitor wants a [`Input::Tick`] if nothing else comes before.
    pub fn next_deadline(&self) -> Option<Timestamp> {
        None
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
