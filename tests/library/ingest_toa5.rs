//! A Campbell logger's tables: what their headers mean, what their marks mean, and what goes wrong in them.

use crate::made_up::{assert_identical, made_up, read};
use crate::measured::measured;
use slipwatch::reading::{Conventions, LocalClock, SummerTime, Unit};
use slipwatch::runtime::ingest::{
    Item, ReadOptions, TOA5, TextRows, convert, read_files, write_toa5,
};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const HEADER: &str = r#""TOA5","Toc","CR1000","12345","CR1000.Std.32","CPU:toc.CR1","4711","Hourly"
"TIMESTAMP","RECORD","5_displacement","upper_displacement_mm","Rain_Tot","AirT_TMx","lake_level_m"
"TS","RN","mm","","mm","",""
"","","Avg","Smp","Tot","TMx","Smp"
"#;

fn write(folder: &TempDir, text: &str) -> PathBuf {
    let file = folder.path().join("toc.dat");
    fs::write(&file, text).unwrap();
    file
}

fn in_rome(summer_time: SummerTime) -> ReadOptions {
    let zone = jiff::tz::TimeZone::get("Europe/Rome").unwrap();
    let clock = LocalClock {
        zone: Some(zone),
        summer_time,
    };
    ReadOptions {
        conventions: Conventions {
            clock,
            ..Conventions::default()
        },
        ..ReadOptions::default()
    }
}

/// What each line gives: values, marks, or what is wrong.
fn reported(rows: &mut TextRows, text: &str) -> Vec<String> {
    let mut reported = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let taken = rows.take(number, line);
        reported.extend(taken.items.into_iter().map(|item| match item {
            Item::Reading {
                benchmark, reading, ..
            } => format!("{benchmark}:{}", reading.value),
            Item::Sample {
                channel, sample, ..
            } => format!("{channel}:{}", sample.value),
            Item::Missing {
                benchmark, what, ..
            } => format!("{benchmark} gives {what}"),
        }));
        reported.extend(taken.fault.map(|fault| fault.to_string()));
    }
    reported
}

fn rows(options: &ReadOptions) -> TextRows {
    TextRows::new(&TOA5, Path::new("toc.dat"), options)
}

#[test]
fn names_units_and_times_of_a_logger_are_understood() {
    let folder = TempDir::new().unwrap();
    let text = format!(
        "{HEADER}\"2017-06-06 17:00:00\",4294967295,1.5,20,0.2,\"2017-06-06 16:12:00\",650.25\r\n\
         \"2017-06-06 18:00:00.25\",0,1.75,21,0,\"2017-06-06 17:48:00\",650.5\r\n"
    );
    let (recording, disorder) = read(&write(&folder, &text)).unwrap();
    assert_eq!(disorder.missing, 0);
    let series: Vec<_> = recording
        .series
        .iter()
        .map(|series| (series.benchmark.as_str(), series.unit))
        .collect();
    assert_eq!(series, [("5", Unit::MM), ("upper", Unit::MM)]);
    let channels: Vec<_> = recording
        .channels
        .iter()
        .map(|channel| (channel.name.as_str(), channel.unit.as_deref()))
        .collect();
    let expected = [("Rain_Tot_mm", Some("mm")), ("lake_level_m", Some("m"))];
    assert_eq!(channels, expected);
    let times: Vec<String> = recording.series[0]
        .readings
        .iter()
        .map(|reading| reading.time.to_string())
        .collect();
    assert_eq!(times, ["2017-06-06T17:00:00Z", "2017-06-06T18:00:00.25Z"]);
}

#[test]
fn nan_and_the_loggers_codes_are_missing_readings_and_never_values() {
    let text = format!(
        "{HEADER}\"2017-06-06 17:00:00\",1,\"NAN\",-7999,\"NAN\",\"\",\"INF\"\n\
         \"2017-06-06 18:00:00\",2,\"-INF\",-99999.0,0,\"\",1\n"
    );
    let expected = [
        "5 gives NAN",
        "upper gives -7999",
        "5 gives -INF",
        "upper gives -99999.0",
        "Rain_Tot_mm:0",
        "lake_level_m:1",
    ];
    assert_eq!(
        reported(&mut rows(&ReadOptions::default()), &text),
        expected
    );
    let folder = TempDir::new().unwrap();
    let (recording, disorder) = read(&write(&folder, &text)).unwrap();
    assert_eq!((recording.series.len(), disorder.missing), (0, 4));
}

#[test]
fn the_loggers_zone_holds_and_its_standard_time_has_no_summer() {
    let folder = TempDir::new().unwrap();
    let text = format!("{HEADER}\"2017-06-06 17:00:00\",1,1,2,0,\"\",650\n");
    let file = write(&folder, &text);
    let time = |options: &ReadOptions| {
        let (recording, _) = read_files(std::slice::from_ref(&file), options).unwrap();
        recording.series[0].readings[0].time.to_string()
    };
    assert_eq!(time(&in_rome(SummerTime::Reject)), "2017-06-06T15:00:00Z");
    assert_eq!(time(&in_rome(SummerTime::Standard)), "2017-06-06T16:00:00Z");
}

#[test]
fn an_hour_that_came_twice_is_quarantined_with_its_line_and_the_next_one_is_taken() {
    let text = format!(
        "{HEADER}\"2017-10-29 02:30:00\",1,1,2,0,\"\",650\n\
         \"2017-10-29 03:30:00\",2,3,4,0,\"\",650\n"
    );
    let reported = reported(&mut rows(&in_rome(SummerTime::Reject)), &text);
    assert!(
        reported[0].contains("line 5") && reported[0].contains("twice"),
        "{reported:?}"
    );
    assert_eq!(reported[1..3], ["5:3", "upper:4"]);
}

