//! The program from outside: exit codes, what it prints, signals and pipes.

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
const LIMIT: Duration = Duration::from_secs(60);

fn slipwatch(args: &[&str]) -> Assert {
    Command::new(PROGRAM).args(args).timeout(LIMIT).assert()
}

fn out(assert: &Assert) -> String {
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

fn err(assert: &Assert) -> String {
    String::from_utf8(assert.get_output().stderr.clone()).unwrap()
}

fn recording(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    folder.join(name).to_str().unwrap().to_owned()
}

fn vaiont() -> String {
    recording("vaiont-1963-reconstruction.mcap")
}

/// A temporary folder with `text` in a file `name`.
fn file(name: &str, text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    (folder, path.to_str().unwrap().to_owned())
}

#[test]
fn a_command_line_that_cannot_be_meant_is_2() {
    for args in [
        &["replay"] as &[&str],
        &["no-such-command"],
        &["replay", "a.csv", "--speed", "0"],
        &["replay", "a.csv", "--speed", "NaN"],
        &["replay", "a.csv", "--hooks"],
        &["replay", "a.csv", "--until", "soon"],
        &["replay", "a.csv", "--averaging", "1"],
        &["replay", "a.csv", "--critical-velocity", "5 mm"],
        &["replay", "a.csv", "--column", "a=b:speed:mm"],
        &["simulate", "--times", "1"],
        &["simulate", "--m", "1", "--x-i", "2", "--times", "1"],
        &["simulate", "--m", "2", "--s-theta", "2", "--times", "1"],
        &["simulate", "--m", "2", "--x-i", "-2", "--times", "1"],
        &["simulate", "--m", "2", "--x-i", "2", "--times", "-1"],
        &["simulate", "--m", "2", "--x-i", "2", "--times", "1,inf"],
    ] {
        let done = slipwatch(args).code(2);
        assert!(out(&done).is_empty() && !err(&done).is_empty(), "{args:?}");
    }
}

#[test]
fn bad_data_is_65_and_is_shown_with_its_place() {
    let text = "time,displacement_mm\n2020-01-01T00:00:00Z,1\n2020-01-02T00:00:00Z,abc\n";
    let (_folder, path) = file("bad.csv", text);
    let said = err(&slipwatch(&["replay", &path]).code(65));
    for part in [
        "bad.csv",
        "line 3",
        "\"displacement_mm\"",
        "\"abc\"",
        "expected",
    ] {
        assert!(said.contains(part), "{part} is not in: {said}");
    }
    slipwatch(&["replay", &vaiont(), "--benchmark", "6"]).code(65);
    slipwatch(&["replay", &vaiont(), "--until", "1900-01-01T00:00:00Z"]).code(65);
    slipwatch(&["convert", &path, "out.txt"]).code(65);
    slipwatch(&["convert", &path, "-"]).code(2);
}

#[test]
fn input_or_output_that_fails_is_74_and_the_cause_is_said_once() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.csv");
    let said = err(&slipwatch(&["replay", missing.to_str().unwrap()]).code(74));
    assert_eq!(said.matches("No such file").count(), 1, "{said}");
    let out = folder.path().join("no/such/folder/out.csv");
    slipwatch(&["convert", &vaiont(), out.to_str().unwrap()]).code(74);
}

#[test]
fn a_bad_config_is_78_and_every_problem_is_shown() {
    let (_folder, path) = file("site.toml", "[site]\nnamee = \"Toc\"\nstate_dir = 7\n");
    for args in [
        &["check", &path] as &[&str],
        &["run", &path],
        &["replay", &vaiont(), "--config", &path],
    ] {
        let said = err(&slipwatch(args).code(78));
        assert!(
            said.contains("namee") && said.contains("state_dir"),
            "{said}"
        );
        assert!(said.contains("site.toml:3:"), "{said}");
    }
    let shown = out(&slipwatch(&["check", &path, "--format", "json"]).code(78));
    let shown: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert!(shown["problems"].as_array().unwrap().len() >= 2, "{shown}");
    slipwatch(&["run", "/no/such/site.toml"]).code(78);
}

#[test]
fn the_sample_config_is_right() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/example.toml");
    let done = slipwatch(&["check", "--config-only", config.to_str().unwrap()]).success();
    assert!(out(&done).starts_with("ok: "), "{}", out(&done));
}

