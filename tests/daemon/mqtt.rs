//! Readings from a real Mosquitto: none is lost that was not acknowledged.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::wildcard_enum_match_arm,
    reason = "a test fails by panicking"
)]

use crate::certificates::Certified;
use crate::eventually::eventually;
use crate::site::free_address;
use rumqttc::{AsyncClient, Event, MqttOptions, Packet, QoS};
use slipwatch::config::{self, Config};
use slipwatch::monitor::Input;
use slipwatch::runtime::mqtt::{ReceivedMessage, Subscription, follow};
use slipwatch::runtime::service_faults::ServiceFaults;
use slipwatch::runtime::shutdown::{self, Trigger};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tempfile::TempDir;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::sync::mpsc::{self, Receiver};
use tokio::task::JoinHandle;

const LIMIT: Duration = Duration::from_secs(30);

/// A broker of our own, on a port of its own.
pub(crate) struct Mosquitto {
    program: PathBuf,
    pub(crate) folder: TempDir,
    pub(crate) port: u16,
    pub(crate) process: Child,
}

impl Mosquitto {
    pub(crate) fn start() -> Self {
        Self::start_with(|_| String::new())
    }

    /// With more in its config.
    pub(crate) fn start_with(more: impl Fn(&Path) -> String) -> Self {
        let installed = [
            "/usr/sbin/mosquitto",
            "/usr/bin/mosquitto",
            "/usr/local/sbin/mosquitto",
        ];
        let named = std::env::var_os("MOSQUITTO").map(PathBuf::from);
        let mut programs = named.into_iter().chain(installed.map(PathBuf::from));
        let program = programs.find(|one| one.exists());
        let program = program.expect("Mosquitto, installed or named by MOSQUITTO");
        let folder = tempfile::tempdir().unwrap();
        let more = more(folder.path());
        let port = free_address().port();
        let conf = folder.path().join("mosquitto.conf");
        let text = format!(
            "listener {port} 127.0.0.1\nallow_anonymous true\npersistence true\n\
             persistence_location {}/\nuser root\n{more}",
            folder.path().display()
        );
        std::fs::write(conf, text).unwrap();
        let process = spawn(&program, &folder);
        Self {
            program,
            folder,
            port,
            process,
        }
    }

    /// With a second listener, at the port that is returned, which proves its name by the `authority.pem` in its folder
    /// and not by the `stranger.pem` there.
    pub(crate) fn start_secured() -> (Self, u16) {
        let (certified, stranger) = (Certified::localhost(), Certified::localhost());
        let port = free_address().port();
        let broker = Self::start_with(|folder| {
            let place = |name: &str, text: String| {
                let file = folder.join(name);
                std::fs::write(&file, text).unwrap();
                file.display().to_string()
            };
            place("authority.pem", certified.authority.clone());
            place("stranger.pem", stranger.authority.clone());
            format!(
                "listener {port} 127.0.0.1\nallow_anonymous true\ncertfile {}\nkeyfile {}\n",
                place("own.pem", certified.own.pem()),
                place("own.key", certified.key.serialize_pem())
            )
        });
        (broker, port)
    }

    /// Ends it as a reboot would, and starts it again.
    fn restart(&mut self) {
        let id = self.process.id().to_string();
        assert!(Command::new("kill").arg(id).status().unwrap().success());
        self.process.wait().unwrap();
        self.start_again();
    }

    /// Starts it after its end.
    pub(crate) fn start_again(&mut self) {
        self.process = spawn(&self.program, &self.folder);
    }

    /// Publishes and waits until the broker has it all.
    async fn publish(&self, payloads: &[String]) {
        self.publish_as(payloads, false).await;
    }

    /// The same; where it is retained the broker keeps the last one for whoever subscribes.
    async fn publish_as(&self, payloads: &[String], is_retained: bool) {
        let mut options = MqttOptions::new("writer", "127.0.0.1", self.port);
        options.set_max_packet_size(1 << 20, 1 << 20);
        let (client, mut connection) = AsyncClient::new(options, 100);
        for payload in payloads {
            client
                .publish(
                    "site/5/displacement",
                    QoS::AtLeastOnce,
                    is_retained,
                    payload.as_bytes(),
                )
                .await
                .unwrap();
        }
        let mut taken = 0;
        while taken < payloads.len() {
            match tokio::time::timeout(LIMIT, connection.poll())
                .await
                .unwrap()
            {
                Ok(Event::Incoming(Packet::PubAck(_))) => taken += 1,
                Ok(_) => {}
                // The broker is not up yet.
                Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
            }
        }
    }
}

