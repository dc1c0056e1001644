//! Webhooks against real listeners: what they get, that it is signed, and how failures are tried again.

use crate::certificates::Certified;
use crate::eventually::eventually;
use crate::identity::red_fires;
use crate::offered::offer;
use crate::site::free_address;
use slipwatch::alert::Level;
use slipwatch::config::{self, HookConfig};
use slipwatch::monitor::{AlertState, Event, EventKind};
use slipwatch::reading::BenchmarkId;
use slipwatch::runtime::deliver::{self, Dispatcher, Retry};
use slipwatch::runtime::delivered::Delivered;
use slipwatch::runtime::hook::{Alert, HookOutcome, Status};
use slipwatch::store::{DeliveryOutcome, Store};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio_rustls::rustls;
use tokio_rustls::rustls::pki_types::PrivateKeyDer;

const SECRET: &str = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";

/// What one request held.
#[derive(Debug, Clone)]
struct Got {
    line: String,
    headers: BTreeMap<String, String>,
    body: String,
}

/// A receiver on a port of its own, which answers with these statuses in turn and then with the last one; 0: never.
struct Receiver {
    url: String,
    got: Arc<Mutex<Vec<Got>>>,
}

impl Receiver {
    fn answering(statuses: &[u16]) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}/alerts?x=1", listener.local_addr().unwrap());
        let got = Arc::new(Mutex::new(Vec::new()));
        let (seen, statuses) = (Arc::clone(&got), statuses.to_vec());
        std::thread::spawn(move || {
            let mut open = Vec::new();
            for (number, stream) in listener.incoming().enumerate() {
                let mut stream = stream.unwrap();
                seen.lock().unwrap().push(request(&stream));
                let status = statuses[number.min(statuses.len() - 1)];
                if status == 0 {
                    // Held open, never answered.
                    open.push(stream);
                    continue;
                }
                let answer = format!("HTTP/1.1 {status} Said\r\ncontent-length: 2\r\n\r\nok");
                stream.write_all(answer.as_bytes()).unwrap();
            }
        });
        Self { url, got }
    }

    fn got(&self) -> Vec<Got> {
        self.got.lock().unwrap().clone()
    }
}

fn request(stream: impl Read) -> Got {
    let mut reader = BufReader::new(stream);
    let mut next = || {
        let mut line = String::new();
        reader.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    };
    let line = next();
    let mut headers = BTreeMap::new();
    loop {
        let line = next();
        let Some((name, value)) = line.split_once(": ") else {
            break;
        };
        headers.insert(name.to_ascii_lowercase(), value.to_owned());
    }
    let length = headers.get("content-length");
    let mut body = vec![0; length.map_or(0, |length| length.parse().unwrap())];
    reader.read_exact(&mut body).unwrap();
    let body = String::from_utf8(body).unwrap();
    Got {
        line,
        headers,
        body,
    }
}

/// The webhooks of a config with these tables.
fn webhooks(folder: &Path, tables: &str) -> Vec<HookConfig> {
    std::fs::write(folder.join("secret"), format!("{SECRET}\n")).unwrap();
    config::parse(&text(tables), &folder.join("site.toml"))
        .unwrap()
        .hooks
}

pub(crate) fn text(tables: &str) -> String {
    format!(
        "[site]\nname = \"Monte Toc\"\nstate_dir = \"state\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n{tables}"
    )
}

fn webhook(url: &str, more: &str) -> String {
    format!("[[webhook]]\nurl = \"{url}\"\nsecret_file = \"secret\"\n{more}\n")
}

pub(crate) fn alert(benchmark: &str, key: &str) -> Alert {
    let event = Event {
        time: "2017-06-06T17:00:00Z".parse().unwrap(),
        benchmark: Some(BenchmarkId::new(benchmark)),
        kind: EventKind::Alert {
            level: Level::Red,
            state: AlertState::Firing,
            key: key.to_owned(),
            rule: "chance".to_owned(),
            text: "red at 5: caf\u{e9}".to_owned(),
        },
    };
    Alert::new(&event, "Monte Toc", None, Status::Actual).unwrap()
}

