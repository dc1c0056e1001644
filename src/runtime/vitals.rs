//! What the daemon knows of its own health; the work loop writes it, whoever asks reads it.

use super::clock::Stopwatch;
use super::drilled::DrillRecord;
use super::locked::locked;
use super::mute::Mute;
use super::recorded::RecordStanding;
use super::service_faults::{ServiceFault, ServiceFaults};
use super::standing::after_alert;
use crate::alert::Level;
use crate::monitor::{AlertState, Event, EventKind, Unexplained};
use crate::reading::{BenchmarkId, Timestamp};
use prometheus_client::metrics::histogram::Histogram;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Benchmarks of which single figures are given; of the others only how many stand at each level.
pub const MOST_SHOWN: usize = 2000;
/// Upper ends of the refit times' bins, seconds.
const REFIT_SECONDS: [f64; 10] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// The site as a whole.
#[derive(Debug, Clone, Default, PartialEq, JsonSchema, Serialize)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a key of its own in the answer"
)]
pub struct Health {
    /// Whether the past has been read.
    pub is_caught_up: bool,
    /// Whether the last write to the state folder went well.
    pub is_store_writable: bool,
    /// Whether the rows of the state are what was written, as far as they have been looked at.
    pub is_store_damaged: bool,
    /// Whether nothing more is taken in: what came waits for room on the disk, or for the host's clock.
    pub is_paused: bool,
    /// Values that the monitor took.
    pub readings: u64,
    /// Values dropped because they had been taken before.
    pub repeated: u64,
    /// Values dropped because they are from the future.
    pub from_the_future: u64,
    /// Values dropped because no clock that is set gives their time.
    pub without_clock: u64,
    /// Inputs that wait, unacknowledged, for room on the disk.
    pub unwritten: u64,
    /// Whether the host's clock is earlier than readings that are known, or has leapt ahead.
    pub is_clock_wrong: bool,
    /// Values that wait, unacknowledged, until the host's clock is right.
    pub held: u64,
    /// Lines of the log that could not be written.
    pub log_lines_lost: u64,
    /// Alerts that people asked not to be notified of.
    pub silences: Vec<Mute>,
    /// Lines, records and files that could not be used, a source.
    pub quarantined: BTreeMap<String, u64>,
    /// How long the oldest value that was found and is not durable yet has waited; zero when none waits.
    pub lag_seconds: f64,
    /// Batches of values between the sources and the work loop.
    pub queue: usize,
    /// Alerts that a hook has not taken yet.
    pub outbox: usize,
    /// When the oldest of them was called, data time.
    pub outbox_oldest: Option<Timestamp>,
    /// Deliveries closed because the config has no such hook any more.
    pub outbox_closed: usize,
    /// Searches for an effect that are at work.
    pub searches: usize,
    /// Heartbeats that were taken, and that were not, since the start.
    pub heartbeats: u64,
    /// See [`Health::heartbeats`].
    pub heartbeats_failed: u64,
    /// How drills stand; `None` where none are held.
    pub drill: Option<DrillRecord>,
    /// Size of the database, bytes.
    pub database_bytes: Option<u64>,
    /// How the record stands; `None` where none is kept.
    pub record: Option<RecordStanding>,
    /// Why the config file as it is now was not taken at a reload; `None` where it is in force.
    pub config_refused: Option<String>,
    /// What lasts and keeps it from its work: a broker out of reach, a file that cannot be read; the first of them.
    pub faults: Vec<ServiceFault>,
}

impl Health {
    /// Why the site is not watched as it should be, where it is not.
    pub fn not_ready(&self) -> Option<&'static str> {
        if !self.is_caught_up {
            Some("still reading the past")
        } else if !self.is_store_writable {
            Some("the state folder cannot be written to")
        } else if self.is_paused {
            Some("nothing more is taken in: what came waits for room on the disk, or for the clock")
        } else if self.is_store_damaged {
            Some("the state is damaged: restore a backup")
        } else if self.is_clock_wrong {
            Some(
                "the host's clock and the readings disagree: it is wrong, or the host was suspended",
            )
        } else {
            None
        }
    }
}

/// One benchmark.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct VitalsPoint {
    /// When its newest reading was measured.
    pub newest: Option<Timestamp>,
    /// The level in force.
    pub level: Level,
    /// Whether the monitor cannot decide: beside the level, never instead of it.
    pub is_unknown: bool,
    /// How long the last reading that led to a refit took to be worked in, seconds.
    pub refit_seconds: Option<f64>,
    /// How much less likely the newest reading was than the usual one, ln; zero where it does not stand out.
    pub surprise_nats: f64,
    /// The velocity of the last refit, mm/day.
    pub velocity_mm_per_day: Option<f64>,
}

