//! What a person is to know at once: readings of another site, figures of another time, coordinates, rain as a total, rows that
//! are refused.

use crate::office::{Office, site};
use jiff::SignedDuration;
use serde_json::Value;
use slipwatch::reading::Timestamp;
use slipwatch::runtime::clock;
use std::fmt::Write as _;
use std::fs;

const ROWS: i32 = 150;
const START: &str = "2020-01-01T00:00:00Z";

/// A number within a half of zero that looks drawn.
fn drawn(row: i32) -> f64 {
    f64::from((row * 7919 + 104) % 1009) / 1009.0 - 0.5
}

/// Hourly readings up to `ends` from now, on the way to a collapse after 250 of them.
fn to_collapse(slip_mm: f64, ends: SignedDuration) -> String {
    let newest = clock::now() + ends;
    (0..ROWS).fold("time,P1_displacement_mm\n".to_owned(), |mut text, row| {
        let time = newest - SignedDuration::from_hours(i64::from(ROWS - 1 - row));
        let value = -slip_mm * (1.0 - f64::from(row) / 250.0).ln() + 0.05 * drawn(row);
        let _ = writeln!(text, "{time:.0},{value:.4}");
        text
    })
}

fn json(office: &Office, args: &[&str]) -> Value {
    let args = [args, &["--config", "site.toml", "--format", "json"]].concat();
    serde_json::from_str(&office.done(&args)).unwrap()
}

