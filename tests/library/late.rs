//! Readings that come days late, or in another order than that of their measurement.

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    reason = "a helper that fails is a test that fails; a test looks for the kinds it names"
)]

use jiff::{SignedDuration, ToSpan};
use proptest::prelude::*;
use slipwatch::alert::{Level, Policy};
use slipwatch::config::{self, Config};
use slipwatch::model::Law;
use slipwatch::monitor::{Event, EventKind, Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Timestamp, Unit};
use slipwatch::runtime::tail::{Arrival, ArrivalBatch, Follower};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn start() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

fn input(time: Timestamp, value: f64) -> Input {
    Input::Reading {
        benchmark: BenchmarkId::new("a"),
        unit: Unit::MM,
        averaging: None,
        reading: Reading {
            time,
            value,
            sigma: None,
        },
    }
}

/// Two readings a day of a slope with m = 1.3 that fails after some 49 days, up to the 46th.
fn failing() -> Vec<(Timestamp, f64)> {
    let law = Law::from_paper(1.3, 0.3, 125.0, 1.5).unwrap();
    let path = slipwatch::model::Trajectory::solve(&law, 46.0, slipwatch::model::Accuracy::Full);
    (0..92)
        .map_while(|index| {
            let noise = if index % 2 == 0 { 0.2 } else { -0.2 };
            let slip = path.at(f64::from(index) / 2.0)?.displacement;
            Some((start() + (12 * index).hours(), slip + noise))
        })
        .collect()
}

fn monitor() -> Monitor {
    Monitor::new(Settings {
        policy: Policy {
            evacuation_time: SignedDuration::from_hours(72),
            ..Policy::default()
        },
        ..Settings::default()
    })
}

fn corrections(events: &[Event]) -> Vec<(Timestamp, Level, Level)> {
    let one = |event: &Event| match &event.kind {
        EventKind::Correction {
            since,
            level_then,
            level_now,
            ..
        } => Some((*since, *level_then, *level_now)),
        _ => None,
    };
    events.iter().filter_map(one).collect()
}

#[test]
fn corrected_readings_that_would_have_called_a_higher_level_are_a_correction() {
    let readings = failing();
    let steady = (readings[50].1 - readings[30].1) / 20.0;
    let mut monitor = monitor();
    let mut events = Vec::new();
    for (index, (time, value)) in readings[..90].iter().enumerate() {
        // From here on the logger goes on as before, whatever the slope does.
        let after = f64::from(u32::try_from(index.saturating_sub(50)).unwrap());
        let shown = if index > 50 {
            readings[50].1 + steady * after
        } else {
            *value
        };
        events.extend(monitor.step(*time, &input(*time, shown)));
    }
    let now = readings[89].0;
    for (time, value) in &readings[51..90] {
        events.extend(monitor.step(now, &input(*time, *value)));
    }
    assert!(corrections(&events).is_empty());
    let mut restarted = Monitor::restore(&monitor.save().unwrap()).unwrap();
    let (time, value) = readings[90];
    let reported = monitor.step(time, &input(time, value));
    let [(since, then, now)] = corrections(&reported)[..] else {
        panic!("{reported:?}");
    };
    assert_eq!(since, readings[51].0);
    assert!(now > then && now >= Level::Orange, "{then} {now}");
    assert_eq!(restarted.step(time, &input(time, value)), reported);
}

#[test]
fn a_late_reading_that_changes_nothing_is_no_correction() {
    let mut monitor = monitor();
    let readings = failing();
    let mut events = Vec::new();
    for (index, (time, value)) in readings.iter().enumerate() {
        if index == 60 {
            continue;
        }
        events.extend(monitor.step(*time, &input(*time, *value)));
        if index == 80 {
            let (late, value) = readings[60];
            events.extend(monitor.step(*time, &input(late, value)));
        }
    }
    assert!(events.iter().any(|event| match &event.kind {
        EventKind::Fault { kind, .. } => kind == "out-of-order",
        _ => false,
    }));
    assert!(
        corrections(&events).is_empty(),
        "{:?}",
        corrections(&events)
    );
}

fn config(folder: &Path) -> Config {
    let text = format!(
        "[site]\nname = \"S\"\nstate_dir = \"state\"\n\
         [[source]]\nid = \"s\"\nkind = \"csv\"\nreorder = \"10m\"\npath = \"{}/*.csv\"\n",
        folder.display()
    );
    config::parse(&text, &folder.join("site.toml")).unwrap()
}

