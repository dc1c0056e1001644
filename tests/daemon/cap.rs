//! Messages of the Common Alerting Protocol 1.2, read back by an XML parser and, where OASIS's schema is there, validated.

use roxmltree::{Document, Node};
use slipwatch::alert::Level;
use slipwatch::config::{self, HookConfig};
use slipwatch::monitor::{AlertState, Event, EventKind};
use slipwatch::reading::BenchmarkId;
use slipwatch::runtime::deliver;
use slipwatch::runtime::hook::{Alert, HookOutcome, Status};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

const NAMESPACE: &str = "urn:oasis:names:tc:emergency:cap:1.2";
const TABLE: &str = "[[cap]]\nfolder = \"cap\"\nsender = \"slipwatch@example.org\"\n\
                     area = \"Toc & the <shore>\"\nlevels = [\"yellow\", \"orange\", \"red\", \"unknown\"]\n\
                     polygon = \"46.27,12.33 46.28,12.35 46.26,12.36 46.27,12.33\"\n";
/// The order in which the schema has them.
const OF_ALERT: [&str; 8] = [
    "identifier",
    "sender",
    "sent",
    "status",
    "msgType",
    "scope",
    "restriction",
    "references",
];
const OF_INFO: [&str; 12] = [
    "language",
    "category",
    "event",
    "responseType",
    "urgency",
    "severity",
    "certainty",
    "senderName",
    "headline",
    "description",
    "instruction",
    "parameter",
];

fn text(table: &str) -> String {
    format!(
        "[site]\nname = \"Monte \\\"Toc\\\" <&>\"\nstate_dir = \"state\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n{table}"
    )
}

fn folder() -> (TempDir, HookConfig) {
    let folder = tempfile::tempdir().unwrap();
    let config = config::parse(&text(TABLE), &folder.path().join("site.toml")).unwrap();
    (folder, config.hooks[0].clone())
}

fn alert(benchmark: &str, level: Level, (state, status): (AlertState, Status)) -> Alert {
    let event = Event {
        time: "2017-06-06T17:00:00Z".parse().unwrap(),
        benchmark: Some(BenchmarkId::new(benchmark)),
        kind: EventKind::Alert {
            level,
            state,
            key: format!("{benchmark}/{level}/2017-06-06T17:00:00Z"),
            rule: "chance-within-outlook".to_owned(),
            text: "velocity > 5 & rising \u{1}\u{7}\u{ffff} caf\u{e9}".to_owned(),
        },
    };
    Alert::new(&event, "Monte \"Toc\" <&>", None, status).unwrap()
}

/// Readings that came late would have called another level than `red` did.
fn corrected(red: &Alert) -> Alert {
    let event = Event {
        time: "2017-06-06T18:00:00Z".parse().unwrap(),
        benchmark: red.event.benchmark.clone(),
        kind: EventKind::Correction {
            since: red.event.time,
            level_then: Level::Red,
            level_now: Level::Orange,
            alerts: vec![red.key.clone()],
            text: "orange & not red".to_owned(),
        },
    };
    Alert::new(&event, "Monte \"Toc\" <&>", None, Status::Exercise).unwrap()
}

/// Writes it; returns the message as text, or none where no file came.
async fn written(folder: &Path, hook: &HookConfig, alert: &Alert) -> Option<String> {
    let files = || -> BTreeSet<_> {
        let listed = fs::read_dir(folder.join("cap")).into_iter().flatten();
        let files = listed.map(|entry| entry.unwrap().path());
        files
            .filter(|file| file.extension().is_some_and(|one| one == "xml"))
            .collect()
    };
    let before = files();
    assert_eq!(deliver::run(hook, alert, 1).await, HookOutcome::Done);
    let after = files();
    let fresh = after.difference(&before).next()?;
    Some(fs::read_to_string(fresh).unwrap())
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> &'a str {
    let is_it = |one: &Node<'_, '_>| one.has_tag_name((NAMESPACE, name));
    node.children()
        .find(is_it)
        .and_then(|one| one.text())
        .unwrap_or("")
}

/// The elements stand in the order of the schema.
fn ordered(node: Node<'_, '_>, order: &[&str]) {
    let elements = node.children().filter(Node::is_element);
    let names = elements.map(|one| one.tag_name().name().to_owned());
    let known = names.filter(|name| !["info", "area"].contains(&name.as_str()));
    let places = known.map(|name| order.iter().position(|one| *one == name).unwrap());
    assert!(places.is_sorted(), "{node:?}");
}

fn reference(message: &str) -> String {
    let document = Document::parse(message).unwrap();
    let root = document.root_element();
    format!(
        "{},{},{}",
        child(root, "sender"),
        child(root, "identifier"),
        child(root, "sent")
    )
}

/// Type and references of a message.
fn kind(message: &str) -> (String, String) {
    let document = Document::parse(message).unwrap();
    let root = document.root_element();
    (
        child(root, "msgType").to_owned(),
        child(root, "references").to_owned(),
    )
}

