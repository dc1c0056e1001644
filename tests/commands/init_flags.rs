//! What `init` makes of flags and of files that are not one table of readings.

use crate::office::{Office, plain, rows, site};
use std::fs;
use std::path::Path;

fn written(office: &Office) -> String {
    fs::read_to_string(office.path("site.toml")).unwrap()
}

/// A table of days, six hours apart.
fn of_days(count: i64) -> String {
    let rows: Vec<String> = (0..count)
        .map(|row| format!("{},{}\n", 0.25 * row as f64, 0.1 * row as f64))
        .collect();
    format!("t_days,P1_displacement_mm\n{}", rows.concat())
}

#[test]
fn day_0_of_a_table_is_written_and_watched_and_said_where_it_is_assumed() {
    let office = Office::with(&[("slope.csv", &of_days(40))]);
    let said = office.done(&["init", "slope.csv", "--epoch", "2021-03-01T00:00:00Z"]);
    let config = written(&office);
    assert!(
        config.contains("epoch = \"2021-03-01T00:00:00Z\""),
        "{config}"
    );
    assert!(said.contains("first 2021-03-01T00:00:00Z"), "{said}");
    assert!(!said.contains("day 0 is taken"), "{said}");
    let replay = ["replay", "slope.csv", "--config", "site.toml"];
    let events = office.done(&[&replay[..], &["--format", "json"]].concat());
    assert!(
        events.contains("2021-03-10T18:00:00Z") && !events.contains("2000-01"),
        "{events}"
    );
    let daemon = office.run(&["run", "site.toml"]);
    office.status_until("2021-03-10 18:00");
    drop(daemon);

    let office = Office::with(&[("slope.csv", &of_days(40))]);
    for args in [&["init", "slope.csv"][..], &["check", "site.toml"]] {
        let said = office.done(args);
        assert!(
            said.contains("day 0 is taken as 2000-01-01T00:00:00Z") && said.contains("--epoch"),
            "{said}"
        );
    }
    let office = Office::with(&[("slope.csv", &plain(20))]);
    let (exit, _, said) = office.say(&["init", "slope.csv", "--epoch", "2021-03-01T00:00:00Z"]);
    assert!(
        exit == 0 && said.contains("no file has a column t_days"),
        "{said}"
    );
}

#[test]
fn an_epoch_is_of_tables_alone() {
    let config = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"a\"\nkind = \"ndjson\"\npath = \"*.ndjson\"\nepoch = \"2021-03-01T00:00:00Z\"\n";
    let office = Office::with(&[("site.toml", config)]);
    let said = office.refused(78, &["check", "site.toml"]);
    assert!(
        said.contains("source.epoch does nothing for this kind"),
        "{said}"
    );
}

#[test]
fn the_span_of_means_is_written_for_velocities() {
    let body = rows(40, |time, value| format!("{time}+02:00,{value},{value}\n"));
    let text = format!("time,P1_velocity_mm_per_h,P2_displacement_mm\n{body}");
    let office = Office::with(&[("slope.csv", &text)]);
    office.done(&["init", "slope.csv", "--averaging", "1h"]);
    let config = written(&office);
    assert_eq!(
        config.matches("\naveraging = \"1h\"").count(),
        1,
        "{config}"
    );
    let of_p1 = config.find("id = \"P1\"").unwrap();
    assert!(
        config[of_p1..].find("averaging").unwrap() < config[of_p1..].find("id = \"P2\"").unwrap()
    );
}

