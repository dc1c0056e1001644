//! The daemon and its core, with real folders, files and hooks.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by panicking"
)]

use crate::eventually::eventually;
use crate::identity::red_fires;
use jiff::{SignedDuration, Timestamp};
use slipwatch::alert::Level;
use slipwatch::config::{self, Config};
use slipwatch::monitor::{AlertState, Event, EventKind, Input};
use slipwatch::reading::{BenchmarkId, Quantity, Reading, Unit};
use slipwatch::runtime::deliver::{Dispatcher, Retry};
use slipwatch::runtime::delivered::Delivered;
use slipwatch::runtime::hook::Status;
use slipwatch::runtime::progress::Progress;
use slipwatch::runtime::run::{RunError, run};
use slipwatch::runtime::shutdown::{self, Shutdown};
use slipwatch::runtime::site::{Counts, Sinks, Site};
use slipwatch::runtime::tail::{Arrival, WaitingReading};
use slipwatch::store::{DeliveryOutcome, Store, StoreError};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;
use tokio::sync::watch;
use tokio::task::JoinHandle;

mod crisis;

const LIMIT: Duration = Duration::from_secs(60);
const MULTI: &str = "time,5_displacement_mm,6_displacement_mm\n";

/// A site whose hook writes down what it is notified of.
fn site_folder() -> (TempDir, Config) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("incoming")).unwrap();
    let script = "echo $SLIPWATCH_KEY $SLIPWATCH_STATUS >> notified\ncat >> stdin\n";
    fs::write(folder.path().join("hook.sh"), script).unwrap();
    let text = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
                [alert]\nevacuation_time = \"12h\"\n\
                [[hook]]\nrun = [\"/bin/sh\", \"hook.sh\"]\nlevels = [\"orange\", \"red\"]\n";
    let file = folder.path().join("site.toml");
    fs::write(&file, text).unwrap();
    let config = config::load(&file).unwrap();
    (folder, config)
}

fn lines(folder: &TempDir, name: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.path().join(name)).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

fn alert(time: Timestamp, level: Level, state: AlertState) -> Event {
    Event {
        time,
        benchmark: Some(BenchmarkId::new("5")),
        kind: EventKind::Alert {
            level,
            state,
            key: format!("5/{level}/{}", time.as_second()),
            rule: "chance".to_owned(),
            text: "text".to_owned(),
        },
    }
}

fn reading(time: Timestamp, value: f64) -> Arrival {
    Arrival {
        time,
        input: Input::Reading {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time,
                value,
                sigma: None,
            },
        },
    }
}

fn site(config: &Config) -> Site {
    let store = Arc::new(Store::open(&config.site.state_dir).unwrap());
    let delivered = Delivered::of(Arc::clone(&store));
    let dispatcher = Dispatcher::start(&config.hooks, &Retry::default(), delivered);
    let sinks = Sinks {
        store: Some(store),
        alerts: Some(dispatcher),
        status: Status::Actual,
    };
    Site::resume(
        &config.site.name,
        config.settings.clone(),
        sinks,
        &mut || std::ops::ControlFlow::Continue(()),
    )
    .unwrap()
    .unwrap()
}

/// The events in the site's state.
fn events(folder: &TempDir) -> Vec<Event> {
    let Ok(store) = Store::look(&folder.path().join("state")) else {
        return Vec::new();
    };
    let (mut events, mut after) = (Vec::new(), 0);
    loop {
        let some = store.events(after, None, None).unwrap();
        let Some((last, _)) = some.last() else {
            return events;
        };
        after = *last;
        let each = some
            .iter()
            .map(|(_, body)| serde_json::from_str::<Event>(body).unwrap());
        events.extend(each);
    }
}

fn noon() -> Timestamp {
    "2017-06-06T12:00:00Z".parse().unwrap()
}

fn hours(count: i64) -> SignedDuration {
    SignedDuration::from_hours(count)
}

async fn close(site: Site, wall: Timestamp) {
    assert_eq!(site.close(wall, LIMIT).await.unwrap(), Some(0));
}