#[tokio::test]
async fn the_messages_of_a_place_make_a_chain_that_names_what_came_before() {
    let (folder, hook) = folder();
    let real = |level, state| alert("5", level, (state, Status::Actual));
    let (firing, resolved) = (AlertState::Firing, AlertState::Resolved);
    let at = folder.path();
    let orange = written(at, &hook, &real(Level::Orange, firing))
        .await
        .unwrap();
    assert_eq!(kind(&orange), ("Alert".to_owned(), String::new()));
    // Another attempt writes the same message again.
    assert_eq!(written(at, &hook, &real(Level::Orange, firing)).await, None);
    // Another place, a level beside, and a drill are chains of their own.
    let beside = [
        alert("6", Level::Orange, (firing, Status::Actual)),
        real(Level::Unknown, firing),
        alert("5", Level::Red, (firing, Status::Exercise)),
    ];
    for other in &beside {
        let message = written(at, &hook, other).await.unwrap();
        assert_eq!(kind(&message), ("Alert".to_owned(), String::new()));
    }
    let red = written(at, &hook, &real(Level::Red, firing)).await.unwrap();
    assert_eq!(kind(&red), ("Update".to_owned(), reference(&orange)));
    let end = written(at, &hook, &real(Level::Red, resolved))
        .await
        .unwrap();
    let both = format!("{} {}", reference(&orange), reference(&red));
    assert_eq!(kind(&end), ("Cancel".to_owned(), both));
    let yellow = written(at, &hook, &real(Level::Yellow, firing))
        .await
        .unwrap();
    assert_eq!(kind(&yellow), ("Alert".to_owned(), String::new()));
    // The end of what was never said is no message: a Cancel must name what it ends.
    let unnotified = alert("7", Level::Red, (resolved, Status::Actual));
    assert_eq!(written(at, &hook, &unnotified).await, None);
}

#[tokio::test]
async fn a_message_has_what_the_schema_asks_for_and_any_text_in_it() {
    let (folder, hook) = folder();
    for (status, word) in [
        (Status::Actual, "Actual"),
        (Status::Exercise, "Exercise"),
        (Status::Test, "Test"),
    ] {
        let alert = alert("<5>", Level::Red, (AlertState::Firing, status));
        let message = written(folder.path(), &hook, &alert).await.unwrap();
        let document = Document::parse(&message).unwrap();
        let root = document.root_element();
        assert!(root.has_tag_name((NAMESPACE, "alert")));
        assert_eq!(child(root, "status"), word);
        ordered(root, &OF_ALERT);
        let sent = child(root, "sent");
        assert!(sent.ends_with("-00:00") && sent.len() == 25, "{sent}");
        let info = root
            .children()
            .find(|one| one.has_tag_name((NAMESPACE, "info")))
            .unwrap();
        ordered(info, &OF_INFO);
        assert_eq!(child(info, "severity"), "Extreme");
        assert_eq!(child(info, "responseType"), "Evacuate");
        // A receiver that leaves out what is possible alone keeps it, as it keeps orange.
        assert_eq!(child(info, "certainty"), "Likely");
        let mark = match word {
            "Exercise" => "EXERCISE, do not act on this: ",
            "Test" => "TEST, do not act on this: ",
            _ => "",
        };
        let headline = format!("{mark}Monte \"Toc\" <&>, benchmark <5>: red");
        assert_eq!(child(info, "headline"), headline);
        let instruction = format!("{mark}Evacuate the area");
        assert!(child(info, "instruction").starts_with(&instruction));
        assert_eq!(
            child(info, "description"),
            "velocity > 5 & rising \u{fffd}\u{fffd}\u{fffd} caf\u{e9}"
        );
        let area = info
            .children()
            .find(|one| one.has_tag_name((NAMESPACE, "area")))
            .unwrap();
        assert_eq!(child(area, "areaDesc"), "Toc & the <shore>");
        assert!(child(area, "polygon").starts_with("46.27,12.33 "));
    }
}

#[tokio::test]
#[cfg_attr(
    not(has_cap_schema),
    ignore = "no xmllint, or SLIPWATCH_CAP_SCHEMA does not name OASIS's CAP-v1.2.xsd"
)]
async fn every_message_is_valid_by_the_schema_of_oasis() {
    let (folder, hook) = folder();
    let (firing, resolved) = (AlertState::Firing, AlertState::Resolved);
    let called = [
        (Level::Unknown, firing),
        (Level::Yellow, firing),
        (Level::Orange, firing),
        (Level::Red, firing),
    ];
    let called = called.map(|(level, state)| alert("<5>", level, (state, Status::Exercise)));
    let corrected = corrected(&called[3]);
    let end = alert("<5>", Level::Red, (resolved, Status::Exercise));
    for alert in called.iter().chain([&corrected, &end]) {
        let message = written(folder.path(), &hook, alert).await.unwrap();
        let file = folder.path().join("message.xml");
        fs::write(&file, message).unwrap();
        let schema = option_env!("SLIPWATCH_CAP_SCHEMA");
        let done = Command::new("xmllint")
            .args(["--noout", "--nonet", "--schema"])
            .arg(schema.expect("what the build found"))
            .arg(&file)
            .output()
            .unwrap();
        assert!(
            done.status.success(),
            "{}",
            String::from_utf8_lossy(&done.stderr)
        );
    }
}

