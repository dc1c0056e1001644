//! What a person is to know at once: readings of another site, figures of another time, coordinates, rain as a total, rows that
//! are refused.

use crate::office::Office;
use jiff::SignedDuration;
use serde_json::Value;
use slipwatch::reading::Timestamp;
use slipwatch::runtime::clock;
use std::fmt::Write as _;
use std::fs;

const ROWS: i32 = 150;

/// A number within a half of zero that looks drawn.
fn drawn(row: i32) -> f64 {
    f64::from((row * 7919 + 104) % 1009) / 1009.0 - 0.5
}

/// Hourly readings up to `ends` from now, on the way to a collapse after 250 of them.
fn to_collapse(slip_mm: f64, ends: SignedDuration) -> String {
    let newest = clock::now() + ends;
    (0..ROWS).fold("time,P1_displacement_mm\n".to_owned(), |mut text, row| {
        let time = newest - SignedDuration::from_hours(i64::from(ROWS - 1 - row));
        let value = -slip_mm * (1.0 - f64::from(row) / 250.0).ln() + 0.05 * drawn(row);
        let _ = writeln!(text, "{time:.0},{value:.4}");
        text
    })
}

fn json(office: &Office, args: &[&str]) -> Value {
    let args = [args, &["--config", "site.toml", "--format", "json"]].concat();
    serde_json::from_str(&office.done(&args)).unwrap()
}

fn lines(office: &Office, args: &[&str]) -> Vec<Value> {
    let args = [args, &["--config", "site.toml", "--format", "json"]].concat();
    let said = office.done(&args);
    said.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Runs the daemon until it has gone through the past.
fn run(office: &Office) {
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.until("all is read", || office.log().contains("caught up"));
    office.until("the past is gone through", || {
        office.log().contains("has been gone through") || !office.log().contains("of=0")
    });
    drop(daemon);
}

fn contains_all(said: &str, parts: &[&str]) {
    for part in parts {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
}

#[test]
fn the_readings_of_another_site_in_the_state_are_named_and_init_does_not_take_them_unasked() {
    let (newest, later) = (
        SignedDuration::from_mins(-90),
        SignedDuration::from_mins(-40),
    );
    let office = Office::with(&[
        ("a.csv", &to_collapse(10.0, newest)),
        ("b.csv", &to_collapse(1.0, later)),
    ]);
    office.done(&["init", "a.csv"]);
    run(&office);
    let (_, _, err) = office.say(&["check", "site.toml"]);
    assert!(!err.contains("state folder"), "{err}");
    let said = office.refused(2, &["init", "b.csv", "--force"]);
    contains_all(
        &said,
        &[
            "150 readings of P1",
            "a.csv",
            "--state-dir \"state-b\"",
            "--state-dir state ",
        ],
    );
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    assert!(config.contains("a.csv"), "{config}");
    office.done(&["init", "b.csv", "--force", "--state-dir", "state-b"]);
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    contains_all(&config, &["state_dir = \"state-b\"", "b.csv"]);
    let (exit, _, err) = office.say(&["init", "b.csv", "--force", "--state-dir", "state"]);
    let wanted = [
        "150 readings of P1 that were read from",
        "a.csv",
        "no source of this config reads",
    ];
    assert_eq!(exit, 0, "{err}");
    contains_all(&err, &wanted);
    let (_, _, err) = office.say(&["check", "site.toml"]);
    contains_all(&err, &wanted);
    let (_, out, _) = office.say(&["doctor", "site.toml"]);
    contains_all(&out, &["doubtful  state: state folder", wanted[0]]);
    run(&office);
    contains_all(&office.log(), &wanted);
    let events = office.done(&["events", "--config", "site.toml", "--kind", "fault"]);
    contains_all(&events, &["150 readings of P1 that were read from"]);
    let (_, _, err) = office.say(&["check", "site.toml"]);
    contains_all(
        &err,
        &["300 readings of P1, a part of which was read from", "a.csv"],
    );
    // Once is enough.
    run(&office);
    let faults = lines(&office, &["events", "--kind", "fault"]);
    let inherited = faults
        .iter()
        .filter(|event| event["kind"] == "inherited-readings");
    assert_eq!(inherited.count(), 1, "{faults:?}");
}

#[test]
fn a_file_that_was_renamed_or_whose_folder_was_moved_is_no_other_site() {
    let office = Office::with(&[("a.csv", &to_collapse(10.0, SignedDuration::from_mins(-90)))]);
    office.done(&["init", "a.csv"]);
    run(&office);
    fs::copy(office.path("a.csv"), office.path("c.csv")).unwrap();
    fs::remove_file(office.path("a.csv")).unwrap();
    let (exit, _, err) = office.say(&["init", "c.csv", "--force"]);
    assert_eq!(exit, 0, "{err}");
    assert!(!err.contains("state folder"), "{err}");
}

#[test]
fn after_a_first_start_on_history_a_level_its_date_and_its_figures_are_of_one_time() {
    let office = Office::with(&[("a.csv", &to_collapse(10.0, SignedDuration::from_mins(-10)))]);
    office.done(&["init", "a.csv"]);
    run(&office);
    let called = |event: &&Value| event["benchmark"] == "P1" && event["level"] == "orange";
    let list = lines(&office, &["alerts", "list"]);
    let alert = list.iter().find(called).unwrap();
    let events = lines(&office, &["events", "--kind", "alert"]);
    let of_then = |event: &&Value| called(event) && event["time"] == alert["time"];
    let then = events.iter().find(of_then).unwrap();
    let newest = events.iter().find(called).unwrap();
    assert_ne!(
        newest["time"], then["time"],
        "the past called nothing: {events:?}"
    );
    assert_ne!(newest["text"], then["text"], "{events:?}");
    assert_eq!(alert["text"], then["text"]);
    assert_eq!(alert["key"], newest["key"], "what hooks were notified of");
    let status = json(&office, &["status"]);
    let one = &status["benchmarks"][0];
    assert_eq!(
        (&one["since"], &one["reason"]),
        (&then["time"], &then["text"])
    );
    let shown = json(&office, &["alerts", "show", "P1/orange"]);
    assert_eq!(
        (&shown["since"], &shown["text"]),
        (&then["time"], &then["text"])
    );
    assert_eq!(shown["evidence"]["time"], then["time"], "{shown}");
    assert_eq!(
        (&shown["key"], &shown["state"]),
        (&alert["key"], &"firing".into())
    );
    let time = then["time"].as_str().unwrap().parse::<Timestamp>().unwrap();
    let said = office.done(&["alerts", "show", "P1/orange", "--config", "site.toml"]);
    let since = format!("in force since {}", time.strftime("%Y-%m-%d %H:%MZ"));
    contains_all(&said, &[&since, then["text"].as_str().unwrap()]);
}