fn lines(office: &Office, args: &[&str]) -> Vec<Value> {
    let args = [args, &["--config", "site.toml", "--format", "json"]].concat();
    let said = office.done(&args);
    said.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Runs the daemon until it has gone through the past.
fn run(office: &Office) {
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.until("all is read", || office.log().contains("caught up"));
    office.until("the past is gone through", || {
        office
            .log()
            .contains("before the first start has been judged")
            || !office.log().contains("of=0")
    });
    drop(daemon);
}

/// All that `check` says of the site.
fn by_check(office: &Office) -> String {
    let (_, out, err) = office.say(&["check", "site.toml"]);
    format!("{out}{err}")
}

fn contains_all(said: &str, parts: &[&str]) {
    for part in parts {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
}

#[test]
fn the_readings_of_another_site_in_the_state_are_named_and_init_does_not_take_them_unasked() {
    let (newest, later) = (
        SignedDuration::from_mins(-90),
        SignedDuration::from_mins(-40),
    );
    let office = Office::with(&[
        ("a.csv", &to_collapse(10.0, newest)),
        ("b.csv", &to_collapse(1.0, later)),
    ]);
    office.done(&["init", "a.csv"]);
    run(&office);
    let events = ["events", "--config", "site.toml", "--benchmark"];
    office.done(&[&events[..], &["P1"]].concat());
    let said = office.refused(1, &[&events[..], &["p1"]].concat());
    contains_all(&said, &["there is no benchmark p1"]);
    let (_, _, err) = office.say(&["check", "site.toml"]);
    assert!(!err.contains("state folder"), "{err}");
    let said = office.refused(2, &["init", "b.csv", "--force"]);
    contains_all(
        &said,
        &[
            "150 readings of P1",
            "a.csv",
            "--state-dir \"state-b\"",
            "--state-dir state ",
        ],
    );
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    assert!(config.contains("a.csv"), "{config}");
    office.done(&["init", "b.csv", "--force", "--state-dir", "state-b"]);
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    contains_all(&config, &["state_dir = \"state-b\"", "b.csv"]);
    let (exit, _, err) = office.say(&["init", "b.csv", "--force", "--state-dir", "state"]);
    let wanted = [
        "150 readings of P1 that were read from",
        "a.csv",
        "no source of this config reads",
    ];
    assert_eq!(exit, 0, "{err}");
    contains_all(&err, &wanted);
    let (_, _, err) = office.say(&["check", "site.toml"]);
    contains_all(&err, &wanted);
    let (_, out, _) = office.say(&["doctor", "site.toml"]);
    contains_all(&out, &["doubtful  state: state folder", wanted[0]]);
    run(&office);
    contains_all(&office.log(), &wanted);
    let events = office.done(&["events", "--config", "site.toml", "--kind", "fault"]);
    contains_all(&events, &["150 readings of P1 that were read from"]);
    let (_, _, err) = office.say(&["check", "site.toml"]);
    contains_all(
        &err,
        &["300 readings of P1, a part of which was read from", "a.csv"],
    );
    // Once is enough.
    run(&office);
    let faults = lines(&office, &["events", "--kind", "fault"]);
    let inherited = faults
        .iter()
        .filter(|event| event["kind"] == "inherited-readings");
    assert_eq!(inherited.count(), 1, "{faults:?}");
}

#[test]
fn a_file_that_was_renamed_or_whose_folder_was_moved_is_no_other_site() {
    let office = Office::with(&[("a.csv", &to_collapse(10.0, SignedDuration::from_mins(-90)))]);
    office.done(&["init", "a.csv"]);
    run(&office);
    fs::copy(office.path("a.csv"), office.path("c.csv")).unwrap();
    fs::remove_file(office.path("a.csv")).unwrap();
    let (exit, _, err) = office.say(&["init", "c.csv", "--force"]);
    assert_eq!(exit, 0, "{err}");
    assert!(!err.contains("state folder"), "{err}");
}

#[test]
fn after_a_first_start_on_history_a_level_its_date_and_its_figures_are_of_one_time() {
    let office = Office::with(&[("a.csv", &to_collapse(10.0, SignedDuration::from_mins(-10)))]);
    office.done(&["init", "a.csv"]);
    run(&office);
    let called = |event: &&Value| event["benchmark"] == "P1" && event["level"] == "orange";
    let list = lines(&office, &["alerts", "list"]);
    let alert = list.iter().find(called).unwrap();
    let events = lines(&office, &["events", "--kind", "alert"]);
    let of_then = |event: &&Value| called(event) && event["time"] == alert["time"];
    let then = events.iter().find(of_then).unwrap();
    let newest = events.iter().find(called).unwrap();
    assert_ne!(
        newest["time"], then["time"],
        "the past called nothing: {events:?}"
    );
    assert_ne!(newest["text"], then["text"], "{events:?}");
    assert_eq!(alert["text"], then["text"]);
    assert_eq!(alert["key"], newest["key"], "what hooks were notified of");
    let status = json(&office, &["status"]);
    let one = &status["benchmarks"][0];
    assert_eq!(
        (&one["since"], &one["reason"]),
        (&then["time"], &then["text"])
    );
    let shown = json(&office, &["alerts", "show", "P1/orange"]);
    assert_eq!(
        (&shown["since"], &shown["text"]),
        (&then["time"], &then["text"])
    );
    assert_eq!(shown["evidence"]["time"], then["time"], "{shown}");
    assert_eq!(
        (&shown["key"], &shown["state"]),
        (&alert["key"], &"firing".into())
    );
    let time = then["time"].as_str().unwrap().parse::<Timestamp>().unwrap();
    let said = office.done(&["alerts", "show", "P1/orange", "--config", "site.toml"]);
    let since = format!("in force since {}", time.strftime("%Y-%m-%d %H:%MZ"));
    contains_all(&said, &[&since, then["text"].as_str().unwrap()]);
}

const VECTOR: &str = "[[benchmark]]\nid = \"G1\"\nsource = \"logger\"\ncomponents = [\"G1_E_m\", \"G1_N_m\"]\ndirection = [0.7, 0.7]\n";

/// Hourly coordinates, m, on the way to a collapse.
fn coordinates(east: f64, north: f64) -> String {
    let start = START.parse::<Timestamp>().unwrap();
    (0..ROWS).fold("time,G1_E_m,G1_N_m,G2_E_m\n".to_owned(), |mut text, row| {
        let time = start + SignedDuration::from_hours(i64::from(row));
        let slip = -0.01 * (1.0 - f64::from(row) / 250.0).ln() + 5e-5 * drawn(row);
        let _ = writeln!(text, "{time},{:.6},{:.6},1", east + slip, north + slip);
        text
    })
}

#[test]
fn coordinates_of_a_map_projection_are_readings_and_what_is_too_large_is_named_itself() {
    let velocity = |text: &str| {
        let office = Office::with(&[("n.csv", text), ("site.toml", &site("n.csv", VECTOR))]);
        let (exit, out, err) = office.say(&["check", "site.toml"]);
        assert_eq!(exit, 0, "{out}{err}");
        let said = office.done(&[
            "replay",
            "n.csv",
            "--config",
            "site.toml",
            "--format",
            "json",
        ]);
        let mut events = said
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).unwrap());
        let newest = events.rfind(|event| event["event"] == "refit").unwrap();
        newest["velocity_mm_per_day"].as_f64().unwrap()
    };
    let local = velocity(&coordinates(0.0, 0.0));
    // UTM with the number of the zone before the easting.
    let far = velocity(&coordinates(32_612_345.0, 9_999_999.0));
    assert!((far / local - 1.0).abs() < 1e-3, "{far} {local}");
    let office = Office::with(&[("n.csv", &coordinates(612_345.0, 5_123_456.0))]);
    let said = office.done(&["init", "n.csv", "--column", "G1_N_m=G1:displacement:m"]);
    assert!(said.contains("150 readings of displacement"), "{said}");
    let code = coordinates(612_345.0, 1e30);
    let office = Office::with(&[("n.csv", &code), ("site.toml", &site("n.csv", VECTOR))]);
    let (exit, out, err) = office.say(&["check", "site.toml"]);
    assert_eq!(exit, 1, "{out}{err}");
    contains_all(&out, &["column \"G1_N_m\"", "1e11 mm"]);
    assert!(!out.contains("column \"G1_E_m\": found"), "{out}");
    assert!(!err.contains("mark of no value"), "{err}");
}