#[test]
fn a_table_with_one_row_a_point_is_refused_with_what_to_do() {
    let long = |name: &str, together: bool| {
        let body = rows(60, |time, value| {
            let second = if together { "00" } else { "30" };
            let date = time.strftime("%FT%H");
            format!(
                "{date}:00:00Z,P1,{value}\n{date}:00:{second}Z,P2,{}\n",
                50.0 + value
            )
        });
        format!("time,{name},displacement_mm\n{body}")
    };
    for text in [long("point", true), long("wo", true), long("Prisma", false)] {
        let office = Office::with(&[("slope.csv", &text)]);
        let said = office.refused(2, &["init", "slope.csv"]);
        for part in [
            "slope.csv: column",
            "looks like the names of points, one row a point (P1, P2)",
            "split the file",
            "\"benchmark\": \"P1\"",
        ] {
            assert!(said.contains(part), "no {part:?} in {said}");
        }
        assert!(!office.path("site.toml").exists());
    }
    // Numbers of points that are read in turn, channels of one time, and sensors one below the other.
    let turn = rows(60, |time, value| {
        let hour = time.strftime("%FT%H");
        format!("{hour}:00:00Z,101,{value}\n{hour}:20:00Z,102,{value}\n{hour}:40:00Z,103,{value}\n")
    });
    let channels = rows(60, |time, value| {
        format!("{time}Z,1,{value}\n{time}Z,2,{}\n", 50.0 + value)
    });
    let of = |sensor: &str, minute: u32| {
        rows(60, |time, value| {
            format!(
                "{}:{minute:02}:00Z,{sensor},{value}\n",
                time.strftime("%FT%H")
            )
        })
    };
    let below = format!("{}{}", of("EX1", 0), of("EX2", 7));
    for (name, body) in [("Prisma Nr", turn), ("wo", channels), ("Sensor", below)] {
        let text = format!("time,{name},displacement_mm\n{body}");
        let office = Office::with(&[("slope.csv", &text)]);
        let said = office.refused(2, &["init", "slope.csv"]);
        assert!(said.contains("looks like the names of points"), "{said}");
    }
    // Whole millimetres under the name of a sensor are readings.
    let body = rows(60, |time, value| {
        let whole = (value + f64::from(i32::from(time.hour()) * 7 % 5)).round();
        format!("{time}+02:00,{whole}\n")
    });
    let office = Office::with(&[("slope.csv", &format!("time,Sensor 1\n{body}"))]);
    let map = "Sensor 1=P1:displacement:mm";
    office.done(&["init", "slope.csv", "--column", map]);
    // A column of remarks, or of the state of an instrument, names no point.
    let body = rows(60, |time, value| {
        let state = if time.hour() % 2 == 0 { "ok" } else { "weak" };
        format!("{time}+02:00,{value},{state},Meier\n")
    });
    let text = format!("time,P1_displacement_mm,sensor_status,observer\n{body}");
    Office::with(&[("slope.csv", &text)]).done(&["init", "slope.csv"]);
}

#[test]
fn a_file_of_covariates_alone_goes_beside_one_with_readings() {
    let rain = rows(60, |time, _| format!("{time}+02:00,0.2\n"));
    let rain = format!("time,rain_mm\n{rain}");
    let unknown = rain.replace("rain_mm", "lower");
    let files = [
        ("rain.csv", rain.as_str()),
        ("slope.csv", &plain(60)),
        ("lower.csv", &unknown),
    ];
    let office = Office::with(&files);
    let (exit, out, err) = office.say(&["init", "rain.csv", "slope.csv"]);
    assert_eq!(exit, 0, "{out}{err}");
    assert!(
        err.contains("rain.csv: it is taken for covariates alone (rain_mm)"),
        "{err}"
    );
    assert!(out.contains("covariate rain_mm (rain): 60 values"), "{out}");
    assert!(out.contains("sources: 2, benchmarks: 1"), "{out}");
    office.done(&["check", "site.toml"]);
    // By itself it is none, and no rain is the example of a reading.
    let said = office.refused(2, &["init", "rain.csv", "--force"]);
    assert!(
        said.contains("--column \"NAME=P1:displacement:UNIT\""),
        "{said}"
    );
    // What may be a reading is asked for.
    let said = office.refused(2, &["init", "slope.csv", "lower.csv", "--force"]);
    assert!(
        said.contains("--column \"lower=P1:displacement:UNIT\""),
        "{said}"
    );
    let stated = [
        "init",
        "slope.csv",
        "lower.csv",
        "--force",
        "--covariate",
        "lower=level",
    ];
    let (exit, out, err) = office.say(&stated);
    assert!(
        exit == 0 && out.contains("level, as the config states"),
        "{out}{err}"
    );
    let both = rows(60, |time, value| format!("{time}+02:00,0.2,{value}\n"));
    let both = format!("time,rain_mm,way_cm\n{both}");
    let office = Office::with(&[("slope.csv", &both)]);
    let said = office.refused(2, &["init", "slope.csv"]);
    assert!(
        said.contains("--column \"way_cm=P1:displacement:cm\""),
        "{said}"
    );
}

#[test]
fn what_is_no_file_is_refused_at_once_and_bad_data_are_no_matter_of_flags() {
    let bad = "time,remark\n2026-01-01T00:00:00Z,dry\n2026-01-01T01:00:00Z,wet snow\n";
    let office = Office::with(&[("bad.csv", bad)]);
    let pipe = office.path("pipe.csv");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    for name in ["pipe.csv", "-", "/dev/null"] {
        let said = office.refused(2, &["init", name]);
        assert!(
            said.contains("is no file that a daemon could follow"),
            "{said}"
        );
    }
    let said = office.refused(65, &["init", "bad.csv"]);
    assert!(said.contains("give a file that has some"), "{said}");
    assert!(!office.path("site.toml").exists());
}

