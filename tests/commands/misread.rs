//! Files and configs that would be misread: what they state counts, and what contradicts them is said.

use crate::office::{Office, plain, rows, site};
use std::fs;
use std::os::unix::fs::PermissionsExt;

fn contains_all(said: &str, parts: &[&str]) {
    for part in parts {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
}

/// All that `check` says.
fn checked(office: &Office) -> String {
    let (_, out, err) = office.say(&["check", "site.toml"]);
    format!("{out}{err}")
}

#[test]
fn a_unit_without_a_column_counts_before_the_one_in_the_columns_name() {
    let more = "[[benchmark]]\nid = \"P1\"\nunit = \"m\"\n";
    let config = site("slope.csv", more);
    let office = Office::with(&[("slope.csv", &plain(40)), ("site.toml", &config)]);
    let said = checked(&office);
    contains_all(
        &said,
        &[
            "P1_displacement_mm  benchmark P1, m",
            "19.5 m",
            "named as one in mm, and taken in m",
        ],
    );
}

#[test]
fn a_unit_of_the_units_line_that_cannot_be_read_is_named_and_mm_is_not_proposed() {
    let table = |unit: &str| {
        let body = rows(40, |time, value| {
            format!("\"{}\",{value}\n", time.strftime("%F %T"))
        });
        format!(
            "\"TOA5\",\"a\",\"b\",\"c\",\"d\",\"e\",\"f\",\"g\"\n\"TIMESTAMP\",\"Ext1\"\n\"TS\",\"{unit}\"\n\"\",\"Smp\"\n{body}"
        )
    };
    let office = Office::with(&[("a.dat", &table("furlongs"))]);
    let args = ["init", "a.dat", "--time-zone", "UTC"];
    let said = office.refused(2, &args);
    contains_all(&said, &["\"furlongs\"", "Ext1=P1:displacement:UNIT"]);
    let stated = [&args[..], &["--column", "Ext1=P1:displacement:mm"]].concat();
    let (_, out, err) = office.say(&stated);
    contains_all(
        &format!("{out}{err}"),
        &["the units line has \"furlongs\"", "taken in mm"],
    );
    for (unit, named) in [("inches", "in"), ("um", "um"), ("inches/day", "in_per_day")] {
        let said = Office::with(&[("a.dat", &table(unit))]).refused(2, &args);
        contains_all(&said, &[&format!(":{named}\"")]);
    }
}

/// As docs/failure-modes.md advises where a logger's unit changes.
#[test]
fn a_header_that_comes_again_with_another_unit_gives_the_same_benchmark_though_the_config_names_its_column()
 {
    let text = rows(20, |time, value| {
        let again = if (time.day(), time.hour()) == (1, 10) {
            "time,d_displacement_m\n"
        } else {
            ""
        };
        let value = if time.hour() < 10 {
            value
        } else {
            value / 1000.0
        };
        format!("{again}{}Z,{value:.5}\n", time.strftime("%FT%T"))
    });
    let text = format!("time,d_displacement_mm\n{text}");
    let more = "[[benchmark]]\nid = \"5\"\ncolumn = \"d_displacement_mm\"\n";
    let office = Office::with(&[("a.csv", &text), ("site.toml", &site("a.csv", more))]);
    let said = checked(&office);
    contains_all(&said, &["benchmark 5 (logger): 20 readings", "9.5 mm"]);
}

#[test]
fn a_header_that_comes_again_without_the_column_of_a_benchmark_is_a_warning() {
    let head = |name: &str, unit: &str| {
        format!(
            "\"TOA5\",\"a\",\"b\",\"c\",\"d\",\"e\",\"f\",\"g\"\n\"TIMESTAMP\",\"{name}\"\n\"TS\",\"{unit}\"\n\"\",\"Smp\"\n"
        )
    };
    let row = |time: jiff::civil::DateTime, value: f64| {
        let again = match (time.day(), time.hour()) {
            (2, 0) => head("Ext1", "cm"),
            (2, 6) => head("Ext2", "mm"),
            _ => String::new(),
        };
        let value = if time.day() == 1 { value } else { value / 10.0 };
        format!("{again}\"{}\",{value}\n", time.strftime("%F %T"))
    };
    let text = format!("{}{}", head("Ext1", "mm"), rows(40, row));
    let more =
        "time_zone = \"UTC\"\n[[benchmark]]\nid = \"T\"\ncolumn = \"Ext1_mm\"\nunit = \"mm\"\n";
    let config = site("a.dat", more).replace("\"csv\"", "\"toa5\"");
    let office = Office::with(&[("a.dat", &text), ("site.toml", &config)]);
    let said = checked(&office);
    contains_all(
        &said,
        &[
            "warning: source \"logger\"",
            "has no column \"Ext1_mm\", where the readings of benchmark \"T\" stood",
            "has \"Ext1_mm\" in cm, and it was \"Ext1_mm\" in mm before",
            "benchmark T (logger): 30 readings",
        ],
    );
    // A command without a config reads the rows above it.
    let mapped = [
        "fit",
        "a.dat",
        "--time-zone",
        "UTC",
        "--column",
        "Ext1_mm=T:displacement:mm",
    ];
    let (_, out, err) = office.say(&mapped);
    assert!(
        !format!("{out}{err}").contains("no file has a column"),
        "{out}{err}"
    );
}

#[test]
fn a_clock_of_twelve_hours_is_asked_about_and_am_and_pm_may_stand_in_a_column() {
    let without = rows(100, |time, value| {
        format!("{},{value}\n", time.strftime("%F %I:%M"))
    });
    let text = format!("when,P1_displacement_mm\n{without}");
    let office = Office::with(&[("slope.csv", &text)]);
    let said = office.refused(2, &["init", "slope.csv", "--time-zone", "UTC"]);
    contains_all(&said, &["no hour is over 12", "--time-format"]);

    let with = rows(400, |time, value| {
        format!("{},{value}\n", time.strftime("%m/%d/%Y,%I:%M,%p"))
    });
    let text = format!("Date,Time,AMPM,P1_displacement_mm\n{with}");
    let office = Office::with(&[("slope.csv", &text)]);
    let said = office.done(&["init", "slope.csv", "--time-zone", "UTC"]);
    contains_all(
        &said,
        &[
            "400 readings",
            "first 2017-06-01T00:00:00Z",
            "last  2017-06-17T15:00:00Z",
        ],
    );
}

#[test]
fn the_zone_in_the_name_of_the_times_column_is_taken_and_a_contradiction_said() {
    let text = rows(40, |time, value| {
        format!("{time},{value}\n").replace('T', " ")
    });
    let text = format!("Time (UTC+1),P1_displacement_mm\n{text}");
    let office = Office::with(&[("slope.csv", &text)]);
    let said = office.done(&["init", "slope.csv"]);
    contains_all(&said, &["first 2017-05-31T23:00:00Z", "Etc/GMT-1"]);
    let (_, _, err) = office.say(&["init", "slope.csv", "--time-zone", "UTC", "--force"]);
    contains_all(
        &err,
        &["has the zone Etc/GMT-1 in its name, and --time-zone is UTC"],
    );
}

#[test]
fn a_script_that_the_kernel_cannot_run_is_said_by_check_and_doctor() {
    for (script, why) in [
        ("echo hi\n", "names no interpreter"),
        ("#!/bin/sh\r\necho hi\r\n", "lines end as on Windows"),
    ] {
        let config = site("slope.csv", "[[hook]]\nrun = [\"./hook.sh\"]\n");
        let office = Office::with(&[
            ("slope.csv", &plain(40)),
            ("site.toml", &config),
            ("hook.sh", script),
        ]);
        let executable = fs::Permissions::from_mode(0o755);
        fs::set_permissions(office.path("hook.sh"), executable).unwrap();
        contains_all(&checked(&office), &[why]);
        let (_, out, err) = office.say(&["doctor", "site.toml"]);
        contains_all(&format!("{out}{err}"), &[why]);
    }
}

#[test]
fn thresholds_that_are_exceeded_and_benchmarks_of_one_column_are_said() {
    let more = "[[benchmark]]\nid = \"A\"\ncolumn = \"P1_displacement_mm\"\n\
                [[benchmark]]\nid = \"B\"\ncolumn = \"P1_displacement_mm\"\n";
    let text = plain(40);
    let office = Office::with(&[
        ("slope.csv", &text),
        ("site.toml", &site("slope.csv", more)),
    ]);
    let said = checked(&office);
    contains_all(
        &said,
        &["several [[benchmark]] (A, B) have column = \"P1_displacement_mm\""],
    );
    assert!(!said.contains("is the id right"), "{said}");
    let more = "[alert]\n[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"12 mm\"\n";
    let office = Office::with(&[
        ("slope.csv", &text),
        ("site.toml", &site("slope.csv", more)),
    ]);
    contains_all(
        &checked(&office),
        &["it has moved by 19.5 mm", "\"12 mm\" calls red"],
    );
}

#[test]
fn a_declared_reset_is_no_fall_and_a_contradicting_size_is_said() {
    let text = rows(100, |time, value| {
        let noise = f64::from(time.hour() % 3) * 0.2;
        let value = if value < 30.0 { value } else { value - 35.0 };
        format!("{time}Z,{:.2}\n", value + noise)
    });
    let text = format!("time,P1_displacement_mm\n{text}");
    let of = |size: &str| {
        let event = format!(
            "[[event]]\ntime = \"2017-06-03T11:30:00Z\"\nbenchmark = \"P1\"\nkind = \"reset\"\n{size}"
        );
        let more = format!("[[benchmark]]\nid = \"P1\"\n{event}");
        checked(&Office::with(&[
            ("slope.csv", &text),
            ("site.toml", &site("slope.csv", &more)),
        ]))
    };
    for size in ["", "size = -35.0\nunit = \"mm\"\n"] {
        let said = of(size);
        assert!(!said.contains("suspicion"), "{said}");
    }
    for size in [
        "size = 35.0\nunit = \"mm\"\n",
        "size = -35.0\nunit = \"m\"\n",
    ] {
        contains_all(
            &of(size),
            &["the reset declared for 2017-06-03T11:30:00Z has a size of"],
        );
    }
}

#[test]
fn check_says_how_rain_is_taken_and_where_it_is_a_total_of_each_day() {
    let of = |rain: &dyn Fn(jiff::civil::DateTime) -> f64| {
        let text = rows(200, |time, value| {
            format!("{time}Z,{value},{}\n", rain(time))
        });
        let text = format!("time,P1_displacement_mm,rain_mm\n{text}");
        Office::with(&[("slope.csv", &text)]).done(&["init", "slope.csv"])
    };
    let falling = of(&|time| f64::from(i32::from(time.hour()) * 7 % 5));
    contains_all(&falling, &["rain as it falls: each value"]);
    assert!(!falling.contains("a total of each day"), "{falling}");
    let of_days = of(&|time| f64::from(time.hour() / 6));
    contains_all(
        &of_days,
        &["it falls at 00:00:00 UTC alone, as a total of each day"],
    );
}

#[test]
fn a_header_without_rows_is_refused_and_messages_may_change_their_unit() {
    let office = Office::with(&[("slope.csv", "time,P1_displacement_mm\n")]);
    let said = office.refused(2, &["init", "slope.csv"]);
    contains_all(&said, &["a header and no row below it", "run init again"]);
    let text = rows(40, |time, value| {
        let (value, unit) = if value < 10.0 {
            (value, "mm")
        } else {
            (value / 1e3, "m")
        };
        format!(
            "{{\"benchmark\":\"P1\",\"time\":\"{time}Z\",\"value\":{value},\"unit\":\"{unit}\"}}\n"
        )
    });
    let office = Office::with(&[("m.ndjson", &text)]);
    let said = office.done(&["init", "m.ndjson"]);
    contains_all(&said, &["40 readings", "19.5 mm"]);
}

/// Rows `time,value` with the value as `cell` writes it, below a header of `names`.
fn table(names: &str, cell: impl Fn(jiff::civil::DateTime, f64) -> String) -> String {
    format!(
        "{names}\n{}",
        rows(60, |time, value| format!("{}\n", cell(time, value)))
    )
}

#[test]
fn points_that_may_part_thousands_are_asked_about_and_never_taken_for_decimals() {
    let text = table("Zeit;P1_displacement_um", |time, value| {
        format!(
            "{};{:.3}",
            time.strftime("%d.%m.%Y %H:%M"),
            2.064 + value / 1000.0
        )
    });
    let office = Office::with(&[("a.csv", &text)]);
    let args = ["init", "a.csv", "--time-zone", "Europe/Zurich"];
    let said = office.refused(2, &args);
    contains_all(
        &said,
        &["\"2.064\"", "--decimal point or --thousands point"],
    );
    let stated = [&args[..], &["--thousands", "point"]].concat();
    contains_all(&office.done(&stated), &["2064 um"]);
    let stated = [&args[..], &["--decimal", "point", "--force"]].concat();
    contains_all(&office.done(&stated), &["2.064 um"]);
}

#[test]
fn a_column_of_zones_is_read_or_asked_about() {
    let zone = |zone: &str| {
        let zone = zone.to_owned();
        table("TIMESTAMP,TZ,P1_displacement_mm", move |time, value| {
            format!("{},{zone},{value}", time.strftime("%F %T"))
        })
    };
    let first = "first 2017-06-01T00:00:00Z";
    let office = Office::with(&[("a.csv", &zone("UTC"))]);
    let utc = office.done(&["init", "a.csv"]);
    let (_, _, said) = office.say(&["init", "a.csv", "--time-zone", "Europe/Rome", "--force"]);
    contains_all(
        &said,
        &["column \"TZ\"", "(UTC)", "60 of 60 rows", "is that right?"],
    );
    assert!(utc.contains("in UTC") && utc.contains(first), "{utc}");
    // An offset is read with each row.
    let office = Office::with(&[("a.csv", &zone("+02:00"))]);
    let read = office.done(&["init", "a.csv"]);
    assert!(read.contains("first 2017-05-31T22:00:00Z"), "{read}");
    contains_all(
        &fs::read_to_string(office.path("site.toml")).unwrap(),
        &["time_column = [\"TIMESTAMP\", \"TZ\"]"],
    );
    // Letters are those of a clock that is changed in summer.
    let office = Office::with(&[("a.csv", &zone("CEST"))]);
    contains_all(
        &office.refused(2, &["init", "a.csv"]),
        &["(CEST)", "--time-zone"],
    );
    let (code, _, said) = office.say(&["init", "a.csv", "--time-zone", "Europe/Rome"]);
    assert!(code == 0 && !said.contains("TZ\" gives"), "{said}");
}

#[test]
fn a_line_of_units_below_the_header_is_read_as_such() {
    let text = table(
        "Date Time,Ext A,P2_displacement,Temp\nyyyy-mm-dd hh:mm,cm,mm,degC",
        |time, value| format!("{},{value},{value},12.5", time.strftime("%F %R")),
    );
    let office = Office::with(&[("a.csv", &text)]);
    let args = ["init", "a.csv", "--time-zone", "UTC"];
    let read = office.done(&args);
    contains_all(
        &read,
        &["P2_displacement_mm  benchmark P2, mm", "covariate Ext A"],
    );
    assert!(!read.contains("refused"), "{read}");
    // The unit that is stated of the other one is compared with the line's.
    let mapped = ["--force", "--column", "Ext A=P1:displacement:mm"];
    let said = office.done(&[&args[..], &mapped].concat());
    contains_all(&said, &["has \"cm\" for it, and it is taken in mm"]);
    let alone = text.replace("P2_displacement", "Ext B");
    let said = Office::with(&[("a.csv", &alone)]).refused(2, &args);
    contains_all(&said, &["Ext A=P1:displacement:cm"]);
}

#[test]
fn a_column_in_brackets_goes_on_in_another_unit_and_one_that_ends_is_a_warning() {
    let day = |day: u32, unit: &str, factor: f64| {
        let row = |hour: u32| {
            let value = f64::from(24 * day + hour) / 2.0 * factor;
            format!("2026-11-{day:02}T{hour:02}:00:00Z,{value:.3}")
        };
        let body: Vec<String> = (0..24).map(row).collect();
        format!("time,Ext1 [{unit}]\n{}\n", body.join("\n"))
    };
    let config = site(
        "d*.csv",
        "[[benchmark]]\nid = \"P1\"\nsource = \"logger\"\ncolumn = \"Ext1 [mm]\"\nunit = \"mm\"\n",
    );
    let with = |other: &str| {
        let office = Office::with(&[
            ("d1.csv", &day(1, "mm", 1.0)),
            ("d2.csv", &day(2, other, 0.1)),
            ("d6.csv", &day(6, other, 0.1)),
            ("site.toml", &config),
        ]);
        checked(&office)
    };
    contains_all(
        &with("cm"),
        &[
            "72 readings of displacement",
            "found cm, and mm before",
            "83.5 mm",
        ],
    );
    contains_all(
        &with("1/10 mm"),
        &[
            "its readings end at 2026-11-01T23:00:00Z",
            "does its column still stand",
        ],
    );
}

#[test]
fn a_growing_file_whose_unit_in_brackets_changes_is_converted_and_set_up_by_either_name() {
    let text = rows(40, |time, value| match time.hour() {
        0 if value > 0.0 => format!("time,Ext1 [cm]\n{time}Z,{}\n", value / 10.0),
        _ if value > 12.0 => format!("{time}Z,{}\n", value / 10.0),
        _ => format!("{time}Z,{value}\n"),
    });
    let office = Office::with(&[("a.csv", &format!("time,Ext1 [mm]\n{text}"))]);
    let args = ["init", "a.csv", "--column", "Ext1 [mm]=P1:displacement:mm"];
    contains_all(
        &office.done(&args),
        &[
            "40 readings of displacement",
            "19.5 mm",
            "it was \"Ext1 [mm]\" in mm before",
        ],
    );
}

/// What `init` says of one file of this name and text, which it must refuse.
fn refused_by_init(file: &str, text: &str, flags: &[&str]) -> String {
    let office = Office::with(&[(file, text)]);
    let (code, _, said) = office.say(&[&["init", file][..], flags].concat());
    assert_ne!(code, 0, "{file}");
    said
}

#[test]
fn what_init_cannot_read_is_called_by_its_name() {
    for (file, text, parts) in [
        (
            "rtk.csv",
            "GPSWeek,GPSSeconds,E(m)\n2434,172800.0,0.05\n2434,176400.0,0.06\n",
            ["GPS time", "t_days"],
        ),
        (
            "egms.csv",
            "pid,20200103,20200109,20200115,20200121,20200127\na,1,2,3,4,5\n",
            ["dates stand in its header", "one row a point"],
        ),
        (
            "raw.csv",
            "2026-09-01T00:00:00Z,1.5,2\n2026-09-01T01:00:00Z,1.5,2\n",
            ["a row and no header", "write one line above"],
        ),
        (
            "raw.dat",
            "101,2026,244,0,12.6\n101,2026,244,100,12.6\n",
            ["line 1", "under no header"],
        ),
        (
            "none.csv",
            "time,Ext,Ext\n2026-09-01T00:00:00Z,1,2\n",
            ["\"Ext\" stands more than once", "a name of its own"],
        ),
        (
            "twice.csv",
            "time,P1_displacement_mm,P1_displacement_mm\n2026-09-01T00:00:00Z,1,2\n",
            ["stands twice", "a name of its own"],
        ),
    ] {
        contains_all(&refused_by_init(file, text, &[]), &parts);
    }
    let flags = "--time-zone UTC --time-column Year --time-column DecimalDay --time-format";
    let flags: Vec<&str> = flags.split(' ').chain(["%Y %j"]).collect();
    let text = "Year,DecimalDay,Ext1_mm\n2026,244.041,0.1\n2026,244.083,0.1\n";
    let said = refused_by_init("day.csv", text, &flags);
    contains_all(&said, &["2026 244.041", "time_format"]);
}

#[test]
fn messages_of_several_devices_are_refused_and_times_have_the_column_that_is_named() {
    let messages = |devices: i8| {
        rows(40, |time, value| {
            let (at, device) = (
                time.to_zoned(jiff::tz::TimeZone::UTC)
                    .unwrap()
                    .timestamp()
                    .as_second(),
                time.hour() % devices,
            );
            format!("{{\"ts\": {at}, \"device\": \"ext{device}\", \"displacement\": {value}}}\n")
        })
    };
    let flags = "--time-column ts --time-format unix --column displacement=P1:displacement:mm";
    let flags: Vec<&str> = flags.split(' ').collect();
    let said = refused_by_init("a.ndjson", &messages(2), &flags);
    contains_all(&said, &["\"device\" looks like the names of points"]);
    let office = Office::with(&[("a.ndjson", &messages(1))]);
    let said = office.done(&[&["init", "a.ndjson"][..], &flags].concat());
    contains_all(
        &said,
        &["40 readings of displacement", "first 2017-06-01T00:00:00Z"],
    );
}

#[test]
fn names_of_covariates_that_stand_twice_cost_these_columns_alone() {
    let text = table("time,P1_displacement_mm,Temp,Temp", |time, value| {
        format!("{time}Z,{value},1,2")
    });
    let office = Office::with(&[("a.csv", &text)]);
    contains_all(
        &office.done(&["init", "a.csv"]),
        &[
            "60 readings of displacement",
            "stands more than once in the header",
        ],
    );
}
