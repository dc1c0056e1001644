//! Who is notified of what: in which order, how often, and what people ask for.

use crate::site::{Program, Site, eventually, get};
use jiff::{SignedDuration, Timestamp};
use slipwatch::runtime::clock;
use std::fs;
use std::ops::Range;
use std::sync::OnceLock;
use std::time::Duration;

const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

/// The same for all rows of a test.
static NOW: OnceLock<Timestamp> = OnceLock::new();

/// Hourly readings that run away, the 114th of them now.
pub(crate) fn failing(rows: Range<i32>) -> String {
    let now = *NOW.get_or_init(clock::now);
    rows.map(|row| {
        let time = now - SignedDuration::from_hours(i64::from(113 - row));
        let left = f64::from(120 - row);
        format!("{time},{:.4}\n", 200.0 * (120.0 / left).ln())
    })
    .collect()
}

/// 12 benchmarks of one file.
fn rows(hours: Range<i64>) -> Vec<String> {
    let now = *NOW.get_or_init(clock::now);
    hours
        .map(|hour| {
            let values: String = (0..12)
                .map(|one| format!(",{}.{one}", hour + 500))
                .collect();
            format!("{}{values}\n", now + SignedDuration::from_hours(hour))
        })
        .collect()
}

#[test]
fn a_backlog_that_comes_in_row_by_row_is_one_silence_a_benchmark() {
    let site = Site::new("");
    let names: String = (0..12)
        .map(|one| format!(",p{one}_displacement_mm"))
        .collect();
    site.append(
        "incoming/all.csv",
        &format!("time{names}\n{}", rows(-120..-72).concat()),
    );
    let program = site.caught_up();
    eventually("that they are silent", || {
        site.notified("", "firing") >= 1
            && site
                .events()
                .matches("unknown\",\"state\":\"firing")
                .count()
                >= 12
    });
    for row in rows(-72..-48) {
        site.append("incoming/all.csv", &row);
        std::thread::sleep(Duration::from_millis(250));
    }
    let events = site.events();
    let has_ended = events.contains("\"level\":\"unknown\",\"state\":\"resolved\"");
    assert!(!has_ended, "what is two days old is no end: {events}");
    site.append("incoming/all.csv", &rows(-48..1).concat());
    eventually("that they read again", || {
        let events = site.events();
        let ends = events.lines().filter(|line| {
            line.contains("unknown\",\"state\":\"resolved") && line.contains("benchmark\":\"p")
        });
        ends.count() == 12
    });
    program.stop();
    let events = site.events();
    let of_benchmarks = events
        .lines()
        .filter(|line| line.contains("\"level\":\"unknown\"") && line.contains("benchmark\":\"p"));
    assert_eq!(of_benchmarks.count(), 24, "each silence once: {events}");
    assert!(
        site.lines("notified").len() <= 24,
        "{:?}",
        site.lines("notified")
    );
    site.proven_events();
}

#[test]
fn corrected_readings_are_judged_once_a_batch_and_delay_no_red_of_another_benchmark() {
    let site = Site::new(POLICY);
    site.append(
        "incoming/4.csv",
        &format!("time,displacement_mm\n{}", failing(0..60)),
    );
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..60)),
    );
    let program = site.caught_up();
    let refits = || {
        let events = site.events();
        let is_one = |line: &&str| {
            line.contains("\"event\":\"refit\"") && line.contains("benchmark\":\"4\"")
        };
        events.lines().filter(is_one).count()
    };
    let before = refits();
    // The same times with other values, many times over.
    let again = failing(5..59);
    let corrected: String = (1..=9)
        .flat_map(|round| again.lines().map(move |line| format!("{line}{round}\n")))
        .collect();
    site.append("incoming/4.csv", &corrected);
    site.append("incoming/5.csv", &failing(60..114));
    eventually("the other's red", || site.notified("5/red/", "firing") == 1);
    eventually("all corrections", || {
        site.events().matches("\"kind\":\"corrected\"").count() == 486
    });
    program.stop();
    assert!(refits() <= before + 20, "{} refits of {before}", refits());
    site.proven_events();
}

