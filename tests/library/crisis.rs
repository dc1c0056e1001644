//! Drives the monitor over one recorded benchmark and keeps what it said.

use slipwatch::alert::{Level, Policy};
use slipwatch::monitor::{AlertState, Event, EventKind, Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Series, Timestamp, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::Path;

/// One benchmark's crisis as the monitor lived it.
pub(crate) struct Crisis {
    pub(crate) events: Vec<Event>,
}

/// One refit, as far as the claims need it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Refit {
    pub(crate) time: Timestamp,
    pub(crate) median: Option<Timestamp>,
    pub(crate) intercept: Option<Timestamp>,
    pub(crate) stable_accelerating: f64,
    #[allow(dead_code, reason = "shown where a claim about a refit fails")]
    pub(crate) red_chance: f64,
    pub(crate) chance_within_outlook: f64,
}

/// All series of a file, each velocity the mean of `averaging` where given.
pub(crate) fn series(path: &Path, averaging: Option<jiff::SignedDuration>) -> Vec<Series> {
    let options = ReadOptions {
        averaging,
        ..ReadOptions::default()
    };
    read_files(&[path.to_path_buf()], &options)
        .unwrap()
        .0
        .series
}

/// A file of the project's own recordings.
pub(crate) fn recording(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("recordings")
        .join(name)
}

/// The default policy with another evacuation time.
pub(crate) fn policy(evacuation_hours: i64) -> Policy {
    Policy {
        evacuation_time: jiff::SignedDuration::from_hours(evacuation_hours),
        ..Policy::default()
    }
}

impl Crisis {
    /// Plays one series, and lets the deadlines between its readings pass.
    pub(crate) fn play(series: &Series, policy: &Policy) -> Self {
        let mut monitor = Monitor::new(Settings {
            policy: policy.clone(),
            ..Settings::default()
        });
        let mut events = Vec::new();
        for reading in &series.readings {
            while let Some(due) = monitor.next_deadline().filter(|due| *due <= reading.time) {
                events.extend(monitor.step(due, &Input::Tick));
            }
            let input = Input::Reading {
                benchmark: series.benchmark.clone(),
                unit: series.unit,
                averaging: series.averaging,
                reading: *reading,
            };
            events.extend(monitor.step(reading.time, &input));
        }
        Self { events }
    }

    /// Plays the benchmark `id` of a recording.
    pub(crate) fn of(file: &Path, id: &str, policy: &Policy) -> Self {
        let all = series(file, None);
        let wanted = BenchmarkId::new(id);
        let series = all.iter().find(|s| s.benchmark == wanted).unwrap();
        Self::play(series, policy)
    }

    pub(crate) fn refits(&self) -> Vec<Refit> {
        let refit = |event: &Event| {
            let EventKind::Refit {
                regime,
                failure_time,
                inverse_velocity,
                chance_within_evacuation_time,
                chance_within_outlook,
                ..
            } = &event.kind
            else {
                return None;
            };
            let stable = slipwatch::regime::Regime::StableAccelerating;
            Some(Refit {
                time: event.time,
                median: failure_time.median,
                intercept: inverse_velocity.failure_time,
                stable_accelerating: regime.probabilities[&stable],
                red_chance: *chance_within_evacuation_time,
                chance_within_outlook: *chance_within_outlook,
            })
        };
        self.events.iter().filter_map(refit).collect()
    }

    /// When a level was entered and left, in order.
    pub(crate) fn levels(&self) -> Vec<(Timestamp, Level, AlertState)> {
        let alert = |event: &Event| {
            let EventKind::Alert { level, state, .. } = &event.kind else {
                return None;
            };
            Some((event.time, *level, *state))
        };
        self.events.iter().filter_map(alert).collect()
    }

    /// When a level at least this severe was first entered.
    pub(crate) fn first(&self, level: Level) -> Option<Timestamp> {
        let entered = |(_, l, state): &(Timestamp, Level, AlertState)| {
            *l >= level && *l != Level::Unknown && *state == AlertState::Firing
        };
        self.levels()
            .into_iter()
            .find(entered)
            .map(|(time, ..)| time)
    }

    /// The level in force at the end.
    pub(crate) fn last_level(&self) -> Level {
        let mut level = Level::Green;
        for (_, changed, state) in self.levels() {
            match (changed, state) {
                (Level::Unknown, _) => {}
                (entered, AlertState::Firing) => level = entered,
                (_, AlertState::Resolved) => level = Level::Green,
            }
        }
        level
    }
}

/// Days from `time` to `event`.
pub(crate) fn days_before(event: Timestamp, time: Timestamp) -> f64 {
    days_since(time, event)
}
