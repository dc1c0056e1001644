//! What a site relies on from the monitor, on slopes made by the law itself (with seeded noise).

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    clippy::cast_precision_loss,
    reason = "a helper that fails is a test that fails; a test looks for the kinds it names"
)]

use jiff::{SignedDuration, ToSpan};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::alert::{Combination, Condition, DeclaredRule, Level, Policy, Threshold};
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::monitor::{AlertState, Event, EventKind, Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Timestamp, Unit};

fn start() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

/// Daily displacements of a law, mm, with uniform noise of half a millimetre.
fn displacements(law: &Law, days: i64) -> Vec<(Timestamp, f64)> {
    let mut generator = Pcg64::seed_from_u64(7);
    let motion = Trajectory::solve(law, days as f64, Accuracy::Full);
    let one = |day: i64| {
        let slip = motion.at(day as f64)?.displacement;
        Some((
            start() + (24 * day).hours(),
            slip + generator.random::<f64>() - 0.5,
        ))
    };
    (0..days).map_while(one).collect()
}

fn input(time: Timestamp, value: f64, unit: Unit) -> Input {
    let reading = Reading {
        time,
        value,
        sigma: None,
    };
    Input::Reading {
        benchmark: BenchmarkId::new("a"),
        unit,
        averaging: None,
        reading,
    }
}

fn monitor(policy: Policy) -> Monitor {
    Monitor::new(Settings {
        policy,
        ..Settings::default()
    })
}

fn play(monitor: &mut Monitor, readings: &[(Timestamp, f64)]) -> Vec<Event> {
    let step =
        |(time, value): &(Timestamp, f64)| monitor.step(*time, &input(*time, *value, Unit::MM));
    readings.iter().flat_map(step).collect()
}

fn levels(events: &[Event]) -> Vec<(Level, AlertState)> {
    let one = |event: &Event| match &event.kind {
        EventKind::Alert { level, state, .. } => Some((*level, *state)),
        _ => None,
    };
    events.iter().filter_map(one).collect()
}

/// m = 1.3, fails after some 49 days.
fn failing() -> Law {
    Law::from_paper(1.3, 0.3, 125.0, 1.5).unwrap()
}

#[test]
fn a_failing_slope_is_red_before_it_fails_and_stays_so() {
    let law = failing();
    let failure = Trajectory::solve(&law, 1.0, Accuracy::Full)
        .failure_days()
        .unwrap();
    assert!((40.0..90.0).contains(&failure), "{failure}");
    let mut monitor = monitor(Policy {
        evacuation_time: SignedDuration::from_hours(72),
        ..Policy::default()
    });
    let events = play(&mut monitor, &displacements(&law, 200));
    let firing: Vec<Level> = levels(&events)
        .into_iter()
        .map(|(level, _)| level)
        .collect();
    // Red may come first: it looks ahead until the next reading is due.
    assert_eq!(firing.last(), Some(&Level::Red), "{firing:?}");
}

#[test]
fn a_slope_that_saturates_under_the_critical_velocity_is_never_red() {
    // m = 0.8, from 2 mm/day to a steady 30 mm/day.
    let law = Law::from_paper(0.8, 30.0, 2.0, 30.0).unwrap();
    let readings = displacements(&law, 250);
    assert_eq!(readings.len(), 250);
    let events = play(&mut monitor(Policy::default()), &readings);
    assert!(
        !levels(&events)
            .iter()
            .any(|(level, _)| *level == Level::Red),
        "{:?}",
        levels(&events)
    );
}

