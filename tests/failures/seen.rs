//! What an order of people is of: what was in force when it was given and taken, whatever the times of the readings are.

use crate::site::{Site, eventually};
use jiff::SignedDuration;
use serde_json::Value;
use slipwatch::runtime::clock;

const THRESHOLDS: &str = "[alert]\nevacuation_time = \"12h\"\n\
    [[alert.threshold]]\nlevel = \"orange\"\ndisplacement = \"50 mm\"\n\
    [[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"100 mm\"\n";

/// A site with thresholds, and readings of a few millimetres up to two hours ago.
fn site(names: &[&str]) -> Site {
    let site = Site::new(THRESHOLDS);
    for name in names {
        site.append(&file(name), &format!("time,{name}_displacement_mm\n"));
        for minutes in [125, 124, 123, 122, 121] {
            read(&site, name, minutes, 1.0);
        }
    }
    site
}

fn file(name: &str) -> String {
    format!("incoming/{name}.csv")
}

/// A reading of so many minutes ago.
fn read(site: &Site, name: &str, minutes: i64, mm: f64) {
    let time = clock::now() - SignedDuration::from_mins(minutes);
    site.append(&file(name), &format!("{time},{mm}\n"));
}

fn shown(site: &Site, alert: &str) -> Value {
    let words = [
        "alerts",
        "show",
        alert,
        "--config",
        "site.toml",
        "--format",
        "json",
    ];
    serde_json::from_str(&site.printed(&words)).unwrap()
}

fn alarm_state(site: &Site, benchmark: &str) -> Value {
    let words = ["status", "--config", "site.toml", "--format", "json"];
    let status: Value = serde_json::from_str(&site.printed(&words)).unwrap();
    let all = status["benchmarks"].as_array().unwrap();
    let one = all
        .iter()
        .find(|one| one["benchmark"] == benchmark)
        .unwrap();
    one["alarm_state"].clone()
}

fn calls(site: &Site, alert: &str) {
    eventually(alert, || site.notified(alert, "firing") > 0);
}

#[test]
fn a_red_of_readings_that_came_late_is_not_acknowledged_by_an_order_taken_before_it() {
    let site = site(&["A", "B"]);
    let address = site.listen();
    let program = site.caught_up();
    read(&site, "A", 10, 70.0);
    read(&site, "B", 0, 1.0);
    calls(&site, "A/orange/");
    site.printed(&["alerts", "ack", "--by", "Ada", "--config", "site.toml"]);
    eventually("that it is taken", || {
        shown(&site, "A/orange")["is_acknowledged"] == true
    });
    assert_eq!(alarm_state(&site, "A"), "acknowledged");
    read(&site, "A", 5, 170.0);
    calls(&site, "A/red/");
    eventually("its red", || alarm_state(&site, "A") != "acknowledged");
    assert_eq!(alarm_state(&site, "A"), "unacknowledged");
    let red = shown(&site, "A/red");
    assert_eq!(red["is_acknowledged"], false, "{red}");
    assert_eq!(red["alarm_state"], "unacknowledged", "{red}");
    let audit = red["audit"].as_array().unwrap();
    assert!(audit.iter().all(|event| event["event"] != "order"), "{red}");
    let page = crate::site::get(&address, "/api/site");
    assert!(page.contains("\"acknowledged_by\":{}"), "{page}");
    let listed = site.printed(&["alerts", "list", "--config", "site.toml"]);
    assert!(!listed.contains("Ada"), "{listed}");
    let orange = shown(&site, "A/orange");
    assert_eq!(orange["is_acknowledged"], true, "{orange}");
    // Somebody sees the red too.
    site.acknowledge("A", "Bert");
    eventually("that it is seen", || {
        alarm_state(&site, "A") == "acknowledged"
    });
    assert_eq!(shown(&site, "A/red")["is_acknowledged"], true);
    program.stop();
    site.proven_events();
}

#[test]
fn a_red_that_is_called_between_an_order_and_its_taking_is_not_what_that_is_of() {
    let site = site(&["A", "B"]);
    let program = site.caught_up();
    for name in ["A", "B"] {
        read(&site, name, 2, 70.0);
        calls(&site, &format!("{name}/orange/"));
    }
    let order = |words: &[&str]| {
        let config = ["--by", "Ada", "--config", "site.toml"];
        site.printed(&[&["alerts"], words, &config].concat());
    };
    std::fs::rename(site.path("hook.sh"), site.path("kept.sh")).unwrap();
    // Readings are taken as they come, orders within a second.
    order(&["ack", "--benchmark", "A"]);
    order(&["shelve", "--benchmark", "B", "--for", "20d"]);
    read(&site, "A", 1, 170.0);
    read(&site, "B", 1, 170.0);
    eventually("that they are taken", || {
        site.events().matches("\"event\":\"order\"").count() == 2
    });
    eventually("the reds", || {
        ["A", "B"].iter().all(|name| {
            let events = site.events();
            events.contains(&format!("\"key\":\"{name}/red/"))
        })
    });
    program.stop();
    std::fs::rename(site.path("kept.sh"), site.path("hook.sh")).unwrap();
    let program = site.caught_up();
    calls(&site, "A/red/");
    calls(&site, "B/red/");
    assert_eq!(alarm_state(&site, "A"), "unacknowledged");
    assert_eq!(alarm_state(&site, "B"), "unacknowledged");
    assert_eq!(shown(&site, "A/red")["is_acknowledged"], false);
    program.stop();
    site.proven_events();
}

#[test]
fn what_is_only_unknown_is_not_shelved_and_the_order_names_silence() {
    let site = site(&["A"]);
    let program = site.caught_up();
    calls(&site, "A/unknown/");
    let order = ["alerts", "shelve", "--benchmark", "A", "--for", "1h"];
    let output = site.ask(&[&order[..], &["--by", "Ada", "--config", "site.toml"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success());
    assert!(
        said.contains("only unknown is in force at benchmark A")
            && said.contains("alerts silence --benchmark A"),
        "{said}"
    );
    assert!(!site.events().contains("\"event\":\"order\""));
    program.stop();
}
