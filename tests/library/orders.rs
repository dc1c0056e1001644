//! What people order of the monitor, and that no order of readings, silence and orders loses an alert.

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    reason = "a helper that fails is a test that fails; a test looks for the kinds it names"
)]

use jiff::{SignedDuration, ToSpan};
use proptest::prelude::*;
use slipwatch::alert::{Level, Policy, Threshold};
use slipwatch::monitor::{
    AlertState, Event, EventKind, Given, Input, Monitor, Order, Settings, SiteLevel,
};
use slipwatch::reading::{BenchmarkId, Reading, Timestamp, Unit};
use std::collections::BTreeSet;

fn start() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

/// Orange from 10 mm on, red from 20 mm on.
fn settings() -> Settings {
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
        site: Some(SiteLevel::Worst),
        ..Settings::default()
    }
}

fn read(monitor: &mut Monitor, now: Timestamp, time: Timestamp, value: f64) -> Vec<Event> {
    let reading = Reading {
        time,
        value,
        sigma: None,
    };
    let input = Input::Reading {
        benchmark: BenchmarkId::new("a"),
        unit: Unit::MM,
        averaging: None,
        reading,
    };
    monitor.step(now, &input)
}

fn resolve(monitor: &mut Monitor, now: Timestamp) -> Vec<Event> {
    let given = Given {
        by: Some("Ada".to_owned()),
        why: Some("the wire was cut".to_owned()),
        ..Given::default()
    };
    let benchmark = Some(BenchmarkId::new("a"));
    monitor.step(now, &Input::Order(Order::Resolve { benchmark, given }))
}

/// Place, level, state and key of each alert.
fn alerts(events: &[Event]) -> Vec<(bool, Level, AlertState, String)> {
    let one = |event: &Event| match &event.kind {
        EventKind::Alert {
            level, state, key, ..
        } => Some((event.benchmark.is_none(), *level, *state, key.clone())),
        _ => None,
    };
    events.iter().filter_map(one).collect()
}

#[test]
fn what_people_resolve_ends_there_and_at_the_site_and_is_called_again_under_another_key() {
    let mut monitor = Monitor::new(settings());
    let at = |hour: i64| start() + hour.hours();
    assert!(alerts(&read(&mut monitor, at(0), at(0), 0.0)).is_empty());
    assert!(
        alerts(&resolve(&mut monitor, at(0))).is_empty(),
        "nothing is in force"
    );
    let called = alerts(&read(&mut monitor, at(1), at(1), 12.0));
    let [
        (false, Level::Orange, AlertState::Firing, key),
        (true, Level::Orange, ..),
    ] = &called[..]
    else {
        panic!("{called:?}")
    };
    let events = resolve(&mut monitor, at(1));
    let ended = alerts(&events);
    assert_eq!(
        ended[0],
        (false, Level::Orange, AlertState::Resolved, key.clone())
    );
    assert!(
        ended[1].0 && ended[1].2 == AlertState::Resolved,
        "{ended:?}"
    );
    let EventKind::Alert { rule, text, .. } = &events[1].kind else {
        panic!("{events:?}")
    };
    assert_eq!(rule, "resolved-by-people");
    assert!(text.contains("Ada: the wire was cut"), "{text}");
    assert_eq!(monitor.level(&BenchmarkId::new("a")), Some(Level::Green));
    // What was measured before it was resolved calls it again too, as another alert.
    let corrected = alerts(&read(&mut monitor, at(2), at(1), 13.0));
    assert_eq!(
        (corrected[0].1, corrected[0].2),
        (Level::Orange, AlertState::Firing)
    );
    assert_ne!(corrected[0].3, *key);
    let red = alerts(&read(&mut monitor, at(3), at(3), 25.0));
    assert_eq!((red[0].1, red[0].2), (Level::Red, AlertState::Firing));
}

#[test]
fn what_was_called_after_an_order_was_given_is_not_resolved_by_it() {
    let mut monitor = Monitor::new(settings());
    let at = |hour: i64| start() + hour.hours();
    read(&mut monitor, at(0), at(0), 0.0);
    read(&mut monitor, at(1), at(1), 12.0);
    let red = alerts(&read(&mut monitor, at(2), at(2), 25.0));
    let given = Given {
        called_since: vec![red[0].3.clone()],
        ..Given::default()
    };
    let benchmark = Some(BenchmarkId::new("a"));
    let order = Input::Order(Order::Resolve { benchmark, given });
    assert!(alerts(&monitor.step(at(2), &order)).is_empty());
    assert_eq!(monitor.level(&BenchmarkId::new("a")), Some(Level::Red));
    assert_eq!(alerts(&resolve(&mut monitor, at(2))).len(), 2);
}

