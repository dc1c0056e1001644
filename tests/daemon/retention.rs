//! What the state keeps over the years, and how large it becomes.

use crate::identity::red_fires;
use jiff::{SignedDuration, Timestamp};
use slipwatch::alert::Level;
use slipwatch::monitor::{
    AlertState, CalledLevel, ChancesOfCollapse, Event, EventKind, FailureTime, Input,
    InverseVelocity, LevelChance, RegimeReport,
};
use slipwatch::reading::{BenchmarkId, Reading, Unit};
use slipwatch::regime::Regime;
use slipwatch::store::{Batch, Delivery, DeliveryOutcome, Store, StoreError};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

const DAY: i64 = 86_400;

fn at(second: i64) -> Timestamp {
    Timestamp::from_second(second).unwrap()
}

fn event(kind: EventKind, benchmark: &BenchmarkId, time: Timestamp) -> Event {
    Event {
        time,
        benchmark: Some(benchmark.clone()),
        kind,
    }
}

fn fault() -> EventKind {
    EventKind::Fault {
        kind: "stuck".to_owned(),
        text: "24 readings in a row are the same".to_owned(),
    }
}

fn level_chance() -> LevelChance {
    LevelChance {
        chance: 0.123_456_789_012_345_6,
        within_hours: 24.123_456_789_012_345,
        at_least: 0.05,
    }
}

/// A refit with all that one of a moving slope says.
fn refit(time: Timestamp) -> EventKind {
    let probabilities = Regime::KNOWN
        .into_iter()
        .map(|regime| (regime, 0.123_456_789_012_345_6));
    let later = |days: i64| Some(time + SignedDuration::new(days * DAY, 123_456_789));
    EventKind::Refit {
        t_max: time,
        regime: RegimeReport {
            label: Regime::Undetermined,
            probability_unstable: 0.123_456_789_012_345_6,
            probability_accelerating: 0.123_456_789_012_345_6,
            probabilities: probabilities.collect(),
            r_per_day: Some(0.012_345_678_901_234_56),
            kappa_per_day: Some(-0.012_345_678_901_234_56),
        },
        chances_of_collapse: Some(Box::new(ChancesOfCollapse {
            within_1_day: 0.123_456_789_012_345_6,
            within_2_days: 0.123_456_789_012_345_6,
            within_7_days: 0.123_456_789_012_345_6,
            within_30_days: 0.123_456_789_012_345_6,
        })),
        failure_time: FailureTime {
            low: later(3),
            median: later(30),
            high: later(300),
            probability: 0.123_456_789_012_345_6,
            horizon_days: 400.0,
        },
        critical_velocity_time: Box::new(FailureTime {
            low: later(4),
            median: later(31),
            high: later(301),
            probability: 0.123_456_789_012_345_6,
            horizon_days: 400.0,
        }),
        probability_of_acceleration: 0.123_456_789_012_345_6,
        inverse_velocity: InverseVelocity {
            failure_time: later(7),
            r_squared: Some(0.123_456_789_012_345_6),
        },
        transition_time: later(8),
        velocity_mm_per_day: Some(0.123_456_789_012_345_6),
        chance_within_evacuation_time: 0.123_456_789_012_345_6,
        chance_within_outlook: 0.123_456_789_012_345_6,
        called: Some(Box::new(CalledLevel {
            level: Level::Yellow,
            rule: "chance-within-outlook".to_owned(),
            pending: Vec::new(),
            red: level_chance(),
            orange: level_chance(),
            yellow: level_chance(),
        })),
        plain: None,
    }
}

fn reading(benchmark: &BenchmarkId, time: Timestamp) -> Input {
    Input::Reading {
        benchmark: benchmark.clone(),
        unit: Unit::MM,
        averaging: None,
        reading: Reading {
            time,
            value: time.as_second() as f64 * 1.234_567e-6,
            sigma: None,
        },
    }
}

/// A reading and a refit of each benchmark at each hour, and a fault at noon.
fn take(store: &Store, benchmarks: &[BenchmarkId], hours: std::ops::Range<i64>) {
    let mut batch = Batch::default();
    for hour in hours {
        let time = at(3600 * hour);
        for benchmark in benchmarks {
            let mut events = vec![event(refit(time), benchmark, time)];
            events.extend((hour % 24 == 12).then(|| event(fault(), benchmark, time)));
            batch.step(time, &reading(benchmark, time), &events);
        }
    }
    store.commit(&batch).unwrap();
}

fn thin(store: &Store, before: Timestamp) {
    while store.thin(before).unwrap() {}
}

