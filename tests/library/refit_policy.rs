//! Which readings are refitted, and what acts at those that are not.

use jiff::{SignedDuration, Timestamp};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::alert::{Level, Threshold};
use slipwatch::monitor::{AlertState, Event, EventKind, Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Unit};

/// Readings of a young record, each of which is refitted.
const YOUNG: usize = 1000;
const NOISE_MM: f64 = 0.1;

/// Steady creep of 24 mm a day.
fn creep(readings: usize, minutes: i64) -> Vec<(Timestamp, f64)> {
    let mut generator = Pcg64::seed_from_u64(7);
    let each = (0..i64::try_from(readings).unwrap()).map(|index| {
        let noise: f64 = generator.sample(StandardNormal);
        let time = Timestamp::from_second(60 * minutes * index).unwrap();
        (time, (minutes * index) as f64 / 60.0 + NOISE_MM * noise)
    });
    each.collect()
}

/// The events after each reading.
fn reported(settings: &Settings, readings: &[(Timestamp, f64)]) -> Vec<Vec<Event>> {
    let mut monitor = Monitor::new(settings.clone());
    let each = readings.iter().map(|(time, value)| {
        let reading = Input::Reading {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time: *time,
                value: *value,
                sigma: None,
            },
        };
        monitor.step(*time, &reading)
    });
    each.collect()
}

fn has_refit(events: &[Event]) -> bool {
    events
        .iter()
        .any(|event| matches!(event.kind, EventKind::Refit { .. }))
}

#[test]
fn an_old_record_is_refitted_each_quarter_of_an_hour_of_data_and_a_young_one_at_each_reading() {
    let readings = creep(1600, 1);
    let reported = reported(&Settings::default(), &readings);
    let refits: Vec<usize> = (0..reported.len())
        .filter(|index| has_refit(&reported[*index]))
        .collect();
    let young = refits.iter().take_while(|index| **index < YOUNG);
    assert!(
        young
            .collect::<Vec<_>>()
            .windows(2)
            .all(|pair| pair[0] + 1 == *pair[1])
    );
    let old: Vec<usize> = refits
        .into_iter()
        .filter(|index| *index >= YOUNG - 1)
        .collect();
    assert!(
        old.windows(2).all(|pair| pair[1] - pair[0] <= 15),
        "{old:?}"
    );
    // One in 15, and hardly a reading that was not predicted.
    assert!((40..=44).contains(&old.len()), "{}", old.len());
}

#[test]
fn a_reading_that_was_not_foreseen_is_refitted_at_once() {
    let mut readings = creep(1100, 1);
    let quiet = reported(&Settings::default(), &readings);
    let refits: Vec<usize> = (YOUNG..1100)
        .filter(|index| has_refit(&quiet[*index]))
        .collect();
    let between = refits[1] + 3;
    assert!(!has_refit(&quiet[between]));
    readings[between].1 += 10.0 * NOISE_MM;
    assert!(has_refit(
        &reported(&Settings::default(), &readings)[between]
    ));
}

#[test]
fn readings_as_far_apart_as_a_quarter_of_an_hour_are_all_refitted() {
    let reported = reported(&Settings::default(), &creep(1050, 15));
    assert!(reported[YOUNG..].iter().all(|events| has_refit(events)));
}

#[test]
fn plain_thresholds_act_at_readings_that_are_not_refitted() {
    let readings = creep(1200, 1);
    let quiet = reported(&Settings::default(), &readings);
    let first = readings[0].1;
    let highest = |index: usize| {
        readings[..index]
            .iter()
            .map(|one| one.1)
            .fold(f64::MIN, f64::max)
    };
    let is_new = |index: &usize| readings[*index].1 > highest(*index);
    let crossing = (YOUNG..1200)
        .filter(is_new)
        .find(|index| !has_refit(&quiet[*index]))
        .unwrap();
    let mut settings = Settings::default();
    // No forecast calls a level.
    let policy = &mut settings.policy;
    (
        policy.red_chance,
        policy.orange_chance,
        policy.yellow_chance,
    ) = (2.0, 2.0, 2.0);
    settings.policy.thresholds.push(Threshold {
        level: Level::Red,
        velocity_mm_per_day: None,
        displacement_mm: Some(readings[crossing].1 - first),
        acceleration_mm_per_day2: None,
    });
    let reported = reported(&settings, &readings);
    let is_alert = |event: &Event| {
        matches!(&event.kind, EventKind::Alert { level: Level::Red, state: AlertState::Firing, rule, .. }
            if rule == "displacement-threshold")
    };
    let alerts: Vec<usize> = (0..reported.len())
        .filter(|index| reported[*index].iter().any(is_alert))
        .collect();
    assert_eq!(alerts, [crossing]);
    assert!(!has_refit(&reported[crossing]));
    assert_eq!(
        settings.policy.evacuation_time,
        SignedDuration::from_hours(24)
    );
}

#[test]
fn steady_creep_read_each_minute_stays_below_orange() {
    let reported = reported(&Settings::default(), &creep(1600, 1));
    let is_high = |event: &&Event| matches!(event.kind, EventKind::Alert { level, .. } if level >= Level::Orange);
    let high: Vec<&Event> = reported.iter().flatten().filter(is_high).collect();
    assert!(high.is_empty(), "{high:#?}");
}
