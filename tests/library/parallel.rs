//! Refits of different benchmarks at once: the events are those of one after the other, to the last bit.

use crate::effects_monitor::{STANDS, found, monitor};
use crate::first_start::{as_it_came, at, history};
use crate::loaded::{RESERVOIR, restless};
use jiff::Timestamp;
use slipwatch::monitor::{
    Event, EventKind, Explain, Input, Monitor, Notice, SearchFinding, Task, Workers,
};
use slipwatch::reading::{BenchmarkId, Unit};
use std::cell::Cell;

/// Does the last task first, and counts them.
#[derive(Debug, Default)]
struct Backwards(Cell<usize>);

impl Workers for Backwards {
    fn run(&self, tasks: Vec<Task<'_>>) {
        self.0.set(self.0.get() + tasks.len());
        tasks.into_iter().rev().for_each(|task| task());
    }
}

/// The events of all inputs, prepared as far as they go.
fn prepared(
    monitor: &mut Monitor,
    inputs: &[(Timestamp, Input)],
    workers: &Backwards,
) -> Vec<Event> {
    let (mut events, mut ahead) = (Vec::new(), 0);
    for (number, (now, input)) in inputs.iter().enumerate() {
        if ahead == 0 {
            ahead = monitor.prepare(inputs[number..].iter().map(|(_, input)| input), workers);
        }
        ahead -= 1;
        events.extend(monitor.step(*now, input));
    }
    events
}

#[test]
fn two_benchmarks_refitted_at_once_give_the_events_of_one_after_the_other() {
    let inputs = history(80, |hour| 0.02 * (hour * hour) as f64);
    let (mut there, given) = as_it_came(&inputs[..40]);
    let (mut here, said) = as_it_came(&inputs[..40]);
    assert_eq!(said, given);
    let workers = Backwards::default();
    let one_by_one: Vec<Event> = (inputs[40..].iter())
        .flat_map(|(now, input)| there.step(*now, input))
        .collect();
    assert_eq!(prepared(&mut here, &inputs[40..], &workers), one_by_one);
    assert_eq!(workers.0.get(), 120);
}

#[test]
fn what_was_prepared_for_another_reading_is_not_used() {
    let inputs = history(60, |_| 0.0);
    let (mut there, _) = as_it_came(&inputs[..80]);
    let (mut here, _) = as_it_came(&inputs[..80]);
    let workers = Backwards::default();
    let other = history(60, |hour| 3.0 * hour as f64);
    for (index, (now, input)) in inputs[80..].iter().enumerate() {
        let next = other[80 + index..].iter().map(|(_, input)| input);
        here.prepare(next, &workers);
        assert_eq!(here.step(*now, input), there.step(*now, input));
    }
}

#[test]
fn what_queued_is_judged_at_once_as_one_after_the_other() {
    let inputs = history(60, |hour| 0.02 * (hour * hour) as f64);
    let workers = Backwards::default();
    let judged = |is_prepared: bool| {
        let (mut monitor, _) = as_it_came(&inputs[..80]);
        monitor.step(at(39), &Input::Notice(Notice::InBatches));
        monitor.step(at(39), &Input::Notice(Notice::Queue));
        let mut said = Vec::new();
        for (now, input) in &inputs[80..] {
            said.extend(monitor.step(*now, input));
        }
        while monitor.queues() {
            if is_prepared {
                monitor.prepare_queued(&workers);
            }
            said.extend(monitor.step(at(59), &Input::Notice(Notice::BatchEnd)));
        }
        said
    };
    let one_by_one = judged(false);
    let is_refit = |event: &&Event| matches!(event.kind, EventKind::Refit { .. });
    assert_eq!(one_by_one.iter().filter(is_refit).count(), 2);
    assert_eq!(judged(true), one_by_one);
    assert_eq!(workers.0.get(), 2);
}

#[test]
fn under_a_known_load_too() {
    let measured = STANDS.measured(120, restless);
    let mut inputs = Vec::new();
    let both = measured.samples.iter().zip(&measured.readings);
    for (day, (sample, reading)) in both.enumerate() {
        let sample = Input::Sample {
            channel: RESERVOIR.to_owned(),
            unit: Some("m".to_owned()),
            sample: *sample,
        };
        inputs.push((reading.time, sample));
        for id in ["a", "b"] {
            if day == 80 {
                let benchmark = BenchmarkId::new(id);
                let finding = SearchFinding {
                    benchmark,
                    ..found(STANDS)
                };
                inputs.push((reading.time, Input::Found(finding)));
            }
        }
        for id in ["a", "b"] {
            let input = Input::Reading {
                benchmark: BenchmarkId::new(id),
                unit: Unit::MM,
                averaging: None,
                reading: *reading,
            };
            inputs.push((reading.time, input));
        }
    }
    let workers = Backwards::default();
    let mut there = monitor(Explain::Adopt);
    let one_by_one: Vec<Event> = (inputs.iter())
        .flat_map(|(now, input)| there.step(*now, input))
        .collect();
    let is_by_load = |event: &Event| matches!(&event.kind, EventKind::Refit { plain: Some(_), .. });
    assert!(one_by_one.iter().any(is_by_load));
    assert_eq!(
        prepared(&mut monitor(Explain::Adopt), &inputs, &workers),
        one_by_one
    );
    assert!(workers.0.get() > 200);
}