pub(crate) fn quick() -> Retry {
    Retry {
        attempts: 3,
        first_delay: Duration::from_millis(20),
        longest_delay: Duration::from_millis(40),
        seed: 7,
    }
}

/// The signature as Python's own library makes it.
fn signature_by_python(got: &Got) -> String {
    let program = "import base64,hashlib,hmac,sys\n\
        key = base64.b64decode(sys.argv[1].removeprefix('whsec_'))\n\
        signed = (sys.argv[2] + '.' + sys.argv[3] + '.').encode() + sys.stdin.buffer.read()\n\
        print('v1,' + base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode())";
    let (id, time) = (
        &got.headers["webhook-id"],
        &got.headers["webhook-timestamp"],
    );
    let mut child = Command::new("python3")
        .args(["-c", program, SECRET, id, time])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(got.body.as_bytes()).unwrap();
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

#[tokio::test]
#[cfg_attr(not(has_python3), ignore = "python3 was not found by build.rs")]
async fn a_webhook_gets_what_a_hook_gets_on_stdin_under_a_signature() {
    let folder = tempfile::tempdir().unwrap();
    let receiver = Receiver::answering(&[204]);
    let hooks = webhooks(folder.path(), &webhook(&receiver.url, ""));
    let alert = alert("m\u{fc}hle", "m\u{fc}hle/red/1.5");
    assert_eq!(deliver::run(&hooks[0], &alert, 3).await, HookOutcome::Done);
    let got = receiver.got().remove(0);
    assert_eq!(got.line, "POST /alerts?x=1 HTTP/1.1");
    assert_eq!(got.headers["content-type"], "application/json");
    // No full stop: it parts what is signed.
    assert_eq!(got.headers["webhook-id"], "m%C3%BChle/red/1%2E5/red/firing");
    let body: serde_json::Value = serde_json::from_str(&got.body).unwrap();
    for (key, value) in [
        ("event", "alert"),
        ("benchmark", "m\u{fc}hle"),
        ("level", "red"),
        ("key", "m\u{fc}hle/red/1.5"),
        ("site", "Monte Toc"),
        ("status", "Actual"),
    ] {
        assert_eq!(body[key], value, "{key}");
    }
    assert_eq!(body["attempt"], 3);
    let sent: i64 = got.headers["webhook-timestamp"].parse().unwrap();
    let now = slipwatch::runtime::clock::now().as_second();
    assert!(
        (now - 600..=now).contains(&sent),
        "{sent} is not now: {now}"
    );
    assert_eq!(got.headers["webhook-signature"], signature_by_python(&got));
}

#[tokio::test]
async fn a_webhook_that_fails_is_tried_again_under_the_same_id_until_it_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    // More failures than what need not arrive is given: a red is never given up. A redirection is a failure.
    let receiver = Receiver::answering(&[500, 503, 302, 429, 200]);
    let hooks = webhooks(folder.path(), &webhook(&receiver.url, ""));
    let store = Arc::new(Store::open(&folder.path().join("state")).unwrap());
    let dispatcher = Dispatcher::start(&hooks, &quick(), Delivered::of(Arc::clone(&store)));
    let red = alert("5", "toc/5/red/1");
    offer(&dispatcher, &red);
    let identity = red_fires("toc/5/red/1");
    let is_taken = || {
        let noted = store.is_noted(
            identity,
            Some(&receiver.url),
            Some(DeliveryOutcome::Delivered),
        );
        noted.unwrap()
    };
    eventually("taken", is_taken).await;
    offer(&dispatcher, &red);
    assert_eq!(dispatcher.close(Duration::from_secs(20)).await, Some(0));
    let got = receiver.got();
    assert_eq!(got.len(), 5, "it is sent again after it was taken");
    let ids: BTreeSet<&str> = (got.iter())
        .map(|one| one.headers["webhook-id"].as_str())
        .collect();
    assert_eq!(ids, BTreeSet::from(["toc/5/red/1/red/firing"]));
    assert_eq!(store.attempts(identity, &receiver.url).unwrap(), 5);
}

