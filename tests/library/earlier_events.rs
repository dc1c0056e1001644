//! What once happened to a slope, or to its instrument, hides no later collapse.

use crate::crisis::policy;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::monitor::{AlertState, EventKind, Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Timestamp, Unit, after_days, days_since};

/// Creep, and from the second on a straight line in inverse velocity to the third, days.
const CREEP_MM_PER_DAY: f64 = 0.8;
const ONSET: f64 = 70.0;
const END: f64 = 90.0;
/// When something else happens, days, well before the acceleration.
const EARLIER: f64 = 35.0;

fn slope(t: f64) -> f64 {
    let left = END - ONSET;
    let more = (t - ONSET).max(0.0).min(0.999 * left);
    CREEP_MM_PER_DAY * (t.min(ONSET) - left * 3.0 * (1.0 - more / left).ln())
}

/// How long before the end red was first called since the onset, days; readings once a day with noise of half a mm.
fn red_before_the_end(seed: u64, more: impl Fn(f64) -> f64) -> Option<f64> {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let mut monitor = Monitor::new(Settings {
        policy: policy(24),
        ..Settings::default()
    });
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut noise = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    for day in 0..90_u32 {
        let t = f64::from(day);
        let time = after_days(start, t).unwrap();
        let input = Input::Reading {
            benchmark: BenchmarkId::new("P"),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time,
                value: slope(t) + more(t) + 0.5 * noise(),
                sigma: None,
            },
        };
        let events = monitor.step(time, &input);
        let is_red = |kind: &EventKind| {
            matches!(
                kind,
                EventKind::Alert {
                    level: Level::Red,
                    state: AlertState::Firing,
                    ..
                }
            )
        };
        if t >= ONSET && events.iter().any(|event| is_red(&event.kind)) {
            return Some(END - days_since(start, time));
        }
    }
    None
}

fn is_red_in_time(more: impl Fn(f64) -> f64 + Copy) {
    for seed in 0..4 {
        let lead = red_before_the_end(seed, more);
        assert!(lead.is_some_and(|lead| lead >= 1.0), "{seed}: {lead:?}");
    }
}

#[test]
fn a_collapse_is_called_where_nothing_happened_before() {
    is_red_in_time(|_| 0.0);
}

#[test]
fn a_slide_that_stopped_hides_no_collapse() {
    // 100 mm/day at first, over within some days.
    is_red_in_time(|t| 200.0 * (1.0 - (-(t - EARLIER).max(0.0) / 2.0).exp()));
}

#[test]
fn a_reset_that_nobody_declared_hides_no_collapse() {
    is_red_in_time(|t| if t < EARLIER { 0.0 } else { 100.0 });
}

#[test]
fn three_wrong_readings_hide_no_collapse() {
    is_red_in_time(|t| {
        if (EARLIER..EARLIER + 3.0).contains(&t) {
            200.0
        } else {
            0.0
        }
    });
}
