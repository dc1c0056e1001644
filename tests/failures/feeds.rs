//! What comes in and cannot be used: it stops nothing else, and nothing of it is silent.

use crate::notified::failing;
use crate::site::{Site, eventually};
use flate2::Compression;
use flate2::write::GzEncoder;
use nix::sys::signal::Signal;
use std::fs::{self, File};
use std::io::Write;

const HEADER: &str = "time,displacement_mm\n";
const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

/// With a file in its folder that never gives anything, a site reports its red, takes a new config, and stops.
fn goes_on(site: &Site) {
    site.append("incoming/5.csv", HEADER);
    let program = site.start(&[]);
    eventually("a start", || site.log().contains("followed"));
    site.append("incoming/5.csv", &failing(0..114));
    eventually("notified", || site.notified("5/red/", "") == 1);
    program.signal(Signal::SIGHUP);
    eventually("the config", || site.log().contains("the config is taken"));
    program.stop();
    let length = fs::metadata(site.path("log")).unwrap().len();
    assert!(length < 1 << 20, "{length} bytes of log");
}

#[test]
fn a_file_of_a_terabyte_without_a_line_stops_no_other_source() {
    let site = Site::new(POLICY);
    let file = File::create(site.path("incoming/0.csv")).unwrap();
    file.set_len(1 << 40).unwrap();
    goes_on(&site);
}

#[test]
fn a_packed_file_of_very_many_bad_lines_stops_no_other_source_and_fills_no_log() {
    let site = Site::new(POLICY);
    let file = File::create(site.path("incoming/0.csv.gz")).unwrap();
    let mut packed = GzEncoder::new(file, Compression::fast());
    packed.write_all(HEADER.as_bytes()).unwrap();
    let lines = "x\n".repeat(1 << 19);
    for _ in 0..100 {
        packed.write_all(lines.as_bytes()).unwrap();
    }
    packed.finish().unwrap();
    goes_on(&site);
}

#[test]
fn a_file_that_was_moved_away_while_the_daemon_was_down_is_a_possible_gap() {
    let site = Site::new("");
    fs::create_dir(site.path("archive")).unwrap();
    let rows = |days: std::ops::Range<u32>| -> String {
        days.map(|day| format!("2020-01-{day:02}T00:00:00Z,{day}\n"))
            .collect()
    };
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(1..6)));
    site.caught_up().stop();
    site.append("incoming/5.csv", &rows(6..9));
    fs::rename(site.path("incoming/5.csv"), site.path("archive/5.csv")).unwrap();
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(9..12)));
    site.caught_up().stop();
    let events = site.proven_events();
    assert_eq!(
        events.matches("\"kind\":\"possible-gap\"").count(),
        1,
        "{events}"
    );
    assert_eq!(site.values().len(), 8);
    site.caught_up().stop();
    let events = site.proven_events();
    assert_eq!(
        events.matches("\"kind\":\"possible-gap\"").count(),
        1,
        "notified again"
    );
}

#[test]
fn a_recording_with_a_record_that_cannot_end_is_refused_and_said_to_be() {
    let site = Site::new("");
    let mut bytes = b"\x89MCAP0\r\n".to_vec();
    // A metadata record.
    bytes.push(0x0c);
    bytes.extend((1_u64 << 50).to_le_bytes());
    bytes.extend([0; 4000]);
    fs::write(site.path("incoming/5.mcap"), bytes).unwrap();
    let program = site.caught_up();
    eventually("that it is refused", || {
        site.log().contains("file refused until it is replaced")
    });
    program.stop();
}

#[test]
fn a_column_that_no_file_has_is_said_by_the_check_and_no_other_is_taken_for_it() {
    let site = Site::new(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\ncolumn = \"upper_displacement_mm\"\n",
    );
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..60)));
    let output = site.ask(&["check", "site.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("have no reading of it"), "{said}");
    site.caught_up().stop();
    assert_eq!(site.values().len(), 0, "another column was taken");
}
