//! Files that grow, shrink and are replaced while they are followed.

use jiff::SignedDuration;
use slipwatch::config::{self, Config};
use slipwatch::monitor::Input;
use slipwatch::reading::Timestamp;
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use slipwatch::runtime::replay::arrivals;
use slipwatch::runtime::tail::{Arrival, ArrivalBatch, Follower};
use slipwatch::store::Position;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

const HEADER: &str = "time,displacement_mm\n";

mod gone;
mod rotation;

struct Bench {
    folder: TempDir,
    config: Config,
    follower: Follower,
    /// The wall clock's time.
    wall: Timestamp,
    /// The positions, as a state has them.
    saved: BTreeMap<String, Vec<u8>>,
    /// What the faults say.
    faults: Vec<String>,
}

impl Bench {
    fn new(kind: &str) -> Self {
        Self::with(kind, "")
    }

    fn with(kind: &str, benchmarks: &str) -> Self {
        let source =
            format!("id = \"logger\"\nkind = \"{kind}\"\npath = \"*.{kind}\"\n{benchmarks}");
        Self::of(&[], &format!("[[source]]\n{source}"))
    }

    /// With these folders, and what the config says of the sources.
    fn of(folders: &[&str], sources: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for name in folders {
            fs::create_dir(folder.path().join(name)).unwrap();
        }
        let text = format!("[site]\nname = \"Toc\"\nstate_dir = \"state\"\n{sources}");
        let config = config::parse(&text, &folder.path().join("site.toml")).unwrap();
        let follower = Follower::new(&config.sources, &config.benchmarks, &[]);
        // What waits does so no longer than from when its file was written.
        let wall = "2025-01-01T00:00:00Z".parse().unwrap();
        Self {
            folder,
            config,
            follower,
            wall,
            saved: BTreeMap::new(),
            faults: Vec::new(),
        }
    }

    /// As a restart or a reload goes on.
    fn restart(&mut self) {
        let saved: Vec<_> = self.saved.clone().into_iter().collect();
        self.follower = Follower::new(&self.config.sources, &self.config.benchmarks, &saved);
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn append(&self, name: &str, text: &str) {
        let mut file = OpenOptions::new()
            .append(true)
            .open(self.path(name))
            .unwrap();
        file.write_all(text.as_bytes()).unwrap();
    }

    /// The values that have come since, as `name:value`.
    fn news(&mut self) -> Vec<String> {
        let mut news = Vec::new();
        loop {
            let ArrivalBatch {
                arrivals,
                positions,
                caught_up,
                ..
            } = self.follower.poll(self.wall);
            for Position { name, body } in positions {
                match body {
                    Some(body) => self.saved.insert(name, body),
                    None => self.saved.remove(&name),
                };
            }
            news.extend(arrivals.into_iter().map(|arrival| match arrival.input {
                Input::Reading {
                    benchmark, reading, ..
                } => format!("{benchmark}:{}", reading.value),
                Input::Sample {
                    channel, sample, ..
                } => format!("{channel}:{}", sample.value),
                Input::Missing {
                    benchmark, what, ..
                } => format!("{benchmark} gives {what}"),
                Input::Trouble { kind, text } => {
                    self.faults.push(text);
                    kind
                }
                Input::Notice(notice) => format!("{notice:?}"),
                Input::Settings(_) | Input::Order(_) | Input::Found(_) | Input::Tick => {
                    panic!("not in a file")
                }
            }));
            if caught_up {
                return news;
            }
        }
    }
}

fn row_at(time: jiff::Timestamp, value: i64) -> String {
    format!("{time},{value}\n")
}

fn row(day: u32, value: f64) -> String {
    format!("2017-06-{day:02}T00:00:00Z,{value}\n")
}

#[test]
fn a_file_of_fixed_size_that_is_filled_from_its_front_is_read_as_it_is_filled() {
    for size in [4096, 1 << 20] {
        let mut bench = Bench::new("csv");
        let path = bench.path("5.csv");
        bench.write("5.csv", "");
        let mut file = OpenOptions::new().write(true).open(&path).unwrap();
        file.set_len(size).unwrap();
        assert!(bench.news().is_empty());
        write!(file, "{HEADER}{}", row(1, 1.5)).unwrap();
        assert_eq!(bench.news(), ["5:1.5"]);
        // A row that is not whole yet.
        write!(file, "2017-06-02T00:00:00Z,2").unwrap();
        assert!(bench.news().is_empty());
        bench.restart();
        writeln!(file, ".5").unwrap();
        write!(file, "{}", row(3, 3.5)).unwrap();
        assert_eq!(bench.news(), ["5:2.5", "5:3.5"]);
        // What is appended behind the room is read, and what then comes behind that.
        bench.append("5.csv", &format!("\n{}", row(4, 4.5)));
        assert_eq!(bench.news(), ["5:4.5"]);
        bench.append("5.csv", &row(5, 5.5));
        assert_eq!(bench.news(), ["5:5.5"]);
        assert!(bench.faults.is_empty(), "{:?}", bench.faults);
    }
}

#[test]
fn a_growing_file_is_read_line_by_line_and_a_partial_line_is_held() {
    let mut bench = Bench::new("csv");
    assert!(bench.news().is_empty());
    bench.write("5.csv", "time,displa");
    assert!(bench.news().is_empty());
    bench.append("5.csv", "cement_mm\n");
    assert!(bench.news().is_empty());
    bench.append("5.csv", &row(1, 1.5));
    assert_eq!(bench.news(), ["5:1.5"]);
    bench.append("5.csv", "2017-06-02T00:00:00Z,1");
    assert!(bench.news().is_empty(), "1 may become 12.5");
    bench.append("5.csv", "2.5\n");
    assert_eq!(bench.news(), ["5:12.5"]);
    assert!(bench.news().is_empty());
}

#[test]
fn a_truncated_file_is_read_again_from_its_start() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", &format!("{HEADER}{}{}", row(1, 1.0), row(2, 2.0)));
    assert_eq!(bench.news(), ["5:1", "5:2"]);
    // The same file, shorter.
    bench.write("5.csv", &format!("{HEADER}{}", row(3, 3.0)));
    assert_eq!(bench.news(), ["possible-gap", "5:3"]);
}

