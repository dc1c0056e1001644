//! Files as loggers and spreadsheets export them: what can be read wrongly is read rightly, or the flag that decides it is named.

use crate::office::{Office, rows, site};
use std::fs;

/// `init` in UTC of an hourly table of 60 rows, with what it prints.
fn begun(header: &str, row: impl Fn(jiff::civil::DateTime, f64) -> String) -> (Office, String) {
    let office = Office::with(&[("slope.csv", &format!("{header}\n{}", rows(60, row)))]);
    let said = office.done(&["init", "slope.csv", "--time-zone", "UTC"]);
    (office, said)
}

#[test]
fn a_time_of_day_in_a_column_of_its_own_is_found_however_it_is_written() {
    let ways = [
        ("Datum,Zeit", "%d.%m.%Y,%H%M"),
        ("Date,Time", "%m/%d/%Y,%I:%M %p"),
        ("Data,Ora", "%d/%m/%Y,%H.%M"),
        ("Date,Heure", "%Y-%m-%d,%Hh%M"),
        ("Datum,Stunde", "%d.%m.%Y,%H"),
        ("Date,Time", "%Y-%m-%d,%H%M%S"),
    ];
    for (columns, pattern) in ways {
        let header = format!("{columns},P1_displacement_mm");
        let (_, said) = begun(&header, |time, value| {
            // The 13th of a month is the day of no other date.
            let time = time.checked_add(jiff::Span::new().days(12)).unwrap();
            format!("{},{value}\n", time.strftime(pattern))
        });
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [
            "60 readings of displacement, every 1h",
            "first 2017-06-13T00:00:00Z",
            "last 2017-06-15T11:00:00Z",
        ] {
            assert!(said.contains(part), "{pattern}: no {part:?} in {said}");
        }
    }
}

#[test]
fn a_header_that_is_repeated_does_not_make_a_column_of_times_one_of_text() {
    let header = "Datum;Zeit;P1_displacement_mm";
    let (_, said) = begun(header, |time, value| {
        let again = if time.hour() == 12 {
            format!("{header}\n")
        } else {
            String::new()
        };
        format!("{again}{};{value}\n", time.strftime("%d.%m.%Y;%H:%M"))
    });
    assert!(said.contains("60 readings"), "{said}");
}