/// Daily creep that rain drives, and rain as `given`, from the day's and the sum before it.
fn in_the_rain(name: &str, given: impl Fn(i32, f64, &mut f64) -> f64) -> String {
    let start = START.parse::<Timestamp>().unwrap();
    let (mut total, mut soaked, mut moved) = (0.0, 0.0, 0.0);
    (0..360).fold(
        format!("time,P1_displacement_mm,{name}\n"),
        |mut text, day| {
            let time = start + SignedDuration::from_hours(24 * i64::from(day));
            let rain = if (day * 7919 + 13) % 7 < 2 {
                20.0 + 30.0 * drawn(day)
            } else {
                0.0
            };
            soaked += rain - soaked / 7.0;
            moved += 0.05 + 0.002 * soaked;
            let value = given(day, rain, &mut total);
            let _ = writeln!(
                text,
                "{time},{:.3},{value:.1}",
                moved + 0.1 * drawn(day + 500)
            );
            text
        },
    )
}

fn add(rain: f64, total: &mut f64) -> f64 {
    *total += rain;
    *total
}

fn set_back_on_day_200(day: i32, rain: f64, total: &mut f64) -> f64 {
    if day == 200 {
        *total = 0.0;
    }
    add(rain, total)
}

#[test]
fn check_names_a_total_of_rain_that_is_set_back_and_codes_in_a_covariate() {
    let check = |text: &str| {
        let office = Office::with(&[("slope.csv", text), ("site.toml", &site("slope.csv", ""))]);
        let (exit, out, err) = office.say(&["check", "site.toml"]);
        assert_eq!(exit, 0, "{out}{err}");
        (out, err)
    };
    let (out, _) = check(&in_the_rain("rain_mm", |_, rain, _| rain));
    assert!(
        !out.contains("running total") && !out.contains("suspicion"),
        "{out}"
    );
    let (out, _) = check(&in_the_rain("rain_cum_mm", |_, rain, total| {
        add(rain, total)
    }));
    assert!(
        out.contains("a running total of rain, which is never set back"),
        "{out}"
    );
    let (out, _) = check(&in_the_rain("rain_cum_mm", set_back_on_day_200));
    contains_all(
        &out,
        &["a running total of rain, set back once, first at 2020-07-19T00:00:00Z"],
    );
    for name in ["rain_mm", "lake_level_m", "Temp"] {
        let coded = |day: i32, rain: f64, _: &mut f64| if day % 30 == 7 { -9999.0 } else { rain };
        let (out, err) = check(&in_the_rain(name, coded));
        contains_all(&out, &["suspicion: -9999 stands 12 times"]);
        contains_all(
            &err,
            &[
                &format!("covariate {name:?}: -9999 stands 12 times"),
                "missing = [-9999]",
            ],
        );
    }
}

