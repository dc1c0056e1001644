//! A flood: a row of each of ten files takes ten thousand benchmarks over orange, and one of them over red.

use super::{Daemon, steps};
use jiff::{SignedDuration, Timestamp};
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::time::{Duration, Instant};

/// Rows of the past.
const ROWS: i64 = 3;
/// Benchmarks of a file: a line of more than 64 KiB is refused.
const COLUMNS: usize = 1000;

/// How long after such a row's append the red's hook has been started, and all is durable.
pub(crate) fn one_row(benchmarks: usize) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("incoming")).unwrap();
    let notified = folder.path().join("notified");
    // The clock is that of the host: nanoseconds since 1970.
    let script = "echo $SLIPWATCH_LEVEL $(date +%s%N) >> notified\n";
    fs::write(folder.path().join("hook.sh"), script).unwrap();
    let text = "[site]\nname = \"bench\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
                [[alert.threshold]]\nlevel = \"orange\"\ndisplacement = \"1 m\"\n\
                [[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"5 m\"\n\
                [[hook]]\nrun = [\"/bin/sh\", \"hook.sh\"]\nlevels = [\"orange\", \"red\"]\n";
    fs::write(folder.path().join("site.toml"), text).unwrap();
    let files: Vec<_> = (0..benchmarks)
        .step_by(COLUMNS)
        .map(|first| {
            (
                first,
                folder.path().join(format!("incoming/f{first:05}.csv")),
            )
        })
        .collect();
    let columns = |first: usize| first..(first + COLUMNS).min(benchmarks);
    let row = |time: Timestamp, first: usize, value: &dyn Fn(usize) -> f64| {
        let mut line = time.to_string();
        for benchmark in columns(first) {
            write!(line, ",{}", value(benchmark)).unwrap();
        }
        line + "\n"
    };
    for (first, file) in &files {
        let mut past = "time".to_owned();
        for benchmark in columns(*first) {
            write!(past, ",b{benchmark:05}_displacement_mm").unwrap();
        }
        past.push('\n');
        for back in (1..=ROWS).rev() {
            let time = Timestamp::now() - SignedDuration::from_mins(10 * back);
            past += &row(time, *first, &|_| 1.0);
        }
        fs::write(file, past).unwrap();
    }
    let daemon = Daemon::start(&folder);
    let before = benchmarks * usize::try_from(ROWS).unwrap();
    super::wait_for(&folder, before);
    std::thread::sleep(Duration::from_secs(5));
    let (first, red) = (steps(&folder), benchmarks / 2);
    let now = Timestamp::now();
    let value = |one: usize| if one == red { 6000.0 } else { 2000.0 };
    let lines: Vec<_> = (files.iter())
        .map(|(place, file)| (file, row(now, *place, &value)))
        .collect();
    let appended = Timestamp::now().as_nanosecond();
    let began = Instant::now();
    for (file, line) in lines {
        let mut open = OpenOptions::new().append(true).open(file).unwrap();
        open.write_all(line.as_bytes()).unwrap();
    }
    let of = |level: &str| {
        let lines = fs::read_to_string(&notified).unwrap_or_default();
        let line = lines
            .lines()
            .find_map(|line| line.strip_prefix(level).map(str::to_owned));
        line.and_then(|started| started.trim().parse::<i128>().ok())
    };
    let started = loop {
        if let Some(started) = of("red ") {
            break started;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    while steps(&folder) < first + i64::try_from(benchmarks).unwrap() {
        std::thread::sleep(Duration::from_millis(10));
    }
    let durable = began.elapsed().as_secs_f64();
    std::thread::sleep(Duration::from_secs(2));
    let messages = fs::read_to_string(&notified).unwrap().lines().count();
    println!(
        "flood: {benchmarks} benchmarks over orange at one time, one of them over red\n  \
         appended to the red's hook started {:.2} s, all durable {durable:.2} s, {messages} messages; resident {:.0} MB",
        (started - appended) as f64 / 1e9,
        daemon.megabytes(),
    );
}