#[tokio::test]
async fn an_alert_is_reported_and_after_a_restart_not_again() {
    let (folder, config) = site_folder();
    for _start in 0..2 {
        let mut site = site(&config);
        site.handle(&alert(noon(), Level::Red, AlertState::Firing));
        site.commit(noon()).unwrap();
        close(site, noon()).await;
    }
    let key = format!("5/red/{}", noon().as_second());
    assert_eq!(lines(&folder, "notified"), [format!("{key} Actual")]);
    let store = Store::look(&config.site.state_dir).unwrap();
    let taken = store.is_noted(red_fires(&key), None, Some(DeliveryOutcome::Delivered));
    assert!(taken.unwrap());
}

#[tokio::test]
async fn a_level_that_begins_and_ends_at_once_is_reported_to_nobody_and_ends_what_was_before_it() {
    let (folder, config) = site_folder();
    let mut site = site(&config);
    let orange = format!("5/orange/{}", noon().as_second());
    site.handle(&alert(noon(), Level::Orange, AlertState::Firing));
    site.commit(noon()).unwrap();
    eventually("orange", || !lines(&folder, "notified").is_empty()).await;
    // A logger hands in what it has of half a day.
    let red = noon() + hours(1);
    site.handle(&alert(red, Level::Red, AlertState::Firing));
    let end = Event {
        time: noon() + hours(9),
        ..alert(red, Level::Red, AlertState::Resolved)
    };
    site.handle(&end);
    site.commit(noon() + hours(9)).unwrap();
    close(site, noon() + hours(9)).await;
    let notified = lines(&folder, "notified");
    assert_eq!(
        notified,
        [format!("{orange} Actual"), format!("{orange} Actual")]
    );
    let all = fs::read_to_string(folder.path().join("stdin")).unwrap();
    assert!(all.contains("resolved") && !all.contains("/red/"), "{all}");
}

#[tokio::test(start_paused = true)]
async fn while_a_long_past_is_read_what_is_current_is_judged_once_a_minute() {
    let (_folder, config) = site_folder();
    let mut site = site(&config);
    let mut judged = Vec::new();
    for minute in 0..5_i64 {
        for hour in 0..20 {
            let time = noon() + hours(20 * minute + hour);
            let value = 0.1 * (20 * minute + hour) as f64 + ((hour * 37) % 11) as f64 / 50.0;
            let said = site.take(&reading(time, value), noon() + hours(200));
            assert_eq!(said.unwrap(), []);
            judged.extend(site.judge_meanwhile());
        }
        tokio::time::advance(Duration::from_secs(30)).await;
    }
    let refits = (judged.iter()).filter(|event| matches!(event.kind, EventKind::Refit { .. }));
    // The first of each batch of twenty that came a minute after what was judged before.
    let times: Vec<Timestamp> = refits.map(|event| event.time).collect();
    assert_eq!(times, [40, 80].map(|hour| noon() + hours(hour)));
    close(site, noon() + hours(200)).await;
}

/// Whether these events end that nothing can be said of a benchmark.
fn end_the_silence(events: &[Event]) -> bool {
    events.iter().any(|event| {
        matches!(
            event.kind,
            EventKind::Alert {
                level: Level::Unknown,
                state: AlertState::Resolved,
                ..
            }
        ) && event.benchmark.is_some()
    })
}

