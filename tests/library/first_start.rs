//! A first start on history: what is current is judged first, and the refits of the past come after, as they would have come.

use jiff::{SignedDuration, Timestamp, ToSpan};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use slipwatch::alert::{Level, Policy, Threshold};
use slipwatch::monitor::{AlertState, Event, EventKind, Input, Monitor, Notice, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Unit};
use std::collections::BTreeMap;

pub(crate) fn at(hour: i64) -> Timestamp {
    let start: Timestamp = "2026-01-01T00:00:00Z".parse().unwrap();
    start + hour.hours()
}

fn reading(benchmark: &str, hour: i64, value: f64) -> (Timestamp, Input) {
    let input = Input::Reading {
        benchmark: BenchmarkId::new(benchmark),
        unit: Unit::MM,
        averaging: None,
        reading: Reading {
            time: at(hour),
            value,
            sigma: None,
        },
    };
    (at(hour), input)
}

/// Creep with a jitter, hourly, of two benchmarks; `more` is added to that of the first.
pub(crate) fn history(hours: i64, more: impl Fn(i64) -> f64) -> Vec<(Timestamp, Input)> {
    (0..hours)
        .flat_map(|hour| {
            let jitter = 0.05 * ((hour * 37 % 11) as f64 - 5.0);
            let creep = 0.1 * hour as f64 + jitter;
            [
                reading("a", hour, creep + more(hour)),
                reading("b", hour, 0.5 * creep),
            ]
        })
        .collect()
}

pub(crate) fn monitor() -> Monitor {
    let policy = Policy {
        thresholds: vec![Threshold {
            level: Level::Red,
            velocity_mm_per_day: Some(100.0),
            displacement_mm: None,
            acceleration_mm_per_day2: None,
        }],
        evacuation_time: SignedDuration::from_hours(24),
        ..Policy::default()
    };
    Monitor::new(Settings {
        policy,
        ..Settings::default()
    })
}

fn notice(monitor: &mut Monitor, notice: Notice) -> Vec<Event> {
    let now = at(10_000);
    monitor.step(now, &Input::Notice(notice))
}

/// What a first start says: of the present, and then of the past.
fn first_start(monitor: &mut Monitor, inputs: &[(Timestamp, Input)]) -> (Vec<Event>, Vec<Event>) {
    assert!(notice(monitor, Notice::Past).is_empty());
    for (now, input) in inputs {
        let said = monitor.step(*now, input);
        assert!(!said.iter().any(|event| refit(event).is_some()), "{said:?}");
    }
    let (mut current, mut past) = (Vec::new(), Vec::new());
    while monitor.owes_current() {
        current.extend(notice(monitor, Notice::Current));
    }
    while monitor.owes_past() {
        past.extend(notice(monitor, Notice::Retrace));
    }
    (current, past)
}

/// The benchmark, the time and the words of a refit.
fn refit(event: &Event) -> Option<(String, Timestamp, String)> {
    let is_refit = matches!(event.kind, EventKind::Refit { .. });
    let benchmark = event.benchmark.as_ref()?.to_string();
    is_refit.then(|| (benchmark, event.time, serde_json::to_string(event).unwrap()))
}

/// A monitor that was given each input as it came, and its events.
pub(crate) fn as_it_came(inputs: &[(Timestamp, Input)]) -> (Monitor, Vec<Event>) {
    let mut there = monitor();
    let steps = inputs.iter();
    let events = steps.flat_map(|(now, input)| there.step(*now, input));
    let events = events.collect();
    (there, events)
}

pub(crate) fn refits(events: &[Event]) -> Vec<(String, Timestamp, String)> {
    let mut all: Vec<_> = events.iter().filter_map(refit).collect();
    all.sort();
    all
}

#[test]
fn what_is_current_is_judged_first_and_the_refits_of_the_past_are_those_of_a_daemon_that_was_there()
{
    let inputs = history(60, |_| 0.0);
    let (mut there, given) = as_it_came(&inputs);
    let mut late = monitor();
    let (current, past) = first_start(&mut late, &inputs);
    let newest: Vec<Timestamp> = refits(&current).iter().map(|(_, time, _)| *time).collect();
    assert_eq!(newest, [at(59), at(59)]);
    assert_eq!(refits(&[current, past].concat()), refits(&given));
    // And they go on alike.
    let (now, next) = reading("a", 60, 6.0);
    let (given, said) = (there.step(now, &next), late.step(now, &next));
    assert_eq!(refits(&said), refits(&given));
}