#[test]
fn a_file_that_was_truncated_and_has_grown_past_the_old_end_is_read_again() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    let longer: String = (2..6).map(|day| row(day, f64::from(day))).collect();
    bench.write("5.csv", &format!("{HEADER}{longer}"));
    assert_eq!(bench.news(), ["possible-gap", "5:2", "5:3", "5:4", "5:5"]);
}

/// 28 rows of one length, those of some days with values of their own.
fn filled_in(days: std::ops::Range<u32>) -> String {
    let row = |day: u32| {
        let value = if days.contains(&day) {
            f64::from(day)
        } else {
            0.5
        };
        format!("2017-06-{day:02}T00:00:00Z,{value:6.1}{}\n", " ".repeat(30))
    };
    HEADER.to_owned() + &(1..29).map(row).collect::<String>()
}

/// As `rsync --inplace` or a copy over it writes an export, with the rows of some days filled in and the last ones as before.
fn write_over(file: &Path, text: &str) {
    let before = fs::metadata(file).unwrap();
    let mut opened = OpenOptions::new().write(true).open(file).unwrap();
    opened.write_all(text.as_bytes()).unwrap();
    // Also where the file system counts time in coarse steps.
    let later = before.modified().unwrap() + Duration::from_secs(1);
    opened.set_modified(later).unwrap();
    let after = fs::metadata(file).unwrap();
    assert_eq!((before.ino(), before.len()), (after.ino(), after.len()));
}

/// Whoever writes a file may not be done yet.
fn news_in_time(bench: &mut Bench) -> Vec<String> {
    let mut news = bench.news();
    while news.is_empty() {
        std::thread::sleep(Duration::from_millis(50));
        news = bench.news();
    }
    news
}

#[test]
fn rows_that_are_filled_in_earlier_in_a_file_are_read_also_after_a_restart() {
    for is_down in [false, true] {
        let mut bench = Bench::new("csv");
        bench.write("5.csv", &filled_in(1..8));
        assert_eq!(bench.news().len(), 28);
        write_over(&bench.path("5.csv"), &filled_in(1..16));
        if is_down {
            bench.restart();
        }
        let news = news_in_time(&mut bench);
        assert_eq!(news.len(), 28, "{is_down}: {news:?}");
        assert_eq!(news[14], "5:15");
        bench.append("5.csv", &row(29, 29.0));
        assert_eq!(bench.news(), ["5:29"]);
        assert!(bench.faults.is_empty(), "{:?}", bench.faults);
    }
}

