//! A backlog of messages that a real Mosquitto kept: taken by a daemon that knows nothing yet, by one that knows its benchmarks, and
//! without the monitor.

use crate::{Daemon, floor, readings};
use jiff::Timestamp;
use rumqttc::{AsyncClient, Event, MqttOptions, Packet, QoS};
use slipwatch::config;
use slipwatch::runtime::mqtt::{Subscription, follow};
use slipwatch::runtime::service_faults::ServiceFaults;
use slipwatch::runtime::shutdown;
use slipwatch::store::{Batch, Store};
use std::fs;
use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tokio::sync::mpsc;

/// Readings of each benchmark that a daemon knows before the backlog.
const KNOWN: usize = 30;
/// Messages that one commit takes at most where there is no monitor.
const AT_ONCE: usize = 1024;

/// Its process, its port, and the folder of its config.
struct Mosquitto(
    Child,
    u16,
    #[expect(dead_code, reason = "kept for as long as it runs")] TempDir,
);

impl Mosquitto {
    fn start(folder: TempDir) -> Self {
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = free.local_addr().unwrap().port();
        drop(free);
        let conf = folder.path().join("mosquitto.conf");
        // However many wait, none is dropped; the other settings are Mosquitto's own.
        let text =
            format!("listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n");
        fs::write(&conf, text).unwrap();
        let named = std::env::var("MOSQUITTO").unwrap_or("/usr/sbin/mosquitto".to_owned());
        let child = Command::new(named)
            .arg("-c")
            .arg(conf)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        std::thread::sleep(Duration::from_secs(1));
        Self(child.unwrap(), port, folder)
    }

    /// Publishes and waits until the broker has it all.
    async fn publish(&self, payloads: Vec<String>) {
        let mut options = MqttOptions::new("writer", "127.0.0.1", self.1);
        options.set_inflight(100);
        let (client, mut connection) = AsyncClient::new(options, 100);
        let count = payloads.len();
        let writer = tokio::spawn(async move {
            for payload in payloads {
                let topic = "site/all/displacement";
                let sent = client.publish(topic, QoS::AtLeastOnce, false, payload);
                sent.await.unwrap();
            }
            client
        });
        let mut taken = 0;
        while taken < count {
            let event = connection.poll().await.unwrap();
            taken += usize::from(matches!(event, Event::Incoming(Packet::PubAck(_))));
        }
        writer.await.unwrap();
    }
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// Readings `from` to `until` of each benchmark, ten minutes apart: creep that slows down; they come by time, as from loggers.
fn payloads(benchmarks: usize, (from, until, of): (usize, usize, usize)) -> Vec<String> {
    let first = Timestamp::now().as_second() - i64::try_from(of).unwrap() * 600;
    let mut payloads = Vec::with_capacity(benchmarks * (until - from));
    for reading in from..until {
        let time = Timestamp::from_second(first + i64::try_from(reading).unwrap() * 600).unwrap();
        for benchmark in 0..benchmarks {
            let jitter = ((reading * 37 + benchmark * 11) % 23) as f64 / 40.0;
            let value = 30.0 * (reading as f64 / 4320.0).ln_1p() + jitter;
            payloads.push(format!(
                r#"{{"benchmark":"b{benchmark}","time":"{time}","value":{value:.3},"unit":"mm"}}"#
            ));
        }
    }
    payloads
}

fn site(port: u16) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "[site]\nname = \"bench\"\nstate_dir = \"state\"\n[[source]]\nid = \"radio\"\nkind = \"mqtt\"\n\
         url = \"mqtt://127.0.0.1:{port}\"\ntopic = \"site/+/displacement\"\n"
    );
    fs::write(folder.path().join("site.toml"), text).unwrap();
    folder
}

/// Waits until so many readings are durable; seconds and seconds of the processor since the daemon started.
fn taken(folder: &TempDir, count: usize) -> (f64, f64) {
    let began = Instant::now();
    let daemon = Daemon::start(folder);
    while readings(folder) < count {
        std::thread::sleep(Duration::from_millis(20));
    }
    (began.elapsed().as_secs_f64(), daemon.processor())
}

/// Lets the daemon make its session known to the broker, and take `count` readings; then what it owes the past.
fn at_rest(folder: &TempDir, count: usize) {
    let _daemon = Daemon::start(folder);
    while readings(folder) < count {
        std::thread::sleep(Duration::from_millis(20));
    }
    let events = || Store::look(&folder.path().join("state")).map_or(0, |store| store.last_step());
    let mut before = -1;
    while before != events() {
        before = events();
        std::thread::sleep(Duration::from_secs(4));
    }
}

