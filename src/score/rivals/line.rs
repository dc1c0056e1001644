//! The straight line through inverse velocity: as it stands (Fukuzono 1985), and through trailing averages
//! from the onset of acceleration on (Carlà et al. 2017).

use super::onset::{self, LONG, SHORT};
use super::{point, rates};
use crate::forecast::{InverseVelocityLine, Passage};
use crate::score::Known;

/// Through every rate of the record.
pub(in crate::score) fn raw(known: &Known) -> Option<Passage> {
    meets_zero(InverseVelocityLine::fit(&rates(known))?, known)
}

/// Through the inverse of the short trailing average.
pub(in crate::score) fn short(known: &Known) -> Option<Passage> {
    averaged(known, SHORT)
}

/// Through the inverse of the long trailing average.
pub(in crate::score) fn long(known: &Known) -> Option<Passage> {
    averaged(known, LONG)
}

/// Each average stands at the end of its window, as published: it lags, and the line with it.
fn averaged(known: &Known, count: usize) -> Option<Passage> {
    let rates = rates(known);
    onset::from_onset(&rates, |since| {
        let averages = (since..rates.len())
            .map(|index| (rates[index].to, onset::trailing_mean(&rates, index, count)));
        let points: Vec<(f64, f64)> = averages
            .filter(|(_, velocity)| *velocity > 0.0)
            .map(|(days, velocity)| (days, 1.0 / velocity))
            .collect();
        meets_zero(InverseVelocityLine::through(&points)?, known)
    })
}

pub(super) fn meets_zero(line: InverseVelocityLine, known: &Known) -> Option<Passage> {
    point(line.intercept_days.unwrap_or(f64::INFINITY) - known.now_days)
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, velocities, when};
    use super::*;

    /// Fails on day 30.
    fn failing(t: f64) -> f64 {
        50.0 / (30.0 - t)
    }

    #[test]
    fn the_line_finds_its_own_law_and_the_averages_lag_by_their_windows() {
        let known = velocities(0.3, 26.0, failing);
        let days = |passage: Option<Passage>| when(&known, passage.as_ref());
        assert!((days(raw(&known)) - 30.0).abs() < 1e-6);
        // Half the windows: (3 - 1) / 2 and (7 - 1) / 2 readings of 0.3 days.
        let (short, long) = (days(short(&known)), days(long(&known)));
        assert!((short - 30.3).abs() < 0.05, "{short}");
        assert!((long - 30.9).abs() < 0.1, "{long}");
    }

    #[test]
    fn what_came_before_the_onset_does_not_bend_the_averaged_line() {
        let crept = velocities(0.3, 26.0, |t| failing(t.max(15.0)));
        let days = when(&crept, short(&crept).as_ref());
        assert!((days - 30.3).abs() < 0.1, "{days}");
        let days = when(&crept, raw(&crept).as_ref());
        assert!(days > 33.0, "{days}");
    }

    #[test]
    fn a_slope_that_slows_down_never_fails_and_a_short_record_says_nothing() {
        let slowing = velocities(1.0, 30.0, |t| 50.0 / (1.0 + t));
        let scant = velocities(1.0, 2.0, failing);
        for forecast in [raw, short, long] {
            assert!(never(forecast(&slowing).as_ref()));
            assert_eq!(forecast(&scant), None);
        }
    }
}