#[test]
fn rows_that_are_filled_in_before_others_are_added_are_read_after_a_restart() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", &filled_in(1..8));
    assert_eq!(bench.news().len(), 28);
    write_over(&bench.path("5.csv"), &filled_in(1..16));
    assert!(bench.news().is_empty(), "it may not be written yet");
    bench.append("5.csv", &row(29, 29.0));
    assert_eq!(bench.news(), ["5:29"]);
    bench.restart();
    let news = news_in_time(&mut bench);
    assert_eq!((news.len(), news[14].as_str()), (29, "5:15"), "{news:?}");
}

#[test]
fn an_atomically_replaced_file_is_read_from_its_start() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    bench.write("5.tmp", &format!("{HEADER}{}{}", row(1, 1.0), row(2, 2.0)));
    fs::rename(bench.path("5.tmp"), bench.path("5.csv")).unwrap();
    assert_eq!(bench.news(), ["5:1", "5:2"]);
    bench.append("5.csv", &row(3, 3.0));
    assert_eq!(bench.news(), ["5:3"]);
}

#[test]
fn what_was_written_before_a_rotation_is_read_from_the_old_file() {
    for new_name_at_once in [true, false] {
        let mut bench = Bench::new("csv");
        bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
        assert_eq!(bench.news(), ["5:1"]);
        bench.append("5.csv", &row(2, 2.0));
        fs::rename(bench.path("5.csv"), bench.path("5.csv.1")).unwrap();
        let new = format!("{HEADER}{}", row(4, 4.0));
        if new_name_at_once {
            bench.write("5.csv", &new);
            assert_eq!(bench.news(), ["5:2", "5:4"]);
        } else {
            assert_eq!(bench.news(), ["5:2"]);
            // A writer may hold the old file open for a while.
            bench.append("5.csv.1", &row(3, 3.0));
            assert_eq!(bench.news(), ["5:3"]);
            bench.write("5.csv", &new);
            assert_eq!(bench.news(), ["5:4"]);
        }
    }
}

#[test]
fn a_file_that_its_writer_holds_open_is_read_on_wherever_it_goes() {
    for to in ["5.csv.1", "archive/5.csv", ""] {
        let mut bench = Bench::new("csv");
        fs::create_dir(bench.path("archive")).unwrap();
        bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
        assert_eq!(bench.news(), ["5:1"]);
        let mut writer = OpenOptions::new()
            .append(true)
            .open(bench.path("5.csv"))
            .unwrap();
        // What was written just before it went is read too.
        writer.write_all(row(2, 2.0).as_bytes()).unwrap();
        if to.is_empty() {
            fs::remove_file(bench.path("5.csv")).unwrap();
        } else {
            fs::rename(bench.path("5.csv"), bench.path(to)).unwrap();
        }
        assert_eq!(bench.news(), ["5:2"], "{to}");
        for day in 3..6 {
            // Nothing came between two looks.
            assert!(bench.news().is_empty() && bench.news().is_empty());
            writer
                .write_all(row(day, f64::from(day)).as_bytes())
                .unwrap();
            assert_eq!(bench.news(), [format!("5:{day}")], "{to}");
        }
        bench.write("5.csv", &format!("{HEADER}{}", row(7, 7.0)));
        writer.write_all(row(6, 6.0).as_bytes()).unwrap();
        assert_eq!(bench.news(), ["5:6", "5:7"], "{to}");
    }
}

#[test]
fn files_that_are_rotated_again_and_again_are_each_read_on() {
    let mut bench = Bench::new("csv");
    let mut writers: Vec<File> = Vec::new();
    for day in 1..5 {
        for number in (1..day).rev() {
            let (from, to) = (format!("5.csv.{}", number - 1), format!("5.csv.{number}"));
            let from = if number == 1 { "5.csv" } else { &from };
            fs::rename(bench.path(from), bench.path(&to)).unwrap();
        }
        bench.write("5.csv", &format!("{HEADER}{}", row(day, f64::from(day))));
        assert_eq!(bench.news(), [format!("5:{day}")]);
        let writer = OpenOptions::new().append(true).open(bench.path("5.csv"));
        writers.push(writer.unwrap());
    }
    for (day, mut writer) in (10..).zip(writers) {
        writer.write_all(row(day, 0.5).as_bytes()).unwrap();
    }
    assert_eq!(bench.news(), ["5:0.5"; 4]);
}

#[test]
fn a_deleted_file_that_comes_back_is_read_again() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    fs::remove_file(bench.path("5.csv")).unwrap();
    assert!(bench.news().is_empty());
    bench.write("5.csv", &format!("{HEADER}{}", row(2, 2.0)));
    assert_eq!(bench.news(), ["5:2"]);
}