#[test]
fn a_sensor_that_dies_while_accelerating_leaves_its_level_latched() {
    let mut monitor = monitor(Policy {
        evacuation_time: SignedDuration::from_hours(72),
        ..Policy::default()
    });
    let readings = displacements(&failing(), 200);
    play(&mut monitor, &readings);
    assert_eq!(monitor.level(&BenchmarkId::new("a")), Some(Level::Red));
    let due = monitor.next_deadline().unwrap();
    assert!(due > readings.last().unwrap().0);
    let events = monitor.step(due, &Input::Tick);
    assert_eq!(
        levels(&events),
        [(Level::Unknown, AlertState::Firing)],
        "beside red, not instead of it"
    );
    assert!(matches!(&events[0].kind, EventKind::Fault { kind, .. } if kind == "no-data"));
    assert_eq!(monitor.level(&BenchmarkId::new("a")), Some(Level::Red));
    assert_eq!(monitor.next_deadline(), None, "said once");
}

fn missing(time: Timestamp) -> Input {
    Input::Missing {
        benchmark: BenchmarkId::new("a"),
        time,
        what: "NAN".to_owned(),
    }
}

fn faults(events: &[Event]) -> Vec<&str> {
    let names = events.iter().filter_map(|event| match &event.kind {
        EventKind::Fault { kind, .. } => Some(kind.as_str()),
        _ => None,
    });
    names.collect()
}

#[test]
fn a_sensor_that_gives_nan_is_a_fault_reported_once_a_run_and_becomes_unknown_like_silence() {
    let mut monitor = monitor(Policy::default());
    let day = |day: i64| start() + (24 * day).hours();
    let readings: Vec<(Timestamp, f64)> = (0..20).map(|one| (day(one), one as f64)).collect();
    play(&mut monitor, &readings);
    let due = monitor.next_deadline().unwrap();
    let mut events = Vec::new();
    for one in 20..23 {
        events.extend(monitor.step(day(one), &missing(day(one))));
    }
    assert_eq!(faults(&events), ["sensor-fault"]);
    assert_eq!(monitor.next_deadline(), Some(due), "a fault is no reading");
    let silent = monitor.step(due, &Input::Tick);
    assert_eq!(levels(&silent), [(Level::Unknown, AlertState::Firing)]);
    assert!(matches!(&silent[0].kind, EventKind::Fault { text, .. } if text.contains("gives NAN")));
    // What was read again is over; a reading ends the run, and the next one is reported anew.
    assert!(monitor.step(due, &missing(day(3))).is_empty());
    let back = monitor.step(day(30), &input(day(30), 30.0, Unit::MM));
    assert_eq!(levels(&back), [(Level::Unknown, AlertState::Resolved)]);
    assert!(monitor.step(day(30), &missing(day(29))).is_empty());
    let again = monitor.step(day(31), &missing(day(31)));
    assert_eq!(faults(&again), ["sensor-fault"]);
}

#[test]
fn a_sensor_that_never_gave_a_reading_is_a_fault_too() {
    let mut monitor = monitor(Policy::default());
    let events = monitor.step(start(), &missing(start()));
    assert_eq!(faults(&events), ["sensor-fault"]);
}

#[test]
fn every_silence_has_a_key_of_its_own() {
    let mut monitor = monitor(Policy::default());
    let mut keys = Vec::new();
    for first in [0, 100] {
        let readings: Vec<(Timestamp, f64)> = (first..first + 20)
            .map(|day: i64| (start() + (24 * day).hours(), day as f64))
            .collect();
        let mut events = play(&mut monitor, &readings);
        let due = monitor.next_deadline().unwrap();
        events.extend(monitor.step(due, &Input::Tick));
        for event in events {
            if let EventKind::Alert {
                level: Level::Unknown,
                state: AlertState::Firing,
                key,
                ..
            } = event.kind
            {
                keys.push(key);
            }
        }
    }
    assert_eq!(keys.len(), 2);
    assert_ne!(keys[0], keys[1]);
}

#[test]
fn two_monitors_say_the_same_byte_for_byte() {
    let readings = displacements(&failing(), 40);
    let said = || {
        let events = play(&mut monitor(Policy::default()), &readings);
        serde_json::to_string(&events).unwrap()
    };
    let once = said();
    assert!(once.contains("\"refit\""));
    assert_eq!(once, said());
}

