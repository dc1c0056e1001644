//! Clocks that are wrong: the host's, and those of loggers.

use crate::machine::{another_clock, by_another_clock};
use crate::notified::failing;
use crate::reach::{alerts, taken};
use crate::site::{PROGRAM, Site, eventually, get};
use jiff::{SignedDuration, Timestamp};
use nix::sys::signal::Signal;
use slipwatch::runtime::clock;
use std::fs;
use std::process::Command;
use std::time::Duration;

const HEADER: &str = "time,displacement_mm\n";
const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn what_arrives_live_is_reported_although_the_hosts_clock_is_forty_days_ahead() {
    let site = Site::new(POLICY);
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..40)));
    fs::write(site.path("ahead"), "+40d").unwrap();
    let program = by_another_clock(&site);
    for first in (40..114).step_by(10) {
        site.append("incoming/5.csv", &failing(first..(first + 10).min(114)));
        std::thread::sleep(Duration::from_millis(100));
    }
    eventually("notified", || site.notified("5/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn a_clock_that_is_years_back_is_reported_and_what_lies_ahead_is_taken_when_it_is_right() {
    let site = Site::new(POLICY);
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..90)));
    site.caught_up().stop();
    assert_eq!(site.values().len(), 90);
    fs::write(site.path("ahead"), "-9000d").unwrap();
    let program = by_another_clock(&site);
    eventually("that the clock is wrong", || {
        site.notified("site/unknown/clock/", "firing") == 1
    });
    site.append("incoming/5.csv", &failing(100..114));
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(site.values().len(), 90, "what lies ahead is held");
    // Nothing of it is acknowledged.
    program.signal(Signal::SIGKILL);
    drop(program);
    let program = by_another_clock(&site);
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(site.values().len(), 90, "and again after a restart");
    fs::write(site.path("ahead"), "+0").unwrap();
    eventually("what was held", || site.values().len() == 104);
    eventually("the end of it", || {
        site.notified("site/unknown/clock/", "resolved") == 1
    });
    eventually("the red", || site.notified("5/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn a_clock_that_is_set_back_by_two_days_keeps_no_reading_from_being_taken() {
    let site = Site::new(POLICY);
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..113)));
    fs::write(site.path("ahead"), "+0").unwrap();
    let program = by_another_clock(&site);
    fs::write(site.path("ahead"), "-2d").unwrap();
    site.append("incoming/5.csv", &failing(113..114));
    eventually("it is taken", || site.values().len() == 114);
    eventually("and notified", || {
        site.notified("site/unknown/clock/", "firing") == 1
    });
    program.stop();
    site.proven_events();
}

/// Hourly readings from 60 days ago on, ever faster from the 60th on.
fn old(rows: std::ops::Range<i32>) -> String {
    let start = clock::now() - SignedDuration::from_hours(60 * 24);
    rows.map(|row| {
        let time = start + SignedDuration::from_hours(i64::from(row));
        let noise = f64::from((row * 7919) % 13) * 0.01;
        let faster = f64::from((row - 60).max(0));
        format!(
            "{time},{:.4}\n",
            f64::from(row) * 0.1 + noise + 0.25 * faster * faster
        )
    })
    .collect()
}

#[test]
fn one_reading_stamped_a_month_ahead_keeps_no_later_one_from_counting() {
    // Also of a benchmark that has hardly been read.
    for before in [60, 3, 1] {
        stamped_ahead_after(before);
    }
}

fn stamped_ahead_after(before: i32) {
    let site = Site::new(
        "[alert]\nevacuation_time = \"3h\"\n[[alert.threshold]]\nlevel = \"red\"\nvelocity = \"500 mm/day\"\n",
    );
    site.append("incoming/5.csv", &format!("{HEADER}{}", old(0..before)));
    let program = site.caught_up();
    let ahead = clock::now() - SignedDuration::from_hours(28 * 24);
    site.append("incoming/5.csv", &format!("{ahead},6.5\n"));
    eventually("that it is doubted", || {
        site.events().contains("leaps-ahead")
    });
    for first in (before..113).step_by(10) {
        site.append("incoming/5.csv", &old(first..(first + 10).min(113)));
        std::thread::sleep(Duration::from_millis(50));
    }
    eventually("notified", || site.notified("5/red/", "firing") == 1);
    program.stop();
    let events = site.proven_events();
    assert!(events.contains("leapt-ahead"), "{events}");
}