#[test]
fn a_past_in_which_the_current_is_judged_meanwhile_gives_no_other_refits() {
    let inputs = history(60, |_| 0.0);
    let (_, given) = as_it_came(&inputs);
    let mut late = monitor();
    let mut said = Vec::new();
    for half in [&inputs[..80], &inputs[80..]] {
        notice(&mut late, Notice::Past);
        for (now, input) in half {
            late.step(*now, input);
        }
        said.extend(notice(&mut late, Notice::Current));
    }
    while late.owes_past() {
        said.extend(notice(&mut late, Notice::Retrace));
    }
    let mut made = refits(&said);
    made.dedup();
    assert_eq!(made, refits(&given));
}

/// The history of one benchmark that is added while another is watched.
#[test]
fn the_past_of_one_benchmark_alone_is_taken_without_keeping_the_others_from_being_judged() {
    let inputs = history(60, |_| 0.0);
    let id = BenchmarkId::new("b");
    let is_added =
        |input: &Input| matches!(input, Input::Reading { benchmark, .. } if *benchmark == id);
    let (added, watched): (Vec<_>, Vec<_>) =
        (inputs.into_iter()).partition(|(_, input)| is_added(input));
    let (live, before) = (watched[50..].iter(), watched[..50].iter());
    let mut late = monitor();
    let mut said: Vec<Event> = before
        .flat_map(|(now, input)| late.step(*now, input))
        .collect();
    late.step(at(49), &Input::Notice(Notice::PastOf(id.clone())));
    let (mut live, mut while_read) = (live, Vec::new());
    for (number, (_, input)) in added.iter().enumerate() {
        if number % 6 == 0
            && let Some((now, input)) = live.next()
        {
            while_read.extend(late.step(*now, input));
        }
        while_read.extend(late.step(at(59), input));
    }
    let of = |refits: &[(String, Timestamp, String)], benchmark: &str| {
        refits.iter().filter(|(one, ..)| one == benchmark).count()
    };
    assert_eq!(of(&refits(&while_read), "a"), 10, "judged as they come");
    assert_eq!(of(&refits(&while_read), "b"), 0);
    let mut restored = Monitor::restore(&late.save().unwrap()).unwrap();
    assert!(restored.reads_past() && !restored.reads_all_past());
    let now = at(59);
    let current = restored.step(now, &Input::Notice(Notice::Current));
    let newest: Vec<_> = refits(&current)
        .into_iter()
        .map(|(one, time, _)| (one, time))
        .collect();
    assert_eq!(newest, [("b".to_owned(), at(59))]);
    said.extend([while_read, current].concat());
    while restored.owes_past() {
        said.extend(restored.step(now, &Input::Notice(Notice::Retrace)));
    }
    let (_, given) = as_it_came(&history(60, |_| 0.0));
    assert_eq!(refits(&said), refits(&given));
}

#[test]
fn a_red_of_the_past_that_nothing_has_ended_is_called_after_a_first_start_as_of_then() {
    // Ten hours of 240 mm/day, and twenty of creep: not yet an evacuation time.
    let crisis = |hour: i64| 10.0 * (hour.clamp(30, 40) - 30) as f64;
    let mut late = monitor();
    let (current, past) = first_start(&mut late, &history(60, crisis));
    let red = |event: &Event| {
        let is_red = matches!(
            event.kind,
            EventKind::Alert {
                level: Level::Red,
                state: AlertState::Firing,
                ..
            }
        );
        is_red.then_some(event.time)
    };
    assert_eq!(current.iter().find_map(red), None);
    let called = past.iter().find_map(red).unwrap();
    assert!(called > at(30) && called <= at(41), "{called}");
    assert_eq!(late.level(&BenchmarkId::new("a")), Some(Level::Red));
    assert_eq!(late.level(&BenchmarkId::new("b")), Some(Level::Green));
    // Its figures are those of then, and it says so.
    let found = past.iter().rev().find_map(|event| {
        if let EventKind::Alert { rule, text, .. } = &event.kind {
            (rule == "past").then_some(text)
        } else {
            None
        }
    });
    let found = found.unwrap();
    assert!(
        found.contains("nothing since has ended it; when it was called: chance of collapse"),
        "{found}"
    );
}