/// Readings of each hour in a source that lets each wait for twelve: they are there, and the benchmark is not silent. One that falls
/// silent is so once, from the newest that was read, though the waiting ones come meanwhile.
#[tokio::test(start_paused = true)]
async fn a_benchmark_whose_readings_wait_for_earlier_ones_is_silent_when_no_more_are_read() {
    let (_folder, config) = site_folder();
    let mut site = site(&config);
    let mut wall = noon();
    let value = |hour: i64| 0.1 * hour as f64 + ((hour * 37) % 11) as f64 / 50.0;
    for hour in -30..=0 {
        site.take(&reading(noon() + hours(hour), value(hour)), wall)
            .unwrap();
    }
    site.caught_up(wall).unwrap();
    let is_of_silence =
        |event: &Event| matches!(&event.kind, EventKind::Alert { rule, .. } if rule == "no-data");
    let mut said: Vec<(i64, Event)> = Vec::new();
    for hour in 1..=60 {
        tokio::time::advance(Duration::from_secs(3600)).await;
        wall += hours(1);
        let mut events = Vec::new();
        // None is read for twenty hours.
        let is_read = |hour: i64| hour > 0 && !(21..=40).contains(&hour);
        if is_read(hour) {
            let time = noon() + hours(hour);
            let benchmark = BenchmarkId::new("5");
            site.note_waiting(vec![WaitingReading {
                benchmark,
                quantity: Quantity::Displacement,
                time,
            }]);
        }
        if is_read(hour - 12) {
            let arrival = reading(noon() + hours(hour - 12), value(hour - 12));
            events.extend(site.take(&arrival, wall).unwrap());
        }
        events.extend(site.live(wall));
        site.commit(wall).unwrap();
        said.extend(events.into_iter().map(|event| (hour, event)));
    }
    said.retain(|(_, event)| is_of_silence(event));
    let hours_said: Vec<i64> = said.iter().map(|(hour, _)| *hour).collect();
    assert_eq!(hours_said, [24, 41], "{said:?}");
    assert!(end_the_silence(&[said[1].1.clone()]));
    let since = format!("no reading since {}", noon() + hours(20));
    assert!(matches!(&said[0].1.kind, EventKind::Alert { text, .. } if text.contains(&since)));
    close(site, wall).await;
}

/// Rows that lie forty days behind the clock of a daemon that was started within a silence are a backlog, or its clock is ahead.
#[tokio::test(start_paused = true)]
async fn far_behind_the_clock_a_silence_ends_once_four_readings_come_as_far_apart_as_they_were_measured()
 {
    for comes_each in [hours(0), hours(1)] {
        let (_folder, config) = site_folder();
        let mut site = site(&config);
        let mut wall = noon() + hours(40 * 24);
        let value = |hour: i64| 0.1 * hour as f64 + ((hour * 37) % 11) as f64 / 50.0;
        for hour in -30..=0 {
            site.take(&reading(noon() + hours(hour), value(hour)), wall)
                .unwrap();
        }
        site.caught_up(wall).unwrap();
        site.commit(wall).unwrap();
        let silent = site.live(wall);
        let is_silence = |event: &Event| matches!(&event.kind, EventKind::Fault { kind, .. } if kind == "no-data");
        assert!(silent.iter().any(is_silence), "{silent:?}");
        let mut ended = Vec::new();
        for hour in 1..=12 {
            tokio::time::advance(comes_each.unsigned_abs()).await;
            wall += comes_each;
            let arrival = reading(noon() + hours(hour), value(hour));
            let mut events = site.take(&arrival, wall).unwrap();
            events.extend(site.live(wall));
            if end_the_silence(&events) {
                ended.push(hour);
            }
        }
        let wanted = if comes_each.is_zero() {
            vec![]
        } else {
            vec![4]
        };
        assert_eq!(ended, wanted, "one each {comes_each}");
        close(site, wall).await;
    }
}

#[tokio::test]
async fn attempts_are_counted_over_restarts() {
    let (folder, config) = site_folder();
    let script = "echo $SLIPWATCH_ATTEMPT >> notified\nexit 1\n";
    fs::write(folder.path().join("hook.sh"), script).unwrap();
    for start in 0..3 {
        let mut site = site(&config);
        if start == 0 {
            site.handle(&alert(noon(), Level::Red, AlertState::Firing));
        }
        site.commit(noon()).unwrap();
        assert_eq!(site.close(noon(), LIMIT).await.unwrap(), Some(1));
    }
    let notified = lines(&folder, "notified");
    assert!(notified.len() >= 3, "{notified:?}");
    let counted = (1..).map(|attempt: u32| attempt.to_string());
    assert!(
        notified.iter().cloned().eq(counted.take(notified.len())),
        "{notified:?}"
    );
}