#[test]
fn a_header_in_the_middle_holds_for_what_follows() {
    let second = HEADER
        .replace(
            "\"5_displacement\",\"upper_displacement_mm\"",
            "\"upper_displacement_mm\",\"5_displacement\"",
        )
        .replace("\"RN\",\"mm\",\"\"", "\"RN\",\"\",\"mm\"");
    let row = |hour: u32| format!("\"2017-06-06 {hour}:00:00\",1,1,2,0,\"\",650\n");
    let text = format!("{HEADER}{}{second}{}", row(17), row(18));
    let reported = reported(&mut rows(&ReadOptions::default()), &text);
    let readings: Vec<_> = reported.iter().filter(|one| !one.contains('_')).collect();
    assert_eq!(readings, ["5:1", "upper:2", "upper:1", "5:2"]);
}

#[test]
fn a_row_torn_by_a_power_failure_costs_itself_and_not_the_header_behind_it() {
    let row = |hour: u32| format!("\"2017-06-06 {hour}:00:00\",1,1,2,0,\"\",650\n");
    let text = format!(
        "{HEADER}{}\"2017-06-06 18:00:00\",2,1{HEADER}{}",
        row(17),
        row(19)
    );
    let reported = reported(&mut rows(&ReadOptions::default()), &text);
    assert!(
        reported[4].contains("line 6") && reported[4].contains("a header within"),
        "{reported:?}"
    );
    assert_eq!(reported[5..7], ["5:1", "upper:2"]);
}

#[test]
fn after_a_header_that_is_not_understood_no_row_is_taken_until_one_is() {
    let bad = HEADER.replace("upper_displacement_mm", "5_displacement_cm");
    let row = |hour: u32| format!("\"2017-06-06 {hour}:00:00\",1,1,2,0,\"\",650\n");
    let text = format!("{HEADER}{}{bad}{}{HEADER}{}", row(17), row(18), row(19));
    let mut reader = rows(&ReadOptions::default());
    let reported = reported(&mut reader, &text);
    assert!(reported[4].contains("another such column"), "{reported:?}");
    assert!(
        reported[5].contains("line 10") && reported[5].contains("no header"),
        "{reported:?}"
    );
    assert_eq!(reported[6..8], ["5:1", "upper:2"]);
    assert!(!reader.is_lost());
}

#[test]
fn a_file_that_is_no_toa5_or_contradicts_itself_is_refused_with_the_place() {
    let folder = TempDir::new().unwrap();
    let units = HEADER
        .replace("upper_displacement_mm", "upper_displacement_cm")
        .replace("\"mm\",\"\",\"mm\"", "\"mm\",\"mm\",\"mm\"");
    let short = HEADER.replace("\"TS\",\"RN\"", "\"TS\"");
    let cases = [
        (
            "time,displacement_mm\n",
            "line 1: found a row under no header",
        ),
        (
            &units,
            "line 2, column \"upper_displacement_cm\": the units line gives it another unit",
        ),
        (&short, "line 2: found [7, 6, 7] names"),
        ("", "found no row"),
        (HEADER, "found no row"),
    ];
    for (text, problem) in cases {
        let error = read(&write(&folder, text)).unwrap_err().to_string();
        assert!(
            error.contains(problem) && error.contains("toc.dat"),
            "{error}"
        );
    }
}

#[test]
fn the_lines_of_the_header_are_all_that_a_reader_needs_to_go_on() {
    let options = ReadOptions::default();
    let mut first = rows(&options);
    assert!(first.header().is_empty());
    assert!(reported(&mut first, HEADER).is_empty());
    let mut second = rows(&options);
    for (line, number) in first.header().to_vec().iter().zip(1..) {
        assert!(second.take(number, line).fault.is_none());
    }
    let row = "\"2017-06-06 17:00:00\",1,1,2,0,\"\",650";
    assert_eq!(reported(&mut second, row), reported(&mut first, row));
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_measured_recording_converted_to_toa5_and_back_is_the_same_readings() {
    let folder = TempDir::new().unwrap();
    let options = ReadOptions::default();
    let names = [
        "lanzada_2025_f1.csv",
        "baishuihe_2006.csv",
        "columbia_1985_marker1.csv",
    ];
    for file in names.map(measured) {
        let table = folder.path().join("table.dat");
        let back = folder.path().join("back.csv");
        convert(&file, &table, &options, &mut |_| {}).unwrap();
        convert(&table, &back, &options, &mut |_| {}).unwrap();
        let (original, _) = read(&file).unwrap();
        let (there, disorder) = read(&table).unwrap();
        assert_eq!(disorder, slipwatch::reading::Disorder::default());
        assert_identical(&original, &there);
        assert_identical(&original, &read(&back).unwrap().0);
    }
}

#[test]
fn a_recording_converted_to_toa5_and_back_is_the_same_readings() {
    let folder = TempDir::new().unwrap();
    let mut expected = made_up();
    expected.provenance.clear();
    expected.series[0].averaging = None;
    let table = folder.path().join("made-up.dat");
    let mut bytes = Vec::new();
    write_toa5(&expected, &mut bytes).unwrap();
    fs::write(&table, bytes).unwrap();
    assert_identical(&expected, &read(&table).unwrap().0);
}

#[test]
fn a_value_that_would_read_back_as_missing_is_not_written() {
    let mut recording = made_up();
    recording.series[1].readings[0].value = -7999.0;
    let error = write_toa5(&recording, Vec::new()).unwrap_err().to_string();
    assert!(error.contains("-7999"), "{error}");
}
