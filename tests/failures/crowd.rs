//! 19: everything moves at once.

use crate::site::{Site, eventually};

const BENCHMARKS: usize = 300;

/// Readings up to now of many benchmarks that all run away.
fn run_away() -> String {
    let now = slipwatch::runtime::clock::now();
    let mut text = "time".to_owned();
    for number in 0..BENCHMARKS {
        text += &format!(",p{number:03}_displacement_mm");
    }
    text.push('\n');
    for row in 0..6_i32 {
        let time = now - jiff::SignedDuration::from_mins(i64::from(6 - row));
        text += &time.to_string();
        for number in 0..BENCHMARKS {
            text += &format!(",{}", f64::from(row * row) * 10.0 + number as f64 * 1e-3);
        }
        text.push('\n');
    }
    text
}

/// 19.
#[test]
fn alerts_of_very_many_benchmarks_at_once_are_told_in_few_messages_and_none_again_after_a_restart()
{
    let policy = "[alert]\nevacuation_time = \"1h\"\n\
                  [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";
    let site = Site::new(policy);
    site.append("incoming/all.csv", &run_away());
    let program = site.caught_up();
    let together = || {
        let told = site.lines("told");
        told.iter()
            .filter(|line| line.starts_with("flood/"))
            .count()
    };
    eventually("the message that tells of many", || together() > 0);
    let events = site.events();
    let reds = events
        .matches("\"level\":\"red\",\"state\":\"firing\"")
        .count();
    assert!(reds >= BENCHMARKS, "{reds}");
    program.stop();
    let told = site.lines("told");
    // Of each commit, level and state ten and one; the past comes in few commits.
    assert!(told.len() < BENCHMARKS / 2, "{} messages", told.len());
    site.caught_up().stop();
    let again: Vec<String> = site.lines("told").split_off(told.len());
    assert!(again.is_empty(), "{again:?}");
    site.proven_events();
}