/// The rows of a CSV without its header.
fn rows(text: &str) -> Vec<Vec<Option<f64>>> {
    let cell = |cell: &str| (!cell.is_empty()).then(|| cell.parse().unwrap());
    let lines = text.lines().skip(1);
    lines
        .map(|line| line.split(',').map(cell).collect())
        .collect()
}

#[test]
fn simulate_meets_the_reference_solutions() {
    let mut laws: BTreeMap<(&str, &str), Vec<Vec<&str>>> = BTreeMap::new();
    for line in include_str!("../reference/slider_block.csv")
        .lines()
        .skip(1)
    {
        let row: Vec<&str> = line.split(',').collect();
        let well_conditioned = (8..10).all(|at| row[at].parse::<f64>().unwrap() < 1e6);
        if well_conditioned {
            laws.entry((row[0], row[1])).or_default().push(row);
        }
    }
    assert!(laws.len() > 10, "{} laws", laws.len());
    for ((m, x_i), wanted) in laws {
        let times: Vec<&str> = wanted.iter().map(|row| row[2]).collect();
        let args = [
            "simulate",
            "--m",
            m,
            "--x-i",
            x_i,
            "--times",
            &times.join(","),
        ];
        let text = out(&slipwatch(&args).success());
        assert_eq!(text.lines().next().unwrap(), "t,x,velocity,displacement");
        let got = rows(&text);
        assert_eq!(got.len(), wanted.len());
        for (got, wanted) in got.iter().zip(&wanted) {
            for (column, at) in [(1, 4), (2, 5), (3, 6)] {
                let want: f64 = wanted[at].parse().unwrap();
                let ratio = got[column].unwrap() / want;
                assert!(
                    (ratio - 1.0).abs() < 1e-9,
                    "{m} {x_i}: {got:?} not {wanted:?}"
                );
            }
        }
    }
}

/// The base of these: m = 1, y = 1 - 0.25 t at rest, v = 3 / y.
const HYPERBOLA: [&str; 7] = [
    "simulate",
    "--s-theta",
    "1.5",
    "--t-unit-days",
    "2",
    "--scale",
    "3",
];
const TIMES: [&str; 2] = ["--times", "2,1,0"];

#[test]
fn simulate_follows_a_load_from_a_file() {
    let (_folder, path) = file("load.csv", "days,log_load\n0,0\n1,0\n1,0.5\n");
    let text = out(&slipwatch(&[&HYPERBOLA[..], &TIMES, &["--load", &path]].concat()).success());
    let got = rows(&text);
    let steady = rows(&out(
        &slipwatch(&[&HYPERBOLA[..], &TIMES].concat()).success()
    ));
    // Before the step nothing differs; on it the velocity is up by e^0.5, and the slip is the same.
    assert_eq!(got[2], steady[2]);
    let ratio = |k: usize| got[1][k].unwrap() / steady[1][k].unwrap();
    assert!((ratio(2) - 0.5_f64.exp()).abs() < 1e-12 && (ratio(3) - 1.0).abs() < 1e-12);
    // Then dy/dt = 0.5 - 0.75 e^0.5.
    let y = 0.75 + 0.5 - 0.75 * 0.5_f64.exp();
    let fast = 3.0 * 0.5_f64.exp() / y;
    assert!((got[0][2].unwrap() / fast - 1.0).abs() < 1e-12);
}

#[test]
fn a_load_that_cannot_be_read_is_said_with_its_place() {
    for (text, parts) in [
        ("days,log_load\n0,0\n1,x\n", ["line 3", "log_load", "\"x\""]),
        ("days,log_load\n2,0\n1,0\n", ["line 3", "days", "\"1\""]),
        (
            "days,log_load\n2\n",
            ["line 2", "found 1 field", "expected 2"],
        ),
        ("t,f\n2,0\n", ["line 1", "t,f", "days,log_load"]),
        ("days,log_load\n", ["load.csv", "no row", "expected"]),
    ] {
        let (_folder, path) = file("load.csv", text);
        let done = slipwatch(&[&HYPERBOLA[..], &TIMES, &["--load", &path]].concat()).code(65);
        for part in parts {
            assert!(err(&done).contains(part), "{text:?}: {}", err(&done));
        }
    }
    let done =
        slipwatch(&[&HYPERBOLA[..], &TIMES, &["--load", "/nowhere/load.csv"]].concat()).code(74);
    assert!(err(&done).contains("/nowhere/load.csv"));
}

