//! The record of one alert: shown in words, as JSON and over HTTP, and a bundle that reproduces the decision by itself.

use crate::notified::failing;
use crate::site::{PROGRAM, Site, eventually, get};
use serde_json::Value;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output};

const POLICY: &str =
    "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n[alert]\nevacuation_time = \"3h\"\n";

/// A site whose benchmark 5 has been red, notified, seen by Ada, and is red no more than that.
fn red() -> (Site, crate::site::Program, String) {
    let site = Site::new(POLICY);
    let address = site.listen();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..114)),
    );
    let program = site.caught_up();
    site.awaits_red();
    (site, program, address)
}

fn show(site: &Site, more: &[&str]) -> String {
    let words = ["alerts", "show", "5/red", "--config", "site.toml"];
    site.printed(&[&words[..], more].concat())
}

#[test]
fn an_alert_says_what_called_it_who_has_it_and_who_has_seen_it_why_and_by_which_way() {
    let (site, program, address) = red();
    site.printed(&[
        "alerts",
        "ack",
        "--benchmark",
        "5",
        "--by",
        "Ada",
        "--why",
        "the road is closed",
        "--config",
        "site.toml",
    ]);
    let json = || -> Value { serde_json::from_str(&show(&site, &["--format", "json"])).unwrap() };
    eventually("that it is seen", || json()["is_acknowledged"] == true);
    let alert = json();
    assert_eq!(
        (&alert["level"], &alert["state"]),
        (&"red".into(), &"firing".into())
    );
    let key = alert["key"].as_str().unwrap();
    assert!(key.starts_with("5/red/"), "{key}");
    let notified = site.lines("notified");
    assert!(notified.contains(&format!("{key} firing")), "{notified:?}");
    assert_eq!(alert["deliveries"][0]["hook"], "/bin/sh hook.sh");
    assert_eq!(alert["deliveries"][0]["status"], "delivered");
    assert_eq!(alert["deliveries"][0]["attempts"], 1);
    let evidence = &alert["evidence"];
    assert_eq!(
        (&evidence["event"], &evidence["time"]),
        (&"refit".into(), &alert["since"])
    );
    assert!(evidence["chance_within_evacuation_time"].as_f64().unwrap() >= 0.05);
    let audit = alert["audit"].as_array().unwrap();
    let seen = audit
        .iter()
        .find(|one| one["order"] == "acknowledge")
        .unwrap();
    assert_eq!(
        (&seen["by"], &seen["why"]),
        (&"Ada".into(), &"the road is closed".into())
    );
    assert_eq!(seen["door"], "command-line");
    assert!(seen["given_at"].is_string());

    let text = show(&site, &[]);
    for words in [
        "level        red",
        "chance of collapse of 0.27 or more within twice the evacuation time (6 h)",
        "chance of collapse by which red is called ",
        "Evacuate the area",
        "velocity ",
        " mm/day",
        "red firing: /bin/sh hook.sh has taken it (delivered, 1 attempt)",
        "acknowledged yes",
        "acknowledge by Ada: the road is closed, over the command line, given at ",
    ] {
        assert!(text.contains(words), "{words:?} is not in\n{text}");
    }

    let answer = get(&address, "/api/alert?key=5/red");
    let (_, body) = answer.split_once("\r\n\r\n").unwrap();
    let over_http: Value = serde_json::from_str(body.trim()).unwrap();
    assert_eq!(over_http["key"], alert["key"]);
    assert!(get(&address, "/api/alert?key=6/red").starts_with("HTTP/1.1 404"));
    let none = site.ask(&["alerts", "show", "6/red", "--config", "site.toml"]);
    assert_eq!(none.status.code(), Some(2), "{none:?}");
    program.stop();
    site.proven_events();
}

#[test]
fn an_alert_that_another_level_superseded_stands_as_its_place_does() {
    let site = Site::new(POLICY);
    let rows = |hours| format!("time,displacement_mm\n{}", failing(hours));
    site.append("incoming/5.csv", &rows(0..60));
    let program = site.caught_up();
    eventually("orange", || site.notified("5/orange/", "firing") == 1);
    site.append("incoming/5.csv", &failing(60..114));
    site.awaits_red();
    let of = |key: &str| -> Value {
        let words = [
            "alerts",
            "show",
            key,
            "--config",
            "site.toml",
            "--format",
            "json",
        ];
        serde_json::from_str(&site.printed(&words)).unwrap()
    };
    eventually("that it is superseded", || {
        of("5/orange")["state"] == "superseded"
    });
    for key in ["5/orange", "5/red"] {
        assert_eq!(of(key)["alarm_state"], "unacknowledged", "{key}");
    }
    site.acknowledge("5", "Ada");
    eventually("that it is seen", || of("5/red")["is_acknowledged"] == true);
    assert_eq!(of("5/orange")["alarm_state"], of("5/red")["alarm_state"]);
    program.stop();
}

/// Runs the command of the manifest in the folder of an unpacked bundle.
fn reproduce(folder: &Path) -> Output {
    let manifest: Value =
        serde_json::from_slice(&fs::read(folder.join("manifest.json")).unwrap()).unwrap();
    let programs = Path::new(PROGRAM).parent().unwrap().display().to_string();
    let path = format!("{programs}:{}", std::env::var("PATH").unwrap());
    Command::new("/bin/sh")
        .args(["-c", manifest["command"].as_str().unwrap()])
        .current_dir(folder)
        .env("PATH", path)
        .output()
        .unwrap()
}

#[test]
fn the_bundle_of_an_alert_reproduces_its_decision_by_itself_and_not_without_its_last_reading() {
    let (site, program, _) = red();
    show(&site, &["--bundle", "5.zip"]);
    // What comes afterwards is not in it.
    program.stop();
    let events = site.proven_events();
    let apart = tempfile::tempdir().unwrap();
    let packed = File::open(site.path("5.zip")).unwrap();
    zip::ZipArchive::new(packed)
        .unwrap()
        .extract(apart.path())
        .unwrap();
    drop(site);
    let done = reproduce(apart.path());
    assert!(done.status.success(), "{done:?}");
    let said = String::from_utf8(done.stdout).unwrap();
    let called = |line: &&str| line.contains("\"key\":\"5/red/") && line.contains("\"firing\"");
    assert_eq!(said.trim_end(), events.lines().find(called).unwrap());

    let read = |name: &str| fs::read_to_string(apart.path().join(name)).unwrap();
    let readings = read("readings.csv");
    let last = readings.lines().last().unwrap();
    assert!(last.ends_with("incoming/5.csv,115"), "{last}");
    assert!(read("plot.svg").starts_with("<svg"));
    assert!(read("config.toml").contains("evacuation_time = \"3h\""));
    assert!(read("rule.json").contains("red_chance"));

    let state = rusqlite::Connection::open(apart.path().join("state/slipwatch.db")).unwrap();
    let without =
        "DELETE FROM step WHERE seq = (SELECT max(seq) FROM step WHERE series IS NOT NULL)";
    assert_eq!(state.execute(without, []).unwrap(), 1);
    drop(state);
    let done = reproduce(apart.path());
    assert_eq!(
        (done.status.code(), done.stdout.len()),
        (Some(1), 0),
        "{done:?}"
    );
}