#[test]
fn a_bad_line_is_quarantined_and_following_goes_on() {
    let mut bench = Bench::new("csv");
    bench.write(
        "5.csv",
        &format!("{HEADER}{}nonsense,row,here\n{}", row(1, 1.0), row(2, 2.0)),
    );
    assert_eq!(bench.news(), ["5:1", "5:2"]);
    assert_eq!(bench.follower.quarantined(), 1);
    bench.append("5.csv", "2017-06-03T00:00:00Z,NaN\n");
    bench.append("5.csv", &row(4, 4.0));
    assert_eq!(bench.news(), ["5 gives NaN", "5:4"]);
    bench.append("5.csv", "2017-06-05T00:00:00Z,1e999\n");
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 2);
}

#[test]
fn a_file_with_a_bad_header_is_refused_until_it_is_replaced_and_stops_no_other() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", "when,what\n1,2\n");
    bench.write("6.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["6:1"]);
    bench.append("5.csv", "3,4\n");
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 1);
    bench.write("5.csv", &format!("{HEADER}{}", row(2, 2.0)));
    assert_eq!(bench.news(), ["5:2"]);
}

#[test]
fn the_history_of_many_files_comes_in_the_order_of_its_measurement() {
    let mut bench = Bench::new("csv");
    for (name, first) in [("a", 1), ("b", 2), ("c", 3)] {
        let rows: String = (0..9).map(|n| row(first + 3 * n, f64::from(n))).collect();
        bench.write(&format!("{name}.csv"), &format!("{HEADER}{rows}"));
    }
    let order: String = bench.news().iter().map(|news| &news[..1]).collect();
    assert_eq!(order, "abc".repeat(9));
}

#[test]
fn what_was_measured_at_one_time_comes_as_a_replay_has_it_whatever_the_files_are_called() {
    let rows: String = (1..4).map(|day| row(day, f64::from(day))).collect();
    let tables = [
        ("1.csv", "time,b_displacement_mm\n"),
        ("2.csv", "time,rain_mm\n"),
        ("3.csv", "time,a_displacement_mm\n"),
        ("4.csv", "time,level_m\n"),
    ];
    for reorder in ["", "reorder = \"1h\"\n"] {
        let mut bench = Bench::with("csv", reorder);
        for (name, header) in tables {
            bench.write(name, &format!("{header}{rows}"));
        }
        let files = tables.map(|(name, _)| bench.path(name));
        let (recording, _) = read_files(&files, &ReadOptions::default()).unwrap();
        let expected: Vec<Arrival> = arrivals(&recording);
        assert_eq!(expected.len(), 12);
        let mut followed = bench.follower.poll(bench.wall).arrivals;
        followed.extend(
            bench
                .follower
                .poll(bench.wall + SignedDuration::from_hours(2))
                .arrivals,
        );
        assert_eq!(followed, expected, "{reorder}");
    }
}

#[test]
fn what_waits_for_earlier_values_waits_no_longer_for_a_restart() {
    let reorder = "reorder = \"2h\"\n";
    let mut bench = Bench::with("csv", reorder);
    let hours = SignedDuration::from_hours;
    bench.wall = slipwatch::runtime::clock::now();
    let row = row_at(bench.wall - hours(1), 5);
    bench.write("a.csv", &format!("{HEADER}{row}"));
    assert!(bench.news().is_empty());
    for _each in 0..3 {
        bench.wall += SignedDuration::from_mins(35);
        bench.restart();
        assert!(bench.news().is_empty());
    }
    bench.wall += SignedDuration::from_mins(20);
    assert_eq!(bench.news().len(), 1);
}

/// As in a replay: whichever comes first is watched.
#[test]
fn of_one_benchmark_and_time_the_displacement_comes_before_the_velocity() {
    let time = "2026-03-01T00:00:00Z";
    let mut bench = Bench::new("csv");
    let header = "time,5_velocity_mm_per_day,5_displacement_mm\n";
    bench.write("a.csv", &format!("{header}{time},24,1\n"));
    assert_eq!(bench.news(), ["5:1", "5:24"]);
    let mut bench = Bench::new("ndjson");
    let line = |unit: &str, value: i64| {
        format!(
            "{{\"benchmark\":\"5\",\"time\":\"{time}\",\"value\":{value},\"unit\":\"{unit}\"}}\n"
        )
    };
    let lines = line("mm/day", 24) + &line("mm", 1);
    bench.write("a.ndjson", &lines);
    assert_eq!(bench.news(), ["5:1", "5:24"]);
    // From two files, whatever they are called.
    let mut bench = Bench::new("csv");
    bench.write("a.csv", &format!("time,5_velocity_mm_per_day\n{time},24\n"));
    bench.write("b.csv", &format!("time,5_displacement_mm\n{time},1\n"));
    assert_eq!(bench.news(), ["5:1", "5:24"]);
}