#[test]
fn the_very_first_reading_stamped_a_month_ahead_keeps_no_later_one_from_counting() {
    let ahead = clock::now() - SignedDuration::from_hours(28 * 24);
    let policy = "[alert]\nevacuation_time = \"3h\"\n[[alert.threshold]]\nlevel = \"red\"\nvelocity = \"500 mm/day\"\n";
    // As they come, and on a first start.
    for is_live in [true, false] {
        let site = Site::new(policy);
        site.append("incoming/5.csv", &format!("{HEADER}{ahead},6.5\n"));
        if !is_live {
            site.append("incoming/5.csv", &old(0..113));
        }
        let program = site.caught_up();
        if is_live {
            for first in (0..113).step_by(10) {
                site.append("incoming/5.csv", &old(first..(first + 10).min(113)));
                std::thread::sleep(Duration::from_millis(50));
            }
            eventually("notified", || site.notified("5/red/", "firing") == 1);
        }
        eventually("red", || site.events().contains("\"key\":\"5/red/"));
        eventually("everything", || site.values().len() == 114);
        program.stop();
        let events = site.proven_events();
        // What is read at once is taken in order of time: the one ahead is the last then, and waits.
        let parts = ["leaps-ahead", "its first, lies", "leapt-ahead"];
        for part in &parts[..if is_live { 3 } else { 1 }] {
            assert!(events.contains(part), "{part}: {events}");
        }
        assert!(!events.contains("out-of-order"), "{events}");
    }
}

#[test]
fn a_first_reading_that_is_live_counts_although_a_backlog_comes_after_it() {
    let site = Site::new(POLICY);
    let now = clock::now();
    site.append("incoming/5.csv", &format!("{HEADER}{now},6.5\n"));
    let program = site.caught_up();
    site.append("incoming/5.csv", &old(0..50));
    eventually("the backlog", || site.values().len() == 51);
    program.stop();
    let events = site.proven_events();
    assert!(!events.contains("leaps-ahead"), "{events}");
}

#[test]
fn what_an_unset_clock_gave_first_does_not_disarm_a_displacement_threshold() {
    let site = Site::new("[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"96 mm\"\n");
    let now = clock::now();
    let row = |hour: i32| {
        let time = now - SignedDuration::from_hours(i64::from(40 - hour));
        let noise = f64::from((hour * 7919) % 13) * 0.05;
        format!("{time},{:.3}\n", 2.49 * f64::from(hour) + noise)
    };
    // 95 mm by an hour ago; the logger gave what it reads now before its clock was set.
    let unset: Timestamp = "2000-01-01T00:00:00Z".parse().unwrap();
    let text: String = (1..40).map(row).collect();
    site.append("incoming/5.csv", &format!("{HEADER}{text}"));
    let program = site.caught_up();
    site.append("incoming/5.csv", &format!("{unset},97.5\n"));
    site.append("incoming/5.csv", &row(40));
    eventually("notified", || site.notified("5/red/", "firing") == 1);
    program.stop();
    let events = site.proven_events();
    assert!(events.contains("displacement-threshold"), "{events}");
    assert!(events.contains("clock-not-set"), "{events}");
}

/// A logger that writes local time without saying so, eight hours ahead.
#[test]
fn readings_that_are_whole_hours_ahead_are_said_to_be_perhaps_in_another_zone() {
    let site = Site::new("");
    let now = clock::now();
    let rows = (0..60).map(|row| {
        let time = now + SignedDuration::from_hours(8) - SignedDuration::from_mins(10 * (59 - row));
        format!("{time},{row}\n")
    });
    site.append(
        "incoming/5.csv",
        &format!("{HEADER}{}", rows.collect::<String>()),
    );
    let program = site.caught_up();
    eventually("that the clock is doubted", || {
        site.notified("site/unknown/clock/", "firing") == 1
    });
    program.stop();
    let events = site.proven_events();
    let fault = events
        .lines()
        .find(|line| line.contains("the host's clock says"));
    let fault = fault.unwrap_or_else(|| panic!("{events}"));
    assert!(fault.contains("About 8 h ahead"), "{fault}");
    assert!(fault.contains("set time_zone in its [[source]]"), "{fault}");
}

