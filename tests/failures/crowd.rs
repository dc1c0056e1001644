//! 19: everything moves at once.

use crate::site::{Site, eventually};

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
    eventually("the message that tells of many", || together() > 0);
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
