//! Benchmarks on a slope that creeps and has its crises, and the readings that are made of them.

use jiff::{SignedDuration, Timestamp};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Red is due where so many readings in a row have shown this velocity, which is four times the threshold.
pub(crate) const CRISIS_MM_PER_DAY: f64 = 400.0;
pub(crate) const FEWEST_IN_A_ROW: usize = 4;

/// One reading, as a logger has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    pub(crate) time: Timestamp,
    pub(crate) value: f64,
    /// Red is due once this has been read.
    pub(crate) calls_red: bool,
    /// The velocity is that of a crisis.
    pub(crate) is_of_a_crisis: bool,
}

/// One benchmark.
pub(crate) struct Slope {
    pub(crate) name: &'static str,
    every: SignedDuration,
    next: Timestamp,
    value: f64,
    creep: f64,
    /// When its crises begin and end.
    crises: Vec<(Timestamp, Timestamp)>,
    in_a_row: usize,
    random: Pcg64,
}

impl Slope {
    pub(crate) fn new(
        name: &'static str,
        hours: i64,
        seed: u64,
        (from, to): (Timestamp, Timestamp),
    ) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let every = SignedDuration::from_hours(hours);
        let length = to.duration_since(from);
        let mut crises = Vec::new();
        for _ in 0..random.random_range(1..=2) {
            let begins = from
                + SignedDuration::from_secs_f64(
                    length.as_secs_f64() * random.random_range(0.2..0.8),
                );
            crises.push((begins, begins + every * random.random_range(7..16)));
        }
        Self {
            name,
            every,
            next: from + SignedDuration::from_mins(random.random_range(1..30)),
            value: random.random_range(0.0..100.0),
            creep: random.random_range(0.5..3.0),
            crises,
            in_a_row: 0,
            random,
        }
    }

    /// What has been measured by `now` and was not asked for before.
    pub(crate) fn measure(&mut self, now: Timestamp) -> Vec<Measured> {
        let mut measured = Vec::new();
        while self.next <= now {
            let time = self.next;
            self.next = time + self.every;
            let days = self.every.as_secs_f64() / 86_400.0;
            let is_of_a_crisis = self
                .crises
                .iter()
                .any(|(from, to)| *from < time && time <= *to);
            let velocity = if is_of_a_crisis {
                CRISIS_MM_PER_DAY
            } else {
                self.creep
            };
            self.value += velocity * days;
            self.in_a_row = if is_of_a_crisis { self.in_a_row + 1 } else { 0 };
            let noise = self.random.random_range(-0.05..0.05);
            measured.push(Measured {
                time,
                value: ((self.value + noise) * 1000.0).round() / 1000.0,
                calls_red: self.in_a_row == FEWEST_IN_A_ROW,
                is_of_a_crisis,
            });
        }
        measured
    }
}
