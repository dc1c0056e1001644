//! Partitions are found where benchmarks part and nowhere else; what a covariate's turn does not do is said.
#![allow(missing_docs, reason = "the claims are the names")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "the figures of the draws are shown")]

use crate::measured::measured;
use crate::slopes::{Fate, day_zero, slope};
use slipwatch::effects::{
    Explained, Kind, Options, explain_together, partition, partition_candidate, remarks,
};
use slipwatch::reading::{Recording, Series, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::{Path, PathBuf};

const DRAWS: u64 = 30;

fn options() -> Options {
    Options {
        surrogates: 99,
        ..Options::default()
    }
}

/// How many of the draws part, how many into the right groups, and how many at a time whose interval holds
/// the true one.
fn tally(fate: Fate, is_velocity: bool, draws: u64) -> (usize, usize, usize) {
    let mut tally = (0, 0, 0);
    for seed in 0..draws {
        let made = slope(fate, seed, is_velocity);
        let all: Vec<&Series> = made.series.iter().collect();
        let (found, candidate) = partition(&all, &options());
        assert_eq!(found.is_none(), candidate.rejected_because.is_some());
        let Some(found) = found else { continue };
        tally.0 += 1;
        let mut groups = found.groups.clone();
        groups.sort();
        tally.1 += usize::from(groups == made.groups);
        let interval = found.at_interval.map(|time| days_since(day_zero(), time));
        tally.2 += usize::from(interval[0] <= made.at && made.at <= interval[1]);
    }
    println!(
        "{fate:?}, velocities {is_velocity}: parted, right groups, time held: {tally:?} of {draws}"
    );
    tally
}

fn recording(file: PathBuf) -> Recording {
    read_files(&[file], &ReadOptions::default()).unwrap().0
}

fn archived(name: &str) -> Recording {
    recording(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("recordings")
            .join(name),
    )
}

#[test]
fn displacements_that_part_are_found_in_their_groups() {
    let (found, right, held) = tally(Fate::Parted, false, DRAWS);
    assert!(found >= 24 && right >= 23 && held >= 21);
}

#[test]
fn velocities_that_part_are_found_in_their_groups() {
    let (found, right, held) = tally(Fate::Parted, true, DRAWS);
    assert!(found >= 24 && right >= 23 && held >= 21);
}

#[test]
fn groups_that_begin_to_drift_apart_are_rarely_named_wrongly() {
    let (found, right, _) = tally(Fate::Parting, true, DRAWS);
    assert!(found >= 12 && right + 2 >= found);
}

#[test]
fn one_motion_with_offsets_and_stray_readings_does_not_part() {
    let mut parted = 0;
    for fate in [Fate::Together, Fate::OneOffset, Fate::Strays] {
        parted += tally(fate, false, DRAWS).0 + tally(fate, true, DRAWS).0;
    }
    assert!(parted <= 4, "{parted} of {}", 6 * DRAWS);
}

#[test]
fn benchmarks_that_never_were_one_do_not_part() {
    // Up to 5 %, which takes more draws to see: steady motion beside a late one looks like a partition.
    let draws = 80;
    let parted = tally(Fate::Apart, false, draws).0 + tally(Fate::Apart, true, draws).0;
    assert!(parted <= 8, "{parted} of {}", 2 * draws);
}

#[test]
fn a_ratio_that_drifts_all_the_time_is_no_partition() {
    let mut parted = 0;
    for fate in [Fate::Drift, Fate::BentDrift] {
        parted += tally(fate, false, DRAWS).0 + tally(fate, true, DRAWS).0;
    }
    assert!(parted <= 6, "{parted} of {}", 4 * DRAWS);
}

#[test]
fn a_partition_is_the_verdict_on_all_and_a_candidate_for_each() {
    let made = slope(Fate::Parted, 9, false);
    let all: Vec<&Series> = made.series.iter().collect();
    let mut current = 0.0;
    let together = explain_together(&all, &[], &options(), &mut |share| current = share);
    assert_eq!(together.verdict.effect, Kind::PARTITION);
    assert_ne!(together.explained, Explained::None);
    assert_eq!(together.each.len(), all.len());
    assert!((current - 1.0).abs() < 1e-12);
    let json = serde_json::to_value(&together).unwrap();
    assert_eq!(json["verdict"]["effect"], "partition");
    assert!(json["benchmark"].as_str().unwrap().starts_with("b0, b1"));
    let (effect, candidate) = partition_candidate(all[0], &all[1..], &options());
    assert_eq!(effect.unwrap().groups, together.verdict.groups);
    assert_eq!(candidate.unwrap().rejected_because, None);
    assert_eq!(partition_candidate(all[0], &[], &options()), (None, None));
}

#[test]
fn the_benchmarks_of_the_recordings_do_not_part() {
    for name in [
        "vaiont-1963-reconstruction.mcap",
        "century-mine-2013.mcap",
        "century-mine-2014-southwest.mcap",
    ] {
        let recording = archived(name);
        let all: Vec<&Series> = recording.series.iter().collect();
        let (found, candidate) = partition(&all, &Options::default());
        println!(
            "{name}: {:?}, {:?}, gain {:.0}",
            candidate.rejected_because, candidate.p_value, candidate.bic_gain
        );
        assert_eq!(found, None, "{name}");
    }
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn the_two_benchmarks_at_salmon_falls_do_not_part() {
    let file = measured("salmon_falls_2017.csv");
    let recording = recording(file);
    let all: Vec<&Series> = recording.series.iter().collect();
    assert_eq!(all.len(), 2);
    assert_eq!(partition(&all, &Options::default()).0, None);
}

#[test]
fn at_vaiont_the_reservoir_falls_and_the_velocity_still_rises() {
    let recording = archived("vaiont-1963-reconstruction.mcap");
    for series in &recording.series {
        let said = remarks::of_channels(series, &recording.channels);
        assert_eq!(said.len(), 1, "{said:?}");
        let begins = "reservoir_level_m falls from 1963-09-26 (by ";
        assert!(said[0].starts_with(begins), "{}", said[0]);
        assert!(said[0].contains("until 1963-10-08) and the velocity still rises"));
        assert!(said[0].ends_with("a falling load does not slow this slope."));
    }
}

#[test]
fn a_velocity_that_follows_the_reservoir_down_is_not_remarked_on() {
    let mut recording = archived("vaiont-1963-reconstruction.mcap");
    let turn = "1963-09-25T23:00:00Z".parse().unwrap();
    for series in &mut recording.series {
        let at_turn = series
            .readings
            .iter()
            .find(|one| one.time >= turn)
            .unwrap()
            .value;
        for reading in &mut series.readings {
            if reading.time > turn {
                reading.value = at_turn * at_turn / reading.value;
            }
        }
        assert_eq!(remarks::of_channels(series, &recording.channels), [""; 0]);
    }
}

fn nothing_is_said(recordings: Vec<Recording>) {
    for recording in recordings {
        for series in &recording.series {
            let said = remarks::of_channels(series, &recording.channels);
            assert_eq!(said, [""; 0], "{}", series.benchmark);
        }
    }
}

#[test]
fn where_velocity_and_covariates_do_not_part_nothing_is_said() {
    nothing_is_said(vec![
        archived("century-mine-2013.mcap"),
        archived("la-clapiere-1982-1995-reconstruction.mcap"),
    ]);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn where_velocity_and_covariates_as_measured_do_not_part_nothing_is_said() {
    let names = [
        "salmon_falls_2017.csv",
        "bazimen_2006.csv",
        "baishuihe_2006.csv",
        "columbia_1985_marker1.csv",
    ];
    nothing_is_said(names.map(|name| recording(measured(name))).into());
}
