//! What `check` says of files in which much is wrong, beside what the daemon does with them.

use crate::office::{Office, site};
use jiff::{SignedDuration, Timestamp};
use slipwatch::runtime::clock::{self, Stopwatch};
use std::fmt::Write as _;
use std::fs;
use std::time::Duration;

const HEADER: &str = "time,P1_displacement_mm\n";

/// The preview of `check --format json`.
fn looked(office: &Office) -> serde_json::Value {
    let (_, json, err) = office.say(&["check", "site.toml", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap_or_else(|_| panic!("{err}"));
    json["preview"].clone()
}

/// Half-hourly rows from so many half hours before now.
fn half_hourly(halves: std::ops::Range<i64>) -> String {
    let now = clock::now();
    let row = |half: i64| {
        let time = now + SignedDuration::from_mins(30 * half);
        format!("{time},{}\n", 20.0 + 0.01 * half as f64)
    };
    halves.map(row).collect()
}

#[test]
fn a_value_that_is_corrected_back_is_the_one_that_the_daemon_takes() {
    let earlier = half_hourly(-40..-1);
    let time = clock::now();
    let row = |value: f64| format!("{time},{value}\n");
    let values = |values: &[f64]| values.iter().map(|value| row(*value)).collect::<String>();
    for (last, wanted, counts) in [
        (&[2.0, -40.0, 2.0][..], 2.0, (2, 0)),
        // As in a file that is read again from its start.
        (&[2.0, -40.0, 2.0, -40.0], -40.0, (1, 2)),
    ] {
        let text = format!("{HEADER}{earlier}{}", values(last));
        let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
        let one = &looked(&office)["benchmarks"][0];
        assert_eq!(one["last"][1], wanted, "{one}");
        let (corrected, repeated) = counts;
        assert_eq!(
            (&one["readings"], &one["corrected"], &one["repeated"]),
            (&40.into(), &corrected.into(), &repeated.into()),
            "{one}"
        );
        let daemon = office.run_logged(&["run", "site.toml"]);
        let taken = format!("taken={} repeated={repeated} ", 40 + corrected);
        office.until("all is read", || office.log().contains("caught up"));
        drop(daemon);
        let log = office.log();
        let line = log.lines().find(|line| line.contains("caught up")).unwrap();
        assert!(line.contains(&taken), "no {taken:?} in {log}");
        let out = office.done(&["replay", "--state", "state", "--record", "out.mcap"]);
        assert!(office.path("out.mcap").exists(), "{out}");
        office.done(&["convert", "out.mcap", "out.csv"]);
        let table = fs::read_to_string(office.path("out.csv")).unwrap();
        let newest = table.lines().last().unwrap();
        let value: f64 = newest.split(',').nth(1).unwrap().parse().unwrap();
        assert!((value - wanted).abs() < 1e-9, "{newest}");
    }
}

#[test]
fn many_readings_of_one_time_take_no_longer_to_look_at_than_others() {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let spent = |apart: i64| {
        let rows = (0..400_000).fold(HEADER.to_owned(), |mut text, row: i64| {
            let time = start + SignedDuration::from_secs(apart * row);
            let _ = writeln!(text, "{time},{row}.5");
            text
        });
        let office = Office::with(&[("slope.csv", &rows), ("site.toml", &site("slope.csv", ""))]);
        let begun = Stopwatch::start();
        office.say(&["check", "site.toml"]);
        begun.elapsed()
    };
    let (of_many, of_one) = (spent(60), spent(0));
    assert!(
        of_one < 2 * of_many + Duration::from_secs(2),
        "{of_one:?} and {of_many:?}"
    );
}
