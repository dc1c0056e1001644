//! What goes into a file of readings comes out of it again, and what is wrong with it is named.
#![allow(missing_docs, reason = "the claims are the names")]

mod measured;

use jiff::{SignedDuration, Timestamp};
use measured::measured;
use proptest::prelude::*;
use slipwatch::reading::{
    BenchmarkId, Channel, Disorder, Reading, Recording, Sample, Series, Unit,
};
use slipwatch::runtime::ingest::{
    IngestError, ReadOptions, convert, encode_mcap, read_channels, read_files, write_csv,
    write_mcap,
};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn reading(time: &str, value: f64, sigma: Option<f64>) -> Reading {
    let time = time.parse().unwrap();
    Reading { time, value, sigma }
}

/// Readings from before 1970 on, standard errors, averaging, awkward names and numbers.
fn made_up() -> Recording {
    Recording {
        series: vec![
            Series {
                benchmark: BenchmarkId::new("5"),
                unit: Unit::MM_PER_DAY,
                averaging: Some(SignedDuration::from_mins(90)),
                readings: vec![
                    reading("1963-08-02T00:00:00Z", 5.0, Some(0.1)),
                    reading("1963-08-02T00:00:00.000000001Z", 0.1 + 0.2, None),
                    reading("1971-01-01T00:00:00Z", 1e300, Some(5e-324)),
                ],
            },
            Series {
                benchmark: BenchmarkId::new("west wall/Ü 5,\"b\""),
                unit: Unit::parse("ft").unwrap(),
                averaging: None,
                readings: vec![reading("1963-08-03T00:00:00Z", -1.0 / 3.0, None)],
            },
        ],
        channels: vec![
            Channel {
                name: "lake_level_m".to_owned(),
                unit: Some("m".to_owned()),
                samples: vec![Sample {
                    time: "1963-08-01T12:00:00Z".parse().unwrap(),
                    value: 650.25,
                }],
            },
            Channel {
                name: "quality/of day".to_owned(),
                unit: None,
                samples: vec![Sample {
                    time: "1963-08-01T12:00:00Z".parse().unwrap(),
                    value: f64::MIN_POSITIVE,
                }],
            },
        ],
        provenance: [("title".to_owned(), "made up".to_owned())].into(),
    }
}

fn write(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let file = folder.path().join(name);
    fs::write(&file, text).unwrap();
    file
}

fn read(file: &Path) -> Result<(Recording, Disorder), IngestError> {
    read_files(&[file.to_owned()], &ReadOptions::default())
}

fn read_text(text: &str) -> Result<(Recording, Disorder), IngestError> {
    let folder = TempDir::new().unwrap();
    read(&write(&folder, "prism.csv", text))
}

fn error_of(text: &str) -> String {
    read_text(text).unwrap_err().to_string()
}

/// Compares bits too: `==` holds 0.0 and -0.0 for one number.
fn assert_identical(a: &Recording, b: &Recording) {
    assert_eq!(a, b);
    let bits = |recording: &Recording| -> Vec<u64> {
        let readings = recording.series.iter().flat_map(|series| &series.readings);
        let samples = recording
            .channels
            .iter()
            .flat_map(|channel| &channel.samples);
        readings
            .flat_map(|row| [row.value.to_bits(), row.sigma.unwrap_or(0.0).to_bits()])
            .chain(samples.map(|row| row.value.to_bits()))
            .collect()
    };
    assert_eq!(bits(a), bits(b));
}