fn spawn(program: &Path, folder: &TempDir) -> Child {
    Command::new(program)
        .arg("-c")
        .arg(folder.path().join("mosquitto.conf"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Of a site that reaches its broker at this port.
fn config_at(port: u16) -> Config {
    config_of(&format!("url = \"mqtt://127.0.0.1:{port}\""))
}

/// Of a site with these lines of its broker.
fn config_of(lines: &str) -> Config {
    let text = format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"radio\"\n\
         kind = \"mqtt\"\n{lines}\ntopic = \"site/+/displacement\"\n"
    );
    config::parse(&text, Path::new("site.toml")).unwrap()
}

/// A daemon's source at work.
struct Source {
    deliveries: Receiver<ReceivedMessage>,
    stop: Trigger,
    task: JoinHandle<()>,
}

impl Source {
    fn start(broker: &Mosquitto) -> Self {
        Self::start_at(broker.port)
    }

    fn start_at(port: u16) -> Self {
        Self::of(config_at(port))
    }

    fn of(config: Config) -> Self {
        Self::of_session(config, "slipwatch-toc-radio")
    }

    fn of_session(config: Config, id: &str) -> Self {
        Self::of_subscription(config, Subscription::new(id.to_owned(), false))
    }

    fn of_subscription(config: Config, subscription: Subscription) -> Self {
        let (sender, deliveries) = mpsc::channel(8);
        let (stop, stopped) = shutdown::pair();
        let radio = config.brokers[0].clone();
        let faults = ServiceFaults::default();
        let follow = follow(
            radio,
            config.benchmarks,
            sender,
            faults,
            subscription,
            stopped,
        );
        let task = tokio::spawn(follow);
        Self {
            deliveries,
            stop,
            task,
        }
    }

    async fn next(&mut self) -> ReceivedMessage {
        let came = tokio::time::timeout(LIMIT, self.deliveries.recv()).await;
        came.expect("in time").expect("a delivery")
    }

    async fn end(self) {
        self.stop.request();
        self.task.await.unwrap();
    }
}

fn message(day: usize) -> String {
    format!(r#"{{"benchmark":"5","time":"2017-06-{day:02}T00:00:00Z","value":{day},"unit":"mm"}}"#)
}

fn values(delivery: &ReceivedMessage) -> Vec<f64> {
    let value = |input: &Input| match input {
        Input::Reading { reading, .. } => reading.value,
        Input::Sample { .. }
        | Input::Missing { .. }
        | Input::Trouble { .. }
        | Input::Notice(_)
        | Input::Settings(_)
        | Input::Order(_)
        | Input::Found(_)
        | Input::Tick => f64::NAN,
    };
    delivery
        .arrivals
        .iter()
        .map(|one| value(&one.input))
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn what_was_acknowledged_does_not_come_again_and_what_was_not_does() {
    let broker = Mosquitto::start();
    // The session must be there before anything is written.
    let mut first = Source::start(&broker);
    tokio::time::sleep(Duration::from_millis(1500)).await;
    broker
        .publish(&(1..=5).map(message).collect::<Vec<_>>())
        .await;
    for day in [1.0, 2.0] {
        let delivery = first.next().await;
        assert_eq!(values(&delivery), [day]);
        delivery.receipt.acknowledge().await.unwrap();
    }
    // Taken, and the daemon ends before it is durable.
    assert_eq!(values(&first.next().await), [3.0]);
    tokio::time::sleep(Duration::from_millis(500)).await;
    first.end().await;
    broker.publish(&[message(6)]).await;
    let mut second = Source::start(&broker);
    let mut came = Vec::new();
    while came.len() < 4 {
        let delivery = second.next().await;
        came.extend(values(&delivery));
        delivery.receipt.acknowledge().await.unwrap();
    }
    assert_eq!(came, [3.0, 4.0, 5.0, 6.0]);
    second.end().await;
}

/// What a message says of readings that may be missing.
fn possible_gap(delivery: &ReceivedMessage) -> Option<&str> {
    delivery.arrivals.iter().find_map(|one| match &one.input {
        Input::Trouble { kind, text } if kind == "possible-gap" => Some(text.as_str()),
        _ => None,
    })
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_session_that_the_broker_has_not_kept_is_a_possible_gap_and_one_that_it_has_is_none() {
    let broker = Mosquitto::start();
    let known = |client: &str| Subscription::new(client.to_owned(), true);
    let mut first = Source::start(&broker);
    tokio::time::sleep(Duration::from_millis(1500)).await;
    broker.publish(&[message(1)]).await;
    let delivery = first.next().await;
    assert_eq!(values(&delivery), [1.0]);
    delivery.receipt.acknowledge().await.unwrap();
    tokio::time::sleep(Duration::from_millis(500)).await;
    first.end().await;
    broker.publish(&[message(2)]).await;
    let config = || config_at(broker.port);
    let mut kept = Source::of_subscription(config(), known("slipwatch-toc-radio"));
    assert_eq!(values(&kept.next().await), [2.0]);
    kept.end().await;
    let mut lost = Source::of_subscription(config(), known("slipwatch-toc-lost"));
    let delivery = lost.next().await;
    let text = possible_gap(&delivery).unwrap();
    assert!(
        text.contains("source radio: the broker has not kept"),
        "{text}"
    );
    lost.end().await;
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_site_that_is_renamed_keeps_its_session_and_a_source_that_is_renamed_is_a_possible_gap() {
    let broker = Mosquitto::start();
    let mut daemon = Daemon::start(&broker);
    let is_noted = |daemon: &Daemon| {
        let store = slipwatch::store::Store::look(&daemon.0.path().join("state"));
        store.is_ok_and(|store| !store.broker_sessions().unwrap().is_empty())
    };
    daemon.wait("the session is noted", is_noted);
    daemon.stop();
    broker.publish(&[message(1)]).await;
    daemon.restart_as("name = \"Toc\"", "name = \"Toc, west\"");
    daemon.wait("what was kept comes", |daemon| daemon.readings() == 1);
    daemon.stop();
    assert!(
        !daemon.text("log").contains("kept"),
        "{}",
        daemon.text("log")
    );
    daemon.restart_as("id = \"radio\"", "id = \"wireless\"");
    daemon.wait("what may be missing is said", |daemon| {
        let events = daemon.events();
        events.contains("possible-gap") && events.contains("radio (client")
    });
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_message_that_the_broker_keeps_does_not_undo_a_correction() {
    let broker = Mosquitto::start();
    let mut daemon = Daemon::start(&broker);
    daemon.wait("at work", |daemon| daemon.text("log").contains("connected"));
    let of_day = |day: usize, value: f64| {
        let text = message(day);
        text.replace(&format!(":{day},"), &format!(":{value},"))
    };
    tokio::time::sleep(Duration::from_millis(1500)).await;
    broker.publish(&[of_day(1, 1.0), of_day(2, 2.0)]).await;
    daemon.wait("both are read", |daemon| daemon.readings() == 2);
    broker.publish_as(&[of_day(2, 900.0)], true).await;
    daemon.wait("a wrong one", |daemon| daemon.readings() == 3);
    broker.publish(&[of_day(2, 2.5)]).await;
    daemon.wait("it is corrected", |daemon| daemon.readings() == 4);
    daemon.stop();
    daemon.restart_as("", "");
    tokio::time::sleep(Duration::from_secs(3)).await;
    broker.publish(&[of_day(3, 3.0)]).await;
    daemon.wait("the next one", |daemon| daemon.readings() == 5);
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(daemon.newest_of("2017-06-02T00:00:00Z"), Some(2.5));
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_red_by_a_broker_does_not_wait_until_a_long_file_has_been_read() {
    let broker = Mosquitto::start();
    let daemon = Daemon::start_with(
        &broker,
        "[[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n\
         [[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"100 mm\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"-c\", \"echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\"]\n",
    );
    daemon.wait("caught up", |daemon| {
        daemon.text("log").contains("caught up")
    });
    let now = slipwatch::runtime::clock::now();
    let of = |minutes: i64, value: f64| {
        let time = now - jiff::SignedDuration::from_mins(minutes);
        format!(r#"{{"benchmark":"5","time":"{time}","value":{value},"unit":"mm"}}"#)
    };
    broker.publish(&[of(20, 0.0), of(10, 0.1)]).await;
    daemon.wait("both are read", |daemon| daemon.readings() == 2);
    let rows: i64 = 120_000;
    let text = (0..rows).map(|row| {
        let time = now - jiff::SignedDuration::from_mins(rows - row);
        format!("{time},{}\n", row % 7)
    });
    let text = format!("time,9_displacement_mm\n{}", text.collect::<String>());
    std::fs::write(daemon.0.path().join("9.csv"), text).unwrap();
    daemon.wait("the file is being read", |daemon| daemon.readings() > 2);
    broker.publish(&[of(0, 130.0)]).await;
    daemon.wait("the red", |daemon| {
        daemon.text("notified").contains("5/red/")
    });
    let read = daemon.readings();
    assert!(i64::try_from(read).unwrap() < rows, "{read}");
}

/// Publishes a message of 17 MiB, and a reading after it.
async fn publish_long_and_next(broker: &Mosquitto) -> tokio::task::JoinHandle<()> {
    let long = "x".repeat(17 << 20);
    let mut options = MqttOptions::new("long writer", "127.0.0.1", broker.port);
    options.set_max_packet_size(32 << 20, 32 << 20);
    let (client, mut connection) = AsyncClient::new(options, 4);
    for payload in [long, message(1)] {
        client
            .publish("site/5/displacement", QoS::AtLeastOnce, false, payload)
            .await
            .unwrap();
    }
    tokio::spawn(async move {
        let _client = client;
        while connection.poll().await.is_ok() {}
    })
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_daemon_counts_a_message_that_is_too_long_and_takes_what_comes_after_it() {
    let broker = Mosquitto::start();
    let daemon = Daemon::start_with(&broker, "");
    daemon.wait("at work", |daemon| daemon.text("log").contains("connected"));
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let writer = publish_long_and_next(&broker).await;
    daemon.wait("what comes after it", |daemon| daemon.durable() == (1, 1));
    let log = daemon.text("log");
    assert!(log.contains("quarantined"), "{log}");
    // It is in no file that `--sources` could look into.
    let line =
        "source radio: messages and lines of them that could not be used: 1; the daemon's log";
    daemon.wait("that the status says so", |daemon| {
        let status = Command::new(PROGRAM)
            .args(["status", "--config", "site.toml"])
            .current_dir(daemon.0.path())
            .output();
        let said = String::from_utf8(status.unwrap().stdout).unwrap();
        let said: Vec<&str> = said.split_whitespace().collect();
        said.join(" ").contains(line)
    });
    writer.abort();
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_message_that_is_too_long_is_set_aside_and_what_comes_after_it_is_taken() {
    let broker = Mosquitto::start();
    let mut source = Source::start(&broker);
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let writer = publish_long_and_next(&broker).await;
    let delivery = source.next().await;
    assert_eq!((values(&delivery), delivery.quarantined), (vec![], 1));
    delivery.receipt.acknowledge().await.unwrap();
    let delivery = source.next().await;
    assert_eq!(values(&delivery), [1.0]);
    delivery.receipt.acknowledge().await.unwrap();
    writer.abort();
    source.end().await;
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_backlog_comes_without_waiting_for_the_acknowledgement_of_each_twenty() {
    let broker = Mosquitto::start();
    let mut source = Source::start(&broker);
    tokio::time::sleep(Duration::from_millis(1500)).await;
    broker
        .publish(&(1..=28).map(message).collect::<Vec<_>>())
        .await;
    let mut waiting = Vec::new();
    for day in 1..=28_u32 {
        let delivery = source.next().await;
        assert_eq!(values(&delivery), [f64::from(day)]);
        waiting.push(delivery);
    }
    source.end().await;
    // The connection has ended: each comes again, and by then its number may be another's.
    for delivery in waiting {
        assert!(delivery.receipt.acknowledge().await.is_err());
    }
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn readings_come_over_tls_from_a_broker_that_proves_its_name_and_from_no_other() {
    let (broker, port) = Mosquitto::start_secured();
    let secured = |authority: &str| {
        let file = broker.folder.path().join(authority);
        let lines = format!("url = \"mqtts://localhost:{port}\"\nca_file = {file:?}");
        config_of(&lines)
    };
    let mut trusting = Source::of(secured("authority.pem"));
    let mut doubting = Source::of_session(secured("stranger.pem"), "another");
    tokio::time::sleep(Duration::from_secs(3)).await;
    broker.publish(&[message(1), message(2)]).await;
    for day in [1.0, 2.0] {
        let delivery = trusting.next().await;
        assert_eq!(values(&delivery), [day]);
        delivery.receipt.acknowledge().await.unwrap();
    }
    assert!(doubting.deliveries.try_recv().is_err());
    trusting.end().await;
    doubting.end().await;
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn messages_of_many_lines_wait_at_the_broker_until_those_before_have_been_taken() {
    let broker = Mosquitto::start();
    let (sender, mut deliveries) = mpsc::channel(64);
    let (stop, stopped) = shutdown::pair();
    let config = config_at(broker.port);
    let radio = config.brokers[0].clone();
    let task = tokio::spawn(follow(
        radio,
        config.benchmarks,
        sender,
        ServiceFaults::default(),
        Subscription::new("wide".to_owned(), false),
        stopped,
    ));
    tokio::time::sleep(Duration::from_millis(1500)).await;
    // More values in ten messages than may wait.
    let lines: Vec<String> = (0..8000).map(|line| message(1 + line % 28)).collect();
    broker.publish(&vec![lines.join("\n"); 10]).await;
    eventually("what may wait is there", || deliveries.len() == 8).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    assert_eq!(deliveries.len(), 8);
    for _ in 0..10 {
        let delivery = deliveries.recv().await.unwrap();
        assert_eq!(delivery.arrivals.len(), 8000);
        drop(delivery.room);
        delivery.receipt.acknowledge().await.unwrap();
    }
    stop.request();
    task.await.unwrap();
}

/// Stands before a broker and refuses MQTT 5, as a broker does that knows only 3.1.1; which Debian does not have any more.
/// Gives its port and counts whom it refused.
pub(crate) async fn refusing_version_5(port: u16) -> (u16, Arc<AtomicUsize>) {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let own = listener.local_addr().unwrap().port();
    let refused = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&refused);
    tokio::spawn(async move {
        while let Ok((mut client, _)) = listener.accept().await {
            let mut first = vec![0; 1024];
            let length = client.read(&mut first).await.unwrap();
            // A header of two bytes, then the protocol's name with its length, and its version.
            assert_eq!(first[4..8], *b"MQTT");
            if first[8] == 5 {
                count.fetch_add(1, Ordering::Relaxed);
                let unacceptable_version = [0x20, 2, 0, 1];
                client.write_all(&unacceptable_version).await.unwrap();
                continue;
            }
            let broker = tokio::net::TcpStream::connect(("127.0.0.1", port));
            let mut broker = broker.await.unwrap();
            broker.write_all(&first[..length]).await.unwrap();
            tokio::spawn(async move {
                let _ = tokio::io::copy_bidirectional(&mut client, &mut broker).await;
            });
        }
    });
    (own, refused)
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_broker_that_does_not_know_mqtt_5_is_spoken_to_in_3_1_1() {
    let broker = Mosquitto::start();
    let (port, refused) = refusing_version_5(broker.port).await;
    let mut source = Source::start_at(port);
    tokio::time::sleep(Duration::from_secs(4)).await;
    broker.publish(&[message(1), message(2)]).await;
    for day in [1.0, 2.0] {
        let delivery = source.next().await;
        assert_eq!(values(&delivery), [day]);
        delivery.receipt.acknowledge().await.unwrap();
    }
    assert_eq!(refused.load(Ordering::Relaxed), 1);
    source.end().await;
}

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");

/// A daemon at work in a folder of its own; ended with the test.
struct Daemon(TempDir, Child);

impl Daemon {
    fn start(broker: &Mosquitto) -> Self {
        Self::start_with(broker, "")
    }

    /// With more in its config; it reads the files in its folder beside.
    fn start_with(broker: &Mosquitto, more: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let text = format!(
            "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"radio\"\n\
             kind = \"mqtt\"\nurl = \"mqtt://127.0.0.1:{}\"\ntopic = \"site/+/displacement\"\n{more}",
            broker.port
        );
        std::fs::write(folder.path().join("site.toml"), text).unwrap();
        let process = Self::spawn(folder.path());
        Self(folder, process)
    }

    fn spawn(folder: &Path) -> Child {
        let log = std::fs::File::create(folder.join("log")).unwrap();
        Command::new(PROGRAM)
            .args(["run", "site.toml"])
            .current_dir(folder)
            .stderr(log)
            .stdout(Stdio::null())
            .spawn()
            .unwrap()
    }

    /// Ends it in order.
    fn stop(&mut self) {
        let id = self.1.id().to_string();
        assert!(Command::new("kill").arg(id).status().unwrap().success());
        self.1.wait().unwrap();
    }

    /// Starts it again, with a config in which one text is another.
    fn restart_as(&mut self, text: &str, other: &str) {
        let file = self.0.path().join("site.toml");
        std::fs::write(&file, self.text("site.toml").replacen(text, other, 1)).unwrap();
        self.1 = Self::spawn(self.0.path());
    }

    /// The value that counts of a time.
    fn newest_of(&self, time: &str) -> Option<f64> {
        let store = slipwatch::store::Store::look(&self.0.path().join("state")).unwrap();
        let steps = store.steps(0).unwrap();
        let value = |input: &Input| match input {
            Input::Reading { reading, .. } if reading.time.to_string() == time => {
                Some(reading.value)
            }
            _ => None,
        };
        steps.iter().rev().find_map(|step| value(&step.input))
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.path().join(name)).unwrap_or_default()
    }

    fn readings(&self) -> usize {
        let store = slipwatch::store::Store::look(&self.0.path().join("state"));
        let steps = store
            .map(|store| store.steps(0).unwrap())
            .unwrap_or_default();
        let is_reading = |input: &Input| matches!(input, Input::Reading { .. });
        steps.iter().filter(|step| is_reading(&step.input)).count()
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.1.kill();
        let _ = self.1.wait();
    }
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn two_daemons_of_one_site_name_each_get_every_message() {
    let broker = Mosquitto::start();
    let daemons = [Daemon::start(&broker), Daemon::start(&broker)];
    tokio::time::sleep(Duration::from_secs(4)).await;
    broker
        .publish(&(1..=20).map(message).collect::<Vec<_>>())
        .await;
    for _ in 0..300 {
        if daemons.iter().all(|one| one.readings() == 20) {
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("{:?}", daemons.each_ref().map(Daemon::readings));
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_broker_that_restarts_is_found_again_and_a_bad_line_stops_nothing() {
    let mut broker = Mosquitto::start();
    let mut source = Source::start(&broker);
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let two = format!("{}\n{{\"torn\": {}\n\n", message(1), message(2));
    broker.publish(&[two, "\u{0}".to_owned()]).await;
    let delivery = source.next().await;
    assert_eq!(
        (values(&delivery), delivery.quarantined),
        (vec![1.0, 2.0], 1)
    );
    delivery.receipt.acknowledge().await.unwrap();
    let delivery = source.next().await;
    assert_eq!((values(&delivery), delivery.quarantined), (vec![], 1));
    delivery.receipt.acknowledge().await.unwrap();
    tokio::time::sleep(Duration::from_millis(300)).await;
    broker.restart();
    broker.publish(&[message(3)]).await;
    let delivery = source.next().await;
    assert_eq!(values(&delivery), [3.0]);
    delivery.receipt.acknowledge().await.unwrap();
    source.end().await;
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_broker_that_is_gone_stands_in_status_until_it_is_back() {
    let mut broker = Mosquitto::start();
    let daemon = Daemon::start(&broker);
    let status = || daemon.printed(&["status", "--config", "site.toml"]);
    daemon.wait("it connects", |one| one.text("log").contains("connected"));
    let is_said = |status: &str| status.contains("source radio: no connection to 127.0.0.1:");
    assert!(!is_said(&status()), "{}", status());
    broker.process.kill().unwrap();
    broker.process.wait().unwrap();
    daemon.wait("that it is gone", |_| is_said(&status()));
    let json = daemon.printed(&["status", "--config", "site.toml", "--format", "json"]);
    assert!(json.contains(r#""kind":"broker-unreachable""#), "{json}");
    broker.start_again();
    daemon.wait("that it is back", |_| !is_said(&status()));
}

/// The config of a broker that lets anybody in and refuses each subscription; it needs the plug-in that comes with
/// Mosquitto, as a file of access rules does not refuse subscriptions.
fn refusing(folder: &Path) -> String {
    let rules = folder.join("rules.json");
    let text = r#"{"defaultACLAccess":{"publishClientSend":true,"publishClientReceive":true,"subscribe":false,
                   "unsubscribe":true},"clients":[],"groups":[],"roles":[]}"#;
    std::fs::write(&rules, text).unwrap();
    let named = std::env::var("LD_LIBRARY_PATH").unwrap_or_default();
    let folders = [
        "/usr/lib/x86_64-linux-gnu",
        "/usr/lib/aarch64-linux-gnu",
        "/usr/lib",
    ];
    let mut plugins = named
        .split(':')
        .chain(folders)
        .map(|one| Path::new(one).join("mosquitto_dynamic_security.so"));
    let plugin = plugins.find(|one| one.exists());
    let plugin = plugin.expect("mosquitto_dynamic_security.so");
    format!(
        "plugin {}\nplugin_opt_config_file {}\n",
        plugin.display(),
        rules.display()
    )
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(
    not(has_mosquitto_plugin),
    ignore = "Mosquitto with its security plugin was not found by build.rs"
)]
async fn a_broker_that_refuses_the_subscription_is_reported_and_its_benchmark_is_unknown() {
    let broker = Mosquitto::start_with(refusing);
    tokio::time::sleep(Duration::from_millis(500)).await;
    let daemon = Daemon::start_with(
        &broker,
        "[[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n\
         [[benchmark]]\nid = \"5\"\nsource = \"radio\"\n[[benchmark]]\nid = \"6\"\nsource = \"logger\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"-c\", \"echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\"]\n\
         levels = [\"unknown\"]\n",
    );
    let now = slipwatch::runtime::clock::now();
    std::fs::write(
        daemon.0.path().join("6.csv"),
        format!("time,displacement_mm\n{now},1\n"),
    )
    .unwrap();
    let is_notified = || {
        let notified = daemon.text("notified");
        let mut notified = notified.lines();
        notified.any(|line| line.starts_with("5/unknown/") && line.ends_with("firing"))
    };
    for _ in 0..300 {
        let is_said = daemon
            .text("log")
            .contains("the broker refuses the subscription");
        if is_notified() && is_said && daemon.readings() == 1 {
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("{}\n{}", daemon.text("notified"), daemon.text("log"));
}

/// What `doctor` says of a broker.
fn doctor_of(broker: &Mosquitto) -> String {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("site.toml");
    let port = broker.port;
    let text = format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"radio\"\nkind = \"mqtt\"\n\
         url = \"mqtt://logger:wrong@127.0.0.1:{port}\"\ntopic = \"site/#\"\n"
    );
    std::fs::write(&config, text).unwrap();
    let doctor = std::process::Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .arg("doctor")
        .arg(config)
        .output()
        .unwrap();
    let said = String::from_utf8(doctor.stdout).unwrap();
    let line = said.lines().find(|line| line.contains("the broker"));
    line.unwrap_or(&said).to_owned()
}

#[test]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
fn doctor_asks_the_broker_for_the_subscription_and_says_who_is_not_let_in() {
    let open = Mosquitto::start();
    let closed = Mosquitto::start_with(|_| "allow_anonymous false\n".to_owned());
    std::thread::sleep(Duration::from_millis(500));
    let taken = doctor_of(&open);
    assert!(
        taken.starts_with("good") && taken.contains("takes the subscription"),
        "{taken}"
    );
    let refused = doctor_of(&closed);
    assert!(
        refused.starts_with("wrong") && refused.contains("NotAuthorized"),
        "{refused}"
    );
}

/// The benchmarks of a backlog, the readings of each that a daemon knows before it, and those that queue, an hour apart.
const BENCHMARKS: usize = 10;
const KNOWN: usize = 20;
const QUEUED: usize = 1200;

/// Readings of all benchmarks, by time: creep with a jitter, up to now.
fn backlog(readings: std::ops::Range<usize>) -> Vec<String> {
    let spacing = jiff::SignedDuration::from_hours(1);
    let all = i32::try_from(KNOWN + QUEUED).unwrap();
    let now = slipwatch::runtime::clock::now().as_second() / 86_400 * 86_400;
    let first = jiff::Timestamp::from_second(now).unwrap() - spacing * all;
    let message = |reading: usize, benchmark: usize| {
        let time = first + spacing * i32::try_from(reading).unwrap();
        let jitter = ((reading * 37 + benchmark) % 11) as f64 / 50.0;
        let value = 0.1 * reading as f64 + jitter;
        format!(r#"{{"benchmark":"b{benchmark}","time":"{time}","value":{value:.3},"unit":"mm"}}"#)
    };
    readings
        .flat_map(|reading| (0..BENCHMARKS).map(move |benchmark| message(reading, benchmark)))
        .collect()
}

impl Daemon {
    /// Kills it, and starts it again on the same state.
    fn restart(&mut self) {
        self.1.kill().unwrap();
        self.1.wait().unwrap();
        let process = Command::new(PROGRAM)
            .args(["run", "site.toml"])
            .current_dir(self.0.path())
            .stderr(Stdio::null())
            .stdout(Stdio::null())
            .spawn();
        self.1 = process.unwrap();
    }

    /// Readings that are durable, and how many of them differ in benchmark or time.
    fn durable(&self) -> (usize, usize) {
        let count = || -> rusqlite::Result<(i64, i64)> {
            let database = rusqlite::Connection::open(self.0.path().join("state/slipwatch.db"))?;
            let query = "SELECT count(*), count(DISTINCT series || ' ' || time) FROM step WHERE series IS NOT NULL";
            database.query_row(query, [], |row| Ok((row.get(0)?, row.get(1)?)))
        };
        let (all, distinct) = count().unwrap_or_default();
        (
            usize::try_from(all).unwrap(),
            usize::try_from(distinct).unwrap(),
        )
    }

    fn printed(&self, words: &[&str]) -> String {
        let output = Command::new(PROGRAM)
            .args(words)
            .current_dir(self.0.path())
            .output();
        String::from_utf8(output.unwrap().stdout).unwrap()
    }

    fn events(&self) -> String {
        self.printed(&["events", "--config", "site.toml", "--format", "json"])
    }

    fn refits(&self) -> usize {
        let said = self.events();
        let is_refit = |line: &&str| line.contains(r#""event":"refit""#);
        said.lines().filter(is_refit).count()
    }

    fn wait(&self, what: &str, claim: impl Fn(&Self) -> bool) {
        for _ in 0..6000 {
            if claim(self) {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("{what}: {:?}, {} refits", self.durable(), self.refits());
    }
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn messages_that_queue_are_judged_together_and_kills_in_the_midst_lose_and_repeat_nothing() {
    let broker = Mosquitto::start_with(|_| "max_queued_messages 0\n".to_owned());
    tokio::time::sleep(Duration::from_millis(500)).await;
    let mut daemon = Daemon::start(&broker);
    daemon.wait("connected", |one| one.text("log").contains("connected"));
    tokio::time::sleep(Duration::from_millis(1500)).await;
    for some in backlog(0..KNOWN).chunks(50) {
        broker.publish(some).await;
    }
    // From the tenth reading on each leads to one.
    let known = BENCHMARKS * (KNOWN - 9);
    daemon.wait("the first start", |one| one.refits() == known);
    daemon.1.kill().unwrap();
    for some in backlog(KNOWN..KNOWN + QUEUED).chunks(50) {
        broker.publish(some).await;
    }
    let all = BENCHMARKS * (KNOWN + QUEUED);
    let mut midst = 0;
    for least in [BENCHMARKS * KNOWN + 150, all / 3, 2 * all / 3] {
        daemon.restart();
        daemon.wait("more taken", |one| one.durable().0 >= least);
        midst += usize::from(daemon.durable().0 < all);
    }
    daemon.restart();
    assert!(midst > 0, "each kill came after the end");
    let last = backlog(KNOWN + QUEUED - 1..KNOWN + QUEUED);
    let newest = last.iter().map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).unwrap();
        let name = |key: &str| message[key].as_str().unwrap().to_owned();
        (name("benchmark"), name("time"))
    });
    let newest: Vec<(String, String)> = newest.collect();
    daemon.wait("the newest of each judged", |one| {
        let said = one.events();
        let events = said.lines().map(|line| serde_json::from_str(line).unwrap());
        let refits = events.filter(|event: &serde_json::Value| event["event"] == "refit");
        let refits: Vec<serde_json::Value> = refits.collect();
        (newest.iter()).all(|(benchmark, time)| {
            refits
                .iter()
                .any(|one| one["benchmark"] == **benchmark && one["time"] == **time)
        })
    });
    daemon.1.kill().unwrap();
    daemon.1.wait().unwrap();
    assert_eq!(daemon.durable(), (all, all));
    let replayed = daemon.printed(&["replay", "--state", "state", "--format", "json"]);
    let (replayed, _summary) = replayed.trim_end().rsplit_once('\n').unwrap();
    assert!(
        daemon.events().trim_end() == replayed,
        "other than a replay"
    );
    let refits = daemon.refits() - known;
    assert!(3 * refits < BENCHMARKS * QUEUED, "{refits}");
}

/// Hourly readings of one benchmark, so many hours from now.
fn hourly(hours: std::ops::RangeInclusive<i64>) -> Vec<String> {
    let now = slipwatch::runtime::clock::now().as_second();
    let line = |hour: i64| {
        let time = jiff::Timestamp::from_second(now + 3600 * hour).unwrap();
        let value = 0.1 * (hour + 200) as f64 + ((hour + 200) * 37 % 11) as f64 / 50.0;
        format!(r#"{{"benchmark":"b0","time":"{time}","value":{value:.3},"unit":"mm"}}"#)
    };
    hours.map(line).collect()
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(
    not(all(has_mosquitto, has_faketime)),
    ignore = "Mosquitto or libfaketime was not found by build.rs"
)]
async fn what_a_slow_broker_kept_while_the_daemon_was_off_is_read_before_time_passes() {
    let broker = Mosquitto::start_with(|_| "max_queued_messages 0\n".to_owned());
    tokio::time::sleep(Duration::from_millis(500)).await;
    let mut daemon = Daemon::start(&broker);
    daemon.1.kill().unwrap();
    daemon.1.wait().unwrap();
    // The day before yesterday.
    let library = format!(
        "/usr/lib/{}-linux-gnu/faketime/libfaketime.so.1",
        std::env::consts::ARCH
    );
    let process = Command::new(PROGRAM)
        .args(["run", "site.toml"])
        .current_dir(daemon.0.path())
        .env("LD_PRELOAD", library)
        .env("FAKETIME", "-36h")
        .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
        .stderr(std::fs::File::create(daemon.0.path().join("log")).unwrap())
        .stdout(Stdio::null())
        .spawn();
    daemon.1 = process.unwrap();
    daemon.wait("connected", |one| one.text("log").contains("connected"));
    tokio::time::sleep(Duration::from_millis(1500)).await;
    for some in hourly(-136..=-36).chunks(50) {
        broker.publish(some).await;
    }
    daemon.wait("the past", |one| one.durable().0 == 101);
    daemon.1.kill().unwrap();
    daemon.1.wait().unwrap();
    broker.publish(&hourly(-35..=0)).await;
    let is_unknown = |one: &Daemon| one.events().contains(r#""rule":"no-data""#);
    assert!(!is_unknown(&daemon), "{}", daemon.events());
    let signal = |name: &str| {
        let id = broker.process.id().to_string();
        let status = Command::new("kill").args([name, &id]).status();
        assert!(status.unwrap().success());
    };
    signal("-STOP");
    daemon.restart();
    tokio::time::sleep(Duration::from_secs(5)).await;
    let was_unknown = is_unknown(&daemon);
    signal("-CONT");
    daemon.wait("all of it", |one| one.durable().0 == 137);
    tokio::time::sleep(Duration::from_secs(4)).await;
    assert!(!was_unknown && !is_unknown(&daemon), "{}", daemon.events());
}
