//! Whom an alert reaches: what people have seen, silenced or put on duty, and that whoever received a beginning receives the end.

use crate::site::{Program, Site, eventually};
use jiff::{SignedDuration, Timestamp, tz::TimeZone};
use nix::sys::signal::Signal;
use slipwatch::runtime::clock;
use std::fs;
use std::time::Duration;

const LEVELS: &str = "[alert]\nevacuation_time = \"3h\"\n\
                      [[alert.threshold]]\nlevel = \"orange\"\nvelocity = \"20 mm/day\"\n\
                      [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";
/// A hook that writes what it receives into the file of its first argument.
const NOTES: &str = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> $1\n";
/// The same, which fails.
const FAILS: &str = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE $(date +%s) >> failed; exit 1\n";

/// A site whose benchmarks creep at 1 mm/day, with these hooks beside the first one.
fn site(benchmarks: &[String], hooks: &str) -> Site {
    let site = Site::new(&format!("{LEVELS}{hooks}"));
    fs::write(site.path("note.sh"), NOTES).unwrap();
    fs::write(site.path("fail.sh"), FAILS).unwrap();
    let names = benchmarks
        .iter()
        .map(|one| format!(",{one}_velocity_mm_per_day"));
    site.append(
        "incoming/all.csv",
        &format!("time{}\n", names.collect::<String>()),
    );
    for minutes in [55, 45, 35, 25, 15, 5] {
        let time = clock::now() - SignedDuration::from_mins(minutes);
        site.append("incoming/all.csv", &row(time, &vec![1.0; benchmarks.len()]));
    }
    site
}

fn one_benchmark(hooks: &str) -> Site {
    site(&["5".to_owned()], hooks)
}

fn row(time: Timestamp, velocities: &[f64]) -> String {
    let values = velocities.iter().map(|one| format!(",{one}"));
    format!("{time}{}\n", values.collect::<String>())
}

/// Benchmark 5 moves at this velocity now, mm/day.
fn moves(site: &Site, velocity: f64) {
    site.append("incoming/all.csv", &row(clock::now(), &[velocity]));
}

fn note(hook: &str) -> String {
    format!("[[hook]]\nrun = [\"/bin/sh\", \"note.sh\", \"{hook}\"]\n")
}

const FAILING: &str = "[[hook]]\nrun = [\"/bin/sh\", \"fail.sh\"]\nlevels = [\"red\"]\n";

pub(crate) fn alerts(site: &Site, words: &[&str]) {
    let more = ["--by", "Ada", "--config", "site.toml"];
    site.printed(&[&["alerts"], words, &more].concat());
}

fn resolves(site: &Site) {
    alerts(site, &["resolve", "--all", "--why", "a stone hit the wire"]);
}

/// Waits until an order stands in the events.
pub(crate) fn taken(site: &Site, order: &str) {
    eventually("that the order is taken", || {
        let events = [
            "events",
            "--kind",
            "order",
            "--format",
            "json",
            "--config",
            "site.toml",
        ];
        site.printed(&events).contains(&format!("\"{order}\""))
    });
    // What was under way then has ended.
    std::thread::sleep(Duration::from_millis(700));
}

/// Has the daemon take the config with these hooks as well.
fn reload_with(site: &Site, program: &Program, hooks: &str) {
    let before = site.log().matches("the config is taken").count();
    site.append("site.toml", hooks);
    program.signal(Signal::SIGHUP);
    eventually("that it is taken", || {
        site.log().matches("the config is taken").count() > before
    });
}

fn count(site: &Site, file: &str, what: &str) -> usize {
    let lines = site.lines(file);
    lines.iter().filter(|line| line.contains(what)).count()
}

/// How the red's delivery to a hook stands whose command line ends so.
fn standing(site: &Site, hook: &str) -> String {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let query = "SELECT status FROM outbox WHERE hook LIKE '%' || ?1 AND level = 'red' AND state = 'firing'";
    database
        .query_row(query, [hook], |row| row.get(0))
        .unwrap_or_default()
}

/// The daemon, after the failing hook has been run for the red of a benchmark so many times or more.
fn after_attempts(site: &Site, attempts: usize) -> Program {
    let program = site.caught_up();
    moves(site, 80.0);
    eventually("attempts", || count(site, "failed", "5/red/") >= attempts);
    program
}

