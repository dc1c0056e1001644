//! One level for the whole site, from those of its benchmarks.

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    reason = "a helper that fails is a test that fails; a test looks for the kinds it names"
)]

use jiff::{SignedDuration, ToSpan};
use slipwatch::alert::{Level, Policy, Threshold};
use slipwatch::monitor::{
    AlertState, Event, EventKind, Input, Monitor, Notice, Settings, SiteLevel, Watched,
};
use slipwatch::reading::{BEFORE_ALL, BenchmarkId, Reading, Timestamp, Unit};
use std::collections::BTreeSet;

fn start() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

/// The benchmarks are called by their displacement alone: orange from 10 mm on, red from 20 mm on.
fn settings(site: Option<SiteLevel>) -> Settings {
    let threshold = |level, mm| Threshold {
        level,
        velocity_mm_per_day: None,
        displacement_mm: Some(mm),
        acceleration_mm_per_day2: None,
    };
    Settings {
        policy: Policy {
            thresholds: vec![threshold(Level::Orange, 10.0), threshold(Level::Red, 20.0)],
            ..Policy::default()
        },
        site,
        ..Settings::default()
    }
}

fn read(monitor: &mut Monitor, benchmark: &str, hour: i64, value: f64) -> Vec<Event> {
    let time = start() + hour.hours();
    let input = Input::Reading {
        benchmark: BenchmarkId::new(benchmark),
        unit: Unit::MM,
        averaging: None,
        reading: Reading {
            time,
            value,
            sigma: None,
        },
    };
    monitor.step(time, &input)
}

fn of_the_site(events: &[Event]) -> Vec<(Level, AlertState, String)> {
    let one = |event: &Event| match &event.kind {
        EventKind::Alert {
            level, state, key, ..
        } if event.benchmark.is_none() => Some((*level, *state, key.clone())),
        _ => None,
    };
    events.iter().filter_map(one).collect()
}

fn begin(site: Option<SiteLevel>) -> Monitor {
    let mut monitor = Monitor::new(settings(site));
    for id in ["a", "b", "c"] {
        assert!(of_the_site(&read(&mut monitor, id, 0, 0.0)).is_empty());
    }
    monitor
}

#[test]
fn the_worst_benchmark_makes_the_site() {
    let mut monitor = begin(Some(SiteLevel::Worst));
    let said = of_the_site(&read(&mut monitor, "a", 1, 12.0));
    let key = format!("site/orange/{}", start() + 1.hour());
    assert_eq!(said, [(Level::Orange, AlertState::Firing, key)]);
    assert!(of_the_site(&read(&mut monitor, "b", 2, 12.0)).is_empty());
    let said = of_the_site(&read(&mut monitor, "c", 3, 30.0));
    assert_eq!((said[0].0, said[0].1), (Level::Red, AlertState::Firing));
    let EventKind::Summary(summary) = monitor.summary().unwrap().kind else {
        panic!("no summary");
    };
    assert_eq!(summary.alerts, 3, "the site's own are not counted again");
}

#[test]
fn two_of_three_make_the_site_and_one_that_is_removed_no_longer_does() {
    let mut monitor = begin(Some(SiteLevel::AtLeast(2)));
    assert!(of_the_site(&read(&mut monitor, "a", 1, 30.0)).is_empty());
    let said = of_the_site(&read(&mut monitor, "b", 2, 12.0));
    assert_eq!((said[0].0, said[0].1), (Level::Orange, AlertState::Firing));
    let mut restarted = Monitor::restore(&monitor.save().unwrap()).unwrap();
    let watched: BTreeSet<BenchmarkId> = ["a", "c"].map(BenchmarkId::new).into();
    let without = Settings {
        watched: Watched {
            named: watched,
            is_open: false,
            ..Watched::default()
        },
        ..settings(Some(SiteLevel::AtLeast(2)))
    };
    let input = Input::Settings(Box::new(without));
    let reported = monitor.step(start() + 3.hours(), &input);
    let said = of_the_site(&reported);
    assert_eq!(said.len(), 1);
    assert_eq!(
        (said[0].0, said[0].1),
        (Level::Orange, AlertState::Resolved)
    );
    assert_eq!(restarted.step(start() + 3.hours(), &input), reported);
}

#[test]
fn without_a_rule_the_site_has_no_level() {
    let mut monitor = begin(None);
    assert!(of_the_site(&read(&mut monitor, "a", 1, 30.0)).is_empty());
}

