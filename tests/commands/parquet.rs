//! `--format parquet`: the same rows as `--format json`, in typed columns.

use parquet::basic::{LogicalType, TimeUnit, Type as Physical};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::File;
use std::process::{Command, Output};

fn slipwatch(words: &[&str], format: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipwatch"));
    let command = command.current_dir(env!("CARGO_MANIFEST_DIR")).args(words);
    let done = command.args(["--format", format]).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{words:?}: {said}");
    done
}

type RowMap = BTreeMap<String, Value>;
type ColumnTypes = BTreeMap<String, (Physical, Option<LogicalType>)>;

/// What a reader of Parquet finds: the columns with their types, of each row what is not null, and what the columns mean.
#[expect(
    clippy::wildcard_enum_match_arm,
    reason = "a column of any other kind is wrong"
)]
fn table(words: &[&str]) -> (ColumnTypes, Vec<RowMap>, Value) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("table.parquet");
    std::fs::write(&file, slipwatch(words, "parquet").stdout).unwrap();
    let reader = SerializedFileReader::new(File::open(&file).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let mut meaning = metadata.key_value_metadata().unwrap().iter();
    let meaning = meaning.find(|one| one.key == "slipwatch.columns").unwrap();
    let meaning = meaning.value.as_ref().unwrap();
    let columns = metadata.schema_descr().columns().iter().map(|column| {
        let kind = (column.physical_type(), column.logical_type_ref().cloned());
        (column.self_type().name().to_owned(), kind)
    });
    let rows = reader.get_row_iter(None).unwrap().map(|row| {
        let row = row.unwrap();
        let known = row.get_column_iter().filter_map(|(name, field)| {
            let value = match field {
                Field::Null => return None,
                Field::Double(number) => (*number).into(),
                Field::Long(number) => (*number).into(),
                Field::Bool(flag) => (*flag).into(),
                Field::Str(text) => text.clone().into(),
                Field::Bytes(bytes) => std::str::from_utf8(bytes.data()).unwrap().into(),
                other => panic!("{name}: {other}"),
            };
            Some((name.clone(), value))
        });
        known.collect()
    });
    (
        columns.collect(),
        rows.collect(),
        serde_json::from_str(meaning).unwrap(),
    )
}

fn lines(words: &[&str]) -> Vec<Value> {
    let text = String::from_utf8(slipwatch(words, "json").stdout).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// That a row has all of an object, key for key, and nothing else; `skip` is other each time.
fn same(row: &RowMap, object: &Value, skip: &[&str]) {
    let mut left = row.clone();
    compare(&mut left, object, "", skip);
    left.retain(|name, _| !skip.contains(&name.as_str()));
    assert!(left.is_empty(), "not in {object}: {left:?}");
}

fn compare(left: &mut RowMap, object: &Value, before: &str, skip: &[&str]) {
    for (key, value) in object.as_object().unwrap() {
        let name = format!("{before}{key}");
        if value.is_null() || skip.contains(&name.as_str()) {
            continue;
        }
        let Some(found) = left.remove(&name) else {
            assert!(value.is_object(), "no {name} of {value}");
            compare(left, value, &format!("{name}."), skip);
            continue;
        };
        match (&found, value) {
            (Value::Number(found), Value::Number(value)) => {
                assert_eq!(found.as_f64(), value.as_f64(), "{name}");
            }
            (Value::Number(found), Value::String(time)) => {
                let time: jiff::Timestamp = time.parse().unwrap();
                assert_eq!(
                    i128::from(found.as_i64().unwrap()),
                    time.as_nanosecond(),
                    "{name}"
                );
            }
            (Value::String(json), Value::Array(_) | Value::Object(_)) => {
                assert_eq!(
                    serde_json::from_str::<Value>(json).unwrap(),
                    *value,
                    "{name}"
                );
            }
            (Value::String(json), value) if found != *value => {
                assert_eq!(
                    serde_json::from_str::<Value>(json).unwrap(),
                    *value,
                    "{name}"
                );
            }
            _ => assert_eq!(found, *value, "{name}"),
        }
    }
}

const PREONZO: [&str; 3] = ["recordings/preonzo-2012.mcap", "--benchmark", "E1"];

#[test]
fn the_events_of_a_replay_are_the_rows_of_a_table_with_times_numbers_and_words() {
    let words = [&["replay"], &PREONZO[..]].concat();
    let (columns, rows, meaning) = table(&words);
    let lines = lines(&words);
    assert!(lines.len() > 20);
    assert_eq!(rows.len(), lines.len());
    for (row, line) in rows.iter().zip(&lines) {
        same(row, line, &[]);
    }
    let utc = LogicalType::timestamp(true, TimeUnit::NANOS);
    for time in ["time", "failure_time.median", "t_max"] {
        assert_eq!(
            columns[time],
            (Physical::INT64, Some(utc.clone())),
            "{time}"
        );
    }
    for number in [
        "velocity_mm_per_day",
        "failure_time.probability",
        "chance_within_outlook",
    ] {
        assert_eq!(columns[number], (Physical::DOUBLE, None), "{number}");
    }
    for word in ["event", "benchmark", "level", "text"] {
        let kind = (Physical::BYTE_ARRAY, Some(LogicalType::String));
        assert_eq!(columns[word], kind, "{word}");
    }
    let says = meaning["velocity_mm_per_day"].as_str().unwrap();
    assert!(says.contains("mm/day"), "{says}");
}

#[test]
fn the_fits_of_several_benchmarks_are_a_row_each() {
    let words = ["fit", "recordings/preonzo-2012.mcap"];
    let (_, rows, _) = table(&words);
    let mut lines = lines(&words);
    lines.retain(|line| line.get("together").is_none());
    assert!(lines.len() > 1);
    assert_eq!(rows.len(), lines.len());
    for (row, line) in rows.iter().zip(&lines) {
        // What it took.
        same(row, line, &["seconds"]);
    }
}

#[test]
fn each_forecast_that_was_scored_is_a_row() {
    let failure = ["--failure-time", "2012-05-15T01:30:00Z"];
    let words = [&["score"], &PREONZO[..], &failure].concat();
    let (_, rows, _) = table(&words);
    let report = lines(&words).remove(0);
    let mut count = 0;
    for lead in report["leads"].as_array().unwrap() {
        for (method, score) in lead["scores"].as_object().unwrap() {
            let mut expected = score.clone();
            for key in ["lead_days", "known_until", "remaining_days"] {
                expected[key] = lead[key].clone();
            }
            for key in ["benchmark", "failure_time", "warning"] {
                expected[key] = report[key].clone();
            }
            expected["method"] = method.as_str().into();
            same(&rows[count], &expected, &[]);
            count += 1;
        }
    }
    assert!(count > 12);
    assert_eq!(rows.len(), count);
}
