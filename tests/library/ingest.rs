//! What goes into a file of readings comes out of it again, and what is wrong with it is named.

use crate::made_up::{assert_identical, made_up, read};
use crate::measured::measured;
use jiff::{SignedDuration, Timestamp};
use proptest::prelude::*;
use slipwatch::reading::{BenchmarkId, Disorder, Reading, Recording, Series, Unit};
use slipwatch::runtime::ingest::{
    CsvRows, IngestError, Item, ReadOptions, convert, encode_mcap, read_beside, read_channels,
    read_files, write_csv, write_mcap,
};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn write(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let file = folder.path().join(name);
    fs::write(&file, text).unwrap();
    file
}

fn read_text(text: &str) -> Result<(Recording, Disorder), IngestError> {
    let folder = TempDir::new().unwrap();
    read(&write(&folder, "prism.csv", text))
}

fn error_of(text: &str) -> String {
    read_text(text).unwrap_err().to_string()
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn a_recording_converted_there_and_back_is_the_same_readings() {
    let names = [
        "baishuihe_2006.csv",
        "bazimen_2006.csv",
        "century_2013_31-1930.csv",
        "century_2013_31-1931.csv",
        "century_2013_40-1938.csv",
        "century_2013_rain.csv",
        "century_2014_southwest.csv",
        "columbia_1985_marker1.csv",
        "columbia_1985_rain.csv",
        "houston_msfx_2013.csv",
        "lanzada_2025_f1.csv",
        "lanzada_2025_f4.csv",
        "lanzada_2025_rock_temperature.csv",
        "salmon_falls_2017.csv",
    ];
    let options = ReadOptions::default();
    for file in names.map(measured) {
        let folder = TempDir::new().unwrap();
        let archive = folder.path().join("archive.mcap");
        let back = folder.path().join("back.csv");
        let report = convert(&file, &archive, &options, &mut |_| {}).unwrap();
        convert(&archive, &back, &options, &mut |_| {}).unwrap();
        let (original, disorder) = read(&file).unwrap();
        assert_eq!(disorder, Disorder::default(), "{}", file.display());
        assert_identical(&original, &read(&archive).unwrap().0);
        assert_identical(&original, &read(&back).unwrap().0);
        let counted: usize = report.series.iter().map(|one| one.readings).sum();
        let held: usize = original.series.iter().map(|one| one.readings.len()).sum();
        assert_eq!(counted, held);
    }
}

#[test]
fn csv_holds_all_but_averaging_and_provenance_and_convert_says_so() {
    let folder = TempDir::new().unwrap();
    let archive = folder.path().join("made-up.mcap");
    let table = folder.path().join("made-up.csv");
    write_mcap(&made_up(), &archive).unwrap();
    let report = convert(&archive, &table, &ReadOptions::default(), &mut |_| {}).unwrap();
    assert_eq!(report.left_out.len(), 2, "{:?}", report.left_out);
    let mut expected = made_up();
    expected.provenance.clear();
    expected.series[0].averaging = None;
    assert_identical(&expected, &read(&table).unwrap().0);
    let hour_and_half = ReadOptions {
        averaging: Some(SignedDuration::from_mins(90)),
        ..ReadOptions::default()
    };
    let (reported, _) = read_files(&[table], &hour_and_half).unwrap();
    assert_eq!(reported.series, made_up().series);
}

#[test]
fn a_bad_value_is_named_with_file_line_column() {
    let good = "time,a_displacement_mm,rain_mm\n2020-01-01T00:00:00Z,1,0.5\n";
    for value in ["x", "1e999", "1 mm", "0x10"] {
        let error = error_of(&format!("{good}\n2020-01-02T00:00:00Z,2,{value}\n"));
        for part in ["prism.csv", "line 4", "\"rain_mm\"", value, "finite number"] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
}

#[test]
fn a_column_of_text_is_no_covariate_and_costs_no_reading() {
    let text = "time,a_displacement_mm,remark,rain_mm\n2020-01-01T00:00:00Z,1,new battery,\n\
                2020-01-02T00:00:00Z,2,,0.5\n2020-01-03T00:00:00Z,3,fog,0\n";
    let (recording, _) = read_text(text).unwrap();
    assert_eq!(recording.series[0].readings.len(), 3);
    let channels: Vec<&str> = recording
        .channels
        .iter()
        .map(|one| one.name.as_str())
        .collect();
    assert_eq!(channels, ["rain_mm"]);
}

#[test]
fn a_bad_time_is_named_with_what_was_expected() {
    for time in [
        "",
        "2020-01-01",
        "2020-01-01T00:00:00",
        "noon",
        "1577836800",
    ] {
        let text = format!("time,displacement_mm\n{time},1\n");
        let error = error_of(&text);
        for part in ["line 2", "\"time\"", &format!("{time:?}"), "RFC 3339"] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
}

#[test]
fn a_bad_line_or_header_is_named() {
    let cases = [
        (
            "time,a_displacement_mm\n2020-01-01T00:00:00Z,1,2\n",
            "line 2: found 3 fields, expected 2",
        ),
        (
            "time,a_displacement_mm\n2020-01-01T00:00:00Z\n",
            "line 2: found 1 fields",
        ),
        (
            "time,a_displacement_mm\n2020-01-01T00:00:00Z,\n",
            "\"a_displacement_mm\": found no value",
        ),
        ("time,a_displacement_mm\n", "found no row"),
        ("", "found no header"),
        (
            "a_displacement_mm,x\n1,2\n",
            "column \"time\": there is no such column",
        ),
        ("time|a_displacement_mm\n1|2\n", "--time-column"),
        (
            "time;a_displacement_mm\n2020-01-01T00:00:00Z;1,5\n",
            "decimal comma",
        ),
        (
            "time,a_displacement_mm\n01.02.2020 00:00,1\n",
            "--time-format",
        ),
        ("time,a_displacement_mm\n43831.5,1\n", "excel"),
        ("time,a_displacement_mm\n1577836800,1\n", "unix"),
        ("time,t_days,x\n1,2,3\n", "a second column gives the time"),
        ("time,x_velocity_m_per_d,time\n", "the name stands twice"),
        (
            "time,x,\n2017-06-01T00:00:00Z,2,3\n",
            "a name for this column",
        ),
        ("time\n2020-01-01T00:00:00Z\n", "the only column"),
        (
            "time,velocity_kmh\n2020-01-01T00:00:00Z,1\n",
            "without a known unit",
        ),
        (
            "time,a_displacement_mm,a_displacement_cm\n",
            "has another such column",
        ),
        (
            "time,a_displacement_mm,b_sigma_mm\n",
            "no readings it belongs to",
        ),
        (
            "time,a_displacement_mm,a_sigma_mm_per_d\n",
            "no readings it belongs to",
        ),
        (
            "time,a_displacement_mm,a_sigma_mm,a_sigma_cm\n",
            "the readings have another",
        ),
        (
            "time,displacement_mm,sigma_mm\n2020-01-01T00:00:00Z,1,0\n",
            "positive standard error",
        ),
        ("t_days,displacement_mm\n1e300,1\n", "within the calendar"),
    ];
    for (text, problem) in cases {
        let error = error_of(text);
        assert!(
            error.contains(problem) && error.contains("prism.csv"),
            "{error}"
        );
    }
}

#[test]
fn bytes_that_are_no_text_are_named_by_their_line() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("x.csv");
    fs::write(
        &file,
        b"time,a_displacement_mm\n2020-01-01T00:00:00Z,1\n\xff\xfe,2\n",
    )
    .unwrap();
    let error = read(&file).unwrap_err().to_string();
    assert!(
        error.contains("line 3") && error.contains("found"),
        "{error}"
    );
}

#[test]
fn a_byte_order_mark_windows_line_ends_quotes_and_blank_lines_change_nothing() {
    let plain = read_text("time,displacement_mm\n2020-01-01T01:00:00+01:00,1\n").unwrap();
    let odd = "\u{feff}\"time\" , displacement_mm\r\n\r\n\"2020-01-01T00:00:00Z\",1\r\n\r\n";
    assert_eq!(read_text(odd).unwrap(), plain);
}

#[test]
fn a_column_without_a_name_in_it_is_the_benchmark_of_the_file() {
    let (recording, _) = read_text("t_days,displacement_mm\n-1.5,1\n0.5,2\n").unwrap();
    let series = recording.series(None, None).unwrap();
    assert_eq!(series.benchmark.as_str(), "prism");
    let expected: Timestamp = "1999-12-30T12:00:00Z".parse().unwrap();
    assert_eq!(series.readings[0].time, expected);
}

#[test]
fn a_standard_error_goes_with_the_reading_of_its_kind_in_the_readings_unit() {
    let text = "time,a_displacement_mm,a_velocity_m_per_d,a_sigma_cm,a_sigma_mm_per_d,b_displacement_mm\n\
                2020-01-01T00:00:00Z,1,2,3,4,5\n2020-01-02T00:00:00Z,1,2,,4,5\n";
    let (recording, _) = read_text(text).unwrap();
    let sigmas: Vec<_> = recording
        .series
        .iter()
        .map(|series| (series.benchmark.as_str(), series.readings[0].sigma))
        .collect();
    assert_eq!(sigmas, [("a", Some(30.0)), ("a", Some(0.004)), ("b", None)]);
    assert_eq!(recording.series[0].readings[1].sigma, None);
}

#[test]
fn rows_out_of_order_repeated_or_corrected_are_settled_and_counted() {
    let text = "time,a_displacement_mm,rain_mm\n\
                2020-01-02T00:00:00Z,2,\n2020-01-01T00:00:00Z,1,\n\
                2020-01-02T00:00:00Z,2,\n2020-01-01T00:00:00Z,9,5\n";
    let (recording, disorder) = read_text(text).unwrap();
    let values: Vec<f64> = recording.series[0]
        .readings
        .iter()
        .map(|r| r.value)
        .collect();
    assert_eq!(values, [9.0, 2.0]);
    assert_eq!((disorder.repeated, disorder.corrected), (1, 1));
    assert_eq!(disorder.out_of_order, 2);
}

#[test]
fn a_file_followed_row_by_row_gives_what_the_whole_file_gives() {
    let text = "time,a_displacement_mm,a_sigma_mm,b_velocity_mm_per_h,rain_mm\n\
                2020-01-01T00:00:00Z,1,0.5,,3\n2020-01-02T00:00:00Z,,,4,\n";
    let options = ReadOptions {
        averaging: Some(SignedDuration::from_hours(1)),
        ..ReadOptions::default()
    };
    let folder = TempDir::new().unwrap();
    let file = write(&folder, "x.csv", text);
    let (whole, _) = read_files(std::slice::from_ref(&file), &options).unwrap();

    let mut lines = text.lines().zip(1..);
    let mut rows = CsvRows::new(&file, lines.next().unwrap().0, &options).unwrap();
    let rest = rows
        .row(2, "2020-01-01T00:00:00Z,1,0.5,nonsense,3")
        .unwrap();
    let bad = rows.take_fault().unwrap();
    assert!(bad.to_string().contains("nonsense"), "{bad}");
    assert_eq!(
        rest.len(),
        3,
        "a, the rain, and that b is missing: {rest:?}"
    );
    let items: Vec<Item> = lines
        .flat_map(|(text, line)| rows.row(line, text).unwrap())
        .collect();
    let [a, b] = [&whole.series[0], &whole.series[1]];
    let expected = [
        Item::Reading {
            benchmark: a.benchmark.clone(),
            unit: a.unit,
            averaging: None,
            reading: a.readings[0],
        },
        Item::Sample {
            channel: "rain_mm".to_owned(),
            unit: Some("mm".to_owned()),
            sample: whole.channels[0].samples[0],
        },
        Item::Reading {
            benchmark: b.benchmark.clone(),
            unit: b.unit,
            averaging: Some(SignedDuration::from_hours(1)),
            reading: b.readings[0],
        },
    ];
    assert_eq!(items, expected);
    assert_eq!(b.averaging, Some(SignedDuration::from_hours(1)));
}

#[test]
fn rows_that_lack_their_last_cells_are_read_from_the_third_on_and_a_torn_one_is_not() {
    let header = "time,a_displacement_mm,b_displacement_mm,c_displacement_mm";
    let mut rows = CsvRows::new(Path::new("x.csv"), header, &ReadOptions::default()).unwrap();
    let mut line = 1;
    let mut taken = |cells: &str| {
        line += 1;
        let row = format!("2020-01-{line:02}T00:00:00Z{cells}");
        rows.row(line, &row).map(|items| items.len()).ok()
    };
    assert_eq!(taken(",1,2,3"), Some(3));
    assert_eq!(taken(",1"), None);
    assert_eq!(taken(",1,2,3"), Some(3));
    let short = [",1,2", ",1,2", ",1,2", ",1,2"].map(&mut taken);
    assert_eq!(short, [None, None, Some(2), Some(2)]);
    assert_eq!(taken(",1"), None, "another number of cells may be torn");
    assert_eq!(taken(",1,2,3"), Some(3));
    assert_eq!(taken(",1,2"), None);
    assert_eq!(taken(",1,2,3,,"), Some(3), "what there is more is empty");
    assert_eq!(taken(",1,2,3,4"), None);
}

#[test]
fn a_header_that_comes_again_behind_a_byte_order_mark_is_understood() {
    let header = "time,a_displacement_mm,b_displacement_mm";
    let mut rows = CsvRows::new(Path::new("x.csv"), header, &ReadOptions::default()).unwrap();
    let again = "\u{feff}time,a_displacement_mm,b_displacement_mm,c_displacement_mm";
    assert_eq!(rows.row(2, again).unwrap(), []);
    assert_eq!(rows.row(3, "2020-01-01T00:00:00Z,1,2,3").unwrap().len(), 3);
}

#[test]
fn a_column_map_names_the_benchmark_and_must_meet_its_column() {
    let folder = TempDir::new().unwrap();
    let file = write(
        &folder,
        "p.csv",
        "time,Prism 4,error\n2020-01-01T00:00:00Z,1,2\n",
    );
    let with = |maps: &[&str]| {
        let options = ReadOptions {
            columns: maps.iter().map(|map| map.parse().unwrap()).collect(),
            ..ReadOptions::default()
        };
        read_files(std::slice::from_ref(&file), &options)
    };
    let (recording, _) =
        with(&["Prism 4=31-1930:velocity:cm/h", "error=31-1930:sigma:mm/h"]).unwrap();
    let series = recording
        .series(Some(&BenchmarkId::new("31-1930")), None)
        .unwrap();
    assert_eq!(series.unit.to_string(), "cm/h");
    assert_eq!(series.readings[0].sigma, Some(0.2));
    let error = with(&["Prism 5=a:displacement:mm"])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("Prism 5") && error.contains("Prism 4"),
        "{error}"
    );
}

#[test]
fn channels_may_stand_in_files_of_their_own() {
    let folder = TempDir::new().unwrap();
    let rain = write(
        &folder,
        "rain.csv",
        "time,rain_mm\n2020-01-01T00:00:00Z,1\n",
    );
    let prism = write(
        &folder,
        "a.csv",
        "time,displacement_mm\n2020-01-01T00:00:00Z,1\n",
    );
    let options = ReadOptions::default();
    let (channels, _) = read_channels(&rain, &options).unwrap();
    assert_eq!((channels.len(), channels[0].samples.len()), (1, 1));
    assert_eq!(channels[0].unit.as_deref(), Some("mm"));
    let error = read_channels(&prism, &options).unwrap_err();
    assert!(matches!(error, IngestError::NoChannels { .. }), "{error}");
    let (both, _) = read_files(&[prism, rain], &options).unwrap();
    assert_eq!((both.series.len(), both.channels.len()), (1, 1));
}

#[test]
fn a_file_that_is_not_there_or_of_no_known_kind_is_named() {
    let missing = read(Path::new("/nowhere/a.csv")).unwrap_err();
    assert!(missing.is_io() && missing.to_string().contains("/nowhere/a.csv"));
    let unknown = read(Path::new("a.xlsx")).unwrap_err();
    assert!(!unknown.is_io() && unknown.to_string().contains("a.xlsx"));
}

#[test]
fn a_failed_conversion_leaves_the_old_file_as_it_was() {
    let folder = TempDir::new().unwrap();
    let mut recording = made_up();
    recording.channels[0].name = "lake_displacement_m".to_owned();
    let archive = folder.path().join("a.mcap");
    write_mcap(&recording, &archive).unwrap();
    let table = write(&folder, "a.csv", "precious");
    let error = convert(&archive, &table, &ReadOptions::default(), &mut |_| {}).unwrap_err();
    assert!(
        format!("{error:#}").contains("lake_displacement_m"),
        "{error:#}"
    );
    assert!(error.downcast_ref::<IngestError>().is_some());
    assert_eq!(fs::read_to_string(&table).unwrap(), "precious");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_number_that_is_not_finite_is_not_written() {
    let mut recording = made_up();
    recording.series[1].readings[0].value = f64::NAN;
    let mut bytes = std::io::Cursor::new(Vec::new());
    assert!(encode_mcap(&recording, &mut bytes).is_err());
    assert!(write_csv(&recording, Vec::new()).is_err());
}

prop_compose! {
    fn rows()(rows in prop::collection::btree_map(
        -3_000_000_000_000_000_000_i64..3_000_000_000_000_000_000,
        (prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
         prop::option::of(prop::num::f64::POSITIVE | prop::num::f64::NORMAL)),
        1..20,
    )) -> Vec<Reading> {
        rows.into_iter()
            .map(|(nanosecond, (value, sigma))| Reading {
                time: Timestamp::from_nanosecond(i128::from(nanosecond)).unwrap(),
                // What no slope reaches is refused.
                value: if value.abs() > 1e9 { 1.0 / value } else { value },
                sigma: sigma.map(f64::abs),
            })
            .collect()
    }
}

prop_compose! {
    fn recordings()(parts in prop::collection::btree_map("[ -~Ü]{1,8}", rows(), 1..5)) -> Recording {
        let series = parts
            .into_iter()
            .filter(|(id, _)| id.trim() == id)
            .map(|(id, readings)| Series {
                benchmark: BenchmarkId::new(id),
                unit: Unit::parse("cm/yr").unwrap(),
                averaging: None,
                readings,
            });
        Recording { series: series.collect(), ..Recording::default() }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_recording_comes_back_bit_for_bit(recording in recordings()) {
        prop_assume!(!recording.series.is_empty());
        let folder = TempDir::new().unwrap();
        let archive = folder.path().join("a.mcap");
        let table = folder.path().join("a.csv");
        write_mcap(&recording, &archive).unwrap();
        write_csv(&recording, fs::File::create(&table).unwrap()).unwrap();
        assert_identical(&recording, &read(&archive).unwrap().0);
        assert_identical(&recording, &read(&table).unwrap().0);
    }
}

#[test]
fn a_local_time_needs_a_zone_and_its_error_says_so() {
    let folder = TempDir::new().unwrap();
    let text = "time,a_displacement_mm\n2017-06-06 17:00:00,1\n2017-06-06T18:00:00Z,2\n";
    let file = write(&folder, "a.csv", text);
    let error = read(&file).unwrap_err().to_string();
    for part in ["line 2", "2017-06-06 17:00:00", "time_zone", "--time-zone"] {
        assert!(error.contains(part), "{part} is not in: {error}");
    }
    let mut options = ReadOptions::default();
    options.conventions.clock.zone = Some(jiff::tz::TimeZone::get("Europe/Rome").unwrap());
    let (recording, _) = read_files(&[file], &options).unwrap();
    let times: Vec<String> = (recording.series[0].readings.iter())
        .map(|reading| reading.time.to_string())
        .collect();
    assert_eq!(times, ["2017-06-06T15:00:00Z", "2017-06-06T18:00:00Z"]);
}

#[test]
fn marks_for_missing_values_are_left_out_and_counted_and_the_file_is_read_on() {
    let text = "time,a_displacement_mm,rain_mm\n2020-01-01T00:00:00Z,NAN,1\n\
                2020-01-02T00:00:00Z,-inf,inf\n2020-01-03T00:00:00Z,-7999,\n\
                2020-01-04T00:00:00Z,,2\n";
    let (recording, disorder) = read_text(text).unwrap();
    let values = |recording: &Recording| -> Vec<f64> {
        let readings = recording.series[0].readings.iter();
        readings.map(|reading| reading.value).collect()
    };
    assert_eq!((values(&recording), disorder.missing), (vec![-7999.0], 2));
    assert_eq!(recording.channels[0].samples.len(), 2);
    let folder = TempDir::new().unwrap();
    let mut options = ReadOptions::default();
    options.conventions.missing.add("-7999");
    let file = write(&folder, "x.csv", text);
    let (recording, disorder) = read_files(&[file], &options).unwrap();
    assert_eq!((recording.series.len(), disorder.missing), (0, 3));
}

#[test]
fn a_reading_that_no_slope_reaches_is_refused_with_its_place_and_costs_its_own_value_alone() {
    let text = "time,a_displacement_m,b_displacement_m\n2020-01-01T00:00:00Z,1e6,1\n2020-01-02T00:00:00Z,1e308,2\n";
    let error = read_text(text).unwrap_err().to_string();
    for part in [
        "prism.csv",
        "line 3",
        "a_displacement_m",
        "1e308",
        "1e11 mm",
    ] {
        assert!(error.contains(part), "{part} is not in: {error}");
    }
    let folder = TempDir::new().unwrap();
    let line = r#"{"benchmark":"a","time":"2020-01-01T00:00:00Z","value":-1e300,"unit":"mm/h"}"#;
    let file = write(&folder, "x.ndjson", &format!("{line}\n"));
    let error = read(&file).unwrap_err().to_string();
    for part in ["line 1", "-1e300 mm/h", "1e9 mm/day"] {
        assert!(error.contains(part), "{part} is not in: {error}");
    }
    let file = write(&folder, "y.csv", text);
    let mut aside = 0;
    let read = read_beside(&file, &ReadOptions::default(), &mut |_| aside += 1).unwrap();
    let counts: Vec<usize> = (read.recording.series.iter())
        .map(|series| series.readings.len())
        .collect();
    assert_eq!((aside, counts), (1, vec![1, 2]));
}

#[test]
fn what_stands_before_a_header_is_passed_over_where_it_is_said_or_begins_as_a_remark() {
    let table = "time,a_displacement_mm\n2020-01-01T00:00:00Z,1\n2020-01-02T00:00:00Z,nonsense\n";
    let folder = TempDir::new().unwrap();
    let skipping = |skip_lines: u64, text: &str| {
        let file = write(&folder, "x.csv", text);
        let mut options = ReadOptions::default();
        options.dialect.skip_lines = skip_lines;
        let mut faults = Vec::new();
        let read = read_beside(&file, &options, &mut |fault| faults.push(fault.to_string()));
        read.map(|read| (read.recording.series[0].readings.len(), faults))
    };
    let station = format!("Crackmeter 7;Toc\n\n{table}");
    for (skip_lines, text, line) in [
        (0, format!("# Crackmeter 7, Toc\n#\n\n{table}"), 6),
        (1, station.clone(), 5),
        (2, station.clone(), 5),
        (0, format!("\u{feff}# Crackmeter 7\n{table}"), 4),
    ] {
        let (readings, faults) = skipping(skip_lines, &text).unwrap();
        assert_eq!((readings, faults.len()), (1, 1), "{text}");
        assert!(faults[0].contains(&format!("line {line},")), "{faults:?}");
    }
    let error = skipping(0, &station).unwrap_err().to_string();
    assert!(error.contains("skip_lines (--skip-lines)"), "{error}");
    // A header may begin so too.
    let mut options = ReadOptions::default();
    options.dialect.time_columns = vec!["#time".to_owned()];
    let file = write(
        &folder,
        "x.csv",
        &format!("#{}", table.replace("nonsense", "2")),
    );
    let (recording, _) = read_files(&[file], &options).unwrap();
    assert_eq!(recording.series[0].readings.len(), 2);
}
