//! Windows in which nothing was measured, and sweeps.

use crate::office::{Office, plain};

const EARLY: &str = "2010-01-01T00:00:00Z";
const LATE: &str = "2030-01-01T00:00:00Z";

#[test]
fn a_window_without_readings_is_bad_input_and_says_where_there_are_some() {
    let office = Office::with(&[("slope.csv", &plain(60))]);
    let cases: [&[&str]; 8] = [
        &["explain", "slope.csv", "--until", EARLY],
        &["explain", "slope.csv", "--from", LATE],
        &["fit", "slope.csv", "--until", EARLY],
        &["fit", "slope.csv", "--from", LATE],
        &["fit", "slope.csv", "--from", LATE, "--until", EARLY],
        &["sweep", "slope.csv", "--from", LATE],
        &["sweep", "slope.csv", "--t-max", "2030-01-01T00:00:00Z.."],
        &["sweep", "slope.csv", "--t-max", "..2010-01-01T00:00:00Z"],
    ];
    for args in cases {
        for format in ["text", "json"] {
            let (exit, out, err) = office.say(&[args, &["--format", format]].concat());
            assert_eq!(exit, 65, "{args:?}: {out}{err}");
            assert!(out.is_empty(), "{out}");
            assert!(
                err.contains("2017-05-31T22:00") || err.contains("is later than --until"),
                "{args:?}: {err}"
            );
        }
    }
}

#[test]
fn a_failure_before_all_readings_has_one_exit_code() {
    let office = Office::with(&[("slope.csv", &plain(60))]);
    let before = ["--failure-time", EARLY];
    let cases: [&[&str]; 3] = [
        &["score", "slope.csv"],
        &["plot", "slope.csv", "--kind", "forecast"],
        &["report", "slope.csv", "-o", "out", "--no-search"],
    ];
    for args in cases {
        let said = office.refused(65, &[args, &before].concat());
        assert!(said.contains("--failure-time"), "{said}");
    }
}

#[test]
fn of_too_few_readings_nothing_is_scored_and_nothing_concluded() {
    let office = Office::with(&[("slope.csv", &plain(3))]);
    for how in [&["--no-failure"][..], &["--failure-time", LATE]] {
        let said = office.refused(65, &[&["score", "slope.csv"], how].concat());
        assert!(said.contains("too few readings"), "{said}");
    }
    let said = office.done(&["explain", "slope.csv"]);
    assert!(
        said.contains("too few readings") && !said.contains("nothing that the law lacks"),
        "{said}"
    );
    // Beside a benchmark with enough of them, a mean over nothing is none.
    let long = plain(80).replacen("_mm\n", "_mm,P2_displacement_mm\n", 1);
    let long = long
        .replace("\n2017", ",\n2017")
        .replacen("_mm,\n", "_mm\n", 1);
    let long = format!("{},7\n", long.trim_end());
    let office = Office::with(&[("slope.csv", &long)]);
    let (exit, out, err) = office.say(&["score", "slope.csv", "--no-failure"]);
    assert_eq!(exit, 0, "{out}{err}");
    assert!(err.contains("benchmark P2: too few readings"), "{err}");
    let of_p2 = &out[out.find("benchmark P2").unwrap()..];
    let row = of_p2.lines().find(|line| line.starts_with("persistence"));
    let cells: Vec<&str> = row.unwrap().split_whitespace().collect();
    assert_eq!(cells[1..3], ["-", "-"], "{of_p2}");
}

#[test]
fn a_sweep_has_the_regime_under_load_first_as_fit_has() {
    // One reading off the line: on it to the last digit they have no regime.
    let readings = plain(80).replacen(",20.5\n", ",20.6\n", 1);
    assert_ne!(readings, plain(80));
    let office = Office::with(&[("slope.csv", &readings)]);
    let sweep = ["sweep", "slope.csv", "--steps", "1"];
    let json = office.done(&[&sweep[..], &["--format", "json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let fit = office.done(&["fit", "slope.csv", "--format", "json"]);
    let fit: serde_json::Value = serde_json::from_str(&fit).unwrap();
    let row = &json["rows"][0];
    assert!(row["regime_under_load"]["label"].is_string(), "{row}");
    assert_eq!(row["regime_under_load"], fit["regime_under_load"]);
    assert_eq!(row["regime"], fit["regime"]);
    let text = office.done(&sweep);
    let heads = text.lines().find(|line| line.starts_with("t_max")).unwrap();
    let (first, second) = (
        heads.find("regime").unwrap(),
        heads.find("under constant load").unwrap(),
    );
    assert!(first < second, "{heads}");
    let label = row["regime_under_load"]["label"].as_str().unwrap();
    let line = text.lines().find(|line| line.starts_with("2017")).unwrap();
    assert!(line[first..].starts_with(label), "{text}");
}