#[test]
fn explain_goes_on_from_what_a_total_of_rain_was_when_it_is_set_back() {
    let explain = |text: &str| {
        let office = Office::with(&[("slope.csv", text)]);
        let said = office.done(&["explain", "slope.csv", "--format", "json"]);
        serde_json::from_str::<Value>(&said).unwrap()
    };
    let whole = explain(&in_the_rain("rain_cum_mm", |_, rain, total| {
        add(rain, total)
    }));
    let broken = explain(&in_the_rain("rain_cum_mm", set_back_on_day_200));
    assert!(
        broken.to_string().contains("rain_cum_mm: its zero jumps"),
        "{broken}"
    );
    assert!(broken.to_string().contains("covariate-reset"), "{broken}");
    assert!(!whole.to_string().contains("covariate-reset"), "{whole}");
    let (broken, whole) = (&broken["verdict"], &whole["verdict"]);
    for key in ["effect", "channel", "form"] {
        assert_eq!(broken[key], whole[key]);
    }
    let lag = |verdict: &Value| verdict["lag_days"].as_f64().unwrap();
    assert!(
        (lag(broken) - lag(whole)).abs() <= 0.02 * lag(whole),
        "{broken} {whole}"
    );
}

/// So many rows in mm, and then more under a header in m.
fn with_another_unit() -> String {
    let start = START.parse::<Timestamp>().unwrap();
    (0..300).fold("time,P1_displacement_mm\n".to_owned(), |mut text, row| {
        if row == 100 {
            text += "time,P1_displacement_m\n";
        }
        let value = 0.5 * f64::from(row) + drawn(row);
        let value = if row < 100 { value } else { value / 1e3 };
        let _ = writeln!(
            text,
            "{},{value:.6}",
            start + SignedDuration::from_hours(i64::from(row))
        );
        text
    })
}

#[test]
fn a_unit_that_changes_with_a_header_is_converted_and_what_is_refused_at_the_end_is_said_by_check()
{
    let office = Office::with(&[("uc.csv", &with_another_unit())]);
    let said = office.done(&["init", "uc.csv"]);
    contains_all(
        &said,
        &[
            "300 readings of displacement",
            "line 102: a header that comes again has \"P1_displacement_m\" in m",
        ],
    );
    let last: f64 = said
        .lines()
        .find_map(|line| line.trim().strip_prefix("last ")?.split_whitespace().nth(1))
        .and_then(|value| value.parse().ok())
        .unwrap();
    assert!((149.0..151.0).contains(&last), "{said}");
    // Rows that are wrong in another way, to the end; and such that are followed by good ones.
    let mut text = crate::office::plain(40);
    for row in 0..9 {
        let _ = writeln!(text, "2017-06-03T{row:02}:00:00Z;1;2");
    }
    let broken = ["line 42 on all rows are refused (9 of them)"];
    for (more, is_said) in [("", true), ("2017-06-04T00:00:00Z,20\n", false)] {
        let text = format!("{text}{more}");
        let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
        let (_, _, err) = office.say(&["check", "site.toml"]);
        assert_eq!(err.contains(broken[0]), is_said, "{err}");
    }
}

#[test]
fn a_unit_that_changes_under_the_same_header_is_doubted_by_check_and_no_reset() {
    let newest = clock::now() - SignedDuration::from_mins(30);
    let text = (0..300).fold("time,P1_displacement_mm\n".to_owned(), |mut text, row| {
        let time = newest - SignedDuration::from_hours(i64::from(299 - row));
        let value = 0.05 * f64::from(row) + 0.2 * drawn(row);
        let value = if row < 200 { value } else { value / 1000.0 };
        let _ = writeln!(text, "{time:.0},{value:.5}");
        text
    });
    let office = Office::with(&[("p.csv", &text)]);
    office.done(&["init", "p.csv"]);
    let said = by_check(&office);
    contains_all(&said, &["multiplied by 1000", "accept = [\"scale\"]"]);
    assert!(!said.contains("kind = \"reset\""), "{said}");
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    let accepting = config.replacen(
        "[[benchmark]]\n",
        "[[benchmark]]\naccept = [\"scale\"]\n",
        1,
    );
    fs::write(office.path("site.toml"), accepting).unwrap();
    let said = by_check(&office);
    assert!(!said.contains("multiplied by"), "{said}");
}

