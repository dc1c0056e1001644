//! What goes wrong, and when: drawn from a seed.

use crate::life::STEPS;
use jiff::SignedDuration;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Something that is wrong for a while.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Trouble {
    /// The host's clock is off by so much.
    Clock(SignedDuration),
    /// The state's files cannot grow.
    FullDisk,
    HookFails,
    HookHangs,
    HookHangsAt(&'static str),
    /// The daemon does not run. How it ended.
    Down {
        is_killed: bool,
    },
    /// The folder of the files is not mounted.
    FolderGone,
    /// A logger keeps its rows.
    LoggerAway(&'static str),
    /// Messages wait at the broker.
    BrokerAway,
    /// Messages come twice and out of their order.
    BrokerStutters,
    /// Rows come in halves.
    HalfRows(&'static str),
    /// Rows come in another order than they were measured in.
    LateRows(&'static str),
}

/// Something that happens once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Mishap {
    Rotate(&'static str),
    Replace(&'static str),
    CopyTruncate(&'static str),
    /// Lines that mean nothing.
    Garbage(&'static str),
    /// A file of so many bytes with rows that nobody asked for.
    BigFile,
    /// A row of a month ahead.
    FarStamp(&'static str),
    /// The daemon is killed and comes up again at once.
    Kill,
}

/// Each trouble with the steps in which it begins and ends, and each mishap with its step.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) troubles: Vec<(usize, usize, Trouble)>,
    pub(crate) mishaps: Vec<(usize, Mishap)>,
    /// When a logger corrects its last row: drawn by themselves, so that all else stays what a seed drew before.
    pub(crate) corrections: Vec<(usize, &'static str)>,
}

/// The benchmarks with files that have trouble of their own.
const FILES: [&str; 2] = ["a", "b"];

impl Plan {
    pub(crate) fn drawn(seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x5eed);
        let count = random.random_range(6..14);
        let mut troubles: Vec<(usize, usize, Trouble)> = Vec::new();
        for _ in 0..count {
            let trouble = trouble(&mut random);
            let from = random.random_range(8..STEPS);
            let to = from + random.random_range(1..=longest(&trouble));
            let overlaps = |(start, end, other): &(usize, usize, Trouble)| {
                *start <= to && from <= *end && excludes(&trouble, other)
            };
            if !troubles.iter().any(overlaps) {
                troubles.push((from, to, trouble));
            }
        }
        let mut mishaps = Vec::new();
        for _ in 0..random.random_range(6..16) {
            mishaps.push((random.random_range(4..STEPS), mishap(&mut random)));
        }
        mishaps.sort_by_key(|(step, _)| *step);
        let mut random = Pcg64::seed_from_u64(seed ^ 0xc0_44ec);
        let correction = |_| {
            let file = FILES[random.random_range(0..FILES.len())];
            (random.random_range(4..STEPS), file)
        };
        let corrections = (0..6).map(correction).collect();
        Self {
            troubles,
            mishaps,
            corrections,
        }
    }
}

/// Whether the two are not drawn for one time.
fn excludes(one: &Trouble, other: &Trouble) -> bool {
    std::mem::discriminant(one) == std::mem::discriminant(other)
}

fn trouble(random: &mut Pcg64) -> Trouble {
    let file = FILES[random.random_range(0..FILES.len())];
    match random.random_range(0..13) {
        0 => Trouble::Clock(-SignedDuration::from_mins(random.random_range(240..6000))),
        1 => Trouble::Clock(SignedDuration::from_mins(random.random_range(10..90_000))),
        2 => Trouble::FullDisk,
        3 => Trouble::HookFails,
        4 => Trouble::HookHangs,
        5 => Trouble::HookHangsAt(["a", "b", "m"][random.random_range(0..3)]),
        6 => Trouble::Down {
            is_killed: random.random_bool(0.7),
        },
        7 => Trouble::FolderGone,
        8 => Trouble::LoggerAway(file),
        9 => Trouble::BrokerAway,
        10 => Trouble::BrokerStutters,
        11 => Trouble::HalfRows(file),
        _ => Trouble::LateRows(file),
    }
}

/// Steps that it lasts for at most.
fn longest(trouble: &Trouble) -> usize {
    match trouble {
        Trouble::HookFails | Trouble::HookHangs | Trouble::HookHangsAt(_) => 20,
        Trouble::Down { .. } | Trouble::FullDisk | Trouble::FolderGone => 30,
        Trouble::Clock(_) | Trouble::LoggerAway(_) | Trouble::BrokerAway => 80,
        Trouble::BrokerStutters | Trouble::HalfRows(_) | Trouble::LateRows(_) => 200,
    }
}

fn mishap(random: &mut Pcg64) -> Mishap {
    let file = FILES[random.random_range(0..FILES.len())];
    match random.random_range(0..12) {
        0..3 => Mishap::Rotate(file),
        3..5 => Mishap::Replace(file),
        5 => Mishap::CopyTruncate(file),
        6..8 => Mishap::Garbage(file),
        8 => Mishap::BigFile,
        9 => Mishap::FarStamp(file),
        _ => Mishap::Kill,
    }
}

impl Plan {
    /// Whether the daemon does not run at this step.
    pub(crate) fn is_down(&self, step: usize) -> bool {
        let mut all = self.troubles.iter();
        all.any(|(from, to, trouble)| {
            matches!(trouble, Trouble::Down { .. }) && *from <= step && step < *to
        })
    }
}