#[test]
fn plain_thresholds_act_before_there_is_any_forecast() {
    let threshold = Threshold {
        level: Level::Red,
        velocity_mm_per_day: Some(50.0),
        displacement_mm: None,
        acceleration_mm_per_day2: None,
    };
    let mut monitor = monitor(Policy {
        thresholds: vec![threshold],
        ..Policy::default()
    });
    let readings = [(start(), 0.0), (start() + 24.hours(), 80.0)];
    let events = play(&mut monitor, &readings);
    assert_eq!(levels(&events), [(Level::Red, AlertState::Firing)]);
    assert!(
        !events
            .iter()
            .any(|event| matches!(event.kind, EventKind::Refit { .. }))
    );
}

#[test]
fn readings_twice_out_of_order_or_corrected_do_not_stop_it() {
    let mut monitor = monitor(Policy::default());
    let readings = displacements(&failing(), 30);
    play(&mut monitor, &readings[..20]);
    assert!(
        play(&mut monitor, &readings[19..20]).is_empty(),
        "a repeated reading says nothing"
    );
    let corrected = play(&mut monitor, &[(readings[19].0, 99.0)]);
    assert!(matches!(&corrected[0].kind, EventKind::Fault { kind, .. } if kind == "corrected"));
    let late = play(
        &mut monitor,
        &[(readings[10].0 + 1.hours(), readings[10].1)],
    );
    assert!(matches!(&late[0].kind, EventKind::Fault { kind, .. } if kind == "out-of-order"));
    let after = play(&mut monitor, &readings[20..]);
    assert_eq!(
        after
            .iter()
            .filter(|e| matches!(e.kind, EventKind::Refit { .. }))
            .count(),
        10
    );
}

#[test]
fn the_drift_of_the_intercept_stands_beside_what_the_law_expects() {
    let mut monitor = monitor(Policy::default());
    let events = play(&mut monitor, &displacements(&failing(), 200));
    let drifts: Vec<(f64, Option<f64>)> = events
        .iter()
        .filter_map(|event| match &event.kind {
            EventKind::InterceptDrift {
                drift_days_per_day,
                expected_days_per_day,
                ..
            } => Some((*drift_days_per_day, *expected_days_per_day)),
            _ => None,
        })
        .collect();
    assert!(!drifts.is_empty());
    assert!(
        drifts.iter().any(|(_, expected)| expected.is_some()),
        "{drifts:?}"
    );
}

#[test]
fn a_slope_that_moves_backwards_is_no_quiet_slope() {
    let readings: Vec<(Timestamp, f64)> = displacements(&failing(), 200)
        .into_iter()
        .map(|(time, value)| (time, -value))
        .collect();
    let events = play(&mut monitor(Policy::default()), &readings);
    let fault = |event: &&Event| matches!(&event.kind, EventKind::Fault { kind, .. } if kind == "moves-backwards");
    assert_eq!(events.iter().filter(fault).count(), 1);
    assert!(levels(&events).contains(&(Level::Yellow, AlertState::Firing)));
}

#[test]
fn a_still_or_stuck_sensor_is_named_and_raises_no_level() {
    let readings: Vec<(Timestamp, f64)> = (0..200)
        .map(|hour: i64| (start() + hour.hours(), 5.0))
        .collect();
    let events = play(&mut monitor(Policy::default()), &readings);
    assert!(levels(&events).is_empty(), "{:?}", levels(&events));
    let stuck =
        |event: &&Event| matches!(&event.kind, EventKind::Fault { kind, .. } if kind == "stuck");
    assert_eq!(events.iter().filter(stuck).count(), 1);
}

#[test]
fn readings_by_the_second_on_a_still_slope_raise_no_red() {
    let mut generator = Pcg64::seed_from_u64(3);
    let readings: Vec<(Timestamp, f64)> = (0..400)
        .map(|second: i64| (start() + second.seconds(), generator.random::<f64>()))
        .collect();
    let events = play(&mut monitor(Policy::default()), &readings);
    assert!(levels(&events).is_empty(), "{:?}", levels(&events));
}

