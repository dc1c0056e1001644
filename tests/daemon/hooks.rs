//! Hooks that misbehave, run for real: each is a script in a temporary folder.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by panicking"
)]

use crate::eventually::eventually;
use crate::identity::red_fires;
use crate::offered::offer;
use slipwatch::alert::Level;
use slipwatch::config::{ExtraMessages, HookConfig};
use slipwatch::monitor::{AlertState, Event, EventKind};
use slipwatch::reading::BenchmarkId;
use slipwatch::runtime::deliver::{self, Dispatcher, Retry};
use slipwatch::runtime::delivered::Delivered;
use slipwatch::runtime::hook::{Alert, HookOutcome, Status};
use slipwatch::runtime::service_faults::ServiceFaults;
use slipwatch::store::{AlertIdentity, DeliveryOutcome, Store};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_secs(60);

fn alert_of(level: Level, key: &str, text: &str) -> Alert {
    let event = Event {
        time: "2017-06-06T17:00:00Z".parse().unwrap(),
        benchmark: Some(BenchmarkId::new("5")),
        kind: EventKind::Alert {
            level,
            state: AlertState::Firing,
            key: key.to_owned(),
            rule: "chance".to_owned(),
            text: text.to_owned(),
        },
    };
    let failure_time = Some("2017-06-07T12:00:00Z".parse().unwrap());
    Alert::new(&event, "Monte Toc", failure_time, Status::Actual).unwrap()
}

fn alert() -> Alert {
    alert_of(Level::Red, "toc/5/red/1", "red at 5")
}

/// A hook that runs `script` with sh in a folder of its own.
fn hook(script: &str) -> (TempDir, HookConfig) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("hook.sh"), script).unwrap();
    let config = HookConfig {
        extra: ExtraMessages::default(),
        links: None,
        zone: "UTC".to_owned(),
        site: false,
        to: None,
        escalate_after: None,
        hours: None,
        benchmarks: BTreeSet::new(),
        run: vec!["/bin/sh".to_owned(), "hook.sh".to_owned()],
        levels: vec![Level::Orange, Level::Red],
        timeout: Duration::from_secs(30),
        folder: folder.path().to_owned(),
        sandbox: false,
        writable: Vec::new(),
        launcher: None,
    };
    (folder, config)
}

fn read(folder: &TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).unwrap_or_default()
}

fn is_running(pid: &str) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z ")
}

async fn run(hook_config: &HookConfig, alert: &Alert) -> HookOutcome {
    tokio::time::timeout(LIMIT, deliver::run(hook_config, alert, 1))
        .await
        .expect("the hook's run never ended")
}

#[tokio::test]
async fn a_hook_gets_the_documented_environment_and_the_alert_on_stdin() {
    let (folder, config) = hook("env > env; cat > stdin");
    assert_eq!(run(&config, &alert()).await, HookOutcome::Done);
    let env = read(&folder, "env");
    for line in [
        "SLIPWATCH_EVENT=alert",
        "SLIPWATCH_KEY=toc/5/red/1",
        "SLIPWATCH_SITE=Monte Toc",
        "SLIPWATCH_BENCHMARK=5",
        "SLIPWATCH_LEVEL=red",
        "SLIPWATCH_STATE=firing",
        "SLIPWATCH_TIME=2017-06-06T17:00:00Z",
        "SLIPWATCH_FAILURE_TIME=2017-06-07T12:00:00Z",
        "SLIPWATCH_ATTEMPT=1",
        "SLIPWATCH_STATUS=Actual",
    ] {
        assert!(env.lines().any(|had| had == line), "{line} not in\n{env}");
    }
    // What the shell itself sets is not ours.
    let allowed = ["PATH", "HOME", "LANG", "TZ", "PWD", "OLDPWD", "SHLVL", "_"];
    for line in env.lines() {
        let name = line.split('=').next().unwrap();
        assert!(
            name.starts_with("SLIPWATCH_") || allowed.contains(&name),
            "{name} leaked"
        );
    }
    let stdin = read(&folder, "stdin");
    assert_eq!(stdin.lines().count(), 1);
    let body: serde_json::Value = serde_json::from_str(&stdin).unwrap();
    for (key, value) in [
        ("event", "alert"),
        ("benchmark", "5"),
        ("level", "red"),
        ("state", "firing"),
        ("key", "toc/5/red/1"),
        ("status", "Actual"),
        ("failure_time", "2017-06-07T12:00:00Z"),
    ] {
        assert_eq!(body[key], value, "{key}");
    }
    assert_eq!(body["attempt"], 1);
    let recommended = body["recommended"].as_str().unwrap();
    assert!(
        recommended.starts_with("Evacuate the area"),
        "{recommended}"
    );
}