#[test]
fn a_drill_writes_a_message_that_says_test_and_check_refuses_an_outline_that_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let ask = |table: &str, words: &[&str]| {
        fs::write(folder.path().join("site.toml"), text(table)).unwrap();
        let program = env!("CARGO_BIN_EXE_slipwatch");
        let output = Command::new(program)
            .args(words)
            .current_dir(folder.path())
            .output();
        let output = output.unwrap();
        let said = [&output.stdout[..], &output.stderr].concat();
        (
            output.status.code(),
            String::from_utf8_lossy(&said).into_owned(),
        )
    };
    let (code, said) = ask(TABLE, &["hook", "test", "--config", "site.toml"]);
    assert_eq!(code, Some(0), "{said}");
    let files = fs::read_dir(folder.path().join("cap"))
        .unwrap()
        .map(|one| one.unwrap().path());
    let files: Vec<_> = files.filter(|file| file.is_file()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    let message = fs::read_to_string(&files[0]).unwrap();
    assert!(message.contains("<status>Test</status>"), "{message}");
    for (table, what) in [
        (
            TABLE.replace("46.28,12.35 ", "north "),
            "four or more pairs",
        ),
        (TABLE.replace(" 46.27,12.33\"", "\""), "four or more pairs"),
        (TABLE.replace("slipwatch@", "the daemon@"), "cap.sender"),
        (TABLE.repeat(2), "two [[cap]] with the folder"),
        (TABLE.replace("area", "# area"), "cap.area"),
    ] {
        let (code, said) = ask(&table, &["check", "--config-only", "site.toml"]);
        assert_eq!(code, Some(78), "{said}");
        assert!(said.contains(what), "{what}: {said}");
    }
}

#[tokio::test]
async fn the_end_at_one_site_cancels_nothing_of_another_that_writes_into_the_same_folder() {
    let (folder, hook) = folder();
    let at = folder.path();
    let red = |state| alert("5", Level::Red, (state, Status::Actual));
    let (firing, resolved) = (red(AlertState::Firing), red(AlertState::Resolved));
    let south = |alert: &Alert| Alert {
        site: "south".to_owned(),
        ..alert.clone()
    };
    let first = written(at, &hook, &firing).await.unwrap();
    let other = written(at, &hook, &south(&firing)).await.unwrap();
    assert_eq!(kind(&other), ("Alert".to_owned(), String::new()));
    let end = written(at, &hook, &south(&resolved)).await.unwrap();
    assert_eq!(kind(&end), ("Cancel".to_owned(), reference(&other)));
    let end = written(at, &hook, &resolved).await.unwrap();
    assert_eq!(kind(&end), ("Cancel".to_owned(), reference(&first)));
}

#[tokio::test]
async fn the_end_of_what_another_level_has_replaced_cancels_nothing() {
    let (folder, hook) = folder();
    let actual = |state| (state, Status::Actual);
    let red = alert("5", Level::Red, actual(AlertState::Firing));
    let orange = alert("5", Level::Orange, actual(AlertState::Firing));
    assert!(written(folder.path(), &hook, &red).await.is_some());
    assert!(written(folder.path(), &hook, &orange).await.is_some());
    // The end of the red could not be written before, or came late.
    let end = alert("5", Level::Red, actual(AlertState::Resolved));
    assert_eq!(written(folder.path(), &hook, &end).await, None);
    let end = alert("5", Level::Orange, actual(AlertState::Resolved));
    let cancel = written(folder.path(), &hook, &end).await.unwrap();
    assert!(cancel.contains("<msgType>Cancel</msgType>"), "{cancel}");
}

#[tokio::test]
async fn a_chain_that_cannot_be_read_is_set_aside_and_the_alert_is_written() {
    let (folder, hook) = folder();
    let at = folder.path();
    let real = |level| alert("5", level, (AlertState::Firing, Status::Actual));
    written(at, &hook, &real(Level::Orange)).await.unwrap();
    let chains = at.join("cap/chains");
    for file in fs::read_dir(&chains).unwrap() {
        fs::write(file.unwrap().path(), "").unwrap();
    }
    let red = written(at, &hook, &real(Level::Red)).await.unwrap();
    assert_eq!(kind(&red), ("Alert".to_owned(), String::new()));
    let names = fs::read_dir(&chains).unwrap();
    let names: Vec<String> = names
        .map(|file| file.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    assert!(
        names.iter().any(|name| name.ends_with(".damaged")),
        "{names:?}"
    );
}
