//! What people declare: resets, maintenance and blasts, before the readings come and after.

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    reason = "a helper that fails is a test that fails; a test looks for the kinds it names"
)]

use jiff::{SignedDuration, ToSpan};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::monitor::{
    AlertState, Declaration, Declared, Event, EventKind, Input, Monitor, Settings,
};
use slipwatch::reading::{BenchmarkId, Reading, Timestamp, Unit};

fn start() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

/// 2 mm/day with noise of half a millimetre, a reading an hour or so many hours; raised by `jump` mm from `at` on.
fn series(readings: i64, hours: i64, (at, jump): (Timestamp, f64)) -> Vec<(Timestamp, f64)> {
    let mut generator = Pcg64::seed_from_u64(3);
    (0..readings)
        .map(|index| {
            let time = start() + (index * hours).hours();
            let days = time.duration_since(start()).as_secs_f64() / 86_400.0;
            let raised = if time >= at { jump } else { 0.0 };
            (time, 2.0 * days + generator.random::<f64>() - 0.5 + raised)
        })
        .collect()
}

fn input((time, value): (Timestamp, f64), unit: Unit) -> Input {
    Input::Reading {
        benchmark: BenchmarkId::new("a"),
        unit,
        averaging: (unit != Unit::MM).then(|| SignedDuration::from_hours(24)),
        reading: Reading {
            time,
            value,
            sigma: None,
        },
    }
}

fn declaring(declared: &[Declared]) -> Settings {
    Settings {
        declared: declared.to_vec(),
        ..Settings::default()
    }
}

fn at(time: Timestamp, kind: Declaration) -> Declared {
    Declared {
        time,
        benchmark: Some(BenchmarkId::new("a")),
        kind,
    }
}

fn reset(time: Timestamp, size_mm: Option<f64>) -> Declared {
    at(time, Declaration::Reset { size_mm })
}

fn play(monitor: &mut Monitor, readings: &[(Timestamp, f64)], unit: Unit) -> Vec<Event> {
    let mut events = Vec::new();
    for one in readings {
        // Time goes by as it does for a site.
        while let Some(due) = monitor.next_deadline().filter(|due| *due <= one.0) {
            events.extend(monitor.step(due, &Input::Tick));
        }
        events.extend(monitor.step(one.0, &input(*one, unit)));
    }
    events
}

/// What is said beside refits, once the slope is known: a short record has forecasts of its own.
fn names(events: &[Event]) -> Vec<&'static str> {
    let known = start() + (55 * 24).hours();
    let later = events.iter().filter(|event| event.time >= known);
    let named = later.map(|event| event.kind.name());
    named.filter(|name| *name != "refit").collect()
}

fn velocities(events: &[Event]) -> Vec<f64> {
    let velocity = |event: &Event| match &event.kind {
        EventKind::Refit {
            velocity_mm_per_day,
            ..
        } => *velocity_mm_per_day,
        _ => None,
    };
    events.iter().filter_map(velocity).collect()
}

fn jumps(events: &[Event]) -> Vec<f64> {
    let size = |event: &Event| match &event.kind {
        EventKind::Declared { size_mm, .. } => *size_mm,
        _ => None,
    };
    events.iter().filter_map(size).collect()
}

#[test]
fn a_declared_reset_is_no_motion_and_an_undeclared_one_is_reported() {
    let time = start() + (61 * 24).hours() + 1.hour();
    let readings = series(90, 24, (time, 500.0));
    let silent = play(&mut Monitor::new(Settings::default()), &readings, Unit::MM);
    assert!(names(&silent).contains(&"unexplained-residual"));
    for size in [None, Some(500.0)] {
        let mut monitor = Monitor::new(declaring(&[reset(time, size)]));
        let events = play(&mut monitor, &readings, Unit::MM);
        assert_eq!(names(&events), ["declared"], "{size:?}");
        assert!((jumps(&events)[0] - 500.0).abs() < 3.0, "{events:?}");
        assert!(velocities(&events).iter().all(|v| v.abs() < 10.0));
        assert_eq!(monitor.level(&BenchmarkId::new("a")), Some(Level::Green));
    }
}