/// The benchmarks beside it would be silent for days, as far as the monitor knows.
#[test]
fn a_source_that_waits_for_earlier_values_is_not_ahead_of_those_beside_it_in_a_backlog() {
    let mut bench = Bench::of(
        &["a", "b"],
        "[[source]]\nid = \"a\"\nkind = \"csv\"\npath = \"a/*.csv\"\nreorder = \"3h\"\n\
         [[source]]\nid = \"b\"\nkind = \"csv\"\npath = \"b/*.csv\"\n",
    );
    let start: Timestamp = "2020-03-01T00:00:00Z".parse().unwrap();
    let rows = |name: &str| {
        let rows = (0..200).map(|hour| row_at(start + SignedDuration::from_hours(hour), hour));
        format!("time,{name}_displacement_mm\n{}", rows.collect::<String>())
    };
    bench.write("a/p.csv", &rows("a"));
    bench.write("b/p.csv", &rows("b"));
    let came = bench.follower.poll(bench.wall).arrivals;
    let waiting = came.iter().filter(|one| one.input.series_name() == "a");
    assert_eq!((came.len(), waiting.count()), (397, 197));
    assert!(came.is_sorted_by(|one, next| one.rank() <= next.rank()));
}

#[test]
fn a_long_history_comes_whole_in_more_than_one_batch() {
    let mut bench = Bench::new("csv");
    let mut text = HEADER.to_owned();
    for second in 0..20_000 {
        let time = jiff::Timestamp::from_second(1_500_000_000 + second).unwrap();
        text.push_str(&row_at(time, second));
    }
    bench.write("5.csv", &text);
    let expected: Vec<String> = (0..20_000).map(|second| format!("5:{second}")).collect();
    assert_eq!(bench.news(), expected);
}

#[test]
fn only_the_benchmarks_that_the_config_names_are_taken() {
    let benchmarks = "[[benchmark]]\nid = \"upper\"\ncolumn = \"ext_1\"\nunit = \"mm\"\n";
    let mut bench = Bench::with("csv", benchmarks);
    bench.write(
        "logger.csv",
        "time,ext_1,lower_displacement_mm,rain_mm\n2017-06-01T00:00:00Z,1,2,3\n",
    );
    let mut news = bench.news();
    news.sort();
    assert_eq!(news, ["rain_mm:3", "upper:1"]);
}

#[test]
fn a_column_that_two_benchmarks_claim_belongs_to_the_one_its_file_is_named_after() {
    let benchmarks = "[[benchmark]]\nid = \"5\"\ncolumn = \"displacement_mm\"\n\
                      [[benchmark]]\nid = \"6\"\ncolumn = \"displacement_mm\"\n";
    let mut bench = Bench::with("csv", benchmarks);
    bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    bench.write("6.csv", &format!("{HEADER}{}", row(2, 2.0)));
    bench.write("7.csv", &format!("{HEADER}{}", row(3, 3.0)));
    assert_eq!(bench.news(), ["5:1", "6:2"]);
}

type Recorder = mcap::Writer<File>;

fn recorder(bench: &Bench, options: mcap::WriteOptions) -> (Recorder, u16) {
    let file = File::create(bench.path("r.mcap")).unwrap();
    let mut writer = mcap::Writer::with_options(file, options).unwrap();
    let channel = writer
        .add_channel(0, "/benchmarks/5/displacement", "json", &BTreeMap::new())
        .unwrap();
    (writer, channel)
}

fn record(writer: &mut Recorder, channel: u16, day: u32) {
    let payload =
        format!("{{\"time\":\"2017-06-{day:02}T00:00:00Z\",\"value\":{day},\"unit\":\"mm\"}}");
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: day,
        log_time: u64::from(day),
        publish_time: u64::from(day),
    };
    writer
        .write_to_known_channel(&header, payload.as_bytes())
        .unwrap();
}

#[test]
fn a_recording_flushed_after_each_message_arrives_message_by_message() {
    let mut bench = Bench::new("mcap");
    let (mut writer, channel) = recorder(&bench, mcap::WriteOptions::new().use_chunks(false));
    for day in 1..10 {
        record(&mut writer, channel, day);
        writer.flush().unwrap();
        assert_eq!(bench.news(), [format!("5:{day}")]);
    }
    writer.finish().unwrap();
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 0);
}

