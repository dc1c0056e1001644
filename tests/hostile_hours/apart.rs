//! Lives in processes of their own: this binary started again for one of its tests, with the seeds that it is to live.

use crate::life::{Seen, live_with};
use crate::people::Mood;
use std::ops::Range;
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};

/// The seeds, `FIRST..END`; set in a process that lives.
const SEEDS: &str = "HOSTILE_OWN_SEEDS";
/// Lives of one process at most.
const LIVES: u64 = 10;
/// Before what a life has seen, and before a seed that found something.
const SEEN: &str = "seen: ";
const FOUND: &str = "found by seed: ";

/// The seeds that this process is to live; `None` in the one that was started by hand.
pub(crate) fn own_seeds() -> Option<Range<u64>> {
    let seeds = std::env::var(SEEDS).ok()?;
    let (first, end) = seeds.split_once("..").unwrap();
    Some(first.parse().unwrap()..end.parse().unwrap())
}

/// Lives them one after the other, and says what each has seen.
pub(crate) fn live_all(seeds: Range<u64>, hook: &Mood) {
    for seed in seeds {
        match std::panic::catch_unwind(|| live_with(seed, hook.clone())) {
            Ok(seen) => println!("\n{SEEN}{}", serde_json::to_string(&seen).unwrap()),
            Err(_) => println!("\n{FOUND}{seed}"),
        }
    }
}

/// Lives these seeds in processes that run the test `name`, as many at once as there are cores.
///
/// # Panics
/// Where a seed has found something, with what was said of it.
pub(crate) fn live_in_processes(name: &str, seeds: Range<u64>) -> Seen {
    let next = AtomicU64::new(seeds.start);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let lives = LIVES.min((seeds.end - seeds.start).div_ceil(cores as u64));
    let work = || {
        let (mut seen, mut found) = (Seen::default(), Vec::new());
        loop {
            let first = next.fetch_add(lives, Ordering::Relaxed);
            if first >= seeds.end {
                return (seen, found);
            }
            let (more, failed) = live_apart(name, first..(first + lives).min(seeds.end));
            seen.add(&more);
            found.extend(failed);
        }
    };
    let results: Vec<(Seen, Vec<String>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        workers.into_iter().map(|one| one.join().unwrap()).collect()
    });
    let (mut seen, mut found) = (Seen::default(), Vec::new());
    for (more, failed) in results {
        seen.add(&more);
        found.extend(failed);
    }
    assert!(
        found.is_empty(),
        "seeds that found something:\n{}",
        found.join("\n")
    );
    seen
}

/// What the lives of one process have seen, and what was found.
fn live_apart(name: &str, seeds: Range<u64>) -> (Seen, Vec<String>) {
    let process = Command::new(std::env::current_exe().unwrap())
        .args([name, "--exact", "--nocapture"])
        .env(SEEDS, format!("{}..{}", seeds.start, seeds.end))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&process.stdout);
    let errors = String::from_utf8_lossy(&process.stderr);
    if std::env::var_os("HOSTILE_LOG").is_some() {
        println!("{said}\n{errors}");
    }
    let (mut seen, mut lived, mut found) = (Seen::default(), 0, Vec::new());
    for line in said.lines() {
        if let Some(own) = line.strip_prefix(SEEN) {
            seen.add(&serde_json::from_str(own).unwrap());
            lived += 1;
        } else if let Some(seed) = line.strip_prefix(FOUND) {
            found.push(seed.to_owned());
            lived += 1;
        }
    }
    if !found.is_empty() || lived < seeds.end - seeds.start {
        found.push(format!("of {seeds:?}, {}: {errors}", process.status));
    }
    (seen, found)
}
