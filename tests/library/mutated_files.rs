//! Damaged files never bring a reader down, nor get a value through that is no number: the fuzz targets'
//! own entry points, on real files with seeded damage.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by panicking"
)]

#[path = "../../fuzz/entry.rs"]
mod entry;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::runtime::ingest::{ReadOptions, convert};
use std::fs;
use std::path::Path;

/// Damaged copies of each file, unless `MUTATED_COPIES` says otherwise.
const COPIES: usize = 300;
/// Files are cut to this, so that damage often meets what is read first.
const LONGEST: usize = 6000;

fn copies() -> usize {
    std::env::var("MUTATED_COPIES").map_or(COPIES, |text| text.parse().unwrap())
}

/// What damage is made of: signs that mean something to either reader.
const SIGNS: [&[u8]; 14] = [
    b"NaN",
    b"inf",
    b"-",
    b"1e999",
    b"\"",
    b",",
    b"\n",
    b"\r\n",
    b"\0",
    b"\xff\xfe",
    b"T24:00:00Z",
    b"9999-12-31T24:00:00+02:00",
    b"9999-12-30T24:00:00Z",
    b"}",
];

/// One to six pieces of damage: bytes changed, lost, repeated, put in, or cut off.
fn damage(bytes: &[u8], generator: &mut Pcg64) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..generator.random_range(1..=6) {
        if out.is_empty() {
            break;
        }
        let at = generator.random_range(0..out.len());
        let to = (at + generator.random_range(1..64)).min(out.len());
        match generator.random_range(0..7) {
            0 => out[at] = generator.random(),
            1 => out[at] ^= 1 << generator.random_range(0..8),
            2 => drop(out.drain(at..to)),
            3 => {
                let piece = out[at..to].to_vec();
                out.splice(at..at, piece);
            }
            4 => {
                let sign = SIGNS[generator.random_range(0..SIGNS.len())];
                out.splice(at..at, sign.iter().copied());
            }
            5 => {
                // A length that lies.
                let length: u64 = generator.random();
                let end = (at + 8).min(out.len());
                out[at..end].copy_from_slice(&length.to_le_bytes()[..end - at]);
            }
            _ => out.truncate(at),
        }
    }
    out
}

fn recordings() -> Vec<std::path::PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let names = ["century-mine-2013.mcap", "century-mine-2014-southwest.mcap"];
    names.into_iter().map(|name| folder.join(name)).collect()
}

#[test]
fn no_damage_to_a_csv_file_brings_its_readers_down() {
    damage_text("csv", 11, entry::csv);
}

#[test]
fn no_damage_to_an_ndjson_file_brings_its_readers_down() {
    damage_text("ndjson", 14, entry::ndjson);
}

#[test]
fn no_damage_to_a_toa5_file_brings_its_readers_down() {
    damage_text("dat", 15, entry::toa5);
}

fn damage_text(extension: &str, seed: u64, read: fn(&[u8])) {
    let folder = tempfile::tempdir().unwrap();
    let mut generator = Pcg64::seed_from_u64(seed);
    for recording in recordings() {
        let file = folder.path().join(format!("whole.{extension}"));
        convert(&recording, &file, &ReadOptions::default(), &mut |_| {}).unwrap();
        let mut bytes = fs::read(&file).unwrap();
        bytes.truncate(LONGEST);
        for _ in 0..copies() {
            read(&damage(&bytes, &mut generator));
        }
    }
}

#[test]
fn no_damage_to_an_mcap_file_brings_its_readers_down() {
    let mut generator = Pcg64::seed_from_u64(12);
    for recording in recordings() {
        let bytes = fs::read(&recording).unwrap();
        for _ in 0..copies() {
            entry::mcap(&damage(&bytes, &mut generator));
        }
    }
}

#[test]
fn bytes_of_no_kind_bring_no_reader_down() {
    let mut generator = Pcg64::seed_from_u64(13);
    for _ in 0..copies() {
        let count = generator.random_range(0..400);
        let bytes: Vec<u8> = (0..count).map(|_| generator.random()).collect();
        entry::csv(&bytes);
        entry::ndjson(&bytes);
        entry::toa5(&bytes);
        entry::mcap(&bytes);
    }
}
