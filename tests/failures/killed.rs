//! The daemon is killed, again and again, while its files grow.

use crate::site::{Program, Site, eventually};
use jiff::{SignedDuration, Timestamp};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::time::Duration;

/// How often the daemon is killed; `SLIPWATCH_KILLS` says otherwise.
const ROUNDS: usize = 60;
/// Between two readings; after a few of them missing the daemon calls a silence.
const SPACING: SignedDuration = SignedDuration::from_hours(1);
const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

/// What the files of both sources hold, and are still to hold.
struct Loggers {
    recorder: mcap::Writer<File>,
    channel: u16,
    start: Timestamp,
    rows: usize,
    /// Rows written so far.
    at: usize,
    /// The end of a row that has been written in part.
    rest: String,
}

impl Loggers {
    fn start(site: &Site, rows: usize) -> Self {
        let file = File::create(site.path("incoming/recording.mcap")).unwrap();
        let options = mcap::WriteOptions::new().use_chunks(false);
        let mut recorder = mcap::Writer::with_options(file, options).unwrap();
        let topic = "/benchmarks/toe/displacement";
        let channel = (recorder.add_channel(0, topic, "json", &BTreeMap::new())).unwrap();
        site.append("incoming/crown.csv", "time,crown_displacement_mm\n");
        let span = SPACING * i32::try_from(rows).unwrap();
        let now = slipwatch::runtime::clock::now();
        // Whole seconds read the same everywhere.
        let start = Timestamp::from_second((now - span).as_second()).unwrap();
        Self {
            recorder,
            channel,
            start,
            rows,
            at: 0,
            rest: String::new(),
        }
    }

    fn reading(&self, row: usize) -> (Timestamp, f64) {
        let time = self.start + SPACING * i32::try_from(row).unwrap();
        let left = 1.1 - row as f64 / self.rows as f64;
        let value = -200.0 * left.ln();
        (time, (value * 1e4).round() / 1e4)
    }

    /// One more reading of each; `cut` of the row's bytes stay behind until the next one.
    fn grow(&mut self, site: &Site, cut: usize) {
        if self.at == self.rows {
            return;
        }
        let (time, value) = self.reading(self.at);
        let row = format!("{}{time},{value}\n", std::mem::take(&mut self.rest));
        let (whole, rest) = row.split_at(row.len() - cut.min(row.len()));
        site.append("incoming/crown.csv", whole);
        rest.clone_into(&mut self.rest);
        let payload = format!("{{\"time\":\"{time}\",\"value\":{value},\"unit\":\"mm\"}}");
        let nanoseconds = u64::try_from(time.as_nanosecond()).unwrap();
        let header = mcap::records::MessageHeader {
            channel_id: self.channel,
            sequence: u32::try_from(self.at).unwrap(),
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        self.recorder
            .write_to_known_channel(&header, payload.as_bytes())
            .unwrap();
        self.recorder.flush().unwrap();
        self.at += 1;
    }

    fn finish(&mut self, site: &Site) {
        while self.at < self.rows {
            self.grow(site, 0);
        }
        site.append("incoming/crown.csv", &std::mem::take(&mut self.rest));
        self.recorder.finish().unwrap();
    }

    /// What is to stand in the state in the end: each reading once.
    fn expected(&self) -> Vec<(String, Timestamp, f64)> {
        let of = |benchmark: &'static str| {
            (0..self.rows).map(move |row| {
                let (time, value) = self.reading(row);
                (benchmark.to_owned(), time, value)
            })
        };
        of("crown").chain(of("toe")).collect()
    }
}

/// The refits, flips and drifts of one benchmark, by their time: those of the past before the first start come after
/// that of the present.
fn findings(events: &str, benchmark: &str) -> Vec<String> {
    let is_ours = |line: &&str| {
        let event: Value = serde_json::from_str(line).unwrap();
        let kinds = [
            "refit",
            "regime-flip",
            "intercept-drift",
            "transition-drift",
        ];
        event["benchmark"] == benchmark && kinds.contains(&event["event"].as_str().unwrap())
    };
    let mut ours: Vec<String> = (events.lines().filter(is_ours))
        .map(str::to_owned)
        .collect();
    let time = |event: &String| {
        let event: Value = serde_json::from_str(event).unwrap();
        text(&event["time"]).parse::<jiff::Timestamp>().unwrap()
    };
    ours.sort_by_key(time);
    ours
}