/// Time, kind and benchmark of every event.
fn kept(store: &Store) -> Vec<(i64, String, String)> {
    let (mut kept, mut after) = (Vec::new(), 0);
    loop {
        let some = store.events(after, None, None).unwrap();
        let Some((last, _)) = some.last() else {
            return kept;
        };
        after = *last;
        for (_, body) in some {
            let event: Event = serde_json::from_str(&body).unwrap();
            let benchmark = event.benchmark.unwrap().to_string();
            kept.push((
                event.time.as_second(),
                event.kind.name().to_owned(),
                benchmark,
            ));
        }
    }
}

#[test]
fn of_old_refits_the_first_of_each_day_and_benchmark_stays_and_of_the_rest_everything() {
    let folder = tempfile::tempdir().unwrap();
    let benchmarks = ["5", "6"].map(BenchmarkId::new);
    let mut store = Store::open(folder.path()).unwrap();
    // From 05:00 on: the first of a day is not at midnight.
    take(&store, &benchmarks, 5..10 * 24);
    let all = kept(&store);
    let steps = store.last_step();
    // As data time goes on, and with restarts between.
    for hour in (24..7 * 24).step_by(9) {
        store.thin(at(3600 * hour)).unwrap();
        drop(store);
        store = Store::open(folder.path()).unwrap();
    }
    let limit = 7 * DAY;
    thin(&store, at(limit));
    let mut days = BTreeSet::new();
    let expected = all.into_iter().filter(|(time, kind, benchmark)| {
        kind != "refit" || *time >= limit || days.insert((time / DAY, benchmark.clone()))
    });
    assert_eq!(kept(&store), expected.collect::<Vec<_>>());
    assert_eq!(store.last_step(), steps);
    assert_eq!(
        store.steps(0).unwrap().len(),
        usize::try_from(steps).unwrap()
    );
}

#[test]
fn a_refit_on_which_an_alert_rests_stays() {
    let folder = tempfile::tempdir().unwrap();
    let benchmarks = ["5", "6"].map(BenchmarkId::new);
    let store = Store::open(folder.path()).unwrap();
    take(&store, &benchmarks, 0..17);
    let time = at(16 * 3600);
    let red = EventKind::Alert {
        level: Level::Red,
        state: AlertState::Firing,
        key: format!("5/red/{time}"),
        rule: "chance-for-red".to_owned(),
        text: "red".to_owned(),
    };
    let mut batch = Batch::default();
    let called = [event(red, &benchmarks[0], time)];
    batch.step(time, &reading(&benchmarks[0], time), &called);
    store.commit(&batch).unwrap();
    take(&store, &benchmarks, 17..24);
    thin(&store, at(100 * DAY));
    let refits = kept(&store)
        .into_iter()
        .filter(|(_, kind, _)| kind == "refit");
    let refits: Vec<(i64, String)> = refits.map(|(time, _, id)| (time / 3600, id)).collect();
    // The newest event is never taken out.
    let expected = [(0, "5"), (0, "6"), (16, "5"), (23, "6")];
    assert_eq!(refits, expected.map(|(hour, id)| (hour, id.to_owned())));
}

#[test]
fn before_any_value_there_is_nothing_to_thin() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    assert!(!store.thin(Timestamp::MIN).unwrap());
}

#[test]
fn what_follows_thinned_events_gets_a_number_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let benchmarks = ["5"].map(BenchmarkId::new);
    let store = Store::open(folder.path()).unwrap();
    take(&store, &benchmarks, 0..12);
    let last = store.events(0, None, None).unwrap().last().unwrap().0;
    thin(&store, at(100 * DAY));
    drop(store);
    let store = Store::open(folder.path()).unwrap();
    take(&store, &benchmarks, 12..13);
    let after = store.events(last, None, None).unwrap();
    assert_eq!(after.len(), 2, "a refit and a fault");
}

fn delivery(key: &str, state: &str, time: Timestamp) -> Delivery {
    Delivery {
        key: key.to_owned(),
        level: "red".to_owned(),
        state: state.to_owned(),
        hook: "hook".to_owned(),
        time,
        noted: time,
        body: vec![1],
    }
}

