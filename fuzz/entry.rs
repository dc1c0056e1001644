//! Any bytes through the readers of files: as a whole file, and as the daemon takes a growing one.
//!
//! Both must come to an end, and a value that they let through must be a number. The fuzz targets and
//! `tests/library/mutated_files.rs` share this file.

use slipwatch::reading::Recording;
use slipwatch::runtime::ingest::{
    CSV, Item, NDJSON, ReadOptions, TOA5, TextFormat, TextRows, decode_message, read_files,
};
use slipwatch::runtime::tail::lines::Lines;
use slipwatch::runtime::tail::records::{Channels, HEADER_BYTES, MAGIC, NextRecord, frame};
use std::path::Path;

/// Bytes as a CSV file.
pub(crate) fn csv(bytes: &[u8]) {
    whole(bytes, "csv");
    grown(bytes, &CSV, "csv");
}

/// Bytes as an NDJSON file.
pub(crate) fn ndjson(bytes: &[u8]) {
    whole(bytes, "ndjson");
    grown(bytes, &NDJSON, "ndjson");
}

/// Bytes as a Campbell TOA5 file.
pub(crate) fn toa5(bytes: &[u8]) {
    whole(bytes, "dat");
    grown(bytes, &TOA5, "dat");
}

/// Reads the bytes as the daemon does a file that grows.
fn grown(bytes: &[u8], format: &TextFormat, extension: &str) {
    let mut lines = Lines::default();
    let (first, second) = bytes.split_at(bytes.len() / 2);
    let mut fed = lines.feed(first);
    fed.extend(lines.feed(second));
    let file = format!("fuzzed.{extension}");
    let mut rows = TextRows::new(format, Path::new(&file), &ReadOptions::default());
    for line in fed {
        let Ok(text) = line.text else { continue };
        for item in &rows.take(line.number, &text).items {
            check(item);
        }
        if rows.is_lost() && format.name == CSV.name {
            return;
        }
    }
}

/// Bytes as an MCAP file.
pub(crate) fn mcap(bytes: &[u8]) {
    whole(bytes, "mcap");
    let mut rest = bytes.strip_prefix(MAGIC).unwrap_or(bytes);
    let mut channels = Channels::default();
    while let Some((header, after)) = rest.split_first_chunk::<HEADER_BYTES>() {
        let (opcode, length) = match frame(*header, after.len() as u64) {
            NextRecord::Read { opcode, length } => (Some(opcode), length),
            NextRecord::Skip { length } => (None, length),
            NextRecord::Wait | NextRecord::End | NextRecord::Damaged { .. } => return,
        };
        let (body, next) = after.split_at(usize::try_from(length).expect("it fits the file"));
        rest = next;
        let messages = opcode.map(|opcode| channels.decode(opcode, body));
        for message in messages.into_iter().flatten().flatten().flatten() {
            let (time, payload) = (message.publish_time, &message.payload);
            let decoded = decode_message(message.channel(), time, payload);
            if let Ok(Some(item)) = decoded {
                check(&item);
            }
        }
    }
}

/// Reads the bytes as a file with that extension.
fn whole(bytes: &[u8], extension: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join(format!("fuzzed.{extension}"));
    std::fs::write(&file, bytes).expect("a temporary file");
    if let Ok((recording, _)) = read_files(&[file], &ReadOptions::default()) {
        check_recording(&recording);
    }
}

fn check_recording(recording: &Recording) {
    for series in &recording.series {
        assert!(series.readings.iter().all(|one| one.value.is_finite()));
        let times = series
            .readings
            .windows(2)
            .all(|pair| pair[0].time < pair[1].time);
        assert!(times, "readings out of order");
    }
    for channel in &recording.channels {
        assert!(channel.samples.iter().all(|one| one.value.is_finite()));
    }
}

fn check(item: &Item) {
    let value = match item {
        Item::Reading { reading, .. } => reading.value,
        Item::Sample { sample, .. } => sample.value,
        Item::Missing { .. } => return,
    };
    assert!(value.is_finite(), "{item:?}");
}