#[test]
fn a_benchmark_whose_readings_end_long_before_its_neighbours_is_named_by_check() {
    let newest = clock::now() - SignedDuration::from_mins(30);
    let head = "time,P1_displacement_mm,P2_displacement_mm\n".to_owned();
    let text = (0..200).fold(head, |mut text, row| {
        let time = newest - SignedDuration::from_hours(i64::from(199 - row));
        let value = 990.0 + 0.1 * f64::from(row) + 0.2 * drawn(row);
        // The logger writes the unit beside what is longer.
        let first = if value < 1000.0 {
            format!("{value:.2}")
        } else {
            format!("{value:.2} mm")
        };
        let _ = writeln!(text, "{time:.0},{first},{value:.2}");
        text
    });
    let office = Office::with(&[("p.csv", &text)]);
    office.done(&["init", "p.csv"]);
    let said = by_check(&office);
    contains_all(
        &said,
        &[
            "benchmark \"P1\": its readings end at ",
            "before the newest of its source",
        ],
    );
    assert!(
        !said.contains("benchmark \"P2\": its readings end") && !said.contains("(reorder)"),
        "{said}"
    );
    // So long no level follows what is measured each hour.
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    let waiting = config.replacen("[[source]]\n", "[[source]]\nreorder = \"4h\"\n", 1);
    fs::write(office.path("site.toml"), waiting).unwrap();
    let said = by_check(&office);
    let part = "benchmark \"P2\": measured every 1h, and its source lets each reading wait for 4h (reorder)";
    assert!(said.contains(part), "{said}");
}

#[test]
fn a_recording_that_was_cut_off_is_read_by_every_command_and_each_says_so() {
    let newest = SignedDuration::from_mins(-90);
    let office = Office::with(&[("p.csv", &to_collapse(10.0, newest))]);
    office.done(&["convert", "p.csv", "p.mcap"]);
    let bytes = fs::read(office.path("p.mcap")).unwrap();
    fs::write(office.path("p.mcap"), &bytes[..bytes.len() - 7]).unwrap();
    let commands: [&[&str]; 4] = [
        &["init", "p.mcap"],
        &["fit", "p.mcap"],
        &["replay", "p.mcap"],
        &["convert", "p.mcap", "back.csv"],
    ];
    for args in commands {
        let (exit, out, err) = office.say(args);
        assert_eq!(exit, 0, "{args:?}: {out}{err}");
        contains_all(&err, &["p.mcap: has not ended", "message 150"]);
    }
    let back = fs::read_to_string(office.path("back.csv")).unwrap();
    assert_eq!(back.lines().count(), 151);
}

/// A logger that begins a file each day: each would be a benchmark of its own, and tomorrow's be followed by nothing.
#[test]
fn init_asks_whose_readings_files_are_that_differ_by_their_dates_alone() {
    let rows = |day: i32| {
        let row = |hour: i32| format!("2026-11-{day}T{hour:02}:00:00Z,{}\n", hour + 24 * day);
        let rows: String = (0..24).map(row).collect();
        format!("time,displacement_mm\n{rows}")
    };
    let days: Vec<(String, String)> = (20..23)
        .map(|day| (format!("slope-202611{day}.csv"), rows(day)))
        .collect();
    let files: Vec<(&str, &str)> = days
        .iter()
        .map(|(name, text)| (&name[..], &text[..]))
        .collect();
    let office = Office::with(&files);
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    let said = office.refused(2, &[&["init"], &names[..]].concat());
    for part in [
        "slope-20261120 and slope-20261121",
        "--column NAME=slope",
        "path = \"slope-*.csv\"",
    ] {
        assert!(said.contains(part), "{said}");
    }
    // One of them, by what the message says, and then all.
    office.done(&[
        "init",
        names[0],
        "--column",
        "displacement_mm=slope:displacement:mm",
    ]);
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    let config = config.replace("slope-20261120.csv", "slope-*.csv");
    fs::write(office.path("site.toml"), config).unwrap();
    let checked = office.done(&["check", "site.toml"]);
    assert!(checked.contains("72 readings"), "{checked}");
}
