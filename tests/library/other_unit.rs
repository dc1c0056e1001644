//! A logger that writes another unit from some reading on, under the same header.

#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "a test looks for the kinds it names"
)]

use jiff::ToSpan;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::monitor::{AlertState, Event, EventKind, Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Suspicion, Timestamp, Unit};

fn at(hour: i64) -> Timestamp {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    start + hour.hours()
}

/// Readings of `motion`, mm, with noise of a tenth of a millimetre, one an hour; those from `since` on as `written`.
fn readings(
    hours: i64,
    motion: impl Fn(f64) -> f64,
    since: i64,
    written: impl Fn(f64) -> f64,
) -> Vec<(Timestamp, f64)> {
    let mut generator = Pcg64::seed_from_u64(7);
    let mut noise = || (0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0;
    let value = |hour: i64| {
        let read = motion(hour as f64) + 0.1 * noise();
        let read = if hour < since { read } else { written(read) };
        (at(hour), (read * 1e5).round() / 1e5)
    };
    (0..hours).map(value).collect()
}

fn creep(hour: f64) -> f64 {
    0.05 * hour
}

fn in_metres(value: f64) -> f64 {
    value / 1000.0
}

fn play(monitor: &mut Monitor, readings: &[(Timestamp, f64)]) -> Vec<Event> {
    let mut events = Vec::new();
    for (time, value) in readings {
        let input = Input::Reading {
            benchmark: BenchmarkId::new("a"),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time: *time,
                value: *value,
                sigma: None,
            },
        };
        events.extend(monitor.step(*time, &input));
    }
    events
}

/// When faults of this kind were reported.
fn faults(events: &[Event], of: &str) -> Vec<Timestamp> {
    let is_one =
        |event: &&Event| matches!(&event.kind, EventKind::Fault { kind, .. } if kind == of);
    events
        .iter()
        .filter(is_one)
        .map(|event| event.time)
        .collect()
}

/// Whether nothing can be said of the benchmark after these events.
fn is_unknown(events: &[Event]) -> bool {
    let mut states = events.iter().filter_map(|event| match &event.kind {
        EventKind::Alert {
            level: Level::Unknown,
            state,
            ..
        } => Some(*state),
        _ => None,
    });
    states.next_back() == Some(AlertState::Firing)
}

#[test]
fn readings_in_another_unit_are_unknown_while_they_come_and_no_reset() {
    let all = readings(1000, creep, 480, in_metres);
    let mut monitor = Monitor::new(Settings::default());
    let events = play(&mut monitor, &all);
    assert_eq!(faults(&events, "suspect-scale"), [at(480)]);
    for other in [
        "suspect-scale-ends",
        "suspect-fall",
        "reset-found",
        "spoilt-readings",
        "stuck-sensor",
    ] {
        assert!(faults(&events, other).is_empty(), "{other}");
    }
    assert!(is_unknown(&events));
    // A state that is kept meanwhile goes on the same, and ends it where the former unit is back.
    let mut before = Monitor::new(Settings::default());
    let mut parts = play(&mut before, &all[..700]);
    let mut after = Monitor::restore(&before.save().unwrap()).unwrap();
    parts.extend(play(&mut after, &all[700..]));
    assert_eq!(events, parts);
    let back: Vec<(Timestamp, f64)> = readings(1030, creep, 0, |value| value).split_off(1000);
    let ended = play(&mut after, &back);
    assert_eq!(faults(&ended, "suspect-scale-ends"), [at(1003)]);
    let level = after.level(&BenchmarkId::new("a"));
    assert!(level < Some(Level::Orange), "{level:?}");
}

#[test]
fn a_red_stays_in_force_while_its_readings_are_in_another_unit() {
    let failing = |hour: f64| 200.0 * (120.0 / (120.0 - hour.min(112.0))).ln();
    let mut monitor = Monitor::new(Settings::default());
    play(&mut monitor, &readings(400, failing, 112, in_metres));
    let level = monitor.level(&BenchmarkId::new("a"));
    assert_eq!(level, Some(Level::Red));
}

#[test]
fn a_reset_to_near_zero_is_one_and_so_is_what_people_accept() {
    let (near_zero, metres) = (|value: f64| value - 24.02, in_metres);
    let mut monitor = Monitor::new(Settings::default());
    let events = play(&mut monitor, &readings(600, creep, 480, near_zero));
    assert_eq!(faults(&events, "reset-found"), [at(483)]);
    assert!(faults(&events, "suspect-scale").is_empty());
    let mut settings = Settings::default();
    let scale = [Suspicion::Scale].into();
    settings.accepted.insert(BenchmarkId::new("a"), scale);
    let events = play(
        &mut Monitor::new(settings),
        &readings(600, creep, 480, metres),
    );
    assert_eq!(faults(&events, "reset-found"), [at(483)]);
}
