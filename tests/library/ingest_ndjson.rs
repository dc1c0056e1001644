//! NDJSON: messages, rows, and what a killed writer leaves behind.

use crate::made_up::{assert_identical, made_up, read};
use crate::measured::measured;
use jiff::SignedDuration;
use slipwatch::reading::Unit;
use slipwatch::runtime::ingest::{Item, NDJSON, ReadOptions, TextRows, convert, write_ndjson};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// What the lines give: values, marks, or what is wrong.
fn reported(text: &str) -> Vec<String> {
    let mut rows = TextRows::new(&NDJSON, Path::new("toc.ndjson"), &ReadOptions::default());
    let mut reported = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let taken = rows.take(number, line);
        assert!(!rows.is_lost(), "every line stands for itself");
        reported.extend(taken.items.into_iter().map(|item| match item {
            Item::Reading {
                benchmark,
                unit,
                reading,
                ..
            } => format!("{benchmark}:{} {unit}", reading.value),
            Item::Sample {
                channel, sample, ..
            } => format!("{channel}:{}", sample.value),
            Item::Missing {
                benchmark, what, ..
            } => format!("{benchmark} gives {what}"),
        }));
        reported.extend(taken.fault.map(|fault| format!("fault: {fault}")));
    }
    reported
}

fn message(value: &str) -> String {
    format!(r#"{{"benchmark":"5","time":"2017-06-06T00:00:00Z","value":{value},"unit":"mm"}}"#)
}

#[test]
fn messages_and_rows_may_stand_in_one_file() {
    let text = r#"{"benchmark": "5", "quantity": "displacement", "time": "2017-06-06T00:00:00Z", "value": 1.5, "unit": "mm", "sigma": 0.1}
{"channel": "lake_level_m", "time": "2017-06-06T00:00:00Z", "value": 650}

{"time": "2017-06-06T01:00:00Z", "5_displacement_mm": 1.75, "upper_velocity_mm_per_h": 2, "rain_mm": null}
{"benchmark": 7, "time": "2017-06-06T01:00:00Z", "value": 3, "unit": "mm/day"}
"#;
    let expected = [
        "5:1.5 mm",
        "lake_level_m:650",
        "5:1.75 mm",
        "upper:2 mm/h",
        "7:3 mm/day",
    ];
    assert_eq!(reported(text), expected);
}

#[test]
fn of_a_torn_object_glued_to_the_next_one_the_intact_one_is_kept() {
    let whole = message("1");
    for cut in 1..whole.len() {
        let reported = reported(&format!("{}{}", &whole[..cut], message("2")));
        assert_eq!(reported[0], "5:2 mm", "cut at {cut}: {reported:?}");
        assert!(
            reported[1].contains("line 1") && reported.len() == 2,
            "cut at {cut}: {reported:?}"
        );
    }
}

#[test]
fn intact_objects_before_a_torn_one_or_on_one_line_are_kept() {
    let (a, b) = (message("1"), message("2"));
    assert_eq!(reported(&format!("{a}{b}")), ["5:1 mm", "5:2 mm"]);
    let reported = reported(&format!("{a}{}", &b[..30]));
    assert_eq!((reported[0].as_str(), reported.len()), ("5:1 mm", 2));
}

#[test]
fn a_value_that_is_null_nan_or_infinite_is_a_missing_reading() {
    for value in ["null", "NaN", "-Infinity", "\"NAN\"", "\"inf\""] {
        let reported = reported(&message(value));
        assert!(
            reported.len() == 1 && reported[0].starts_with("5 gives"),
            "{value}: {reported:?}"
        );
    }
    let row =
        r#"{"time":"2017-06-06T00:00:00Z","5_displacement_mm":NaN,"NaN \"x_mm":-Infinity,"b_c":1}"#;
    assert_eq!(reported(row), ["5 gives NaN", "b_c:1"]);
}

#[test]
fn what_is_no_reading_is_named_by_line_and_field() {
    let cases = [
        (message("\"1 mm\""), "field \"value\""),
        (message("1").replace("\"mm\"", "\"furlong\""), "field \"unit\": found \"furlong\""),
        (message("1").replace("00Z", "00"), "RFC 3339"),
        (message("1").replace("\"5\"", "\"\""), "expected a name"),
        (r#"{"benchmark":"5","quantity":"velocity","time":"2017-06-06T00:00:00Z","value":1,"unit":"mm"}"#.to_owned(), "a unit of velocity"),
        (r#"{"5_displacement_mm":1}"#.to_owned(), "column \"time\""),
        (r#"{"time":"2017-06-06T00:00:00Z","5_displacement_mm":[1]}"#.to_owned(), "found \"[1]\""),
        ("time,5_displacement_mm".to_owned(), "one JSON object"),
        ("[1,2]".to_owned(), "one JSON object"),
    ];
    for (line, problem) in cases {
        let reported = reported(&format!("{}\n{line}\n{}", message("1"), message("2")));
        assert_eq!(
            (reported[0].as_str(), reported[2].as_str()),
            ("5:1 mm", "5:2 mm"),
            "{line}"
        );
        assert!(
            reported[1].contains("line 2") && reported[1].contains(problem),
            "{reported:?}"
        );
    }
}

#[test]
fn a_whole_file_with_a_bad_line_is_refused() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("toc.jsonl");
    fs::write(&file, format!("{}\n{{\"benchm", message("1"))).unwrap();
    let error = read(&file).unwrap_err().to_string();
    assert!(
        error.contains("line 2") && error.contains("toc.jsonl"),
        "{error}"
    );
}

#[test]
fn a_line_in_another_unit_is_converted_to_that_of_the_first() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("toc.jsonl");
    let two_units = format!(
        "{}\n{}\n",
        message("1"),
        message("2").replace("\"mm\"", "\"cm\"")
    );
    fs::write(&file, two_units).unwrap();
    let (recording, _) = read(&file).unwrap();
    let [series] = &recording.series[..] else {
        panic!("{recording:?}");
    };
    // Of one time: the later line corrects the earlier one.
    let values: Vec<f64> = series.readings.iter().map(|one| one.value).collect();
    assert_eq!((series.unit, values), (Unit::MM, vec![20.0]));
}

#[test]
fn a_recording_converted_to_ndjson_and_back_is_the_same_but_for_its_provenance() {
    let folder = TempDir::new().unwrap();
    let lines = folder.path().join("lines.ndjson");
    let mut expected = made_up();
    expected.provenance.clear();
    assert_eq!(
        expected.series[0].averaging,
        Some(SignedDuration::from_mins(90))
    );
    let mut bytes = Vec::new();
    write_ndjson(&expected, &mut bytes).unwrap();
    fs::write(&lines, bytes).unwrap();
    assert_identical(&expected, &read(&lines).unwrap().0);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_measured_recording_converted_to_ndjson_and_back_is_the_same() {
    let folder = TempDir::new().unwrap();
    let lines = folder.path().join("lines.ndjson");
    let options = ReadOptions::default();
    for file in ["lanzada_2025_f1.csv", "baishuihe_2006.csv"].map(measured) {
        convert(&file, &lines, &options, &mut |_| {}).unwrap();
        assert_identical(&read(&file).unwrap().0, &read(&lines).unwrap().0);
    }
}