#[tokio::test]
async fn a_hook_that_hangs_is_killed_with_its_children() {
    let (folder, mut config) = hook("sleep 90 & echo $! > pid; wait");
    config.timeout = Duration::from_secs(2);
    assert_eq!(run(&config, &alert()).await, HookOutcome::TimedOut);
    let pid = read(&folder, "pid").trim().to_owned();
    assert!(!pid.is_empty(), "the script had no time to start");
    eventually("the child's end", || !is_running(&pid)).await;
}

#[tokio::test]
async fn a_hook_that_ignores_a_long_stdin_blocks_nothing() {
    let (_folder, config) = hook("exit 0");
    let long = alert_of(Level::Red, "k", &"x".repeat(200_000));
    assert_eq!(run(&config, &long).await, HookOutcome::Done);
    let (_folder, mut config) = hook("sleep 90");
    config.timeout = Duration::from_millis(300);
    assert_eq!(run(&config, &long).await, HookOutcome::TimedOut);
}

#[tokio::test]
async fn a_hook_that_floods_stdout_runs_to_its_end() {
    let (folder, config) = hook("head -c 5000000 /dev/zero; echo done > end");
    assert_eq!(run(&config, &alert()).await, HookOutcome::Done);
    assert_eq!(read(&folder, "end"), "done\n");
}

#[tokio::test]
async fn a_grandchild_that_holds_stdout_open_is_not_waited_for() {
    let (folder, config) = hook("sleep 90 & echo $! > pid; exit 0");
    assert_eq!(run(&config, &alert()).await, HookOutcome::Done);
    let pid = read(&folder, "pid").trim().to_owned();
    assert!(is_running(&pid), "it was to outlive the hook");
    let status = std::process::Command::new("kill").arg(&pid).status();
    assert!(status.unwrap().success());
}

#[tokio::test]
async fn a_hook_that_ends_with_the_code_of_what_cannot_be_run_has_run() {
    let (folder, config) = hook("echo sent > sent; echo modem slow >&2; exit 126");
    assert_eq!(run(&config, &alert()).await, HookOutcome::Failed(126));
    assert_eq!(read(&folder, "sent"), "sent\n");
}

#[tokio::test]
async fn a_hook_that_is_missing_or_not_executable_is_not_started() {
    let (folder, mut config) = hook("");
    config.run = vec!["./nowhere.sh".to_owned()];
    let outcome = run(&config, &alert()).await;
    assert!(
        matches!(&outcome, HookOutcome::NotStarted(why) if why.contains("nowhere.sh")),
        "{outcome:?}"
    );
    std::fs::write(folder.path().join("plain.sh"), "#!/bin/sh\n").unwrap();
    config.run = vec!["./plain.sh".to_owned()];
    let outcome = run(&config, &alert()).await;
    assert!(
        matches!(&outcome, HookOutcome::NotStarted(why) if why.contains("denied")),
        "{outcome:?}"
    );
}

#[tokio::test]
async fn an_exit_code_and_a_signal_are_distinguished() {
    let (_folder, config) = hook("exit 7");
    assert_eq!(run(&config, &alert()).await, HookOutcome::Failed(7));
    let (_folder, config) = hook("kill -9 $$");
    assert_eq!(run(&config, &alert()).await, HookOutcome::Signalled(9));
}

fn quick_retry() -> Retry {
    Retry {
        attempts: 5,
        first_delay: Duration::from_millis(10),
        ..Retry::default()
    }
}