#[test]
fn a_recording_converted_there_and_back_is_the_same_readings() {
    let names = [
        "century_2013_31-1930.csv",
        "century_2014_southwest.csv",
        "century_2013_rain.csv",
        "salmon_falls_2017.csv",
        "lanzada_2025_f1.csv",
    ];
    let options = ReadOptions::default();
    for file in names.into_iter().filter_map(measured) {
        let folder = TempDir::new().unwrap();
        let archive = folder.path().join("archive.mcap");
        let back = folder.path().join("back.csv");
        let report = convert(&file, &archive, &options).unwrap();
        convert(&archive, &back, &options).unwrap();
        let (original, disorder) = read(&file).unwrap();
        assert_eq!(disorder, Disorder::default(), "{}", file.display());
        assert_identical(&original, &read(&archive).unwrap().0);
        assert_identical(&original, &read(&back).unwrap().0);
        let counted: usize = report.series.iter().map(|one| one.readings).sum();
        let held: usize = original.series.iter().map(|one| one.readings.len()).sum();
        assert_eq!(counted, held);
    }
}

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
fn csv_holds_all_but_averaging_and_provenance_and_convert_says_so() {
    let folder = TempDir::new().unwrap();
    let archive = folder.path().join("made-up.mcap");
    let table = folder.path().join("made-up.csv");
    write_mcap(&made_up(), &archive).unwrap();
    let report = convert(&archive, &table, &ReadOptions::default()).unwrap();
    assert_eq!(report.left_out.len(), 2, "{:?}", report.left_out);
    let mut expected = made_up();
    expected.provenance.clear();
    expected.series[0].averaging = None;
    assert_identical(&expected, &read(&table).unwrap().0);
    let hour_and_half = ReadOptions {
        averaging: Some(SignedDuration::from_mins(90)),
        ..ReadOptions::default()
    };
    let (told, _) = read_files(&[table], &hour_and_half).unwrap();
    assert_eq!(told.series, made_up().series);
}

#[test]
fn a_recording_in_mcap_is_the_same_bytes_every_time_and_stands_readable_for_all() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().unwrap();
    let [first, second] = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
    write_mcap(&made_up(), &first).unwrap();
    write_mcap(&made_up(), &second).unwrap();
    assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
    let plain = write(&folder, "plain", "");
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

