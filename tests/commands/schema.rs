//! The JSON Schemas: those in docs/schema are this program's, and what the program writes is as they say.

use assert_cmd::cargo::cargo_bin;
use jsonschema::Validator;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn slipwatch(words: &[&str]) -> String {
    let done = Command::new(cargo_bin("slipwatch"))
        .args(words)
        .current_dir(root())
        .output()
        .unwrap();
    String::from_utf8(done.stdout).unwrap()
}

/// The schema of that name, as it is published.
fn published(name: &str) -> Value {
    let file = root().join(format!("docs/schema/{name}.json"));
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

/// The same, closed: a key that it does not name is refused. What later versions may add is no excuse for this one.
fn closed(name: &str) -> Value {
    let mut schema = published(name);
    let mut mixed_in = BTreeSet::new();
    references_beside_properties(&schema, &mut mixed_in);
    let definitions = schema["$defs"].as_object_mut().unwrap();
    for (name, one) in definitions {
        let is_object = one["type"] == "object" || one.get("properties").is_some();
        if is_object && !mixed_in.contains(name) {
            one["unevaluatedProperties"] = json!(false);
        }
    }
    schema
}

/// Definitions whose properties stand beside others in one object, which alone knows all of them.
fn references_beside_properties(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(members) => {
            if let (Some(Value::String(reference)), true) =
                (members.get("$ref"), members.contains_key("properties"))
            {
                found.insert(reference.rsplit('/').next().unwrap().to_owned());
            }
            for one in members.values() {
                references_beside_properties(one, found);
            }
        }
        Value::Array(items) => {
            for one in items {
                references_beside_properties(one, found);
            }
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

fn validator(schema: &Value) -> Validator {
    jsonschema::options()
        .should_validate_formats(true)
        .build(schema)
        .unwrap()
}

/// Asserts that every line is as the schema of that name says, and that there are at least so many.
fn are(name: &str, lines: &str, at_least: usize) {
    let validator = validator(&closed(name));
    let mut count = 0;
    for line in lines.lines() {
        let value: Value = serde_json::from_str(line).unwrap();
        let wrong: Vec<String> = validator
            .iter_errors(&value)
            .map(|error| format!("{}: {error}", error.instance_path()))
            .collect();
        assert!(wrong.is_empty(), "{name}: {wrong:#?}\n{line}");
        count += 1;
    }
    assert!(count >= at_least, "{name}: {count} lines");
}

fn names() -> Vec<String> {
    let list = slipwatch(&["schema"]);
    let first = |line: &str| line.split_whitespace().next().unwrap().to_owned();
    list.lines().map(first).collect()
}

#[test]
fn the_published_schemas_are_those_of_this_program() {
    let folder = tempfile::tempdir().unwrap();
    slipwatch(&["schema", "-o", folder.path().to_str().unwrap()]);
    let files = |folder: &Path| -> BTreeSet<PathBuf> {
        let entries = std::fs::read_dir(folder).unwrap();
        let files = entries.map(|entry| PathBuf::from(entry.unwrap().file_name()));
        files
            .filter(|file| file.extension().is_some_and(|end| end == "json"))
            .collect()
    };
    let published = root().join("docs/schema");
    assert_eq!(files(folder.path()), files(&published));
    for file in files(folder.path()) {
        let text = |folder: &Path| std::fs::read_to_string(folder.join(&file)).unwrap();
        assert!(
            text(folder.path()) == text(&published),
            "docs/schema/{} is not what the program writes: cargo run -- schema -o docs/schema",
            file.display()
        );
    }
    let index = std::fs::read_to_string(published.join("README.md")).unwrap();
    for name in names() {
        assert!(index.contains(&format!("({name}.json)")), "{name}");
        assert_eq!(
            slipwatch(&["schema", &name]).lines().nth(2).unwrap(),
            format!("  \"title\": \"slipwatch {name}\",")
        );
    }
}

#[test]
fn each_is_a_schema_and_says_what_every_key_means() {
    for name in names() {
        let schema = published(&name);
        assert!(jsonschema::draft202012::meta::is_valid(&schema), "{name}");
        let mut bare = Vec::new();
        without_words(&schema, &mut bare);
        assert!(bare.is_empty(), "{name}: {bare:?}");
    }
}

/// Keys that nothing is said of, here or where they refer to.
fn without_words(schema: &Value, bare: &mut Vec<String>) {
    match schema {
        Value::Object(members) => {
            if let Some(Value::Object(properties)) = members.get("properties") {
                for (key, value) in properties {
                    let says = ["description", "const", "$ref"];
                    let is_list_of_tables = value["items"].get("$ref").is_some();
                    if !is_list_of_tables && says.iter().all(|word| value.get(word).is_none()) {
                        bare.push(key.clone());
                    }
                }
            }
            for one in members.values() {
                without_words(one, bare);
            }
        }
        Value::Array(items) => {
            for one in items {
                without_words(one, bare);
            }
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

#[test]
fn what_the_commands_on_files_write_is_as_the_schemas_say() {
    let json = |words: &[&str]| slipwatch(&[words, &["--format", "json"]].concat());
    let preonzo = "recordings/preonzo-2012.mcap";
    are("fit", &json(&["fit", preonzo]), 2);
    let few = tempfile::tempdir().unwrap();
    let file = few.path().join("few.csv");
    std::fs::write(
        &file,
        "time,displacement_mm\n2020-01-01T00:00:00Z,0\n2020-01-02T00:00:00Z,1\n",
    )
    .unwrap();
    let file = file.to_str().unwrap();
    are("fit", &json(&["fit", file]), 1);
    are(
        "sweep",
        &json(&["sweep", preonzo, "--benchmark", "E1", "--steps", "4"]),
        1,
    );
    are("sweep", &json(&["sweep", file]), 1);
    are("explain", &json(&["explain", file]), 1);
    let score = [
        "score",
        preonzo,
        "--benchmark",
        "E1",
        "--failure-time",
        "2012-05-15T01:30:00Z",
    ];
    are("score", &json(&score), 1);
    are(
        "score",
        &json(&["score", preonzo, "--benchmark", "E1", "--no-failure"]),
        1,
    );
    are("event", &json(&["replay", preonzo]), 100);
    let simulate = [
        "simulate",
        "--m",
        "1.35",
        "--x-i",
        "0.6",
        "--times",
        "0,0.5,5000",
    ];
    are("simulate", &json(&simulate), 1);
    let copy = few.path().join("copy.ndjson");
    are(
        "convert",
        &json(&["convert", preonzo, copy.to_str().unwrap()]),
        1,
    );
    let folder = few.path().to_str().unwrap();
    are(
        "report",
        &json(&["report", file, "-o", folder, "--no-search"]),
        1,
    );
    let site = few.path().join("site.toml");
    let init = ["init", preonzo, "-o", site.to_str().unwrap()];
    are("init", &json(&init), 2);
    are("check", &json(&["check", "config/example.toml"]), 1);
    let wrong = few.path().join("wrong.toml");
    std::fs::write(&wrong, "[site]\nnam = \"Toc\"\n").unwrap();
    are("check", &json(&["check", wrong.to_str().unwrap()]), 1);
    are("doctor", &json(&["doctor", site.to_str().unwrap()]), 1);
}

#[test]
fn a_schema_refuses_what_is_wrong() {
    let event = validator(&closed("event"));
    let fault = json!({"time": "2020-01-01T00:00:00Z", "event": "fault", "kind": "no-data", "text": "silent"});
    assert!(event.is_valid(&fault));
    for (key, value) in [
        ("time", json!("yesterday")),
        ("event", json!("fualt")),
        ("text", Value::Null),
        ("extra", json!(1)),
    ] {
        let mut wrong = fault.clone();
        wrong[key] = value;
        assert!(!event.is_valid(&wrong), "{key}");
    }
    let fit = validator(&published("fit"));
    assert!(!fit.is_valid(&json!({"benchmark": "5"})));
}

/// The example with what stands in its comments, as JSON.
fn example() -> Value {
    let text = std::fs::read_to_string(root().join("config/example.toml")).unwrap();
    let is_meant = |line: &&str| {
        let key = line.split(' ').next().unwrap();
        let is_key =
            line.contains(" = ") && key.bytes().all(|b| b.is_ascii_lowercase() || b == b'_');
        line.starts_with('[') || is_key
    };
    let bare = |line: &'_ str| -> String {
        line.strip_prefix("# ")
            .filter(is_meant)
            .unwrap_or(line)
            .to_owned()
    };
    let text: Vec<String> = text.lines().map(bare).collect();
    let table: toml::Table = toml::from_str(&text.join("\n")).unwrap();
    serde_json::to_value(table).unwrap()
}

#[test]
fn the_schema_of_the_config_takes_what_the_reader_takes() {
    let config = validator(&published("config"));
    let right = example();
    let wrong: Vec<String> = config
        .iter_errors(&right)
        .map(|error| error.to_string())
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    let mut wrong = right.clone();
    wrong["alert"]["red_chanse"] = json!(0.1);
    assert!(!config.is_valid(&wrong));
    let mut wrong = right.clone();
    wrong["site"]["listen"] = json!(8642);
    assert!(!config.is_valid(&wrong));
    let mut wrong = right.clone();
    wrong.as_object_mut().unwrap().remove("site");
    assert!(!config.is_valid(&wrong));
    let mut wrong = right;
    wrong["site"].as_object_mut().unwrap().remove("name");
    assert!(!config.is_valid(&wrong));
}

#[test]
fn the_schema_of_the_config_has_the_keys_that_check_says_are_known() {
    let schema = published("config");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.toml");
    let known = |table: &str, more: &str| -> BTreeSet<String> {
        std::fs::write(&file, format!("{table}\nno_such_key = 1\n{more}")).unwrap();
        let said = slipwatch(&["check", file.to_str().unwrap(), "--format", "json"]);
        let said: Value = serde_json::from_str(&said).unwrap();
        let problems = said["problems"].as_array().unwrap().iter();
        let fix = problems
            .filter(|one| one["what"].as_str().unwrap().contains("unknown key"))
            .map(|one| one["fix"].as_str().unwrap())
            .find_map(|fix| fix.strip_prefix("known here: "))
            .unwrap();
        fix.split(", ").map(str::to_owned).collect()
    };
    let rule = "level = \"red\"";
    for (name, table, more) in [
        ("site", "[site]", ""),
        ("alert", "[alert]", ""),
        ("alert.threshold", "[[alert.threshold]]", rule),
        (
            "alert.rule",
            "[[alert.rule]]",
            "level = \"red\"\nall = [\"velocity 1 m/day\"]",
        ),
        ("explain", "[explain]", ""),
        ("benchmark", "[[benchmark]]", ""),
        ("benchmark.alert", "[[benchmark]]\n[benchmark.alert]", ""),
        ("hook", "[[hook]]", ""),
        ("webhook", "[[webhook]]", ""),
        ("cap", "[[cap]]", ""),
        ("heartbeat", "[[heartbeat]]", ""),
    ] {
        let keys: BTreeSet<String> = schema["$defs"][name]["properties"]
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect();
        assert_eq!(keys, known(table, more), "{name}");
    }
    // What these may say depends on their kind.
    for (name, kinds) in [
        ("source", ["csv", "mqtt", "mcap"]),
        ("event", ["reset", "maintenance", "blast"]),
    ] {
        let of = |kind: &str| {
            let more = format!("kind = \"{kind}\"\ntime = \"2020-01-01T00:00:00Z\"");
            known(&format!("[[{name}]]"), &more)
        };
        let each: BTreeSet<String> = kinds.into_iter().flat_map(of).collect();
        let keys = schema["$defs"][name]["properties"].as_object().unwrap();
        assert_eq!(
            keys.keys().cloned().collect::<BTreeSet<_>>(),
            each,
            "{name}"
        );
    }
}

/// A daemon, killed when the test ends.
struct Daemon(Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

/// The status and the body of the answer.
fn asked(address: SocketAddr, head: &str, body: &str) -> Option<(u16, String)> {
    let mut connection = TcpStream::connect(address).ok()?;
    let length = body.len();
    let request = format!(
        "{head} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAuthorization: Bearer {TOKEN}\r\n\
         Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
    );
    connection.write_all(request.as_bytes()).ok()?;
    let mut answer = String::new();
    connection.read_to_string(&mut answer).ok()?;
    let (head, body) = answer.split_once("\r\n\r\n")?;
    let status = head.split(' ').nth(1)?.parse().ok()?;
    Some((status, body.to_owned()))
}

/// A site with an alert, a hook that keeps what it gets, and a page.
fn watched_site(folder: &Path) -> (PathBuf, SocketAddr) {
    let rows = (1..=30).map(|day| {
        let slip = f64::from(day * day) * 0.5;
        format!("2020-01-{day:02}T00:00:00Z,{slip},{}\n", day % 4)
    });
    let readings = "time,displacement_mm,rain_mm\n".to_owned() + &rows.collect::<String>();
    std::fs::write(folder.join("logger.csv"), readings).unwrap();
    std::fs::write(folder.join("token"), TOKEN).unwrap();
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = free.local_addr().unwrap();
    let config = folder.join("site.toml");
    let text = format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\nlisten = \"{address}\"\ntoken_file = \"token\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"logger.csv\"\n\
         [[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"100 mm\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"-c\", \"cat >> got.json\"]\n"
    );
    std::fs::write(&config, text).unwrap();
    (config, address)
}

#[test]
fn what_the_daemon_and_the_commands_beside_it_write_is_as_the_schemas_say() {
    let folder = tempfile::tempdir().unwrap();
    let (config, address) = watched_site(folder.path());
    let site = config.to_str().unwrap();
    let child = Command::new(cargo_bin("slipwatch"))
        .args(["run", site])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let _daemon = Daemon(child.unwrap());
    let get = |path: &str| asked(address, &format!("GET {path}"), "");
    let is_ready = || get("/readyz").is_some_and(|(status, _)| status == 200);
    for _ in 0..1200 {
        if is_ready() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let json =
        |words: &[&str]| slipwatch(&[words, &["--config", site, "--format", "json"]].concat());
    are("hook-test", &json(&["hook", "test"]), 1);
    let got = std::fs::read_to_string(folder.path().join("got.json")).unwrap();
    are("hook", &got, 1);
    are("event", &json(&["events"]), 2);
    are("event", &json(&["alerts", "list"]), 1);
    are("alert", &json(&["alerts", "show", "logger/red"]), 1);
    are("status", &json(&["status"]), 1);
    are("status", &json(&["status", "--sources"]), 1);
    are(
        "order",
        &json(&["alerts", "ack", "--by", "Ada", "--why", "seen"]),
        1,
    );
    are("order", &json(&["alerts", "silence", "--for", "1h"]), 1);
    are("order", &json(&["alerts", "unsilence"]), 1);
    are(
        "order",
        &json(&["alerts", "shelve", "--benchmark", "logger", "--for", "1h"]),
        1,
    );
    are("redeliver", &json(&["alerts", "redeliver"]), 1);
    let copy = folder.path().join("copy.db");
    are("backup", &json(&["backup", copy.to_str().unwrap()]), 1);
    let answer = |path: &str| {
        let (status, body) = get(path).unwrap();
        assert_eq!(status, 200, "{path}: {body}");
        body
    };
    are("api-status", &answer("/api/status"), 1);
    are("api-site", &answer("/api/site"), 1);
    are("api-site", &answer("/api/site?at=2020-01-20T00:00:00Z"), 1);
    are("api-benchmark", &answer("/api/benchmark?id=logger"), 1);
    are("event", &answer("/api/events"), 2);
    let key = &json(&["alerts", "list"]);
    let key: Value = serde_json::from_str(
        key.lines()
            .find(|line| line.contains("\"event\":\"alert\""))
            .unwrap(),
    )
    .unwrap();
    let key = key["key"]
        .as_str()
        .unwrap()
        .replace('/', "%2F")
        .replace(':', "%3A");
    are("alert", &answer(&format!("/api/alert?key={key}")), 1);
    let order = json!({"order": "silence", "benchmark": null, "by": "Ada", "why": "a drill", "seconds": 60});
    are("api-order", &order.to_string(), 1);
    let (status, body) = asked(address, "POST /api/orders", &order.to_string()).unwrap();
    assert_eq!(status, 200, "{body}");
    are("order", &body, 1);
}
