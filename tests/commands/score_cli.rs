//! `score` from the outside: what a script reads, and what it answers to a wrong call.

use assert_cmd::Command;
use serde_json::Value;

const VAIONT: &str = "recordings/vaiont-1963-reconstruction.mcap";
const FAILURE: &str = "1963-10-09T22:39:00+01:00";

fn score(arguments: &[&str]) -> assert_cmd::assert::Assert {
    Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("score")
        .args(arguments)
        .assert()
}

fn json(arguments: &[&str]) -> Value {
    let done = score(&[arguments, &["--format", "json"]].concat()).success();
    serde_json::from_slice(&done.get_output().stdout).unwrap()
}

#[test]
fn a_scorecard_says_for_each_lead_and_method_how_far_it_was_off_and_what_it_knew() {
    let what = [VAIONT, "--benchmark", "5", "--failure-time", FAILURE];
    let card = json(&[&what[..], &["--evacuation-time", "72h"]].concat());
    let failure: jiff::Timestamp = FAILURE.parse().unwrap();
    let methods = card["methods"].as_array().unwrap();
    assert!(methods.contains(&Value::from("panel")), "{methods:?}");
    let leads = card["leads"].as_array().unwrap();
    assert!(leads.len() >= 5);
    for lead in leads {
        let known: jiff::Timestamp = lead["known_until"].as_str().unwrap().parse().unwrap();
        let days = (failure.as_second() - known.as_second()) as f64 / 86_400.0;
        assert!(days >= lead["lead_days"].as_f64().unwrap() - 1e-6, "{lead}");
        // One that expects no collapse is the furthest off.
        let furthest = lead["scores"]["persistence"]["crps_days"].as_f64().unwrap();
        for method in methods {
            let score = &lead["scores"][method.as_str().unwrap()];
            let crps = score["crps_days"].as_f64().unwrap();
            assert!((0.0..=furthest).contains(&crps), "{score} {furthest}");
            assert!((0.0..=1.0 + 1e-9).contains(&score["probability"].as_f64().unwrap()));
        }
    }
    let ten = leads.iter().find(|lead| lead["lead_days"] == 10.0).unwrap();
    let panel = &ten["scores"]["panel"];
    assert!(panel["error_days"].as_f64().unwrap().abs() < 3.0, "{panel}");
    assert!(panel["crps_days"].as_f64().unwrap() < 3.0, "{panel}");
    assert_eq!(panel["covered"], true);
    assert!(card["warning"]["hours_at"]["red"].as_f64().unwrap() > 0.0);
    assert!(card["warning"]["first_red"].is_string());
}

#[test]
fn a_slope_that_stood_is_scored_at_looks_and_was_never_red() {
    let recording = "recordings/century-mine-2013.mcap";
    let card = json(&[recording, "--benchmark", "40-1938", "--no-failure"]);
    assert!(card["leads"].as_array().unwrap().is_empty());
    assert!(card["looks"].as_array().unwrap().len() > 20);
    assert!(card["warning"]["first_red"].is_null());
}

#[test]
fn a_covariate_is_what_it_is_stated_to_be() {
    let what = [
        "recordings/century-mine-2013.mcap",
        "--benchmark",
        "31-1930",
        "--no-failure",
    ];
    let methods = |more: &[&str]| {
        let card = json(&[&what[..], more].concat());
        card["methods"].to_string()
    };
    assert!(!methods(&[]).contains("river-"));
    assert!(methods(&["--covariate", "rain_mm=flow"]).contains("river-"));
    let refused = |stated: &str, code: i32| {
        let done = score(&[&what[..], &["--covariate", stated]].concat()).code(code);
        String::from_utf8(done.get_output().stderr.clone()).unwrap()
    };
    let said = refused("rain_mm=snow", 2);
    assert!(said.contains("write one of rain, flow, level"), "{said}");
    let said = refused("flow", 2);
    assert!(said.contains("write NAME=KIND"), "{said}");
    let said = refused("Nied_1h=rain", 65);
    assert!(
        said.contains("no file has a covariate \"Nied_1h\": expected one of [\"rain_mm\"]"),
        "{said}"
    );
}

#[test]
fn a_plot_is_one_svg_and_a_call_without_the_truth_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("life.svg");
    let plot = ["--plot", file.to_str().unwrap()];
    let call = [VAIONT, "--benchmark", "5", "--failure-time", FAILURE];
    score(&[&call[..], &plot[..]].concat()).success();
    let svg = std::fs::read_to_string(file).unwrap();
    assert!(
        svg.starts_with("<svg") && svg.contains("what came"),
        "{svg}"
    );
    score(&[VAIONT]).code(2);
    let early = "1960-01-01T00:00:00Z";
    let refused = score(&[VAIONT, "--benchmark", "5", "--failure-time", early]).failure();
    let reported = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
    assert!(
        reported.contains("expected readings before --failure-time"),
        "{reported}"
    );
}