#[test]
fn what_began_in_the_past_and_ended_while_it_was_gone_through_is_reported_with_its_end() {
    let crisis = |hour: i64| 10.0 * (hour.clamp(30, 40) - 30) as f64;
    let inputs = history(400, crisis);
    let levels = |events: &[Event]| -> BTreeMap<String, Vec<AlertState>> {
        let mut levels: BTreeMap<String, Vec<AlertState>> = BTreeMap::new();
        for event in events {
            if let EventKind::Alert { key, state, .. } = &event.kind {
                levels.entry(key.clone()).or_default().push(*state);
            }
        }
        levels
    };
    let mut late = monitor();
    assert!(notice(&mut late, Notice::Past).is_empty());
    let (first, rest) = inputs.split_at(2 * 100);
    for (now, input) in first {
        late.step(*now, input);
    }
    let mut said = Vec::new();
    while late.owes_current() {
        said.extend(notice(&mut late, Notice::Current));
    }
    for (now, input) in rest {
        said.extend(late.step(*now, input));
    }
    while late.owes_past() {
        said.extend(notice(&mut late, Notice::Retrace));
    }
    let (_, given) = as_it_came(&inputs);
    let red = |levels: &BTreeMap<String, Vec<AlertState>>| {
        let red = levels.iter().find(|(key, _)| key.contains("red"));
        red.map(|(_, states)| states.clone())
    };
    let whole = [AlertState::Firing, AlertState::Resolved];
    assert_eq!(red(&levels(&given)).unwrap(), whole);
    assert_eq!(red(&levels(&said)).unwrap(), whole);
}

#[test]
fn a_memory_saved_half_way_through_the_past_goes_on_from_there() {
    let inputs = history(60, |_| 0.0);
    let (mut one, mut other) = (monitor(), monitor());
    let (_, whole) = first_start(&mut one, &inputs);
    notice(&mut other, Notice::Past);
    for (now, input) in &inputs {
        other.step(*now, input);
    }
    let mut said = Vec::new();
    notice(&mut other, Notice::Current);
    for _ in 0..2 {
        said.extend(notice(&mut other, Notice::Retrace));
    }
    let mut restored = Monitor::restore(&other.save().unwrap()).unwrap();
    while restored.owes_past() {
        said.extend(notice(&mut restored, Notice::Retrace));
    }
    assert_eq!(refits(&said), refits(&whole));
}

/// An acceleration to a collapse after 372 h, each of these with another noise.
fn failing(names: &[String]) -> Vec<(Timestamp, Input)> {
    let tf = 15.5;
    let of = |name: &String, number: usize| {
        let mut random = Pcg64::seed_from_u64(number as u64);
        let noise = Normal::new(0.0, 0.3).unwrap();
        let each = (0..360).map(move |hour| {
            let days = hour as f64 / 24.0;
            let value = days - 80.0 * (1.0 - days / tf).ln() + noise.sample(&mut random);
            (hour, value)
        });
        let name = name.clone();
        each.map(move |(hour, value)| reading(&name, hour, value))
    };
    let all = names.iter().enumerate();
    let mut all: Vec<_> = all.flat_map(|(number, name)| of(name, number)).collect();
    all.sort_by_key(|(time, _)| *time);
    all
}

/// When each benchmark was first called red.
fn reds(events: &[Event]) -> BTreeMap<String, Timestamp> {
    let mut first = BTreeMap::new();
    for event in events {
        if let EventKind::Alert {
            level: Level::Red,
            state: AlertState::Firing,
            ..
        } = event.kind
            && let Some(benchmark) = &event.benchmark
        {
            first.entry(benchmark.to_string()).or_insert(event.time);
        }
    }
    first
}

/// For hours the past may wait to be gone through, while readings come. A chance that is high at one of them calls no red that a
/// daemon which was there does not call.
#[test]
fn before_the_past_has_been_gone_through_red_goes_by_the_course_of_its_chance_too() {
    let names: Vec<String> = (0..5).map(|number| format!("p{number}")).collect();
    let inputs = failing(&names);
    let policy = Policy {
        evacuation_time: SignedDuration::from_hours(12),
        ..Policy::default()
    };
    let new = || {
        Monitor::new(Settings {
            policy: policy.clone(),
            ..Settings::default()
        })
    };
    let mut there = new();
    let steps = inputs.iter();
    let given: Vec<Event> = steps
        .flat_map(|(now, input)| there.step(*now, input))
        .collect();
    let expected = reds(&given);
    assert_eq!(expected.len(), names.len());
    let first = expected.values().min().unwrap();
    let started = inputs.partition_point(|(time, _)| *time < *first - 2.hours());
    let mut late = new();
    notice(&mut late, Notice::Past);
    for (now, input) in &inputs[..started] {
        late.step(*now, input);
    }
    let mut said = Vec::new();
    let (now, _) = inputs[started - 1];
    while late.owes_current() {
        said.extend(late.step(now, &Input::Notice(Notice::Current)));
    }
    for (now, input) in &inputs[started..] {
        said.extend(late.step(*now, input));
    }
    assert!(late.owes_past());
    for (name, time) in reds(&said) {
        let apart = time.duration_since(expected[&name]).abs();
        assert!(
            apart <= SignedDuration::from_hours(1),
            "{name}: {time}, {}",
            expected[&name]
        );
    }
}