#[test]
fn simulate_has_nothing_to_say_from_the_singularity_on() {
    let args = [&HYPERBOLA as &[&str], &["--times", "0,1,4,5"]].concat();
    let text = out(&slipwatch(&args).success());
    let got = rows(&text);
    assert_eq!(got[0], [Some(0.0), Some(1.0), Some(3.0), Some(0.0)]);
    // y = 1 - (S theta_i - 1) t / theta_i
    assert!((got[1][2].unwrap() - 3.0 / 0.75).abs() < 1e-12);
    assert_eq!(got[2][1..], [None; 3]);
    assert_eq!(got[3][1..], [None; 3]);
    let json = out(&slipwatch(&[&args as &[&str], &["--format", "json"]].concat()).success());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["failure_days"], 4.0);
    assert_eq!(json["rows"][1]["velocity"], 4.0);
    assert!(json["rows"][2]["velocity"].is_null());
}

#[test]
fn a_file_converted_there_and_back_is_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (first, packed, second) = (path("first.csv"), path("packed.mcap"), path("second.csv"));
    slipwatch(&["convert", &vaiont(), &first]).success();
    slipwatch(&["convert", &first, &packed]).success();
    let done = slipwatch(&["convert", &packed, &second, "--format", "json"]).success();
    assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
    let report: serde_json::Value = serde_json::from_str(&out(&done)).unwrap();
    assert_eq!(report["series"][0]["benchmark"], "5");
}

#[test]
fn red_looks_twice_the_evacuation_time_ahead_or_as_far_as_the_config_says() {
    let hours = |alert: &str| -> f64 {
        let text = format!(
            "[site]\nname = \"Preonzo\"\nstate_dir = \"state\"\n[[source]]\nid = \"a\"\nkind = \"mcap\"\npath = \"*.mcap\"\n[alert]\n{alert}\n"
        );
        let (_folder, config) = file("site.toml", &text);
        let preonzo = recording("preonzo-2012.mcap");
        let replay = ["replay", &preonzo, "--benchmark", "E3", "--config", &config];
        let said = out(&slipwatch(&[&replay[..], &["--format", "json"]].concat()).success());
        let events = said.lines().map(|line| serde_json::from_str(line).unwrap());
        let called: Vec<serde_json::Value> = events
            .filter_map(|event: serde_json::Value| event.get("called").cloned())
            .collect();
        let last = &called[called.len() - 1]["red"];
        assert_eq!(last["at_least"], 0.27);
        last["within_hours"].as_f64().unwrap()
    };
    // A day to the next reading.
    assert!((hours("evacuation_time = \"12h\"") - 48.0).abs() < 0.1);
    let given = hours("evacuation_time = \"12h\"\nred_within = \"36h\"");
    assert!((given - 60.0).abs() < 0.1, "{given}");
}

#[test]
fn a_replay_is_the_same_bytes_twice_and_at_any_speed() {
    let vaiont = vaiont();
    let replay = ["replay", &vaiont, "--format", "json", "--benchmark", "5"];
    let first = out(&slipwatch(&replay).success());
    assert_eq!(out(&slipwatch(&replay).success()), first);
    // 67 days in about a third of a second.
    let paced = [&replay as &[&str], &["--speed", "2e7"]].concat();
    assert_eq!(out(&slipwatch(&paced).success()), first);
    let last = first.lines().last().unwrap();
    let summary: serde_json::Value = serde_json::from_str(last).unwrap();
    assert_eq!(summary["event"], "summary");
    assert!(first.ends_with('\n'));
}

#[test]
fn a_replay_as_text_ends_with_velocity_level_and_forecast_as_marks_in_eighty_columns() {
    let said = out(&slipwatch(&["replay", &vaiont(), "--benchmark", "63"]).success());
    let (_, marks) = said.split_once("\n63 ").unwrap();
    let rows: Vec<&str> = marks.lines().skip(1).collect();
    for (row, name) in rows.iter().zip(["velocity", "level", "forecast"]) {
        assert!(row.starts_with(name) && row.chars().count() <= 80, "{row}");
    }
    assert!(rows[1].contains('r'), "{marks}");
    let json =
        out(&slipwatch(&["replay", &vaiont(), "--benchmark", "63", "--format", "json"]).success());
    assert!(
        !json.contains("velocity  "),
        "as JSON there are events alone"
    );
}

