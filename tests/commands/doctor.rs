//! `doctor` and the sampling that `check` looks at, on real folders, files and hooks.

use assert_cmd::Command;
use slipwatch::reading::Recording;
use slipwatch::runtime::ingest::encode_mcap;
use slipwatch::runtime::tail::records::{MAGIC, OPEN_CHUNK};
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
const LIMIT: Duration = Duration::from_secs(60);

/// A site with a hook `hook.sh` that has this text.
fn site(hook: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in ["incoming", "recordings", "state"] {
        fs::create_dir(at.join(name)).unwrap();
    }
    fs::write(at.join("hook.sh"), hook).unwrap();
    fs::set_permissions(at.join("hook.sh"), Permissions::from_mode(0o755)).unwrap();
    let text = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
                [[source]]\nid = \"recorder\"\nkind = \"mcap\"\npath = \"recordings/*.mcap\"\n\
                [alert]\nevacuation_time = \"12h\"\n\
                [[hook]]\nrun = [\"./hook.sh\"]\n";
    fs::write(at.join("site.toml"), text).unwrap();
    folder
}

/// What `command` says on stdout with JSON, and its exit code.
fn json(command: &str, folder: &Path) -> (serde_json::Value, i32) {
    let file = folder.join("site.toml");
    let ended = Command::new(PROGRAM)
        .args([command, file.to_str().unwrap(), "--format", "json"])
        .timeout(LIMIT)
        .assert();
    let output = ended.get_output();
    let report = serde_json::from_slice(&output.stdout).unwrap();
    (report, output.status.code().unwrap())
}

/// The verdicts and texts of one check, and whether the exit code is that of all of them.
fn findings(check: &str, folder: &Path) -> Vec<(String, String)> {
    let (report, code) = json("doctor", folder);
    let all = report["findings"].as_array().unwrap();
    let is_wrong = all.iter().any(|finding| finding["verdict"] == "wrong");
    assert_eq!(code, i32::from(is_wrong), "{report}");
    let word = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    all.iter()
        .filter(|finding| finding["check"] == check)
        .map(|finding| (word(&finding["verdict"]), word(&finding["text"])))
        .collect()
}

fn finding(check: &str, folder: &Path) -> (String, String) {
    let mut found = findings(check, folder);
    assert_eq!(found.len(), 1, "{found:?}");
    found.remove(0)
}

#[test]
fn a_machine_that_can_carry_the_site_is_good_in_what_can_be_seen() {
    let folder = site("#!/bin/sh\ntouch ran\n");
    let at = folder.path();
    for check in ["inotify", "hook", "recording", "fsync"] {
        let (verdict, text) = finding(check, at);
        assert_eq!(verdict, "good", "{check}: {text}");
    }
    assert_eq!(findings("file-system", at).len(), 3);
    let (_, sync) = finding("fsync", at);
    assert!(sync.contains("median of 20"), "{sync}");
    assert!(!at.join("ran").exists(), "the hook was run");
    let left = fs::read_dir(at.join("state")).unwrap().count();
    assert_eq!(left, 0, "something was left behind");
}

#[test]
fn a_broker_is_tried_and_so_are_the_authorities_that_it_has_to_prove_itself_by() {
    let folder = site("#!/bin/sh\n");
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let file = folder.path().join("site.toml");
    let before = fs::read_to_string(&file).unwrap();
    let said = |scheme: &str, more: &str| {
        let broker = format!(
            "[[source]]\nid = \"radio\"\nkind = \"mqtt\"\nurl = \"{scheme}://127.0.0.1:{port}\"\n\
             topic = \"site/#\"\n{more}"
        );
        fs::write(&file, format!("{before}{broker}")).unwrap();
        let mut found = findings("source", folder.path());
        found.retain(|(_, text)| text.starts_with("\"radio\""));
        found.remove(0)
    };
    // It accepts connections and says nothing; a real broker is asked in tests/daemon/mqtt.rs.
    let (verdict, text) = said("mqtt", "");
    assert_eq!(verdict, "wrong");
    assert!(text.contains("did not answer"), "{text}");
    let (verdict, text) = said("mqtts", "ca_file = \"authority.pem\"\n");
    assert_eq!(verdict, "wrong");
    assert!(text.contains("authority.pem"), "{text}");
    drop(listener);
    let (verdict, text) = said("mqtt", "");
    assert!(
        verdict == "wrong" && text.contains("cannot be reached"),
        "{text}"
    );
}

#[test]
fn a_hook_that_cannot_run_is_wrong_before_it_is_needed() {
    let wrong = |folder: &TempDir, why: &str| {
        let (verdict, text) = finding("hook", folder.path());
        assert_eq!(verdict, "wrong", "{text}");
        assert!(text.contains(why), "{text}");
    };
    wrong(&site("#!/no/such/shell\n"), "/no/such/shell");
    wrong(
        &site("#!/usr/bin/env no-such-language\n"),
        "no-such-language",
    );
    let folder = site("#!/bin/sh\n");
    let script = folder.path().join("hook.sh");
    fs::set_permissions(&script, Permissions::from_mode(0o644)).unwrap();
    wrong(&folder, "cannot be executed");
    fs::remove_file(&script).unwrap();
    wrong(&folder, "there is no");
}

