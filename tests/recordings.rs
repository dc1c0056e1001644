//! The recordings in the repository are whole, attributed, and what was measured.
#![allow(missing_docs, reason = "the claims are the names")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod measured;

use measured::measured;
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
            ["measured", "reconstruction"].contains(&kind.as_str()),
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
fn the_century_recordings_are_what_was_measured() {
    let west = read(folder().join("century-mine-2013.mcap"));
    for prism in ["31-1930", "31-1931", "40-1938"] {
        let Some(file) = measured(&format!("century_2013_{prism}.csv")) else {
            continue;
        };
        let archived = west.series(Some(&BenchmarkId::new(prism)), None).unwrap();
        let original = read(file);
        assert_eq!(
            archived.readings,
            original.series(None, None).unwrap().readings
        );
    }
    if let Some(file) = measured("century_2013_rain.csv") {
        assert_eq!(west.channels, read(file).channels);
    }
    if let Some(file) = measured("century_2014_southwest.csv") {
        let archived = read(folder().join("century-mine-2014-southwest.mcap"));
        assert_eq!(archived.series, read(file).series);
    }
}
