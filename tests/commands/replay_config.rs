//! What `replay --config` plays: what the daemon would have taken.

use crate::office::{Office, plain, rows, site};
use std::fs;

const REPLAY: [&str; 4] = ["replay", "slope.csv", "--config", "site.toml"];

#[test]
fn rows_that_cannot_be_used_are_set_aside_as_the_daemon_does() {
    let whole = plain(60);
    let bad = whole
        .replacen(",10\n", ",ten\n", 1)
        .replacen(",12\n", ",twelve\n", 1)
        .replacen(",15\n", ",15,2\n", 1);
    let config = site("slope.csv", "");
    let office = Office::with(&[("slope.csv", &bad), ("site.toml", &config)]);
    let (exit, out, err) = office.say(&REPLAY);
    assert_eq!(exit, 0, "{out}{err}");
    for part in [
        "slope.csv: rows that cannot be used, set aside as the daemon does: 3",
        "2 rows, the first: slope.csv, line 22",
        "1 row, the first: slope.csv, line 32",
    ] {
        assert!(err.contains(part), "no {part:?} in {err}");
    }
    // The rest is what it is without those rows.
    let kept = whole
        .lines()
        .filter(|line| [",10", ",12", ",15"].iter().all(|end| !line.ends_with(end)));
    let kept: Vec<&str> = kept.collect();
    let other = Office::with(&[
        ("slope.csv", &format!("{}\n", kept.join("\n"))),
        ("site.toml", &config),
    ]);
    assert_eq!(other.done(&REPLAY), out);
    // By itself a file is whole, or refused.
    let said = office.refused(65, &["replay", "slope.csv"]);
    assert!(said.contains("line 22"), "{said}");
    // A column that has held nothing yet is no fault to a daemon.
    let empty = whole.replacen("_mm\n", "_mm,P2_displacement_mm\n", 1);
    let empty = empty.replace("\n2017", ",\n2017");
    let empty = empty.replacen("_mm,\n", "_mm\n", 1);
    fs::write(office.path("slope.csv"), format!("{},\n", empty.trim_end())).unwrap();
    office.refused(65, &["replay", "slope.csv"]);
    office.done(&REPLAY);
}

#[test]
fn a_flag_that_the_config_stands_over_is_refused_with_the_key_to_set() {
    let office = Office::with(&[
        ("slope.csv", &plain(60)),
        (
            "other.csv",
            &plain(60).replace("P1", "P2").replace("+02:00", ""),
        ),
        ("site.toml", &site("slope.csv", "")),
    ]);
    let cases: [(&[&str], &str); 12] = [
        (&["--missing", "-7999"], "missing of [[source]]"),
        (&["--time-zone", "Europe/Rome"], "time_zone of [[source]]"),
        (&["--dst", "standard"], "dst of [[source]]"),
        (&["--epoch", "2021-03-01T00:00:00Z"], "epoch of [[source]]"),
        (&["--delimiter", "comma"], "delimiter of [[source]]"),
        (&["--decimal", "point"], "decimal of [[source]]"),
        (&["--thousands", "blank"], "thousands of [[source]]"),
        (&["--time-column", "time"], "time_column of [[source]]"),
        (&["--time-format", "rfc3339"], "time_format of [[source]]"),
        (&["--skip-lines", "0"], "skip_lines of [[source]]"),
        (&["--averaging", "1h"], "averaging of [[benchmark]]"),
        (
            &["--column", "P1_displacement_mm=P7:displacement:mm"],
            "column and unit of [[benchmark]]",
        ),
    ];
    for (flag, key) in cases {
        let said = office.refused(2, &[&REPLAY[..], flag].concat());
        assert!(
            said.contains("slope.csv") && said.contains(flag[0]) && said.contains(key),
            "{said}"
        );
    }
    // A file of no source is read as the flags say.
    let both = ["replay", "slope.csv", "other.csv", "--config", "site.toml"];
    let (exit, out, err) = office.say(&[&both[..], &["--time-zone", "UTC"]].concat());
    assert_eq!(exit, 0, "{out}{err}");
    assert!(err.contains("--time-zone is for the other files"), "{err}");
    let report = ["report", "--config", "site.toml", "-o", "out"];
    office.refused(2, &[&report[..], &["--missing", "-7999"]].concat());
    office.refused(2, &[&report[..], &["--evacuation-time", "6h"]].concat());
}