#[test]
fn messages_in_an_open_chunk_wait_for_its_end_and_none_is_lost() {
    for compression in [
        None,
        Some(mcap::Compression::Zstd),
        Some(mcap::Compression::Lz4),
    ] {
        let mut bench = Bench::new("mcap");
        let options = mcap::WriteOptions::new()
            .chunk_size(None)
            .compression(compression);
        let (mut writer, channel) = recorder(&bench, options);
        let mut news = Vec::new();
        for day in 1..30 {
            record(&mut writer, channel, day);
            if day % 5 == 0 {
                writer.flush().unwrap();
            }
            news.extend(bench.news());
        }
        writer.finish().unwrap();
        news.extend(bench.news());
        let expected: Vec<String> = (1..30).map(|day| format!("5:{day}")).collect();
        assert_eq!(news, expected, "{compression:?}");
        assert_eq!(bench.follower.quarantined(), 0);
    }
}

/// A finished recording of three chunks, in bytes.
fn three_chunks(bench: &Bench) -> Vec<u8> {
    let options = mcap::WriteOptions::new().chunk_size(None);
    let (mut writer, channel) = recorder(bench, options);
    for day in 1..=3 {
        record(&mut writer, channel, day);
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
    fs::read(bench.path("r.mcap")).unwrap()
}

#[test]
fn a_recording_arrives_the_same_however_its_bytes_are_written() {
    let source = Bench::new("mcap");
    let bytes = three_chunks(&source);
    for step in [1, 7, 64, 1000] {
        let mut bench = Bench::new("mcap");
        let mut file = File::create(bench.path("grown.mcap")).unwrap();
        let mut news = Vec::new();
        for part in bytes.chunks(step) {
            file.write_all(part).unwrap();
            news.extend(bench.news());
        }
        assert_eq!(news, ["5:1", "5:2", "5:3"], "{step} bytes a write");
    }
}

#[test]
fn no_flipped_bit_is_taken_for_a_reading_or_stops_the_follower() {
    let source = Bench::new("mcap");
    let bytes = three_chunks(&source);
    let mut damaged = 0;
    let mut bench = Bench::new("mcap");
    for bit in (0..bytes.len() * 8).step_by(3) {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let path = bench.path("f.mcap");
        fs::write(&path, &flipped).unwrap();
        let mut news = bench.news();
        news.extend(bench.news());
        for one in &news {
            assert!(
                ["5:1", "5:2", "5:3"].contains(&one.as_str()),
                "{bit}: {one}"
            );
        }
        damaged += usize::from(news.len() < 3);
        fs::remove_file(&path).unwrap();
        // Of so many that have gone not all are read on.
        assert!(bench.news().iter().all(|one| one == "possible-gap"));
    }
    assert!(damaged > 0, "no bit was flipped where it hurts");
}

#[test]
fn a_length_that_cannot_be_true_is_neither_allocated_nor_waited_for() {
    let mut bench = Bench::new("mcap");
    let mut bytes = b"\x89MCAP0\r\n\x05".to_vec();
    bytes.extend((u64::MAX / 2).to_le_bytes());
    fs::write(bench.path("bomb.mcap"), bytes).unwrap();
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 1);
}

#[test]
fn a_chunk_whose_length_is_filled_in_later_is_taken_once_whole() {
    let source = Bench::new("mcap");
    let bytes = three_chunks(&source);
    // The first chunk, as a writer leaves it before it seeks back.
    let mut at = 8;
    while bytes[at] != 0x06 {
        at += 9 + usize::try_from(u64::from_le_bytes(
            bytes[at + 1..at + 9].try_into().unwrap(),
        ))
        .unwrap();
    }
    let mut open = bytes.clone();
    open[at + 1..at + 9].copy_from_slice(&u64::MAX.to_le_bytes());
    let mut bench = Bench::new("mcap");
    fs::write(bench.path("o.mcap"), &open).unwrap();
    assert!(bench.news().is_empty());
    let mut file = OpenOptions::new()
        .write(true)
        .open(bench.path("o.mcap"))
        .unwrap();
    file.seek(SeekFrom::Start(at as u64 + 1)).unwrap();
    file.write_all(&bytes[at + 1..at + 9]).unwrap();
    assert_eq!(bench.news(), ["5:1", "5:2", "5:3"]);
}