#[test]
fn a_bad_value_is_named_with_file_line_column() {
    let good = "time,a_displacement_mm,rain_mm\n2020-01-01T00:00:00Z,1,\n";
    for value in ["x", "NaN", "inf", "-inf", "1e999", "1 mm", "0x10"] {
        let error = error_of(&format!("{good}\n2020-01-02T00:00:00Z,2,{value}\n"));
        for part in ["prism.csv", "line 4", "\"rain_mm\"", value, "finite number"] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
}

#[test]
fn a_bad_time_is_named_with_what_was_expected() {
    for time in [
        "",
        "2020-01-01",
        "2020-01-01T00:00:00",
        "noon",
        "1577836800",
    ] {
        let text = format!("time,displacement_mm\n{time},1\n");
        let error = error_of(&text);
        for part in ["line 2", "\"time\"", &format!("{time:?}"), "RFC 3339"] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
}

#[test]
fn a_bad_line_or_header_is_named() {
    let cases = [
        (
            "time,a_displacement_mm\n2020-01-01T00:00:00Z,1,2\n",
            "line 2: found 3 fields, expected 2",
        ),
        (
            "time,a_displacement_mm\n2020-01-01T00:00:00Z\n",
            "line 2: found 1 fields",
        ),
        (
            "time,a_displacement_mm\n2020-01-01T00:00:00Z,\n",
            "\"a_displacement_mm\": found no value",
        ),
        ("time,a_displacement_mm\n", "found no row"),
        ("", "found no header"),
        (
            "a_displacement_mm,x\n1,2\n",
            "column \"time\": there is no such column",
        ),
        ("time;a_displacement_mm\n1;2\n", "comma-separated"),
        ("time,t_days,x\n1,2,3\n", "a second column gives the time"),
        ("time,x,x\n1,2,3\n", "column \"x\": the name stands twice"),
        ("time,x,\n1,2,3\n", "a column without a name"),
        ("time\n2020-01-01T00:00:00Z\n", "the only column"),
        (
            "time,velocity_kmh\n2020-01-01T00:00:00Z,1\n",
            "without a known unit",
        ),
        (
            "time,a_displacement_mm,a_displacement_cm\n",
            "has another such column",
        ),
        (
            "time,a_displacement_mm,b_sigma_mm\n",
            "no readings it belongs to",
        ),
        (
            "time,a_displacement_mm,a_sigma_mm_per_d\n",
            "no readings it belongs to",
        ),
        (
            "time,a_displacement_mm,a_sigma_mm,a_sigma_cm\n",
            "the readings have another",
        ),
        (
            "time,displacement_mm,sigma_mm\n2020-01-01T00:00:00Z,1,0\n",
            "positive standard error",
        ),
        ("t_days,displacement_mm\n1e300,1\n", "within the calendar"),
    ];
    for (text, problem) in cases {
        let error = error_of(text);
        assert!(
            error.contains(problem) && error.contains("prism.csv"),
            "{error}"
        );
    }
}

#[test]
fn bytes_that_are_no_text_are_named_by_their_line() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("x.csv");
    fs::write(
        &file,
        b"time,a_displacement_mm\n2020-01-01T00:00:00Z,1\n\xff\xfe,2\n",
    )
    .unwrap();
    let error = read(&file).unwrap_err().to_string();
    assert!(
        error.contains("line 3") && error.contains("UTF-8"),
        "{error}"
    );
}

#[test]
fn a_byte_order_mark_windows_line_ends_quotes_and_blank_lines_change_nothing() {
    let plain = read_text("time,displacement_mm\n2020-01-01T01:00:00+01:00,1\n").unwrap();
    let odd = "\u{feff}\"time\" , displacement_mm\r\n\r\n\"2020-01-01T00:00:00Z\",1\r\n\r\n";
    assert_eq!(read_text(odd).unwrap(), plain);
}

#[test]
fn a_column_without_a_name_in_it_is_the_benchmark_of_the_file() {
    let (recording, _) = read_text("t_days,displacement_mm\n-1.5,1\n0.5,2\n").unwrap();
    let series = recording.series(None, None).unwrap();
    assert_eq!(series.benchmark.as_str(), "prism");
    let expected: Timestamp = "1999-12-30T12:00:00Z".parse().unwrap();
    assert_eq!(series.readings[0].time, expected);
}

#[test]
fn a_standard_error_goes_with_the_reading_of_its_kind_in_the_readings_unit() {
    let text = "time,a_displacement_mm,a_velocity_m_per_d,a_sigma_cm,a_sigma_mm_per_d,b_displacement_mm\n\
                2020-01-01T00:00:00Z,1,2,3,4,5\n2020-01-02T00:00:00Z,1,2,,4,5\n";
    let (recording, _) = read_text(text).unwrap();
    let sigmas: Vec<_> = recording
        .series
        .iter()
        .map(|series| (series.benchmark.as_str(), series.readings[0].sigma))
        .collect();
    assert_eq!(sigmas, [("a", Some(30.0)), ("a", Some(0.004)), ("b", None)]);
    assert_eq!(recording.series[0].readings[1].sigma, None);
}

#[test]
fn rows_out_of_order_repeated_or_corrected_are_settled_and_counted() {
    let text = "time,a_displacement_mm,rain_mm\n\
                2020-01-02T00:00:00Z,2,\n2020-01-01T00:00:00Z,1,\n\
                2020-01-02T00:00:00Z,2,\n2020-01-01T00:00:00Z,9,5\n";
    let (recording, disorder) = read_text(text).unwrap();
    let values: Vec<f64> = recording.series[0]
        .readings
        .iter()
        .map(|r| r.value)
        .collect();
    assert_eq!(values, [9.0, 2.0]);
    assert_eq!((disorder.repeated, disorder.corrected), (1, 1));
    assert_eq!(disorder.out_of_order, 2);
}

#[test]
fn a_column_map_names_the_benchmark_and_must_meet_its_column() {
    let folder = TempDir::new().unwrap();
    let file = write(
        &folder,
        "p.csv",
        "time,Prism 4,error\n2020-01-01T00:00:00Z,1,2\n",
    );
    let with = |maps: &[&str]| {
        let options = ReadOptions {
            columns: maps.iter().map(|map| map.parse().unwrap()).collect(),
            ..ReadOptions::default()
        };
        read_files(std::slice::from_ref(&file), &options)
    };
    let (recording, _) =
        with(&["Prism 4=31-1930:velocity:cm/h", "error=31-1930:sigma:mm/h"]).unwrap();
    let series = recording
        .series(Some(&BenchmarkId::new("31-1930")), None)
        .unwrap();
    assert_eq!(series.unit.to_string(), "cm/h");
    assert_eq!(series.readings[0].sigma, Some(0.2));
    let error = with(&["Prism 5=a:displacement:mm"])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("Prism 5") && error.contains("Prism 4"),
        "{error}"
    );
}

