//! An effect put into measured readings is found again with nothing declared, where docs/closing-the-loop.md says so.

use crate::found_again::{Found, Trial, alone};
use crate::put_in::What;
use slipwatch::effects::{Explained, Kind};
use slipwatch::reading::BenchmarkId;
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::PathBuf;

/// The measured series of that name; tests of these are ignored where they are not at hand.
fn measured(name: &str) -> PathBuf {
    studies::measured(name).unwrap()
}

/// Seeds of the document's first draws.
const RESET: u64 = 101;
const TIDE: u64 = 201;
/// Of the steps of the velocity that are found.
const STEP: u64 = 3;

/// What was put in, and what was said with and without it.
fn trial(files: &[PathBuf], benchmark: Option<&str>, drawn: (What, u64)) -> Trial {
    trial_of(files, benchmark, drawn, &ReadOptions::default())
}

fn trial_of(
    files: &[PathBuf],
    benchmark: Option<&str>,
    drawn: (What, u64),
    options: &ReadOptions,
) -> Trial {
    let (recording, _) = read_files(files, options).unwrap();
    let benchmark = benchmark.map(BenchmarkId::new);
    let series = recording.series(benchmark.as_ref(), None).unwrap();
    let without = alone(series, &recording.channels);
    Trial::of(series, &recording.channels, &without, drawn).unwrap()
}

/// A reset is found at its date within an interval between readings, and its size within a share of it.
fn the_reset_is_found(trial: &Trial, most_off: f64) {
    let found: Found = trial.found().unwrap();
    assert_eq!(found.kind, Kind::OFFSET);
    let intervals = trial.intervals(found.late_days.unwrap());
    assert!(intervals.abs() <= 1.0, "{intervals} intervals late");
    let off = found.size.unwrap() / trial.put_in.size - 1.0;
    assert!(off.abs() <= most_off, "{found:?} for {:?}", trial.put_in);
    assert!(trial.with.error.fit.after < trial.with.error.fit.before);
}

#[test]
fn a_reset_put_into_a_prism_of_century_mine_is_found() {
    let root = studies::project();
    let file = root.join("recordings/century-mine-2013.mcap");
    let trial = trial(&[file], Some("31-1931"), (What::Reset, RESET));
    the_reset_is_found(&trial, 0.1);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_reset_put_into_either_benchmark_of_salmon_falls_is_found_beside_the_lake() {
    let file = measured("salmon_falls_2017.csv");
    for benchmark in ["blkm", "ntoe"] {
        let trial = trial(
            std::slice::from_ref(&file),
            Some(benchmark),
            (What::Reset, RESET),
        );
        the_reset_is_found(&trial, 0.05);
        let lake = trial.with.also.iter().chain([&trial.with.verdict]);
        let mut lake = lake.filter(|one| one.effect == Kind::HYDROLOGICAL);
        assert_eq!(
            lake.next().unwrap().channel.as_deref(),
            Some("lake_level_m")
        );
    }
}

/// A step of the velocity put into BLKM at Salmon Falls.
fn step_at_salmon_falls() -> Trial {
    let file = measured("salmon_falls_2017.csv");
    trial(&[file], Some("blkm"), (What::Step, STEP))
}

/// Its kind is open: where the state hardly heals, a reset of it is a step of the velocity.
#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_step_of_the_velocity_put_into_blkm_at_salmon_falls_is_found_and_predicts_the_later_block() {
    let trial = step_at_salmon_falls();
    let intervals = trial.intervals(trial.found().unwrap().late_days.unwrap());
    assert!(intervals.abs() <= 1.0, "{intervals} intervals late");
    let steps = &trial.with.error.held_out_step;
    assert!(steps.after < steps.before);
    // 105 mm without any effect, 7.8 mm where the lake was fitted before the step and not again beside it.
    let held_out = &trial.with.error.held_out;
    assert!(held_out.after.unwrap() < 2.0, "{held_out:?}");
}

#[test]
#[ignore = "not reached: a reset of the state to 0.37 is found for a step by 0.81 e-folds; before events began from fresh laws it was a step by 0.96"]
fn a_step_of_the_velocity_put_into_blkm_at_salmon_falls_is_found_with_its_size() {
    let trial = step_at_salmon_falls();
    assert!(trial.is_right(), "{:?}", trial.with.verdict);
    let found = trial.found().unwrap();
    let off = found.size.unwrap() / trial.put_in.size - 1.0;
    assert!(off.abs() <= 0.15, "{found:?} for {:?}", trial.put_in);
}

/// The slope runs up to its collapse and leaves structure whatever is put into the law; a jump of its velocity has a date all the same.
#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_step_of_the_velocity_put_into_lanzada_is_found_beside_what_is_left() {
    let options = ReadOptions {
        averaging: Some(jiff::SignedDuration::from_hours(1)),
        ..ReadOptions::default()
    };
    let file = measured("lanzada_2025_f1.csv");
    let trial = trial_of(&[file], None, (What::Step, STEP), &options);
    let found = trial.found().unwrap();
    let intervals = trial.intervals(found.late_days.unwrap());
    assert!(intervals.abs() <= 1.0, "{intervals} intervals late");
    assert_eq!(trial.with.explained, Explained::Partly);
    let fit = &trial.with.error.fit;
    assert!(fit.after.unwrap() < 0.2 * fit.before.unwrap(), "{fit:?}");
}

/// The law's own failure time drifts in the held-out hours before the collapse, with the wave and without; the wave does not. Where the law
/// without the wave fails there, its error is no figure.
#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_wave_of_the_tides_period_put_into_lanzada_is_found_with_its_size_though_the_law_drifts() {
    let options = ReadOptions {
        averaging: Some(jiff::SignedDuration::from_hours(1)),
        ..ReadOptions::default()
    };
    for seed in [TIDE, TIDE + 1, TIDE + 2] {
        let file = measured("lanzada_2025_f1.csv");
        let trial = trial_of(&[file], None, (What::Tide, seed), &options);
        let found = trial.found().unwrap();
        let off = found.size.unwrap() / trial.put_in.size - 1.0;
        assert!(off.abs() <= 0.2, "{found:?} for {:?}", trial.put_in);
        let held_out = &trial.with.error.held_out_step;
        let falls = |before: f64| held_out.after.is_some_and(|after| after < before);
        assert!(held_out.before.is_none_or(falls), "{held_out:?}");
    }
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_reset_put_into_the_height_at_houston_is_found_beside_its_own_four_steps() {
    let file = measured("houston_msfx_2013.csv");
    let trial = trial(&[file], Some("up"), (What::Reset, RESET));
    the_reset_is_found(&trial, 0.05);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_wave_of_the_tides_period_put_into_columbia_glacier_is_found_with_its_size() {
    let files = ["columbia_1985_marker1.csv", "columbia_1985_rain.csv"].map(measured);
    let trial = trial(&files, None, (What::Tide, TIDE));
    let found = trial.found().unwrap();
    assert_eq!(found.kind, Kind::TIDE);
    let off = found.size.unwrap() / trial.put_in.size - 1.0;
    assert!(off.abs() <= 0.1, "{found:?} for {:?}", trial.put_in);
    let held_out = &trial.with.error.held_out_step;
    assert!(held_out.after < held_out.before);
}