#[test]
fn a_value_beyond_any_slope_is_refused_by_name() {
    let mut monitor = monitor(Policy::default());
    let mut readings = displacements(&failing(), 30);
    readings[20].1 = 1e308;
    let events = play(&mut monitor, &readings);
    assert!(
        events
            .iter()
            .any(|e| matches!(&e.kind, EventKind::Fault { kind, .. } if kind == "out-of-range"))
    );
    assert_eq!(
        events
            .iter()
            .filter(|e| matches!(e.kind, EventKind::Refit { .. }))
            .count(),
        20
    );
}

#[test]
fn a_rule_of_the_site_fires_when_its_conditions_have_held_for_as_long_as_it_asks_and_says_its_figures()
 {
    let hours = SignedDuration::from_hours;
    let rule = DeclaredRule {
        name: "fast".to_owned(),
        level: Level::Red,
        combination: Combination::All,
        conditions: vec![
            Condition::Velocity(50.0),
            Condition::Displacement(100.0),
            Condition::Chance {
                at_least: 1e-9,
                within: hours(12),
            },
        ],
        lasting: hours(3),
    };
    let mut monitor = monitor(Policy {
        red_chance: 1.0,
        rules: vec![rule],
        ..Policy::default()
    });
    // 24 mm/day for four days, then 96.
    let value = |hour: i64| hour as f64 + 3.0 * (hour - 96).max(0) as f64;
    let readings: Vec<(Timestamp, f64)> = (0..120)
        .map(|hour| (start() + hour.hours(), value(hour)))
        .collect();
    let events = play(&mut monitor, &readings);
    let reds: Vec<(Timestamp, &String, &String)> = (events.iter())
        .filter_map(|event| match &event.kind {
            EventKind::Alert {
                level: Level::Red,
                rule,
                text,
                ..
            } => Some((event.time, rule, text)),
            _ => None,
        })
        .collect();
    let [(time, rule, text)] = reds[..] else {
        panic!("{reds:?}");
    };
    assert_eq!(rule, "rule:fast");
    // The displacement is reached at the 97th hour.
    let since_change = time.duration_since(start() + 97.hours());
    assert!(
        since_change >= hours(3) && since_change <= hours(6),
        "{since_change:?}"
    );
    for part in [
        "red; velocity of 50 mm/day or more (",
        " mm/day) and displacement since the first reading of 100 mm or more (1",
        " mm) and chance of collapse of 0.000000001 or more within 12h and until the next reading (",
        ", for 3h; chance of collapse ",
        "; rule rule:fast",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_suspicion_of_another_scale_is_raised_once_where_readings_hover_about_its_bounds_and_ends_once_they_have_moved()
 {
    let value = |hour: i64| {
        let t = hour as f64;
        let hovers = 0.0099 * t.min(700.0) + 0.05 * (t / 7.0).sin();
        ((hovers + 0.05 * (t - 700.0).max(0.0)) * 1e3).round() / 1e3
    };
    let readings: Vec<(Timestamp, f64)> = (0..900)
        .map(|hour| (start() + hour.hours(), value(hour)))
        .collect();
    let said = |holds_scale: bool| {
        let mut monitor = Monitor::new(Settings {
            holds_scale,
            ..Settings::default()
        });
        let mut said = Vec::new();
        for (hour, reading) in (0..).zip(&readings) {
            for event in play(&mut monitor, &[*reading]) {
                if let EventKind::Fault { kind, .. } = &event.kind
                    && kind.starts_with("suspect-scale")
                {
                    said.push((hour, kind.clone()));
                }
            }
        }
        said
    };
    let held = said(true);
    assert_eq!(held.len(), 2, "{held:?}");
    // They have moved by 2 mm after 200 hours, several readings on either side.
    assert!(
        held[0].0 < 100 && (190..240).contains(&held[1].0),
        "{held:?}"
    );
    // A state of an earlier version is gone through again as it was.
    let before = said(false);
    assert!(before.len() > 4, "{before:?}");
}
