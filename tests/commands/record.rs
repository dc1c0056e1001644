//! `replay --record`: an MCAP file for Foxglove, whose readings can be replayed again.

use assert_cmd::Command;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const PREONZO: [&str; 3] = ["recordings/preonzo-2012.mcap", "--benchmark", "E1"];

fn slipwatch(words: &[&[&str]]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(words.concat())
        .assert()
        .success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

/// The crisis of Preonzo at E1, recorded, with its events.
fn recorded() -> (tempfile::TempDir, PathBuf, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("out.mcap");
    let record = ["--record", file.to_str().unwrap(), "--format", "json"];
    let events = slipwatch(&[&["replay"], &PREONZO, &record]);
    (folder, file, events)
}

#[test]
fn a_replay_of_the_recorded_file_says_the_same() {
    let (folder, file, events) = recorded();
    let file = file.to_str().unwrap();
    assert_eq!(slipwatch(&[&["replay", file, "--format", "json"]]), events);
    // Also up to a time, of which the file then holds nothing later.
    let until = ["--until", "2012-04-20T00:00:00Z", "--format", "json"];
    let early = folder.path().join("early.mcap");
    let early = early.to_str().unwrap();
    let said = slipwatch(&[&["replay"], &PREONZO, &until, &["--record", early]]);
    assert_eq!(slipwatch(&[&["replay", early, "--format", "json"]]), said);
    assert!(events.starts_with(said.rsplit_once("\n{").unwrap().0));
}

#[test]
fn an_output_that_would_not_be_read_as_mcap_is_refused() {
    let refused = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .args(["replay", "a.csv", "--record", "out.csv"])
        .assert()
        .code(2);
    let said = String::from_utf8_lossy(&refused.get_output().stderr);
    assert!(said.contains("ends in .mcap"), "{said}");
}

/// What the official reader of MCAP finds: of each topic its schema's name and text, and its messages.
struct Topic {
    schema: String,
    text: Value,
    messages: Vec<(u64, Value)>,
}

const READ: &str = r#"
import json, sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    for schema, channel, message in reader.iter_messages():
        assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
        print(json.dumps([channel.topic, schema.name, json.loads(schema.data), message.log_time, json.loads(message.data)]))
"#;

fn by_the_official_reader(file: &Path) -> BTreeMap<String, Topic> {
    let read = Command::new("python3")
        .args(["-c", READ])
        .arg(file)
        .assert()
        .success();
    let lines = String::from_utf8(read.get_output().stdout.clone()).unwrap();
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    for line in lines.lines() {
        let (topic, schema, text, time, message): (String, String, Value, u64, Value) =
            serde_json::from_str(line).unwrap();
        let topic = topics.entry(topic).or_insert_with(|| Topic {
            schema,
            text,
            messages: Vec::new(),
        });
        topic.messages.push((time, message));
    }
    topics
}

#[test]
#[cfg_attr(
    not(has_python_mcap),
    ignore = "python3 with mcap was not found by build.rs"
)]
fn the_official_reader_finds_readings_fits_forecasts_levels_and_alerts_as_their_schemas_say() {
    let (_folder, file, _) = recorded();
    let topics = by_the_official_reader(&file);
    let schemas: Vec<(&str, &str)> = topics
        .iter()
        .map(|(topic, one)| (topic.as_str(), one.schema.as_str()))
        .collect();
    assert_eq!(
        schemas,
        [
            ("/alerts", "slipwatch.Alert"),
            ("/benchmarks/E1/displacement", "slipwatch.Reading"),
            ("/benchmarks/E1/fit", "slipwatch.Fit"),
            ("/benchmarks/E1/forecast", "slipwatch.Forecast"),
            ("/benchmarks/E1/level", "slipwatch.Level"),
            ("/log", "foxglove.Log"),
        ]
    );
    each_message_is_as_its_schema_says(&topics);
}

fn each_message_is_as_its_schema_says(topics: &BTreeMap<String, Topic>) {
    for (name, topic) in topics {
        let mut closed = topic.text.clone();
        closed["additionalProperties"] = false.into();
        let validator = jsonschema::options()
            .should_validate_formats(true)
            .build(&closed)
            .unwrap();
        for (_, message) in &topic.messages {
            let wrong: Vec<String> = validator
                .iter_errors(message)
                .map(|e| e.to_string())
                .collect();
            assert!(wrong.is_empty(), "{name}: {wrong:?}\n{message}");
        }
    }
}