#[test]
fn days_alone_that_repeat_are_no_times_until_somebody_says_so() {
    let text = rows(60, |time, value| {
        format!(
            "{},{:.1},{value}\n",
            time.strftime("%d.%m.%Y"),
            1.5 * f64::from(time.hour())
        )
    });
    let text = format!("Datum,when,P1_displacement_mm\n{text}");
    let office = Office::with(&[("slope.csv", &text)]);
    let said = office.refused(2, &["init", "slope.csv", "--time-zone", "UTC"]);
    for part in [
        "column \"Datum\" gives no more than the day",
        "60 of 60 rows",
        "--time-format",
        "when",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    let stated = [
        "init",
        "slope.csv",
        "--time-zone",
        "UTC",
        "--time-column",
        "Datum",
    ];
    office.done(&stated);
}

#[test]
fn dates_in_one_row_of_digits_are_no_seconds_since_1970() {
    let ways = [
        ("Date", "%Y%m%d%H%M"),
        ("MESS_DATUM", "%Y%m%d%H"),
        ("time", "%Y%m%d%H%M%S"),
    ];
    for (column, pattern) in ways {
        let header = format!("{column},P1_displacement_mm");
        let (_, said) = begun(&header, |time, value| {
            format!("{},{value}\n", time.strftime(pattern))
        });
        assert!(said.contains("2017-06-03T11:00:00Z"), "{pattern}: {said}");
    }
    // Seconds since 1970 are no dates.
    let (_, said) = begun("time,P1_displacement_mm", |time, value| {
        let time = time.to_zoned(jiff::tz::TimeZone::UTC).unwrap();
        format!("{},{value}\n", time.timestamp().as_second())
    });
    assert!(said.contains("2017-06-03T11:00:00Z"), "{said}");
}

#[test]
fn the_end_of_a_day_is_a_time_and_what_a_spreadsheet_says_of_its_cells_no_header() {
    let (_, said) = begun("sep=;\nZeit;P1_displacement_mm", |time, value| {
        let midnight = time.hour() == 0;
        let day = if midnight {
            time.yesterday_at_24()
        } else {
            time.strftime("%Y-%m-%d %H:%M").to_string()
        };
        format!("{day};{value}\n")
    });
    assert!(
        said.contains("60 readings of displacement, every 1h"),
        "{said}"
    );
}

/// A date and time as its day's end.
trait EndOfDay {
    fn yesterday_at_24(&self) -> String;
}

impl EndOfDay for jiff::civil::DateTime {
    fn yesterday_at_24(&self) -> String {
        format!("{} 24:00", self.date().yesterday().unwrap())
    }
}

#[test]
fn a_header_with_other_columns_ends_what_is_understood_until_a_known_one_comes() {
    let row = |time: jiff::civil::DateTime, value: f64| {
        let again = match (time.day(), time.hour()) {
            (2, 0) => "Time;Batterie;Prisma 1\n",
            (3, 0) => "Zeit;Prisma 1;Batterie\n",
            _ => "",
        };
        let time = time.strftime("%Y-%m-%d %H:%M");
        if again.starts_with("Time") || (12.0..24.0).contains(&value) {
            format!("{again}{time};12.6;{value}\n")
        } else {
            format!("{again}{time};{value};12.6\n")
        }
    };
    let text = format!("Zeit;Prisma 1;Batterie\n{}", rows(60, row));
    let office = Office::with(&[("slope.csv", &text)]);
    let map = "Prisma 1=P1:displacement:mm";
    office.done(&["init", "slope.csv", "--time-zone", "UTC", "--column", map]);
    let (_, events, said) = office.say(&[
        "replay",
        "slope.csv",
        "--config",
        "site.toml",
        "--format",
        "json",
    ]);
    let last = events.lines().last().unwrap();
    let summary: serde_json::Value = serde_json::from_str(last).unwrap();
    assert_eq!(summary["readings"], 36, "{summary} {said}");
    assert!(said.contains("line 26, column \"Zeit\""), "{said}");
}

#[test]
fn a_unit_in_a_columns_name_is_the_one_that_is_proposed_and_another_one_is_remarked() {
    let proposals = [
        ("Prisma 1 [m]", "Prisma 1 [m]=P1:displacement:m\""),
        ("E [mm/h]", "E [mm/h]=P1:velocity:mm_per_h\""),
        ("L (um)", "L (um)=P1:displacement:um\""),
        ("L (dm)", "L (dm)=P1:displacement:UNIT\""),
        ("V [mm/min]", "V [mm/min]=P1:velocity:mm_per_min\""),
        ("V [mm/s]", "V [mm/s]=P1:velocity:UNIT\""),
    ];
    for (column, proposed) in proposals {
        let table = rows(60, |time, value| format!("{time}+00:00,{value}\n"));
        let office = Office::with(&[("slope.csv", &format!("time,{column}\n{table}"))]);
        let said = office.refused(2, &["init", "slope.csv"]);
        assert!(said.contains(proposed), "{column}: {said}");
    }
    let table = rows(60, |time, value| format!("{time}+00:00,{value}\n"));
    let office = Office::with(&[("slope.csv", &format!("time,Prisma 1 [m]\n{table}"))]);
    let map = "Prisma 1 [m]=P1:displacement:mm";
    let (exit, _, said) = office.say(&["init", "slope.csv", "--column", map]);
    assert_eq!(exit, 0, "{said}");
    assert!(
        said.contains("has the unit m in its name, and mm by --column"),
        "{said}"
    );
}

#[test]
fn columns_named_as_readings_in_a_unit_that_is_not_known_are_remarked() {
    let names = [
        "C_velocity_m_per_s",
        "D_displacement_km",
        "E_velocity_mm_s",
        "F_displacement_dm",
        "G displacement [\u{b5}m]",
    ];
    let header = format!("time,P1_displacement_mm,{}", names.join(","));
    let (_, said) = begun(&header, |time, value| {
        format!("{time}+00:00,{value},1,2,3,{value},5\n")
    });
    for name in names {
        let remark = format!("column {name:?}: named like a reading");
        assert!(said.contains(&remark), "no {remark:?} in {said}");
    }
    let (_, said) = begun(
        "time,P1_displacement_mm,displacement_sensor_voltage_v",
        |time, value| format!("{time}+00:00,{value},{}\n", 12.0 + value),
    );
    assert!(!said.contains("named like a reading"), "{said}");
}

#[test]
fn a_velocity_that_is_negative_all_along_is_doubted_and_turned_as_is_said() {
    let text = rows(60, |time, value| {
        format!("{time}+00:00,{:.4}\n", -0.1 - 0.01 * value)
    });
    let text = format!("time,P1_velocity_mm_per_h\n{text}");
    let turned =
        "[[benchmark]]\nid = \"P1\"\ncomponents = [\"P1_velocity_mm_per_h\"]\ndirection = [-1.0]\n";
    let office = Office::with(&[
        ("slope.csv", &text),
        ("turned.toml", &site("slope.csv", turned)),
    ]);
    let said = office.done(&["init", "slope.csv"]);
    assert!(
        said.contains("its velocity is negative") && said.contains("direction = [-1.0]"),
        "{said}"
    );
    let said = office.done(&["check", "turned.toml"]);
    assert!(
        !said.contains("is negative") && said.contains("60 readings"),
        "{said}"
    );
}

#[test]
fn a_table_for_a_config_is_one_line_and_score_names_both_ways_to_end() {
    let table = rows(60, |time, value| format!("{time}+00:00,{value}\n"));
    let office = Office::with(&[("slope.csv", &format!("time,P1_displacement_mm\n{table}"))]);
    for command in ["check", "run", "doctor"] {
        let said = office.refused(78, &[command, "slope.csv"]);
        assert!(
            said.contains("slipwatch init FILE") && said.lines().count() <= 2,
            "{said}"
        );
    }
    let said = office.refused(2, &["score", "slope.csv", "--failure-time", "2017-06-05"]);
    assert!(said.contains("2017-06-05T17:00:00Z"), "{said}");
    let said = office.refused(2, &["score", "slope.csv"]);
    assert!(
        said.contains("--failure-time") && said.contains("--no-failure"),
        "{said}"
    );
    assert!(fs::metadata(office.path("state")).is_err());
}

#[test]
fn one_cell_with_a_comma_does_not_change_how_the_readings_are_read() {
    let text = rows(200, |time, value| {
        let odd = if (value - 25.0).abs() < 0.1 {
            "\"12,5\""
        } else {
            ""
        };
        format!("{time}Z,2{value:05.2}0,{odd}\n")
    });
    let text = format!("time,P1_displacement_mm,Bemerkung\n{text}");
    let office = Office::with(&[("slope.csv", &text)]);
    let said = office.done(&["init", "slope.csv"]);
    assert!(
        said.contains("first 2017-06-01T00:00:00Z  200 mm"),
        "{said}"
    );
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    assert!(!config.contains("decimal"), "{config}");
    // A battery's voltage in all rows is a question.
    let text = rows(200, |time, value| {
        format!("{time}Z,2{value:05.2}0,\"12,6\"\n")
    });
    let text = format!("time,P1_displacement_mm,battery_V\n{text}");
    let office = Office::with(&[("slope.csv", &text)]);
    let said = office.refused(2, &["init", "slope.csv"]);
    for part in ["\"200.000\"", "\"12,6\"", "--decimal point"] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    office.done(&["init", "slope.csv", "--decimal", "point"]);
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    assert!(!config.contains("thousands"), "{config}");
    // Where most readings would be refused nothing is written.
    let args = ["init", "slope.csv", "--decimal", "comma", "--force"];
    let said = office.refused(2, &args);
    assert!(said.contains("no row of the file can be used"), "{said}");
    let text = rows(200, |time, value| {
        let reading = if value < 20.0 {
            value.to_string()
        } else {
            format!("{value} mm")
        };
        format!("{time}Z,{reading},0.5\n")
    });
    let text = format!("time,P1_displacement_mm,rain_mm\n{text}");
    let said = Office::with(&[("slope.csv", &text)]).refused(2, &["init", "slope.csv"]);
    assert!(
        said.contains("160 of 200 readings of benchmark \"P1\" cannot be used"),
        "{said}"
    );
}

#[test]
fn a_year_of_two_digits_in_front_is_read_as_such_or_asked_about() {
    let of = |pattern: &'static str, count: i64| {
        let text = rows(count, |time, value| {
            format!("{},{value}\n", time.strftime(pattern))
        });
        let text = format!("time,P1_displacement_mm\n{text}");
        Office::with(&[("slope.csv", &text)])
    };
    let args = ["init", "slope.csv", "--time-zone", "UTC"];
    for pattern in ["%y/%m/%d %H:%M", "%y-%m-%d %H:%M:%S", "%y.%m.%d %H:%M"] {
        // From the 1st to the 6th: the days of other years as well.
        let said = of(pattern, 140).refused(2, &args);
        assert!(
            said.contains("can be read in several ways") && said.contains(pattern),
            "{pattern}: {said}"
        );
        // Over the end of the month only one of them goes one way.
        let said = of(pattern, 24 * 40).done(&args);
        assert!(
            said.contains("last  2017-07-10T23:00:00Z"),
            "{pattern}: {said}"
        );
        assert!(said.contains("days old"), "{pattern}: {said}");
    }
}