/// Within what clocks may differ by.
#[test]
fn a_logger_whose_clock_is_ahead_makes_no_other_benchmark_silent() {
    let site = Site::new("");
    let time = |ahead: i64, ago: i64| {
        clock::now() + SignedDuration::from_mins(ahead) - SignedDuration::from_mins(ago)
    };
    for (name, ahead) in [("A", 45), ("B", 0)] {
        let rows = (1..10).rev().map(|ago| format!("{},1\n", time(ahead, ago)));
        let rows: String = rows.collect();
        let text = format!("time,{name}_displacement_mm\n{rows}");
        site.append(&format!("incoming/{name}.csv"), &text);
    }
    let program = site.caught_up();
    for round in 1..=3 {
        for (name, ahead) in [("B", 0), ("A", 45)] {
            let before = site.values().len();
            let row = format!("{},1.0{round}\n", time(ahead, 0));
            site.append(&format!("incoming/{name}.csv"), &row);
            eventually("the reading", || site.values().len() > before);
        }
    }
    eventually("that A is suspect", || {
        site.events().contains("\"kind\":\"suspect-ahead\"")
    });
    program.stop();
    let events = site.proven_events();
    assert!(
        !events.contains("benchmark B: no reading since"),
        "{events}"
    );
    assert_eq!(site.notified("B/unknown/", ""), 0, "{events}");
}

