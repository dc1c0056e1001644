//! The posterior's probabilities hold, on series drawn from its own prior.
//!
//! A subset of what `studies/src/bin/calibration` measures on 1,000. There intervals of 90 % hold 87 to 92 % of the truths, and
//! of the start 95 %. The bounds here are three standard deviations of a binomial count around that.

use crate::drawn::Starts;
use crate::score::{PLACED, SAID, Tally};

/// The coverage that 1,000 series reach.
const LEAST: f64 = 0.85;
/// What 1,000 series stay under, and as much again for the scatter of a few hundred.
const CALIBRATION_ERROR: f64 = 0.05 + 0.05;

fn tally(count: u64, starts: Starts) -> Tally {
    let mut tally = Tally::default();
    for index in 0..count {
        tally.add(&crate::drawn::drawn(50_000 + index, starts), starts);
    }
    tally
}

/// Three standard deviations of the share of `count` that are so with probability `share`.
fn three_sigma(share: f64, count: usize) -> f64 {
    3.0 * (share * (1.0 - share) / count as f64).sqrt()
}

/// `absent` can be seen in none of them.
fn assert_calibrated(tally: &Tally, absent: Option<&str>) {
    for what in PLACED {
        let (share, count) = tally.coverage(what, None);
        if absent == Some(what) {
            assert_eq!(count, 0, "{what}");
            continue;
        }
        let low = LEAST - three_sigma(LEAST, count);
        let high = 0.95 + three_sigma(0.95, count);
        assert!(
            count > 0 && (low..=high).contains(&share),
            "{what}: {share:.3} of {count}, not {low:.3} to {high:.3}"
        );
    }
    for what in SAID {
        let error = tally.calibration_error(what);
        assert!(
            error < CALIBRATION_ERROR,
            "{what}: calibration error {error:.3}"
        );
    }
}

#[test]
fn intervals_and_probabilities_hold_from_the_first_reading() {
    assert_calibrated(&tally(240, Starts::First), Some("onset"));
}

#[test]
fn intervals_and_probabilities_hold_where_the_start_is_to_be_found() {
    assert_calibrated(&tally(160, Starts::ToBeFound), None);
}