#[tokio::test]
async fn a_hook_that_fails_is_tried_again_with_the_same_key() {
    let (folder, config) = hook(
        "echo $SLIPWATCH_ATTEMPT $SLIPWATCH_KEY >> calls\n[ $SLIPWATCH_ATTEMPT -ge 3 ] || exit 1",
    );
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    offer(&dispatcher, &alert());
    eventually("three calls", || {
        read(&folder, "calls").lines().count() == 3
    })
    .await;
    assert_eq!(dispatcher.close(LIMIT).await, Some(0));
    assert_eq!(
        read(&folder, "calls"),
        "1 toc/5/red/1\n2 toc/5/red/1\n3 toc/5/red/1\n"
    );
}

#[tokio::test]
async fn a_hook_that_fails_is_shown_with_what_it_did_until_it_takes_an_alert() {
    let (folder, config) =
        hook("echo \"$SLIPWATCH_RULE: $SLIPWATCH_TEXT\" > said; [ -e works ] || exit 7");
    let faults = ServiceFaults::default();
    let delivered = Delivered::default().reporting(&faults);
    let retry = Retry {
        longest_delay: Duration::from_millis(20),
        ..quick_retry()
    };
    let dispatcher = Dispatcher::start(&[config], &retry, delivered);
    offer(&dispatcher, &alert_of(Level::Red, "5/red/1", "chance 0.3"));
    eventually("the fault", || !faults.shown().is_empty()).await;
    let text = faults.shown().remove(0).text;
    assert!(
        text.contains("red (firing)") && text.contains("exit code 7"),
        "{text}"
    );
    std::fs::write(folder.path().join("works"), "").unwrap();
    eventually("the end of the fault", || faults.shown().is_empty()).await;
    assert_eq!(dispatcher.close(LIMIT).await, Some(0));
    assert!(read(&folder, "said").contains("chance 0.3"));
}

/// The end of an alert goes to those who were notified of its beginning.
#[tokio::test]
async fn an_escalation_reports_the_end_of_what_it_has_reported_and_nothing_of_what_ended_in_time() {
    let (folder, mut config) = hook("echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> calls");
    let store = Arc::new(Store::open(&folder.path().join("state")).unwrap());
    let ended = |key: &str| {
        let mut alert = alert_of(Level::Red, key, "");
        alert.state = AlertState::Resolved.into();
        alert
    };
    for (after, key, expected) in [
        (Duration::from_secs(3600), "in time", ""),
        (
            Duration::from_millis(1),
            "late",
            "late firing\nlate resolved\n",
        ),
    ] {
        config.escalate_after = Some(after);
        let delivered = Delivered::of(Arc::clone(&store));
        let hooks = std::slice::from_ref(&config);
        let dispatcher = Dispatcher::start(hooks, &quick_retry(), delivered);
        offer(&dispatcher, &alert_of(Level::Red, key, ""));
        if !expected.is_empty() {
            eventually("the first call", || read(&folder, "calls").contains(key)).await;
        }
        offer(&dispatcher, &ended(key));
        assert_eq!(dispatcher.close(LIMIT).await, Some(0));
        assert_eq!(read(&folder, "calls"), expected);
        let is_over = |state| {
            let alert = AlertIdentity {
                state,
                ..red_fires(key)
            };
            store.is_noted(alert, None, Some(DeliveryOutcome::Over))
        };
        assert_eq!(is_over("firing").unwrap(), expected.is_empty());
    }
    assert!(store.waiting().unwrap().is_empty());
}

#[tokio::test]
async fn an_alert_that_waits_for_its_retry_holds_up_no_other() {
    let (folder, config) =
        hook("echo $SLIPWATCH_KEY >> calls; [ $SLIPWATCH_KEY != first ] || exit 1");
    let slow = Retry {
        first_delay: Duration::from_secs(3600),
        longest_delay: Duration::from_secs(3600),
        ..Retry::default()
    };
    let dispatcher = Dispatcher::start(&[config], &slow, Delivered::default());
    offer(&dispatcher, &alert_of(Level::Red, "first", ""));
    eventually("the first call", || read(&folder, "calls") == "first\n").await;
    offer(&dispatcher, &alert_of(Level::Orange, "second", ""));
    eventually("the second call", || {
        read(&folder, "calls") == "first\nsecond\n"
    })
    .await;
    // On the way out the waiting one gets a last chance.
    assert_eq!(dispatcher.close(LIMIT).await, Some(1));
    assert_eq!(read(&folder, "calls"), "first\nsecond\nfirst\n");
}