/// The daemon has taken everything and is stopped: nothing is missing, nothing is there twice, everybody was notified.
fn settle(site: &Site, loggers: &mut Loggers) {
    loggers.finish(site);
    let program = site.caught_up();
    let expected = loggers.expected();
    eventually("all readings", || site.values().len() >= expected.len());
    let files = ["incoming/crown.csv", "incoming/recording.mcap"];
    let plain = site.printed(&[
        "replay",
        files[0],
        files[1],
        "--config",
        "site.toml",
        "--format",
        "json",
    ]);
    eventually("the past gone through", || {
        let events = site.events();
        let of = |events: &str| ["crown", "toe"].map(|one| findings(events, one).len());
        of(&events) == of(&plain)
    });
    program.stop();
    assert_eq!(site.values(), expected);
    let events = site.proven_events();
    for benchmark in ["crown", "toe"] {
        let ours = findings(&events, benchmark);
        assert!(ours.len() > loggers.rows / 2, "{}", ours.len());
        assert!(ours == findings(&plain, benchmark), "{benchmark}");
    }
    everybody_was_notified(site, &events);
}

/// Each alert that was to be delivered was, and none that was never called.
fn everybody_was_notified(site: &Site, events: &str) {
    let called: BTreeSet<String> = (events.lines())
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .filter(|event| event["event"] == "alert")
        .map(|event| format!("{} {}", text(&event["key"]), text(&event["state"])))
        .collect();
    let notified: BTreeSet<String> = site.lines("notified").into_iter().collect();
    assert!(notified.is_subset(&called), "{notified:?} {called:?}");
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let mut query = database
        .prepare("SELECT key || ' ' || state FROM outbox WHERE status = 'delivered'")
        .unwrap();
    let noted = query.query_map([], |row| row.get::<_, String>(0)).unwrap();
    let noted: BTreeSet<String> = noted.map(Result::unwrap).collect();
    assert!(!noted.is_empty(), "nothing was called");
    assert!(noted.is_subset(&notified), "{noted:?} {notified:?}");
    let waiting: i64 = database
        .query_row(
            "SELECT count(*) FROM outbox WHERE status IN ('waiting', 'dead')",
            [],
            |row| row.get(0),
        )
        .unwrap();
    assert_eq!(waiting, 0, "nobody was notified of these");
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap()
}

fn rounds() -> usize {
    let asked = std::env::var("SLIPWATCH_KILLS").ok();
    asked.map_or(ROUNDS, |count| count.parse().unwrap())
}

/// 15.
#[test]
fn a_daemon_killed_at_random_moments_loses_nothing_and_takes_nothing_twice() {
    let rounds = rounds();
    let mut generator = Pcg64::seed_from_u64(15);
    let site = Site::new(POLICY);
    let mut loggers = Loggers::start(&site, rounds.min(120));
    let mut kept = 0;
    for round in 0..rounds {
        loggers.grow(&site, generator.random_range(0..12));
        let mut program: Program = site.start(&[]);
        // Half of them in the course of the start, the others at work.
        if generator.random() {
            eventually("its start", || site.log().contains("started"));
        }
        std::thread::sleep(Duration::from_millis(generator.random_range(0..60)));
        if generator.random() {
            loggers.grow(&site, generator.random_range(0..12));
        }
        std::thread::sleep(Duration::from_millis(generator.random_range(0..60)));
        assert_eq!(program.ended(), None, "round {round}: {}", site.log());
        program.0.kill().unwrap();
        drop(program);
        let values = site.values().len();
        assert!(values >= kept, "round {round}: {values} of {kept}");
        kept = values;
    }
    assert!(kept > 0, "no round has kept anything");
    settle(&site, &mut loggers);
}

/// 15.
#[test]
#[cfg_attr(not(has_strace), ignore = "strace was not found by build.rs")]
fn a_daemon_killed_as_it_calls_the_system_loses_nothing() {
    let site = Site::new(POLICY);
    let calls = [
        "write,pwrite64,lseek",
        "fsync,fdatasync",
        "openat",
        "unlink,ftruncate",
    ];
    let rounds: Vec<(&str, usize)> = (calls.iter())
        .flat_map(|call| [1, 2, 3, 5, 8, 13, 21].map(|when| (*call, when)))
        .collect();
    let mut loggers = Loggers::start(&site, 2 * rounds.len());
    let mut killed = BTreeMap::new();
    for (call, when) in rounds {
        loggers.grow(&site, 0);
        let mut program = site.start_traced(call, &format!("signal=KILL:when={when}"));
        // What it does until it stands still may be too little for the call to come.
        for _ in 0..40 {
            if program.ended().is_some() {
                *killed.entry(call).or_insert(0) += 1;
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
    assert!(
        calls.iter().all(|call| killed.contains_key(call)),
        "{killed:?}"
    );
    settle(&site, &mut loggers);
}