#[test]
fn a_replay_in_eighty_columns_has_every_word_of_the_other_and_no_longer_line() {
    let plain = out(&slipwatch(&["replay", &vaiont()]).success());
    let narrow = out(&slipwatch(&["replay", &vaiont(), "--width", "80"]).success());
    assert!(plain.lines().any(|line| line.chars().count() > 80));
    let longest = narrow.lines().map(|line| line.chars().count()).max();
    assert!(longest.is_some_and(|columns| columns <= 80), "{longest:?}");
    assert!(plain.split_whitespace().eq(narrow.split_whitespace()));
    let said = err(&slipwatch(&["replay", &vaiont(), "--width", "8"]).code(2));
    assert!(said.contains("--width") && said.contains("40"), "{said}");
}

#[test]
fn a_replay_up_to_a_time_is_the_beginning_of_the_whole_one() {
    let vaiont = vaiont();
    let replay = ["replay", &vaiont, "--format", "json", "--benchmark", "5"];
    let whole = out(&slipwatch(&replay).success());
    let until = [&replay as &[&str], &["--until", "1963-09-20T12:00:00Z"]].concat();
    let part = out(&slipwatch(&until).success());
    let (events, summary) = part
        .trim_end()
        .rsplit_once('\n')
        .unwrap_or(("", part.trim_end()));
    assert!(whole.starts_with(events));
    assert!(summary.contains("\"summary\""), "{summary}");
}

#[test]
fn a_replay_notifies_the_hooks_that_it_is_an_exercise_and_of_every_alert() {
    let folder = tempfile::tempdir().unwrap();
    let (config, _) = site(folder.path());
    let mut text = fs::read_to_string(&config).unwrap();
    text.push_str("[[hook]]\nrun = [\"/bin/sh\", \"hook.sh\"]\nlevels = [\"orange\", \"red\"]\n");
    fs::write(&config, text).unwrap();
    let script = "echo $SLIPWATCH_LEVEL $SLIPWATCH_STATUS >> reported\n";
    fs::write(folder.path().join("hook.sh"), script).unwrap();
    let (vaiont, config) = (vaiont(), config.to_str().unwrap());
    let args = [
        "replay", &vaiont, "--format", "json", "--hooks", "--config", config,
    ];
    let said = out(&slipwatch(&args).success());
    let events = said.lines().map(|line| serde_json::from_str(line).unwrap());
    let alerts = events.filter(|event: &serde_json::Value| event["event"] == "alert");
    // The whole site's are for hooks that ask for them.
    let alerts = alerts.filter(|event| event["benchmark"].is_string());
    let mut levels: Vec<String> = alerts
        .map(|alert| alert["level"].as_str().unwrap().to_owned())
        .filter(|level| level == "orange" || level == "red")
        .map(|level| format!("{level} Exercise"))
        .collect();
    let reported = fs::read_to_string(folder.path().join("reported")).unwrap_or_default();
    let mut reported: Vec<String> = reported.lines().map(str::to_owned).collect();
    levels.sort();
    reported.sort();
    assert!(!levels.is_empty());
    assert_eq!(reported, levels);
    assert!(!folder.path().join("state").exists());
    // A hook that fails is trouble, and the events are the same.
    fs::write(folder.path().join("hook.sh"), "exit 3\n").unwrap();
    assert_eq!(out(&slipwatch(&args).code(1)), said);
}

#[test]
fn disorder_in_the_data_is_a_warning() {
    let text = "time,displacement_mm\n2020-01-02T00:00:00Z,1\n2020-01-01T00:00:00Z,2\n\
                2020-01-02T00:00:00Z,1\n2020-01-01T00:00:00Z,3\n";
    let (_folder, path) = file("a.csv", text);
    let said = err(&slipwatch(&["replay", &path]).success());
    for part in [
        "values that repeated an earlier one: 1",
        "values that gave another value for a time already read: 1",
        "values that stood before an earlier time: 2",
    ] {
        assert!(said.contains(part), "{part} is not in: {said}");
    }
}

#[test]
fn a_reader_that_has_gone_ends_it_quietly() {
    let vaiont = vaiont();
    for args in [
        &["replay", &vaiont] as &[&str],
        &["replay", &vaiont, "--format", "json"],
        &["simulate", "--m", "2", "--x-i", "2", "--times", "1"],
        &["--help"],
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let done = std::process::Command::new(PROGRAM)
            .args(args)
            .stdout(writer)
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!(
            (done.status.code(), said.as_str()),
            (Some(0), ""),
            "{args:?}"
        );
    }
}

/// A running daemon, killed when the test fails, and the lines of its log.
struct Daemon {
    child: Child,
    log: Receiver<String>,
}

