//! A disk that is full, and one that fails.

use crate::site::{Site, command, eventually, get, has_own_mounts, tamper};
use slipwatch::monitor::Input;
use slipwatch::store::{StepRow, Store};
use std::fs;

fn rows(days: std::ops::Range<u32>) -> String {
    days.map(|day| format!("2020-01-{day:02}T00:00:00Z,{}\n", f64::from(day) * 0.5))
        .collect()
}

/// Hourly readings up to now that run away.
fn failing() -> String {
    let now = slipwatch::runtime::clock::now();
    (0..=113)
        .map(|row: i32| {
            let time = now - jiff::SignedDuration::from_hours(i64::from(113 - row));
            let left = f64::from(120 - row);
            format!("{time},{:.4}\n", 200.0 * (120.0 / left).ln())
        })
        .collect()
}

/// Commands that ask the state say that it cannot be written, and what is in force.
fn say_what_is_not_written(site: &Site) {
    for words in [
        &["alerts", "list"][..],
        &["alerts", "show", "5/red"],
        &["alerts", "ack", "--benchmark", "5", "--by", "Ada"],
        &[
            "alerts",
            "silence",
            "--benchmark",
            "5",
            "--for",
            "1h",
            "--by",
            "Ada",
        ],
    ] {
        let output = site.ask(&[words, &["--config", "site.toml"]].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            said.contains("the daemon cannot write the state")
                && said.contains("in force there: 5 red"),
            "{words:?}: {said}"
        );
    }
}

/// 14.
#[test]
#[cfg_attr(
    not(has_own_mounts),
    ignore = "a process may not have mounts of its own here"
)]
fn on_a_full_disk_alerts_go_out_and_what_was_taken_is_written_when_there_is_room() {
    if !has_own_mounts(
        "disk::on_a_full_disk_alerts_go_out_and_what_was_taken_is_written_when_there_is_room",
    ) {
        return;
    }
    let site = Site::new("[alert]\nevacuation_time = \"3h\"\n");
    let address = site.listen();
    site.append("incoming/5.csv", "time,displacement_mm\n");
    let state = site.path("state");
    fs::create_dir(&state).unwrap();
    let folder = state.to_str().unwrap();
    command(&["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", folder]);
    let mut program = site.caught_up();
    let filled = fs::write(state.join("ballast"), vec![0; 8 << 20]);
    assert!(filled.is_err(), "three megabytes hold eight");
    site.append("incoming/5.csv", &failing());
    eventually("no room", || site.log().contains("no room on the disk"));
    let reds = || site.notified("5/red/", "");
    eventually("notified", || reds() > 0);
    assert_eq!(site.values().len(), 0, "there was room");
    let status = || site.printed(&["status", "--config", "site.toml"]);
    let is_said = || {
        status()
            .replace("\n    ", " ")
            .contains("in force there: 5 red")
    };
    eventually("what the state does not hold", is_said);
    let shown = get(&address, "/api/site");
    assert!(
        shown.contains("\"is_not_written\":true") && shown.contains("\"level\":\"red\""),
        "{shown}"
    );
    say_what_is_not_written(&site);
    assert_eq!(program.ended(), None, "{}", site.log());
    fs::remove_file(state.join("ballast")).unwrap();
    eventually("written", || site.values().len() == 114);
    // The line of the log follows the commit.
    eventually("said", || {
        site.log().contains("there is room on the disk again")
    });
    eventually("no fault", || !status().contains("FAULT"));
    eventually("as written", || {
        !get(&address, "/api/site").contains("is_not_written")
    });
    let times: std::collections::BTreeSet<_> =
        (site.values().into_iter().map(|(_, time, _)| time)).collect();
    assert_eq!(times.len(), 114, "each once");
    program.stop();
    site.caught_up().stop();
    assert_eq!(reds(), 1, "notified again");
    site.proven_events();
}

/// 16. As the state is opened: at each of the syncs that this takes.
#[test]
#[cfg_attr(not(has_strace), ignore = "strace was not found by build.rs")]
fn a_sync_that_fails_at_the_start_ends_the_daemon_and_the_next_start_goes_well() {
    let site = Site::new("");
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", rows(1..9)),
    );
    let mut failed = 0;
    for when in 1..=4 {
        let injected = format!("error=EIO:when={when}+");
        let mut program = site.start_traced("fsync,fdatasync", &injected);
        let mut code = None;
        eventually("its end, or that it works", || {
            code = program.ended();
            code.is_some() || site.log().contains("caught up")
        });
        if let Some(code) = code {
            assert_eq!(code, Some(74), "{}", site.log());
            failed += 1;
        }
    }
    assert!(failed > 0, "it starts without a sync");
    site.caught_up().stop();
    assert_eq!(site.values().len(), 8);
    site.proven_events();
}

/// 16. From some commit on every sync fails, of the file at `path` alone where there is one.
fn fails_to_sync(path: Option<&str>) {
    let site = Site::new("");
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", rows(1..3)),
    );
    let mut program = site.caught_up();
    let mut words = vec!["-e", "trace=fsync,fdatasync"];
    words.extend(["-e", "inject=fsync,fdatasync:error=EIO"]);
    words.extend(path.iter().flat_map(|path| ["-P", path]));
    let tracer = tamper(&site, &program, &words);
    // More than the log holds before it is moved into the database.
    let rain = (0..9000).map(|row: i64| {
        let time = jiff::Timestamp::from_second(1_577_836_800 + 60 * row).unwrap();
        format!("{time},0\n")
    });
    let rain = format!("time,rain_mm\n{}", rain.collect::<String>());
    site.append("incoming/rain.csv", &rain);
    site.append("incoming/5.csv", &rows(3..5));
    let mut code = None;
    eventually("its end", || {
        code = program.ended();
        code.is_some()
    });
    drop(tracer);
    assert_eq!(code, Some(Some(74)), "{}", site.log());
    let log = site.log();
    assert!(log.contains("the disk failed to sync"), "{log}");
    site.caught_up().stop();
    let store = Store::look(&site.path("state")).unwrap();
    let is_rain = |step: &&StepRow| matches!(step.input, Input::Sample { .. });
    let (mut rain, mut after) = (0, 0);
    loop {
        let steps = store.steps(after).unwrap();
        let Some(last) = steps.last() else { break };
        after = last.seq;
        rain += steps.iter().filter(is_rain).count();
    }
    assert_eq!((site.values().len(), rain), (4, 9000));
    site.proven_events();
}

#[test]
#[cfg_attr(
    not(all(has_strace, may_attach)),
    ignore = "strace was not found by build.rs, or may not attach"
)]
fn a_commit_that_is_not_synced_ends_the_daemon_and_a_restart_loses_nothing() {
    fails_to_sync(None);
}

#[test]
#[cfg_attr(
    not(all(has_strace, may_attach)),
    ignore = "strace was not found by build.rs, or may not attach"
)]
fn a_database_that_is_not_synced_ends_the_daemon_and_a_restart_loses_nothing() {
    fails_to_sync(Some("state/slipwatch.db"));
}