#[test]
fn what_is_acknowledged_is_tried_no_more_also_after_a_restart_nor_sent_to_a_hook_that_a_reload_adds()
 {
    let site = one_benchmark(FAILING);
    let program = after_attempts(&site, 2);
    alerts(&site, &["ack", "--benchmark", "5"]);
    taken(&site, "acknowledge");
    let attempts = count(&site, "failed", "");
    assert_eq!(standing(&site, "fail.sh"), "acknowledged");
    reload_with(&site, &program, &note("added"));
    std::thread::sleep(Duration::from_secs(4));
    program.stop();
    let program = site.caught_up();
    std::thread::sleep(Duration::from_secs(2));
    program.stop();
    assert_eq!(
        count(&site, "failed", ""),
        attempts,
        "{:?}",
        site.lines("failed")
    );
    assert_eq!(site.lines("added"), [""; 0]);
    let record = site.printed(&["alerts", "show", "5/red", "--config", "site.toml"]);
    assert!(
        record.contains("fail.sh did not take it and is not tried again: somebody acknowledged it"),
        "{record}"
    );
    site.proven_events();
}

#[test]
fn a_silence_holds_for_a_hook_that_fails_and_for_one_that_a_reload_adds_until_it_is_over() {
    let site = one_benchmark(FAILING);
    let program = after_attempts(&site, 1);
    alerts(&site, &["silence", "--for", "1h"]);
    taken(&site, "silence");
    let attempts = count(&site, "failed", "");
    reload_with(&site, &program, &note("added"));
    std::thread::sleep(Duration::from_secs(4));
    program.stop();
    let program = site.caught_up();
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(
        count(&site, "failed", ""),
        attempts,
        "{:?}",
        site.lines("failed")
    );
    assert_eq!(site.lines("added"), [""; 0]);
    alerts(&site, &["unsilence"]);
    eventually("another attempt", || count(&site, "failed", "") > attempts);
    eventually("the added one", || count(&site, "added", "5/red/") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn a_silence_that_runs_out_by_itself_is_said_to_be_over() {
    let site = one_benchmark("");
    let program = site.caught_up();
    alerts(&site, &["silence", "--for", "5s"]);
    taken(&site, "silence");
    eventually("its end", || {
        site.log().contains("were not reported has ended")
    });
    program.stop();
}

/// From so long before now until so long after, by UTC; and its end.
fn hours(before: i64, after: i64) -> (String, Timestamp) {
    let time = |seconds: i64| clock::now() + SignedDuration::from_secs(seconds);
    let word = |time: Timestamp| {
        let time = time.round(jiff::Unit::Second).unwrap();
        time.to_zoned(TimeZone::UTC).time().to_string()
    };
    let (from, until) = (time(-before), time(after));
    (
        format!("hours = [\"{}-{}\"]\n", word(from), word(until)),
        until,
    )
}

#[test]
fn what_waits_for_the_next_shift_outlasts_a_silence_and_nobody_is_said_to_have_acknowledged_it() {
    let (begins, _) = hours(-15, 3600);
    let site = one_benchmark(&format!("{}levels = [\"red\"]\n{begins}", note("office")));
    let program = site.caught_up();
    moves(&site, 80.0);
    site.awaits_red();
    alerts(&site, &["silence", "--for", "1s"]);
    taken(&site, "silence");
    assert_eq!(standing(&site, "office"), "waiting");
    eventually("the office", || count(&site, "office", "5/red/") == 1);
    eventually("its receipt", || standing(&site, "office") == "delivered");
    program.stop();
}

#[test]
fn after_the_end_of_a_shift_nothing_is_tried_again_and_nothing_is_escalated() {
    let (duty, until) = hours(60, 10);
    let site = one_benchmark(&format!(
        "{FAILING}{duty}{}levels = [\"red\"]\nescalate_after = \"12s\"\n{duty}",
        note("chief")
    ));
    let program = after_attempts(&site, 1);
    while clock::now() < until + SignedDuration::from_secs(16) {
        std::thread::sleep(Duration::from_millis(200));
    }
    program.stop();
    let late = site.lines("failed").into_iter().filter(|line| {
        let at: i64 = line.rsplit(' ').next().unwrap().parse().unwrap();
        at > until.as_second() + 1
    });
    assert_eq!(late.count(), 0, "{:?}", site.lines("failed"));
    assert_eq!(site.lines("chief"), [""; 0]);
}

#[test]
fn who_received_orange_receives_its_end_where_the_red_between_did_not_reach_them() {
    let site = one_benchmark(&format!(
        "{}levels = [\"orange\"]\n{}levels = [\"orange\", \"red\"]\nescalate_after = \"5s\"\n\
         [[cap]]\nfolder = \"cap\"\nsender = \"toc@example.org\"\narea = \"Toc\"\nlevels = [\"orange\"]\n",
        note("orange"),
        note("escalated"),
    ));
    let program = site.caught_up();
    moves(&site, 30.0);
    for file in ["orange", "escalated"] {
        eventually("the orange", || count(&site, file, "5/orange/") == 1);
    }
    moves(&site, 80.0);
    site.awaits_red();
    resolves(&site);
    for file in ["orange", "escalated"] {
        eventually("its end", || count(&site, file, " resolved") == 1);
        let [begins, ends] = &site.lines(file)[..] else {
            panic!("{:?}", site.lines(file));
        };
        let key = |line: &str| line.split(' ').next().unwrap().to_owned();
        assert_eq!(key(begins), key(ends), "{file}");
    }
    eventually("the CAP message", || {
        let files = fs::read_dir(site.path("cap"))
            .unwrap()
            .map(|file| file.unwrap().path());
        let mut texts = files.filter_map(|file| fs::read_to_string(file).ok());
        texts.any(|text| text.contains("<msgType>Cancel</msgType>"))
    });
    std::thread::sleep(Duration::from_secs(6));
    program.stop();
    assert_eq!(
        count(&site, "escalated", ""),
        2,
        "{:?}",
        site.lines("escalated")
    );
    // Who received the red receives one end, the red's.
    assert_eq!(site.notified("5/red/", "resolved"), 1);
    assert_eq!(site.notified("5/orange/", "resolved"), 0);
    site.proven_events();
}

/// Benchmarks b0 to b39, which move together, and the village, which does not.
fn forty_and_the_village() -> Vec<String> {
    let forty = (0..40).map(|one| format!("b{one}"));
    forty.chain(["village".to_owned()]).collect()
}

fn forty_move(site: &Site) {
    let mut velocities = vec![80.0; 40];
    velocities.push(1.0);
    site.append("incoming/all.csv", &row(clock::now(), &velocities));
}

#[test]
fn a_flood_keeps_its_key_to_its_end_and_a_hook_of_some_benchmarks_receives_these_singly() {
    let some = |file: &str, which: &str| {
        format!("{}levels = [\"red\"]\nbenchmarks = [{which}]\n", note(file))
    };
    let site = site(
        &forty_and_the_village(),
        &format!(
            "{}{}[[cap]]\nfolder = \"cap\"\nsender = \"toc@example.org\"\narea = \"Toc\"\nlevels = [\"red\"]\n",
            some("village", "\"village\""),
            some("two", "\"b3\", \"b39\""),
        ),
    );
    let program = site.caught_up();
    forty_move(&site);
    eventually("the flood", || site.notified("flood/", "firing") == 1);
    eventually("both", || count(&site, "two", "firing") == 2);
    program.stop();
    let program = site.caught_up();
    resolves(&site);
    eventually("the flood's end", || {
        site.notified("flood/", "resolved") == 1
    });
    eventually("both ends", || count(&site, "two", "resolved") == 2);
    let messages = |kind: &str| {
        let files = fs::read_dir(site.path("cap"))
            .unwrap()
            .map(|file| file.unwrap().path());
        let texts = files.filter_map(|file| fs::read_to_string(file).ok());
        texts
            .filter(|text| text.contains(&format!("<msgType>{kind}</msgType>")))
            .count()
    };
    eventually("as many CAP messages", || {
        (messages("Alert"), messages("Cancel")) == (11, 11)
    });
    for headline in [
        "Toc, 30 more benchmarks: red",
        "Toc, 30 more benchmarks: red ends",
    ] {
        let wanted = format!("<headline>{headline}</headline>");
        let files = fs::read_dir(site.path("cap"))
            .unwrap()
            .map(|file| file.unwrap().path());
        let texts = files.filter_map(|file| fs::read_to_string(file).ok());
        assert_eq!(
            texts.filter(|text| text.contains(&wanted)).count(),
            1,
            "{headline}"
        );
    }
    program.stop();
    let lines = site.lines("notified");
    let keys: Vec<&str> = (lines.iter())
        .filter(|line| line.starts_with("flood/"))
        .map(|line| line.split(' ').next().unwrap())
        .collect();
    assert!(keys.len() == 2 && keys[0] == keys[1], "{keys:?}");
    assert_eq!(
        (lines.len(), site.lines("village").len()),
        (22, 0),
        "{lines:?}"
    );
    received_two_of_the_forty(&site, "two");
    site.proven_events();
}

/// The hook that writes this file received beginning and end of b3 and of b39, and nothing else.
fn received_two_of_the_forty(site: &Site, file: &str) {
    let lines = site.lines(file);
    let of = |name: &str| lines.iter().filter(|line| line.starts_with(name)).count();
    assert_eq!(
        (lines.len(), of("b3/red/"), of("b39/red/")),
        (4, 2, 2),
        "{lines:?}"
    );
}

/// A hook that fails as long as the file `works` is not there.
const FLAKY: &str = "[ -e works ] && echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> flaky\n";

#[test]
fn a_hook_that_a_reload_has_ask_for_some_benchmarks_receives_these_of_a_flood_that_it_has_not_taken()
 {
    for restarts in [false, true] {
        let hook = "[[hook]]\nrun = [\"/bin/sh\", \"flaky.sh\"]\nlevels = [\"red\"]\n";
        let site = site(&forty_and_the_village(), hook);
        fs::write(site.path("flaky.sh"), FLAKY).unwrap();
        let program = site.caught_up();
        forty_move(&site);
        eventually("the flood", || site.notified("flood/", "firing") == 1);
        let config = fs::read_to_string(site.path("site.toml")).unwrap();
        let some = format!("{hook}benchmarks = [\"b3\", \"b39\", \"village\"]\n");
        fs::write(site.path("site.toml"), config.replace(hook, &some)).unwrap();
        let program = if restarts {
            program.stop();
            site.caught_up()
        } else {
            program.signal(Signal::SIGHUP);
            eventually("the config", || site.log().contains("the config is taken"));
            program
        };
        fs::write(site.path("works"), "").unwrap();
        eventually("both", || count(&site, "flaky", "firing") == 2);
        resolves(&site);
        eventually("both ends", || count(&site, "flaky", "resolved") == 2);
        program.stop();
        received_two_of_the_forty(&site, "flaky");
        site.proven_events();
    }
}

#[test]
fn a_flood_that_is_over_before_its_escalation_is_not_escalated() {
    let site = site(
        &forty_and_the_village(),
        &format!(
            "{}levels = [\"red\"]\nescalate_after = \"8s\"\n",
            note("escalated")
        ),
    );
    let program = site.caught_up();
    forty_move(&site);
    eventually("the flood", || site.notified("flood/", "firing") == 1);
    resolves(&site);
    eventually("the flood's end", || {
        site.notified("flood/", "resolved") == 1
    });
    std::thread::sleep(Duration::from_secs(10));
    program.stop();
    assert_eq!(site.lines("escalated"), [""; 0]);
}

#[test]
fn the_silence_of_the_whole_site_is_not_ended_for_one_benchmark_without_a_word() {
    let site = one_benchmark("");
    let program = site.caught_up();
    alerts(&site, &["silence", "--for", "1h"]);
    taken(&site, "silence");
    let refused = site.ask(&[
        "alerts",
        "unsilence",
        "--benchmark",
        "5",
        "--config",
        "site.toml",
    ]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(
        said.contains("the whole site is silenced") && said.contains("Ada"),
        "{said}"
    );
    alerts(&site, &["unsilence"]);
    taken(&site, "unsilence");
    alerts(&site, &["unsilence", "--benchmark", "5"]);
    program.stop();
}

#[test]
fn what_is_over_is_not_delivered_again_as_if_it_were_in_force() {
    let site = one_benchmark(FAILING);
    let program = after_attempts(&site, 1);
    let right = fs::read_to_string(site.path("site.toml")).unwrap();
    fs::write(site.path("site.toml"), right.replace(FAILING, "")).unwrap();
    reload_with(&site, &program, "");
    assert_eq!(standing(&site, "fail.sh"), "closed");
    let redeliver = || site.printed(&["alerts", "redeliver", "--config", "site.toml"]);
    let again = |said: &str, left_out: bool| {
        assert_eq!(
            said.contains("1 are left out: their alerts are over"),
            left_out,
            "{said}"
        );
    };
    resolves(&site);
    eventually("its end", || site.notified("5/red/", "resolved") == 1);
    again(&redeliver(), true);
    fs::write(site.path("site.toml"), &right).unwrap();
    fs::write(
        site.path("fail.sh"),
        "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> mended\n",
    )
    .unwrap();
    reload_with(&site, &program, "");
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(
        count(&site, "mended", "firing"),
        0,
        "{:?}",
        site.lines("mended")
    );
    program.stop();
}
