//! The onset of acceleration as Carlà et al. 2017 find it: where a short trailing average of the velocity
//! last rose above a long one ("Guidelines on the use of inverse velocity method as a tool for setting alarm
//! thresholds and forecasting landslides and structure collapses", Landslides 14, 517-534).
//!
//! Both averages trail, so that an onset is known when it is crossed and never earlier. What they average
//! are the rates of the record, not raw differences of readings: those are already merged until they stand
//! clear of the noise.

use crate::fit::Rate;
use crate::forecast::Passage;

/// Velocities in the short average and in the long one.
pub(super) const SHORT: usize = 3;
pub(super) const LONG: usize = 7;
/// Averages of one velocity differ by as much.
const ROUNDING: f64 = 1e-12;

/// The mean of the `count` velocities that end with the one at `newest`, which must have that many.
pub(super) fn trailing_mean(rates: &[Rate], newest: usize, count: usize) -> f64 {
    let window = &rates[newest + 1 - count..=newest];
    window.iter().map(|rate| rate.velocity).sum::<f64>() / count as f64
}

/// What `forecast` says of the rates from the onset on, given their first index: `None` with too few for the
/// long average, never while the short average is not above the long one. Noise makes them cross again and again, and
/// each crossing is an onset: whoever looks at the plot would overlook some, a program that judged which would no
/// longer be the published method.
pub(super) fn from_onset(
    rates: &[Rate],
    forecast: impl FnOnce(usize) -> Option<Passage>,
) -> Option<Passage> {
    if rates.len() < LONG {
        return None;
    }
    let rises = |index: &usize| {
        let long = trailing_mean(rates, *index, LONG);
        trailing_mean(rates, *index, SHORT) > long + ROUNDING * long.abs()
    };
    match (LONG - 1..rates.len()).rev().take_while(rises).last() {
        Some(onset) => forecast(onset),
        None => Some(Passage::default()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{drawn, rates};
    use super::*;

    fn onset(velocity: impl Fn(f64) -> f64) -> Option<usize> {
        let mut found = None;
        from_onset(&rates(&drawn::velocities(1.0, 40.0, velocity)), |index| {
            found = Some(index);
            None
        });
        found
    }

    #[test]
    fn the_onset_is_where_the_short_average_last_crossed_the_long_one() {
        assert_eq!(onset(|t| if t > 20.0 { t - 19.9 } else { 0.1 }), Some(21));
        // A burst that ended is no onset.
        let burst = |t: f64| if (5.0..9.0).contains(&t) { 9.0 } else { 1.0 };
        assert_eq!(
            onset(|t| burst(t) + if t > 30.0 { t - 30.0 } else { 0.0 }),
            Some(31)
        );
        assert_eq!(onset(|t| 100.0 - t), None);
    }
}