#[test]
fn a_reset_declared_after_its_readings_came_joins_the_history_and_refits() {
    let time = start() + (61 * 24).hours() + 1.hour();
    let readings = series(90, 24, (time, 500.0));
    let declared = declaring(&[reset(time, None)]);
    let mut before = Monitor::new(declared.clone());
    play(&mut before, &readings[..70], Unit::MM);
    let mut after = Monitor::new(Settings::default());
    play(&mut after, &readings[..70], Unit::MM);
    let reported = after.step(readings[69].0, &Input::Settings(Box::new(declared.clone())));
    assert_eq!(names(&reported)[0], "declared");
    assert!(reported.iter().any(|event| event.kind.name() == "refit"));
    assert!(
        after
            .step(readings[69].0, &Input::Settings(Box::new(declared)))
            .is_empty()
    );
    let (early, late) = (
        play(&mut before, &readings[70..], Unit::MM),
        play(&mut after, &readings[70..], Unit::MM),
    );
    assert_eq!(velocities(&early), velocities(&late));
}

#[test]
fn a_reset_taken_back_leaves_the_readings_as_they_were() {
    let time = start() + (61 * 24).hours() + 1.hour();
    let readings = series(90, 24, (time, 0.0));
    let mut plain = Monitor::new(Settings::default());
    play(&mut plain, &readings[..70], Unit::MM);
    let window = Declaration::Maintenance {
        until: time + 72.hours(),
    };
    let mut wrong = Monitor::new(declaring(&[
        reset(time, Some(-300.0)),
        at(time + 24.hours(), window),
    ]));
    play(&mut wrong, &readings[..70], Unit::MM);
    wrong.step(readings[69].0, &Input::Settings(Box::default()));
    let (right, mended) = (
        play(&mut plain, &readings[70..], Unit::MM),
        play(&mut wrong, &readings[70..], Unit::MM),
    );
    for (right, mended) in velocities(&right).iter().zip(velocities(&mended)) {
        assert!((right - mended).abs() < 1e-6, "{right} {mended}");
    }
}

#[test]
fn a_velocity_that_is_a_mean_over_a_reset_is_left_out() {
    let time = start() + (61 * 24).hours() + 1.hour();
    let mut readings = series(90, 24, (start(), 0.0));
    for (index, one) in readings.iter_mut().enumerate() {
        let noise = if index % 2 == 0 { 0.1 } else { -0.1 };
        one.1 = if index == 62 { 400.0 } else { 2.0 + noise };
    }
    let silent = play(
        &mut Monitor::new(Settings::default()),
        &readings,
        Unit::MM_PER_DAY,
    );
    assert!(velocities(&silent).contains(&400.0));
    let mut monitor = Monitor::new(declaring(&[reset(time, None)]));
    let events = play(&mut monitor, &readings, Unit::MM_PER_DAY);
    assert_eq!(names(&events), ["declared"]);
    assert!(velocities(&events).iter().all(|v| *v < 3.0));
}

#[test]
fn maintenance_raises_nothing_and_keeps_what_is_in_force() {
    let from = start() + (60 * 24).hours();
    let until = from + (5 * 24).hours();
    let mut readings = series(90, 24, (start(), 0.0));
    for one in readings
        .iter_mut()
        .filter(|(time, _)| (from..until).contains(time))
    {
        one.1 += 900.0;
    }
    let window = at(from, Declaration::Maintenance { until });
    let mut monitor = Monitor::new(declaring(&[window]));
    let events = play(&mut monitor, &readings, Unit::MM);
    assert_eq!(names(&events), ["declared"]);
    assert!(velocities(&events).iter().all(|v| v.abs() < 10.0));
}

