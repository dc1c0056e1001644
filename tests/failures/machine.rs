//! What the machine does to the daemon: no file descriptors, files that fail to open, mounts that go, sleep, clocks
//! that jump.

use crate::site::{Program, Site, command, eventually, has_own_mounts, tamper};
use jiff::{SignedDuration, Timestamp};
use nix::sys::signal::Signal;
use slipwatch::runtime::clock;
use std::fs;
use std::time::Duration;

const HEADER: &str = "time,displacement_mm\n";
const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

fn row(day: u32) -> String {
    format!("2020-01-{day:02}T00:00:00Z,{day}\n")
}

fn rows(days: std::ops::Range<u32>) -> String {
    days.map(row).collect()
}

/// Values of a benchmark that stand in the state.
pub(crate) fn of(site: &Site, benchmark: &str) -> usize {
    let values = site.values();
    values.iter().filter(|(name, ..)| name == benchmark).count()
}

fn gaps(site: &Site) -> usize {
    site.events().matches("\"kind\":\"possible-gap\"").count()
}

/// Hourly readings up to now that run away.
fn failing() -> String {
    let now = clock::now();
    (0..=113)
        .map(|row: i32| {
            let time = now - SignedDuration::from_hours(i64::from(113 - row));
            format!(
                "{time},{:.4}\n",
                200.0 * (120.0 / f64::from(120 - row)).ln()
            )
        })
        .collect()
}

/// 13. EMFILE: neither a file can be opened nor a hook be started.
#[test]
#[cfg_attr(not(has_prlimit), ignore = "prlimit was not found by build.rs")]
fn a_daemon_without_file_descriptors_loses_nothing_and_sends_its_alerts_once_it_has_some() {
    let site = Site::new(POLICY);
    site.append("incoming/5.csv", HEADER);
    let mut program = site.caught_up();
    let id = program.0.id();
    let limit = |soft: &str| {
        command(&[
            "prlimit",
            &format!("--pid={id}"),
            &format!("--nofile={soft}:"),
        ]);
    };
    // Fewer than it has open: what is open stays.
    limit("4");
    site.append("incoming/5.csv", &failing());
    site.append("incoming/6.csv", &format!("{HEADER}{}", rows(1..4)));
    eventually("that it says so", || site.log().contains("os error 24"));
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(program.ended(), None, "{}", site.log());
    assert!(site.lines("notified").is_empty(), "a hook was started");
    limit("1024");
    eventually("everything", || site.values().len() == 117);
    site.awaits_red();
    program.stop();
    assert_eq!(gaps(&site), 0);
    site.proven_events();
}

/// 13. As when a server that the file lies on has gone, or its disk is broken: each error for a while.
#[test]
#[cfg_attr(
    not(all(has_strace, may_attach)),
    ignore = "strace was not found by build.rs, or may not attach"
)]
fn a_file_that_cannot_be_opened_for_a_while_is_read_then_and_others_meanwhile() {
    let site = Site::new("");
    // strace and a hook that is being started wait for each other.
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    fs::write(site.path("site.toml"), text.replace(", \"unknown\"]", "]")).unwrap();
    for name in ["5", "6"] {
        site.append(
            &format!("incoming/{name}.csv"),
            &format!("{HEADER}{}", rows(1..2)),
        );
    }
    let program = site.caught_up();
    for (round, error) in (0..).zip(["ESTALE", "EIO", "EACCES"]) {
        let inject = format!("inject=openat:error={error}");
        let words = ["-P", "incoming/5.csv", "-e", "trace=openat", "-e", &inject];
        let tracer = tamper(&site, &program, &words);
        for name in ["5", "6"] {
            site.append(&format!("incoming/{name}.csv"), &row(2 + round));
        }
        let known = 2 + usize::try_from(round).unwrap();
        eventually("the other's", || of(&site, "6") == known);
        assert_eq!(of(&site, "5"), known - 1, "it was opened");
        tracer.let_go();
        eventually("its own", || of(&site, "5") == known);
    }
    program.stop();
    assert_eq!(gaps(&site), 0);
    site.proven_events();
}

