//! A state folder that the first version wrote is brought to this one's tables, and nothing of it is lost.

use crate::site::{Site, eventually};
use flate2::read::GzDecoder;
use rusqlite::Connection;
use serde_json::Value;
use std::fs;
use std::io::Read;
use std::path::Path;

/// The alert that stood when the first version stopped: one hook had taken it, the other had refused it six times.
const RED: &str = "5/red/2026-11-25T10:00:00Z";

/// What a file of tests/reference holds.
fn unpacked(name: &str) -> Vec<u8> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference")
        .join(name);
    let mut bytes = Vec::new();
    GzDecoder::new(fs::File::open(file).unwrap())
        .read_to_end(&mut bytes)
        .unwrap();
    bytes
}

/// The made-up slope that the first version watched: hourly readings that run away.
fn rows() -> String {
    let last: jiff::Timestamp = "2026-11-25T10:00:00Z".parse().unwrap();
    let row = |row: i32| {
        let time = last - jiff::SignedDuration::from_hours(i64::from(113 - row));
        let moved = 200.0 * (120.0 / f64::from(120 - row)).ln();
        format!("{time},{moved:.4}\n")
    };
    (0..114).map(row).collect()
}

/// Whether all that `old` has stands in `new`, which may have more.
fn is_kept(old: &Value, new: &Value) -> bool {
    match (old, new) {
        (Value::Object(old), Value::Object(new)) => old
            .iter()
            .all(|(key, value)| new.get(key).is_some_and(|one| is_kept(value, one))),
        _ => old == new,
    }
}

fn lines(text: &str) -> Vec<Value> {
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn a_state_that_the_first_version_wrote_keeps_readings_events_and_what_was_not_delivered() {
    let site = Site::new(
        "[alert]\nevacuation_time = \"3h\"\n[[hook]]\nrun = [\"/bin/sh\", \"late.sh\"]\nlevels = [\"red\"]\n",
    );
    let late = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> late\n";
    fs::write(site.path("late.sh"), late).unwrap();
    fs::create_dir(site.path("state")).unwrap();
    fs::write(
        site.path("state/slipwatch.db"),
        unpacked("state-0.1.0.db.gz"),
    )
    .unwrap();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", rows()),
    );
    let program = site.caught_up();
    eventually("what waited is delivered", || {
        site.lines("late").contains(&format!("{RED} firing"))
    });
    let now = slipwatch::runtime::clock::now();
    site.append("incoming/5.csv", &format!("{now},570\n"));
    eventually("a new reading", || site.values().len() == 115);
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(status.contains("red"), "{status}");
    program.stop();
    assert!(
        site.log().contains("brought to this version"),
        "{}",
        site.log()
    );
    let database = Connection::open(site.path("state/slipwatch.db")).unwrap();
    for table in ["series", "latest"] {
        let query = format!("SELECT count(*), count(sum) FROM {table}");
        let (rows, sums): (i64, i64) = database
            .query_row(&query, [], |row| Ok((row.get(0)?, row.get(1)?)))
            .unwrap();
        assert!(rows > 0 && sums == rows, "{table}: {sums} of {rows}");
    }
    assert_eq!(site.notified(RED, "firing"), 0, "it had been taken");
    assert_eq!(site.lines("late").len(), 1, "{:?}", site.lines("late"));
    let before = String::from_utf8(unpacked("state-0.1.0-events.ndjson.gz")).unwrap();
    let (before, after) = (lines(&before), lines(&site.events()));
    assert_eq!(before.len(), 112);
    for (old, new) in before.iter().zip(&after) {
        assert!(is_kept(old, new), "{old}\n{new}");
    }
}