#[test]
fn a_column_without_a_name_is_passed_over_where_it_is_empty() {
    let rows = rows(30, |time, value| format!("{time}+02:00;{value};\n"));
    let with = format!("time;P1_displacement_mm;\n{rows}");
    let short = with
        .replace(";\n2017", "\n2017")
        .replacen("mm\n", "mm;\n", 1);
    for text in [&with, &short] {
        let office = Office::with(&[("slope.csv", text)]);
        let said = office.done(&["init", "slope.csv"]);
        assert!(said.contains("30 readings of displacement"), "{said}");
        let fit = office.done(&["fit", "slope.csv"]);
        assert!(fit.contains("30 readings"), "{fit}");
    }
    let filled = with.replacen(";\n2017-06-01T05", ";7\n2017-06-01T05", 1);
    assert_ne!(filled, with);
    let office = Office::with(&[("slope.csv", &filled)]);
    let said = office.refused(65, &["fit", "slope.csv"]);
    assert!(
        said.contains("found \"7\"") && said.contains("a name for this column"),
        "{said}"
    );
}

#[test]
fn what_cannot_be_written_or_read_is_named() {
    let office = Office::with(&[("slope.csv", &plain(30))]);
    let config = "/nonexistent/folder/site.toml";
    assert!(!Path::new("/nonexistent").exists());
    let said = office.refused(74, &["init", "slope.csv", "-o", config]);
    assert!(said.contains(config), "{said}");
    let torn = plain(30).replacen("-06-01T05", "\0\0\0", 1);
    fs::write(office.path("slope.csv"), torn).unwrap();
    fs::write(office.path("site.toml"), site("slope.csv", "")).unwrap();
    let said = office.done(&["check", "site.toml"]);
    let line = said.lines().find(|line| line.contains("NUL")).unwrap();
    assert!(line.contains("slope.csv, line 7"), "{line}");
}

#[test]
fn lines_before_the_header_are_passed_over_by_init_replay_and_the_daemon_also_after_a_restart() {
    let text = format!("Crackmeter 7;Toc\nserial 4711\n{}", plain(40));
    let office = Office::with(&[("slope.csv", &text)]);
    let (_, _, said) = office.say(&["init", "slope.csv"]);
    assert!(said.contains("--skip-lines"), "{said}");
    office.refused(65, &["replay", "slope.csv"]);
    office.done(&["init", "slope.csv", "--skip-lines", "2"]);
    let config = written(&office);
    assert!(config.contains("skip_lines = 2"), "{config}");
    office.done(&["replay", "slope.csv", "--skip-lines", "2"]);
    let daemon = office.run(&["run", "site.toml"]);
    office.status_until("2017-06-02 13:00");
    drop(daemon);
    let more = rows(42, |time, value| format!("{time}+02:00,{value}\n"));
    let more: String = more.split_inclusive('\n').skip(40).collect();
    fs::write(office.path("slope.csv"), format!("{text}{more}")).unwrap();
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.status_until("2017-06-02 15:00");
    drop(daemon);
    let log = office.log();
    assert!(
        !log.contains("line quarantined") && !log.contains("no position"),
        "{log}"
    );
    // Other lines before it: the file is read anew, and what is known of it dropped.
    fs::write(
        office.path("site.toml"),
        config.replace("skip_lines = 2", "skip_lines = 3"),
    )
    .unwrap();
    fs::write(
        office.path("slope.csv"),
        format!("a new firmware\n{text}{more}"),
    )
    .unwrap();
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.until("read anew", || office.log().contains("caught up"));
    drop(daemon);
    assert!(office.log().contains("repeated=42"), "{}", office.log());
}

/// A logger that begins a file each day, of which the first is there.
#[test]
fn what_follows_the_file_of_a_day_is_said_where_its_path_stands_and_is_then_read() {
    let day = |day: u32| {
        let row = |hour| format!("2026-11-{day:02}T{hour:02}:00:00Z,{}\n", day * 24 + hour);
        format!(
            "time,displacement_mm\n{}",
            (0..24).map(row).collect::<String>()
        )
    };
    let office = Office::with(&[("logger_2026-11-23.csv", &day(23))]);
    office.done(&["init", "logger_2026-11-23.csv"]);
    let config = written(&office);
    assert!(config.contains("path = \"logger_*.csv\""), "{config}");
    let followed = config
        .replace(
            "path = \"logger_2026-11-23.csv\"",
            "path = \"logger_*.csv\"",
        )
        .replacen(
            "[[benchmark]]\nid = \"logger_2026-11-23\"",
            "[[benchmark]]\nid = \"logger\"\ncolumn = \"displacement_mm\"",
            1,
        );
    fs::write(office.path("site.toml"), followed).unwrap();
    fs::write(office.path("logger_2026-11-24.csv"), day(24)).unwrap();
    let said = office.done(&["check", "site.toml"]);
    assert!(said.contains("48 readings of displacement"), "{said}");
}