#[test]
fn silence_during_maintenance_is_no_fault_and_silence_after_it_is_one() {
    let from = start() + (60 * 24).hours();
    let until = from + (20 * 24).hours();
    let mut readings = series(90, 24, (start(), 0.0));
    readings.retain(|(time, _)| !(from..until).contains(time));
    let silent = play(&mut Monitor::new(Settings::default()), &readings, Unit::MM);
    assert!(names(&silent).contains(&"fault"));
    let window = at(from, Declaration::Maintenance { until });
    let mut monitor = Monitor::new(declaring(std::slice::from_ref(&window)));
    let events = play(&mut monitor, &readings, Unit::MM);
    assert_eq!(names(&events), ["declared"]);
    // The gap of maintenance does not make it patient afterwards.
    let newest = readings.last().unwrap().0;
    assert!(monitor.next_deadline().unwrap() <= newest + (6 * 24).hours());
    readings.retain(|(time, _)| *time < from);
    let mut monitor = Monitor::new(declaring(&[window]));
    play(&mut monitor, &readings, Unit::MM);
    let due = monitor.next_deadline().unwrap();
    assert!(due > until && due < until + (6 * 24).hours(), "{due}");
    let reported = monitor.step(due, &Input::Tick);
    let is_unknown = |event: &Event| {
        matches!(
            &event.kind,
            EventKind::Alert {
                level: Level::Unknown,
                state: AlertState::Firing,
                ..
            }
        )
    };
    assert!(reported.iter().any(is_unknown));
}

#[test]
fn what_a_blast_shakes_within_an_hour_asks_for_no_look() {
    let time = start() + (61 * 24).hours() - 30.minutes();
    let mut readings = series(90, 24, (start(), 0.0));
    readings.truncate(62);
    readings[61].1 += 40.0;
    let silent = play(&mut Monitor::new(Settings::default()), &readings, Unit::MM);
    let residuals = |events: &[Event]| {
        let named = names(events).into_iter();
        named.filter(|name| *name == "unexplained-residual").count()
    };
    assert_eq!(residuals(&silent), 1);
    let mut monitor = Monitor::new(declaring(&[at(time, Declaration::Blast)]));
    let events = play(&mut monitor, &readings, Unit::MM);
    assert_eq!(residuals(&events), 0);
    assert!(names(&events).contains(&"declared"));
    let mut late = Monitor::new(declaring(&[at(time - 2.hours(), Declaration::Blast)]));
    assert_eq!(residuals(&play(&mut late, &readings, Unit::MM)), 1);
}

#[test]
fn what_is_declared_is_remembered_over_a_restart() {
    let time = start() + (61 * 24).hours() + 1.hour();
    let readings = series(90, 24, (time, 500.0));
    let window = Declaration::Maintenance {
        until: time + (10 * 24).hours(),
    };
    let declared = declaring(&[reset(time, None), at(time + (5 * 24).hours(), window)]);
    let mut whole = Monitor::new(declared.clone());
    let mut first = Monitor::new(declared);
    play(&mut whole, &readings[..69], Unit::MM);
    play(&mut first, &readings[..69], Unit::MM);
    let mut second = Monitor::restore(&first.save().unwrap()).unwrap();
    assert_eq!(
        play(&mut whole, &readings[69..], Unit::MM),
        play(&mut second, &readings[69..], Unit::MM)
    );
}

fn found_resets(events: &[Event]) -> usize {
    let is_one = |event: &&Event| matches!(&event.kind, EventKind::Fault { kind, .. } if kind == "reset-found");
    events.iter().filter(is_one).count()
}

/// The displacement since the first reading that a threshold sees, by which one it calls.
fn displaced_by(
    readings: &[(Timestamp, f64)],
    mut settings: Settings,
    mm: f64,
) -> (Vec<Event>, Monitor) {
    settings
        .policy
        .thresholds
        .push(slipwatch::alert::Threshold {
            level: Level::Orange,
            velocity_mm_per_day: None,
            displacement_mm: Some(mm),
            acceleration_mm_per_day2: None,
        });
    let mut monitor = Monitor::new(settings);
    let events = play(&mut monitor, readings, Unit::MM);
    (events, monitor)
}