#[test]
fn only_what_the_config_watches_is_played_and_reaches_hooks() {
    let text = rows(200, |time, value| {
        let fast = 1000.0 / (210.0 - 2.0 * value);
        format!("{time}+02:00,{},{fast}\n", 0.01 * value)
    });
    let text = format!("time,P1_displacement_mm,P2_displacement_mm\n{text}");
    let hook = "[[hook]]\nrun = [\"/bin/sh\", \"hook.sh\"]\n[[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";
    let watched = format!("[[benchmark]]\nid = \"P1\"\n{hook}");
    let office = Office::with(&[
        ("slope.csv", &text),
        ("site.toml", &site("slope.csv", &watched)),
        ("hook.sh", "echo $SLIPWATCH_BENCHMARK >> called\n"),
    ]);
    let (exit, out, err) = office.say(&[&REPLAY[..], &["--hooks"]].concat());
    assert_eq!(exit, 0, "{out}{err}");
    assert!(!out.contains("P2"), "{out}");
    assert!(
        err.contains("slope.csv: not watched, and not played")
            && err.contains("displacement of P2"),
        "{err}"
    );
    let called = fs::read_to_string(office.path("called")).unwrap_or_default();
    assert!(!called.contains("P2"), "{called}");
    // Where the source names no benchmark all of them are watched.
    fs::write(office.path("site.toml"), site("slope.csv", hook)).unwrap();
    let out = office.done(&[&REPLAY[..], &["--hooks"]].concat());
    assert!(out.contains("P2"), "{out}");
    let called = fs::read_to_string(office.path("called")).unwrap();
    assert!(called.contains("P2"), "{called}");
}

#[test]
fn a_state_is_played_without_files_and_flags_about_them() {
    let office = Office::with(&[("slope.csv", &plain(20))]);
    fs::create_dir(office.path("state")).unwrap();
    let state = ["replay", "--state", "state"];
    let more: [&[&str]; 5] = [
        &["slope.csv"],
        &["--channels", "slope.csv"],
        &["--missing", "-7999"],
        &["--time-zone", "UTC"],
        &["--evacuation-time", "6h"],
    ];
    for more in more {
        let said = office.refused(2, &[&state[..], more].concat());
        assert!(said.contains("--state"), "{said}");
    }
}

#[test]
fn a_file_of_covariates_that_belongs_to_a_source_is_read_as_that_says() {
    let rain = rows(60, |time, value| {
        format!(
            "{};{}\n",
            time.strftime("%d.%m.%Y %H:%M"),
            format!("{:.2}", value + 100.25).replace('.', ",")
        )
    });
    let rain = format!("Zeit;rain_mm\n{rain}");
    let more = "[[source]]\nid = \"rain\"\nkind = \"csv\"\npath = \"rain.csv\"\ndelimiter = \"semicolon\"\ndecimal = \"comma\"\n\
                time_column = \"Zeit\"\ntime_format = \"%d.%m.%Y %H:%M\"\ntime_zone = \"Europe/Rome\"\n";
    let office = Office::with(&[
        ("slope.csv", &plain(60)),
        ("rain.csv", &rain),
        ("site.toml", &site("slope.csv", more)),
    ]);
    let record = ["--record", "all.mcap", "--channels", "rain.csv"];
    office.done(&[&REPLAY[..], &record].concat());
    office.done(&["convert", "all.mcap", "all.csv"]);
    let all = fs::read_to_string(office.path("all.csv")).unwrap();
    for part in ["rain_mm", "129.75"] {
        assert!(all.contains(part), "{all}");
    }
    // Which leaves no file to a flag.
    let flag = ["--channels", "rain.csv", "--decimal", "comma"];
    let said = office.refused(2, &[&REPLAY[..], &flag].concat());
    assert!(said.contains("decimal of [[source]]"), "{said}");
}