impl Default for VitalsPoint {
    fn default() -> Self {
        Self {
            newest: None,
            level: Level::Green,
            is_unknown: false,
            refit_seconds: None,
            surprise_nats: 0.0,
            velocity_mm_per_day: None,
        }
    }
}

impl VitalsPoint {
    fn note(&mut self, kind: &EventKind) {
        if let EventKind::Refit {
            velocity_mm_per_day,
            ..
        } = kind
        {
            self.velocity_mm_per_day = *velocity_mm_per_day;
        } else if let EventKind::UnexplainedResidual(Unexplained::Reading {
            surprise_nats, ..
        }) = kind
        {
            self.surprise_nats = *surprise_nats;
        } else if let EventKind::Alert { level, state, .. } = kind {
            self.call(*level, *state);
        }
    }

    fn call(&mut self, level: Level, state: AlertState) {
        (self.level, self.is_unknown) = after_alert((self.level, self.is_unknown), level, state);
    }
}

/// The daemon's own health, shared between the work loop and those who ask.
#[derive(Debug)]
pub struct Vitals {
    since_start: Stopwatch,
    /// When the work loop last turned, milliseconds after the start, by a clock that no one sets.
    last_turn_ms: AtomicU64,
    health: Mutex<Health>,
    /// Runs since the oldest value that is not durable yet was found.
    oldest: Mutex<Option<Stopwatch>>,
    points: Mutex<BTreeMap<BenchmarkId, VitalsPoint>>,
    refits: Histogram,
    faults: ServiceFaults,
}

impl Default for Vitals {
    fn default() -> Self {
        Self {
            since_start: Stopwatch::start(),
            last_turn_ms: AtomicU64::new(0),
            health: Mutex::default(),
            oldest: Mutex::default(),
            points: Mutex::default(),
            refits: Histogram::new(REFIT_SECONDS),
            faults: ServiceFaults::default(),
        }
    }
}

impl Vitals {
    /// The work loop has turned once more.
    pub fn turned(&self) {
        let now = u64::try_from(self.uptime().as_millis()).unwrap_or(u64::MAX);
        self.last_turn_ms.store(now, Ordering::Relaxed);
    }

    /// How long ago the work loop last turned, or the daemon started.
    pub fn since_turn(&self) -> Duration {
        let turned = Duration::from_millis(self.last_turn_ms.load(Ordering::Relaxed));
        self.uptime().saturating_sub(turned)
    }

    /// How long the daemon has been up.
    pub fn uptime(&self) -> Duration {
        self.since_start.elapsed()
    }

    /// The site as a whole.
    pub fn health(&self) -> Health {
        let oldest = *locked(&self.oldest);
        Health {
            lag_seconds: oldest.map_or(0.0, |found| found.elapsed().as_secs_f64()),
            faults: self.faults.shown(),
            ..locked(&self.health).clone()
        }
    }

    /// What lasts and keeps the daemon from its work.
    pub(super) fn faults(&self) -> &ServiceFaults {
        &self.faults
    }

    /// Values found then are being taken; those before them may not be durable yet either.
    pub fn takes(&self, found: Stopwatch) {
        locked(&self.oldest).get_or_insert(found);
    }

    /// All that was taken is durable.
    pub fn note_taken(&self) {
        *locked(&self.oldest) = None;
    }

    /// So many more lines, records and files of a source could not be used.
    pub fn quarantined(&self, source: &str, more: u64) {
        if more > 0 {
            self.update(|health| *health.quarantined.entry(source.to_owned()).or_default() += more);
        }
    }

    /// Changes what is known of the site as a whole.
    pub fn update(&self, change: impl FnOnce(&mut Health)) {
        change(&mut locked(&self.health));
    }

    /// A reading of `benchmark` was worked in within `took` and led to `events`.
    pub fn read(&self, benchmark: &BenchmarkId, time: Timestamp, events: &[Event], took: Duration) {
        let mut points = locked(&self.points);
        let point = points.entry(benchmark.clone()).or_default();
        // A benchmark that the config names is unknown until it has read.
        point.is_unknown &= point.newest.is_some();
        point.newest = point.newest.max(Some(time));
        point.surprise_nats = 0.0;
        let is_refit = |event: &Event| {
            matches!(event.kind, EventKind::Refit { .. })
                && event.benchmark.as_ref() == Some(benchmark)
        };
        if events.iter().any(is_refit) {
            point.refit_seconds = Some(took.as_secs_f64());
            self.refits.observe(took.as_secs_f64());
        }
        note_all(&mut points, events);
    }

    /// What followed for benchmarks whose newest readings were judged together, which took so long.
    pub fn judged(&self, events: &[Event], took: Duration) {
        let is_refit = |event: &&Event| matches!(event.kind, EventKind::Refit { .. });
        let refits = events.iter().filter(is_refit).count();
        for _ in 0..refits {
            self.refits.observe(took.as_secs_f64() / refits as f64);
        }
        self.note(events);
    }

