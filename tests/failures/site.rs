//! A site in a folder of its own, and the program at work on it.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use slipwatch::reading::Timestamp;
use slipwatch::store::Store;
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
const LOOKS: usize = 3000;

/// Waits until `claim` holds; how long that takes is not what is tested.
pub(crate) fn eventually(what: &str, mut claim: impl FnMut() -> bool) {
    for _ in 0..LOOKS {
        if claim() {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("never: {what}");
}

/// What the daemon answers, its head too.
pub(crate) fn get(address: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

/// A folder with a site that reads `incoming/*.csv` and `incoming/*.mcap`, and a hook that writes the keys it receives.
pub(crate) struct Site(pub(crate) TempDir);

impl Site {
    pub(crate) fn new(more: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("incoming")).unwrap();
        fs::write(
            folder.path().join("hook.sh"),
            "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\n",
        )
        .unwrap();
        let site = Self(folder);
        site.configure(more);
        site
    }

    pub(crate) fn configure(&self, more: &str) {
        let text = format!(
            "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
             [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
             [[source]]\nid = \"recorder\"\nkind = \"mcap\"\npath = \"incoming/*.mcap\"\n{more}\
             [[hook]]\nrun = [\"/bin/sh\", \"hook.sh\"]\n\
             levels = [\"yellow\", \"orange\", \"red\", \"unknown\"]\n"
        );
        fs::write(self.path("site.toml"), text).unwrap();
    }

    /// Has it answer questions; where.
    pub(crate) fn listen(&self) -> String {
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = free.local_addr().unwrap().to_string();
        let text = fs::read_to_string(self.path("site.toml")).unwrap();
        let text = text.replacen(
            "state_dir",
            &format!("listen = \"{address}\"\nstate_dir"),
            1,
        );
        fs::write(self.path("site.toml"), text).unwrap();
        address
    }

    /// How many notices of alerts whose key begins so, and whose state ends so, the hook has written.
    pub(crate) fn notified(&self, begins: &str, ends: &str) -> usize {
        let lines = self.lines("notified");
        let is_it = |line: &&String| line.starts_with(begins) && line.ends_with(ends);
        lines.iter().filter(is_it).count()
    }

    /// Waits until the hook has been notified that benchmark 5 is red.
    pub(crate) fn awaits_red(&self) {
        eventually("that the red is notified", || {
            self.notified("5/red/", "") > 0
        });
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn append(&self, name: &str, text: &str) {
        let mut file = (OpenOptions::new().create(true).append(true))
            .open(self.path(name))
            .unwrap();
        file.write_all(text.as_bytes()).unwrap();
    }

    pub(crate) fn lines(&self, name: &str) -> Vec<String> {
        let text = fs::read_to_string(self.path(name)).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    pub(crate) fn log(&self) -> String {
        fs::read_to_string(self.path("log")).unwrap_or_default()
    }

    /// Starts the daemon under `strace`, which answers the `calls` with what `injected` says.
    pub(crate) fn start_traced(&self, calls: &str, injected: &str) -> Program {
        let (trace, inject) = (
            format!("trace={calls}"),
            format!("inject={calls}:{injected}"),
        );
        let quietly = ["strace", "-f", "-qq", "-D", "-o", "/dev/null"];
        self.start(&[&quietly[..], &["-e", &trace, "-e", &inject]].concat())
    }

    /// Starts the daemon, behind `before`.
    pub(crate) fn start(&self, before: &[&str]) -> Program {
        let words: Vec<&str> = (before.iter().copied())
            .chain([PROGRAM, "run", "site.toml"])
            .collect();
        let child = Command::new(words[0])
            .args(&words[1..])
            .current_dir(self.0.path())
            .env_remove("RUST_LOG")
            .stdout(Stdio::null())
            .stderr(File::create(self.path("log")).unwrap())
            .spawn()
            .unwrap();
        Program(child)
    }

    /// Starts it and waits until it has read the past.
    pub(crate) fn caught_up(&self) -> Program {
        let mut program = self.start(&[]);
        eventually("caught up", || {
            assert!(program.ended().is_none(), "{}", self.log());
            self.log().contains("caught up")
        });
        program
    }

    /// Runs the program to its end.
    pub(crate) fn ask(&self, words: &[&str]) -> Output {
        Command::new(PROGRAM)
            .args(words)
            .current_dir(self.0.path())
            .env_remove("RUST_LOG")
            .output()
            .unwrap()
    }

    /// What `check` says of the config where the first hook is notified of unknown alone; the config stays as it was.
    pub(crate) fn checked_with_a_first_hook_for_unknown(&self) -> String {
        let text = fs::read_to_string(self.path("site.toml")).unwrap();
        let only = text.replace(
            "\"yellow\", \"orange\", \"red\", \"unknown\"",
            "\"unknown\"",
        );
        fs::write(self.path("site.toml"), only).unwrap();
        let output = self.ask(&["check", "--config-only", "site.toml"]);
        fs::write(self.path("site.toml"), text).unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr)
    }

    pub(crate) fn printed(&self, words: &[&str]) -> String {
        let output = self.ask(words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{words:?}: {said}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Acknowledges what is called at a benchmark, in somebody's name.
    pub(crate) fn acknowledge(&self, benchmark: &str, by: &str) {
        let of = ["alerts", "ack", "--benchmark", benchmark];
        let config = ["--by", by, "--config", "site.toml"];
        self.printed(&[of, config].concat());
    }

    /// The level in force at a benchmark.
    pub(crate) fn level(&self, benchmark: &str) -> String {
        let text = self.printed(&["status", "--config", "site.toml", "--format", "json"]);
        let status: Value = serde_json::from_str(&text).unwrap();
        let all = status["benchmarks"].as_array().unwrap();
        let one = all.iter().find(|one| one["benchmark"] == benchmark);
        one.unwrap()["level"].as_str().unwrap().to_owned()
    }

    /// The event log.
    pub(crate) fn events(&self) -> String {
        self.printed(&["events", "--config", "site.toml", "--format", "json"])
    }

    /// The event log, and that it follows from the stored input, byte for byte.
    pub(crate) fn proven_events(&self) -> String {
        let events = self.events();
        let replayed = self.printed(&["replay", "--state", "state", "--format", "json"]);
        let (replayed, _summary) = replayed.trim_end().rsplit_once('\n').unwrap_or_default();
        assert!(
            events.trim_end() == replayed,
            "the event log is not that of its steps"
        );
        events
    }

    /// The values that stand in the state: benchmark, time, value; sorted.
    pub(crate) fn values(&self) -> Vec<(String, Timestamp, f64)> {
        values(&self.path("state"))
    }
}

/// The values in a state folder, sorted.
pub(crate) fn values(state: &Path) -> Vec<(String, Timestamp, f64)> {
    let Ok(store) = Store::look(state) else {
        return Vec::new();
    };
    let (mut values, mut after) = (Vec::new(), 0);
    loop {
        let rows = store.steps(after).unwrap();
        let Some(last) = rows.last() else { break };
        after = last.seq;
        values.extend(rows.into_iter().filter_map(|row| match row.input {
            slipwatch::monitor::Input::Reading {
                benchmark, reading, ..
            } => Some((benchmark.to_string(), reading.time, reading.value)),
            _ => None,
        }));
    }
    values.sort_by(|one, other| {
        (&one.0, one.1)
            .cmp(&(&other.0, other.1))
            .then(one.2.total_cmp(&other.2))
    });
    values
}

/// The program at work; ended with the test.
pub(crate) struct Program(pub(crate) Child);

impl Program {
    pub(crate) fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(i32::try_from(self.0.id()).unwrap()), signal).unwrap();
    }

    /// Its exit code, if it has ended; `None` within where a signal did that.
    pub(crate) fn ended(&mut self) -> Option<Option<i32>> {
        self.0.try_wait().unwrap().map(|status| status.code())
    }

    pub(crate) fn stop(mut self) {
        self.signal(Signal::SIGTERM);
        assert_eq!(self.0.wait().unwrap().code(), Some(0));
    }

    /// Asks it to end, however it does.
    pub(crate) fn let_go(mut self) {
        self.signal(Signal::SIGTERM);
        self.0.wait().unwrap();
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Has `strace` change what the system answers to `program` from now on, until it is stopped.
pub(crate) fn tamper(site: &Site, program: &Program, words: &[&str]) -> Program {
    let said = site.path("strace");
    let id = program.0.id().to_string();
    let tracer = Command::new("strace")
        .args(["-f", "-o", "/dev/null", "-p", &id])
        .args(words)
        .current_dir(site.0.path())
        .stderr(File::create(&said).unwrap())
        .spawn();
    let mut tracer = Program(tracer.unwrap());
    let is_attached = || fs::read_to_string(&said).unwrap().contains("attached");
    eventually("strace's answer", || {
        is_attached() || tracer.ended().is_some()
    });
    assert!(is_attached(), "{}", fs::read_to_string(&said).unwrap());
    tracer
}

/// Whether this is a run that has mounts of its own. Where it is not, makes such a run of `test`.
pub(crate) fn has_own_mounts(test: &str) -> bool {
    const INSIDE: &str = "SLIPWATCH_OWN_MOUNTS";
    if std::env::var_os(INSIDE).is_some() {
        return true;
    }
    let (root, user): (&[&str], &[&str]) = (&["unshare", "-m"], &["unshare", "-Urm"]);
    let mount = ["mount", "-t", "tmpfs", "tmpfs", "/mnt"];
    let mut ways = [root, user].into_iter();
    let how = ways.find(|how| has(&[*how, &mount[..]].concat()));
    let how = how.expect("mounts of its own");
    let run = Command::new(how[0])
        .args(&how[1..])
        .arg(std::env::current_exe().unwrap())
        .args([test, "--exact", "--nocapture"])
        .env(INSIDE, "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout) + String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && said.contains("1 passed"), "{said}");
    false
}

/// Runs a command that must go well.
pub(crate) fn command(words: &[&str]) {
    assert!(has(words), "{words:?}");
}

/// Whether a command goes well.
fn has(words: &[&str]) -> bool {
    let status = Command::new(words[0])
        .args(&words[1..])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}