#[test]
fn where_fewer_can_be_judged_than_the_rule_asks_for_all_of_those_make_the_site() {
    let red_after = |silent_from: i64| {
        let mut monitor = begin(Some(SiteLevel::AtLeast(3)));
        for hour in 1..100 {
            for id in ["a", "b", "c"] {
                if id != "c" || hour < silent_from {
                    read(&mut monitor, id, hour, 0.0);
                }
            }
            monitor.step(start() + hour.hours(), &Input::Tick);
        }
        let first = of_the_site(&read(&mut monitor, "a", 100, 30.0));
        assert!(first.iter().all(|(level, ..)| *level != Level::Red));
        of_the_site(&read(&mut monitor, "b", 100, 30.0))
            .iter()
            .any(|(level, state, _)| (*level, *state) == (Level::Red, AlertState::Firing))
    };
    assert!(!red_after(100), "the third can be judged and is not red");
    assert!(red_after(30), "of the third nothing can be said any more");
}

#[test]
fn benchmarks_that_have_never_read_are_waited_for_and_then_those_that_read_make_the_site() {
    // b can be judged and is not red, until nothing can be said of it either: after a day without another reading.
    assert_eq!(first_day_of_three(&["a", "b"], 25), (false, Some(25)));
    // Nothing can be said of b and c: at once of the site, and from the end of the wait on a makes its level.
    assert_eq!(first_day_of_three(&["a"], 25), (true, Some(25)));
    // Where there was no data time before, the first reading begins the wait.
    assert_eq!(first_day_of_three(&[], 25), (true, Some(26)));
    assert_eq!(first_day_of_three(&["a"], 0), (true, Some(1)));
}

/// Of a site of three, two of which make its level: whether it is unknown from the start on, and hours after that by the clock when it is red. Those that
/// are `reading` have read before; `a` alone reads on, and is red from an hour after the start on.
fn first_day_of_three(reading: &[&str], wait_hours: i64) -> (bool, Option<i64>) {
    let mut monitor = Monitor::new(Settings {
        watched: Watched {
            named: ["a", "b", "c"].map(BenchmarkId::new).into(),
            is_open: false,
            ..Watched::default()
        },
        first_readings_within: SignedDuration::from_hours(wait_hours),
        ..settings(Some(SiteLevel::AtLeast(2)))
    });
    for id in reading {
        read(&mut monitor, id, 0, 0.0);
    }
    let before = if reading.is_empty() {
        BEFORE_ALL
    } else {
        start()
    };
    let mut said = of_the_site(&monitor.step(before, &Input::Notice(Notice::Watching)));
    let is_unknown = said.iter().any(|(level, ..)| *level == Level::Unknown);
    let mut red_after = None;
    for hour in 1..30 {
        // Data time stays at the first readings of `a`; the clock goes on.
        let reported = if hour <= 2 {
            // Displacement counts from the first reading of all.
            let is_first = hour == 1 && reading.is_empty();
            let value = if is_first { 0.0 } else { 28.0 + hour as f64 };
            read(&mut monitor, "a", hour, value)
        } else {
            let until = start() + hour.hours();
            let silences_alone = false;
            let passed = Notice::Passed {
                until,
                silences_alone,
            };
            monitor.step(start() + 2.hours(), &Input::Notice(passed))
        };
        said.extend(of_the_site(&reported));
        let last = said.iter().rfind(|(level, ..)| *level == Level::Red);
        let is_red = last.is_some_and(|(_, state, _)| *state == AlertState::Firing);
        red_after = red_after.or(is_red.then_some(hour));
        assert_eq!(is_red, red_after.is_some(), "{said:?}");
        if hour == 12 {
            monitor = Monitor::restore(&monitor.save().unwrap()).unwrap();
        }
    }
    (is_unknown, red_after)
}

#[test]
fn a_site_that_one_unknown_benchmark_could_make_red_beside_a_red_one_is_unknown() {
    let unknown_with = |first: f64| {
        let mut monitor = begin(Some(SiteLevel::AtLeast(2)));
        for hour in 1..100 {
            for id in ["a", "b", "c"] {
                if id != "c" || hour < 30 {
                    read(&mut monitor, id, hour, 0.0);
                }
            }
            let said = of_the_site(&monitor.step(start() + hour.hours(), &Input::Tick));
            assert!(said.is_empty(), "one of three is silent: {said:?}");
        }
        let said = of_the_site(&read(&mut monitor, "a", 100, first));
        let is_said = |state: AlertState, said: &[(Level, AlertState, String)]| {
            said.iter()
                .any(|(level, one, _)| (*level, *one) == (Level::Unknown, state))
        };
        let is_unknown = is_said(AlertState::Firing, &said);
        // The other one is red too: nothing is unknown of the site any more.
        let said = of_the_site(&read(&mut monitor, "b", 100, 30.0));
        assert_eq!(
            is_said(AlertState::Resolved, &said),
            is_unknown && first >= 20.0
        );
        is_unknown
    };
    assert!(unknown_with(30.0));
    assert!(!unknown_with(1.0));
}
