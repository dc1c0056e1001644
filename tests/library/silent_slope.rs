//! A slope whose readings end is judged again as time passes.

use crate::crisis::policy;
use slipwatch::alert::Level;
use slipwatch::monitor::{AlertState, EventKind, Input, Monitor, Notice, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Timestamp, Unit, after_days, days_since};

/// Six-hourly displacements until `last` days, then none until `end` days; when each level was entered, days.
fn levels(mm: impl Fn(f64) -> f64, last: f64, end: f64) -> Vec<(f64, Level, String)> {
    levels_with_late_ones(mm, (last, last), end, f64::INFINITY)
}

/// The same where those after `last` until `read` days are read, and wait for earlier ones to the end; and where from `late_from` days on one more reading comes three hours late after each, in a batch with it.
fn levels_with_late_ones(
    mm: impl Fn(f64) -> f64,
    (last, read): (f64, f64),
    end: f64,
    late_from: f64,
) -> Vec<(f64, Level, String)> {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let mut monitor = Monitor::new(Settings {
        policy: policy(24),
        ..Settings::default()
    });
    let mut events = Vec::new();
    let mut at = 0.0;
    let reading = |at: f64| Input::Reading {
        benchmark: BenchmarkId::new("P"),
        unit: Unit::MM,
        averaging: None,
        reading: Reading {
            time: after_days(start, at).unwrap(),
            // Whole tenths of mm, as an instrument gives them.
            value: (mm(at) * 10.0).round() / 10.0,
            sigma: None,
        },
    };
    while at <= last {
        let time = after_days(start, at).unwrap();
        events.extend(monitor.step(time, &reading(at)));
        if at >= late_from {
            monitor.step(time, &Input::Notice(Notice::InBatches));
            events.extend(monitor.step(time, &reading(at - 0.125)));
            events.extend(monitor.step(time, &Input::Notice(Notice::BatchEnd)));
        }
        at += 0.25;
    }
    let end = after_days(start, end).unwrap();
    while let Some(due) = monitor.next_deadline().filter(|due| *due <= end) {
        let until = days_since(start, due);
        if at <= read.min(until) {
            let waits = Notice::Waits {
                benchmark: BenchmarkId::new("P"),
                time: after_days(start, at).unwrap(),
                until: due,
            };
            events.extend(monitor.step(due, &Input::Notice(waits)));
            at += 0.25;
            continue;
        }
        events.extend(monitor.step(due, &Input::Tick));
        let next = monitor.next_deadline();
        assert!(next.is_none_or(|next| next > due), "{due} does not pass");
    }
    let entered = events.into_iter().filter_map(|event| {
        let EventKind::Alert {
            level, state, text, ..
        } = event.kind
        else {
            return None;
        };
        let is_own = state == AlertState::Firing && event.benchmark.is_some();
        is_own.then(|| (days_since(start, event.time), level, text))
    });
    entered.collect()
}

#[test]
fn a_failing_slope_whose_sensor_is_lost_becomes_red_before_its_collapse_without_a_reading() {
    // A straight line in inverse velocity that meets zero at 80 days; read until 10 days before.
    let failing = |t: f64| -60.0 * (1.0 - t / 80.0).ln();
    let entered = levels(failing, 70.0, 90.0);
    let while_read = |(at, level, _): &&(f64, Level, String)| *at <= 70.0 && *level == Level::Red;
    assert_eq!(entered.iter().find(while_read), None, "red before: no test");
    let red = entered.iter().find(|(_, level, _)| *level == Level::Red);
    let (at, _, text) = red.unwrap_or_else(|| panic!("{entered:?}"));
    assert!((70.0..80.0).contains(at), "{entered:?}");
    assert!(text.contains("no reading since 2020-03-11"), "{text}");
    assert!(entered.iter().any(|(_, level, _)| *level == Level::Unknown));
}

#[test]
fn while_later_readings_wait_for_earlier_ones_no_red_is_called_for_want_of_them() {
    let failing = |t: f64| -60.0 * (1.0 - t / 80.0).ln();
    let red = |read: f64| {
        let entered = levels_with_late_ones(failing, (70.0, read), 90.0, f64::INFINITY);
        let red = entered
            .into_iter()
            .find(|(_, level, _)| *level == Level::Red);
        red.map(|(at, _, text)| (at, text)).unwrap()
    };
    assert!(red(70.0).0 < 76.0);
    let (at, text) = red(76.0);
    assert!(at >= 76.25, "{at} {text}");
    assert!(text.contains("no reading since 2020-03-17"), "{text}");
}

#[test]
fn what_comes_late_keeps_no_benchmark_from_being_judged_when_its_readings_end() {
    let failing = |t: f64| -60.0 * (1.0 - t / 80.0).ln();
    let entered = levels_with_late_ones(failing, (70.0, 70.0), 90.0, 60.0);
    let after = |level: Level| {
        let mut all = entered.iter().filter(|(at, _, _)| *at > 70.0);
        all.any(|(_, entered, _)| *entered == level)
    };
    assert!(after(Level::Red) && after(Level::Unknown), "{entered:?}");
}

#[test]
fn a_slope_that_creeps_becomes_unknown_and_not_red_when_its_sensor_is_lost() {
    let entered = levels(|t| 2.0 * t, 73.0, 400.0);
    let called: Vec<Level> = entered.iter().map(|(_, level, _)| *level).collect();
    assert_eq!(called, [Level::Unknown], "{entered:?}");
}
