//! A daemon of our own over measured readings, moved in time so that the last one is an hour old.

use assert_cmd::Command;
use jiff::{SignedDuration, Timestamp};
use serde_json::Value;
use slipwatch::runtime::clock::Stopwatch;
use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Stdio};
use std::time::Duration;
use tempfile::TempDir;

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
pub(crate) const TOKEN: &str = "0123456789abcdef-of-the-test";
/// A benchmark whose name is markup.
pub(crate) const MARKUP: &str = "<script>window.pwned=1</script>";
/// A daemon that has not begun after this time never will; a million readings take minutes.
const LIMIT: Duration = Duration::from_secs(600);

/// An address of this machine at which nothing listens.
pub(crate) fn free_address() -> SocketAddr {
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    free.local_addr().unwrap()
}

pub(crate) struct Site {
    folder: TempDir,
    pub(crate) port: u16,
    process: Option<Child>,
}

impl Site {
    pub(crate) fn start() -> Self {
        Self::with(MARKUP)
    }

    /// The same with another name for the benchmark that stands still.
    pub(crate) fn with(still: &str) -> Self {
        Self::of(&readings(still), |port| config(port, still))
    }

    /// A site with these readings in `slope.csv`, and the config that belongs to the port.
    pub(crate) fn of(readings: &str, config: impl Fn(u16) -> String) -> Self {
        let port = free_address().port();
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("token", TOKEN);
        write("slope.csv", readings);
        write("site.toml", &config(port));
        let mut site = Self {
            folder,
            port,
            process: None,
        };
        site.run();
        let start = Stopwatch::start();
        let log = || fs::read_to_string(site.folder.path().join("log")).unwrap();
        while !log().contains("before the first start has been judged") {
            assert!(start.elapsed() < LIMIT, "{}", log());
            std::thread::sleep(Duration::from_millis(100));
        }
        site
    }

    /// Starts the daemon and waits until it has read the past.
    pub(crate) fn run(&mut self) {
        let log = fs::File::create(self.folder.path().join("log")).unwrap();
        let process = std::process::Command::new(PROGRAM)
            .args(["run", "site.toml"])
            .current_dir(self.folder.path())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn();
        self.process = Some(process.unwrap());
        let start = Stopwatch::start();
        while self.get("/readyz").0 != 200 {
            let log = fs::read_to_string(self.folder.path().join("log")).unwrap();
            assert!(start.elapsed() < LIMIT, "{log}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Ends it without a word, as a power cut would.
    pub(crate) fn kill(&mut self) {
        if let Some(mut process) = self.process.take() {
            process.kill().unwrap();
            process.wait().unwrap();
        }
    }

    /// Adds a row to the file that the daemon follows.
    pub(crate) fn append(&self, row: &str) {
        let path = self.folder.path().join("slope.csv");
        let mut file = fs::File::options().append(true).open(path).unwrap();
        writeln!(file, "{row}").unwrap();
    }

    pub(crate) fn address(&self, place: &str) -> String {
        format!("http://127.0.0.1:{}/{place}", self.port)
    }

    /// Status and body of an answer; 0 where nobody answers.
    pub(crate) fn get(&self, path: &str) -> (u16, String) {
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", self.port)) else {
            return (0, String::new());
        };
        let port = self.port;
        let request = format!(
            "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut text = String::new();
        let _ = stream.read_to_string(&mut text);
        let status = text.split(' ').nth(1).and_then(|code| code.parse().ok());
        let body = text.split_once("\r\n\r\n").map_or("", |(_, body)| body);
        (status.unwrap_or(0), body.to_owned())
    }

    pub(crate) fn json(&self, path: &str) -> Value {
        let (status, body) = self.get(path);
        assert_eq!(status, 200, "{path}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    /// The events of a kind, as the command line gives them, by their time: those of the past before the first start
    /// come after that of the present.
    pub(crate) fn events(&self, kind: &str) -> Vec<Value> {
        let output = Command::new(PROGRAM)
            .args(["events", "--config", "site.toml", "--format", "json"])
            .args(["--kind", kind])
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let lines = text.lines();
        let mut events: Vec<Value> = lines
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        let time = |event: &Value| event["time"].as_str().unwrap().parse::<jiff::Timestamp>();
        events.sort_by_key(|event| time(event).unwrap());
        events
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Preonzo's E3 and E5, a benchmark that stands still, and rain.
fn readings(name: &str) -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/preonzo-2012.mcap");
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table.csv");
    Command::new(PROGRAM)
        .args(["convert", file])
        .arg(&table)
        .assert()
        .success();
    let mut reader = csv::Reader::from_path(&table).unwrap();
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|one| one == name).unwrap();
    let columns = [column("E3_displacement_mm"), column("E5_displacement_mm")];
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let time = |row: &csv::StringRecord| row[0].parse::<Timestamp>().unwrap();
    let newest = time(rows.last().unwrap());
    let hour_ago = slipwatch::runtime::clock::now() - SignedDuration::from_hours(1);
    let shift = hour_ago.duration_since(newest);
    let mut text =
        format!("time,E3_displacement_mm,E5_displacement_mm,{name}_displacement_mm,rain_mm\n");
    for (index, row) in rows.iter().enumerate() {
        let [e3, e5] = columns.map(|column| &row[column]);
        let still = 0.05 * (index % 3) as f64;
        let moved = time(row) + shift;
        writeln!(text, "{moved},{e3},{e5},{still},{}", index * 7 % 11).unwrap();
    }
    text
}

fn config(port: u16, still: &str) -> String {
    let benchmark = |id: &str, position: &str| {
        format!(
            "[[benchmark]]\nid = \"{id}\"\nsource = \"logger\"\ncolumn = \"{id}_displacement_mm\"\nposition = {position}\n"
        )
    };
    [
        format!("[site]\nname = \"Preonzo, moved in time\"\nstate_dir = \"state\"\nlisten = \"127.0.0.1:{port}\"\n"),
        "token_file = \"token\"\ntime_zone = \"Europe/Zurich\"\n".to_owned(),
        "[[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"slope.csv\"\n".to_owned(),
        benchmark("E3", "[120, 80, 1410]"),
        benchmark("E5", "[180, 140, 1460]"),
        benchmark(still, "[60, 20, 1350]"),
        "[[hook]]\nrun = [\"/bin/true\"]\n".to_owned(),
    ]
    .concat()
}