    /// Shows these benchmarks only, of those that are shown.
    pub(super) fn retain(&self, is_shown: impl Fn(&BenchmarkId) -> bool) {
        locked(&self.points).retain(|benchmark, _| is_shown(benchmark));
    }

    /// How a benchmark stood when the daemon last stopped.
    pub fn resume(
        &self,
        benchmark: &BenchmarkId,
        newest: Option<Timestamp>,
        level: Level,
        is_unknown: bool,
    ) {
        let mut points = locked(&self.points);
        let point = points.entry(benchmark.clone()).or_default();
        (point.newest, point.level, point.is_unknown) = (newest, level, is_unknown);
    }

    /// Events that came of something else than a reading.
    pub fn note(&self, events: &[Event]) {
        if !events.is_empty() {
            note_all(&mut locked(&self.points), events);
        }
    }

    /// The first [`MOST_SHOWN`] benchmarks by name.
    pub fn points(&self) -> BTreeMap<BenchmarkId, VitalsPoint> {
        let points = locked(&self.points);
        let shown = points.iter().take(MOST_SHOWN);
        shown
            .map(|(id, point)| (id.clone(), point.clone()))
            .collect()
    }

    /// How many benchmarks stand at each level, all of them; those at `unknown` count there, and at the level beside it where that is above
    /// green.
    pub fn levels(&self) -> [(Level, usize); 5] {
        let points = locked(&self.points);
        [
            Level::Green,
            Level::Yellow,
            Level::Orange,
            Level::Red,
            Level::Unknown,
        ]
        .map(|level| {
            let stands = |point: &&VitalsPoint| match level {
                Level::Unknown => point.is_unknown,
                Level::Green => point.level == level && !point.is_unknown,
                Level::Yellow | Level::Orange | Level::Red => point.level == level,
            };
            (level, points.values().filter(stands).count())
        })
    }

    /// How long readings that led to a refit took.
    pub(super) fn refits(&self) -> &Histogram {
        &self.refits
    }
}

fn note_all(points: &mut BTreeMap<BenchmarkId, VitalsPoint>, events: &[Event]) {
    for event in events {
        if let Some(benchmark) = &event.benchmark {
            points
                .entry(benchmark.clone())
                .or_default()
                .note(&event.kind);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alert(level: Level, state: AlertState) -> Event {
        Event {
            time: Timestamp::UNIX_EPOCH,
            benchmark: Some(BenchmarkId::new("5")),
            kind: EventKind::Alert {
                level,
                state,
                key: String::new(),
                rule: String::new(),
                text: String::new(),
            },
        }
    }

    #[test]
    fn unknown_stands_beside_a_level_and_a_superseded_level_takes_nothing_back() {
        let vitals = Vitals::default();
        let point = || vitals.points()[&BenchmarkId::new("5")].clone();
        vitals.note(&[alert(Level::Orange, AlertState::Firing)]);
        vitals.note(&[alert(Level::Unknown, AlertState::Firing)]);
        assert_eq!((point().level, point().is_unknown), (Level::Orange, true));
        vitals.note(&[
            alert(Level::Red, AlertState::Firing),
            alert(Level::Orange, AlertState::Resolved),
        ]);
        assert_eq!(point().level, Level::Red);
        vitals.note(&[
            alert(Level::Red, AlertState::Resolved),
            alert(Level::Unknown, AlertState::Resolved),
        ]);
        assert_eq!((point().level, point().is_unknown), (Level::Green, false));
    }

    #[test]
    fn a_reading_that_does_not_stand_out_ends_the_surprise_of_the_one_before() {
        let vitals = Vitals::default();
        let five = BenchmarkId::new("5");
        let event = Event {
            time: Timestamp::UNIX_EPOCH,
            benchmark: Some(five.clone()),
            kind: EventKind::UnexplainedResidual(Unexplained::Reading {
                surprise_nats: 9.0,
                velocity_mm_per_day: None,
            }),
        };
        vitals.read(&five, Timestamp::UNIX_EPOCH, &[event], Duration::ZERO);
        assert!((vitals.points()[&five].surprise_nats - 9.0).abs() < 1e-12);
        vitals.read(&five, Timestamp::UNIX_EPOCH, &[], Duration::ZERO);
        assert!(vitals.points()[&five].surprise_nats.abs() < 1e-12);
    }

    #[test]
    fn more_benchmarks_than_are_shown_are_still_counted_by_level() {
        let vitals = Vitals::default();
        for number in 0..MOST_SHOWN + 5 {
            let id = BenchmarkId::new(format!("{number:05}"));
            vitals.read(&id, Timestamp::UNIX_EPOCH, &[], Duration::ZERO);
        }
        assert_eq!(vitals.points().len(), MOST_SHOWN);
        assert_eq!(vitals.levels()[0], (Level::Green, MOST_SHOWN + 5));
    }
}
