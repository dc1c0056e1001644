//! Readings that come faster than they can be judged: each is taken, thresholds act at each, and the newest is judged.

use crate::first_start::{as_it_came, at, history, refits};
use jiff::Timestamp;
use slipwatch::alert::Level;
use slipwatch::monitor::{AlertState, Event, EventKind, Input, Monitor, Notice};
use slipwatch::reading::BenchmarkId;

/// Hours that are judged as they come, before a queue.
const BEFORE: usize = 40;

/// A monitor that knows its two benchmarks, and the rest of what comes.
fn before(inputs: &[(Timestamp, Input)]) -> (Monitor, impl Iterator<Item = &(Timestamp, Input)>) {
    let (known, rest) = inputs.split_at(2 * BEFORE);
    let (mut monitor, _) = as_it_came(known);
    monitor.step(at(39), &Input::Notice(Notice::InBatches));
    monitor.step(at(39), &Input::Notice(Notice::Queue));
    (monitor, rest.iter())
}

fn settle(monitor: &mut Monitor, now: Timestamp) -> Vec<Event> {
    let mut said = Vec::new();
    while monitor.queues() {
        said.extend(monitor.step(now, &Input::Notice(Notice::BatchEnd)));
    }
    said
}

#[test]
fn of_readings_that_queue_the_newest_is_judged_as_if_each_had_been() {
    let inputs = history(60, |_| 0.0);
    let (mut there, given) = as_it_came(&inputs);
    let (mut monitor, rest) = before(&inputs);
    for (now, input) in rest {
        assert_eq!(refits(&monitor.step(*now, input)), []);
    }
    let said = settle(&mut monitor, at(59));
    let newest: Vec<_> = (refits(&given).into_iter())
        .filter(|(_, time, _)| *time == at(59))
        .collect();
    assert_eq!(newest.len(), 2);
    assert_eq!(refits(&said), newest);
    // And each reading is judged as it comes again.
    let next = history(61, |_| 0.0);
    for (now, input) in &next[120..] {
        let (given, said) = (there.step(*now, input), monitor.step(*now, input));
        assert_eq!((refits(&said).len(), refits(&said)), (1, refits(&given)));
    }
}

#[test]
fn a_threshold_is_called_at_its_reading_however_many_queue_behind_it() {
    let inputs = history(60, |hour| 10.0 * (hour.max(45) - 45) as f64);
    let (mut monitor, rest) = before(&inputs);
    let is_red = |event: &Event| {
        matches!(
            event.kind,
            EventKind::Alert {
                level: Level::Red,
                state: AlertState::Firing,
                ..
            }
        )
    };
    let (there, given) = as_it_came(&inputs);
    let called = given.iter().find(|event| is_red(event)).unwrap().time;
    assert_eq!(there.level(&BenchmarkId::new("a")), Some(Level::Red));
    for (now, input) in rest {
        let said = monitor.step(*now, input);
        if let Some(event) = said.iter().find(|event| is_red(event)) {
            assert_eq!((*now, event.time), (called, called));
            return;
        }
    }
    panic!("not called before the queue was over");
}

/// When readings that queue are judged, as long as more come.
fn judged_meanwhile(more: impl Fn(i64) -> f64) -> Vec<Timestamp> {
    let inputs = history(200, more);
    let (mut monitor, rest) = before(&inputs);
    let mut said = Vec::new();
    for (now, input) in rest {
        said.extend(monitor.step(*now, input));
    }
    // Of each the newest is judged in any case.
    assert_eq!(refits(&settle(&mut monitor, at(199))).len(), 2);
    let of_the_first = (refits(&said).into_iter()).filter(|(benchmark, ..)| benchmark == "a");
    of_the_first.map(|(_, time, _)| time).collect()
}

#[test]
fn a_slope_that_accelerates_while_its_readings_queue_is_judged_once_in_an_evacuation_time() {
    let growth = |hour: i64| 0.5 * ((hour - 40).max(0) as f64 / 30.0).exp();
    // From the first that queued, and from the first after each that was judged.
    assert_eq!(
        judged_meanwhile(growth),
        [64, 89, 114, 139, 164, 189].map(at)
    );
}

#[test]
fn a_slope_whose_motion_rules_out_orange_is_judged_when_no_more_readings_queue() {
    assert_eq!(judged_meanwhile(|_| 0.0), []);
}

#[test]
fn a_memory_saved_in_a_queue_goes_on_from_there() {
    let inputs = history(60, |_| 0.0);
    let (mut monitor, rest) = before(&inputs);
    for (now, input) in rest {
        monitor.step(*now, input);
    }
    let saved = monitor.save().unwrap();
    let mut restored = Monitor::restore(&saved).unwrap();
    let said = settle(&mut restored, at(59));
    assert_eq!(refits(&said).len(), 2);
    assert_eq!(said, settle(&mut monitor, at(59)));
}