/// It is given by that clock, and the daemon goes by the readings.
#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn a_silence_lasts_as_long_as_it_was_given_for_where_the_hosts_clock_is_days_ahead() {
    let site = Site::new(POLICY);
    let address = site.listen();
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..40)));
    fs::write(site.path("ahead"), "+3d").unwrap();
    let program = by_another_clock(&site);
    for first in [40, 50] {
        site.append("incoming/5.csv", &failing(first..first + 10));
        std::thread::sleep(Duration::from_millis(300));
    }
    let ask = |words: &[&str]| {
        let before = another_clock(&site);
        let output = Command::new(&before[0])
            .args(&before[1..])
            .arg(PROGRAM)
            .args(words)
            .args(["--config", "site.toml"])
            .current_dir(site.path(""))
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let silences = || get(&address, "/metrics").contains("slipwatch_silences 1");
    let seen = || {
        [
            silences(),
            ask(&["status"]).contains("silence by Ada"),
            ask(&["alerts", "list"]).contains("silence by Ada"),
            !get(&address, "/api/site").contains("\"silences\":[]"),
        ]
    };
    ask(&["alerts", "silence", "--for", "6s", "--by", "Ada"]);
    eventually("that it is taken", silences);
    assert_eq!(seen(), [true; 4]);
    eventually("its end", || !silences());
    assert_eq!(seen(), [false; 4]);
    site.append("incoming/5.csv", &failing(60..114));
    eventually("the red", || site.notified("5/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

/// As by a logger whose clock jumps once, or that stands in the hour after the end of summer time.
#[test]
fn one_reading_stamped_within_the_hour_keeps_no_true_one_from_calling_red() {
    let site = Site::new("[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"50 mm\"\n");
    let creep: String = (1..60)
        .rev()
        .map(|row| {
            let time = clock::now() - SignedDuration::from_mins(row);
            format!("{time},{:.3}\n", 0.001 * (60 - row) as f64)
        })
        .collect();
    site.append("incoming/5.csv", &format!("{HEADER}{creep}"));
    let program = site.caught_up();
    let ahead = clock::now() + SignedDuration::from_mins(50);
    site.append("incoming/5.csv", &format!("{ahead},0.1\n"));
    eventually("the one ahead", || site.values().len() == 60);
    for reading in 0..4 {
        let now = clock::now();
        let line = format!("{now},{}\n", 60 + 40 * reading);
        site.append("incoming/5.csv", &line);
        eventually("it", || site.values().len() == 61 + reading);
    }
    eventually("the red", || site.notified("5/red/", "firing") == 1);
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(status.contains("red"), "{status}");
    program.stop();
    let events = site.proven_events();
    assert!(events.contains("leaps-ahead"), "{events}");
}

/// Its readings from before are of the same minutes as the new ones, as they are of full ones.
#[test]
fn a_logger_that_ran_ahead_and_is_set_right_calls_red_with_its_third_reading() {
    let site = Site::new("[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"50 mm\"\n");
    let begin = clock::now();
    let row = |minutes: i64, value: f64| {
        let time = begin + SignedDuration::from_mins(minutes);
        format!("{time},{value:.3}\n")
    };
    let creep: String = (-60..6).map(|index| row(10 * index, 0.001)).collect();
    site.append("incoming/5.csv", &format!("{HEADER}{creep}"));
    let program = site.caught_up();
    for (taken, minutes) in (67..).zip([-20, -10, 0]) {
        assert_eq!(site.notified("5/red/", "firing"), 0);
        site.append("incoming/5.csv", &row(minutes, 100.0 + minutes as f64));
        eventually("it", || site.values().len() == taken);
    }
    eventually("the red", || site.notified("5/red/", "firing") == 1);
    program.stop();
    let events = site.proven_events();
    assert!(events.contains("clock-set-back"), "{events}");
}

/// It lasts the time it was given for, and not as much longer as the clock was set back.
#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn a_clock_that_is_set_back_by_less_than_counts_as_wrong_prolongs_no_silence() {
    let site = Site::new(POLICY);
    site.append("incoming/5.csv", &format!("{HEADER}{},1\n", clock::now()));
    fs::write(site.path("ahead"), "+0").unwrap();
    let program = by_another_clock(&site);
    alerts(&site, &["silence", "--for", "6s"]);
    taken(&site, "silence");
    fs::write(site.path("ahead"), "-50m").unwrap();
    eventually("its end", || {
        site.log().contains("were not reported has ended")
    });
    program.stop();
}

/// All of an upload counts, whose newest reading comes first and lies a quarter of an hour ahead.
#[test]
fn an_upload_that_begins_with_its_newest_reading_is_no_logger_that_was_set_right() {
    let site = Site::new("[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"50 mm\"\n");
    let begin = clock::now() + SignedDuration::from_mins(15);
    let row = |back: i64, value: f64| {
        let time = begin - SignedDuration::from_mins(10 * back);
        format!("{time},{value:.3}\n")
    };
    let creep: String = (6..60).rev().map(|back| row(back, 0.001)).collect();
    site.append("incoming/5.csv", &format!("{HEADER}{creep}"));
    let program = site.caught_up();
    for (taken, back) in (55..).zip(0..6) {
        site.append("incoming/5.csv", &row(back, 100.0 - back as f64));
        eventually("it", || site.values().len() == taken);
    }
    program.stop();
    let events = site.proven_events();
    assert!(!events.contains("clock-set-back"), "{events}");
}

/// As where the sensor has gone with the slope.
#[test]
#[cfg_attr(not(has_faketime), ignore = "libfaketime was not found by build.rs")]
fn what_is_unknown_beside_a_red_says_that_the_red_stays() {
    let site = Site::new(POLICY);
    let hook = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\n\
                echo \"$SLIPWATCH_LEVEL $SLIPWATCH_STATE beside:$SLIPWATCH_IN_FORCE $SLIPWATCH_RECOMMENDED\" >> advice\n";
    fs::write(site.path("hook.sh"), hook).unwrap();
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..114)));
    fs::write(site.path("ahead"), "+0").unwrap();
    let program = by_another_clock(&site);
    site.awaits_red();
    fs::write(site.path("ahead"), "+3d").unwrap();
    let said = |begins: &str| {
        site.lines("advice")
            .iter()
            .any(|line| line.starts_with(begins))
    };
    eventually("that it is unknown", || {
        said("unknown firing beside:red RED STAYS IN FORCE")
    });
    assert!(
        said("red firing beside: Evacuate"),
        "{:?}",
        site.lines("advice")
    );
    program.stop();
}
