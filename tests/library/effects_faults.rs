//! Faults of the data in the measured series and the recordings: those that are known, and no others.
#![allow(missing_docs, reason = "the claims are the names")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::measured::measured;
use slipwatch::effects::{Fault, FaultKind, Inspected, inspect};
use slipwatch::reading::{BenchmarkId, Channel, Recording, Series, Timestamp, Unit, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::{Path, PathBuf};

fn read(file: PathBuf) -> Recording {
    read_files(&[file], &ReadOptions::default()).unwrap().0
}

fn benchmark<'a>(recording: &'a Recording, name: &str) -> &'a Series {
    let name = BenchmarkId::new(name);
    recording.series(Some(&name), None).unwrap()
}

/// Kind, channel, day (UTC) of each fault.
fn named(inspected: &Inspected) -> Vec<(FaultKind, String, String)> {
    let name = |fault: &Fault| {
        let channel = fault.channel.clone().unwrap_or_default();
        (fault.kind, channel, fault.at.strftime("%F").to_string())
    };
    inspected.faults.iter().map(name).collect()
}

fn expected(faults: &[(FaultKind, &str, &str)]) -> Vec<(FaultKind, String, String)> {
    let own = |&(kind, channel, day): &(FaultKind, &str, &str)| {
        (kind, channel.to_owned(), day.to_owned())
    };
    faults.iter().map(own).collect()
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn salmon_falls_loggers_were_reset_on_the_three_known_days_and_each_benchmark_has_one_outlier() {
    let file = measured("salmon_falls_2017.csv");
    let recording = read(file);
    let resets = [
        (FaultKind::Reset, "creek_sensor_raw_m", "2017-06-06", -0.659),
        (FaultKind::Reset, "creek_sensor_raw_m", "2017-09-10", 0.199),
        (FaultKind::Reset, "lake_sensor_raw_m", "2017-09-10", 0.682),
        (FaultKind::Reset, "creek_sensor_raw_m", "2018-01-23", -0.009),
        (FaultKind::Reset, "lake_sensor_raw_m", "2018-01-23", -0.103),
    ];
    for (name, outlier) in [("blkm", "2017-03-04"), ("ntoe", "2017-03-06")] {
        let inspected = inspect(benchmark(&recording, name), &recording.channels);
        let mut faults = vec![(FaultKind::Outlier, "", outlier)];
        faults.extend(resets.map(|(kind, channel, day, _)| (kind, channel, day)));
        assert_eq!(named(&inspected), expected(&faults), "{name}");
        for (fault, (.., size)) in inspected.faults[1..].iter().zip(resets) {
            assert!((fault.size.unwrap() - size).abs() < 0.002, "{fault:?}");
        }
        assert_eq!(inspected.flags, ["covariate-reset", "outlier"]);
    }
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn corrected_salmon_falls_loggers_show_what_their_owners_corrected_values_show() {
    let file = measured("salmon_falls_2017.csv");
    let recording = read(file);
    let channels = inspect(&recording.series[0], &recording.channels).channels;
    let channel = |name: &str| channels.iter().find(|one| one.name == name).unwrap();
    for (raw, corrected) in [
        ("lake_sensor_raw_m", "lake_level_m"),
        ("creek_sensor_raw_m", "creek_stage_m"),
    ] {
        let of_day = |time: Timestamp| {
            let samples = &channel(corrected).samples;
            let place = samples.binary_search_by_key(&time, |sample| sample.time);
            samples[place.unwrap()].value
        };
        for sample in &channel(raw).samples {
            let off = sample.value - of_day(sample.time);
            assert!(off.abs() < 3e-4, "{raw} {}: {off}", sample.time);
        }
    }
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn raw_salmon_falls_loggers_alone_show_the_visit_that_moved_both() {
    let file = measured("salmon_falls_2017.csv");
    let recording = read(file);
    let is_raw =
        |channel: &&Channel| !["lake_level_m", "creek_stage_m"].contains(&channel.name.as_str());
    let raw: Vec<Channel> = recording.channels.iter().filter(is_raw).cloned().collect();
    let inspected = inspect(benchmark(&recording, "blkm"), &raw);
    // The others are no larger than what creek and lake do by themselves.
    let faults = [
        (FaultKind::Outlier, "", "2017-03-04"),
        (FaultKind::Reset, "creek_sensor_raw_m", "2017-09-10"),
        (FaultKind::Reset, "lake_sensor_raw_m", "2017-09-10"),
    ];
    assert_eq!(named(&inspected), expected(&faults));
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn baishuihe_has_one_copied_reading_and_its_rain_and_level_are_its_own() {
    let file = measured("baishuihe_2006.csv");
    let recording = read(file);
    let inspected = inspect(&recording.series[0], &recording.channels);
    // Stamped at midnight, UTC+08:00.
    let at: Timestamp = "2011-03-01T00:00:00+08:00".parse().unwrap();
    let original: Timestamp = "2008-01-01T00:00:00+08:00".parse().unwrap();
    let [fault] = inspected.faults.as_slice() else {
        panic!("{:?}", inspected.faults);
    };
    assert_eq!((fault.kind, fault.at), (FaultKind::RepeatedRows, at));
    assert_eq!((fault.copy_of, fault.values), (Some(original), 1));
    assert_eq!(inspected.flags, ["repeated-rows"]);
    assert!(
        inspected
            .series
            .readings
            .iter()
            .all(|reading| reading.time != at)
    );
    assert_eq!(inspected.series.readings.len(), 72);
    assert_eq!(inspected.channels, recording.channels);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn the_columbia_speed_is_a_drawn_curve_and_is_kept_whole() {
    let file = measured("columbia_1985_marker1.csv");
    let recording = read(file);
    let inspected = inspect(&recording.series[0], &recording.channels);
    assert_eq!(inspected.flags, ["interpolated"]);
    assert_eq!(inspected.series, recording.series[0]);
    assert!(inspected.remarks[0].contains("drawn curve"));
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn the_other_measured_series_are_without_fault() {
    for name in [
        "bazimen_2006.csv",
        "century_2013_31-1930.csv",
        "century_2013_31-1931.csv",
        "century_2013_40-1938.csv",
        "century_2013_rain.csv",
        "century_2014_southwest.csv",
        "columbia_1985_rain.csv",
        "houston_msfx_2013.csv",
        "lanzada_2025_f1.csv",
        "lanzada_2025_f4.csv",
        "lanzada_2025_rock_temperature.csv",
    ] {
        without_fault(name, &read(measured(name)));
    }
}

#[test]
fn the_recordings_have_no_fault_but_the_lines_in_which_a_reservoir_was_reconstructed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    for name in [
        "century-mine-2013.mcap",
        "century-mine-2014-southwest.mcap",
        "la-clapiere-1982-1995-reconstruction.mcap",
    ] {
        without_fault(name, &read(folder.join(name)));
    }
    let vaiont = read(folder.join("vaiont-1963-reconstruction.mcap"));
    for series in &vaiont.series {
        let inspected = inspect(series, &vaiont.channels);
        let lines = [(FaultKind::Interpolated, "reservoir_level_m", "1963-08-01")];
        assert_eq!(named(&inspected), expected(&lines));
        assert!(inspected.flags.is_empty() && inspected.series == *series);
        let span = days_since(inspected.faults[0].at, inspected.faults[0].until.unwrap());
        assert!(span > 60.0, "{span}");
    }
}

/// Files of covariates alone are inspected beside a benchmark without readings.
fn without_fault(name: &str, recording: &Recording) {
    let none = Series {
        benchmark: BenchmarkId::new("none"),
        unit: Unit::MM,
        averaging: None,
        readings: Vec::new(),
    };
    let series = recording.series.iter().chain([&none]);
    for one in series {
        let inspected = inspect(one, &recording.channels);
        assert_eq!(inspected.faults, [], "{name} {}", one.benchmark);
        assert_eq!(inspected.channels, recording.channels, "{name}");
        assert_eq!(&inspected.series, one, "{name}");
    }
}