/// The same messages received, parsed, written and acknowledged, without the monitor; seconds.
async fn without_the_monitor(broker: &Mosquitto, messages: &[String]) -> f64 {
    let folder = site(broker.1);
    let config = config::load(&folder.path().join("site.toml")).unwrap();
    let start = || {
        let (sender, deliveries) = mpsc::channel(AT_ONCE);
        let (stop, stopped) = shutdown::pair();
        let radio = config.brokers[0].clone();
        let faults = ServiceFaults::default();
        let source = follow(
            radio,
            Vec::new(),
            sender,
            faults,
            Subscription::new("floor".to_owned(), false),
            stopped,
        );
        (deliveries, stop, tokio::spawn(source))
    };
    let (deliveries, stop, task) = start();
    tokio::time::sleep(Duration::from_secs(2)).await;
    stop.request();
    task.await.unwrap();
    drop(deliveries);
    broker.publish(messages.to_vec()).await;
    let store = Store::open(&folder.path().join("state")).unwrap();
    let mut batch = Batch::default();
    let (mut count, began) = (0, Instant::now());
    let (mut deliveries, stop, task) = start();
    while count < messages.len() {
        let mut some = Vec::new();
        deliveries.recv_many(&mut some, AT_ONCE).await;
        for arrival in some.iter().flat_map(|one| &one.arrivals) {
            batch.step(arrival.time, &arrival.input, &[]);
        }
        store.commit(&batch).unwrap();
        batch.clear();
        count += some.iter().map(|one| one.arrivals.len()).sum::<usize>();
        // Beside, as the daemon does it: the source may wait for room among the deliveries. What has been taken gives its room
        // back first: Mosquitto 2.0.11 sends all that it kept at once, whatever a client lets it.
        let receipts: Vec<_> = some.into_iter().map(|one| one.receipt).collect();
        tokio::spawn(async move {
            for receipt in receipts {
                // The last ones find no connection any more.
                let _ = receipt.acknowledge().await;
            }
        });
    }
    let seconds = began.elapsed().as_secs_f64();
    stop.request();
    task.await.unwrap();
    seconds
}

/// Seconds of parsing and of parsing and SQLite, of the same lines in a file.
fn from_a_file(messages: &[String]) -> (f64, f64) {
    let folder = tempfile::tempdir().unwrap();
    let text = "[site]\nname = \"bench\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"ndjson\"\npath = \"*.ndjson\"\n";
    fs::write(folder.path().join("site.toml"), text).unwrap();
    fs::write(folder.path().join("all.ndjson"), messages.join("\n") + "\n").unwrap();
    let config = config::load(&folder.path().join("site.toml")).unwrap();
    let (parsed, stored) = floor(&config, messages.len());
    let count = messages.len() as f64;
    (count / parsed, count / stored)
}

pub(crate) fn backlog(benchmarks: usize, count: usize) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let start = || Mosquitto::start(tempfile::tempdir().unwrap());
    let each = count / benchmarks;
    let known = payloads(benchmarks, (0, KNOWN, KNOWN + each));
    let messages = payloads(benchmarks, (KNOWN, KNOWN + each, KNOWN + each));
    let (parsed, stored) = from_a_file(&messages);
    let received = runtime.block_on(without_the_monitor(&start(), &messages));
    println!(
        "messages: {count} at QoS 1, {benchmarks} benchmarks, kept by Mosquitto for the session\n  \
         the same lines in a file: parsing {parsed:.2} s, parsing and SQLite {stored:.2} s\n  \
         received, parsed, written and acknowledged without the monitor {received:.2} s"
    );
    for (what, before) in [
        ("knows nothing yet", Vec::new()),
        ("knows its benchmarks", known),
    ] {
        // One of its own: a session of which nobody takes the messages would keep them all.
        let broker = start();
        let folder = site(broker.1);
        let number = before.len();
        at_rest(&folder, 0);
        runtime.block_on(broker.publish(before));
        at_rest(&folder, number);
        runtime.block_on(broker.publish(messages.clone()));
        let (seconds, processor) = taken(&folder, number + messages.len());
        println!(
            "  a daemon that {what}: {seconds:.2} s, {processor:.1} s of the processor, {:.0}/s; \
             {:.1} times parsing and SQLite, {:.1} times that with the broker",
            count as f64 / seconds,
            seconds / stored,
            seconds / received,
        );
    }
}