#[tokio::test]
async fn a_receiver_that_never_answers_holds_no_other_ones_red() {
    let folder = tempfile::tempdir().unwrap();
    let (hanging, other) = (Receiver::answering(&[0]), Receiver::answering(&[200]));
    let tables = [
        webhook(&hanging.url, "timeout = \"1h\""),
        webhook(&other.url, "timeout = \"1h\""),
    ];
    let hooks = webhooks(folder.path(), &tables.concat());
    let dispatcher = Dispatcher::start(&hooks, &quick(), Delivered::default());
    for number in 0..20 {
        let benchmark = format!("b{number}");
        offer(
            &dispatcher,
            &alert(&benchmark, &format!("{benchmark}/red/1")),
        );
    }
    eventually("that the hanging one is at work", || {
        !hanging.got().is_empty()
    })
    .await;
    eventually("the other one's", || other.got().len() == 20).await;
    // Cut off: the hanging one has an hour.
    assert_eq!(dispatcher.close(Duration::from_millis(100)).await, None);
}

#[tokio::test]
async fn a_webhook_ends_at_its_timeout_and_says_why_it_cannot_be_sent() {
    let folder = tempfile::tempdir().unwrap();
    let hanging = Receiver::answering(&[0]);
    let free = free_address();
    let tables = [
        webhook(&hanging.url, "timeout = \"300ms\""),
        webhook(&format!("http://{free}/"), ""),
    ];
    let hooks = webhooks(folder.path(), &tables.concat());
    let alert = alert("5", "k");
    assert_eq!(
        deliver::run(&hooks[0], &alert, 1).await,
        HookOutcome::TimedOut
    );
    let refused = deliver::run(&hooks[1], &alert, 1).await;
    assert!(
        matches!(&refused, HookOutcome::NotStarted(why) if why.contains("refused")),
        "{refused:?}"
    );
    std::fs::write(folder.path().join("secret"), "guess me").unwrap();
    let unsigned = deliver::run(&hooks[0], &alert, 1).await;
    assert!(
        matches!(&unsigned, HookOutcome::NotStarted(why) if why.contains("whsec_")),
        "{unsigned:?}"
    );
    assert_eq!(hanging.got().len(), 1, "nothing goes out unsigned");
}

#[tokio::test]
async fn a_webhook_is_sent_the_benchmarks_and_levels_that_it_asks_for() {
    let folder = tempfile::tempdir().unwrap();
    let (one, all) = (Receiver::answering(&[200]), Receiver::answering(&[200]));
    let tables = [
        webhook(&one.url, "benchmarks = [\"5\"]"),
        webhook(&all.url, "levels = [\"red\"]"),
        webhook(&format!("{}&y", all.url), "levels = [\"yellow\"]"),
    ];
    let hooks = webhooks(folder.path(), &tables.concat());
    let dispatcher = Dispatcher::start(&hooks, &quick(), Delivered::default());
    offer(&dispatcher, &alert("4", "4/red/1"));
    offer(&dispatcher, &alert("5", "5/red/1"));
    assert_eq!(dispatcher.close(Duration::from_secs(20)).await, Some(0));
    let keys = |receiver: &Receiver| -> BTreeSet<String> {
        let got = receiver.got();
        got.iter()
            .map(|one| one.headers["webhook-id"].clone())
            .collect()
    };
    assert_eq!(
        keys(&one),
        BTreeSet::from(["5/red/1/red/firing".to_owned()])
    );
    assert_eq!(all.got().len(), 2);
    assert_eq!(keys(&all).len(), 2);
}

/// An authority of our own and a receiver at `localhost` that has a certificate of it.
struct Secured {
    authority: String,
    receiver: Receiver,
}

impl Secured {
    fn answering(status: u16) -> Self {
        let certified = Certified::localhost();
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let config = rustls::ServerConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_no_client_auth()
            .with_single_cert(
                vec![certified.own.der().clone()],
                PrivateKeyDer::try_from(certified.key.serialize_der()).unwrap(),
            )
            .unwrap();
        let config = Arc::new(config);
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let got = Arc::new(Mutex::new(Vec::new()));
        let seen = Arc::clone(&got);
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                let mut stream = stream.unwrap();
                let mut server = rustls::ServerConnection::new(Arc::clone(&config)).unwrap();
                // Whoever does not trust us hangs up.
                if server.complete_io(&mut stream).is_err() || server.is_handshaking() {
                    continue;
                }
                let mut tls = rustls::StreamOwned::new(server, stream);
                seen.lock().unwrap().push(request(&mut tls));
                let answer = format!("HTTP/1.1 {status} Said\r\ncontent-length: 2\r\n\r\nok");
                tls.write_all(answer.as_bytes()).unwrap();
            }
        });
        let url = format!("https://localhost:{port}/alerts");
        Self {
            authority: certified.authority,
            receiver: Receiver { url, got },
        }
    }
}

