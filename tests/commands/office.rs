//! A person's folder on the first day at a site: files, the program, its daemon.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
pub(crate) const PAUSE: Duration = Duration::from_millis(200);
pub(crate) const ATTEMPTS: usize = 300;

/// A folder to stand in.
pub(crate) struct Office {
    pub(crate) folder: TempDir,
}

impl Office {
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        let office = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        for (name, text) in files {
            fs::write(office.path(name), text).unwrap();
        }
        office
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(args).current_dir(self.folder.path());
        command
    }

    /// Exit code, stdout and stderr.
    pub(crate) fn say(&self, args: &[&str]) -> (i32, String, String) {
        ended(&self.command(args).output().unwrap())
    }

    /// What it says on stderr, when it must exit with this.
    pub(crate) fn refused(&self, code: i32, args: &[&str]) -> String {
        let (exit, out, err) = self.say(args);
        assert_eq!(exit, code, "{args:?}: {out}{err}");
        err
    }

    /// What it says on stdout, when it must succeed.
    pub(crate) fn done(&self, args: &[&str]) -> String {
        let (exit, out, err) = self.say(args);
        assert_eq!(exit, 0, "{args:?}: {out}{err}");
        out
    }

    pub(crate) fn run(&self, args: &[&str]) -> Daemon {
        let mut command = self.command(args);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        Daemon(command.spawn().unwrap())
    }

    /// The same with its log in a file.
    pub(crate) fn run_logged(&self, args: &[&str]) -> Daemon {
        let log = fs::File::create(self.path("log.txt")).unwrap();
        let mut command = self.command(args);
        command.stdout(Stdio::null()).stderr(Stdio::from(log));
        Daemon(command.spawn().unwrap())
    }

    pub(crate) fn log(&self) -> String {
        fs::read_to_string(self.path("log.txt")).unwrap()
    }

    /// Waits until something is so.
    pub(crate) fn until(&self, what: &str, is_so: impl Fn() -> bool) {
        for _ in 0..ATTEMPTS {
            if is_so() {
                return;
            }
            std::thread::sleep(PAUSE);
        }
        let (_, out, err) = self.say(&["status", "--config", "site.toml"]);
        panic!("{what}: not seen; {out}{err}");
    }

    /// Waits for a text in what `status` says.
    pub(crate) fn status_until(&self, wanted: &str) -> String {
        let mut said = String::new();
        for _ in 0..ATTEMPTS {
            let (_, out, err) = self.say(&["status", "--config", "site.toml"]);
            if out.contains(wanted) {
                return out;
            }
            said = format!("{out}{err}");
            std::thread::sleep(PAUSE);
        }
        panic!("no {wanted:?} in {said}");
    }
}

pub(crate) struct Daemon(pub(crate) Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn ended(output: &Output) -> (i32, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// So many hourly rows from 2017-06-01 00:00 in Rome, each as `row` writes it.
pub(crate) fn rows(count: i64, row: impl Fn(jiff::civil::DateTime, f64) -> String) -> String {
    let start = jiff::civil::date(2017, 6, 1).at(0, 0, 0, 0);
    let rows = (0..count).map(|hour| {
        let time = start
            .checked_add(jiff::SignedDuration::from_hours(hour))
            .unwrap();
        row(time, 0.5 * hour as f64)
    });
    rows.collect()
}

pub(crate) fn plain(count: i64) -> String {
    let body = rows(count, |time, value| format!("{time}+02:00,{value}\n"));
    format!("time,P1_displacement_mm\n{body}")
}

pub(crate) fn site(path: &str, more: &str) -> String {
    format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"logger\"\nkind = \"csv\"\npath = {path:?}\n{more}"
    )
}
