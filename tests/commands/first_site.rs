//! The first day at a site: files as people have them, from `init` to a running watch with a tested hook.

use crate::office::{Daemon, Office, PROGRAM, ended, plain, rows, site};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Semicolons, decimal commas, date and time in two columns, and a remark now and then.
fn of_the_office(count: i64) -> String {
    let body = rows(count, |time, value| {
        let remark = if time.hour() == 3 {
            "Akku getauscht"
        } else {
            ""
        };
        let (day, hour) = (time.strftime("%d.%m.%Y"), time.strftime("%H:%M"));
        let value = format!("{value:.2}").replace('.', ",");
        format!("{day};{hour};{value};0,2;{remark}\n")
    });
    format!("Datum;Zeit;Prisma 1;Regen_mm;Bemerkung\n{body}")
}

const INIT: [&str; 6] = [
    "init",
    "slope.csv",
    "--time-zone",
    "Europe/Rome",
    "--column",
    "Prisma 1=P1:displacement:mm",
];

#[test]
fn one_command_leads_from_a_file_of_the_office_to_a_watch_that_reads_it() {
    let office = Office::with(&[("slope.csv", &of_the_office(100))]);
    let said = office.done(&INIT);
    for part in [
        "wrote site.toml",
        "ok: ",
        "benchmark P1, mm",
        "covariate, mm",
        "not used: text",
        "100 readings of displacement, every 1h",
        "first 2017-05-31T22:00:00Z (2017-06-01 00:00 CEST)  0 mm",
        "last  2017-06-05T01:00:00Z (2017-06-05 03:00 CEST)  49.5 mm",
        "slipwatch run site.toml",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    for line in [
        "path = \"slope.csv\"",
        "decimal = \"comma\"",
        "time_column = [\"Datum\", \"Zeit\"]",
    ] {
        assert!(config.contains(line), "no {line:?} in {config}");
    }
    let daemon = office.run(&["run", "site.toml"]);
    let status = office.status_until("2017-06-05 03:00 CEST");
    assert!(!status.contains("NO DAEMON RUNS"), "{status}");
    let table = status
        .lines()
        .skip_while(|line| !line.starts_with("benchmark "));
    let table: Vec<&str> = table.take_while(|line| !line.is_empty()).collect();
    assert!(table.len() >= 3, "{status}");
    for line in table {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let status = office.done(&["status", "--sources", "--config", "site.toml"]);
    assert!(
        status.contains("covariate Regen_mm (slope): 100 values"),
        "{status}"
    );
    drop(daemon);
    let status = office.done(&["status", "--config", "site.toml"]);
    assert!(status.starts_with("NO DAEMON RUNS"), "{status}");
    assert!(status.contains("P1"), "{status}");
}

#[test]
fn marks_between_thousands_are_seen_where_a_number_shows_them_or_are_said() {
    let text = |part: &str, decimal: &str| {
        let body = rows(60, |time, value| {
            let digits = format!("{value:06.2}").replace('.', decimal);
            format!("{time}Z;7{part}{digits}\n")
        });
        format!("time;P1_displacement_mm\n{body}")
    };
    let german = text(".", ",");
    let swiss = text("\u{2019}", ".");
    let whole = german.replace(",00\n", "\n").replace(",50\n", "\n");
    let cases: [(&str, &[&str], &str, &str); 3] = [
        (
            &german,
            &[],
            "thousands = \"point\"",
            "last  2017-06-03T11:00:00Z  7029.5 mm",
        ),
        (&swiss, &[], "thousands = \"apostrophe\"", "7029.5 mm"),
        (
            &whole,
            &["--thousands", "point"],
            "thousands = \"point\"",
            "7029 mm",
        ),
    ];
    for (text, flags, line, newest) in cases {
        let office = Office::with(&[("slope.csv", text)]);
        let said = office.done(&[&["init", "slope.csv"], flags].concat());
        assert!(said.contains(newest), "no {newest:?} in {said}");
        let config = fs::read_to_string(office.path("site.toml")).unwrap();
        assert!(config.contains(line), "no {line:?} in {config}");
    }
}

#[test]
fn init_writes_nothing_where_a_file_leaves_something_open_and_names_the_flag() {
    let ambiguous = rows(50, |time, value| {
        format!(
            "{}/06/2017 {:02}:00,{value}\n",
            1 + time.day() % 9,
            time.hour()
        )
    });
    let ambiguous = format!("time,P1_displacement_mm\n{ambiguous}");
    let local = plain(5).replace("+02:00", "");
    let thousands =
        "time;P1_displacement_mm\n2017-06-01T00:00:00Z;1,234\n2017-06-01T01:00:00Z;1,250\n";
    let two = "measured,received,P1_displacement_mm\n2017-06-01 00:00,2017-06-01 00:10,1\n";
    let cases: [(&str, &[&str], &[&str]); 6] = [
        (
            &ambiguous,
            &["--time-zone", "UTC"],
            &["%d/%m/%Y %H:%M", "%m/%d/%Y %H:%M"],
        ),
        (&local, &[], &["--time-zone"]),
        (thousands, &[], &["--decimal comma or --thousands comma"]),
        (
            two,
            &["--time-zone", "UTC"],
            &["--time-column", "measured, received"],
        ),
        ("when,x\nyesterday,1\n", &[], &["--time-column"]),
        (
            "time,lower,upper\n2017-06-01T00:00:00Z,1,2\n",
            &[],
            &["--column \"lower=P1:displacement:UNIT\"", "lower, upper"],
        ),
    ];
    for (text, flags, wanted) in cases {
        let office = Office::with(&[("slope.csv", text)]);
        let args = [&["init", "slope.csv"], flags].concat();
        let said = office.refused(2, &args);
        for part in wanted {
            assert!(said.contains(part), "no {part:?} in {said}");
        }
        assert!(!office.path("site.toml").exists(), "{text}");
    }
}

#[test]
fn init_names_the_flag_where_nothing_but_the_times_of_messages_is_wrong() {
    let messages = |time: &dyn Fn(i64) -> String| {
        (0..30).fold(String::new(), |mut text, hour| {
            let time = time(hour);
            let _ = writeln!(
                text,
                r#"{{"benchmark": "P1", "time": {time}, "value": {hour}, "unit": "mm"}}"#
            );
            text
        })
    };
    let local = |hour: i64| format!("\"2026-10-{:02}T{:02}:00:00\"", 1 + hour / 24, hour % 24);
    let of_rows = (0..30).fold(String::new(), |mut text, hour| {
        let _ = writeln!(
            text,
            r#"{{"time": {}, "P1_displacement_mm": {hour}}}"#,
            local(hour)
        );
        text
    });
    for (text, flag, value) in [
        (unix_messages(30), "--time-format", "unix"),
        (messages(&local), "--time-zone", "UTC"),
        (of_rows, "--time-zone", "UTC"),
    ] {
        let office = Office::with(&[("a.ndjson", &text)]);
        let said = office.refused(2, &["init", "a.ndjson"]);
        assert!(said.contains(flag), "{said}");
        assert!(said.contains("a.ndjson, line 1"), "{said}");
        assert_eq!(said.matches("a.ndjson").count(), 1, "{said}");
        office.done(&["init", "a.ndjson", flag, value]);
    }
}

#[test]
fn a_day_above_twelve_decides_which_number_is_the_month() {
    let american = rows(24 * 20, |time, value| {
        format!("{},{value}\n", time.strftime("%m/%d/%Y %I:%M %p"))
    });
    let office = Office::with(&[("slope.csv", &format!("when,P1_displacement_mm\n{american}"))]);
    let said = office.done(&["init", "slope.csv", "--time-zone", "America/Denver"]);
    assert!(said.contains("last  2017-06-21T05:00:00Z"), "{said}");
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    assert!(
        config.contains("time_format = \"%m/%d/%Y %I:%M %p\""),
        "{config}"
    );
}

#[test]
fn what_init_writes_passes_check_whatever_the_file_is_called_and_has() {
    let both = rows(30, |time, value| format!("{time}+02:00,{value},12\n"));
    let both = format!("time,P1_displacement_mm,P1_velocity_mm_per_day\n{both}");
    let body = rows(30, |time, value| {
        format!("\"{}\",{value}\n", time.strftime("%F %T"))
    });
    let toa5 = format!(
        "\"TOA5\",\"CR1000\",\"CR1000\",\"1\",\"OS\",\"CPU:p.CR1\",\"2\",\"Hourly\"\n\"TIMESTAMP\",\"P1_displacement\"\n\"TS\",\"mm\"\n\"\",\"Smp\"\n{body}"
    );
    let unix = unix_messages(30);
    let cases: [(&str, &str, &[&str], &str); 5] = [
        ("both.csv", &both, &[], "quantity = \"displacement\""),
        (
            "logger.csv",
            &toa5,
            &["--time-zone", "UTC"],
            "kind = \"toa5\"",
        ),
        (
            "my slope's.csv",
            &plain(30),
            &[],
            "path = \"my slope's.csv\"",
        ),
        ("-x.csv", &plain(30), &[], "path = \"-x.csv\""),
        (
            "unix.ndjson",
            &unix,
            &["--time-format", "unix"],
            "time_format = \"unix\"",
        ),
    ];
    for (name, text, flags, wanted) in cases {
        let office = Office::with(&[(name, text)]);
        let path = format!("./{name}");
        let said = office.done(&[&["init", &path], flags].concat());
        let config = fs::read_to_string(office.path("site.toml")).unwrap();
        assert!(config.contains(wanted), "no {wanted:?} in {config}");
        let checked = office.done(&["check", "site.toml"]);
        assert!(checked.contains("30 readings"), "{checked}");
        assert!(!checked.contains("not watched"), "{checked}");
        // A shell takes the commands that it names as they stand.
        for line in said
            .lines()
            .filter(|line| line.contains("slipwatch replay "))
        {
            let (command, _) = line.split_once("  what it").unwrap();
            let command = command.trim().replacen("slipwatch", PROGRAM, 1);
            let mut shell = Command::new("sh");
            let output = shell
                .args(["-c", &command])
                .current_dir(office.folder.path());
            let (exit, _, err) = ended(&output.output().unwrap());
            assert_eq!(exit, 0, "{command}: {err}");
        }
    }
}

#[test]
fn init_says_of_a_file_without_readings_what_it_has_and_suggests_no_wrong_unit() {
    let row = "2017-06-01T00:00:00Z";
    let cases = [
        (
            format!("time,remark\n{row},rain\n"),
            "none of its columns (time, remark) holds numbers",
        ),
        (
            format!("time,d_dm\n{row},4\n"),
            "--column \"d_dm=P1:displacement:UNIT\"; a UNIT is um, mm, cm",
        ),
        (
            format!("time,rate [mm/s]\n{row},4\n"),
            "--column \"rate [mm/s]=P1:velocity:UNIT\"",
        ),
        (
            format!("time,way_cm\n{row},4\n"),
            "--column \"way_cm=P1:displacement:cm\"",
        ),
        ("time,P1_displacement_mm\n".to_owned(), "no row below it"),
    ];
    for (text, wanted) in cases {
        let office = Office::with(&[("slope.csv", &text)]);
        let (exit, _, said) = office.say(&["init", "slope.csv"]);
        assert!(
            exit != 0 && said.contains(wanted),
            "no {wanted:?} in {said}"
        );
        assert!(!office.path("site.toml").exists(), "{text}");
    }
}

#[test]
fn init_writes_nothing_where_no_file_has_a_column_that_is_named() {
    let table = "time,E1 [mm],E2 [mm]\n2026-01-01T00:00:00Z,1,1\n2026-01-01T01:00:00Z,1.1,1\n";
    let office = Office::with(&[("slope.csv", table)]);
    let named = |second: &str| {
        let second = format!("{second}=E2:displacement:mm");
        let first = "E1 [mm]=E1:displacement:mm";
        office.say(&["init", "slope.csv", "--column", first, "--column", &second])
    };
    let (exit, out, err) = named("E2[mm]");
    assert_eq!(exit, 2, "{out}{err}");
    assert!(err.contains("no file has a column \"E2[mm]\""), "{err}");
    assert!(err.contains("\"E2 [mm]\""), "{err}");
    assert!(!office.path("site.toml").exists());
    let (exit, out, err) = named("E2 [mm]");
    assert_eq!(exit, 0, "{out}{err}");
    assert!(out.contains("benchmark E2, mm"), "{out}");
}

#[test]
fn init_writes_over_no_config_unasked() {
    let office = Office::with(&[("slope.csv", &plain(5)), ("site.toml", "mine")]);
    let said = office.refused(2, &["init", "slope.csv"]);
    assert!(
        said.contains("site.toml") && said.contains("--force"),
        "{said}"
    );
    assert_eq!(
        fs::read_to_string(office.path("site.toml")).unwrap(),
        "mine"
    );
    office.done(&["init", "slope.csv", "--force"]);
}

#[test]
#[expect(
    clippy::too_many_lines,
    reason = "a table of ways to write the same readings"
)]
fn the_same_readings_come_out_however_the_table_is_written() {
    let zone = jiff::tz::TimeZone::get("Europe/Rome").unwrap();
    let unix =
        |time: jiff::civil::DateTime| time.to_zoned(zone.clone()).unwrap().timestamp().as_second();
    let days = |time: jiff::civil::DateTime| {
        42887.0 + f64::from(time.day() - 1) + f64::from(time.hour()) / 24.0
    };
    let table = |header: &str, row: &dyn Fn(jiff::civil::DateTime, f64) -> String| {
        format!("{header}\n{}", rows(40, row)).into_bytes()
    };
    let european = of_the_office(40);
    let latin1: Vec<u8> = european
        .replace("Akku getauscht", "Akku überprüft")
        .chars()
        .map(|letter| u8::try_from(u32::from(letter)).unwrap())
        .collect();
    let utf16 = std::iter::once(0xfeff).chain(european.encode_utf16());
    let utf16: Vec<u8> = utf16.flat_map(u16::to_le_bytes).collect();
    let rome = ["--time-zone", "Europe/Rome"];
    let office: Vec<&str> = [
        &rome[..],
        &[
            "--decimal",
            "comma",
            "--time-column",
            "Datum",
            "--time-column",
            "Zeit",
        ],
        &[
            "--time-format",
            "%d.%m.%Y %H:%M",
            "--column",
            "Prisma 1=P1:displacement:mm",
        ],
    ]
    .concat();
    let tabs = plain(40).replace(',', "\t").into_bytes();
    let excel = table("time;P1_displacement_mm", &|time, value| {
        format!("{};{value}\n", days(time))
    });
    let seconds = table("stamp,P1_displacement_mm", &|time, value| {
        format!("{},{value}\n", unix(time))
    });
    let brackets = table("time,P1_displacement [mm]", &|time, value| {
        format!("{time}+02:00,{value}\n")
    });
    let excel_flags = [&rome[..], &["--time-format", "excel"]].concat();
    let cases: [(Vec<u8>, &[&str]); 8] = [
        (plain(40).into_bytes(), &[]),
        (european.into_bytes(), &office),
        (latin1, &office),
        (utf16, &office),
        (tabs, &[]),
        (excel, &excel_flags),
        (
            seconds,
            &["--time-column", "stamp", "--time-format", "unix"],
        ),
        (brackets, &[]),
    ];
    let mut before: Option<String> = None;
    for (number, (bytes, flags)) in cases.iter().enumerate() {
        let office = Office::with(&[]);
        fs::write(office.path("slope.csv"), bytes).unwrap();
        let args = [
            &["fit", "slope.csv", "--format", "json", "--benchmark", "P1"],
            *flags,
        ]
        .concat();
        let fit: serde_json::Value = serde_json::from_str(&office.done(&args)).unwrap();
        let read = format!(
            "{} {} {} {}",
            fit["readings"], fit["first"], fit["last"], fit["rms"]
        );
        assert_eq!(before.get_or_insert(read.clone()), &read, "case {number}");
    }
}

