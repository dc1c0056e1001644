//! What the daemon answers to its page, asked without a browser.

use crate::site::{MARKUP, Site, TOKEN};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;

/// Status, head and body of an answer to a request as it is.
fn send(site: &Site, request: &str) -> (u16, String, String) {
    let mut stream = TcpStream::connect(("127.0.0.1", site.port)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut text = String::new();
    let _ = stream.read_to_string(&mut text);
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
    let status = head.split(' ').nth(1).and_then(|code| code.parse().ok());
    (
        status.unwrap_or(0),
        head.to_ascii_lowercase(),
        body.to_owned(),
    )
}

fn order(site: &Site, headers: &str, body: &Value) -> (u16, String) {
    let (body, port) = (body.to_string(), site.port);
    let request = format!(
        "POST /api/orders HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{headers}Content-Length: {}\r\n\r\n{body}",
        body.len()
    );
    let (status, _, said) = send(site, &request);
    (status, said)
}

#[test]
fn the_page_is_open_its_data_is_not_and_its_policy_lets_nothing_foreign_run() {
    let site = Site::start();
    let get = |path: &str| {
        let request = format!(
            "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n",
            site.port
        );
        send(&site, &request)
    };
    let (status, head, body) = get("/");
    assert_eq!(status, 200);
    let policy = "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; \
                  connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    assert!(head.contains(policy), "{head}");
    assert!(
        !body.contains("Preonzo"),
        "the page's own text says nothing of the site"
    );
    for file in ["/page/main.js", "/page/page.css", "/page/uplot.js"] {
        assert_eq!(get(file).0, 200, "{file}");
    }
    for data in [
        "/api/site",
        "/api/benchmark?id=E3",
        "/api/stream",
        "/api/status",
    ] {
        assert_eq!(get(data).0, 401, "{data}");
    }
}

#[test]
fn a_moment_is_shown_as_it_was_known_then() {
    let site = Site::start();
    let alerts = site.events("alert");
    let refits = site.events("refit");
    let red = alerts
        .iter()
        .find(|one| one["benchmark"] == "E3" && one["level"] == "red")
        .unwrap();
    let red = red["time"].as_str().unwrap();
    let before: jiff::Timestamp = red.parse().unwrap();
    let before = before - jiff::SignedDuration::from_mins(1);
    let is_before = |one: &&Value| {
        let time: jiff::Timestamp = one["time"].as_str().unwrap().parse().unwrap();
        one["benchmark"] == "E3" && time <= before
    };
    let level = |at: &str| {
        let answer = site.json(&format!("/api/site?at={at}"));
        let standings = answer["benchmarks"].as_array().unwrap().clone();
        standings
            .into_iter()
            .find(|one| one["benchmark"] == "E3")
            .unwrap()
    };
    assert_eq!(level(red)["level"], "red");
    let then = level(&before.to_string());
    assert_eq!(then["level"], "yellow");
    let newest = refits.iter().rfind(is_before).unwrap();
    assert_eq!(then["failure_time"], newest["failure_time"]);
    let answer = site.json(&format!("/api/benchmark?id=E3&at={before}"));
    assert_eq!(&answer["latest"], newest);
    let forecasts = answer["forecasts"].as_array().unwrap();
    assert_eq!(forecasts.last().unwrap()["time"], newest["time"]);
    assert_eq!(
        answer["levels"].as_array().unwrap().last().unwrap()["level"],
        "yellow"
    );
    let t = answer["readings"]["t"].as_array().unwrap();
    assert!(
        t.iter()
            .all(|t| t.as_f64().unwrap() <= before.as_second() as f64 + 1.0)
    );
    // At the beginning nothing is known.
    let empty = site.json("/api/benchmark?id=E3&at=1990-01-01T00:00:00Z");
    assert_eq!(empty["readings"]["t"], json!([]));
    assert_eq!(empty["latest"], Value::Null);
    assert_eq!(empty["standing"]["is_unknown"], true);
    assert_eq!(site.get("/api/benchmark?id=nobody").0, 404);
    let (status, text) = site.get("/api/site?at=yesterday");
    assert_eq!(status, 400);
    assert!(
        text.contains("at: found \"yesterday\", expected a time such as"),
        "{text}"
    );
}

#[test]
fn an_order_from_a_foreign_page_or_under_a_foreign_name_is_refused() {
    let site = Site::start();
    let body = json!({ "order": "acknowledge", "benchmark": "E3", "by": "Anna" }).to_string();
    let port = site.port;
    let order = |host: &str, origin: &str| {
        let request = format!(
            "POST /api/orders HTTP/1.1\r\nHost: {host}\r\n{origin}Authorization: Bearer {TOKEN}\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        send(&site, &request)
    };
    let own = format!("127.0.0.1:{port}");
    for (host, origin) in [
        (&*own, "Origin: http://evil.example\r\n".to_owned()),
        (&*own, "Origin: null\r\n".to_owned()),
        (&*own, format!("Origin: http://127.0.0.1:{}\r\n", port ^ 1)),
        // A name that somebody else had lead to this machine, asked by the page under that name.
        ("evil.example", "Origin: http://evil.example\r\n".to_owned()),
        ("evil.example", String::new()),
    ] {
        let (status, _, said) = order(host, &origin);
        assert_eq!(status, 403, "{host} {origin}: {said}");
    }
    assert_eq!(site.events("order").len(), 0);
    let ours = format!("Origin: http://{own}\r\n");
    assert_eq!(order(&own, &ours).0, 200);
    assert_eq!(order(&format!("localhost:{port}"), "").0, 200);
}

#[test]
fn an_order_needs_the_token_a_name_and_a_span_that_is_allowed() {
    let site = Site::start();
    let json_kind = "Content-Type: application/json\r\n";
    let headers = format!("Authorization: Bearer {TOKEN}\r\n{json_kind}");
    let order = |headers: &str, body: &Value| order(&site, headers, body);
    let good = json!({ "order": "shelve", "benchmark": MARKUP, "by": "Anna", "seconds": 3600 });
    assert_eq!(order(json_kind, &good).0, 401);
    // What a page of another site could send without being asked first.
    let plain = format!("Authorization: Bearer {TOKEN}\r\nContent-Type: text/plain\r\n");
    assert_eq!(order(&plain, &good).0, 415);
    for wrong in [
        json!({ "order": "shelve", "benchmark": "E3", "by": " ", "seconds": 3600 }),
        json!({ "order": "shelve", "benchmark": "E3", "seconds": 3600 }),
        json!({ "order": "shelve", "by": "Anna", "seconds": 3600 }),
        json!({ "order": "shelve", "benchmark": "nobody", "by": "Anna", "seconds": 3600 }),
        json!({ "order": "silence", "by": "Anna" }),
        json!({ "order": "silence", "by": "Anna", "seconds": 8 * 86_400 }),
        json!({ "order": "resolve", "by": "Anna", "why": "wire cut" }),
        json!({ "order": "resolve", "benchmark": "E3", "by": "Anna" }),
    ] {
        let (status, said) = order(&headers, &wrong);
        assert_eq!(status, 422, "{wrong}: {said}");
    }
    assert_eq!(order(&headers, &good).0, 200);
    let start = slipwatch::runtime::clock::Stopwatch::start();
    let orders = loop {
        let orders = site.events("order");
        if !orders.is_empty() || start.elapsed().as_secs() > 60 {
            break orders;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    };
    assert_eq!(orders.len(), 1);
    assert_eq!(
        [
            &orders[0]["order"],
            &orders[0]["by"],
            &orders[0]["benchmark"]
        ],
        ["shelve", "Anna", MARKUP]
    );
}

#[test]
fn an_order_is_not_of_what_was_called_after_the_view_that_it_is_given_from() {
    let site = Site::start();
    let headers = format!("Authorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\n");
    let view = site.json("/api/benchmark?id=E3");
    let newest = view["newest_event"].as_i64().unwrap();
    assert!(newest > 0);
    let taken = |seen: i64, count: usize| {
        let order_of_view =
            json!({ "order": "acknowledge", "benchmark": "E3", "by": "Anna", "seen": seen });
        assert_eq!(order(&site, &headers, &order_of_view).0, 200);
        let start = slipwatch::runtime::clock::Stopwatch::start();
        while site.events("order").len() < count && start.elapsed().as_secs() < 60 {
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        let acknowledged = site.json("/api/site")["acknowledged_by"].clone();
        acknowledged.as_object().unwrap().len()
    };
    assert_eq!(taken(0, 1), 0, "called since, and not seen");
    assert_eq!(taken(newest, 2), 1);
}

#[test]
fn the_silence_of_the_whole_site_is_not_ended_for_one_benchmark_without_a_word() {
    let site = Site::start();
    let headers = format!("Authorization: Bearer {TOKEN}\r\nContent-Type: application/json\r\n");
    let silence = json!({ "order": "silence", "by": "Anna", "seconds": 3600 });
    assert_eq!(order(&site, &headers, &silence).0, 200);
    let start = slipwatch::runtime::clock::Stopwatch::start();
    while site.events("order").is_empty() && start.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    let one = json!({ "order": "unsilence", "benchmark": "E3", "by": "Anna" });
    let (status, said) = order(&site, &headers, &one);
    assert_eq!(status, 422, "{said}");
    assert!(said.contains("the whole site is silenced"), "{said}");
    assert!(said.contains("by Anna"), "{said}");
    let all = json!({ "order": "unsilence", "by": "Anna" });
    assert_eq!(order(&site, &headers, &all).0, 200);
}

#[test]
fn the_stream_gives_each_event_once_with_its_number_and_ends_by_itself() {
    let site = Site::start();
    let request = format!(
        "GET /api/stream?since=0 HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n",
        site.port
    );
    let (status, head, body) = send(&site, &request);
    assert_eq!(status, 200);
    assert!(head.contains("content-type: text/event-stream"), "{head}");
    let numbers: Vec<i64> = body
        .split("\n\n")
        .filter(|message| message.contains("event: change"))
        .filter_map(|message| {
            message
                .lines()
                .find_map(|line| line.strip_prefix("id: ")?.parse().ok())
        })
        .collect();
    assert!(numbers.len() > 20, "{body}");
    assert!(
        numbers.windows(2).all(|pair| pair[0] < pair[1]),
        "{numbers:?}"
    );
    assert!(body.contains("event: progress"), "{body}");
}