#[test]
fn channels_may_stand_in_files_of_their_own() {
    let folder = TempDir::new().unwrap();
    let rain = write(
        &folder,
        "rain.csv",
        "time,rain_mm\n2020-01-01T00:00:00Z,1\n",
    );
    let later = write(
        &folder,
        "rain2.csv",
        "time,rain_mm\n2020-01-02T00:00:00Z,2\n",
    );
    let prism = write(
        &folder,
        "a.csv",
        "time,displacement_mm\n2020-01-01T00:00:00Z,1\n",
    );
    let options = ReadOptions::default();
    let (channels, _) = read_channels(&[later, rain.clone()], &options).unwrap();
    assert_eq!((channels.len(), channels[0].samples.len()), (1, 2));
    assert_eq!(channels[0].unit.as_deref(), Some("mm"));
    let error = read_channels(std::slice::from_ref(&prism), &options).unwrap_err();
    assert!(matches!(error, IngestError::NoChannels { .. }), "{error}");
    let (both, _) = read_files(&[prism, rain], &options).unwrap();
    assert_eq!((both.series.len(), both.channels.len()), (1, 1));
}

#[test]
fn a_file_that_is_not_there_or_of_no_known_kind_is_named() {
    let missing = read(Path::new("/nowhere/a.csv")).unwrap_err();
    assert!(missing.is_io() && missing.to_string().contains("/nowhere/a.csv"));
    let unknown = read(Path::new("a.xlsx")).unwrap_err();
    assert!(!unknown.is_io() && unknown.to_string().contains("a.xlsx"));
}

#[test]
fn a_failed_conversion_leaves_the_old_file_as_it_was() {
    let folder = TempDir::new().unwrap();
    let mut recording = made_up();
    recording.channels[0].name = "lake_displacement_m".to_owned();
    let archive = folder.path().join("a.mcap");
    write_mcap(&recording, &archive).unwrap();
    let table = write(&folder, "a.csv", "precious");
    let error = convert(&archive, &table, &ReadOptions::default()).unwrap_err();
    assert!(
        format!("{error:#}").contains("lake_displacement_m"),
        "{error:#}"
    );
    assert!(error.downcast_ref::<IngestError>().is_some());
    assert_eq!(fs::read_to_string(&table).unwrap(), "precious");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_number_that_is_not_finite_is_not_written() {
    let mut recording = made_up();
    recording.series[1].readings[0].value = f64::NAN;
    let mut bytes = std::io::Cursor::new(Vec::new());
    assert!(encode_mcap(&recording, &mut bytes).is_err());
    assert!(write_csv(&recording, Vec::new()).is_err());
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
fn a_truncated_archive_is_refused() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.mcap");
    let (recording, bytes) = archive();
    for length in (0..bytes.len()).step_by(37).chain([bytes.len() - 1]) {
        fs::write(&file, &bytes[..length]).unwrap();
        let error = read(&file).unwrap_err();
        assert!(
            matches!(error, IngestError::Damaged { .. }),
            "{length}: {error}"
        );
    }
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

prop_compose! {
    fn rows()(rows in prop::collection::btree_map(
        -3_000_000_000_000_000_000_i64..3_000_000_000_000_000_000,
        (prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
         prop::option::of(prop::num::f64::POSITIVE | prop::num::f64::NORMAL)),
        1..20,
    )) -> Vec<Reading> {
        rows.into_iter()
            .map(|(nanosecond, (value, sigma))| Reading {
                time: Timestamp::from_nanosecond(i128::from(nanosecond)).unwrap(),
                value,
                sigma: sigma.map(f64::abs),
            })
            .collect()
    }
}

prop_compose! {
    fn recordings()(parts in prop::collection::btree_map("[ -~Ü]{1,8}", rows(), 1..5)) -> Recording {
        let series = parts
            .into_iter()
            .filter(|(id, _)| id.trim() == id)
            .map(|(id, readings)| Series {
                benchmark: BenchmarkId::new(id),
                unit: Unit::parse("cm/yr").unwrap(),
                averaging: None,
                readings,
            });
        Recording { series: series.collect(), ..Recording::default() }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_recording_comes_back_bit_for_bit(recording in recordings()) {
        prop_assume!(!recording.series.is_empty());
        let folder = TempDir::new().unwrap();
        let archive = folder.path().join("a.mcap");
        let table = folder.path().join("a.csv");
        write_mcap(&recording, &archive).unwrap();
        write_csv(&recording, fs::File::create(&table).unwrap()).unwrap();
        assert_identical(&recording, &read(&archive).unwrap().0);
        assert_identical(&recording, &read(&table).unwrap().0);
    }
}
