//! `report` from outside: one page, complete in itself, that says what a replay and a scorecard say.

use assert_cmd::Command;
use std::path::Path;

const PREONZO: &str = "recordings/preonzo-2012.mcap";
const E3: [&str; 3] = [PREONZO, "--benchmark", "E3"];
const E2: [&str; 3] = [PREONZO, "--benchmark", "E2"];

fn slipwatch(arguments: &[&str]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .assert()
        .success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

fn report(folder: &Path, flags: &[&str]) -> String {
    report_of(&E3, folder, flags)
}

fn report_of(readings: &[&str], folder: &Path, flags: &[&str]) -> String {
    let to = ["-o", folder.to_str().unwrap()];
    let said = slipwatch(&[&["report"], readings, flags, &to].concat());
    let file = folder.join("report.html");
    assert_eq!(said.trim(), file.to_str().unwrap());
    std::fs::read_to_string(file).unwrap()
}

#[test]
fn what_is_unlikely_is_not_written_as_impossible() {
    let folder = tempfile::tempdir().unwrap();
    let page = report_of(&E2, folder.path(), &["--evacuation-time", "1h"]);
    assert!(page.contains("chance of collapse &lt; 1 % within") && !page.contains(" 0 % within"));
}

#[test]
fn a_crisis_is_one_page_with_its_figures_levels_search_scorecard_and_sources_and_asks_for_nothing_else()
 {
    let folder = tempfile::tempdir().unwrap();
    let page = report(folder.path(), &["--failure-time", "2012-05-15T01:30:00Z"]);
    for part in [
        "<h3>Levels</h3>",
        "<h3>In order</h3>",
        "<h3>Closing the loop</h3>",
        "<h3>Scorecard</h3>",
        "Provenance and versions",
        "CC BY 4.0",
        "regime",
        "inverse velocity",
        "@media print",
        env!("CARGO_PKG_VERSION"),
    ] {
        assert!(page.contains(part), "{part}");
    }
    let pictures = page.matches("<svg").count();
    assert!(pictures >= 4);
    assert_eq!(page.matches("role=\"img\" aria-label=\"").count(), pictures);
    assert!(page.contains(">E3: residual before the effects<"));
    // What is unlikely is not written as impossible, nor is an axis drawn around nothing.
    assert!(!page.contains("chance 0.00"));
    assert!(!page.contains("1970-01-01") && !page.contains(">01-01 00:00<"));
    // The levels are those of a replay.
    let replayed = slipwatch(&[&["replay"], &E3[..], &["--format", "json"]].concat());
    let events = replayed
        .lines()
        .map(|line| serde_json::from_str(line).unwrap());
    let alerts = events.filter(|event: &serde_json::Value| {
        event["event"] == "alert" && event["benchmark"] == "E3"
    });
    let mut count = 0;
    for alert in alerts {
        let minute = alert["time"].as_str().unwrap()[..16].replace('T', " ") + "Z";
        assert!(
            page.contains(&format!("<tr><td>{minute}</td><td>alert</td>")),
            "{alert}"
        );
        count += 1;
    }
    assert!(count >= 2);
    let outside = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for sign in [
        "http:", "https:", "src=", "@import", "<script", "<link", "NaN",
    ] {
        // An attribution may give an address as text.
        let count = outside.matches(sign).count();
        let in_text = outside.matches("CC BY 4.0; http").count();
        assert!(count <= in_text, "{sign}");
    }
    let mut names: Vec<&str> = page
        .split(" id=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    let all = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all, "a name is there twice");
}

#[test]
fn two_reports_of_the_same_files_are_the_same_bytes_and_without_an_outcome_there_is_no_scorecard() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [one, other] = folders
        .each_ref()
        .map(|folder| report(folder.path(), &["--no-search"]));
    assert_eq!(one, other);
    assert!(!one.contains("<h3>Scorecard</h3>") && !one.contains("<h3>Closing the loop</h3>"));
}