fn tireless_retry() -> Retry {
    Retry {
        attempts: 2,
        first_delay: Duration::from_millis(1),
        longest_delay: Duration::from_millis(2),
        ..Retry::default()
    }
}

fn calls(folder: &TempDir, key: &str) -> usize {
    let calls = read(folder, "calls");
    calls.lines().filter(|line| *line == key).count()
}

/// A hook that notes each key and fails until there is a file `fixed`.
const BROKEN: &str = "echo $SLIPWATCH_KEY >> calls; [ -e fixed ]";

#[tokio::test]
async fn an_orange_a_red_and_an_unknown_are_tried_until_the_hook_takes_them() {
    let (folder, mut config) = hook(BROKEN);
    config.levels = vec![Level::Yellow, Level::Orange, Level::Red, Level::Unknown];
    for level in [Level::Orange, Level::Red, Level::Unknown] {
        let store = Arc::new(Store::open(&folder.path().join("state")).unwrap());
        let delivered = Delivered::of(Arc::clone(&store));
        let dispatcher =
            Dispatcher::start(std::slice::from_ref(&config), &tireless_retry(), delivered);
        let alert = alert_of(level, level.name(), "");
        offer(&dispatcher, &alert);
        eventually("twelve calls", || calls(&folder, level.name()) >= 12).await;
        // What is in hand is not taken twice, what has been taken not again.
        offer(&dispatcher, &alert);
        std::fs::write(folder.path().join("fixed"), "").unwrap();
        let identity = AlertIdentity {
            level: level.name(),
            ..red_fires(level.name())
        };
        eventually("its receipt", || {
            store
                .is_noted(identity, None, Some(DeliveryOutcome::Delivered))
                .unwrap()
        })
        .await;
        assert_eq!(dispatcher.close(LIMIT).await, Some(0), "{level}");
        std::fs::remove_file(folder.path().join("fixed")).unwrap();
    }
    // A yellow is given up.
    let dispatcher = Dispatcher::start(&[config], &tireless_retry(), Delivered::default());
    offer(&dispatcher, &alert_of(Level::Yellow, "yellow", ""));
    eventually("two calls", || calls(&folder, "yellow") == 2).await;
    assert_eq!(dispatcher.close(LIMIT).await, Some(1));
    assert_eq!(calls(&folder, "yellow"), 2);
}

#[tokio::test]
async fn what_is_superseded_or_resolved_is_not_tried_again() {
    let (folder, mut config) = hook(BROKEN);
    config.levels = vec![Level::Orange, Level::Unknown];
    let dispatcher = Dispatcher::start(&[config], &tireless_retry(), Delivered::default());
    let orange = alert_of(Level::Orange, "orange", "");
    offer(&dispatcher, &orange);
    eventually("some calls", || calls(&folder, "orange") >= 3).await;
    // The hook does not ask for red, but does not receive the orange any more either. Another level's
    // alert in hand shows that the worker goes on.
    dispatcher.supersede(&alert_of(Level::Red, "red", ""));
    offer(&dispatcher, &alert_of(Level::Unknown, "unknown", ""));
    eventually("some calls", || calls(&folder, "unknown") >= 5).await;
    let before = calls(&folder, "orange");
    eventually("more calls", || calls(&folder, "unknown") >= 10).await;
    assert_eq!(calls(&folder, "orange"), before);
    // Nor does it receive more of a silence that has ended.
    let mut end = alert_of(Level::Unknown, "unknown", "");
    end.state = AlertState::Resolved.into();
    std::fs::write(folder.path().join("hook.sh"), "exit 0").unwrap();
    offer(&dispatcher, &end);
    assert!(dispatcher.close(LIMIT).await.is_some());
}