#[tokio::test]
#[cfg_attr(not(has_python3), ignore = "python3 was not found by build.rs")]
async fn an_alert_goes_over_tls_to_who_can_prove_its_name_by_a_trusted_authority_and_to_nobody_else()
 {
    let folder = tempfile::tempdir().unwrap();
    let secured = Secured::answering(204);
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("ca.pem", &secured.authority);
    write("other.pem", &Secured::answering(204).authority);
    write("empty.pem", "");
    let url = &secured.receiver.url;
    let with = |url: &str, more: &str| webhooks(folder.path(), &webhook(url, more)).remove(0);
    let send =
        |hook: HookConfig| async move { deliver::run(&hook, &alert("5", "5/red/1"), 1).await };

    assert_eq!(
        send(with(url, "ca_file = \"ca.pem\"")).await,
        HookOutcome::Done
    );
    let got = secured.receiver.got();
    assert_eq!(
        (got.len(), got[0].line.as_str()),
        (1, "POST /alerts HTTP/1.1")
    );
    assert!(got[0].headers["webhook-signature"].starts_with("v1,"));
    assert_eq!(
        got[0].headers["webhook-signature"],
        signature_by_python(&got[0])
    );

    let by_address = url.replace("localhost", "127.0.0.1");
    for (hook, why) in [
        (with(url, "ca_file = \"other.pem\""), "no TLS"),
        (with(&by_address, "ca_file = \"ca.pem\""), "no TLS"),
        (
            with(url, "ca_file = \"empty.pem\""),
            "it holds no certificate",
        ),
        (with(url, "ca_file = \"absent.pem\""), "ca_file"),
        // The machine's own authorities.
        (with(url, ""), ""),
    ] {
        let outcome = send(hook).await;
        assert!(
            matches!(&outcome, HookOutcome::NotStarted(said) if said.contains(why)),
            "{why}: {outcome:?}"
        );
    }
    assert_eq!(secured.receiver.got().len(), 1);
}

fn ended(mut alert: Alert, time: &str) -> Alert {
    alert.state = AlertState::Resolved.into();
    alert.event.time = time.parse().unwrap();
    alert
}

const KEY: &str = "5/red/2017-06-06T17:00:00Z";

#[tokio::test]
async fn alertmanager_gets_a_list_with_the_same_labels_when_an_alert_fires_and_when_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let receiver = Receiver::answering(&[200]);
    let table = format!(
        "[[webhook]]\nurl = \"{}\"\nformat = \"alertmanager\"\n",
        receiver.url
    );
    let hook = webhooks(folder.path(), &table).remove(0);
    let end = ended(alert("5", KEY), "2017-06-09T05:00:00Z");
    for alert in [&alert("5", KEY), &end] {
        assert_eq!(deliver::run(&hook, alert, 1).await, HookOutcome::Done);
    }
    let got = receiver.got();
    assert!(!got[0].headers.contains_key("webhook-signature"));
    let bodies = got
        .iter()
        .map(|one| serde_json::from_str(&one.body).unwrap());
    let bodies: Vec<serde_json::Value> = bodies.collect();
    let (fires, ends) = (&bodies[0][0], &bodies[1][0]);
    assert_eq!(fires["labels"], ends["labels"]);
    assert_eq!(fires["labels"]["benchmark"], "5");
    assert_eq!(fires["labels"]["level"], "red");
    assert_eq!(fires["labels"]["status"], "Actual");
    for one in [fires, ends] {
        assert_eq!(one["startsAt"], "2017-06-06T17:00:00Z");
    }
    // Without an end it would be over five minutes later.
    assert_eq!(fires["endsAt"], "2018-06-06T17:00:00Z");
    assert_eq!(ends["endsAt"], "2017-06-09T05:00:00Z");
}

