//! A log that cannot be written.

use crate::notified::failing;
use crate::site::{PROGRAM, Program, Site, eventually};
use std::fs::{self, OpenOptions};
use std::process::{Command, Stdio};

fn start(site: &Site, stderr: Stdio) -> Program {
    let child = Command::new(PROGRAM)
        .args(["run", "site.toml"])
        .current_dir(site.0.path())
        .env("RUST_LOG", "debug")
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn();
    Program(child.unwrap())
}

fn site() -> Site {
    let site = Site::new("[alert]\nevacuation_time = \"3h\"\n");
    site.append("incoming/5.csv", "time,displacement_mm\n");
    site
}

fn tells_its_red(site: &Site, mut program: Program) {
    site.append("incoming/5.csv", &failing(0..114));
    eventually("notified", || {
        assert_eq!(program.ended(), None, "it ended");
        site.notified("5/red/", "") > 0
    });
    program.stop();
}

#[test]
fn a_log_on_a_full_disk_keeps_no_red_from_being_sent() {
    let site = site();
    let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
    let program = start(&site, full.into());
    tells_its_red(&site, program);
}

#[test]
fn a_log_whose_reader_has_gone_keeps_no_red_from_being_sent() {
    let site = site();
    let mut program = start(&site, Stdio::piped());
    drop(program.0.stderr.take());
    tells_its_red(&site, program);
}

#[test]
fn a_log_that_nobody_reads_keeps_no_red_from_being_sent() {
    let site = site();
    // Each is worth a line: more than a pipe holds.
    for number in 0..1500 {
        fs::write(
            site.path(&format!("incoming/empty{number:05}.csv")),
            "time,rain_mm\n",
        )
        .unwrap();
    }
    let program = start(&site, Stdio::piped());
    tells_its_red(&site, program);
}