#[test]
fn deliveries_stay_while_their_alert_stands_or_a_hook_waits() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let settle = |key: &str, state: &str, day: i64, fate: DeliveryOutcome| {
        let notified = delivery(key, state, at(day * DAY));
        store.record_outcomes(&[(notified, fate)]).unwrap();
    };
    settle("over", "firing", 1, DeliveryOutcome::Delivered);
    settle("over", "resolved", 2, DeliveryOutcome::Delivered);
    settle("stands", "firing", 1, DeliveryOutcome::Delivered);
    settle("just over", "firing", 1, DeliveryOutcome::Delivered);
    settle("just over", "resolved", 200, DeliveryOutcome::Delivered);
    settle("given up", "firing", 1, DeliveryOutcome::Dead);
    settle("given up", "resolved", 2, DeliveryOutcome::Delivered);
    let mut batch = Batch::default();
    batch.deliver(delivery("waits", "firing", at(DAY)));
    batch.deliver(delivery("waits", "resolved", at(2 * DAY)));
    store.commit(&batch).unwrap();
    thin(&store, at(100 * DAY));
    let is_there = |key: &str| store.is_noted(red_fires(key), None, None).unwrap();
    for key in ["stands", "just over", "given up", "waits"] {
        assert!(is_there(key), "{key}");
    }
    assert!(!is_there("over"));
    assert_eq!(store.outbox(&[]).unwrap().0, 2);
}

#[test]
fn a_later_versions_tables_are_refused_and_an_empty_file_gets_ours() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("slipwatch.db");
    fs::write(&file, "").unwrap();
    drop(Store::open(folder.path()).unwrap());
    let connection = rusqlite::Connection::open(&file).unwrap();
    let version: i64 = connection
        .pragma_query_value(None, "user_version", |row| row.get(0))
        .unwrap();
    assert_eq!(version, 8);
    connection.pragma_update(None, "user_version", 9).unwrap();
    drop(connection);
    for refused in [Store::open(folder.path()), Store::look(folder.path())] {
        assert!(
            matches!(refused, Err(StoreError::Newer { version: 9 })),
            "{refused:?}"
        );
    }
}

#[test]
fn tables_of_the_version_before_are_brought_up_and_what_they_hold_stays() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("slipwatch.db");
    drop(Store::open(folder.path()).unwrap());
    let connection = rusqlite::Connection::open(&file).unwrap();
    let before =
        "DROP INDEX event_at; ALTER TABLE step DROP COLUMN sum; ALTER TABLE event DROP COLUMN sum;
                  ALTER TABLE outbox DROP COLUMN sum;
                  ALTER TABLE series DROP COLUMN sum; ALTER TABLE latest DROP COLUMN sum;
                  ALTER TABLE outbox DROP COLUMN noted; DROP TABLE used_link; DROP TABLE broker_session;
                  INSERT INTO step (seq, now) VALUES (1, 5); PRAGMA user_version = 1;";
    connection.execute_batch(before).unwrap();
    drop(connection);
    assert!(
        Store::look(folder.path()).is_err(),
        "it is to be brought up first"
    );
    let store = Store::open(folder.path()).unwrap();
    assert_eq!(store.steps(0).unwrap().len(), 1);
}

/// The database with its log, bytes.
fn size(folder: &Path) -> u64 {
    let files = ["slipwatch.db", "slipwatch.db-wal", "slipwatch.db-shm"];
    let sizes = files.map(|name| fs::metadata(folder.join(name)).map_or(0, |file| file.len()));
    sizes.iter().sum()
}

#[test]
#[ignore = "minutes: 3.5 million steps; cargo test --test daemon retention:: -- --ignored --nocapture"]
fn ten_years_of_forty_benchmarks_at_an_hour_stay_under_a_gibibyte() {
    let folder = tempfile::tempdir().unwrap();
    let benchmarks: Vec<BenchmarkId> = (0..40)
        .map(|n| BenchmarkId::new(format!("b{n:02}")))
        .collect();
    let store = Store::open(folder.path()).unwrap();
    let (mut largest, mut largest_log) = (0, 0);
    for day in 0..3652 {
        take(&store, &benchmarks, 24 * day..24 * (day + 1));
        thin(&store, at((day - 90) * DAY));
        largest = largest.max(size(folder.path()));
        let log = fs::metadata(folder.path().join("slipwatch.db-wal")).map_or(0, |file| file.len());
        largest_log = largest_log.max(log);
    }
    let body = serde_json::to_string(&event(refit(at(0)), &benchmarks[0], at(0))).unwrap();
    let (steps, events) = (store.last_step(), kept(&store).len());
    println!(
        "{steps} steps, {events} events kept, a refit of {} bytes: at most {largest} bytes, {largest_log} of them log",
        body.len()
    );
    assert_eq!(steps, 40 * 24 * 3652);
    assert!(largest < 1 << 30, "{largest}");
}