#[test]
#[cfg_attr(
    not(has_python_mcap),
    ignore = "python3 with mcap was not found by build.rs"
)]
fn what_is_recorded_is_what_was_said() {
    let (_folder, file, events) = recorded();
    let topics = by_the_official_reader(&file);
    let events: Vec<Value> = events
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let of = |kind: &str| {
        events
            .iter()
            .filter(|one| one["event"] == kind)
            .collect::<Vec<_>>()
    };
    let forecasts = &topics["/benchmarks/E1/forecast"].messages;
    assert_eq!(forecasts.len(), of("refit").len());
    for ((time, forecast), refit) in forecasts.iter().zip(of("refit")) {
        let at = |value: &Value| value.as_str().unwrap().parse::<jiff::Timestamp>().unwrap();
        assert_eq!(i128::from(*time), at(&refit["time"]).as_nanosecond());
        let chance = "chance_within_evacuation_time";
        assert_eq!(forecast[chance], refit[chance]);
        let median = &refit["failure_time"]["median"];
        assert_eq!(forecast.get("median").unwrap_or(&Value::Null), median);
        if !median.is_null() {
            let days = at(median).duration_since(at(&refit["time"])).as_secs_f64() / 86_400.0;
            assert!((forecast["median_days"].as_f64().unwrap() - days).abs() < 1e-6);
        }
    }
    assert_eq!(topics["/alerts"].messages.len(), of("alert").len());
    let levels = &topics["/benchmarks/E1/level"].messages;
    assert_eq!(levels[0].1["level"], "green");
    let red = levels
        .iter()
        .find(|(_, level)| level["level"] == "red")
        .unwrap();
    let alert = of("alert")
        .into_iter()
        .find(|alert| alert["level"] == "red")
        .unwrap();
    assert_eq!(red.1["time"], alert["time"]);
    assert_eq!(red.1["number"], 3);
    let fatal = topics["/log"]
        .messages
        .iter()
        .filter(|(_, line)| line["level"] == 5)
        .count();
    assert_eq!(
        fatal,
        of("alert")
            .iter()
            .filter(|alert| alert["level"] == "red")
            .count()
    );
}

/// Every string under a key of that name, however deep.
fn strings<'a>(value: &'a Value, key: &str, found: &mut Vec<&'a str>) {
    match value {
        Value::Object(members) => {
            found.extend(members.get(key).and_then(Value::as_str));
            for one in members.values() {
                strings(one, key, found);
            }
        }
        Value::Array(items) => {
            for one in items {
                strings(one, key, found);
            }
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

#[test]
#[cfg_attr(
    not(has_python_mcap),
    ignore = "python3 with mcap was not found by build.rs"
)]
fn all_that_the_layout_shows_is_in_the_recorded_file() {
    let (_folder, file, _) = recorded();
    let topics = by_the_official_reader(&file);
    let layout = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy/foxglove/slipwatch.json");
    let layout: Value = serde_json::from_str(&std::fs::read_to_string(layout).unwrap()).unwrap();
    let mut paths = Vec::new();
    for key in ["value", "topicPath", "topicToRender"] {
        strings(&layout["configById"], key, &mut paths);
    }
    assert!(paths.len() > 8, "{paths:?}");
    for path in paths {
        let (topic, field) = path.split_once('.').unwrap_or((path, ""));
        let found = topics.get(topic).unwrap_or_else(|| panic!("{path}"));
        let is_there = field.is_empty() || found.text["properties"].get(field).is_some();
        assert!(is_there, "{path}");
    }
    // Each panel that is laid out is set up, and the other way round.
    let mut shown = Vec::new();
    for key in ["first", "second"] {
        strings(&layout["layout"], key, &mut shown);
    }
    shown.sort_unstable();
    let mut known: Vec<&str> = layout["configById"]
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    known.sort_unstable();
    assert_eq!(shown, known);
}

#[test]
fn what_a_daemon_took_in_can_be_recorded_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let readings = (1..=31).map(|day| {
        let slip = f64::from(day * day) * 0.5;
        format!("2020-01-{day:02}T00:00:00Z,{slip},{}\n", day % 4)
    });
    let text = "time,displacement_mm,rain_mm\n".to_owned() + &readings.collect::<String>();
    std::fs::write(folder.path().join("upper.csv"), text).unwrap();
    let config = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
                  [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"upper.csv\"\n";
    std::fs::write(folder.path().join("site.toml"), config).unwrap();
    let slipwatch = |words: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_slipwatch"));
        command.current_dir(&folder).args(words);
        command
    };
    let mut daemon = slipwatch(&["run", "site.toml"])
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let said = |words: &[&str]| {
        let done = slipwatch(words).output().unwrap();
        String::from_utf8(done.stdout).unwrap()
    };
    let record = [
        "replay", "--state", "state", "--record", "out.mcap", "--format", "json",
    ];
    let mut events = String::new();
    for _ in 0..1200 {
        events = said(&record);
        if events.contains("\"readings\":31") {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    daemon.kill().unwrap();
    daemon.wait().unwrap();
    assert!(events.contains("\"readings\":31"), "{events}");
    let as_csv = |file: &str| {
        said(&["convert", file, "copy.csv"]);
        std::fs::read_to_string(folder.path().join("copy.csv")).unwrap()
    };
    assert_eq!(as_csv("out.mcap"), as_csv("upper.csv"));
}