#[test]
fn very_many_readings_of_one_time_delay_no_red_of_another_benchmark() {
    let site = Site::new(POLICY);
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..60)),
    );
    let program = site.caught_up();
    let time = clock::now() - SignedDuration::from_mins(5);
    let same: String = (0..40_000)
        .map(|row| format!("{time},{:.3}\n", 80.0 + f64::from(row) / 1000.0))
        .collect();
    site.append("incoming/6.csv", &format!("time,displacement_mm\n{same}"));
    site.append("incoming/5.csv", &failing(60..114));
    eventually("the other's red", || site.notified("5/red/", "firing") == 1);
    eventually("all of them", || {
        let values = site.values();
        values.iter().filter(|(name, ..)| name == "6").count() == 40_000
    });
    // Read again from its start, as a file is that is put in another's place, it gives nothing new.
    fs::write(
        site.path("incoming/new"),
        format!("time,displacement_mm\n{same}"),
    )
    .unwrap();
    fs::rename(site.path("incoming/new"), site.path("incoming/6.csv")).unwrap();
    site.append("incoming/6.csv", &format!("{time},1.5\n"));
    eventually("what comes after them", || {
        let values = site.values();
        values
            .iter()
            .any(|(name, _, value)| name == "6" && *value < 2.0)
    });
    assert_eq!(site.values().len(), 40_115);
    program.stop();
}

#[test]
fn a_silence_has_a_longest_time_and_an_end_and_is_seen_everywhere() {
    let site = Site::new(POLICY);
    let listen = site.listen();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..8)),
    );
    let program = site.caught_up();
    let alerts = |words: &[&str]| {
        let all = [&["alerts"], words, &["--config", "site.toml"]].concat();
        site.ask(&all)
    };
    let refused = alerts(&["silence", "--for", "876000h"]);
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("168h at most"));
    assert!(alerts(&["silence", "--for", "2h"]).status.success());
    let shown = |what: &str| get(&listen, what);
    eventually("in the metrics", || {
        shown("/metrics").contains("slipwatch_silences 1")
    });
    let until = || {
        let all = shown("/metrics");
        let line = all
            .lines()
            .find_map(|line| line.strip_prefix("slipwatch_silenced_until_timestamp_seconds "));
        line.map_or(0.0, |text| text.parse::<f64>().unwrap())
    };
    let long = until();
    assert!(alerts(&["silence", "--for", "1h"]).status.success());
    eventually("the later one says how long", || until() < long - 3000.0);
    assert!(shown("/api/status").contains("\"silences\":[{"));
    assert!(site.log().contains("Silence"), "{}", site.log());
    for words in [&["status"][..], &["alerts", "list"]] {
        let said = site.printed(&[words, &["--config", "site.toml"]].concat());
        assert_eq!(said.matches("silence until").count(), 1, "{said}");
    }
    site.append("incoming/5.csv", &failing(8..114));
    eventually("a red", || site.events().contains("\"level\":\"red\""));
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(site.notified("5/red/", "firing"), 0, "it was silenced");
    assert!(alerts(&["unsilence"]).status.success());
    eventually("notified", || site.notified("5/red/", "firing") == 1);
    eventually("no longer in the metrics", || {
        shown("/metrics").contains("slipwatch_silences 0")
    });
    program.stop();
    site.proven_events();
}