#[tokio::test]
async fn what_was_given_up_is_made_to_wait_again_and_reported_at_the_next_start() {
    let (folder, config) = site_folder();
    let (key, notified) = (format!("5/red/{}", noon().as_second()), "notified");
    let mut first = site(&config);
    first.handle(&alert(noon(), Level::Red, AlertState::Firing));
    first.commit(noon()).unwrap();
    close(first, noon()).await;
    let database = rusqlite::Connection::open(config.site.state_dir.join("slipwatch.db")).unwrap();
    database
        .execute("UPDATE outbox SET status = 'dead', sum = NULL", [])
        .unwrap();
    drop(database);
    close(site(&config), noon()).await;
    assert_eq!(lines(&folder, notified).len(), 1, "it had been given up");
    let store = Store::look(&config.site.state_dir).unwrap();
    assert_eq!(store.redeliver(&|_| false).unwrap(), (1, 0));
    drop(store);
    close(site(&config), noon()).await;
    let line = format!("{key} Actual");
    assert_eq!(lines(&folder, notified), [line.clone(), line]);
}

#[tokio::test]
async fn what_is_long_past_fires_no_hook() {
    let (folder, config) = site_folder();
    let mut site = site(&config);
    // Twice the evacuation time is a day.
    let wall = noon() + hours(24);
    site.handle(&alert(noon() - hours(1), Level::Red, AlertState::Firing));
    site.handle(&alert(noon(), Level::Orange, AlertState::Firing));
    site.commit(wall).unwrap();
    assert_eq!(site.counts().long_past, 1);
    site.caught_up(wall).unwrap();
    close(site, wall).await;
    let notified = lines(&folder, "notified");
    assert_eq!(notified.len(), 1, "{notified:?}");
    assert!(notified[0].starts_with("5/orange/"));
}

#[tokio::test]
async fn an_old_alert_still_in_force_is_reported_when_its_readings_are_recent() {
    let (folder, config) = site_folder();
    let wall = noon() + hours(24 * 30);
    let mut site = site(&config);
    site.handle(&alert(noon() - hours(2), Level::Orange, AlertState::Firing));
    site.handle(&alert(
        noon() - hours(1),
        Level::Orange,
        AlertState::Resolved,
    ));
    site.handle(&alert(noon(), Level::Red, AlertState::Firing));
    site.commit(wall).unwrap();
    site.take(&reading(wall - hours(1), 5.0), wall).unwrap();
    site.caught_up(wall).unwrap();
    close(site, wall).await;
    let notified = lines(&folder, "notified");
    assert_eq!(notified.len(), 1, "{notified:?}");
    assert!(notified[0].starts_with("5/red/"));
}

#[tokio::test]
async fn the_end_of_what_was_reported_is_reported_however_late_it_comes_and_after_a_restart_too() {
    let (folder, config) = site_folder();
    let mut first = site(&config);
    first.handle(&alert(noon(), Level::Orange, AlertState::Firing));
    first.commit(noon()).unwrap();
    close(first, noon()).await;
    let wall = noon() + hours(24 * 30);
    let mut second = site(&config);
    // Long past, and so not notified; the orange that it supersedes was.
    second.handle(&alert(noon() + hours(1), Level::Red, AlertState::Firing));
    let end = noon() + hours(2);
    second.handle(&alert(end, Level::Red, AlertState::Resolved));
    // Of these nobody has been notified.
    second.handle(&alert(noon() + hours(3), Level::Red, AlertState::Firing));
    second.handle(&alert(noon() + hours(4), Level::Red, AlertState::Resolved));
    second.commit(wall).unwrap();
    close(second, wall).await;
    let expected = [
        format!("5/orange/{} Actual", noon().as_second()),
        format!("5/red/{} Actual", end.as_second()),
    ];
    assert_eq!(lines(&folder, "notified"), expected);
}

