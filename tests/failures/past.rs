//! A first start on history, and rows that are read again.

use crate::notified::failing;
use crate::site::{Site, eventually};
use jiff::SignedDuration;
use slipwatch::runtime::clock;
use std::collections::BTreeMap;
use std::fs;

const HEADER: &str = "time,displacement_mm\n";
const BENCHMARKS: i32 = 6;
const ROWS: i32 = 120;

/// Hourly creep of each benchmark, and eight covariates.
fn history() -> Site {
    let site = Site::new("");
    let start = clock::now() - SignedDuration::from_hours(i64::from(ROWS));
    let time = |row: i32| start + SignedDuration::from_hours(i64::from(row));
    for benchmark in 0..BENCHMARKS {
        let rows: String = (0..ROWS)
            .map(|row| {
                let jitter = f64::from((row * 37 + benchmark) % 11) / 50.0;
                format!("{},{:.3}\n", time(row), 0.1 * f64::from(row) + jitter)
            })
            .collect();
        site.append(
            &format!("incoming/{benchmark}.csv"),
            &format!("{HEADER}{rows}"),
        );
    }
    let names: String = (0..8).map(|one| format!(",c{one}_mm")).collect();
    let rows: String = (0..ROWS)
        .map(|row| {
            let values: String = (0..8)
                .map(|one| format!(",{}", (row * (7 + one)) % 13))
                .collect();
            format!("{}{values}\n", time(row))
        })
        .collect();
    site.append("incoming/weather.csv", &format!("time{names}\n{rows}"));
    site
}

/// The benchmark and the time of each refit, in the order in which they were said.
fn refits(site: &Site) -> Vec<(String, String)> {
    let said = site.events();
    let events = said.lines().map(|line| serde_json::from_str(line).unwrap());
    let refits = events.filter(|event: &serde_json::Value| event["event"] == "refit");
    let of = |event: serde_json::Value| {
        let text = |name: &str| event[name].as_str().unwrap().to_owned();
        (text("benchmark"), text("time"))
    };
    refits.map(of).collect()
}

/// 24. What is current comes first; the refits of the past come after it, also through kills.
#[test]
fn a_first_start_judges_what_is_current_before_it_makes_the_refits_of_the_past_and_makes_them_all()
{
    let site = history();
    let newest: BTreeMap<String, String> = site_newest(&site);
    let program = site.caught_up();
    eventually("some refits of the past", || {
        refits(&site).len() > BENCHMARKS as usize + 20
    });
    let first: BTreeMap<String, String> = refits(&site)
        .into_iter()
        .take(BENCHMARKS as usize)
        .collect();
    assert_eq!(first, newest);
    drop(program);
    let program = site.start(&[]);
    // From the tenth reading on each leads to one.
    let all = (BENCHMARKS * (ROWS - 9)) as usize;
    eventually("all refits of the past", || refits(&site).len() == all);
    program.stop();
    let mut once = refits(&site);
    once.sort();
    once.dedup();
    assert_eq!(once.len(), all, "made twice");
    site.proven_events();
}

/// As a power cut leaves it: what takes minutes to judge on a first start is not to keep the next start from reading.
#[test]
fn the_past_that_has_been_judged_is_not_judged_again_after_a_kill() {
    let site = history();
    let program = site.caught_up();
    eventually("that it is judged", || {
        site.log()
            .contains("before the first start has been judged")
    });
    drop(program);
    site.caught_up().stop();
    let log = site.log();
    let replayed = log
        .lines()
        .rfind(|line| line.contains("stored steps replayed"));
    let (_, steps) = replayed.unwrap().split_once("steps=").unwrap();
    let steps: usize = steps.split_once(' ').unwrap().0.parse().unwrap();
    assert!(steps < 10, "{steps} steps: {log}");
    site.proven_events();
}

fn site_newest(site: &Site) -> BTreeMap<String, String> {
    let newest = (0..BENCHMARKS).map(|benchmark| {
        let text = fs::read_to_string(site.path(&format!("incoming/{benchmark}.csv"))).unwrap();
        let last = text.lines().last().unwrap();
        let (time, _) = last.split_once(',').unwrap();
        (benchmark.to_string(), time.to_owned())
    });
    newest.collect()
}

/// Ten hours at twice the threshold, and twenty of creep: no evacuation time yet.
fn past_red(hooks: &str) -> Site {
    let site = Site::new(&format!(
        "[alert]\nevacuation_time = \"24h\"\n\
         [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"100 mm/day\"\n{hooks}"
    ));
    let start = clock::now() - SignedDuration::from_hours(59);
    let rows: String = (0..60_i64)
        .map(|hour| {
            let crisis = 10.0 * (hour.clamp(30, 40) - 30) as f64;
            let jitter = ((hour * 37) % 11) as f64 / 50.0;
            let time = start + SignedDuration::from_hours(hour);
            format!("{time},{:.3}\n", 0.1 * hour as f64 + crisis + jitter)
        })
        .collect();
    site.append("incoming/5.csv", &format!("{HEADER}{rows}"));
    site
}

#[test]
fn a_red_of_the_past_that_nothing_has_ended_is_reported_after_a_first_start() {
    let site = past_red("");
    let listen = site.listen();
    let program = site.caught_up();
    eventually("the red notified", || site.notified("5/red/", "firing") > 0);
    // The page says since when, and not when it was found.
    let notified = site.lines("notified");
    let red = notified.iter().find(|line| line.starts_with("5/red/"));
    let since = red.unwrap().trim_start_matches("5/red/").split(' ').next();
    let said = format!("\"since\":\"{}\"", since.unwrap());
    let shown = crate::site::get(&listen, "/api/site");
    assert!(shown.contains(&said), "{said}: {shown}");
    program.stop();
    site.proven_events();
}