impl Daemon {
    fn start(config: &Path) -> Self {
        let mut child = std::process::Command::new(PROGRAM)
            .args(["run", "--log", "json"])
            .arg(config)
            .env_remove("RUST_LOG")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        let (sender, log) = mpsc::channel();
        std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        Self { child, log }
    }

    /// The next line of the log with `what` in it.
    fn until(&self, what: &str) -> String {
        let next = || self.log.recv_timeout(LIMIT).unwrap();
        std::iter::repeat_with(next)
            .find(|line| line.contains(what))
            .unwrap()
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A site that reads `incoming/*.csv`, where `logger.csv` holds 30 days of a slow creep.
fn site(folder: &Path) -> (PathBuf, PathBuf) {
    fs::create_dir(folder.join("incoming")).unwrap();
    let readings = folder.join("incoming/logger.csv");
    let mut text = "time,displacement_mm\n".to_owned();
    for day in 1..=30 {
        let slip = f64::from(day) * 0.5 + f64::from(day % 3) * 0.01;
        writeln!(text, "2020-01-{day:02}T00:00:00Z,{slip}").unwrap();
    }
    fs::write(&readings, text).unwrap();
    let config = folder.join("site.toml");
    let text = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n";
    fs::write(&config, text).unwrap();
    (config, readings)
}

#[test]
fn sigterm_ends_a_daemon_that_follows_a_growing_file_and_its_events_are_those_of_a_replay() {
    let folder = tempfile::tempdir().unwrap();
    let (config, readings) = site(folder.path());
    let before =
        out(&slipwatch(&["replay", readings.to_str().unwrap(), "--format", "json"]).success());
    let mut daemon = Daemon::start(&config);
    daemon.until("caught up");
    let mut growing = OpenOptions::new().append(true).open(&readings).unwrap();
    // Values are taken by time: once the one from the future is refused, the other is in.
    write!(
        growing,
        "2020-02-01T00:00:00Z,16\n2200-01-01T00:00:00Z,17\n"
    )
    .unwrap();
    daemon.until("measured in the future");
    let (said, _summary) = before.trim_end().rsplit_once('\n').unwrap_or_default();
    let said: Vec<&str> = said.lines().collect();
    let mut events = String::new();
    // The refits of the past are made when nothing else waits.
    for _ in 0..3000 {
        events = events_of(&config);
        if said.iter().all(|one| events.contains(one)) {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    kill(
        Pid::from_raw(i32::try_from(daemon.child.id()).unwrap()),
        Signal::SIGTERM,
    )
    .unwrap();
    let stopped = daemon.until("\"stopped\"");
    assert_eq!(daemon.child.wait().unwrap().code(), Some(0));
    assert!(stopped.contains("\"taken\":31,"), "{stopped}");
    // What is current is judged first: the events of a replay, in the order of their times. That nothing came between
    // the last of them and the reading after it is a matter of this daemon's clock.
    let mut by_time: Vec<&str> = events.lines().collect();
    by_time.sort_by_key(|line| time_of(line));
    assert!(
        by_time.starts_with(&said),
        "{by_time:?}\n does not begin with\n{said:?}"
    );
}

/// The events of a daemon's state, as JSON.
fn events_of(config: &Path) -> String {
    let config = config.to_str().unwrap();
    let asked = slipwatch(&["events", "--config", config, "--format", "json"]).success();
    String::from_utf8(asked.get_output().stdout.clone()).unwrap()
}

fn time_of(event: &str) -> String {
    let event: serde_json::Value = serde_json::from_str(event).unwrap();
    event["time"].as_str().unwrap().to_owned()
}

#[test]
fn a_second_daemon_on_the_same_state_folder_is_74() {
    let folder = tempfile::tempdir().unwrap();
    let (config, _) = site(folder.path());
    let daemon = Daemon::start(&config);
    daemon.until("caught up");
    slipwatch(&["run", config.to_str().unwrap()]).code(74);
}

#[test]
#[cfg_attr(feature = "parquet", ignore = "this build writes it")]
fn a_build_without_parquet_says_how_to_build_one_with_it() {
    let file = "recordings/preonzo-2012.mcap";
    let refused = slipwatch(&["replay", file, "--format", "parquet"]).code(2);
    let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(
        said.contains("cargo build --release --features parquet"),
        "{said}"
    );
    assert!(refused.get_output().stdout.is_empty());
}