#[test]
fn an_encoding_and_a_column_of_text_are_said_and_no_row_is_lost_by_them() {
    let text = plain(5).replace("P1_displacement_mm", "P1_displacement_mm,remark");
    let lines = text.lines().map(|line| {
        let end = if line.contains("remark") {
            ""
        } else {
            ",Böschung"
        };
        [line, end, "\n"].concat()
    });
    let text = lines.collect::<Vec<String>>().concat();
    let latin1: Vec<u8> = text
        .chars()
        .map(|letter| u8::try_from(u32::from(letter)).unwrap())
        .collect();
    let office = Office::with(&[]);
    fs::write(office.path("slope.csv"), latin1).unwrap();
    fs::write(office.path("site.toml"), site("slope.csv", "")).unwrap();
    let said = office.done(&["check", "site.toml"]);
    for part in [
        "5 readings",
        "Latin-1",
        "column \"remark\": found \"Böschung\", which is no number",
        "not used: text",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    assert!(!said.contains("refused"), "{said}");
}

#[test]
fn check_exits_1_where_a_benchmark_is_fed_by_nothing_and_says_what_the_files_have() {
    let typing_error = "[[benchmark]]\nid = \"P2\"\n";
    let cases = [
        (
            plain(5),
            site("slope.csv", typing_error),
            "they have P1, which no [[benchmark]] names",
        ),
        (
            plain(5),
            site("slopes.csv", typing_error),
            "there is no file",
        ),
        (
            plain(5).replace("P1_displacement_mm", "P1_displacement_mm/d"),
            site("slope.csv", ""),
            "nothing is watched",
        ),
    ];
    for (text, config, wanted) in cases {
        let office = Office::with(&[("slope.csv", &text), ("site.toml", &config)]);
        let said = office.refused(1, &["check", "site.toml"]);
        assert!(said.contains(wanted), "no {wanted:?} in {said}");
        let (_, json, _) = office.say(&["check", "site.toml", "--format", "json"]);
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let unfed = json["preview"]["unfed"].as_array();
        assert!(unfed.is_some_and(|unfed| !unfed.is_empty()), "{json}");
        office.done(&["check", "--config-only", "site.toml"]);
    }
}

#[test]
fn check_shows_the_rows_that_are_refused_each_kind_once() {
    let mut text = plain(30);
    for line in 0..20_000 {
        let _ = writeln!(text, "2017-06-05T00:00:00Z,bad{line}");
    }
    text.push_str("not a time,1\n2017-06-05T00:00:00Z,1,2\n2017-06-05T01:00:00Z,1");
    let office = Office::with(&[
        ("slope.csv", &text),
        ("site.toml", &site("./slope.csv", "")),
    ]);
    let said = office.done(&["check", "site.toml"]);
    for part in [
        "20000 rows, the first: ./slope.csv, line 32, column \"P1_displacement_mm\": found \"bad0\"",
        "1 row, the first: ./slope.csv, line 20032, column \"time\"",
        "found 3 fields",
        "its last line has no line break",
        "30 readings",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    assert!(said.lines().count() < 30, "{said}");
    let (_, json, _) = office.say(&["check", "site.toml", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["preview"]["benchmarks"][0]["id"], "P1", "{json}");
    assert_eq!(
        json["preview"]["sources"][0]["refused"][0]["rows"], 20_000,
        "{json}"
    );
}

/// One case of what a source's files hold: its keys, its files, what the first benchmark's readings, corrections and
/// repetitions are, and what is said.
struct Counted<'a> {
    source: &'a str,
    files: Vec<(&'a str, String)>,
    counts: Option<(u64, u64, u64)>,
    said: &'a [&'a str],
}

fn hourly(count: i64, time: impl Fn(jiff::Timestamp) -> String) -> String {
    let start: jiff::Timestamp = "2026-10-23T12:00:00Z".parse().unwrap();
    let rows = (0..count).map(|hour| {
        let at = start + jiff::SignedDuration::from_hours(hour);
        let value = 0.5 * hour as f64 + 0.01 * (hour * hour) as f64;
        format!("{},{value:.3}\n", time(at))
    });
    rows.collect()
}

/// Messages whose time is a number of seconds, an hour apart.
fn unix_messages(count: i64) -> String {
    (0..count).fold(String::new(), |mut text, hour| {
        let time = 1_792_756_800 + 3600 * hour;
        let _ = writeln!(
            text,
            r#"{{"benchmark": "P1", "time": {time}, "value": {hour}, "unit": "mm"}}"#
        );
        text
    })
}

fn other_kinds() -> [Counted<'static>; 2] {
    [
        Counted {
            source: "kind = \"mcap\"",
            files: vec![("a.csv", table(&in_utc(60)))],
            counts: None,
            said: &["a.csv: found \"time,P1_displacement_mm\", expected an MCAP recording"],
        },
        Counted {
            source: "kind = \"ndjson\"\ntime_format = \"unix\"",
            files: vec![("a.ndjson", unix_messages(12))],
            counts: Some((12, 0, 0)),
            said: &["last  2026-10-23T23:00:00Z  11 mm"],
        },
    ]
}

const COUNTED: &str = "time,P1_displacement_mm\n";
const METRES: &str = "2026-10-24T00:00:00Z,0.0295\n";

fn table(rows: &str) -> String {
    format!("{COUNTED}{rows}")
}

fn in_utc(count: i64) -> String {
    hourly(count, |time| time.to_string())
}

/// Times that cannot be meant.
fn of_times() -> [Counted<'static>; 4] {
    let short = hourly(60, |time| time.strftime("%d.%m.%y %H:%M").to_string());
    let seconds = hourly(60, |time| time.as_second().to_string());
    let unset = format!("1970-01-01T01:00:00Z,4\n{}", in_utc(12));
    let ahead = format!("{}2417-01-01T01:00:00Z,4\n", in_utc(12));
    [
        Counted {
            source: "kind = \"csv\"\ntime_format = \"%d.%m.%Y %H:%M\"\ntime_zone = \"UTC\"",
            files: vec![("a.csv", table(&short))],
            counts: None,
            said: &[
                "60 rows, the first: ",
                "a.csv, line 2, column \"time\": found \"23.10.26 12:00\"",
                "%y for two",
            ],
        },
        Counted {
            source: "kind = \"csv\"\ntime_format = \"unix_ms\"",
            files: vec![("a.csv", table(&seconds))],
            counts: None,
            said: &["a.csv, line 2, column \"time\"", "unix for seconds"],
        },
        Counted {
            source: "kind = \"csv\"",
            files: vec![("a.csv", table(&unset))],
            counts: Some((12, 0, 0)),
            said: &["a.csv, line 2, \"P1\": found 1970-01-01T01:00:00Z, expected another day"],
        },
        Counted {
            source: "kind = \"csv\"",
            files: vec![("a.csv", table(&ahead))],
            counts: Some((12, 0, 0)),
            said: &[
                "refused, ahead of this machine's clock: 1",
                "a.csv, line 14, \"P1\": found 2417-01-01T01:00:00Z",
            ],
        },
    ]
}

/// Readings that come twice, and units that change.
fn of_values() -> [Counted<'static>; 4] {
    let corrected = in_utc(60)
        .replace("0.510", "0.512")
        .replace("1.040", "1.050");
    let rome = jiff::tz::TimeZone::get("Europe/Rome").unwrap();
    let there = |time: jiff::Timestamp| time.to_zoned(rome.clone()).strftime("%F %H:%M");
    let local = hourly(60, |time| there(time).to_string());
    let in_metres = format!("time,P1_displacement_m\n{METRES}");
    [
        Counted {
            source: "kind = \"csv\"",
            files: vec![("a.csv", table(&in_utc(60))), ("b.csv", table(&corrected))],
            counts: Some((60, 2, 58)),
            said: &[
                "corrected by another reading of the same time: 2",
                "b.csv, line 3: another reading of 2026-10-23T13:00:00Z: found 0.512 mm, and 0.51 mm before",
            ],
        },
        Counted {
            source: "kind = \"csv\"\ntime_format = \"%Y-%m-%d %H:%M\"\ntime_zone = \"Europe/Rome\"\ndst = \"earlier\"",
            files: vec![("a.csv", table(&local))],
            counts: Some((59, 1, 0)),
            said: &["a.csv, line 39: another reading", "dst = \"standard\""],
        },
        Counted {
            source: "kind = \"csv\"",
            files: vec![("a.csv", table(&in_utc(12))), ("b.csv", in_metres.clone())],
            counts: Some((13, 0, 0)),
            said: &[
                "b.csv, line 2: found m, and mm before",
                "last  2026-10-24T00:00:00Z  29.5 mm",
            ],
        },
        Counted {
            source: "kind = \"csv\"",
            files: vec![("a.csv", format!("{}{in_metres}", table(&in_utc(12))))],
            counts: Some((13, 0, 0)),
            said: &[
                "line 14: a header that comes again has \"P1_displacement_m\" in m, and it was \"P1_displacement_mm\" in mm before",
                "last  2026-10-24T00:00:00Z  29.5 mm",
            ],
        },
    ]
}

#[test]
fn check_counts_as_readings_what_the_daemon_takes_and_says_what_it_refuses() {
    for Counted {
        source,
        files,
        counts,
        said,
    } in of_times()
        .into_iter()
        .chain(of_values())
        .chain(other_kinds())
    {
        let config = format!(
            "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"logger\"\n{source}\npath = \"in/a*\"\n[[benchmark]]\nid = \"P1\"\n"
        );
        let config = if files.len() > 1 {
            config.replace("in/a*", "in/*.csv")
        } else {
            config
        };
        let office = Office::with(&[("site.toml", &config)]);
        fs::create_dir(office.path("in")).unwrap();
        for (name, text) in &files {
            fs::write(office.path("in").join(name), text).unwrap();
        }
        let (exit, out, err) = office.say(&["check", "site.toml"]);
        assert_eq!(exit, i32::from(counts.is_none()), "{source}: {out}{err}");
        for part in said {
            assert!(out.contains(part), "{source}: no {part:?} in {out}{err}");
        }
        let (_, json, _) = office.say(&["check", "site.toml", "--format", "json"]);
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let one = &json["preview"]["benchmarks"][0];
        let number = |key: &str| one[key].as_u64();
        let counted = number("readings")
            .zip(number("corrected"))
            .zip(number("repeated"));
        assert_eq!(
            counted,
            counts.map(|(a, b, c)| ((a, b), c)),
            "{source}: {json}"
        );
        // The daemon takes each correction too.
        let daemon = office.run_logged(&["run", "site.toml"]);
        let (readings, corrected, repeated) = counts.unwrap_or_default();
        let taken = readings + corrected;
        let taken = format!("taken={taken} repeated={repeated} ");
        office.until("all is read", || office.log().contains("caught up"));
        let log = office.log();
        let line = log.lines().find(|line| line.contains("caught up")).unwrap();
        assert!(line.contains(&taken), "{source}: no {taken:?} in {log}");
        drop(daemon);
    }
}

#[test]
fn what_hardly_means_what_was_intended_is_said_as_a_suspicion_with_its_evidence() {
    let table = |row: &dyn Fn(jiff::civil::DateTime, f64) -> String| {
        format!("time,P1_displacement_mm\n{}", rows(60, row))
    };
    let marked = plain(60).replace("+02:00,10\n", "+02:00,-999\n");
    let wobble = |value: f64| value * 0.01 + (value * 7.0).sin();
    let fallen = table(&|time, value| {
        let after = if value > 20.0 { -400.0 } else { 0.0 };
        format!("{time}+02:00,{:.3}\n", wobble(value) + after)
    });
    let metres = table(&|time, value| format!("{time}+02:00,{:.3}\n", 12.345 + value / 1000.0));
    let ahead = plain(60).replace("2017-", "2417-");
    let cases = [
        (marked, "-999 stands 1 time, first at 2017-06-01T18:00:00Z"),
        (fallen, "it fell by 401.824 mm, 195 times the usual scatter"),
        (metres, "unit = \"m\""),
        (ahead, "ahead of this machine's clock: is the time_zone"),
    ];
    for (text, wanted) in cases {
        let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
        let (_, out, err) = office.say(&["check", "site.toml"]);
        let line = out.lines().find(|line| line.contains("suspicion: "));
        assert!(
            line.is_some_and(|line| line.contains(wanted)),
            "no {wanted:?} in {out}"
        );
        assert!(err.contains(wanted), "{err}");
    }
    let office = Office::with(&[
        ("slope.csv", &plain(60)),
        ("site.toml", &site("slope.csv", "")),
    ]);
    assert!(
        !office.done(&["check", "site.toml"]).contains("suspicion"),
        "a plain record"
    );
}

#[test]
fn a_relative_path_stands_once_in_an_error() {
    let office = Office::with(&[]);
    fs::create_dir_all(office.path("x/in")).unwrap();
    fs::write(
        office.path("x/in/slope.csv"),
        "time,P1_displacement_mm\nnoon,1\n",
    )
    .unwrap();
    let said = office.refused(65, &["fit", "x/in/slope.csv"]);
    assert!(said.starts_with("x/in/slope.csv, line 2"), "{said}");
}

#[test]
fn a_workbook_is_refused_with_the_way_out() {
    let office = Office::with(&[("slope.xlsx", "PK")]);
    let mut said = vec![office.refused(65, &["init", "slope.xlsx"])];
    said.push(office.refused(65, &["fit", "slope.xlsx"]));
    fs::write(office.path("site.toml"), site("slope.xlsx", "")).unwrap();
    said.push(office.refused(78, &["check", "site.toml"]));
    for said in said {
        assert!(said.contains("CSV UTF-8"), "{said}");
    }
}

#[test]
fn what_cannot_be_meant_is_refused_with_what_can() {
    let office = Office::with(&[
        ("slope.csv", &plain(40)),
        ("site.toml", &site("slope.csv", "")),
    ]);
    let said = office.refused(2, &["events", "--config", "site.toml", "--kind", "nosuch"]);
    assert!(
        said.contains("regime-flip") && said.contains("alert"),
        "{said}"
    );
    let said = office.refused(2, &["replay", "slope.csv", "--until", "1985-08-07"]);
    assert!(said.contains("1985-08-07T17:00:00Z"), "{said}");
}

#[test]
fn a_replay_of_a_state_keeps_to_the_benchmark_and_an_acknowledgement_is_shown() {
    let both = plain(60).replace("P1_", "P2_");
    let office = Office::with(&[("a.csv", &plain(60)), ("b.csv", &both)]);
    fs::write(office.path("site.toml"), site("*.csv", "")).unwrap();
    let daemon = office.run(&["run", "site.toml"]);
    office.status_until("in force:");
    office.done(&["alerts", "ack", "--by", "Ada", "--config", "site.toml"]);
    office.status_until("by Ada");
    drop(daemon);
    let listed = office.done(&["alerts", "list", "--config", "site.toml"]);
    assert!(listed.contains("acknowledge by Ada"), "{listed}");
    let events = office.done(&[
        "replay",
        "--state",
        "state",
        "--benchmark",
        "P1",
        "--format",
        "json",
    ]);
    assert!(events.contains("\"P1\""), "{events}");
    assert!(!events.contains("\"benchmark\":\"P2\""), "{events}");
    // Under another policy than the daemon had.
    let state = ["replay", "--state", "state", "--format", "json"];
    let lived = office.done(&state);
    let own = office.done(&[&state[..], &["--config", "site.toml"]].concat());
    assert_eq!(own, lived);
    let strict = "[alert]\ncritical_velocity = \"5 mm/day\"\n";
    fs::write(office.path("strict.toml"), site("*.csv", strict)).unwrap();
    let strict = office.done(&[&state[..], &["--config", "strict.toml"]].concat());
    let by_velocity = "\"rule\":\"critical-velocity\"";
    assert!(!lived.contains(by_velocity) && strict.contains(by_velocity));
    for line in office.done(&["status", "--config", "site.toml"]).lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let said = office.refused(65, &["replay", "--state", "state", "--benchmark", "P9"]);
    assert!(said.contains("P9") && said.contains("P1"), "{said}");
}

/// The commands of a page: its indented lines.
fn commands(page: &str) -> Vec<String> {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
    let lines = text.lines().filter_map(|line| line.strip_prefix("    "));
    lines.map(str::to_owned).collect()
}

#[test]
fn every_command_of_the_page_on_the_first_site_does_what_it_says() {
    let office = Office::with(&[("slope.csv", &of_the_office(200))]);
    let programs = Path::new(PROGRAM).parent().unwrap().to_str().unwrap();
    let path = format!("{programs}:{}", std::env::var("PATH").unwrap());
    let shell = |line: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", line]).current_dir(office.folder.path());
        command.env("PATH", &path);
        command
    };
    let mut daemon = None;
    let commands = commands("docs/first-site.md");
    assert!(commands.len() >= 10, "{commands:?}");
    for line in &commands {
        if line.starts_with("slipwatch run ") {
            let mut command = shell(&format!("exec {line}"));
            command.stdout(Stdio::null()).stderr(Stdio::null());
            daemon = Some(Daemon(command.spawn().unwrap()));
            office.status_until("P1");
            continue;
        }
        let (exit, out, err) = ended(&shell(line).output().unwrap());
        // A machine may be doubtful; that is no fault of the command.
        let is_doctor = line.starts_with("slipwatch doctor ");
        assert!(
            exit == 0 || is_doctor && exit == 1,
            "{line}: {exit} {out}{err}"
        );
        if line == "cat hook.txt" {
            assert!(out.starts_with("Test: "), "{out}");
        }
    }
    assert!(daemon.is_some(), "{commands:?}");
}

#[test]
fn the_readme_shows_no_other_commands_for_a_slope_of_ones_own_than_those_that_are_run() {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let (_, rest) = text.split_once("## A slope of your own").unwrap();
    let (part, _) = rest.split_once("\n## ").unwrap();
    let shown: Vec<&str> = part
        .lines()
        .filter_map(|line| line.strip_prefix("    "))
        .collect();
    assert_eq!(shown.len(), 5, "{shown:?}");
    let run = commands("docs/first-site.md");
    for line in shown {
        assert!(run.iter().any(|one| one == line), "{line} is in no test");
    }
}

#[test]
fn doctor_tries_the_files_and_the_broker_and_knows_a_hook_from_windows() {
    let more = "[[source]]\nid = \"rain\"\nkind = \"csv\"\npath = \"rain/*.csv\"\n\
                [[source]]\nid = \"radio\"\nkind = \"mqtt\"\nurl = \"mqtt://127.0.0.1:1\"\ntopic = \"a\"\n\
                [[hook]]\nrun = [\"./notify.sh\"]\n";
    let office = Office::with(&[
        ("slope.csv", &plain(5)),
        ("site.toml", &site("slope.csv", more)),
        ("notify.sh", "#!/bin/sh\r\necho\r\n"),
    ]);
    let script = office.path("notify.sh");
    fs::set_permissions(&script, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let (exit, out, err) = office.say(&["doctor", "site.toml"]);
    assert_eq!(exit, 1, "{out}{err}");
    for (verdict, part) in [
        ("good", "\"logger\": files that can be read: 1"),
        ("doubtful", "there is no folder"),
        ("wrong", "cannot be reached"),
        ("wrong", "end as on Windows"),
    ] {
        let line = out.lines().find(|line| line.contains(part));
        assert!(
            line.is_some_and(|line| line.starts_with(verdict)),
            "{part}: {out}"
        );
    }
}
