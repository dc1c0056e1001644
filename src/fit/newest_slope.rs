//! How fast a slope may run by the prior, in units of its newest sampling interval: one rule for every posterior of the law.

use super::rates::Rate;
use crate::reading::upper_median;

/// Standard deviation of the prior on r times the newest sampling interval: what would be over well within one rests on one
/// reading.
pub(super) const SLOPE_PER_INTERVAL: f64 = 1.5;
/// Newest rates whose spacings count.
const NEWEST: usize = 4;

/// The newest sampling interval, days: of the last three spacings between rates the middle one, because a logger that was out
/// before a collapse must not rule the collapse out. `None` with fewer than two rates.
pub(super) fn newest_interval_days(rates: &[Rate]) -> Option<f64> {
    let newest = &rates[rates.len().saturating_sub(NEWEST)..];
    let spacings = newest.windows(2).map(|pair| pair[1].to - pair[0].to);
    upper_median(&mut spacings.collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::ReadingError;

    #[test]
    fn an_outage_before_the_newest_readings_is_not_the_sampling_interval() {
        let rates: Vec<Rate> = [0.0, 1.0, 2.0, 3.0, 30.0, 31.0, 32.0]
            .map(|to| Rate {
                from: to,
                to,
                velocity: 1.0,
                sigma: 0.0,
                readings: 1,
                error: ReadingError::Own,
            })
            .to_vec();
        assert_eq!(newest_interval_days(&rates), Some(1.0));
        assert_eq!(newest_interval_days(&rates[..6]), Some(1.0));
        assert_eq!(newest_interval_days(&rates[..5]), Some(1.0));
        assert_eq!(newest_interval_days(&rates[..1]), None);
    }
}
