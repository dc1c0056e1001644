//! An MCAP archive is read as it was written, or as far as it goes where it has no end, or refused.

use crate::made_up::{assert_identical, made_up, read};
use jiff::Timestamp;
use slipwatch::reading::{Disorder, Reading, Recording};
use slipwatch::runtime::ingest::{
    IngestError, ReadOptions, encode_mcap, read_with_remarks, write_mcap,
};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

#[test]
fn mcap_holds_times_before_1970_standard_errors_averaging_names_and_provenance() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("made-up.mcap");
    write_mcap(&made_up(), &file).unwrap();
    let (back, disorder) = read(&file).unwrap();
    assert_identical(&made_up(), &back);
    assert_eq!(disorder, Disorder::default());
}

#[test]
fn a_recording_in_mcap_is_the_same_bytes_every_time_and_stands_readable_for_all() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().unwrap();
    let [first, second] = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
    write_mcap(&made_up(), &first).unwrap();
    write_mcap(&made_up(), &second).unwrap();
    assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
    let plain = folder.path().join("plain");
    fs::write(&plain, "").unwrap();
    let mode = |file: &Path| fs::metadata(file).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&first), mode(&plain));
}

#[test]
fn a_recording_has_what_viewers_need() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    encode_mcap(&made_up(), &mut bytes).unwrap();
    let bytes = bytes.into_inner();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 6);
    assert_eq!(summary.metadata_indexes[0].name, "provenance");
    assert!(!summary.chunk_indexes.is_empty());
    let messages: Vec<_> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert!(messages.is_sorted_by_key(|message| message.log_time));
    for message in &messages {
        let channel = &message.channel;
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!(schema.encoding, "jsonschema");
        serde_json::from_slice::<serde_json::Value>(&schema.data).unwrap();
        assert_eq!(channel.message_encoding, "json");
        let base = &channel.metadata["time_base"];
        assert_eq!(base, "seconds since 1963-08-01T12:00:00Z");
    }
    let first: serde_json::Value = serde_json::from_slice(&messages[2].data).unwrap();
    assert_eq!(messages[2].channel.topic, "/benchmarks/5/velocity");
    assert_eq!(
        first.to_string(),
        r#"{"time":"1963-08-02T00:00:00Z","value":5.0,"unit":"mm/day","sigma":0.1}"#
    );
}

/// An archive of some length, for damage to be done to.
fn archive() -> (Recording, Vec<u8>) {
    let mut recording = made_up();
    recording.series[0].readings = (0..400_i32)
        .map(|day| Reading {
            time: Timestamp::from_second(i64::from(day) * 86_400).unwrap(),
            value: f64::from(day).sqrt(),
            sigma: Some(0.5),
        })
        .collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    encode_mcap(&recording, &mut bytes).unwrap();
    (recording, bytes.into_inner())
}

#[test]
fn a_flipped_bit_is_refused_or_changes_nothing() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.mcap");
    let (recording, bytes) = archive();
    let mut refused = 0;
    for step in 0..600 {
        // Spread over the whole file, every bit of a byte in turn.
        let at = step * bytes.len() / 600;
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (step % 8);
        fs::write(&file, &damaged).unwrap();
        match read(&file) {
            Ok((read, _)) => assert_identical(&recording, &read),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 500, "only {refused} of 600 flips were noticed");
}