#[tokio::test]
async fn an_alert_that_found_no_room_can_be_offered_again() {
    let (folder, config) =
        hook("echo $SLIPWATCH_KEY >> calls; until [ -e go ]; do sleep 0.01; done");
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    let keys: Vec<String> = (0..1200).map(|number| format!("k{number}")).collect();
    let offer_all = || {
        for key in &keys {
            offer(&dispatcher, &alert_of(Level::Red, key, ""));
        }
    };
    assert!(!dispatcher.finds_room(), "nothing was refused");
    offer_all();
    assert!(!dispatcher.finds_room(), "it is full");
    std::fs::write(
        folder.path().join("hook.sh"),
        "echo $SLIPWATCH_KEY >> calls",
    )
    .unwrap();
    std::fs::write(folder.path().join("go"), "").unwrap();
    eventually("room", || dispatcher.finds_room()).await;
    assert!(!dispatcher.finds_room(), "it is said once");
    offer_all();
    assert!(dispatcher.close(LIMIT).await.is_some());
    // A later alert of the benchmark supersedes those that still waited: the last one has found room.
    assert_eq!(calls(&folder, "k1199"), 1);
}

#[tokio::test]
async fn only_the_levels_that_a_hook_asks_for_reach_it() {
    let (folder, config) = hook("echo $SLIPWATCH_LEVEL >> calls");
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    for level in [Level::Yellow, Level::Orange, Level::Unknown, Level::Red] {
        offer(
            &dispatcher,
            &alert_at(level.name(), level, AlertState::Firing),
        );
    }
    assert_eq!(dispatcher.close(LIMIT).await, Some(0));
    let mut calls: Vec<String> = read(&folder, "calls").lines().map(str::to_owned).collect();
    calls.sort();
    assert_eq!(calls, ["orange", "red"]);
}

/// An alert at another benchmark than the others'.
fn alert_at(benchmark: &str, level: Level, state: AlertState) -> Alert {
    let mut alert = alert_of(level, &format!("{benchmark}/{level}"), "");
    alert.event.benchmark = Some(BenchmarkId::new(benchmark));
    alert.state = state.into();
    alert
}

#[tokio::test]
async fn a_red_is_reported_before_everything_that_waits_for_a_slow_hook() {
    let (folder, mut config) = hook("echo $SLIPWATCH_KEY >> calls; sleep 0.3");
    config.levels.push(Level::Unknown);
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    for number in 0..40 {
        let name = format!("p{number}");
        offer(
            &dispatcher,
            &alert_at(&name, Level::Unknown, AlertState::Firing),
        );
    }
    eventually("the first calls", || !read(&folder, "calls").is_empty()).await;
    offer(
        &dispatcher,
        &alert_at("toe", Level::Red, AlertState::Firing),
    );
    eventually("the red", || read(&folder, "calls").contains("toe/red")).await;
    let before = read(&folder, "calls")
        .lines()
        .take_while(|line| *line != "toe/red")
        .count();
    assert!(before <= 8, "{before} before it");
    assert!(dispatcher.close(LIMIT).await.is_some());
}

/// A hook that is asked for each level but green, and whose runs may last a quarter of an hour.
fn with_runs_that_hang(script: &str) -> (TempDir, Dispatcher) {
    let (folder, mut config) = hook(script);
    config.levels.push(Level::Unknown);
    config.timeout = Duration::from_secs(900);
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    (folder, dispatcher)
}

