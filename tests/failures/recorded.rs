//! A daemon's record in MCAP files, on disks that are full, gone, or lose their daemon.

use crate::site::{Program, Site, command, eventually, get, has_own_mounts};
use serde_json::Value;
use slipwatch::runtime::clock::Stopwatch;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

/// Hourly readings that run away, the last of them as these tests began.
fn failing(rows: std::ops::Range<i32>) -> String {
    static FIRST: std::sync::LazyLock<jiff::Timestamp> = std::sync::LazyLock::new(|| {
        let now = slipwatch::runtime::clock::now().as_second();
        jiff::Timestamp::from_second(now - 113 * 3600).unwrap()
    });
    let first = *FIRST;
    let row = |row: i32| {
        let time = first + jiff::SignedDuration::from_hours(i64::from(row));
        let left = f64::from(120 - row);
        format!("{time},{:.4}\n", 200.0 * (120.0 / left).ln())
    };
    rows.map(row).collect()
}

fn recording(more: &str) -> Site {
    let site = Site::new("[alert]\nevacuation_time = \"3h\"\n");
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let record = format!("record = \"record/site.mcap\"\n{more}state_dir");
    fs::write(
        site.path("site.toml"),
        text.replacen("state_dir", &record, 1),
    )
    .unwrap();
    site
}

/// The files of the record, the oldest first.
fn files(site: &Site) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(site.path("record")) else {
        return Vec::new();
    };
    let files = entries.map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = files
        .filter(|path| path.extension().is_some_and(|ending| ending == "mcap"))
        .collect();
    files.sort();
    files
}

/// What this program's own commands read of the files: the rows as CSV.
fn readings(site: &Site, files: &[PathBuf]) -> String {
    let mut rows = std::collections::BTreeSet::new();
    for file in files {
        site.printed(&["convert", file.to_str().unwrap(), "copy.csv"]);
        rows.extend(site.lines("copy.csv"));
    }
    let rows: Vec<String> = rows
        .into_iter()
        .filter(|row| row.starts_with('2'))
        .collect();
    rows.join("\n")
}

/// By the official reader, which needs no end of the file: of each topic its messages.
const READ: &str = r#"
import json, sys
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
try:
    reader = NonSeekingReader(open(sys.argv[1], "rb"), validate_crcs=True)
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        assert schema.encoding == "jsonschema" and json.loads(schema.data)["type"] == "object"
        print(json.dumps([channel.topic, json.loads(message.data)]))
except EndOfFile:
    print("cut", file=sys.stderr)
"#;

fn by_the_official_reader(files: &[PathBuf]) -> BTreeMap<String, Vec<Value>> {
    let mut topics: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for file in files {
        let mut reader = Command::new("python3");
        let read = reader.args(["-c", READ]).arg(file).output().unwrap();
        let said = String::from_utf8_lossy(&read.stderr);
        assert!(read.status.success(), "{}: {said}", file.display());
        for line in String::from_utf8(read.stdout).unwrap().lines() {
            let (topic, message): (String, Value) = serde_json::from_str(line).unwrap();
            topics.entry(topic).or_default().push(message);
        }
    }
    topics
}

fn health(address: &str) -> Value {
    let answer = get(address, "/api/status");
    let (_, body) = answer.split_once("\r\n\r\n").unwrap();
    serde_json::from_str(body.trim()).unwrap()
}

/// Waits until all that the state has stands in the record, and the past has been judged: nothing has come to it for a second.
fn recorded(site: &Site, address: &str, values: usize) {
    eventually("that it is taken", || site.values().len() == values);
    let (mut before, mut since) = (None, Stopwatch::start());
    eventually("that all is recorded", || {
        let store = slipwatch::store::Store::look(&site.path("state")).unwrap();
        let now = Some((store.last_step(), store.last_event()));
        if before != now {
            (before, since) = (now, Stopwatch::start());
        }
        let record = &health(address)["record"];
        record["step"].as_i64().zip(record["event"].as_i64()) == now
            && since.elapsed() >= Duration::from_secs(1)
    });
}

fn stream(rows: &str) -> String {
    format!("time,displacement_mm\n{rows}")
}

