//! The daemon's answers over HTTP, asked by a client on a real socket.

use assert_cmd::Command;
use jiff::Timestamp;
use slipwatch::alert::Level;
use slipwatch::config::Token;
use slipwatch::monitor::{AlertState, Event, EventKind};
use slipwatch::reading::BenchmarkId;
use slipwatch::runtime::serve::{
    Archive, ArchiveError, CONTENT_TYPE, Limits, ListenOptions, Page, Server,
};
use slipwatch::runtime::vitals::Vitals;
use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
const LIMIT: Duration = Duration::from_secs(60);
const SECRET: &str = "0123456789abcdef-of-the-test";

struct Answer {
    status: u16,
    head: String,
    body: String,
}

/// Sends `request` as it is and reads to the end of the answer.
fn send(address: SocketAddr, request: &[u8]) -> Answer {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    // A server that refuses early may close before all is written.
    let _ = stream.write_all(request);
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    let text = String::from_utf8(bytes).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
    let status = head.split(' ').nth(1).and_then(|code| code.parse().ok());
    Answer {
        status: status.unwrap_or(0),
        head: head.to_ascii_lowercase(),
        body: body.to_owned(),
    }
}

fn get(address: SocketAddr, path: &str, headers: &str) -> Answer {
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n{headers}\r\n");
    send(address, request.as_bytes())
}

fn options() -> ListenOptions {
    ListenOptions {
        listen: "127.0.0.1:0".parse().unwrap(),
        token: None,
        limits: Limits::default(),
    }
}

async fn start(options: ListenOptions, vitals: &Arc<Vitals>) -> (Server, SocketAddr) {
    let server = Server::start(options, Arc::clone(vitals), None)
        .await
        .unwrap();
    let address = server.address();
    (server, address)
}

