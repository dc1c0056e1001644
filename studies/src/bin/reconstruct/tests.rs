//! The committed reconstructions say what the paper says, and come out of their generator as they stand.

use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::reading::{Recording, days_since};
use slipwatch::runtime::ingest::{ReadOptions, encode_mcap, read_files};
use std::io::Cursor;
use std::path::PathBuf;

fn path(file: &str) -> PathBuf {
    studies::project().join("recordings").join(file)
}

fn committed(file: &str) -> Recording {
    let (recording, disorder) = read_files(&[path(file)], &ReadOptions::default()).unwrap();
    assert_eq!(disorder, slipwatch::reading::Disorder::default(), "{file}");
    recording
}

fn assert_reproduced(file: &str, again: &Recording) {
    let mut bytes = Cursor::new(Vec::new());
    encode_mcap(again, &mut bytes).unwrap();
    let same = std::fs::read(path(file)).unwrap() == bytes.into_inner();
    assert!(same, "{file} is not what its generator writes");
}

#[test]
fn the_vaiont_reconstruction_keeps_the_papers_statements() {
    let day_zero = crate::vaiont::DAY_ZERO.parse().unwrap();
    crate::facts::vaiont(&committed(crate::vaiont::FILE), day_zero).unwrap();
}

#[test]
fn the_la_clapiere_reconstruction_keeps_the_papers_statements() {
    crate::facts::la_clapiere(&committed(crate::la_clapiere::FILE)).unwrap();
    let motions = crate::la_clapiere::motions(
        &crate::la_clapiere::days().unwrap(),
        crate::la_clapiere::Parts::All,
    )
    .unwrap();
    crate::facts::la_clapiere_motion(&motions).unwrap();
}

#[test]
fn the_generator_writes_the_committed_bytes() {
    assert_reproduced(crate::vaiont::FILE, &crate::vaiont::recording().unwrap());
    assert_reproduced(
        crate::la_clapiere::FILE,
        &crate::la_clapiere::recording().unwrap(),
    );
}

#[test]
fn every_reconstruction_says_that_it_is_not_measured() {
    for file in [crate::vaiont::FILE, crate::la_clapiere::FILE] {
        assert!(file.contains("reconstruction"), "{file}");
        let provenance = committed(file).provenance;
        assert_eq!(provenance["kind"], "reconstruction", "{file}");
        assert!(provenance["statement"].contains("not measured"), "{file}");
        for key in [
            "title",
            "sources",
            "stated_by_the_source",
            "invented",
            "seed",
        ] {
            assert!(!provenance[key].is_empty(), "{file}: {key}");
        }
    }
}

#[test]
fn the_reservoir_falls_from_26_september_while_the_velocity_rises() {
    let recording = committed(crate::vaiont::FILE);
    let day_zero = crate::vaiont::DAY_ZERO.parse().unwrap();
    let level = &recording.channels[0];
    assert_eq!(level.name, "reservoir_level_m");
    for pair in level.samples.windows(2) {
        let falling = pair[1].value < pair[0].value;
        let drawn_down = days_since(day_zero, pair[0].time) >= 55.0;
        assert_eq!(falling, drawn_down, "{}", pair[0].time);
    }
    for series in &recording.series {
        let week = |day: usize| {
            let values = series.readings[day..day + 6].iter().map(|r| r.value);
            values.sum::<f64>()
        };
        assert!(week(62) > 1.5 * week(54), "{}", series.benchmark);
    }
}

#[test]
fn a_constant_load_moves_the_loaded_law_as_it_moves_the_law() {
    let law = Law::from_paper(1.35, 0.05, 3790.0, 0.175).unwrap();
    let block = crate::loaded_law::Block::START.advance(&law, |_| 0.0, 60.0, 12_000);
    let motion = Trajectory::solve(&law, 60.0, Accuracy::Full)
        .at(60.0)
        .unwrap();
    assert!((block.y / motion.y - 1.0).abs() < 1e-9);
    assert!((block.slip_mm / motion.displacement - 1.0).abs() < 1e-9);
}

#[test]
fn the_rivers_of_1986_to_1988_are_not_anomalously_high() {
    let recording = committed(crate::la_clapiere::FILE);
    let flow = &recording.channels[0];
    assert_eq!(flow.name, "tinee_flow_m3_s");
    let mean = |years: std::ops::RangeInclusive<i16>| {
        let year = |time: jiff::Timestamp| time.to_zoned(jiff::tz::TimeZone::UTC).year();
        let inside = flow
            .samples
            .iter()
            .filter(|s| years.contains(&year(s.time)));
        let values: Vec<f64> = inside.map(|sample| sample.value).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let ratio = mean(1986..=1988) / mean(1983..=1985);
    assert!((0.85..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn the_acceleration_of_1987_is_the_fits_and_not_the_rivers() {
    let days = crate::la_clapiere::days().unwrap();
    let shares = crate::la_clapiere::shares(&days).unwrap();
    assert_eq!(shares.len(), 5);
    let (_, [fit_1986, river_1986, _]) = shares[3];
    let (_, [fit_1987, river_1987, all_1987]) = shares[4];
    // The last year's slip, of which the river has no part.
    let (fit, river) = (fit_1987 - fit_1986, river_1987 - river_1986);
    assert!((river / fit - 1.0).abs() < 1e-9, "{fit} {river}");
    assert!(
        (all_1987 / fit_1987 - 1.0).abs() < 0.1,
        "{all_1987} {fit_1987}"
    );
}

#[test]
fn noise_without_a_direction_has_no_part_along_it_and_keeps_the_rest() {
    let along = vec![1.0, 1.0, 1.0, 1.0];
    let twice = vec![2.0, 2.0, 2.0, 2.0];
    let rest = crate::projection::without(&[along, twice], vec![1.0, 2.0, 3.0, 6.0]);
    let expected = [-2.0, -1.0, 0.0, 3.0];
    for (value, expected) in rest.iter().zip(expected) {
        assert!((value - expected).abs() < 1e-12, "{rest:?}");
    }
}