#[test]
fn a_hook_of_the_whole_site_is_notified_that_its_sensors_are_silent() {
    let site = Site::new("");
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let text = text.replace("[[hook]]\n", "[[hook]]\nsite = true\n");
    fs::write(site.path("site.toml"), text).unwrap();
    let old = rows(-100..-60);
    site.append(
        "incoming/all.csv",
        &format!(
            "time,a_displacement_mm\n{}",
            old.iter()
                .map(|row| row.split(',').take(2).collect::<Vec<_>>().join(",") + "\n")
                .collect::<String>()
        ),
    );
    let program = site.caught_up();
    eventually("notified", || site.notified("site/unknown/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn a_site_of_which_nobody_is_notified_that_a_sensor_is_dead_does_not_pass_the_check_unseen() {
    let site = Site::new("");
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let text = text.replace(", \"unknown\"]", "]");
    fs::write(site.path("site.toml"), text).unwrap();
    let output = site.ask(&["check", "site.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("no hook has unknown"), "{said}");
}

/// How a hook's child detaches: in a session of its own, and besides that with nothing left in its environment and no parent.
const DETACHED: [&str; 2] = ["setsid", "env -i setsid"];

/// The daemon, once a red has had two attempts of `hook`, and what the first of them wrote into `children` has ended.
fn until_the_first_child_ends(site: &Site, hook: &str) -> Program {
    let script = format!("[ $SLIPWATCH_LEVEL = red ] || exit 0\n{hook}");
    fs::write(site.path("hook.sh"), script).unwrap();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..114)),
    );
    let program = site.caught_up();
    eventually("two attempts", || site.lines("children").len() >= 2);
    let first = site.lines("children").swap_remove(0);
    eventually("its end", || has_ended(&first));
    program
}

#[test]
fn a_child_that_leaves_its_hooks_group_does_not_outlive_the_attempt() {
    for detached in DETACHED {
        let site = Site::new(POLICY);
        let text = fs::read_to_string(site.path("site.toml")).unwrap();
        fs::write(site.path("site.toml"), format!("{text}timeout = \"1s\"\n")).unwrap();
        let hook = format!("({detached} sh -c 'echo $$ >> children; sleep 300' &)\nsleep 300\n");
        until_the_first_child_ends(&site, &hook).let_go();
        for child in site.lines("children") {
            let _ = std::process::Command::new("kill").arg(child).status();
        }
    }
}

#[test]
fn what_a_hook_that_fails_leaves_behind_does_not_outlive_the_attempt_either() {
    for detached in DETACHED {
        let site = Site::new(POLICY);
        let hook =
            format!("{detached} sh -c 'echo $$ >> children; sleep 300' &\nsleep 0.2\nexit 1\n");
        until_the_first_child_ends(&site, &hook).stop();
        for child in site.lines("children") {
            let is_over = has_ended(&child);
            let _ = std::process::Command::new("kill").arg(&child).status();
            assert!(is_over, "one outlives the daemon: {detached}");
        }
    }
}

/// Whether a process is there no more.
fn has_ended(process: &str) -> bool {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    stat.is_empty() || stat.contains(") Z ")
}

/// All that a program printed.
fn said(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr[..]].concat()).into_owned()
}

#[test]
fn what_people_resolve_ends_and_the_next_reading_that_calls_for_it_calls_it_again() {
    let site = Site::new(POLICY);
    // One reading, four days old: after a second one the benchmark would be silent as soon as that is checked.
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..1)),
    );
    let alerts = |words: &[&str]| {
        let all = [&["alerts"], words, &["--config", "site.toml"]].concat();
        site.ask(&all)
    };
    let program = site.caught_up();
    let nothing = alerts(&["ack", "--by", "Ada"]);
    assert_eq!(nothing.status.code(), Some(1), "{}", said(&nothing));
    assert!(said(&nothing).contains("there is nothing to acknowledge"));
    site.append("incoming/5.csv", &failing(1..113));
    eventually("notified", || site.notified("5/red/", "firing") == 1);
    for refused in [
        &["resolve", "--benchmark", "5", "--by", "Ada"][..],
        &["resolve", "--by", "Ada", "--why", "the wire was cut"],
    ] {
        assert_eq!(alerts(refused).status.code(), Some(2), "{refused:?}");
    }
    let resolve = [
        "resolve",
        "--benchmark",
        "5",
        "--by",
        "Ada",
        "--why",
        "wire cut",
    ];
    let state = |benchmark: &str| {
        let status = site.printed(&["status", "--format", "json", "--config", "site.toml"]);
        let status: serde_json::Value = serde_json::from_str(&status).unwrap();
        let all = status["benchmarks"].as_array().unwrap().clone();
        let one = all.into_iter().find(|one| one["benchmark"] == benchmark);
        let one = one.unwrap();
        (one["level"].clone(), one["alarm_state"].clone())
    };
    assert_eq!(state("5"), ("red".into(), "unacknowledged".into()));
    let taken = alerts(&resolve);
    assert!(taken.status.success(), "{}", said(&taken));
    assert!(said(&taken).contains("calls the level again"));
    eventually("its end notified", || {
        site.notified("5/red/", "resolved") == 1
    });
    assert_eq!(state("5"), ("green".into(), "normal".into()));
    assert_eq!(
        alerts(&resolve).status.code(),
        Some(1),
        "nothing is in force"
    );
    site.append("incoming/5.csv", &failing(113..114));
    eventually("called again", || site.notified("5/red/", "firing") == 2);
    let keys: std::collections::BTreeSet<String> = site.lines("notified").into_iter().collect();
    assert_eq!(
        keys.iter()
            .filter(|line| line.ends_with("firing") && line.starts_with("5/red"))
            .count(),
        2
    );
    assert!(alerts(&["ack", "--by", "Ada"]).status.success());
    eventually("acknowledged", || {
        state("5") == ("red".into(), "acknowledged".into())
    });
    program.stop();
    let late = alerts(&["ack", "--by", "Ada"]);
    assert!(said(&late).contains("NO DAEMON RUNS"), "{}", said(&late));
    site.proven_events();
}