#[tokio::test]
async fn what_alertmanager_has_taken_is_sent_to_it_again_each_minute_for_as_long_as_it_is_in_force()
{
    let folder = tempfile::tempdir().unwrap();
    let receiver = Receiver::answering(&[200]);
    let table = format!(
        "[[webhook]]\nurl = \"{}\"\nformat = \"alertmanager\"\n",
        receiver.url
    );
    let hooks = webhooks(folder.path(), &table);
    let dispatcher = Dispatcher::start(&hooks, &quick(), Delivered::default());
    let (taken, other) = (alert("5", KEY), alert("6", "6/red/2017-06-06T17:00:00Z"));
    offer(&dispatcher, &taken);
    eventually("that it is taken", || receiver.got().len() == 1).await;
    for round in 2..4 {
        // Before a minute has gone nothing is.
        dispatcher.repeat(|| Box::new([&taken, &other].into_iter()));
        tokio::time::pause();
        tokio::time::advance(Duration::from_secs(61)).await;
        tokio::time::resume();
        dispatcher.repeat(|| Box::new([&taken, &other].into_iter()));
        eventually("that it is sent again", || receiver.got().len() == round).await;
        // The answer is read before the next one is due.
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    let bodies = receiver.got();
    let bodies = bodies.iter().map(|one| serde_json::from_str(&one.body));
    let bodies: Vec<serde_json::Value> = bodies.map(Result::unwrap).collect();
    assert_eq!(
        bodies[1], bodies[0],
        "the same, and not what it has not taken"
    );
    assert_eq!(bodies[2], bodies[0]);
    // A repetition that was under way may have come after the end.
    let end = ended(taken.clone(), "2017-06-09T05:00:00Z");
    offer(&dispatcher, &end);
    eventually("that the end is taken", || receiver.got().len() == 4).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    tokio::time::pause();
    tokio::time::advance(Duration::from_secs(61)).await;
    tokio::time::resume();
    dispatcher.repeat(|| Box::new(std::iter::empty()));
    eventually("that the end is sent again", || receiver.got().len() == 5).await;
    let got = receiver.got();
    assert_eq!(got[4].body, got[3].body);
    assert_eq!(dispatcher.close(Duration::from_secs(5)).await, Some(0));
}

#[tokio::test]
async fn the_end_of_a_red_that_alertmanager_did_not_take_comes_after_the_next_red_too() {
    let folder = tempfile::tempdir().unwrap();
    let receiver = Receiver::answering(&[200, 503, 200]);
    let table = format!(
        "[[webhook]]\nurl = \"{}\"\nformat = \"alertmanager\"\n",
        receiver.url
    );
    let hooks = webhooks(folder.path(), &table);
    let retry = Retry {
        first_delay: Duration::from_millis(300),
        ..quick()
    };
    let dispatcher = Dispatcher::start(&hooks, &retry, Delivered::default());
    let count = |count: usize| move |receiver: &Receiver| receiver.got().len() >= count;
    offer(&dispatcher, &alert("5", KEY));
    eventually("the first", || count(1)(&receiver)).await;
    offer(&dispatcher, &ended(alert("5", KEY), "2017-06-09T05:00:00Z"));
    eventually("its end, refused", || count(2)(&receiver)).await;
    offer(&dispatcher, &alert("5", "5/red/2017-06-09T06:00:00Z"));
    eventually("the next, and the end", || count(4)(&receiver)).await;
    assert_eq!(dispatcher.close(Duration::from_secs(20)).await, Some(0));
    let ends = receiver
        .got()
        .into_iter()
        .filter(|one| one.body.contains("2017-06-09T05:00:00Z"));
    assert_eq!(ends.count(), 2);
}

#[tokio::test]
#[cfg_attr(not(has_alertmanager), ignore = "there is no prometheus-alertmanager")]
async fn a_real_alertmanager_has_the_alert_in_force_until_its_end_comes() {
    let folder = tempfile::tempdir().unwrap();
    let address = free_address().to_string();
    let config = "route: {receiver: nobody}\nreceivers: [{name: nobody}]\n";
    std::fs::write(folder.path().join("am.yml"), config).unwrap();
    let mut program = Command::new("prometheus-alertmanager")
        .args([
            "--config.file=am.yml",
            "--storage.path=am",
            "--cluster.listen-address=",
        ])
        .arg(format!("--web.listen-address={address}"))
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    eventually("that it listens", || {
        std::net::TcpStream::connect(&address).is_ok()
    })
    .await;
    let table = format!(
        "[[webhook]]\nurl = \"http://{address}/api/v2/alerts\"\nformat = \"alertmanager\"\n"
    );
    let hook = webhooks(folder.path(), &table).remove(0);
    let in_force = || {
        let mut stream = std::net::TcpStream::connect(&address).unwrap();
        let ask = "GET /api/v2/alerts?active=true HTTP/1.0\r\nHost: localhost\r\n\r\n";
        stream.write_all(ask.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let body = answer.split_once("\r\n\r\n").unwrap().1.to_owned();
        let alerts: serde_json::Value = serde_json::from_str(&body).unwrap();
        let alerts = alerts.as_array().unwrap().clone();
        alerts
            .into_iter()
            .map(|one| one["labels"]["key"].clone())
            .collect::<Vec<_>>()
    };
    // It takes what is in force by its own clock.
    let now = slipwatch::runtime::clock::now();
    let mut fires = alert("5", &format!("5/red/{now}"));
    fires.event.time = now;
    let end = ended(fires.clone(), &now.to_string());
    let outcome = deliver::run(&hook, &fires, 1).await;
    let held = in_force();
    let ended = deliver::run(&hook, &end, 1).await;
    eventually("that it is over", || in_force().is_empty()).await;
    program.kill().unwrap();
    program.wait().unwrap();
    assert_eq!((outcome, ended), (HookOutcome::Done, HookOutcome::Done));
    assert_eq!(held, [format!("5/red/{now}")]);
}

#[test]
fn a_config_says_what_is_wrong_with_a_webhook() {
    for (table, what) in [
        (
            webhook("ftp://example.org/", ""),
            "is neither http nor https",
        ),
        (webhook("/path", ""), "is neither http nor https"),
        (
            webhook("http://a/", "ca_file = \"ca.pem\""),
            "webhook.ca_file is not used without TLS",
        ),
        (webhook("http://me:secret@example.org/", ""), "password"),
        (
            webhook("http://a/", "benchmarks = []"),
            "webhook.benchmarks is empty",
        ),
        (
            webhook("http://a/", "levels = [\"rot\"]"),
            "webhook.levels has \"rot\"",
        ),
        (
            webhook("http://a/", "").repeat(2),
            "two webhooks \"http://a/\"",
        ),
        (webhook("http://a/", "format = \"xml\""), "webhook.format"),
        (
            "[[webhook]]\nurl = \"http://a/\"\n".to_owned(),
            "webhook.secret_file",
        ),
    ] {
        let refused = config::parse(&text(&table), Path::new("site.toml")).expect_err(&table);
        assert!(refused.to_string().contains(what), "{what}: {refused}");
    }
}

#[test]
fn hook_test_sends_a_drill_to_a_webhook_and_check_reads_its_secret() {
    let folder = tempfile::tempdir().unwrap();
    let receiver = Receiver::answering(&[200, 401]);
    let table = webhook(&receiver.url, "name = \"control room\"");
    std::fs::write(folder.path().join("site.toml"), text(&table)).unwrap();
    let ask = |words: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
            .args(words)
            .current_dir(folder.path())
            .output()
            .unwrap();
        let said = [&output.stdout[..], &output.stderr].concat();
        (
            output.status.code(),
            String::from_utf8_lossy(&said).into_owned(),
        )
    };
    let (_, said) = ask(&["check", "--config-only", "site.toml"]);
    assert!(said.contains("cannot read the secret file"), "{said}");
    std::fs::write(folder.path().join("secret"), SECRET).unwrap();
    let (code, said) = ask(&["hook", "test", "--config", "site.toml"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("control room: done"), "{said}");
    let body: serde_json::Value = serde_json::from_str(&receiver.got()[0].body).unwrap();
    assert_eq!(body["status"], "Test");
    let (code, said) = ask(&["hook", "test", "--config", "site.toml"]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("answered with status 401"), "{said}");
}

/// A daemon at work over a file that is growing; killed with the test.
struct Watching(std::process::Child);

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Watching {
    fn over(folder: &Path) -> Self {
        let log = std::fs::File::create(folder.join("log")).unwrap();
        let daemon = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
            .args(["run", "site.toml"])
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(log)
            .spawn();
        Self(daemon.unwrap())
    }
}

/// What is unknown before the first reading is dated by the clock, and the first reading may be older than that.
#[tokio::test(flavor = "multi_thread")]
async fn alertmanager_gets_no_end_before_its_beginning_where_the_first_reading_is_old() {
    for dies_between in [false, true] {
        let receiver = Receiver::answering(&[200]);
        let folder = tempfile::tempdir().unwrap();
        let site = text(&format!(
            "[[benchmark]]\nid = \"P1\"\nsource = \"logger\"\n\
             [[webhook]]\nurl = \"{}\"\nformat = \"alertmanager\"\nlevels = [\"unknown\"]\n",
            receiver.url
        ));
        std::fs::write(folder.path().join("site.toml"), site).unwrap();
        let mut daemon = Watching::over(folder.path());
        let taken = || -> Vec<serde_json::Value> {
            let bodies = receiver.got().into_iter();
            bodies
                .map(|one| serde_json::from_str::<serde_json::Value>(&one.body).unwrap()[0].clone())
                .collect()
        };
        eventually("it fires", || taken().len() == 1).await;
        if dies_between {
            // The answer is noted after the request has come.
            tokio::time::sleep(Duration::from_millis(500)).await;
            drop(daemon);
            daemon = Watching::over(folder.path());
        }
        let now = slipwatch::runtime::clock::now();
        let rows: Vec<String> = (0..20)
            .map(|row| {
                let time = now - jiff::SignedDuration::from_mins(10 * (22 - row));
                format!("{time},{row}\n")
            })
            .collect();
        let csv = format!("time,P1_displacement_mm\n{}", rows.concat());
        std::fs::write(folder.path().join("slope.csv"), csv).unwrap();
        eventually("it ends", || taken().len() == 2).await;
        drop(daemon);
        let taken = taken();
        let (fires, ends) = (&taken[0], &taken[1]);
        assert_eq!(fires["labels"], ends["labels"]);
        assert_eq!(fires["startsAt"], ends["startsAt"], "{taken:?}");
        let time = |one: &serde_json::Value| {
            let text = one.as_str().unwrap();
            text.parse::<jiff::Timestamp>().unwrap()
        };
        let (begins, ends) = (time(&fires["startsAt"]), time(&ends["endsAt"]));
        assert!(begins <= ends, "{taken:?}");
        assert!(now.duration_since(begins).abs() < jiff::SignedDuration::from_mins(5));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn heartbeats_come_for_as_long_as_the_site_is_watched_and_no_longer() {
    let taking = Receiver::answering(&[200]);
    let refusing = Receiver::answering(&[500]);
    let folder = tempfile::tempdir().unwrap();
    let heartbeat = |url: &str| format!("[[heartbeat]]\nurl = \"{url}\"\nevery = \"1s\"\n");
    let listen = free_address();
    let tables = heartbeat(&taking.url) + &heartbeat(&refusing.url);
    let site = text(&tables).replace("[[source]]", &format!("listen = \"{listen}\"\n[[source]]"));
    std::fs::write(folder.path().join("site.toml"), site).unwrap();
    let now = slipwatch::runtime::clock::now();
    let rows: Vec<String> = (0..20)
        .map(|row| {
            format!(
                "{},{row}\n",
                now - jiff::SignedDuration::from_hours(20 - row)
            )
        })
        .collect();
    let csv = format!("time,P1_displacement_mm\n{}", rows.concat());
    std::fs::write(folder.path().join("slope.csv"), csv).unwrap();
    let daemon = Watching::over(folder.path());
    eventually("both are asked", || {
        taking.got().len() >= 3 && refusing.got().len() >= 3
    })
    .await;
    assert!(taking.got()[0].line.starts_with("GET /alerts?x=1 "));
    // The receiver has a request before the daemon has its answer and counts it.
    eventually("both are counted", || {
        let mut stream = std::net::TcpStream::connect(listen).unwrap();
        let request =
            format!("GET /metrics HTTP/1.1\r\nHost: {listen}\r\nConnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        let mut metrics = String::new();
        stream.read_to_string(&mut metrics).unwrap();
        let count = |name: &str| -> u64 {
            let line = metrics.lines().find(|line| line.starts_with(name)).unwrap();
            line.split(' ').next_back().unwrap().parse().unwrap()
        };
        count("slipwatch_heartbeats_total ") >= 3
            && count("slipwatch_heartbeats_failed_total ") >= 3
    })
    .await;
    let log = std::fs::read_to_string(folder.path().join("log")).unwrap();
    assert!(
        log.contains("a heartbeat has not been taken") && log.contains("status 500"),
        "{log}"
    );
    // The state cannot be written any more: the readings are not safe, and others are to look.
    std::fs::rename(folder.path().join("state"), folder.path().join("gone")).unwrap();
    let mut before = usize::MAX;
    eventually("heartbeats end", || {
        let count = taking.got().len();
        std::thread::sleep(Duration::from_millis(2500));
        before = taking.got().len();
        before == count
    })
    .await;
    drop(daemon);
    assert_eq!(taking.got().len(), before);
}

/// A row of a file of velocities, mm/day.
fn row(now: jiff::Timestamp, velocity: f64) -> String {
    format!("{now},{velocity}\n")
}

/// By the labels that it began with.
#[tokio::test(flavor = "multi_thread")]
async fn alertmanager_gets_the_end_of_an_orange_that_a_red_supersedes() {
    let receiver = Receiver::answering(&[200]);
    let folder = tempfile::tempdir().unwrap();
    let site = text(&format!(
        "[alert]\nevacuation_time = \"3h\"\n\
         [[alert.threshold]]\nlevel = \"orange\"\nvelocity = \"20 mm/day\"\n\
         [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n\
         [[webhook]]\nurl = \"{}\"\nformat = \"alertmanager\"\nlevels = [\"orange\", \"red\"]\n",
        receiver.url
    ));
    std::fs::write(folder.path().join("site.toml"), site).unwrap();
    let now = slipwatch::runtime::clock::now();
    let mut csv = "time,5_velocity_mm_per_day\n".to_owned();
    for minutes in [55, 45, 35, 25, 15] {
        csv += &row(now - jiff::SignedDuration::from_mins(minutes), 1.0);
    }
    let file = folder.path().join("slope.csv");
    std::fs::write(&file, &csv).unwrap();
    let _daemon = Watching::over(folder.path());
    let log = || std::fs::read_to_string(folder.path().join("log")).unwrap();
    eventually("the past", || log().contains("caught up")).await;
    let append = |text: &str| {
        let file = std::fs::File::options().append(true).open(&file);
        file.unwrap().write_all(text.as_bytes()).unwrap();
    };
    append(&row(now - jiff::SignedDuration::from_mins(5), 30.0));
    eventually("the orange", || receiver.got().len() == 1).await;
    append(&row(now, 80.0));
    eventually("the red", || receiver.got().len() == 2).await;
    let body = |number: usize| -> Vec<serde_json::Value> {
        serde_json::from_str(&receiver.got()[number].body).unwrap()
    };
    let (orange, red) = (body(0), body(1));
    assert_eq!((orange.len(), red.len()), (1, 2), "{red:?}");
    assert_eq!(red[0]["labels"]["level"], "red");
    assert_eq!(red[1]["labels"], orange[0]["labels"]);
    let time =
        |value: &serde_json::Value| -> jiff::Timestamp { value.as_str().unwrap().parse().unwrap() };
    assert!(time(&red[0]["endsAt"]) > now, "{red:?}");
    assert_eq!(time(&red[1]["endsAt"]), time(&red[0]["startsAt"]));
    assert_eq!(red[1]["startsAt"], orange[0]["startsAt"]);
}