/// Runs for unknown that hang, of as many benchmarks as run at a time, and one for orange at the benchmark that turns red.
#[tokio::test]
async fn a_red_waits_for_no_run_of_a_lesser_alert_that_hangs() {
    let script = "echo \"$SLIPWATCH_BENCHMARK $SLIPWATCH_LEVEL\" >> calls; [ $SLIPWATCH_LEVEL = red ] || exec sleep 600";
    let (folder, dispatcher) = with_runs_that_hang(script);
    let offer_at = |benchmark, level| {
        offer(&dispatcher, &alert_at(benchmark, level, AlertState::Firing));
    };
    let calls = || read(&folder, "calls");
    for benchmark in ["1", "2", "3"] {
        offer_at(benchmark, Level::Unknown);
    }
    offer_at("4", Level::Orange);
    eventually("four runs that hang", || calls().lines().count() == 4).await;
    offer_at("5", Level::Red);
    eventually("the red of a fifth benchmark", || calls().contains("5 red")).await;
    // Its own orange is given some seconds to end, so that messages come in their order.
    offer_at("4", Level::Red);
    eventually("the red of the fourth", || calls().contains("4 red")).await;
    // The end of a red comes before the orange that follows on it, also where no run for less is free.
    let mut end = alert_at("6", Level::Red, AlertState::Resolved);
    end.key = "6/red".to_owned();
    offer(&dispatcher, &end);
    offer_at("6", Level::Orange);
    eventually("the orange after a red", || calls().contains("6 orange")).await;
    let of_the_sixth = calls();
    let of_the_sixth = of_the_sixth.lines().filter(|line| line.starts_with('6'));
    assert_eq!(of_the_sixth.collect::<Vec<&str>>(), ["6 red", "6 orange"]);
    assert!(dispatcher.close(Duration::ZERO).await.is_none());
}

/// As many runs for orange that hang as there are at a time, and one for the end of `unknown` at a benchmark that turns red.
#[tokio::test]
async fn a_red_waits_for_no_run_for_orange_or_for_the_end_of_unknown_that_hangs() {
    let script = "echo \"$SLIPWATCH_BENCHMARK $SLIPWATCH_LEVEL $SLIPWATCH_STATE\" >> calls; [ $SLIPWATCH_LEVEL = red ] || exec sleep 600";
    let (folder, dispatcher) = with_runs_that_hang(script);
    let offer_at = |benchmark, level, state| {
        offer(&dispatcher, &alert_at(benchmark, level, state));
    };
    let calls = || read(&folder, "calls");
    offer_at("0", Level::Unknown, AlertState::Resolved);
    eventually("the end", || calls().lines().count() == 1).await;
    offer_at("0", Level::Red, AlertState::Firing);
    eventually("the red after the end", || calls().contains("0 red")).await;
    // The end that was broken off is tried again.
    eventually("the end", || {
        calls().matches("0 unknown resolved").count() == 2
    })
    .await;
    for benchmark in ["1", "2", "3", "4", "5"] {
        offer_at(benchmark, Level::Orange, AlertState::Firing);
    }
    eventually("six runs that hang", || calls().lines().count() == 8).await;
    offer_at("6", Level::Red, AlertState::Firing);
    eventually("the red of another one", || calls().contains("6 red")).await;
    assert!(dispatcher.close(Duration::ZERO).await.is_none());
}

#[tokio::test]
async fn what_is_superseded_while_it_waits_is_not_reported_and_a_silence_that_is_over_neither() {
    let (folder, mut config) =
        hook("echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> calls; until [ -e go ]; do sleep 0.01; done");
    config.levels.push(Level::Unknown);
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    // These keep the hook at work.
    for number in 0..4 {
        offer(
            &dispatcher,
            &alert_at(&format!("p{number}"), Level::Red, AlertState::Firing),
        );
    }
    eventually("four at once", || {
        read(&folder, "calls").lines().count() == 4
    })
    .await;
    offer(
        &dispatcher,
        &alert_at("a", Level::Orange, AlertState::Firing),
    );
    offer(&dispatcher, &alert_at("a", Level::Red, AlertState::Firing));
    offer(
        &dispatcher,
        &alert_at("b", Level::Unknown, AlertState::Firing),
    );
    offer(
        &dispatcher,
        &alert_at("b", Level::Unknown, AlertState::Resolved),
    );
    std::fs::write(folder.path().join("go"), "").unwrap();
    assert_eq!(dispatcher.close(LIMIT).await, Some(0));
    let calls = read(&folder, "calls");
    let rest: Vec<&str> = calls.lines().skip(4).collect();
    assert_eq!(rest, ["a/red firing"], "{calls}");
}