/// Rows of a slope that goes on at the velocity of row 60, and does not run away.
fn steady(rows: Range<i32>) -> String {
    let now = *NOW.get_or_init(clock::now);
    rows.map(|row| {
        let time = now - SignedDuration::from_hours(i64::from(113 - row));
        let moved = 200.0 * 2.0_f64.ln() + 200.0 / 60.0 * f64::from(row - 60);
        format!("{time},{moved:.4}\n")
    })
    .collect()
}

#[test]
fn readings_that_are_corrected_after_a_red_send_a_correction_that_names_it_to_whom_asks_for_these()
{
    let cap = "[[hook]]\nrun = [\"/bin/sh\", \"corrected.sh\"]\nlevels = [\"red\"]\ncorrections = true\n\
               [[cap]]\nfolder = \"cap\"\nsender = \"toc@example.org\"\narea = \"Toc\"\ncorrections = true\n";
    let site = Site::new(&format!("{POLICY}{cap}"));
    fs::write(site.path("corrected.sh"), "cat >> corrected\n").unwrap();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..112)),
    );
    let program = site.caught_up();
    site.awaits_red();
    site.append("incoming/5.csv", &steady(61..113));
    eventually("the correction", || {
        site.lines("corrected")
            .iter()
            .any(|line| line.contains("\"event\":\"correction\""))
    });
    let messages = || {
        let files = fs::read_dir(site.path("cap")).unwrap().map(Result::unwrap);
        let mut files: Vec<_> = files.map(|file| file.path()).collect();
        files.retain(|file| file.extension().is_some_and(|one| one == "xml"));
        let texts = files.iter().map(|file| fs::read_to_string(file).unwrap());
        texts.collect::<Vec<_>>()
    };
    let is_update =
        |text: &String| text.contains("is in force; what was called before is corrected");
    eventually("its CAP message", || messages().iter().any(is_update));
    program.stop();
    let red = site.lines("notified");
    let red = red.iter().find_map(|line| {
        line.strip_suffix(" firing")
            .filter(|key| key.starts_with("5/red/"))
    });
    let red = red.unwrap();
    let lines = site.lines("corrected");
    let corrections = lines
        .iter()
        .filter(|line| line.contains("\"event\":\"correction\""));
    let [correction] = corrections.collect::<Vec<_>>()[..] else {
        panic!("{lines:?}");
    };
    for part in [
        "\"level_then\":\"red\"",
        "\"state\":\"correction\"",
        "\"key\":\"5/correction/",
        "\"recommended\":null",
        red,
    ] {
        assert!(correction.contains(part), "{part}: {correction}");
    }
    let messages = messages();
    let update = messages.iter().find(|text| is_update(text)).unwrap();
    for part in [
        "<msgType>Update</msgType>",
        "<references>toc@example.org,slipwatch-",
        "<severity>Extreme</severity>",
        red,
    ] {
        assert!(update.contains(part), "{part}: {update}");
    }
    assert_eq!(
        site.notified("5/correction/", ""),
        0,
        "it was not asked for"
    );
    // What stands stays: the newest reading decides that.
    assert_eq!(site.notified("5/red/", "resolved"), 0);
    site.proven_events();
}