#[test]
#[cfg_attr(not(has_dev_shm), ignore = "there is no /dev/shm")]
fn a_state_folder_in_memory_and_one_that_takes_no_writes_are_not_good() {
    let folder = site("#!/bin/sh\n");
    let at = folder.path();
    let text = fs::read_to_string(at.join("site.toml")).unwrap();
    let text = text.replace("\"state\"", "\"/dev/shm/slipwatch-not-there\"");
    fs::write(at.join("site.toml"), text).unwrap();
    let (verdict, text) = findings("file-system", at).remove(0);
    assert_eq!(verdict, "doubtful", "{text}");
    assert!(text.contains("tmpfs"), "{text}");
    assert_eq!(finding("fsync", at).0, "unknown");
    let text = fs::read_to_string(at.join("site.toml")).unwrap();
    let text = text.replace("\"/dev/shm/slipwatch-not-there\"", "\"/proc\"");
    let text = text.replace("\"state\"", "\"/proc\"");
    fs::write(at.join("site.toml"), text).unwrap();
    assert_eq!(finding("fsync", at).0, "wrong");
}

#[test]
fn a_record_that_has_no_room_is_doubtful_and_one_that_cannot_be_written_is_wrong() {
    let folder = site("#!/bin/sh\n");
    let at = folder.path();
    let plain = fs::read_to_string(at.join("site.toml")).unwrap();
    assert!(findings("record", at).is_empty(), "there is none");
    let with = |path: &str, total: &str| {
        let keys = format!("[site]\nrecord = \"{path}\"\nrecord_total = \"{total}\"");
        let text = plain.replace("[site]", &keys);
        fs::write(at.join("site.toml"), text).unwrap();
        finding("record", at)
    };
    let (verdict, text) = with("record/site.mcap", "200 MB");
    assert_eq!(verdict, "good", "{text}");
    assert!(text.contains("up to 200 MB are recorded"), "{text}");
    let (verdict, text) = with("record/site.mcap", "900000 GB");
    assert_eq!(verdict, "doubtful", "{text}");
    assert!(text.contains("lower record_total"), "{text}");
    assert_eq!(with("/proc/site.mcap", "200 MB").0, "wrong");
}

#[test]
fn a_recording_that_keeps_readings_back_in_an_open_chunk_is_reported_with_its_bytes() {
    let folder = site("#!/bin/sh\n");
    let at = folder.path().join("recordings");
    let whole = fs::File::create(at.join("whole.mcap")).unwrap();
    encode_mcap(&Recording::default(), whole).unwrap();
    assert_eq!(finding("recording", folder.path()).0, "good");
    let mut open = MAGIC.to_vec();
    open.extend(OPEN_CHUNK);
    open.extend([0; 1234]);
    fs::write(at.join("open.mcap"), &open).unwrap();
    let (verdict, text) = finding("recording", folder.path());
    assert_eq!(verdict, "doubtful");
    assert!(text.contains("open.mcap: 1234 bytes"), "{text}");
}

#[test]
fn check_warns_where_readings_come_too_rarely_for_the_evacuation_and_not_where_they_do_not() {
    let folder = site("#!/bin/sh\n");
    let series = |step_hours: i64| {
        let end: jiff::Timestamp = "2017-07-10T00:00:00Z".parse().unwrap();
        let rows = (0..40).map(|number| {
            let time = end - jiff::SignedDuration::from_hours(step_hours * (39 - number));
            format!("{time},{number}\n")
        });
        format!("time,displacement_mm\n{}", rows.collect::<String>())
    };
    let incoming = folder.path().join("incoming");
    fs::write(incoming.join("daily.csv"), series(24)).unwrap();
    fs::write(incoming.join("hourly.csv"), series(1)).unwrap();
    fs::write(
        incoming.join("single.csv"),
        "time,displacement_mm\n2017-06-01T00:00:00Z,1\n",
    )
    .unwrap();
    let (summary, code) = json("check", folder.path());
    assert_eq!(code, 0);
    let warnings = summary["warnings"].as_array().unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let warning = warnings[0].as_str().unwrap();
    assert!(
        warning.contains("\"daily\": measured every 24h"),
        "{warning}"
    );
}

#[test]
fn completions_and_the_manual_name_every_command_and_no_hidden_one() {
    for shell in ["bash", "zsh", "fish"] {
        let ended = Command::new(PROGRAM)
            .args(["completions", shell])
            .assert()
            .success();
        let text = String::from_utf8(ended.get_output().stdout.clone()).unwrap();
        for command in ["replay", "doctor", "explain", "plot"] {
            assert!(text.contains(command), "{shell}: {command}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man1");
    let arguments = ["man", pages.to_str().unwrap()];
    Command::new(PROGRAM).args(arguments).assert().success();
    for page in ["slipwatch.1", "slipwatch-run.1", "slipwatch-doctor.1"] {
        let text = fs::read_to_string(pages.join(page)).unwrap();
        assert!(text.contains(".SH NAME"), "{page}");
    }
    assert!(
        pages.join("slipwatch-hook-test.1").exists() || pages.join("slipwatch-hook.1").exists()
    );
    assert!(!pages.join("slipwatch-hook-exec.1").exists());
}
