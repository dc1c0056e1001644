//! What the daemon holds: a steady load, a first start, a backlog, many benchmarks. The program itself on real files, with a real hook.
//!
//!     cargo bench --bench daemon -- load [--seconds 60] | first | messages [--messages 100000] |
//!     flood [--benchmarks 10000] | catchup [--readings 100000] | memory [--most 10000]

#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "its figures")]
#![expect(clippy::disallowed_methods, reason = "it measures by the clock")]

mod broker;
mod flood;

use jiff::{SignedDuration, Timestamp};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::config::{self, Config};
use slipwatch::runtime::tail::Follower;
use slipwatch::store::{Batch, Store};
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Benchmarks and readings a second, in all, of the held load.
const BENCHMARKS: usize = 1000;
const READINGS_A_SECOND: u32 = 10;
/// Of the held load: hourly readings of each benchmark before it.
const HISTORY: usize = 30;
/// Each fifth benchmark's first reading calls an alert.
const ALERTS: usize = 5;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let after = |flag: &str| {
        let at = args.iter().position(|arg| arg == flag)?;
        args.get(at + 1)
    };
    if let Some(folder) = after("--hook") {
        return note_alert(Path::new(folder));
    }
    let number = |flag, default: usize| after(flag).map_or(default, |text| text.parse().unwrap());
    let all = !args.iter().any(|arg| {
        ["load", "first", "messages", "flood", "catchup", "memory"].contains(&arg.as_str())
    });
    let wants = |name: &str| all || args.iter().any(|arg| arg == name);
    if wants("load") {
        held_load(u32::try_from(number("--seconds", 60)).unwrap());
    }
    if wants("first") {
        first_start(30, 300, 8);
    }
    if wants("messages") {
        broker::backlog(100, number("--messages", 100_000));
    }
    if wants("flood") {
        flood::one_row(number("--benchmarks", 10_000));
    }
    if wants("catchup") {
        let readings = number("--readings", 100_000);
        catch_up("one benchmark, a reading a minute", 1, readings, 60);
        catch_up("40 benchmarks, a reading an hour", 40, readings / 40, 3600);
    }
    if wants("memory") {
        let most = number("--most", 10_000);
        for benchmarks in [100, 1000, 10_000].into_iter().filter(|n| *n <= most) {
            memory(benchmarks);
        }
    }
}

/// As the hook: when it was started, wall clock.
fn note_alert(folder: &Path) {
    let started = nanoseconds();
    let benchmark = std::env::var("SLIPWATCH_BENCHMARK").unwrap();
    // The first alert of a benchmark alone.
    let file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(folder.join(benchmark));
    if let Ok(mut file) = file {
        write!(file, "{started}").unwrap();
    }
}

fn nanoseconds() -> i128 {
    Timestamp::now().as_nanosecond()
}

/// A site of `benchmarks` files with `each` readings before now, `seconds` apart: creep of a mm a day that slows down.
fn site(benchmarks: usize, each: usize, seconds: i64) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["incoming", "notified"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    let hook = std::env::current_exe().unwrap();
    let text = format!(
        "[site]\nname = \"bench\"\nstate_dir = \"state\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
         [[alert.threshold]]\nlevel = \"orange\"\ndisplacement = \"5 m\"\n\
         [[hook]]\nrun = [{:?}, \"--hook\", {:?}]\nlevels = [\"orange\", \"red\"]\n",
        hook.display(),
        folder.path().join("notified").display(),
    );
    fs::write(folder.path().join("site.toml"), text).unwrap();
    let mut generator = Pcg64::seed_from_u64(20_261_122);
    let first = Timestamp::now().as_second() - i64::try_from(each).unwrap() * seconds;
    for benchmark in 0..benchmarks {
        let mut lines = "time,displacement_mm\n".to_owned();
        for reading in 0..each {
            let time = first + i64::try_from(reading).unwrap() * seconds;
            let days = (reading as f64) * (seconds as f64) / 86_400.0;
            let noise: f64 = generator.sample(StandardNormal);
            let value = 30.0 * (days / 30.0).ln_1p() + 0.2 * noise;
            writeln!(
                lines,
                "{},{value:.2}",
                Timestamp::from_second(time).unwrap()
            )
            .unwrap();
        }
        fs::write(file(&folder, benchmark), lines).unwrap();
    }
    folder
}

fn file(folder: &TempDir, benchmark: usize) -> std::path::PathBuf {
    folder.path().join(format!("incoming/b{benchmark:05}.csv"))
}

/// Stopped when it goes out of scope.
struct Daemon(Child);

impl Daemon {
    fn start(folder: &TempDir) -> Self {
        // Another build of the program, to compare with.
        let named = std::env::var("SLIPWATCH");
        let child = Command::new(named.as_deref().unwrap_or(env!("CARGO_BIN_EXE_slipwatch")))
            .arg("run")
            .arg(folder.path().join("site.toml"))
            .env("RUST_LOG", "error")
            .stdout(Stdio::null())
            .spawn();
        Self(child.unwrap())
    }