fn alert(benchmark: &str, level: Level) -> Event {
    Event {
        time: "2017-06-06T17:00:00Z".parse().unwrap(),
        benchmark: Some(BenchmarkId::new(benchmark)),
        kind: EventKind::Alert {
            level,
            state: AlertState::Firing,
            key: "k".to_owned(),
            rule: "chance".to_owned(),
            text: "text".to_owned(),
        },
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn health_is_bad_while_the_work_loop_stands_still_and_good_again_after() {
    let vitals = Arc::new(Vitals::default());
    let limits = Limits {
        turn_time: Duration::from_millis(300),
        ..Limits::default()
    };
    let (server, address) = start(
        ListenOptions {
            limits,
            ..options()
        },
        &vitals,
    )
    .await;
    let idle = Duration::from_millis(400);
    tokio::time::sleep(idle).await;
    let answer = get(address, "/healthz", "");
    assert_eq!(answer.status, 503);
    assert!(answer.body.contains("has not turned"), "{}", answer.body);
    vitals.turned();
    assert_eq!(get(address, "/healthz", "").status, 200);
    server.stop().await;
    assert!(TcpStream::connect(address).is_err(), "still listens");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn it_is_ready_only_when_the_past_is_read_and_the_store_takes_writes() {
    let vitals = Arc::new(Vitals::default());
    let (_server, address) = start(options(), &vitals).await;
    let ready = || get(address, "/readyz", "").status;
    vitals.update(|health| health.is_store_writable = true);
    assert_eq!(ready(), 503);
    vitals.update(|health| health.is_caught_up = true);
    assert_eq!(ready(), 200);
    vitals.update(|health| health.is_paused = true);
    assert_eq!(ready(), 503);
    vitals.update(|health| (health.is_paused, health.is_store_writable) = (false, false));
    assert_eq!(ready(), 503);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn metrics_are_openmetrics_text_with_every_figure_and_escaped_names() {
    let vitals = Arc::new(Vitals::default());
    let time: Timestamp = "2017-06-06T17:00:00Z".parse().unwrap();
    let (odd, took) = ("a \"quoted\"\\\n\u{1b}name", Duration::from_millis(20));
    vitals.read(
        &BenchmarkId::new(odd),
        time,
        &[alert(odd, Level::Orange)],
        took,
    );
    vitals.update(|health| {
        health.readings = 67;
        health.outbox_oldest = Some(time);
        health.database_bytes = Some(4096);
        health.quarantined.insert("logger".to_owned(), 3);
    });
    let (_server, address) = start(options(), &vitals).await;
    let answer = get(address, "/metrics", "");
    assert_eq!(answer.status, 200);
    let kind = format!("content-type: {CONTENT_TYPE}");
    assert!(answer.head.contains(&kind), "{}", answer.head);
    assert!(answer.body.ends_with("# EOF\n"), "{}", answer.body);
    let label = "{benchmark=\"a \\\"quoted\\\"\\\\\\n\\\\u{1b}name\"}";
    for line in [
        "slipwatch_readings_total 67".to_owned(),
        "slipwatch_quarantined_total{source=\"logger\"} 3".to_owned(),
        "slipwatch_outbox_oldest_timestamp_seconds 1496768400.0".to_owned(),
        "slipwatch_benchmarks{level=\"orange\"} 1.0".to_owned(),
        format!("slipwatch_benchmark_level{label} 2.0"),
        format!("slipwatch_benchmark_last_reading_timestamp_seconds{label} 1496768400.0"),
        "# TYPE slipwatch_refit_seconds histogram".to_owned(),
    ] {
        assert!(
            answer.body.lines().any(|had| had == line),
            "{line} not in\n{}",
            answer.body
        );
    }
    let samples = answer.body.lines().filter(|line| !line.starts_with('#'));
    for line in samples {
        let value = line.rsplit_once(' ').map(|(_, value)| value.parse::<f64>());
        assert!(matches!(value, Some(Ok(_))), "{line}");
    }
    let status = get(address, "/api/status", "").body;
    let status: serde_json::Value = serde_json::from_str(&status).unwrap();
    assert_eq!(status["readings"], 67);
    assert_eq!(status["levels"]["orange"], 1);
    assert_eq!(status["benchmarks"][odd]["level"], "orange");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_token_opens_everything_and_without_it_only_health_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("token");
    fs::write(&file, format!("{SECRET}\n")).unwrap();
    let token = Some(Token::read(&file).unwrap());
    let vitals = Arc::new(Vitals::default());
    let (_server, address) = start(ListenOptions { token, ..options() }, &vitals).await;
    let authorized = |given: &str| {
        let headers = format!("Authorization: {given}\r\n");
        get(address, "/metrics", &headers).status
    };
    assert_eq!(get(address, "/healthz", "").status, 200);
    for path in ["/metrics", "/readyz", "/api/status", "/no/such/page"] {
        let answer = get(address, path, "");
        assert_eq!(answer.status, 401, "{path}");
        assert!(answer.head.contains("www-authenticate: bearer"), "{path}");
    }
    assert_eq!(authorized(&format!("Bearer {SECRET}")), 200);
    assert_eq!(authorized(&format!("bearer {SECRET}")), 200);
    for wrong in [
        "Bearer",
        "Bearer ",
        "Basic abc",
        &SECRET[1..],
        "Bearer 0123456789abcdef",
    ] {
        assert_eq!(authorized(wrong), 401, "{wrong}");
    }
    assert_eq!(authorized(&format!("Bearer {SECRET}x")), 401);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_page_under_a_foreign_name_that_points_here_is_shown_nothing() {
    let vitals = Arc::new(Vitals::default());
    let (_server, address) = start(options(), &vitals).await;
    let under = |host: &str| {
        let request = format!("GET /api/status HTTP/1.1\r\nHost: {host}\r\n\r\n");
        send(address, request.as_bytes()).status
    };
    for host in [
        "localhost",
        "localhost:8642",
        "127.0.0.1:8642",
        "[::1]:8642",
        "[::1]",
    ] {
        assert_eq!(under(host), 200, "{host}");
    }
    for host in [
        "evil.example",
        "evil.example:8642",
        "127.0.0.1.evil.example",
        "10.0.0.1",
    ] {
        assert_eq!(under(host), 403, "{host}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn heads_and_bodies_that_are_too_long_are_refused() {
    let vitals = Arc::new(Vitals::default());
    let (_server, address) = start(options(), &vitals).await;
    let long = "x".repeat(20_000);
    assert_eq!(
        get(address, "/healthz", &format!("X: {long}\r\n")).status,
        431
    );
    let many = "X: 1\r\n".repeat(100);
    assert_eq!(get(address, "/healthz", &many).status, 431);
    let path = get(address, &format!("/{long}"), "").status;
    assert!([414, 431].contains(&path), "{path}");
    let body = "POST /api/status HTTP/1.1\r\nHost: localhost\r\nContent-Length: 65537\r\n\r\n";
    assert_eq!(send(address, body.as_bytes()).status, 413);
    assert_eq!(send(address, b"\x16\x03\x01\x02\x00\r\n\r\n").status, 400);
    assert_eq!(get(address, "/healthz", "").status, 200);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn callers_that_never_finish_their_request_shut_nobody_out() {
    let vitals = Arc::new(Vitals::default());
    let limits = Limits {
        connections: 8,
        head_time: Duration::from_millis(300),
        ..Limits::default()
    };
    let (_server, address) = start(
        ListenOptions {
            limits,
            ..options()
        },
        &vitals,
    )
    .await;
    let mut slow = Vec::new();
    for number in 0..24 {
        let mut stream = TcpStream::connect(address).unwrap();
        if number % 2 == 0 {
            stream.write_all(b"GET /healthz HT").unwrap();
        }
        slow.push(stream);
    }
    assert_eq!(get(address, "/healthz", "").status, 200);
    for mut stream in slow {
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        let mut rest = Vec::new();
        // The end, or a reset: in any case not a wait.
        if let Err(error) = stream.read_to_end(&mut rest) {
            assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset);
        }
    }
}

/// Three events.
#[derive(Debug)]
struct Three;

impl Archive for Three {
    fn events(&self, since: Option<&str>, limit: usize) -> Result<Page, ArchiveError> {
        let since: usize = match since {
            None => 0,
            Some(text) => (text.parse()).map_err(|_| ArchiveError::NoSuchPlace(text.to_owned()))?,
        };
        let end = (since + limit).min(3);
        let lines = (since..end).map(|number| format!("{{\"number\":{number}}}\n"));
        Ok(Page {
            lines: lines.collect(),
            next: end.to_string(),
        })
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn events_come_in_pages_and_a_place_that_is_none_is_refused() {
    let vitals = Arc::new(Vitals::default());
    let server = Server::start(options(), vitals, Some(Arc::new(Three)))
        .await
        .unwrap();
    let page = |query: &str| get(server.address(), &format!("/api/events{query}"), "");
    let first = page("?limit=2");
    assert_eq!(first.body, "{\"number\":0}\n{\"number\":1}\n");
    assert!(first.head.contains("slipwatch-next: 2"), "{}", first.head);
    assert!(first.head.contains("content-type: application/x-ndjson"));
    assert_eq!(page("?since=2").body, "{\"number\":2}\n");
    for wrong in ["?since=soon", "?from=2", "?limit=-1"] {
        assert_eq!(page(wrong).status, 400, "{wrong}");
    }
}

/// A site that listens on `listen`, and what else its `[site]` has.
fn site(listen: &str, more: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("incoming")).unwrap();
    fs::write(folder.path().join("token"), SECRET).unwrap();
    let text = format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\nlisten = \"{listen}\"\n{more}\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
         [[hook]]\nrun = [\"/bin/true\"]\n"
    );
    let file = folder.path().join("site.toml");
    fs::write(&file, text).unwrap();
    let file = file.to_str().unwrap().to_owned();
    (folder, file)
}

/// What `command` says of a config that it refuses.
fn refused(command: &str, file: &str) -> String {
    let ended = Command::new(PROGRAM)
        .args([command, file])
        .timeout(LIMIT)
        .assert();
    let said = String::from_utf8_lossy(&ended.get_output().stderr).into_owned();
    ended.code(78);
    said
}

#[test]
fn listening_to_other_machines_without_a_token_is_refused_by_check_and_run() {
    for listen in ["0.0.0.0:0", "[::]:0", "192.0.2.1:8642"] {
        let (_folder, file) = site(listen, "");
        for command in ["check", "run"] {
            let said = refused(command, &file);
            assert!(said.contains("without a token"), "{command}: {said}");
        }
    }
}

#[test]
fn a_token_that_can_be_guessed_or_is_not_there_is_refused_by_check_and_run() {
    let (folder, file) = site("0.0.0.0:0", "token_file = \"token\"\n");
    for text in [
        Some(""),
        Some("short"),
        Some("two words, each of them long"),
        None,
    ] {
        let token = folder.path().join("token");
        match text {
            Some(text) => fs::write(token, text).unwrap(),
            None => fs::remove_file(token).unwrap(),
        }
        for command in ["check", "run"] {
            let said = refused(command, &file);
            assert!(said.contains("token file"), "{command} {text:?}: {said}");
        }
    }
}

#[test]
fn an_address_that_is_taken_is_a_missing_service() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let (_folder, file) = site(&taken.local_addr().unwrap().to_string(), "");
    let run = Command::new(PROGRAM)
        .args(["run", &file])
        .timeout(LIMIT)
        .assert();
    run.code(69);
}

/// The daemon, and where it listens.
struct Daemon {
    child: Child,
    address: SocketAddr,
}

impl Daemon {
    fn start(file: &str) -> Self {
        let mut child = std::process::Command::new(PROGRAM)
            .args(["run", file])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut log = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("listening") {
            line.clear();
            assert_ne!(log.read_line(&mut line).unwrap(), 0, "ended");
        }
        // Somebody must read on, or the daemon waits for the pipe.
        std::thread::spawn(move || std::io::copy(&mut log, &mut std::io::sink()));
        let (_, address) = line.trim().rsplit_once("address=").unwrap();
        let address: SocketAddr = address.parse().unwrap();
        Self { child, address }
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_running_daemon_reports_its_readings_to_whoever_has_the_token() {
    let (folder, file) = site("0.0.0.0:0", "token_file = \"token\"\n");
    let mut text = b"time,5_displacement_mm\n".to_vec();
    for day in 1..=12 {
        writeln!(text, "2017-06-{day:02}T00:00:00Z,{day}").unwrap();
    }
    fs::write(folder.path().join("incoming/a.csv"), text).unwrap();
    let daemon = Daemon::start(&file);
    let address = SocketAddr::from(([127, 0, 0, 1], daemon.address.port()));
    let token = format!("Authorization: Bearer {SECRET}\r\n");
    let mut is_ready = false;
    for _ in 0..600 {
        is_ready = get(address, "/readyz", &token).status == 200;
        if is_ready {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(is_ready, "never ready");
    assert_eq!(get(address, "/metrics", "").status, 401);
    assert_eq!(get(address, "/healthz", "").status, 200);
    let metrics = get(address, "/metrics", &token).body;
    for line in [
        "slipwatch_readings_total 12",
        "slipwatch_caught_up 1.0",
        "slipwatch_benchmark_last_reading_timestamp_seconds{benchmark=\"5\"} 1497225600.0",
    ] {
        assert!(
            metrics.lines().any(|had| had == line),
            "{line} not in\n{metrics}"
        );
    }
    let refits = metrics
        .lines()
        .find_map(|line| line.strip_prefix("slipwatch_refit_seconds_count "));
    let refits: u32 = refits.expect("a histogram").parse().unwrap();
    assert!((1..=12).contains(&refits), "{refits}");
}

/// A figure of the daemon's metrics.
fn figure(metrics: &str, name: &str) -> f64 {
    let line = metrics.lines().find_map(|line| {
        let (had, value) = line.rsplit_once(' ')?;
        (had == name).then(|| value.parse().unwrap())
    });
    line.unwrap_or_else(|| panic!("{name} not in\n{metrics}"))
}

#[test]
fn a_running_daemon_reports_how_long_values_wait_what_it_cannot_use_and_what_no_hook_takes() {
    let (folder, file) = site("127.0.0.1:0", "");
    let refused = fs::read_to_string(&file).unwrap().replace("true", "false");
    let threshold = "[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"50 mm\"\n";
    fs::write(&file, refused + threshold).unwrap();
    let mut text =
        "time,5_displacement_mm\n1970-01-01T00:00:05Z,1\nno time,1\nnor here,2\n".to_owned();
    let first = slipwatch::runtime::clock::now().as_second() - 600 * 60;
    let mut backlog = String::new();
    for minute in 0..600 {
        let time = Timestamp::from_second(first + 60 * minute).unwrap();
        let rows = if minute < 20 { &mut text } else { &mut backlog };
        writeln!(rows, "{time},{}", minute as f64 / 10.0).unwrap();
    }
    fs::write(folder.path().join("incoming/a.csv"), &text).unwrap();
    let daemon = Daemon::start(&file);
    let (mut lag, mut metrics) = (0.0_f64, String::new());
    while !metrics.contains("slipwatch_caught_up 1.0") {
        std::thread::sleep(Duration::from_millis(20));
        metrics = get(daemon.address, "/metrics", "").body;
    }
    // Those of the first start are taken without being judged one by one; these are not.
    let file = folder.path().join("incoming/a.csv");
    let mut growing = fs::OpenOptions::new().append(true).open(file).unwrap();
    growing.write_all(backlog.as_bytes()).unwrap();
    for _ in 0..3000 {
        metrics = get(daemon.address, "/metrics", "").body;
        lag = lag.max(figure(&metrics, "slipwatch_lag_seconds"));
        if figure(&metrics, "slipwatch_caught_up") > 0.0
            && figure(&metrics, "slipwatch_outbox_alerts") > 0.0
            && figure(&metrics, "slipwatch_readings_total") >= 600.0
        {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    // The batch is worked in for long enough to be seen waiting, and when it is done nothing waits.
    assert!(lag > 0.0);
    for (name, value) in [
        ("slipwatch_readings_total", 600.0),
        ("slipwatch_lag_seconds", 0.0),
        ("slipwatch_quarantined_total{source=\"logger\"}", 2.0),
        ("slipwatch_without_clock_total", 1.0),
        ("slipwatch_unwritten_inputs", 0.0),
    ] {
        let had = figure(&metrics, name);
        assert!((had - value).abs() < 1e-9, "{name} {had}");
    }
    let called = figure(&metrics, "slipwatch_outbox_oldest_timestamp_seconds");
    let range = first as f64..(first + 36_000) as f64;
    assert!(range.contains(&called), "{called}");
}