#[test]
fn a_fall_that_no_slope_makes_is_a_reset_that_nobody_declared_and_a_spike_is_none() {
    let when = start() + 200.hours();
    let readings = series(400, 1, (when, -30.0));
    // 400 h at 2 mm/day are 33 mm, of which 30 would be missing.
    let (events, monitor) = displaced_by(&readings, Settings::default(), 25.0);
    assert_eq!(found_resets(&events), 1);
    assert_eq!(monitor.level(&BenchmarkId::new("a")), Some(Level::Orange));
    let is_red = |event: &Event| {
        matches!(
            event.kind,
            EventKind::Alert {
                level: Level::Red,
                ..
            }
        )
    };
    assert!(!events.iter().any(is_red), "{events:?}");
    // Declared as well, it is taken off once.
    let declared = declaring(&[reset(when, Some(-30.0))]);
    let (mut events, mut monitor) = displaced_by(&readings, Settings::default(), 45.0);
    events.extend(monitor.step(
        readings.last().unwrap().0,
        &Input::Settings(Box::new(declared)),
    ));
    let level = monitor.level(&BenchmarkId::new("a"));
    assert!(level < Some(Level::Orange), "{level:?}: 63 mm");
    // Whoever knows that the slope fell says so.
    let mut accepting = Settings::default();
    let fall = [slipwatch::reading::Suspicion::Fall].into();
    accepting.accepted.insert(BenchmarkId::new("a"), fall);
    assert_eq!(found_resets(&displaced_by(&readings, accepting, 25.0).0), 0);
    // What comes back is a spike, or an offset that has passed; a slope that is read with the other sign moves on.
    let mut spike = series(400, 1, (when, 0.0));
    spike[200].1 -= 30.0;
    spike[201].1 -= 30.0;
    assert_eq!(
        found_resets(&displaced_by(&spike, Settings::default(), 25.0).0),
        0
    );
    let mut offset = series(400, 1, (when, 0.0));
    for one in &mut offset[200..260] {
        one.1 -= 30.0;
    }
    let (events, monitor) = displaced_by(&offset, Settings::default(), 45.0);
    assert_eq!(found_resets(&events), 1);
    // 33 mm, and not the 30 more by which it came back.
    let level = monitor.level(&BenchmarkId::new("a"));
    assert!(level < Some(Level::Orange), "{level:?}");
    let mut turned: Vec<(Timestamp, f64)> = series(400, 1, (when, 30.0));
    for one in &mut turned {
        one.1 = -one.1;
    }
    assert_eq!(
        found_resets(&displaced_by(&turned, Settings::default(), 25.0).0),
        0
    );
}

/// Hourly readings of a slope that creeps at 1 mm/day and collapses at the 330th hour, with what a function makes of each.
fn to_a_collapse(read: impl Fn(usize, f64) -> f64) -> Vec<(Timestamp, f64)> {
    let mut generator = Pcg64::seed_from_u64(5);
    let mut moved = 30.0;
    let readings = (0..325_i32).map(|hour| {
        let left = f64::from(330 - hour.max(240));
        moved += 0.04 + 15.0 * (1.0 / left - 1.0 / 90.0);
        let noise = (0..12)
            .map(|_| generator.random_range(0.0..1.0))
            .sum::<f64>()
            - 6.0;
        let index = usize::try_from(hour).unwrap();
        (start() + hour.hours(), read(index, moved + 0.1 * noise))
    });
    readings.collect()
}

fn first_red(readings: &[(Timestamp, f64)]) -> Option<Timestamp> {
    let mut settings = Settings::default();
    settings.policy.evacuation_time = 12.hours().try_into().unwrap();
    let events = play(&mut Monitor::new(settings), readings, Unit::MM);
    let red = events.into_iter().find(|event| {
        matches!(
            event.kind,
            EventKind::Alert {
                level: Level::Red,
                ..
            }
        )
    });
    red.map(|event| event.time)
}

/// An offset that passes, or another unit that ends, hides no later acceleration.
#[test]
fn readings_that_were_wrong_for_a_while_delay_no_later_red() {
    let as_read = first_red(&to_a_collapse(|_, value| value)).unwrap();
    let is_wrong = |hour: usize| (200..210).contains(&hour);
    for (what, wrong) in [
        ("27 mm too low", (|value| value - 27.0) as fn(f64) -> f64),
        ("300 mm too low", |value| value - 300.0),
        ("in metres", |value| (100.0 * value).round() / 1e5),
    ] {
        let readings = to_a_collapse(
            |hour, value| {
                if is_wrong(hour) { wrong(value) } else { value }
            },
        );
        let red = first_red(&readings).unwrap();
        assert!(
            red <= as_read + 6.hours(),
            "{what}: {red}, and {as_read} without"
        );
    }
}