    /// Resident memory, MB.
    fn megabytes(&self) -> f64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.0.id())).unwrap();
        let line = status
            .lines()
            .find(|line| line.starts_with("VmRSS"))
            .unwrap();
        let kilobytes: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        kilobytes / 1024.0
    }

    /// Processor time so far, seconds.
    fn processor(&self) -> f64 {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.0.id())).unwrap();
        let fields: Vec<&str> = stat
            .rsplit(')')
            .next()
            .unwrap()
            .split_whitespace()
            .collect();
        (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// Steps that are durable.
fn steps(folder: &TempDir) -> i64 {
    Store::look(&folder.path().join("state")).map_or(0, |store| store.last_step())
}

/// Readings that are durable: steps are also notices of time and of the clock.
fn readings(folder: &TempDir) -> usize {
    let count = || -> rusqlite::Result<i64> {
        let file = folder.path().join("state/slipwatch.db");
        let database = rusqlite::Connection::open(file)?;
        database.query_row("SELECT count(series) FROM step", [], |row| row.get(0))
    };
    usize::try_from(count().unwrap_or(0)).unwrap()
}

/// The alerts in force, as the program lists them.
fn in_force(folder: &TempDir) -> String {
    let listed = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .args(["alerts", "list", "--format", "json", "--config"])
        .arg(folder.path().join("site.toml"))
        .output();
    String::from_utf8(listed.unwrap().stdout).unwrap()
}

fn wait_for(folder: &TempDir, least: usize) {
    while steps(folder) < i64::try_from(least).unwrap() {
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn held_load(seconds: u32) {
    let folder = site(BENCHMARKS, HISTORY, 3600);
    let daemon = Daemon::start(&folder);
    wait_for(&folder, BENCHMARKS * HISTORY);
    std::thread::sleep(Duration::from_secs(3));
    let standing = in_force(&folder);
    let (before, memory) = (readings(&folder), daemon.megabytes());
    let began = Instant::now();
    let mut appended: Vec<i128> = Vec::new();
    let (mut lags, mut middle) = ([0, 0], memory);
    for number in 0..seconds * READINGS_A_SECOND {
        let due = Duration::from_secs(1) * number / READINGS_A_SECOND;
        std::thread::sleep(due.saturating_sub(began.elapsed()));
        let benchmark = number as usize % BENCHMARKS;
        let value = if benchmark.is_multiple_of(ALERTS) {
            6000.0
        } else {
            30.0
        };
        let mut file = OpenOptions::new()
            .append(true)
            .open(file(&folder, benchmark))
            .unwrap();
        let line = format!("{},{value:.2}\n", Timestamp::now());
        let now = nanoseconds();
        file.write_all(line.as_bytes()).unwrap();
        appended.push(now);
        let half = usize::from(2 * number >= seconds * READINGS_A_SECOND);
        if half == 0 {
            middle = daemon.megabytes();
        }
        if number % READINGS_A_SECOND == 0 && number > 0 {
            let lag = (number as usize).saturating_sub(readings(&folder) - before);
            lags[half] = lag.max(lags[half]);
        }
    }
    std::thread::sleep(Duration::from_secs(3));
    let (mut latencies, mut stood) = (Vec::new(), 0);
    for (benchmark, appended) in appended.iter().take(BENCHMARKS).enumerate().step_by(ALERTS) {
        let name = format!("b{benchmark:05}");
        // It was notified before, perhaps in one message with many others.
        if standing.contains(&format!("\"benchmark\":\"{name}\"")) {
            stood += 1;
            continue;
        }
        let notified = fs::read_to_string(folder.path().join("notified").join(&name));
        let started = notified.unwrap_or_else(|error| panic!("{name} was never notified: {error}"));
        let started: i128 = started.parse().unwrap();
        latencies.push((started - appended) as f64 / 1e6);
    }
    latencies.sort_by(f64::total_cmp);
    let share = |share: usize| latencies[(latencies.len() * share / 100).min(latencies.len() - 1)];
    println!(
        "held load: {BENCHMARKS} benchmarks, {READINGS_A_SECOND} readings/s for {seconds} s\n  \
         readings that were not durable yet, most: first half {}, second half {}; at the end {}\n  \
         resident: {memory:.1} MB at the start, {middle:.1} in the middle, {:.1} at the end\n  \
         appended to hook started, {} alerts ({stood} benchmarks stood at a level before): p50 {:.1} ms, p90 {:.1} ms, p99 {:.1} ms",
        lags[0],
        lags[1],
        appended.len().saturating_sub(readings(&folder) - before),
        daemon.megabytes(),
        latencies.len(),
        share(50),
        share(90),
        share(99),
    );
}

/// Values a second of parsing alone, and of parsing and SQLite without the monitor.
fn floor(config: &Config, values: usize) -> (f64, f64) {
    let pass = |store: Option<&Store>| {
        let began = Instant::now();
        let mut follower = Follower::new(&config.sources, &config.benchmarks, &[]);
        let mut batch = Batch::default();
        loop {
            let found = follower.poll(slipwatch::runtime::clock::now());
            if let Some(store) = store {
                for arrival in &found.arrivals {
                    batch.step(arrival.time, &arrival.input, &[]);
                }
                found
                    .positions
                    .into_iter()
                    .for_each(|one| batch.position(one));
                store.commit(&batch).unwrap();
                batch.clear();
            }
            if found.caught_up {
                return values as f64 / began.elapsed().as_secs_f64();
            }
        }
    };
    let parsed = pass(None);
    let other = tempfile::tempdir().unwrap();
    (parsed, pass(Some(&Store::open(other.path()).unwrap())))
}

/// A first start on hourly rows of many benchmarks and their covariates.
fn first_start(benchmarks: usize, rows: usize, covariates: usize) {
    let folder = site(benchmarks, rows, 3600);
    let first = Timestamp::now().as_second() - i64::try_from(rows).unwrap() * 3600;
    let mut text = "time".to_owned();
    for number in 0..covariates {
        write!(text, ",c{number}_mm").unwrap();
    }
    let mut generator = Pcg64::seed_from_u64(8);
    let mut walk = vec![0.0; covariates];
    for row in 0..rows {
        let time = first + i64::try_from(row).unwrap() * 3600;
        write!(text, "\n{}", Timestamp::from_second(time).unwrap()).unwrap();
        for value in &mut walk {
            let noise: f64 = generator.sample(StandardNormal);
            *value = 0.9 * *value + noise;
            write!(text, ",{value:.2}").unwrap();
        }
    }
    fs::write(folder.path().join("incoming/weather.csv"), text + "\n").unwrap();
    let config = config::load(&folder.path().join("site.toml")).unwrap();
    let values = (benchmarks + covariates) * rows;
    let (parsed, stored) = floor(&config, values);
    let began = Instant::now();
    let daemon = Daemon::start(&folder);
    wait_for(&folder, values);
    let (taken, processor) = (began.elapsed().as_secs_f64(), daemon.processor());
    let refits = i64::try_from(benchmarks * (rows - 9)).unwrap();
    let said = || {
        let store = Store::look(&folder.path().join("state"));
        store.map_or(0, |store| store.heads().unwrap().event)
    };
    while said() < refits {
        std::thread::sleep(Duration::from_millis(100));
    }
    println!(
        "first start: {benchmarks} benchmarks, {rows} rows, {covariates} covariates, {values} values\n  \
         parsing alone {:.3} s; parsing and SQLite {:.3} s; the daemon {taken:.3} s ({:.1} times that), {processor:.2} s of the processor\n  \
         the {refits} refits of the past: after {:.1} s, {:.1} s of the processor",
        values as f64 / parsed,
        values as f64 / stored,
        taken * stored / values as f64,
        began.elapsed().as_secs_f64(),
        daemon.processor(),
    );
}

fn catch_up(what: &str, benchmarks: usize, each: usize, seconds: i64) {
    let readings = benchmarks * each;
    let folder = site(benchmarks, each, seconds);
    let config = config::load(&folder.path().join("site.toml")).unwrap();
    let (parsed, stored) = floor(&config, readings);
    let began = Instant::now();
    let daemon = Daemon::start(&folder);
    wait_for(&folder, readings);
    let (taken, processor) = (
        readings as f64 / began.elapsed().as_secs_f64(),
        daemon.processor(),
    );
    let refits = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .args(["events", "--kind", "refit", "--format", "json", "--config"])
        .arg(folder.path().join("site.toml"))
        .output();
    let refits = refits
        .unwrap()
        .stdout
        .split(|byte| *byte == b'\n')
        .filter(|line| !line.is_empty())
        .count();
    println!(
        "catch-up: {what}, {readings} readings\n  parsing alone {parsed:.0} readings/s; parsing and SQLite {stored:.0}/s; \
         the daemon {taken:.0}/s, {processor:.1} s of the processor, {:.0} MB, {refits} refits in its state",
        daemon.megabytes(),
    );
}

fn memory(benchmarks: usize) {
    // So many readings that the last ones lead to a forecast, and no more: what is held is the same.
    let span = SignedDuration::from_mins(290).as_secs();
    let folder = site(benchmarks, 100, span / 100);
    let daemon = Daemon::start(&folder);
    wait_for(&folder, benchmarks * 100);
    std::thread::sleep(Duration::from_secs(3));
    let megabytes = daemon.megabytes();
    println!(
        "memory: {benchmarks} benchmarks of 100 readings: {megabytes:.1} MB, {:.1} kB each",
        1024.0 * megabytes / benchmarks as f64
    );
}
