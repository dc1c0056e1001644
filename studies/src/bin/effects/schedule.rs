//! When a slope is read: hourly to monthly, even or not, with gaps.

use rand_pcg::Pcg64;
use slipwatch::reading::SECONDS_PER_DAY;
use studies::random::{count, happens, log_uniform_by_exp, one_of, uniform};

/// Days of the nominal intervals.
pub(crate) const HOURLY: f64 = 1.0 / 24.0;
pub(crate) const TWO_HOURLY: f64 = 2.0 / 24.0;
pub(crate) const SIX_HOURLY: f64 = 0.25;
pub(crate) const DAILY: f64 = 1.0;
pub(crate) const WEEKLY: f64 = 7.0;
pub(crate) const MONTHLY: f64 = 30.4375;

/// What every record keeps to.
const READINGS: (usize, usize) = (150, 1500);
/// No instrument here is read for longer, days.
const LONGEST: f64 = 25.0 * 365.25;
/// Draws of gaps that leave too few readings are repeated this often.
const TRIES: usize = 20;

/// The times of the readings.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    /// Days, increasing from 0, at whole seconds.
    pub(crate) days: Vec<f64>,
    /// The nominal interval, days.
    pub(crate) interval: f64,
}

/// What a kind of effect asks of the sampling.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Need {
    /// Intervals that do, with their weights.
    pub(crate) intervals: &'static [(f64, f64)],
    /// Length of the record that it takes, days.
    pub(crate) least_days: f64,
}

impl Need {
    pub(crate) const ANY: Self = Self {
        intervals: &[
            (0.2, HOURLY),
            (0.25, SIX_HOURLY),
            (0.4, DAILY),
            (0.15, MONTHLY),
        ],
        least_days: 0.0,
    };
    pub(crate) const TIDE: Self = Self {
        intervals: &[(0.5, HOURLY), (0.5, TWO_HOURLY)],
        least_days: 15.0,
    };
    pub(crate) const SEASON: Self = Self {
        intervals: &[(0.4, DAILY), (0.4, WEEKLY), (0.2, MONTHLY)],
        least_days: 2.6 * 365.25,
    };
    pub(crate) const FINE: Self = Self {
        intervals: &[(0.4, HOURLY), (0.3, SIX_HOURLY), (0.3, DAILY)],
        least_days: 0.0,
    };
}

impl Schedule {
    pub(crate) fn draw(rng: &mut Pcg64, need: Need) -> Option<Self> {
        let interval = one_of(rng, need.intervals);
        let fewest = (need.least_days / interval).max(READINGS.0 as f64);
        let most = (LONGEST / interval).min(READINGS.1 as f64);
        let wanted = log_uniform_by_exp(rng, fewest.min(most), most);
        let even = happens(rng, 0.65);
        (0..TRIES)
            .map(|_| Self::attempt(rng, interval, wanted, even))
            .find(|one| {
                one.days.len() >= READINGS.0
                    && one.days.len() <= READINGS.1
                    && one.length() >= 0.95 * need.least_days
            })
    }

    pub(crate) fn length(&self) -> f64 {
        self.days.last().copied().unwrap_or(0.0)
    }

    fn attempt(rng: &mut Pcg64, interval: f64, wanted: f64, even: bool) -> Self {
        let length = wanted * interval;
        let gaps = gaps(rng, interval, length);
        let lost = if happens(rng, 0.5) {
            uniform(rng, 0.0, 0.1)
        } else {
            0.0
        };
        let mut days = Vec::new();
        let mut at = 0.0;
        while at < length {
            let shift = if even { 0.0 } else { uniform(rng, -0.35, 0.35) };
            let day = whole_seconds(at + shift * interval);
            if !gaps.iter().any(|gap| day > gap.0 && day < gap.1) && !happens(rng, lost) {
                days.push(day);
            }
            at += interval;
        }
        let first = days.first().copied().unwrap_or(0.0);
        for day in &mut days {
            *day -= first;
        }
        Self { days, interval }
    }
}

/// In four records of ten, one to three of them.
fn gaps(rng: &mut Pcg64, interval: f64, length: f64) -> Vec<(f64, f64)> {
    if !happens(rng, 0.4) {
        return Vec::new();
    }
    (0..count(rng, 1, 3))
        .map(|_| {
            let from = uniform(rng, 0.05, 0.9) * length;
            (from, from + interval * log_uniform_by_exp(rng, 3.0, 30.0))
        })
        .collect()
}

fn whole_seconds(days: f64) -> f64 {
    (days * SECONDS_PER_DAY).round() / SECONDS_PER_DAY
}