/// What happens next.
#[derive(Debug, Clone)]
enum Turn {
    /// A reading so many minutes later, so many mm further.
    Reads(i64, f64),
    /// Nothing for so many days.
    Silent(i64),
    Resolves,
    Acknowledges,
    Silences,
}

fn turns() -> impl Strategy<Value = Vec<Turn>> {
    let reads = (10_i64..400, 0.0..2.5).prop_map(|(minutes, mm)| Turn::Reads(minutes, mm));
    let orders = prop_oneof![
        Just(Turn::Resolves),
        Just(Turn::Acknowledges),
        Just(Turn::Silences)
    ];
    let silent = (20_i64..200).prop_map(Turn::Silent);
    prop::collection::vec(prop_oneof![12 => reads, 2 => orders, 1 => silent], 10..60)
}

/// The alert of the benchmark that is in force, by what was reported, and all keys so far.
#[derive(Debug, Default)]
struct Reported {
    in_force: Option<(Level, String)>,
    is_unknown: bool,
    keys: BTreeSet<String>,
}

impl Reported {
    fn take(&mut self, events: &[Event]) {
        for (is_site, level, state, key) in alerts(events) {
            let is_first = state != AlertState::Firing || self.keys.insert(key.clone());
            assert!(is_first, "{key} begins twice");
            if is_site {
                continue;
            }
            match (level, state) {
                (Level::Unknown, _) => self.is_unknown = state == AlertState::Firing,
                (_, AlertState::Firing) => {
                    let before = self.in_force.replace((level, key));
                    let is_other = before.as_ref().is_none_or(|(before, _)| *before < level);
                    assert!(is_other, "{level} after {before:?}, which has not ended");
                }
                (_, AlertState::Resolved) => {
                    assert_eq!(
                        self.in_force.take(),
                        Some((level, key)),
                        "it was not in force"
                    );
                }
            }
        }
    }

    fn level(&self) -> Level {
        self.in_force
            .as_ref()
            .map_or(Level::Green, |(level, _)| *level)
    }
}

/// The level that the thresholds call for.
fn called(mm: f64) -> Level {
    match mm {
        mm if mm >= 20.0 => Level::Red,
        mm if mm >= 10.0 => Level::Orange,
        _ => Level::Green,
    }
}

fn order(turn: &Turn, now: Timestamp) -> Order {
    let (benchmark, given) = (Some(BenchmarkId::new("a")), Given::default());
    match turn {
        Turn::Acknowledges => Order::Acknowledge {
            benchmark,
            alert: None,
            given,
        },
        Turn::Silences => Order::Silence {
            benchmark,
            until: now + SignedDuration::from_hours(5),
            given,
        },
        _ => Order::Resolve { benchmark, given },
    }
}

/// Nine hourly readings, from which the usual spacing is known.
fn go_on(monitor: &mut Monitor, reported: &mut Reported, (now, mm): (&mut Timestamp, &mut f64)) {
    for _ in 0..9 {
        (*now, *mm) = (*now + 1.hours(), *mm + 0.1);
        reported.take(&read(monitor, *now, *now, *mm));
    }
}

fn live(turns: &[Turn]) {
    let mut monitor = Monitor::new(settings());
    let (mut now, mut mm, mut reported) = (start(), 0.0, Reported::default());
    reported.take(&read(&mut monitor, now, now, mm));
    go_on(&mut monitor, &mut reported, (&mut now, &mut mm));
    for turn in turns {
        let before = reported.level();
        match turn {
            Turn::Reads(minutes, more) => {
                (now, mm) = (now + minutes.minutes(), mm + more);
                reported.take(&read(&mut monitor, now, now, mm));
                // What jitters where a sensor was found stuck is no reading; people know that it is unknown.
                let is_called = reported.level() >= called(mm) || reported.is_unknown;
                assert!(is_called, "{mm} mm: {reported:?}");
            }
            Turn::Silent(days) => {
                let until = now + SignedDuration::from_hours(24 * days);
                while let Some(due) = monitor.next_deadline().filter(|due| *due <= until) {
                    reported.take(&monitor.step(due, &Input::Tick));
                }
                now = until;
                assert!(reported.is_unknown, "silent for {days} days");
                assert!(reported.level() >= before, "silence ended a level");
                go_on(&mut monitor, &mut reported, (&mut now, &mut mm));
            }
            _ => {
                reported.take(&monitor.step(now, &Input::Order(order(turn, now))));
                let is_over = matches!(turn, Turn::Resolves);
                let expected = if is_over { Level::Green } else { before };
                assert_eq!(reported.level(), expected, "{turn:?}");
            }
        }
        assert_eq!(
            monitor.level(&BenchmarkId::new("a")),
            Some(reported.level())
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 48,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(19),
        ..ProptestConfig::default()
    })]

    #[test]
    fn no_course_of_readings_silence_and_orders_loses_an_alert_or_calls_one_twice(turns in turns()) {
        live(&turns);
    }
}