#[test]
fn following_a_finished_file_gives_what_reading_it_whole_gives() {
    let mut bench = Bench::new("mcap");
    three_chunks(&bench);
    let (recording, _) = read_files(&[bench.path("r.mcap")], &ReadOptions::default()).unwrap();
    let whole: Vec<String> = recording.series[0]
        .readings
        .iter()
        .map(|reading| format!("5:{}", reading.value))
        .collect();
    assert_eq!(bench.news(), whole);
}

#[test]
fn a_header_in_the_middle_is_taken_and_values_in_its_unit_are_given_in_the_first_one() {
    let mut bench = Bench::new("csv");
    let at = |day: u32| format!("2017-06-{day:02}T00:00:00Z");
    bench.write("x.csv", "time,5_displacement_mm,6_displacement_mm\n");
    bench.append("x.csv", &format!("{},1,10\n", at(1)));
    assert_eq!(bench.news(), ["5:1", "6:10"]);
    bench.append("x.csv", "time,6_displacement_mm,5_displacement_cm\n");
    bench.append("x.csv", &format!("{},11,0.2\n", at(2)));
    assert_eq!(bench.news(), ["5:2", "6:11"]);
    bench.append("x.csv", "time,5_displacement_mm\n");
    bench.append("x.csv", &format!("{},3\n", at(3)));
    assert_eq!(bench.news(), ["5:3"]);
}

#[test]
fn under_a_header_that_is_not_understood_no_row_is_taken() {
    let mut bench = Bench::new("csv");
    bench.write("5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    bench.append(
        "5.csv",
        &format!("time,displacement_furlong\n{}", row(2, 2.0)),
    );
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 2);
    bench.append("5.csv", &format!("{HEADER}{}", row(3, 3.0)));
    assert_eq!(bench.news(), ["5:3"]);
}

#[test]
fn ndjson_is_followed_and_a_torn_object_costs_itself_alone() {
    let mut bench = Bench::new("ndjson");
    let message = |day: u32| {
        format!(
            r#"{{"benchmark":"5","time":"2017-06-{day:02}T00:00:00Z","value":{day},"unit":"mm"}}"#
        )
    };
    bench.write(
        "x.ndjson",
        &format!("{}\n{}", message(1), &message(2)[..40]),
    );
    assert_eq!(bench.news(), ["5:1"]);
    // The writer was killed and started again.
    bench.append("x.ndjson", &format!("{}\n", message(3)));
    assert_eq!(bench.news(), ["5:3"]);
    assert_eq!(bench.follower.quarantined(), 1);
}

const TOA5: &str = "\"TOA5\",\"Toc\",\"CR6\",\"1\",\"\",\"\",\"\",\"Hourly\"\n\
                    \"TIMESTAMP\",\"RECORD\",\"east\",\"north\",\"height\"\n\
                    \"TS\",\"RN\",\"mm\",\"mm\",\"mm\"\n\"\",\"\",\"Smp\",\"Smp\",\"Smp\"\n";

#[test]
fn a_vector_is_projected_on_the_slope_and_missing_where_a_component_is() {
    let mut bench = Bench::with(
        "toa5",
        "[[benchmark]]\nid = \"gnss\"\ncomponents = [\"east_mm\", \"north_mm\", \"height_mm\"]\n\
         direction = [0, 3, -4]\n",
    );
    bench.write("x.toa5", TOA5);
    assert!(bench.news().is_empty());
    bench.append("x.toa5", "\"2017-06-06 17:00:00\",0,100,5,-5\n");
    assert_eq!(bench.news(), ["gnss:7"], "3/5 of 5 north and 4/5 of 5 down");
    bench.append("x.toa5", "\"2017-06-06 18:00:00\",1,100,\"NAN\",-5\n");
    assert_eq!(bench.news(), ["gnss gives NAN in north_mm"]);
    bench.append("x.toa5", "\"2017-06-06 19:00:00\",2,100,5,-7999\n");
    assert_eq!(bench.news(), ["gnss gives -7999 in height_mm"]);
}

#[test]
fn what_is_no_toa5_is_refused_until_it_is_replaced() {
    let mut bench = Bench::new("toa5");
    bench.write("x.toa5", &format!("{HEADER}{}", row(1, 1.0)));
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 1);
    let other = TOA5.replace("east", "5_displacement");
    bench.write(
        "y.toa5",
        &format!("{other}\"2017-06-06 17:00:00\",0,1,2,3\n"),
    );
    fs::rename(bench.path("y.toa5"), bench.path("x.toa5")).unwrap();
    assert_eq!(bench.news(), ["height_mm:3", "north_mm:2", "5:1"]);
}