#[test]
fn a_killed_daemons_record_is_read_to_its_last_second_and_a_restart_begins_another_file() {
    let site = recording("");
    let address = site.listen();
    site.append("incoming/5.csv", &stream(&failing(0..100)));
    let mut program = site.caught_up();
    recorded(&site, &address, 100);
    site.append("incoming/5.csv", &failing(100..114));
    recorded(&site, &address, 114);
    program.0.kill().unwrap();
    program.0.wait().unwrap();
    let killed = files(&site);
    assert_eq!(killed.len(), 1, "{killed:?}");
    let bytes = fs::read(&killed[0]).unwrap();
    assert!(!bytes.ends_with(b"\x89MCAP0\r\n"), "it was ended");
    let expected = failing(0..114);
    let same = |rows: String| {
        let number = |row: &str| {
            let (time, value) = row.split_once(',').unwrap();
            (time.to_owned(), value.parse::<f64>().unwrap())
        };
        let rows: Vec<_> = rows.lines().map(number).collect();
        let expected: Vec<_> = expected.lines().map(number).collect();
        assert_eq!(rows, expected);
    };
    same(readings(&site, &killed));
    // Nor is it lost when the last chunk is torn.
    fs::write(site.path("torn.mcap"), &bytes[..bytes.len() - 9]).unwrap();
    let torn = readings(&site, &[site.path("torn.mcap")]);
    assert!(torn.lines().count() > 50, "{torn}");

    site.caught_up().stop();
    assert_eq!(fs::read(&killed[0]).unwrap(), bytes, "it was written to");
    let all = files(&site);
    same(readings(&site, &all[..1]));
    let end = fs::read(all.last().unwrap()).unwrap();
    assert!(all.len() == 1 || end.ends_with(b"\x89MCAP0\r\n"));
}

#[test]
#[cfg_attr(
    not(has_python_mcap),
    ignore = "python3 with mcap was not found by build.rs"
)]
fn the_official_reader_finds_in_a_killed_daemons_record_all_that_was_said() {
    let site = recording("");
    let address = site.listen();
    site.append("incoming/5.csv", &stream(&failing(0..114)));
    let mut program = site.caught_up();
    recorded(&site, &address, 114);
    program.0.kill().unwrap();
    program.0.wait().unwrap();
    let topics = by_the_official_reader(&files(&site));
    let events: Vec<Value> = (site.events().lines())
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let count = |kind: &str| events.iter().filter(|one| one["event"] == kind).count();
    assert!(count("alert") > 0 && count("refit") > 10);
    assert_eq!(topics["/benchmarks/5/displacement"].len(), 114);
    assert_eq!(topics["/benchmarks/5/fit"].len(), count("refit"));
    assert_eq!(topics["/benchmarks/5/forecast"].len(), count("refit"));
    assert_eq!(topics["/alerts"].len(), count("alert"));
    assert_eq!(topics["/log"].len(), events.len() - count("refit"));
    let mut levels: Vec<(&str, &str)> = topics["/benchmarks/5/level"]
        .iter()
        .map(|level| {
            let text = |key: &str| level[key].as_str().unwrap();
            (text("time"), text("level"))
        })
        .collect();
    levels.sort_unstable();
    assert_eq!(levels.last().unwrap().1, "red", "{levels:?}");
}

#[test]
fn a_stopped_daemons_record_is_what_a_replay_of_its_state_records() {
    let site = recording("");
    let address = site.listen();
    site.append("incoming/5.csv", &stream(&failing(0..114)));
    let program = site.caught_up();
    recorded(&site, &address, 114);
    program.stop();
    let all = files(&site);
    assert_eq!(all.len(), 1);
    let words = ["replay", "--state", "state", "--record", "again.mcap"];
    site.printed(&words);
    let counts = |file: &str| {
        let bytes = fs::read(site.path(file)).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let counts = &summary.stats.as_ref().unwrap().channel_message_counts;
        let named = |(id, count): (&u16, &u64)| (summary.channels[id].topic.clone(), *count);
        counts.iter().map(named).collect::<BTreeMap<_, _>>()
    };
    let live = counts(
        all[0]
            .strip_prefix(site.path(""))
            .unwrap()
            .to_str()
            .unwrap(),
    );
    // What was judged first stands beside its level at the beginning.
    let is_level = |topic: &String| topic.ends_with("/level");
    let without = |mut counts: BTreeMap<String, u64>| {
        counts.retain(|topic, _| !is_level(topic));
        counts
    };
    assert!(live.keys().any(is_level));
    assert_eq!(without(live), without(counts("again.mcap")));
}

