//! `explain` from outside: its flags, its keys, its exit codes, its page.

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use serde_json::Value;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_secs(60);

fn explain(args: &[&str]) -> Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipwatch"));
    command.arg("explain").args(args).timeout(LIMIT).assert()
}

fn out(assert: &Assert) -> String {
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

fn err(assert: &Assert) -> String {
    String::from_utf8(assert.get_output().stderr.clone()).unwrap()
}

fn json(assert: &Assert) -> Value {
    serde_json::from_str(&out(assert)).unwrap()
}

/// Days from 1 March 2020 as a CSV's time.
fn day(index: u32) -> String {
    let first: jiff::Timestamp = "2020-03-01T00:00:00Z".parse().unwrap();
    (first + jiff::SignedDuration::from_hours(24 * i64::from(index))).to_string()
}

/// A slope at 2 mm a day beside a rain gauge, 40 days of it.
fn slope() -> (TempDir, PathBuf) {
    let mut text = String::from("time,a_displacement_mm,rain_mm\n");
    for index in 0..40 {
        let wobble = f64::from(index * 7 % 5) - 2.0;
        let slip = 2.0 * f64::from(index) + 0.3 * wobble;
        writeln!(text, "{},{slip},{}", day(index), index % 3).unwrap();
    }
    file("slope.csv", &text)
}

fn file(name: &str, text: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn text_of(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn json_has_every_key_that_scripts_rely_on_and_no_number_that_is_none() {
    let (_folder, path) = slope();
    let done = explain(&[text_of(&path), "--format", "json"]).success();
    assert_eq!(out(&done).lines().count(), 1);
    let said = json(&done);
    for key in [
        "/benchmark",
        "/verdict/effect",
        "/verdict/channel",
        "/verdict/form",
        "/verdict/p_value",
        "/verdict/lag_days",
        "/verdict/memory_days",
        "/verdict/gain_per_sd",
        "/verdict/period_days",
        "/verdict/at",
        "/verdict/size",
        "/verdict/unit",
        "/explained",
        "/also",
        "/cannot_separate_from",
        "/faults",
        "/error/unit",
        "/error/fit/before",
        "/error/fit/after",
        "/error/held_out/before",
        "/error/held_out/after",
        "/candidates",
        "/flags",
        "/settings/seed",
        "/settings/version",
        "/settings/data_hash",
    ] {
        assert!(said.pointer(key).is_some(), "{key} is not in {said}");
    }
    assert_eq!(said["benchmark"], "a");
    assert_eq!(said["error"]["unit"], "mm");
    let candidates = said["candidates"].as_array().unwrap();
    for candidate in candidates {
        for key in [
            "effect",
            "channel",
            "bic_gain",
            "p_value",
            "held_out",
            "rejected_because",
        ] {
            assert!(candidate.get(key).is_some(), "{key} is not in {candidate}");
        }
    }
    assert!(!out(&done).contains("NaN") && !out(&done).contains("inf,"));
}

#[test]
fn the_seed_the_surrogates_and_the_span_are_those_that_were_asked_for() {
    let (_folder, path) = slope();
    let path = text_of(&path);
    let (from, until) = (day(5), day(34));
    let flags = [
        "--from",
        &from,
        "--until",
        &until,
        "--seed",
        "7",
        "--surrogates",
        "99",
    ];
    let args = [&[path, "--format", "json"] as &[&str], &flags].concat();
    let said = json(&explain(&args).success());
    assert_eq!(said["settings"]["seed"], 7);
    assert_eq!(said["settings"]["surrogates"], 99);
    assert_eq!(said["readings"], 30);
    assert_eq!(said["first"], from.as_str());
    assert_eq!(said["last"], until.as_str());
}

#[test]
fn text_begins_with_the_benchmark_and_never_claims_a_cause() {
    let (_folder, path) = slope();
    let said = out(&explain(&[text_of(&path)]).success());
    assert!(said.starts_with("a: "), "{said}");
    for part in [
        "benchmark a, displacement in mm, 40 readings",
        "\nError\n",
        "held out",
        "seed",
    ] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
    assert!(!said.contains("caused by"), "{said}");
}

#[test]
fn covariates_may_stand_in_a_file_of_their_own() {
    let (_folder, path) = slope();
    let text: String = (0..40).fold("time,lake_level_m\n".to_owned(), |mut text, index| {
        writeln!(text, "{},{}", day(index), index % 4).unwrap();
        text
    });
    let (_other, lake) = file("lake.csv", &text);
    explain(&[text_of(&path), "--channels", text_of(&lake)]).success();
    let missing = lake.with_file_name("none.csv");
    explain(&[text_of(&path), "--channels", text_of(&missing)]).code(74);
}

#[test]
fn exit_codes_are_those_of_every_command() {
    let (folder, path) = slope();
    let path = text_of(&path);
    for args in [
        &[] as &[&str],
        &[path, "--surrogates", "20"],
        &[path, "--seed", "-1"],
        &[path, "--until", "soon"],
        &[path, "--format", "html"],
    ] {
        explain(args).code(2);
    }
    explain(&[path, "--benchmark", "b"]).code(65);
    let (_bad, bad) = file(
        "bad.csv",
        "time,displacement_mm\n2020-01-01T00:00:00Z,abc\n",
    );
    explain(&[text_of(&bad)]).code(65);
    explain(&["no-such-file.csv"]).code(74);
    let nowhere = folder.path().join("no/such/folder/page.html");
    let done = explain(&[path, "--html", text_of(&nowhere)]).code(74);
    // What was found is reported all the same.
    assert!(out(&done).starts_with("a: "));
    assert!(err(&done).contains("page.html"), "{}", err(&done));
}

#[test]
fn a_span_without_readings_is_said_and_is_no_crash() {
    let (_folder, path) = slope();
    let done = explain(&[text_of(&path), "--until", "1999-01-01T00:00:00Z"]).code(65);
    let said = err(&done);
    assert!(
        said.contains("no reading until 1999-01-01T00:00:00Z"),
        "{said}"
    );
}

#[test]
fn the_page_is_well_formed_and_needs_no_other_file() {
    let (folder, path) = slope();
    let file = folder.path().join("page.html");
    explain(&[text_of(&path), "--html", text_of(&file)]).success();
    let page = fs::read_to_string(&file).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>"));
    assert_eq!(first_unbalanced(&page), None);
    let outside = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for sign in ["http", "src=", "href=", "@import", "<script", "<link"] {
        assert!(!outside.contains(sign), "{sign}");
    }
    assert!(!page.contains("NaN"));
}

#[test]
fn a_reconstruction_is_never_shown_as_measured() {
    let recordings = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let vaiont = recordings.join("vaiont-1963-reconstruction.mcap");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    // A span of a few days: the claim is of the words, not of the search.
    let args = [
        text_of(&vaiont),
        "--benchmark",
        "5",
        "--until",
        "1963-08-20T00:00:00Z",
        "--html",
        text_of(&file),
    ];
    let words = "reconstruction, not measured";
    assert!(out(&explain(&args).success()).contains(words));
    assert!(fs::read_to_string(&file).unwrap().contains(words));
    let json = [&args[..5], &["--format", "json"]].concat();
    assert!(out(&explain(&json).success()).contains(words));
    let (_folder, measured) = slope();
    assert!(!out(&explain(&[text_of(&measured)]).success()).contains("reconstruction"));
}

/// The first tag that closes what is not open, or is left open; in `style` there are none.
fn first_unbalanced(page: &str) -> Option<String> {
    let mut open: Vec<String> = Vec::new();
    for tag in page.split('<').skip(1) {
        let Some((tag, _)) = tag.split_once('>') else {
            return Some(tag.to_owned());
        };
        if tag.starts_with('!') || tag.ends_with('/') {
            continue;
        }
        let name = tag.split_whitespace().next().unwrap_or("");
        if let Some(closed) = name.strip_prefix('/') {
            if open.pop().as_deref() != Some(closed) {
                return Some(tag.to_owned());
            }
        } else {
            open.push(name.to_owned());
        }
    }
    open.pop()
}

#[test]
fn the_balance_of_tags_can_fail() {
    assert_eq!(first_unbalanced("<a><b/></a>"), None);
    assert_eq!(first_unbalanced("<a><b></a>"), Some("/a".to_owned()));
    assert_eq!(first_unbalanced("<a><b></b>"), Some("a".to_owned()));
}

#[test]
fn what_is_declared_is_judged_and_nothing_else_is_tried() {
    let (_folder, path) = slope();
    let declared = ["hydrological:rain_mm", "offset@2020-03-21T00:00:00Z"];
    let done = explain(&[
        text_of(&path),
        "--given",
        declared[0],
        "--given",
        declared[1],
        "--format",
        "json",
    ]);
    let said = json(&done.success());
    let given = said["given"].as_array().unwrap();
    assert_eq!(given.len(), 2);
    for (one, text) in given.iter().zip(declared) {
        assert_eq!(one["declared"], text);
        assert!(one["rejected_because"].is_string(), "{one}");
    }
    assert_eq!(given[1]["effect"]["effect"], "offset");
    let tried = said["candidates"].as_array().unwrap();
    assert_eq!(tried.len(), 2, "{tried:?}");
    let text = out(&explain(&[text_of(&path), "--given", declared[1]]).success());
    let first = text.lines().next().unwrap();
    assert!(
        first.contains("nothing of what was declared stands"),
        "{first}"
    );
    let why = "Declared, and does not stand: offset@2020-03-21T00:00:00Z";
    assert!(text.contains(why), "{text}");
    let none = explain(&[text_of(&path), "--format", "json"]).success();
    assert!(json(&none).get("given").is_none());
}

#[test]
fn what_cannot_be_declared_of_these_readings_is_a_usage_error_that_says_what_can() {
    let (_folder, path) = slope();
    for (declared, said) in [
        ("lake", "no kind of effect; expected one of hydrological"),
        ("hydrological", "write hydrological:CHANNEL"),
        ("hydrological:lake", "there are rain_mm"),
        (
            "offset@2031-01-01T00:00:00Z",
            "the readings are from 2020-03-01T00:00:00Z to",
        ),
        ("seasonal@2020-03-21T00:00:00Z", "has no time"),
    ] {
        let done = explain(&[text_of(&path), "--given", declared]).code(2);
        assert!(err(&done).contains(said), "{declared}: {}", err(&done));
    }
    let twice = explain(&[text_of(&path), "--given", "seasonal", "--given", "seasonal"]);
    assert!(err(&twice.code(2)).contains("stands twice"));
}
