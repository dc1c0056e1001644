//! `demo --serve`: a crisis played on the page, with its end known no earlier than it came.

use crate::site::{PROGRAM, free_address};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};
use slipwatch::runtime::clock::Stopwatch;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

/// The crisis is played in this time, or never.
const LIMIT: Duration = Duration::from_secs(120);

/// The token that the demo says.
const TOKEN: &str = "slipwatch-demo-token";

/// Status and JSON of an answer; 0 where nobody answers.
fn get(address: SocketAddr, path: &str, token: &str) -> (u16, Value) {
    let Ok(mut stream) = TcpStream::connect(address) else {
        return (0, Value::Null);
    };
    let request =
        format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {token}\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut text = String::new();
    let _ = stream.read_to_string(&mut text);
    let status = text.split(' ').nth(1).and_then(|code| code.parse().ok());
    let body = text.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (
        status.unwrap_or(0),
        serde_json::from_str(body).unwrap_or(Value::Null),
    )
}

#[test]
fn the_demo_shows_all_that_a_site_has_and_its_collapse_to_nobody_who_looks_at_an_earlier_moment() {
    let address = free_address();
    let demo = Command::new(PROGRAM)
        .args(["demo", "--pace", "0s", "--serve", &address.to_string()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Stopwatch::start();
    let site = loop {
        assert!(start.elapsed() < LIMIT);
        std::thread::sleep(Duration::from_millis(200));
        let (status, site) = get(address, "/api/site", TOKEN);
        if status == 200 && !site["collapse"].is_null() {
            break site;
        }
    };
    assert_eq!(get(address, "/api/site", "another").0, 401);
    let benchmarks = site["benchmarks"].as_array().unwrap();
    assert_eq!(benchmarks.len(), 5);
    for one in benchmarks {
        assert_eq!(one["position"].as_array().unwrap().len(), 3, "{one}");
        assert_eq!(one["level"], "red", "{one}");
    }
    let says = site["positions_are"].as_str().unwrap();
    assert!(says.contains("states no positions"), "{says}");
    assert_eq!(site["takes_orders"], true);
    let collapse = json!("2012-05-15T01:30:00Z");
    let known = |path: &str| get(address, path, TOKEN).1["collapse"].clone();
    assert_eq!(known("/api/benchmark?id=E1"), collapse);
    for early in ["2012-05-01T00:00:00Z", "2012-05-15T01:29:59Z"] {
        assert_eq!(
            known(&format!("/api/benchmark?id=E1&at={early}")),
            Value::Null
        );
        assert_eq!(known(&format!("/api/site?at={early}")), Value::Null);
    }
    assert_eq!(
        known(&format!("/api/site?at={}", "2012-05-15T01:30:00Z")),
        collapse
    );
    kill(Pid::from_raw(demo.id().try_into().unwrap()), Signal::SIGINT).unwrap();
    let output = demo.wait_with_output().unwrap();
    assert!(output.status.success());
    let said = String::from_utf8(output.stdout).unwrap();
    for part in [TOKEN, "hook.txt", "was run", "[Exercise] Preonzo 2012:"] {
        assert!(said.contains(part), "{part}: {said}");
    }
}