#[tokio::test]
async fn an_end_that_found_no_room_at_a_hook_is_reported_once_there_is_some() {
    let (folder, config) = site_folder();
    let mut site = site(&config);
    site.handle(&alert(noon(), Level::Red, AlertState::Firing));
    site.commit(noon()).unwrap();
    eventually("red", || !lines(&folder, "notified").is_empty()).await;
    // More than may wait, before the hook's worker has its turn.
    let many = 1100;
    for number in 0..many {
        let id = format!("p{number}");
        let mut red = alert(noon(), Level::Red, AlertState::Firing);
        red.benchmark = Some(BenchmarkId::new(&id));
        if let EventKind::Alert { key, .. } = &mut red.kind {
            *key = format!("{id}/red/1");
        }
        site.handle(&red);
        site.commit(noon()).unwrap();
    }
    site.handle(&alert(noon(), Level::Red, AlertState::Resolved));
    site.commit(noon()).unwrap();
    eventually("the end", || {
        site.offer_refused().unwrap();
        let stdin = fs::read_to_string(folder.path().join("stdin"));
        stdin.unwrap_or_default().contains("\"resolved\"")
    })
    .await;
    close(site, noon()).await;
    let notified = lines(&folder, "notified");
    assert_eq!(notified.len(), many + 2, "each once");
}

#[tokio::test]
async fn an_old_alert_in_force_is_reported_in_whatever_batch_it_comes_and_once() {
    let (folder, config) = site_folder();
    let wall = noon() + hours(24 * 3);
    let mut site = site(&config);
    site.take(&reading(noon() - hours(2), 4.0), wall).unwrap();
    site.caught_up(wall).unwrap();
    // The backlog: silence at its end does not make the red past.
    site.handle(&alert(noon() - hours(1), Level::Orange, AlertState::Firing));
    site.handle(&alert(noon(), Level::Red, AlertState::Firing));
    site.commit(wall).unwrap();
    assert_eq!(site.counts().long_past, 2);
    for _batch in 0..3 {
        site.caught_up(wall).unwrap();
    }
    assert_eq!(site.counts().long_past, 1, "the orange, superseded");
    close(site, wall).await;
    let notified = lines(&folder, "notified");
    assert_eq!(notified, [format!("5/red/{} Actual", noon().as_second())]);
}

#[tokio::test]
async fn an_alert_of_a_benchmark_that_nobody_watches_any_more_fires_no_hook() {
    let (folder, config) = site_folder();
    let mut site = site(&config);
    let wall = noon() + hours(24 * 30 + 1);
    site.take(&reading(noon(), 4.0), wall).unwrap();
    site.handle(&alert(noon(), Level::Red, AlertState::Firing));
    site.commit(wall).unwrap();
    site.caught_up(wall).unwrap();
    close(site, wall).await;
    assert_eq!(lines(&folder, "notified"), [""; 0]);
}

#[tokio::test]
async fn a_value_counts_once_a_correction_counts_and_the_future_never() {
    let (_folder, config) = site_folder();
    let mut site = site(&config);
    let wall = noon() + hours(1);
    for value in [1.0, 1.0, 1.5, 1.5] {
        site.take(&reading(noon(), value), wall).unwrap();
    }
    site.take(&reading(wall + hours(2), 9.0), wall).unwrap();
    // Until the past has been read it may be the clock that is behind.
    assert_eq!((site.held(), site.counts().from_the_future), (1, 0));
    site.caught_up(wall).unwrap();
    assert_eq!(site.held(), 0);
    let expected = Counts {
        taken: 2,
        repeated: 2,
        from_the_future: 1,
        without_clock: 0,
        long_past: 0,
    };
    assert_eq!(site.counts(), expected);
    close(site, wall).await;
}

fn write_rows(file: &Path, rows: std::ops::Range<i64>) {
    let mut file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(file)
        .unwrap();
    if file.metadata().unwrap().len() == 0 {
        file.write_all(MULTI.as_bytes()).unwrap();
    }
    for row in rows {
        let time = noon() + hours(row);
        writeln!(file, "{time},{row},{row}.5").unwrap();
    }
}

/// A daemon at work.
struct Daemon {
    trigger: shutdown::Trigger,
    progress: watch::Receiver<Progress>,
    task: JoinHandle<Result<Counts, RunError>>,
}

