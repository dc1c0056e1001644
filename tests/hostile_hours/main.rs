//! A daemon that lives through hours in which much goes wrong, by a plan that a seed draws, in simulated time.
//!
//! Real: the daemon's turns (`Daemon::take_batch`, `take_messages`, `tick`, `look_back`), the site and the monitor, the
//! follower and the files that it reads, the store in SQLite, the outbox and the dispatcher with its queues and retries.
//! Simulated: the host's clock (an argument) and the runtime's (tokio's, moved by hand), the runs of a hook (a task
//! instead of a process), the broker (messages decoded already, and their acknowledgements), the choice of the next turn
//! (`Daemon::work` waits for real events), and a kill (the daemon is dropped between two turns; `tests/failures/killed.rs`
//! kills real processes at any system call). The full disk is a limit on the length of files.
//!
//! In each life three benchmarks meet with trouble of their own, and a fourth with none but what the machine has. Three
//! properties are held:
//!
//! 1. What could be read is in the state once, when the trouble is over.
//! 2. Where red was due, people have received red, or `unknown` for the benchmark or the clock, within [`life::BOUND`] in
//!    which the daemon ran and the hook worked.
//! 3. The fourth benchmark's readings are in the state at the end of the turn in which they came, and property 2 holds for
//!    it, whatever the others do, while the machine is well.
//!
//! And a replay of the state says what the daemon said.
//!
//! Lives are lived in processes of their own ([`apart`]): the limit that stands for the full disk is that of a whole
//! process, and would also meet what the test harness writes to a file.
//!
//! `HOSTILE_HOURS` sets how many hours are lived through; by default [`HOURS`], in `.ci/run` ten thousand. Lives begin at
//! the seed `HOSTILE_SEED`, 0 by default; with `HOSTILE_LOG` the plan and the daemon's log are printed. What a seed found
//! is mended and the seed stays in [`FOUND`].

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    clippy::struct_excessive_bools,
    clippy::print_stdout,
    clippy::format_push_string,
    reason = "a test fails by panicking, and says how much it has seen"
)]

mod apart;
mod clock;
mod host;
mod life;
mod logger;
mod people;
mod plan;
mod radio;
mod slope;
mod state;

use host::FULL;
use life::LIFE_HOURS;
use people::Mood;
use plan::{Plan, Trouble};
use std::io::Write;
use std::time::Duration;

/// Hours that are lived through unless `HOSTILE_HOURS` says otherwise.
const HOURS: u64 = 250;
/// Seeds that found something, and what.
const FOUND: [(u64, &str); 2] = [
    (
        1,
        "a clock that is set back after days of readings in time: true readings were set aside for good",
    ),
    (
        37,
        "the same, and the clock was said to be right again while it was not",
    ),
];

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap())
}

#[test]
fn in_hostile_hours_no_reading_is_lost_no_red_is_kept_from_people_and_no_benchmark_waits_for_another()
 {
    const NAME: &str = "in_hostile_hours_no_reading_is_lost_no_red_is_kept_from_people_and_no_benchmark_waits_for_another";
    if let Some(seeds) = apart::own_seeds() {
        return apart::live_all(seeds, &Mood::Works);
    }
    let lives = number("HOSTILE_HOURS", HOURS).div_ceil(LIFE_HOURS);
    let first = number("HOSTILE_SEED", 0);
    let seen = apart::live_in_processes(NAME, first..first + lives);
    println!("{seen:?}");
    if lives >= 20 {
        // That the plan reaches what is claimed: most reds are sent as such, and not only as unknown.
        assert!(seen.reds_due > lives, "{seen:?}");
        assert!(seen.reds_notified * 2 > seen.reds_due, "{seen:?}");
        assert!(seen.restarts > lives && seen.full_disk > 0, "{seen:?}");
    }
}

#[test]
fn what_seeds_have_found_is_mended() {
    if let Some(seeds) = apart::own_seeds() {
        return apart::live_all(seeds, &Mood::Works);
    }
    for (seed, what) in FOUND {
        println!("seed {seed}: {what}");
        apart::live_in_processes("what_seeds_have_found_is_mended", seed..seed + 1);
    }
}

#[test]
#[should_panic(expected = "has not been notified")]
fn a_hook_that_loses_red_is_found() {
    if let Some(seeds) = apart::own_seeds() {
        return apart::live_all(seeds, &Mood::LosesRed);
    }
    apart::live_in_processes("a_hook_that_loses_red_is_found", 0..1);
}

#[test]
fn the_full_disk_is_the_daemons_and_not_that_of_what_the_tests_write() {
    const NAME: &str = "the_full_disk_is_the_daemons_and_not_that_of_what_the_tests_write";
    if let Some(seeds) = apart::own_seeds() {
        return apart::live_all(seeds, &Mood::Works);
    }
    let is_full = |seed: &u64| {
        let plan = Plan::drawn(*seed);
        let mut troubles = plan.troubles.iter();
        troubles.any(|(_, _, trouble)| *trouble == Trouble::FullDisk)
    };
    let seed = (0..100).find(is_full).unwrap();
    let life = std::thread::spawn(move || apart::live_in_processes(NAME, seed..seed + 1));
    // As a log to which everything that is tested has been written.
    let mut log = tempfile::tempfile().unwrap();
    log.write_all(&vec![b'.'; 3 * FULL as usize]).unwrap();
    while !life.is_finished() {
        log.write_all(b"test ... ok\n").unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(life.join().unwrap().full_disk > 0);
}