#[test]
fn an_archive_without_its_end_is_read_as_far_as_its_whole_chunks_go_and_said_to_have_none() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.mcap");
    let (recording, bytes) = archive();
    let whole = &recording.series[0].readings;
    let (mut refused, mut read_whole) = (0, 0);
    for length in (0..bytes.len()).step_by(37).chain([bytes.len() - 7]) {
        fs::write(&file, &bytes[..length]).unwrap();
        match read_with_remarks(std::slice::from_ref(&file), &ReadOptions::default()) {
            Ok(read) => {
                assert_eq!(read.disorder.unended, 1, "{length}");
                let (of, remark) = &read.remarks[0];
                assert_eq!((of, remark.about.as_str()), (&file, "has not ended"));
                let readings = &read.recording.series[0].readings;
                assert!(whole.starts_with(readings), "{length}");
                read_whole += usize::from(readings.len() == whole.len());
            }
            // Nothing of it is whole.
            Err(error) => {
                assert!(
                    matches!(error, IngestError::Damaged { .. }),
                    "{length}: {error}"
                );
                refused += 1;
            }
        }
    }
    assert!(refused > 0 && read_whole > 0, "{refused}, {read_whole}");
    // A length that leads past the end, which is there, is damage: the first chunk's.
    let at = bytes
        .windows(9)
        .position(|nine| nine[0] == 6 && nine[3..] == [0; 6]);
    let mut damaged = bytes.clone();
    damaged[at.unwrap() + 3] = 1;
    fs::write(&file, &damaged).unwrap();
    let error = read(&file).unwrap_err();
    assert!(matches!(error, IngestError::Damaged { .. }), "{error}");
    fs::write(&file, &bytes).unwrap();
    assert_identical(&recording, &read(&file).unwrap().0);
}

/// A file as another program may write it.
fn foreign(messages: &[(&str, &str)]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().create(&mut bytes).unwrap();
    for (sequence, (topic, json)) in (1..).zip(messages) {
        let channel = writer
            .add_channel(0, topic, "json", &std::collections::BTreeMap::new())
            .unwrap();
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence,
            log_time: 2_000_000_000 * u64::from(sequence),
            publish_time: 1_000_000_000 * u64::from(sequence),
        };
        writer
            .write_to_known_channel(&header, json.as_bytes())
            .unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

#[test]
fn a_foreign_archive_is_read_by_publish_time_and_other_topics_are_left_out() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.mcap");
    let bytes = foreign(&[
        ("/tf", "not even json"),
        ("/benchmarks/5/velocity", r#"{"value": 7, "unit": "mm/h"}"#),
        ("/channels/lake_level_m", r#"{"value": 7}"#),
    ]);
    fs::write(&file, bytes).unwrap();
    let (recording, _) = read(&file).unwrap();
    let first = recording.series[0].readings[0];
    assert_eq!(first.time, Timestamp::from_second(2).unwrap());
    assert_eq!(recording.channels[0].unit.as_deref(), Some("m"));
}

#[test]
fn a_bad_message_is_named_with_file_topic_and_number() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.mcap");
    let good = ("/benchmarks/5/velocity", r#"{"value": 7, "unit": "mm/h"}"#);
    for (json, field, value) in [
        (r#"{"value": null, "unit": "mm/h"}"#, "value", "null"),
        (r#"{"value": 7, "unit": "mm/day"}"#, "unit", "mm/day"),
        (r#"{"value": 7, "unit": "mm"}"#, "unit", "mm"),
    ] {
        fs::write(&file, foreign(&[good, (good.0, json)])).unwrap();
        let error = read(&file).unwrap_err().to_string();
        for part in ["a.mcap", "message 2", good.0, field, value] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
    fs::write(&file, foreign(&[("/tf", "x")])).unwrap();
    let error = read(&file).unwrap_err().to_string();
    assert!(
        error.contains("/tf") && error.contains("/benchmarks/ID"),
        "{error}"
    );
}

#[test]
fn a_file_without_readings_is_left_out_beside_others_and_refused_alone() {
    let folder = TempDir::new().unwrap();
    let [log, readings] = ["log.mcap", "readings.mcap"].map(|name| folder.path().join(name));
    fs::write(&log, foreign(&[("/log", "{}")])).unwrap();
    let reading = ("/benchmarks/5/velocity", r#"{"value": 7, "unit": "mm/h"}"#);
    fs::write(&readings, foreign(&[reading])).unwrap();
    let options = ReadOptions::default();
    let read = read_with_remarks(&[log.clone(), readings], &options).unwrap();
    assert_eq!(read.recording.series[0].readings.len(), 1);
    let (of, remark) = &read.remarks[0];
    assert_eq!(of, &log);
    assert!(remark.to_string().contains("/log"), "{remark}");
    let alone = read_with_remarks(&[log.clone(), log], &options).unwrap_err();
    assert!(matches!(alone, IngestError::NoTopics { .. }), "{alone}");
}