impl Daemon {
    fn start(config: &Config) -> Self {
        let (trigger, shutdown) = shutdown::pair();
        let (sender, progress) = watch::channel(Progress::default());
        let config = config.clone();
        let task = tokio::spawn(async move {
            Box::pin(run(&config, shutdown, &sender, |event, _| {
                event.kind.name().to_owned()
            }))
            .await
        });
        Self {
            trigger,
            progress,
            task,
        }
    }

    async fn until(&mut self, what: &str, claim: impl Fn(&Progress) -> bool) {
        let waited = tokio::time::timeout(LIMIT, self.progress.wait_for(claim)).await;
        assert!(matches!(waited, Ok(Ok(_))), "never: {what}");
    }

    async fn stop(self) -> Counts {
        self.trigger.request();
        let ended = tokio::time::timeout(LIMIT, self.task).await;
        ended.expect("no end").unwrap().unwrap()
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_daemon_takes_the_past_and_what_is_added_and_ends_when_asked() {
    let (folder, config) = site_folder();
    let file = folder.path().join("incoming/logger.csv");
    write_rows(&file, 0..300);
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    write_rows(&file, 300..310);
    let all = |progress: &Progress| progress.counts.taken >= 2 * 310;
    daemon.until("what was added", all).await;
    assert_eq!(daemon.stop().await.taken, 2 * 310);
    // A restart rebuilds the past from the same file.
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    let counts = daemon.stop().await;
    assert_eq!((counts.taken, counts.repeated), (2 * 310, 0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_file_that_is_replaced_by_a_longer_copy_adds_only_what_is_new() {
    let (folder, config) = site_folder();
    let file = folder.path().join("incoming/logger.csv");
    write_rows(&file, 0..10);
    let mut daemon = Daemon::start(&config);
    daemon
        .until("the past", |progress| progress.is_caught_up)
        .await;
    let copy = folder.path().join("copy");
    write_rows(&copy, 0..15);
    fs::rename(copy, file).unwrap();
    let all = |progress: &Progress| progress.counts.taken >= 2 * 15;
    daemon.until("the copy", all).await;
    let counts = daemon.stop().await;
    assert_eq!((counts.taken, counts.repeated), (2 * 15, 2 * 10));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_source_folder_that_appears_later_is_followed() {
    let (folder, config) = site_folder();
    fs::remove_dir(folder.path().join("incoming")).unwrap();
    let mut daemon = Daemon::start(&config);
    daemon
        .until("nothing", |progress| progress.is_caught_up)
        .await;
    fs::create_dir(folder.path().join("incoming")).unwrap();
    write_rows(&folder.path().join("incoming/logger.csv"), 0..5);
    let all = |progress: &Progress| progress.counts.taken >= 2 * 5;
    daemon.until("the new folder's file", all).await;
    daemon.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_daemon_on_the_same_state_folder_is_refused() {
    let (_folder, config) = site_folder();
    let mut first = Daemon::start(&config);
    first
        .until("its start", |progress| progress.is_caught_up)
        .await;
    let second = Daemon::start(&config).task.await.unwrap();
    let Err(RunError::State { source, .. }) = second else {
        panic!("{second:?}");
    };
    assert!(matches!(source, StoreError::InUse), "{source:?}");
    first.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_state_folder_that_cannot_be_made_is_said_so() {
    let (folder, config) = site_folder();
    fs::write(folder.path().join("state"), "a file").unwrap();
    let error = Daemon::start(&config).task.await.unwrap().unwrap_err();
    assert!(error.to_string().contains("state folder"), "{error}");
}

#[tokio::test]
async fn sigterm_asks_for_the_stop() {
    let mut shutdown = Shutdown::on_signals().unwrap();
    assert!(!shutdown.is_requested());
    nix::sys::signal::raise(nix::sys::signal::Signal::SIGTERM).unwrap();
    let asked = tokio::time::timeout(LIMIT, shutdown.requested()).await;
    assert!(asked.is_ok());
}