fn pack(file: &Path, text: &str) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(text.as_bytes()).unwrap();
    let bytes = packer.finish().unwrap();
    fs::write(file, &bytes).unwrap();
    bytes
}

#[test]
fn a_packed_file_is_read_once_whole_and_its_last_line_needs_no_newline() {
    let mut bench = Bench::new("csv");
    let rows: String = (1..=28).map(|day| row(day, f64::from(day))).collect();
    let text = format!("{HEADER}{}", rows.trim_end());
    pack(&bench.path("5.csv.gz"), &text);
    let news = bench.news();
    assert_eq!(
        (news.len(), news[0].as_str(), news[27].as_str()),
        (28, "5:1", "5:28")
    );
    assert!(bench.news().is_empty());
    let file = bench.path("5.csv.gz");
    let (packed, _) = read_files(&[file], &ReadOptions::default()).unwrap();
    assert_eq!(packed.series[0].readings.len(), 28);
    assert_eq!(packed.series[0].benchmark.as_str(), "5");
}

#[test]
fn what_is_added_to_a_packed_file_that_has_been_read_is_not_lost() {
    let mut bench = Bench::new("csv");
    let file = bench.path("5.csv.gz");
    let first = pack(&file, &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    let more = pack(&bench.path("more"), &row(2, 2.0));
    fs::write(&file, [first, more].concat()).unwrap();
    // Whole: whoever takes the values drops what is known.
    assert_eq!(bench.news(), ["5:1", "5:2"]);
    assert!(bench.news().is_empty());
}

#[test]
fn a_packed_file_that_is_still_being_packed_is_read_when_it_is_whole() {
    let mut bench = Bench::new("csv");
    let text = format!("{HEADER}{}{}", row(1, 1.0), row(2, 2.0));
    let file = bench.path("5.csv.gz");
    let bytes = pack(&file, &text);
    fs::write(&file, &bytes[..bytes.len() - 10]).unwrap();
    let early = bench.news();
    assert!(bench.news().is_empty(), "not again and again");
    fs::write(&file, &bytes).unwrap();
    let all = bench.news();
    assert_eq!(all, ["5:1", "5:2"], "after {early:?}");
}

#[test]
fn a_packed_file_that_is_damaged_leaves_the_others_alone() {
    let mut bench = Bench::new("csv");
    let file = bench.path("5.csv.gz");
    let mut bytes = pack(&file, &format!("{HEADER}{}", row(1, 1.0)));
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0xff;
    fs::write(&file, bytes).unwrap();
    bench.write("6.csv", &format!("{HEADER}{}", row(2, 2.0)));
    assert!(bench.news().contains(&"6:2".to_owned()));
    assert!(bench.news().is_empty());
}

#[test]
fn what_comes_live_to_one_file_does_not_wait_for_the_backlog_of_another() {
    let mut bench = Bench::new("csv");
    bench.write("a.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["a:1"]);
    let start: Timestamp = "2017-01-01T00:00:00Z".parse().unwrap();
    let backlog = (0..3000).map(|hour| row_at(start + SignedDuration::from_hours(hour), hour));
    bench.write("b.csv", &format!("{HEADER}{}", backlog.collect::<String>()));
    let first = bench.follower.poll(bench.wall);
    assert!(
        !first.caught_up && first.arrivals.len() <= 250,
        "{}",
        first.arrivals.len()
    );
    bench.append("a.csv", &row(20, 7.0));
    std::thread::sleep(std::time::Duration::from_millis(300));
    let next = bench.follower.poll(bench.wall);
    let is_live = |arrival: &Arrival| {
        matches!(&arrival.input, Input::Reading { benchmark, reading, .. }
            if benchmark.as_str() == "a" && reading.value > 6.0)
    };
    assert!(next.arrivals.first().is_some_and(is_live), "{next:?}");
    // Nothing is lost, taken twice or taken in another order.
    let mut values: Vec<f64> = Vec::new();
    let mut take = |batch: ArrivalBatch| {
        for arrival in batch.arrivals {
            if let Input::Reading {
                benchmark, reading, ..
            } = arrival.input
                && benchmark.as_str() == "b"
            {
                values.push(reading.value);
            }
        }
        batch.caught_up
    };
    let mut is_done = take(first);
    is_done |= take(next);
    while !is_done {
        is_done = take(bench.follower.poll(bench.wall));
    }
    assert_eq!(values, (0..3000).map(f64::from).collect::<Vec<_>>());
}