/// What `init` says of a table whose columns have times of this format.
fn said_of_times(columns: &[&str], format: &str, times: impl Iterator<Item = String>) -> String {
    let rows = times.zip(0..);
    let rows: Vec<String> = rows
        .map(|(time, row)| format!("{time},{}\n", f64::from(row) * 0.01))
        .collect();
    let header = format!("{},Ext1_displacement_mm\n", columns.join(","));
    let office = Office::with(&[("a.csv", &(header + &rows.concat()))]);
    let args = [
        "init",
        "a.csv",
        "--time-zone",
        "UTC",
        "--time-format",
        format,
    ];
    let columns = columns.iter().flat_map(|column| ["--time-column", *column]);
    let args: Vec<&str> = args.into_iter().chain(columns).collect();
    let (exit, out, err) = office.say(&args);
    assert_eq!(exit, 0, "{out}{err}");
    out
}

/// As Campbell's array files have it: 115 is 01:15; and hours from 1 to 24.
#[test]
fn a_time_without_its_leading_zeros_is_the_one_that_was_written_and_hour_24_ends_the_day() {
    let quarters = (0..96).map(|quarter| {
        let minutes = 15 * quarter;
        format!("2026,61,{}", 100 * (minutes / 60) + minutes % 60)
    });
    let said = said_of_times(&["Year", "Day", "HHMM"], "%Y %j %H%M", quarters);
    for part in [
        "96 readings",
        "2026-03-02T00:00:00Z",
        "2026-03-02T23:45:00Z",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    let hours = (0..48).map(|hour| format!("{:02}.03.2026,{}", hour / 24 + 1, hour % 24 + 1));
    let said = said_of_times(&["Date", "Hour"], "%d.%m.%Y %H", hours);
    for part in [
        "48 readings",
        "2026-03-01T01:00:00Z",
        "2026-03-03T00:00:00Z",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
}
