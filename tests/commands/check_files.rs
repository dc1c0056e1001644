//! What `check` says of files in which much is wrong, beside what the daemon does with them.

use crate::office::{Office, plain, site};
use jiff::SignedDuration;
use slipwatch::runtime::clock;
use std::fmt::Write as _;
use std::fs;

const HEADER: &str = "time,P1_displacement_mm\n";

/// The preview of `check --format json`.
fn looked(office: &Office) -> serde_json::Value {
    let (_, json, err) = office.say(&["check", "site.toml", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap_or_else(|_| panic!("{err}"));
    json["preview"].clone()
}

/// Half-hourly rows from so many half hours before now.
fn half_hourly(halves: std::ops::Range<i64>) -> String {
    let now = clock::now();
    let row = |half: i64| {
        let time = now + SignedDuration::from_mins(30 * half);
        format!("{time},{}\n", 20.0 + 0.01 * half as f64)
    };
    halves.map(row).collect()
}

#[test]
fn a_value_that_is_corrected_back_is_the_one_that_the_daemon_takes() {
    let earlier = half_hourly(-40..-1);
    let time = clock::now();
    let row = |value: f64| format!("{time},{value}\n");
    let values = |values: &[f64]| values.iter().map(|value| row(*value)).collect::<String>();
    for (last, wanted, counts) in [
        (&[2.0, -40.0, 2.0][..], 2.0, (2, 0)),
        // As in a file that is read again from its start.
        (&[2.0, -40.0, 2.0, -40.0], -40.0, (1, 2)),
    ] {
        let text = format!("{HEADER}{earlier}{}", values(last));
        let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
        let one = &looked(&office)["benchmarks"][0];
        assert_eq!(one["last"][1], wanted, "{one}");
        let (corrected, repeated) = counts;
        assert_eq!(
            (&one["readings"], &one["corrected"], &one["repeated"]),
            (&40.into(), &corrected.into(), &repeated.into()),
            "{one}"
        );
        let daemon = office.run_logged(&["run", "site.toml"]);
        let taken = format!("taken={} repeated={repeated} ", 40 + corrected);
        office.until("all is read", || office.log().contains("caught up"));
        drop(daemon);
        let log = office.log();
        let line = log.lines().find(|line| line.contains("caught up")).unwrap();
        assert!(line.contains(&taken), "no {taken:?} in {log}");
        let out = office.done(&["replay", "--state", "state", "--record", "out.mcap"]);
        assert!(office.path("out.mcap").exists(), "{out}");
        office.done(&["convert", "out.mcap", "out.csv"]);
        let table = fs::read_to_string(office.path("out.csv")).unwrap();
        let newest = table.lines().last().unwrap();
        let value: f64 = newest.split(',').nth(1).unwrap().parse().unwrap();
        assert!((value - wanted).abs() < 1e-9, "{newest}");
    }
}

#[test]
fn of_many_readings_of_one_time_each_value_is_counted_as_a_correction() {
    let rows = (0..100_000).fold(HEADER.to_owned(), |mut text, row: i64| {
        let _ = writeln!(text, "2020-01-01T00:00:00Z,{row}.5");
        text
    });
    let office = Office::with(&[("slope.csv", &rows), ("site.toml", &site("slope.csv", ""))]);
    let preview = looked(&office).to_string();
    assert!(preview.contains("\"corrected\":99999"), "{preview}");
}

/// A text of other letters for each number, and no digit.
fn letters(mut number: u32) -> String {
    let mut text = String::new();
    for _ in 0..6 {
        text.push(char::from(b'a' + u8::try_from(number % 26).unwrap()));
        number /= 26;
    }
    text
}

/// Bytes without any order, the same each time.
fn rubbish(count: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let next = |_| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        state.to_le_bytes()[7]
    };
    (0..count).map(next).collect()
}

#[test]
fn rows_that_are_wrong_in_the_same_way_are_one_kind_whatever_stands_in_them() {
    let messages = (0..60_000).fold(String::new(), |mut text, row| {
        let wrong = letters(row);
        let _ = match row % 3 {
            0 => writeln!(text, r#"{{"benchmark": "P1", "time": "{wrong}", "value": 1}}"#),
            1 => writeln!(text, "{wrong}"),
            _ => writeln!(
                text,
                r#"{{"benchmark": "{wrong}", "time": "2020-01-01T00:00:00Z", "value": 1, "unit": "{wrong}"}}"#
            ),
        };
        text
    });
    let config = site("in/*", "").replace("\"csv\"", "\"ndjson\"");
    let office = Office::with(&[("site.toml", &config)]);
    fs::create_dir(office.path("in")).unwrap();
    fs::write(office.path("in/a.ndjson"), messages).unwrap();
    let refused = looked(&office)["sources"][0]["refused"].clone();
    let rows: Vec<u64> = (refused.as_array().unwrap().iter())
        .map(|one| one["rows"].as_u64().unwrap())
        .collect();
    assert_eq!(rows, [20_000; 3], "{refused}");

    let office = Office::with(&[("site.toml", &site("in/*", ""))]);
    fs::create_dir(office.path("in")).unwrap();
    let text = [HEADER.as_bytes(), &rubbish(4_000_000)].concat();
    fs::write(office.path("in/a.csv"), text).unwrap();
    let (_, out, err) = office.say(&["check", "site.toml"]);
    assert!(out.contains("refused: "), "{out}{err}");
    assert!(out.lines().count() < 60, "{out}");
}

#[test]
fn bad_rows_count_to_what_is_looked_at() {
    let config = site("a.ndjson", "").replace("\"csv\"", "\"ndjson\"");
    let office = Office::with(&[
        ("a.ndjson", &"x\n".repeat(2_100_000)),
        ("site.toml", &config),
    ]);
    assert_eq!(looked(&office)["is_whole"], false);
}

#[test]
fn readings_ahead_of_the_clock_are_refused_where_a_daemon_is_at_work_that_refuses_them() {
    let office = Office::with(&[
        ("slope.csv", &format!("{HEADER}{}", half_hourly(-60..0))),
        ("site.toml", &site("slope.csv", "")),
    ]);
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.until("all is read", || office.log().contains("caught up"));
    let rows = fs::read_to_string(office.path("slope.csv")).unwrap() + &half_hourly(4..10);
    fs::write(office.path("slope.csv"), &rows).unwrap();
    office.until("they are set aside", || {
        office.log().matches("measured in the future").count() == 6
    });
    let is_refused = || {
        let one = &looked(&office)["benchmarks"][0];
        assert_eq!((&one["readings"], &one["ahead"]), (&60.into(), &6.into()));
        let out = office.done(&["check", "site.toml"]);
        assert!(out.contains("refused: 6 rows"), "{out}");
        assert!(!out.contains("its clock as wrong"), "{out}");
    };
    is_refused();
    drop(daemon);
    is_refused();

    // The same rows, all there when a daemon starts for the first time.
    let office = Office::with(&[("slope.csv", &rows), ("site.toml", &site("slope.csv", ""))]);
    let all_count = || {
        let one = &looked(&office)["benchmarks"][0];
        assert_eq!((&one["readings"], &one["ahead"]), (&66.into(), &0.into()));
    };
    let says = |wanted: &str| office.done(&["check", "site.toml"]).contains(wanted);
    assert!(says("a daemon that starts now, on a new state, takes them"));
    all_count();
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.until("the daemon has taken them", || {
        says("the daemon has taken such")
    });
    all_count();
    drop(daemon);
}

#[test]
fn a_benchmark_that_nothing_feeds_is_explained_by_its_own_source() {
    let more = "[[source]]\nid = \"other\"\nkind = \"csv\"\npath = \"other.csv\"\n\
                [[benchmark]]\nid = \"P1\"\nsource = \"logger\"\n[[benchmark]]\nid = \"Q1\"\nsource = \"other\"\n";
    let unreadable = plain(30).replace("2017-06-", "June-");
    let other = plain(30).replace(
        "P1_displacement_mm",
        "Q1_displacement_mm,Q7_displacement_mm",
    );
    let other = other.replace('\n', ",1\n").replacen(",1\n", "\n", 1);
    let office = Office::with(&[
        ("slope.csv", &unreadable),
        ("other.csv", &other),
        ("site.toml", &site("slope.csv", more)),
    ]);
    let said = office.refused(1, &["check", "site.toml"]);
    let line = said.lines().find(|line| line.contains("\"P1\"")).unwrap();
    assert!(
        line.contains("refuses what they have (30 times)") && line.contains("found \"June-"),
        "{said}"
    );
    assert!(!line.contains("Q7"), "{said}");
    let out = office.say(&["check", "site.toml"]).1;
    assert!(out.contains("not watched: Q7"), "{out}");

    // Where its own source has another one and refused rows too, both are said.
    let both = plain(30).replace("P1_", "P7_") + "yesterday,1\n";
    fs::write(office.path("slope.csv"), both).unwrap();
    let said = office.refused(1, &["check", "site.toml"]);
    let line = said.lines().find(|line| line.contains("\"P1\"")).unwrap();
    assert!(
        line.contains("they have P7") && line.contains("found \"yesterday\""),
        "{said}"
    );
}

#[test]
fn marks_of_no_value_are_counted_for_each_benchmark() {
    let rows: Vec<String> = (0..40)
        .map(|hour| {
            let cell = |marks: &[(i64, &str)]| {
                let mark = marks.iter().find(|(at, _)| *at == hour);
                mark.map_or(format!("{hour}.5"), |(_, mark)| (*mark).to_owned())
            };
            let one = cell(&[(3, "NAN"), (4, "nan"), (5, "INF"), (6, "-INF"), (7, "")]);
            let two = cell(&[(9, "\"NAN\"")]);
            format!(
                "2020-01-0{}T{:02}:00:00Z,{one},{two}\n",
                1 + hour / 24,
                hour % 24
            )
        })
        .collect();
    let rows = rows.concat();
    let text = format!("time,P1_displacement_mm,P2_displacement_mm\n{rows}");
    let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
    let preview = looked(&office);
    let counts = |at: usize| {
        let one = &preview["benchmarks"][at];
        (
            one["readings"].clone(),
            one["missing"].clone(),
            one["out_of_range"].clone(),
        )
    };
    assert_eq!(counts(0), (35.into(), 4.into(), 2.into()), "{preview}");
    assert_eq!(counts(1), (39.into(), 1.into(), 0.into()), "{preview}");
    for args in [
        &["check", "site.toml"][..],
        &["init", "slope.csv", "--force"],
    ] {
        let said = office.done(args);
        assert!(
            said.contains("missing: 4, of these out of range: 2"),
            "{said}"
        );
        assert!(
            said.contains("missing: 1, of these out of range: 0"),
            "{said}"
        );
    }
}

#[test]
fn a_reading_of_three_hundred_digits_is_named_with_its_place_and_printed_nowhere() {
    let text = plain(40).replacen(",10\n", ",1e308\n", 1);
    let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
    let said = office.refused(65, &["replay", "slope.csv"]);
    let parts = ["slope.csv, line 22", "1e308", "1e11 mm (100,000 km)"];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    let daemon = office.run_logged(&["run", "site.toml"]);
    let status = office.status_until("2017-06-02 13:00");
    drop(daemon);
    let log = office.log();
    assert!(parts.iter().all(|part| log.contains(part)), "{log}");
    let (_, out, err) = office.say(&["check", "site.toml"]);
    let (_, events, _) = office.say(&["events", "--config", "site.toml"]);
    for said in [status, log, out, err, events] {
        let longest = said.split(|letter: char| !letter.is_ascii_digit());
        assert!(longest.map(str::len).max().unwrap_or(0) < 30, "{said}");
    }
}

#[test]
fn check_shows_what_each_covariate_is_and_which_stated_one_is_in_no_file() {
    let mut text = "time,P1_displacement_mm,Nied_1h,river_m3_s,box\n".to_owned();
    for hour in 0..20 {
        writeln!(text, "2017-06-01T{hour:02}:00:00Z,{hour},0.5,3.1,{hour}").unwrap();
    }
    let covariate = |column: &str, kind: &str| {
        format!("\n[[covariate]]\ncolumn = \"{column}\"\nkind = \"{kind}\"\n")
    };
    let config = format!(
        "{}{}{}",
        site("slope.csv", ""),
        covariate("Nied_1h", "rain"),
        covariate("Nied_1d", "rain")
    );
    let office = Office::with(&[("slope.csv", &text), ("site.toml", &config)]);
    let (code, out, err) = office.say(&["check", "site.toml"]);
    assert_eq!(code, 0, "{out}{err}");
    for part in [
        "covariate Nied_1h (logger): 20 values, 2017-06-01T00:00:00Z to 2017-06-01T19:00:00Z; rain, as the config states\n",
        "covariate river_m3_s (logger): 20 values, m3_s, 2017-06-01T00:00:00Z to 2017-06-01T19:00:00Z; flow\n",
        "covariate box (logger): 20 values, 2017-06-01T00:00:00Z to 2017-06-01T19:00:00Z; no sensor that is monitored; what it measures its name does not say: state it in [[covariate]], or in --column if it is a sensor of motion\n",
    ] {
        assert!(out.contains(part), "no {part:?} in {out}");
    }
    let line = config
        .lines()
        .position(|line| line.contains("Nied_1d"))
        .unwrap()
        + 1;
    let warning = format!(
        "site.toml:{line}:10: warning: covariate.column = \"Nied_1d\" is no covariate in the files; \
         covariates in the files: Nied_1h, box, river_m3_s"
    );
    assert!(err.contains(&warning), "{err}");
    let shown = &looked(&office)["covariates"];
    let kinds: Vec<(&str, &str, bool)> = (shown.as_array().unwrap().iter())
        .map(|one| {
            (
                one["name"].as_str().unwrap(),
                one["kind"].as_str().unwrap(),
                one["is_stated"].as_bool().unwrap(),
            )
        })
        .collect();
    let expected = [
        ("Nied_1h", "rain", true),
        ("box", "other", false),
        ("river_m3_s", "flow", false),
    ];
    assert_eq!(kinds, expected);
}

#[test]
fn a_benchmark_of_two_sources_is_warned_of_until_one_of_them_is_named() {
    let sources = "[[source]]\nid = \"one\"\nkind = \"csv\"\npath = \"slope.csv\"\n\
                   [[source]]\nid = \"two\"\nkind = \"csv\"\npath = \"other.csv\"\n";
    let head = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n";
    let text = format!("{HEADER}{}", half_hourly(-40..-1));
    let said = |more: &str| {
        let site = format!("{head}{sources}{more}");
        let files = [
            ("slope.csv", &text),
            ("other.csv", &text),
            ("site.toml", &site),
        ];
        let office = Office::with(&files.map(|(name, text)| (name, text.as_str())));
        let (_, out, err) = office.say(&["check", "site.toml"]);
        out + &err
    };
    let warning = "benchmark \"P1\" comes from the sources \"one\" and \"two\"";
    assert!(said("").contains(warning), "{}", said(""));
    let named = "[[benchmark]]\nid = \"P1\"\nsource = \"two\"\n";
    assert!(!said(named).contains(warning), "{}", said(named));
    let broker =
        "[[source]]\nid = \"radio\"\nkind = \"mqtt\"\nurl = \"mqtt://127.0.0.1\"\ntopic = \"a\"\n";
    let open = "no [[benchmark]] says which of the sources \"one\" and \"two\" and \"radio\"";
    assert!(said(broker).contains(open), "{}", said(broker));
    let named = format!("{broker}{named}");
    assert!(!said(&named).contains(open), "{}", said(&named));
}