struct Bench {
    folder: TempDir,
    follower: Follower,
    wall: Timestamp,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let config = config(folder.path());
        let follower = Follower::new(&config.sources, &config.benchmarks, &[]);
        Self {
            folder,
            follower,
            wall: start() + 1.hour(),
        }
    }

    fn write(&self, minutes: &[i64]) {
        let mut text = "time,a_displacement_mm\n".to_owned();
        for minute in minutes {
            let time = start() + minute.minutes();
            writeln!(text, "{time},{minute}").unwrap();
        }
        fs::write(self.folder.path().join("a.csv"), text).unwrap();
    }

    fn poll(&mut self) -> ArrivalBatch {
        let mut all = ArrivalBatch::default();
        loop {
            let batch = self.follower.poll(self.wall);
            all.arrivals.extend(batch.arrivals);
            all.positions.extend(batch.positions);
            if batch.caught_up {
                return all;
            }
        }
    }
}

fn minutes(arrivals: &[Arrival]) -> Vec<i64> {
    let minute = |arrival: &Arrival| arrival.time.duration_since(start()).as_secs() / 60;
    arrivals.iter().map(minute).collect()
}

#[test]
fn values_wait_for_the_window_in_data_time_or_on_the_wall_clock() {
    let mut bench = Bench::new();
    bench.write(&[1, 3, 2, 14, 13]);
    // The values of up to 4 minutes have a newer one by 10 minutes.
    assert_eq!(minutes(&bench.poll().arrivals), [1, 2, 3]);
    bench.wall += SignedDuration::from_mins(9);
    assert!(bench.poll().arrivals.is_empty());
    bench.wall += SignedDuration::from_mins(1);
    assert_eq!(minutes(&bench.poll().arrivals), [13, 14]);
}

#[test]
fn a_file_is_not_acknowledged_past_values_that_wait() {
    let mut bench = Bench::new();
    bench.write(&[1, 3, 2]);
    assert!(bench.poll().positions.is_empty());
    bench.wall += SignedDuration::from_mins(10);
    let batch = bench.poll();
    assert_eq!(minutes(&batch.arrivals), [1, 2, 3]);
    let [position] = &batch.positions[..] else {
        panic!("{:?}", batch.positions);
    };
    let saved = vec![(position.name.clone(), position.body.clone().unwrap())];
    let config = config(bench.folder.path());
    bench.follower = Follower::new(&config.sources, &config.benchmarks, &saved);
    bench.wall += SignedDuration::from_mins(10);
    assert!(bench.poll().arrivals.is_empty());
}

#[test]
fn a_clock_that_is_ahead_by_years_sends_nothing_out_that_waits() {
    let mut bench = Bench::new();
    bench.write(&[1, 3, 60 * 24 * 365 * 9, 2]);
    assert!(bench.poll().arrivals.is_empty());
}

/// The minutes 0 to 59, none of which comes after one that is 10 minutes later or more.
fn arrival_orders() -> impl Strategy<Value = Vec<i64>> {
    prop::collection::vec(0_i64..10, 60).prop_map(|delays| {
        let mut order: Vec<i64> = (0..60).collect();
        order.sort_by_key(|minute| {
            let delay = usize::try_from(*minute)
                .ok()
                .and_then(|index| delays.get(index));
            minute + delay.copied().unwrap_or(0)
        });
        order
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_arrival_order_within_the_window_gives_the_same_events(order in arrival_orders()) {
        let reported = |order: &[i64]| {
            let mut bench = Bench::new();
            bench.write(order);
            let mut arrivals = bench.poll().arrivals;
            bench.wall += SignedDuration::from_mins(10);
            arrivals.extend(bench.poll().arrivals);
            let mut monitor = Monitor::new(Settings::default());
            let step = |arrival: &Arrival| monitor.step(arrival.time, &arrival.input);
            let events: Vec<Event> = arrivals.iter().flat_map(step).collect();
            (minutes(&arrivals), events)
        };
        let in_order: Vec<i64> = (0..60).collect();
        prop_assert_eq!(reported(&order), reported(&in_order));
    }
}