#[test]
fn a_hook_of_the_whole_site_is_notified_of_a_red_of_the_past_too() {
    let hook = "[[hook]]\nsite = true\nlevels = [\"red\"]\nrun = [\"/bin/sh\", \"hook.sh\"]\n";
    let site = past_red(hook);
    let program = site.caught_up();
    eventually("the site's red notified", || {
        site.notified("site/red/", "firing") == 1
    });
    program.stop();
    site.proven_events();
}

/// A benchmark that is added with its history while others are watched: its newest reading is judged first, and the refits of its
/// past keep nothing else waiting.
#[test]
fn the_history_of_a_benchmark_that_is_added_is_taken_as_on_a_first_start() {
    let site = history();
    let program = site.caught_up();
    let all = (BENCHMARKS * (ROWS - 9)) as usize;
    eventually("all refits of the past", || refits(&site).len() == all);
    let added = fs::read_to_string(site.path("incoming/0.csv")).unwrap();
    fs::write(site.path("added.csv"), &added).unwrap();
    fs::rename(site.path("added.csv"), site.path("incoming/added.csv")).unwrap();
    let of_added = || {
        let made = refits(&site).into_iter();
        let of_added = made.filter(|(benchmark, _)| benchmark == "added");
        of_added.map(|(_, time)| time).collect::<Vec<_>>()
    };
    let expected = (ROWS - 9) as usize;
    eventually("all refits of the one that was added", || {
        of_added().len() == expected
    });
    let (newest, _) = added.lines().last().unwrap().split_once(',').unwrap();
    assert_eq!(of_added()[0], newest);
    program.stop();
    site.proven_events();
}

/// A file with a row and its correction, read again; and a row that is corrected back.
#[test]
fn a_row_and_its_correction_that_are_read_again_are_taken_once_and_a_value_corrected_back_counts() {
    let site = Site::new("");
    let rows: Vec<String> = failing(0..20).lines().map(str::to_owned).collect();
    let (time, _) = rows[19].split_once(',').unwrap();
    let text = format!("{HEADER}{}\n{time},77.5\n", rows.join("\n"));
    site.append("incoming/5.csv", &text);
    let program = site.caught_up();
    eventually("all rows", || site.values().len() == 21);
    // The same in another file, put in its place: read from its start.
    fs::write(site.path("new"), &text).unwrap();
    fs::rename(site.path("new"), site.path("incoming/5.csv")).unwrap();
    let next = clock::now();
    site.append("incoming/5.csv", &format!("{next},78\n"));
    eventually("the next row", || site.values().len() >= 22);
    assert_eq!(site.values().len(), 22, "taken twice");
    site.append("incoming/5.csv", &format!("{}\n", rows[19]));
    eventually("the value corrected back", || site.values().len() == 23);
    program.stop();
    site.proven_events();
}

#[test]
fn a_red_that_people_resolve_before_the_past_is_judged_stays_resolved_and_the_next_reading_calls_another()
 {
    let site = Site::new(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n[alert]\n\
         [[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"50 mm\"\n",
    );
    let start = clock::now() - SignedDuration::from_hours(1000);
    let rows: String = (0..1000)
        .map(|row| {
            let time = start + SignedDuration::from_hours(i64::from(row));
            format!("{time},{:.2}\n", 0.01 * f64::from(row))
        })
        .collect();
    site.append("incoming/5.csv", &format!("{HEADER}{rows}"));
    let program = site.caught_up();
    let is_judged = || {
        site.log()
            .contains("before the first start has been judged")
    };
    site.append("incoming/5.csv", &format!("{},110\n", clock::now()));
    eventually("its red", || site.notified("5/red/", "firing") == 1);
    let order = ["alerts", "resolve", "--benchmark", "5", "--by", "q"];
    let why = ["--why", "a rockfall hit the wire", "--config", "site.toml"];
    site.printed(&[&order[..], &why].concat());
    eventually("its end", || site.notified("5/red/", "resolved") == 1);
    assert!(!is_judged(), "the past is too short for this test");
    eventually("the past", is_judged);
    site.append("incoming/5.csv", &format!("{},111\n", clock::now()));
    eventually("red again", || site.notified("5/red/", "firing") == 2);
    program.stop();
    site.proven_events();
}

/// What rows have come while the daemon was down is not judged row by row: the last one would have to wait for all.
#[test]
fn what_files_have_got_while_the_daemon_was_down_is_judged_for_its_newest() {
    let site = Site::new(
        "[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"100 mm\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"-c\", \"echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\"]\n",
    );
    let begins = clock::now() - SignedDuration::from_hours(40);
    let row = |minute: i64, more: f64| {
        let time = begins + SignedDuration::from_mins(minute);
        let jitter = (minute * 37 % 11) as f64 / 50.0;
        format!("{time},{:.3}\n", jitter + more)
    };
    let before: String = (0..60).map(|hour| row(20 * hour, 0.0)).collect();
    site.append("incoming/5.csv", &format!("{HEADER}{before}"));
    let program = site.caught_up();
    eventually("that the past is judged", || {
        site.log()
            .contains("before the first start has been judged")
    });
    program.stop();
    let known = refits(&site).len();
    let down: String = (0..1100).map(|minute| row(1201 + minute, 0.0)).collect();
    site.append("incoming/5.csv", &(down + &row(2390, 200.0)));
    let program = site.caught_up();
    eventually("the red of the last row", || {
        site.lines("notified")
            .iter()
            .any(|line| line.starts_with("5/red/") && line.ends_with("firing"))
    });
    program.stop();
    let refits = refits(&site).len() - known;
    assert!(
        (1..=110).contains(&refits),
        "{refits} refits for 1101 readings"
    );
    site.proven_events();
}
