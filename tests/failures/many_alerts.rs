//! 19: everything moves at once.

use crate::site::{Site, eventually};
use std::collections::BTreeSet;
use std::fs;

/// Benchmarks of one file.
const COLUMNS: usize = 300;

/// Readings up to now of the benchmarks of one file, which all run away.
fn run_away(file: usize) -> String {
    let now = slipwatch::runtime::clock::now();
    let mut text = "time".to_owned();
    for number in 0..COLUMNS {
        text += &format!(",p{file:02}{number:03}_displacement_mm");
    }
    text.push('\n');
    for row in 0..6_i32 {
        let time = now - jiff::SignedDuration::from_mins(i64::from(6 - row));
        text += &time.to_string();
        for number in 0..COLUMNS {
            text += &format!(",{}", f64::from(row * row) * 10.0 + number as f64 * 1e-3);
        }
        text.push('\n');
    }
    text
}

/// 19.
#[test]
fn alerts_of_very_many_benchmarks_at_once_are_reported_in_few_messages_and_none_again_after_a_restart()
 {
    all_at_once(1);
}

/// 19.
#[test]
fn alerts_of_ten_thousand_benchmarks_at_once_are_reported_in_few_messages() {
    all_at_once(34);
}

fn all_at_once(files: usize) {
    let benchmarks = files * COLUMNS;
    let policy = "[alert]\nevacuation_time = \"1h\"\n\
                  [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";
    let site = Site::new(policy);
    for file in 0..files {
        site.append(&format!("incoming/{file}.csv"), &run_away(file));
    }
    let program = site.caught_up();
    let together = || {
        let notified = site.lines("notified");
        notified
            .iter()
            .filter(|line| line.starts_with("flood/"))
            .count()
    };
    eventually("the message that reports many", || together() > 0);
    let events = site.events();
    let reds = events
        .matches("\"level\":\"red\",\"state\":\"firing\"")
        .count();
    assert!(reds >= benchmarks, "{reds}");
    program.stop();
    let notified = site.lines("notified");
    // Of each commit, level and state ten and one; the past comes in few commits.
    assert!(
        notified.len() < 15 + benchmarks / 50,
        "{} messages",
        notified.len()
    );
    site.caught_up().stop();
    let again: Vec<String> = site.lines("notified").split_off(notified.len());
    assert!(again.is_empty(), "{again:?}");
    site.proven_events();
}

/// 24 benchmarks go red in three groups, each of which is reported singly, and end at once.
#[test]
fn whoever_received_beginnings_singly_receives_each_end_by_its_key_however_many_end_at_once() {
    let policy = "[[cap]]\nfolder = \"cap\"\nsender = \"toc@example.org\"\narea = \"Toc\"\nlevels = [\"red\"]\n\
                  [alert]\nevacuation_time = \"1h\"\n\
                  [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";
    let site = Site::new(policy);
    fs::create_dir(site.path("cap")).unwrap();
    let program = site.caught_up();
    let firing = |site: &Site| site.notified("p", "firing");
    for group in 0..3_usize {
        let text = run_away(group);
        let eight = text.lines().map(|line| {
            let cells: Vec<&str> = line.split(',').take(9).collect();
            cells.join(",") + "\n"
        });
        site.append(&format!("incoming/{group}.csv"), &eight.collect::<String>());
        eventually("the group's reds", || firing(&site) == 8 * (group + 1));
    }
    let by = ["--why", "a test", "--by", "Ada", "--config", "site.toml"];
    site.printed(&[&["alerts", "resolve", "--all"][..], &by].concat());
    eventually("all ends", || site.notified("p", "resolved") == 24);
    let cancels = || {
        let files = fs::read_dir(site.path("cap")).unwrap();
        let texts = files.filter_map(|file| fs::read_to_string(file.unwrap().path()).ok());
        let is_cancel = |text: &String| text.contains("<msgType>Cancel</msgType>");
        texts.filter(is_cancel).count()
    };
    eventually("all of CAP", || cancels() == 24);
    program.stop();
    let keys = |state: &str| -> BTreeSet<String> {
        let lines = site.lines("notified").into_iter();
        let of_state = lines.filter(|line| line.ends_with(state));
        let keys = of_state.map(|line| line.split(' ').next().unwrap().to_owned());
        keys.collect()
    };
    assert_eq!(keys("firing"), keys("resolved"));
    site.proven_events();
}
