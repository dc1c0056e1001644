//! A site in a folder of its own, and the program at work on it.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use slipwatch::reading::Timestamp;
use slipwatch::store::Store;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
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

/// A folder with a site that reads `incoming/*.csv` and `incoming/*.mcap`, and a hook that notes the keys it is told.
pub(crate) struct Site(pub(crate) TempDir);

impl Site {
    pub(crate) fn new(more: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("incoming")).unwrap();
        fs::write(
            folder.path().join("hook.sh"),
            "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> told\n",
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

    pub(crate) fn printed(&self, words: &[&str]) -> String {
        let output = self.ask(words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{words:?}: {said}");
        String::from_utf8(output.stdout).unwrap()
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

    /// How it ends by itself.
    pub(crate) fn end(mut self) -> Option<i32> {
        self.0.wait().unwrap().code()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether `strace` is there and may trace.
pub(crate) fn has_strace() -> bool {
    has(&["strace", "-o", "/dev/null", "true"])
}

/// Whether a command goes well; says so where not.
pub(crate) fn has(words: &[&str]) -> bool {
    let status = Command::new(words[0])
        .args(&words[1..])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    let is_there = status.is_ok_and(|status| status.success());
    if !is_there {
        let _ = writeln!(std::io::stderr(), "skipped: {words:?} does not work here");
    }
    is_there
}