async fn deliver_once(config: &HookConfig, state: &Path) {
    let delivered = Delivered::of(Arc::new(Store::open(state).unwrap()));
    let dispatcher = Dispatcher::start(std::slice::from_ref(config), &quick_retry(), delivered);
    offer(&dispatcher, &alert());
    assert_eq!(dispatcher.close(LIMIT).await, Some(0));
}

#[tokio::test]
async fn what_a_hook_has_taken_is_not_sent_again_after_a_restart() {
    let (folder, config) = hook("echo call >> calls");
    let state = folder.path().join("state");
    deliver_once(&config, &state).await;
    deliver_once(&config, &state).await;
    assert_eq!(read(&folder, "calls"), "call\n");
    // The same alert at another hook is another delivery.
    let mut other = config.clone();
    other.run.push("--other".to_owned());
    deliver_once(&other, &state).await;
    assert_eq!(read(&folder, "calls"), "call\ncall\n");
}

#[tokio::test]
async fn closing_does_not_wait_longer_than_its_limit_and_leaves_nothing_running() {
    let (folder, config) = hook("sleep 90 & echo $! > pid; wait");
    let dispatcher = Dispatcher::start(&[config], &quick_retry(), Delivered::default());
    offer(&dispatcher, &alert());
    eventually("the hook's start", || read(&folder, "pid").ends_with('\n')).await;
    assert_eq!(dispatcher.close(Duration::from_millis(100)).await, None);
    let pid = read(&folder, "pid").trim().to_owned();
    eventually("the child's end", || !is_running(&pid)).await;
}

#[test]
fn the_sample_hook_says_it_in_one_line_for_a_person() {
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy/notify.sh");
    let output = std::process::Command::new(sample)
        .env("SLIPWATCH_STATUS", "Test")
        .env("SLIPWATCH_SITE", "Monte Toc")
        .env("SLIPWATCH_LEVEL", "red")
        .env("SLIPWATCH_STATE", "firing")
        .env("SLIPWATCH_BENCHMARK", "5")
        .env("SLIPWATCH_TIME", "2017-06-06T17:00:00Z")
        .env("SLIPWATCH_FAILURE_TIME", "")
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    assert_eq!(
        String::from_utf8(output.stdout).unwrap(),
        "[Test] Monte Toc: red called at benchmark 5, 2017-06-06T17:00:00Z\n"
    );
}

/// A siren that goes by the order alone is off while nothing is in force, and on while something is.
#[tokio::test]
async fn the_end_of_a_level_is_sent_before_the_level_that_follows_on_it_and_holds_it_up_but_once() {
    let ended = |mut alert: Alert| {
        alert.state = AlertState::Resolved.into();
        alert
    };
    for (ends, expected) in [
        ("", ["red firing", "red resolved", "orange firing"]),
        (
            "if [ $SLIPWATCH_STATE = resolved ] && [ $SLIPWATCH_ATTEMPT = 1 ]; then exit 1; fi\n",
            ["red firing", "orange firing", "red resolved"],
        ),
    ] {
        let script = format!(
            "{ends}[ -e begun ] || {{ touch begun; sleep 0.5; }}\necho $SLIPWATCH_LEVEL $SLIPWATCH_STATE >> calls\n"
        );
        let (folder, config) = hook(&script);
        let retry = Retry {
            first_delay: Duration::from_millis(300),
            ..quick_retry()
        };
        let hooks = std::slice::from_ref(&config);
        let dispatcher = Dispatcher::start(hooks, &retry, Delivered::default());
        let red = alert_of(Level::Red, "5/red/1", "");
        offer(&dispatcher, &red);
        eventually("the first run", || folder.path().join("begun").exists()).await;
        offer(&dispatcher, &ended(red));
        offer(&dispatcher, &alert_of(Level::Orange, "5/orange/2", ""));
        eventually("all", || read(&folder, "calls").lines().count() == 3).await;
        assert_eq!(read(&folder, "calls").lines().collect::<Vec<_>>(), expected);
        assert_eq!(dispatcher.close(LIMIT).await, Some(0));
    }
}
