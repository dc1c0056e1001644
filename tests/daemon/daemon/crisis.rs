//! The daemon in a crisis, with the monitor's own alerts: old ones, silence, a full disk.

use super::{Daemon, events, hours, lines, site_folder};
use crate::identity::red_fires;
use jiff::Timestamp;
use slipwatch::alert::Level;
use slipwatch::config::{self, Config};
use slipwatch::monitor::{AlertState, Event, EventKind};
use slipwatch::store::{DeliveryOutcome, Store};
use std::fs;
use std::time::Duration;
use tempfile::TempDir;

/// Hourly readings that accelerate towards a failure, then go on at the speed reached, up to `end`.
fn crisis(end: Timestamp) -> Vec<String> {
    let (accelerating, steady) = (113, 27);
    let displacement = |row: i32| {
        let row = f64::from(row);
        let within = row.min(f64::from(accelerating));
        let beyond = row - within;
        200.0 * (120.0 / (120.0 - within)).ln() + beyond * 200.0 / (120.0 - within)
    };
    let last = accelerating + steady;
    (0..=last)
        .map(|row| {
            let time = end - hours(i64::from(last - row));
            format!("{time},{:.4}", displacement(row))
        })
        .collect()
}

/// The site with a short evacuation, whose hook is notified of silence too.
fn crisis_folder() -> (TempDir, Config) {
    let (folder, _) = site_folder();
    let file = folder.path().join("site.toml");
    let text = fs::read_to_string(&file).unwrap();
    let text = text
        .replace("\"12h\"", "\"3h\"")
        .replace("\"red\"]", "\"red\", \"unknown\"]");
    fs::write(&file, text).unwrap();
    let config = config::load(&file).unwrap();
    (folder, config)
}

fn append(folder: &TempDir, rows: &[String]) {
    let file = folder.path().join("incoming/logger.csv");
    let before =
        fs::read_to_string(&file).unwrap_or_else(|_| "time,5_displacement_mm\n".to_owned());
    let mut text = rows.join("\n");
    text.push('\n');
    fs::write(&file, before + &text).unwrap();
}