#[test]
#[cfg_attr(
    not(has_own_mounts),
    ignore = "a process may not have mounts of its own here"
)]
fn a_full_disk_under_the_record_holds_no_alert_up_and_what_was_said_is_recorded_later() {
    if !has_own_mounts(
        "recorded::a_full_disk_under_the_record_holds_no_alert_up_and_what_was_said_is_recorded_later",
    ) {
        return;
    }
    let site = recording("");
    let address = site.listen();
    fs::create_dir(site.path("record")).unwrap();
    let folder = site.path("record");
    let folder = folder.to_str().unwrap();
    command(&["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", folder]);
    let ballast = site.path("record/ballast");
    assert!(fs::write(&ballast, vec![0; 1 << 20]).is_err());
    site.append("incoming/5.csv", &stream(&failing(0..114)));
    let program = site.caught_up();
    site.awaits_red();
    no_record(&site, &address);
    fs::remove_file(&ballast).unwrap();
    recorded(&site, &address, 114);
    assert_eq!(health(&address)["record"]["failure"], Value::Null);
    assert!(site.log().contains("the record is written again"));
    assert_eq!(readings(&site, &files(&site)).lines().count(), 114);
    program.stop();
}

/// That the daemon says so everywhere, and works.
fn no_record(site: &Site, address: &str) {
    eventually("that it is said", || {
        health(address)["record"]["failure"].is_string()
    });
    assert!(get(address, "/metrics").contains("slipwatch_record_failed 1"));
    assert!(get(address, "/readyz").starts_with("HTTP/1.1 200"));
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(status.contains("NO RECORD since"), "{status}");
    let said = |words: &str| site.log().matches(words).count();
    assert_eq!(said("the record cannot be written"), 1, "{}", site.log());
}

#[test]
fn a_folder_that_cannot_be_made_holds_no_alert_up() {
    let site = recording("");
    let address = site.listen();
    // A file of that name, which binds root too.
    fs::write(site.path("record"), "").unwrap();
    site.append("incoming/5.csv", &stream(&failing(0..114)));
    let program: Program = site.caught_up();
    site.awaits_red();
    no_record(&site, &address);
    program.stop();
    site.proven_events();
}

#[test]
fn the_record_is_bounded_and_its_oldest_files_go() {
    let site = recording("record_size = \"20 kB\"\nrecord_total = \"60 kB\"\n");
    let address = site.listen();
    site.append("incoming/5.csv", &stream(&failing(0..114)));
    let program = site.caught_up();
    recorded(&site, &address, 114);
    let first = files(&site)[0].clone();
    let mut rain = String::from("time,rain_mm\n");
    let mut taken = 114;
    // What hardly packs, more than a page of the state's steps at a time.
    for page in 0..12_u64 {
        for row in 0..5000_u64 {
            let number = page * 5000 + row;
            let time = jiff::Timestamp::from_second(1_577_836_800 + 60 * number.cast_signed());
            let value = number.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
            rain += &format!("{},{value}\n", time.unwrap());
        }
        taken += 5000;
        site.append("incoming/rain.csv", &std::mem::take(&mut rain));
        eventually("that it is recorded", || {
            health(&address)["record"]["step"].as_i64() >= Some(taken)
        });
        let size = |file: &PathBuf| fs::metadata(file).unwrap().len();
        let bytes: u64 = files(&site).iter().map(size).sum();
        // A page more than a file should hold, at most.
        assert!(bytes < 300_000, "{bytes} in {:?}", files(&site));
    }
    program.stop();
    assert!(!first.exists());
    let last = files(&site).pop().unwrap();
    let number: String = last
        .to_string_lossy()
        .chars()
        .filter(char::is_ascii_digit)
        .collect();
    assert!(
        number.parse::<u128>().unwrap() % 1_000_000 > 5,
        "{}",
        last.display()
    );
}