/// 4. A mount with the files goes, and comes back with more in them.
#[test]
#[cfg_attr(
    not(has_own_mounts),
    ignore = "a process may not have mounts of its own here"
)]
fn a_mount_that_goes_and_comes_back_is_read_on_where_it_was_left() {
    if !has_own_mounts("machine::a_mount_that_goes_and_comes_back_is_read_on_where_it_was_left") {
        return;
    }
    let site = Site::new("");
    fs::create_dir(site.path("server")).unwrap();
    let [server, incoming] =
        ["server", "incoming"].map(|name| site.path(name).to_str().unwrap().to_owned());
    command(&["mount", "-t", "tmpfs", "tmpfs", &server]);
    let mount = || command(&["mount", "--bind", &server, &incoming]);
    mount();
    site.append("server/5.csv", &format!("{HEADER}{}", rows(1..4)));
    let program = site.caught_up();
    assert_eq!(site.values().len(), 3);
    command(&["umount", "-l", &incoming]);
    site.append("server/5.csv", &rows(4..6));
    eventually("that it is gone", || site.log().contains("gone"));
    mount();
    eventually("what came meanwhile", || site.values().len() == 5);
    site.append("server/5.csv", &rows(6..8));
    eventually("what came after", || site.values().len() == 7);
    program.stop();
    assert_eq!(gaps(&site), 0);
    site.proven_events();
}

/// 20. As a machine that is suspended: nothing runs while the files grow.
#[test]
fn a_daemon_that_stood_still_reads_what_came_meanwhile() {
    let site = Site::new("");
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(1..4)));
    let program = site.caught_up();
    program.signal(Signal::SIGSTOP);
    site.append("incoming/5.csv", &rows(4..20));
    site.append("incoming/6.csv", &format!("{HEADER}{}", rows(1..4)));
    program.signal(Signal::SIGCONT);
    eventually("what came meanwhile", || site.values().len() == 22);
    program.stop();
    site.proven_events();
}

/// What to put before a program that is to go by a clock ahead of ours by what stands in the file `ahead`.
pub(crate) fn another_clock(site: &Site) -> [String; 5] {
    let library = format!(
        "/usr/lib/{}-linux-gnu/faketime/libfaketime.so.1",
        std::env::consts::ARCH
    );
    let ahead = site.path("ahead");
    [
        "env".to_owned(),
        format!("LD_PRELOAD={library}"),
        format!("FAKETIME_TIMESTAMP_FILE={}", ahead.display()),
        "FAKETIME_NO_CACHE=1".to_owned(),
        "FAKETIME_DONT_FAKE_MONOTONIC=1".to_owned(),
    ]
}

/// The daemon by that clock.
pub(crate) fn by_another_clock(site: &Site) -> Program {
    let program = site.start(&another_clock(site).each_ref().map(String::as_str));
    eventually("caught up", || site.log().contains("caught up"));
    program
}

/// 20. As after a suspension: the clock jumps, the readings of the time between come, and then it is set back.
#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn a_clock_that_jumps_ahead_makes_a_silence_that_the_next_reading_ends_and_data_time_stays() {
    let site = Site::new(POLICY);
    let now = Timestamp::from_second(clock::now().as_second()).unwrap();
    let at = |hours: i64| {
        format!(
            "{},{}\n",
            now + SignedDuration::from_hours(hours),
            hours + 99
        )
    };
    let past: String = (-30..=0).map(at).collect();
    site.append("incoming/5.csv", &format!("{HEADER}{past}"));
    fs::write(site.path("ahead"), "+0").unwrap();
    let program = by_another_clock(&site);
    let notified = |state: &str| {
        let lines = site.lines("notified");
        let unknown = |line: &&String| line.starts_with("5/unknown/") && line.ends_with(state);
        lines.iter().filter(unknown).count()
    };
    fs::write(site.path("ahead"), "+3d").unwrap();
    eventually("a silence", || notified("firing") == 1);
    let meanwhile: String = (1..=72).map(at).collect();
    site.append("incoming/5.csv", &meanwhile);
    eventually("its end", || notified("resolved") == 1);
    eventually("what came meanwhile", || site.values().len() == 103);
    fs::write(site.path("ahead"), "+0").unwrap();
    std::thread::sleep(Duration::from_secs(2));
    site.append("incoming/5.csv", &at(0).replace(",99", ",99.5"));
    eventually("a correction", || site.values().len() == 104);
    program.stop();
    let store = slipwatch::store::Store::look(&site.path("state")).unwrap();
    let steps = store.steps(0).unwrap();
    assert!(steps.is_sorted_by_key(|step| step.now));
    site.proven_events();
}
