//! How far a command has come: on a terminal, on stderr, and nowhere else.

use nix::pty::openpty;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

/// What a command says on stderr where that is a terminal, and where it is a file.
fn said(folder: &Path, words: &[&str]) -> (String, String) {
    let run = |stderr: Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_slipwatch"));
        command.args(words).current_dir(folder).env("TERM", "xterm");
        let status = command.stdout(Stdio::null()).stderr(stderr).status();
        assert!(status.unwrap().success(), "{words:?}");
    };
    let ends = openpty(None, None).unwrap();
    let mut seen = File::from(ends.master);
    let reader = std::thread::spawn(move || {
        let mut all = Vec::new();
        // A terminal whose last user has gone ends in an error.
        let _ = seen.read_to_end(&mut all);
        String::from_utf8_lossy(&all).into_owned()
    });
    run(ends.slave.into());
    let file = folder.join("stderr");
    run(File::create(&file).unwrap().into());
    (reader.join().unwrap(), fs::read_to_string(file).unwrap())
}

fn readings(count: i64) -> String {
    let row = |row: i64| {
        let time = jiff::Timestamp::from_second(1_577_836_800 + 600 * row).unwrap();
        format!("{time},{}\n", 0.01 * row as f64)
    };
    "time,displacement_mm\n".to_owned() + &(0..count).map(row).collect::<String>()
}

#[test]
fn convert_says_how_much_is_read_and_then_written() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("5.csv"), readings(300_000)).unwrap();
    for out in ["out.ndjson", "out.mcap"] {
        let (on_a_terminal, in_a_file) = said(folder.path(), &["convert", "5.csv", out]);
        assert!(on_a_terminal.contains(" %, "), "{on_a_terminal:?}");
        assert!(on_a_terminal.contains(" written, "), "{on_a_terminal:?}");
        assert_eq!(in_a_file, "");
    }
}

#[test]
fn a_replay_of_a_state_says_how_many_of_its_steps_are_done() {
    let folder = tempfile::tempdir().unwrap();
    let store = slipwatch::store::Store::open(&folder.path().join("state")).unwrap();
    let mut batch = slipwatch::store::Batch::default();
    for hour in 0..400 {
        let time = jiff::Timestamp::from_second(1_577_836_800 + 3600 * hour).unwrap();
        let input = slipwatch::monitor::Input::Sample {
            channel: "rain_mm".to_owned(),
            unit: None,
            sample: slipwatch::reading::Sample { time, value: 0.0 },
        };
        batch.step(time, &input, &[]);
    }
    store.commit(&batch).unwrap();
    drop(store);
    let words = ["replay", "--state", "state", "--format", "json"];
    let (on_a_terminal, in_a_file) = said(folder.path(), &words);
    assert!(on_a_terminal.contains(" %, "), "{on_a_terminal:?}");
    assert_eq!(in_a_file, "");
}
