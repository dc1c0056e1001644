//! The recordings in the repository are whole, attributed, and what was measured.

use crate::measured::measured;
use slipwatch::reading::{BenchmarkId, Recording};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings")
}

fn read(file: PathBuf) -> Recording {
    read_files(&[file], &ReadOptions::default()).unwrap().0
}

#[test]
fn every_recording_says_where_it_comes_from() {
    let mut met = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let file = entry.unwrap().path();
        if file.extension().is_none_or(|extension| extension != "mcap") {
            continue;
        }
        met += 1;
        let provenance = read(file.clone()).provenance;
        for key in ["title", "attribution", "licence", "kind"] {
            let said = provenance.get(key).is_some_and(|text| !text.is_empty());
            assert!(said, "{}: no {key}", file.display());
        }
        let kind = &provenance["kind"];
        assert!(
            ["measured", "measured (digitised)", "reconstruction"].contains(&kind.as_str()),
            "{kind}"
        );
    }
    assert!(met >= 2, "only {met} recordings");
}

#[test]
fn the_century_recordings_hold_the_prisms_and_the_rain() {
    let west = read(folder().join("century-mine-2013.mcap"));
    let counts: Vec<_> = west
        .series
        .iter()
        .map(|series| (series.benchmark.as_str(), series.readings.len()))
        .collect();
    assert_eq!(counts, [("31-1930", 13), ("31-1931", 80), ("40-1938", 87)]);
    assert_eq!(west.channels[0].name, "rain_mm");
    // 93 days, of which 2013-12-29 has no reading.
    assert_eq!(west.channels[0].samples.len(), 92);
    let south_west = read(folder().join("century-mine-2014-southwest.mcap"));
    assert_eq!(south_west.series.len(), 11);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn the_century_recordings_are_what_was_measured() {
    let west = read(folder().join("century-mine-2013.mcap"));
    for prism in ["31-1930", "31-1931", "40-1938"] {
        let file = measured(&format!("century_2013_{prism}.csv"));
        let archived = west.series(Some(&BenchmarkId::new(prism)), None).unwrap();
        let original = read(file);
        assert_eq!(
            archived.readings,
            original.series(None, None).unwrap().readings
        );
    }
    let rain = read(measured("century_2013_rain.csv"));
    assert_eq!(west.channels, rain.channels);
    let archived = read(folder().join("century-mine-2014-southwest.mcap"));
    let south_west = read(measured("century_2014_southwest.csv"));
    assert_eq!(archived.series, south_west.series);
}

#[test]
fn preonzo_holds_five_extensometers_and_longjingcun_one_series() {
    let counts = |file: &str| -> Vec<(String, usize)> {
        let recording = read(folder().join(file));
        let count = |series: &slipwatch::reading::Series| {
            (series.benchmark.to_string(), series.readings.len())
        };
        recording.series.iter().map(count).collect()
    };
    let preonzo = [("E1", 36), ("E2", 36), ("E3", 36), ("E4", 35), ("E5", 34)];
    let preonzo = preonzo.map(|(id, count)| (id.to_owned(), count));
    assert_eq!(counts("preonzo-2012.mcap"), preonzo);
    let longjingcun = [("Longjingcun".to_owned(), 21)];
    assert_eq!(counts("longjingcun-2019.mcap"), longjingcun);
}

#[test]
fn preonzo_pauses_from_8_to_12_may_and_then_speeds_up_to_the_end() {
    let preonzo = read(folder().join("preonzo-2012.mcap"));
    for series in &preonzo.series {
        let at = |time: &str| {
            let time: slipwatch::reading::Timestamp = time.parse().unwrap();
            let reading = series.readings.iter().find(|one| one.time == time);
            reading.unwrap().value
        };
        let midnight = |day: u32| at(&format!("2012-05-{day:02}T22:00:00Z"));
        let rate = |day: u32| midnight(day + 1) - midnight(day);
        // The two days before 8 May, the day of 10 May, and the last that all five have.
        let (before, pause, after) = (f64::max(rate(5), rate(6)), rate(9), rate(12));
        assert!(pause < before, "{}: {before}, {pause}", series.benchmark);
        assert!(after > 1.5 * pause, "{}: {after}", series.benchmark);
    }
}