/// Waits until `claim` holds; how long that takes is not what is tested.
async fn eventually(what: &str, mut claim: impl FnMut() -> bool) {
    for _ in 0..6000 {
        if claim() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("never: {what}");
}

/// The alerts of `level` that the site has called: when, each key once.
fn called(folder: &TempDir, level: Level) -> Vec<Timestamp> {
    let mut keys = std::collections::BTreeSet::new();
    events(folder)
        .into_iter()
        .filter_map(|event| {
            let EventKind::Alert {
                level: own,
                state: AlertState::Firing,
                key,
                ..
            } = &event.kind
            else {
                return None;
            };
            // The whole site's repeats that of its benchmark; one that comes from the past stands there too.
            let is_new = *own == level && event.benchmark.is_some() && keys.insert(key.clone());
            is_new.then_some(event.time)
        })
        .collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_red_that_comes_with_the_backlog_of_a_logger_that_was_silent_is_reported() {
    let (folder, config) = crisis_folder();
    let now = slipwatch::runtime::clock::now();
    let rows = crisis(now);
    append(&folder, &rows[..70]);
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    append(&folder, &rows[70..]);
    let is_notified = || {
        lines(&folder, "notified")
            .iter()
            .any(|line| line.starts_with("5/red/"))
    };
    eventually("the red notified", is_notified).await;
    daemon.stop().await;
    let red = called(&folder, Level::Red);
    let time = &red[0];
    assert!(*time < now - hours(6), "{time} is not long past at {now}");
    // After a restart nobody is notified twice.
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    daemon.stop().await;
    let notified = lines(&folder, "notified");
    let reds = notified.iter().filter(|line| line.starts_with("5/red/"));
    assert_eq!(reds.count(), 1, "{notified:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_silence_that_began_before_the_start_is_reported() {
    let (folder, config) = crisis_folder();
    let now = slipwatch::runtime::clock::now();
    append(&folder, &crisis(now - hours(48))[..40]);
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    let is_notified = || {
        lines(&folder, "notified")
            .iter()
            .any(|line| line.starts_with("5/unknown/"))
    };
    eventually("the silence notified", is_notified).await;
    daemon.stop().await;
    let time = &called(&folder, Level::Unknown)[0];
    assert!(*time < now - hours(6), "{time} is not long past at {now}");
}

/// The program itself, so that its limits are its own; ended with the test.
struct Program(std::process::Child);

impl Program {
    fn start(folder: &TempDir, limit: &str) -> Self {
        let mut log = fs::File::create(folder.path().join("log")).unwrap();
        let mut child = std::process::Command::new("prlimit")
            .args([limit, env!("CARGO_BIN_EXE_slipwatch"), "run", "site.toml"])
            .current_dir(folder.path())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        // A pipe has no limit.
        let mut stderr = child.stderr.take().unwrap();
        std::thread::spawn(move || std::io::copy(&mut stderr, &mut log));
        Self(child)
    }

    fn limit(&self, limit: &str) {
        let pid = self.0.id().to_string();
        let status = std::process::Command::new("prlimit")
            .args(["--pid", &pid, limit])
            .status();
        assert!(status.unwrap().success());
    }

    fn is_running(&mut self) -> bool {
        self.0.try_wait().unwrap().is_none()
    }

    fn stop(mut self) {
        let pid = nix::unistd::Pid::from_raw(i32::try_from(self.0.id()).unwrap());
        nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM).unwrap();
        assert!(self.0.wait().unwrap().success());
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[tokio::test]
async fn a_full_disk_ends_neither_the_daemon_nor_its_hooks_and_what_waited_is_written() {
    let (folder, _) = crisis_folder();
    append(&folder, &crisis(slipwatch::runtime::clock::now()));
    // No file may grow beyond 256 kB, the database's log neither: the write fails as on a full disk.
    let mut program = Program::start(&folder, "--fsize=262144:unlimited");
    let log = || lines(&folder, "log").join("\n");
    let is_notified = || {
        lines(&folder, "notified")
            .iter()
            .any(|line| line.starts_with("5/red/"))
    };
    eventually("the red notified", is_notified).await;
    eventually("the full disk logged", || {
        log().contains("no room on the disk")
    })
    .await;
    assert!(called(&folder, Level::Red).is_empty(), "there was room");
    assert!(program.is_running(), "{}", log());
    program.limit("--fsize=unlimited");
    eventually("the red written", || {
        !called(&folder, Level::Red).is_empty()
    })
    .await;
    let refits = || {
        let events = events(&folder);
        let refits = events.iter().filter(|event| event.kind.name() == "refit");
        refits.count()
    };
    eventually("the refits of the past", || refits() > 120).await;
    program.stop();
    // Nothing is lost, nothing there twice.
    let events = events(&folder);
    let refits = events.iter().filter(|event| event.kind.name() == "refit");
    let times: std::collections::BTreeSet<Timestamp> =
        refits.clone().map(|event| event.time).collect();
    assert_eq!(times.len(), refits.count());
    assert!(times.len() > 120, "{}", times.len());
}

#[tokio::test]
async fn a_receipt_that_finds_no_room_still_keeps_the_hook_from_being_notified_twice() {
    let (folder, _) = crisis_folder();
    // Hooks inherit the limit: this one leaves nothing behind but the names of empty files.
    let script = "mkdir -p notified-$SLIPWATCH_LEVEL/$$";
    fs::write(folder.path().join("hook.sh"), script).unwrap();
    let mut program = Program::start(&folder, "--fsize=unlimited");
    eventually("its start", || {
        lines(&folder, "log").join("").contains("caught up")
    })
    .await;
    program.limit("--fsize=0:unlimited");
    append(&folder, &crisis(slipwatch::runtime::clock::now()));
    let calls = || {
        let calls = fs::read_dir(folder.path().join("notified-red"));
        calls.map_or(0, Iterator::count)
    };
    eventually("the red notified", || calls() > 0).await;
    program.limit("--fsize=unlimited");
    eventually("its receipt", || {
        let is_red = |event: &&Event| matches!(&event.kind, EventKind::Alert { level, .. } if *level == Level::Red);
        let events = events(&folder);
        let Some(EventKind::Alert { key, .. }) = events.iter().find(is_red).map(|event| &event.kind) else {
            return false;
        };
        let store = Store::look(&folder.path().join("state")).unwrap();
        let identity = red_fires(key);
        store.is_noted(identity, None, Some(DeliveryOutcome::Delivered)).unwrap()
    })
    .await;
    assert!(program.is_running());
    program.stop();
    let program = Program::start(&folder, "--fsize=unlimited");
    eventually("the past", || {
        lines(&folder, "log").join("").contains("caught up")
    })
    .await;
    program.stop();
    assert_eq!(calls(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_archived_crisis_fires_no_hook() {
    let (folder, config) = crisis_folder();
    append(&folder, &crisis("1963-10-09T22:00:00Z".parse().unwrap()));
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    eventually("the silence after it", || {
        !called(&folder, Level::Unknown).is_empty()
    })
    .await;
    eventually("the red", || !called(&folder, Level::Red).is_empty()).await;
    daemon.stop().await;
    assert_eq!(called(&folder, Level::Red).len(), 1);
    assert_eq!(lines(&folder, "notified"), [""; 0]);
}
