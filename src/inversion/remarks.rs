//! What a person should know of an inversion that its numbers do not say.

use super::report::FittedRegime;
use crate::fit::{LawDraws, Rate};
use crate::reading::HALF_WIDTH_90;

/// Said where the parameters have no intervals although there are readings enough.
const UNSETTLED: &str = "The parameters have no intervals: the laws that were drawn from what the readings leave open did not spread over it, \
     as where readings scatter far less than laws can be distinguished by. Go by the best fit, without an error.";
/// Said where the two regimes differ after the velocity has stood still.
const STOOD_STILL: &str = "The two regimes differ, and the newest readings do not decide between them: over the last third of the record the \
     velocity stayed the same within 10 %. What they disagree about is whether the slope will accelerate again. The first lets the \
     load change, gives old readings less weight, and takes most slopes that are watched for unstable until readings say otherwise; the \
     monitor, and the chance of a failure above, go by it. The second takes the load for constant over the whole record, and goes by \
     how the velocity came to rest. By these readings alone the regime is undetermined.";

/// The newest share of a record that is looked at, with at least so many rates.
const NEWEST: f64 = 1.0 / 3.0;
const FEWEST_RATES: usize = 6;
/// A velocity stands still where its change over that, ln, is less than this with 95 % certainty.
const STILL: f64 = 0.1;
const CERTAIN: f64 = HALF_WIDTH_90;

/// Whether the velocity has stood still over the last third of the record: by a straight line through ln v.
pub(super) fn has_stood_still(rates: &[Rate]) -> bool {
    let (Some(first), Some(last)) = (rates.first(), rates.last()) else {
        return false;
    };
    let from = last.to - NEWEST * (last.to - first.from);
    let newest: Vec<&Rate> = rates.iter().filter(|rate| rate.middle() >= from).collect();
    let moves = newest.iter().all(|rate| rate.velocity > 0.0);
    if newest.len() < FEWEST_RATES || !moves {
        return false;
    }
    let n = newest.len() as f64;
    let mean = |of: &dyn Fn(&Rate) -> f64| newest.iter().map(|rate| of(rate)).sum::<f64>() / n;
    let (day, ln_v) = (mean(&Rate::middle), mean(&|rate| rate.velocity.ln()));
    let about = |rate: &Rate| (rate.middle() - day, rate.velocity.ln() - ln_v);
    let squares = n * mean(&|rate| about(rate).0.powi(2));
    let slope = n * mean(&|rate| about(rate).0 * about(rate).1) / squares;
    let left = n * mean(&|rate| (about(rate).1 - slope * about(rate).0).powi(2));
    let error = (left / (n - 2.0) / squares).sqrt();
    (slope.abs() + CERTAIN * error) * (last.to - from) <= STILL
}

/// Each a paragraph.
pub(super) fn remarks(
    posterior: Option<&LawDraws>,
    (constant, load): (&FittedRegime, Option<&FittedRegime>),
    has_stood_still: bool,
) -> Vec<String> {
    let mut remarks = Vec::new();
    if posterior.is_some_and(|posterior| !posterior.suffices) {
        remarks.push(UNSETTLED.to_owned());
    }
    if has_stood_still && constant.differs_from(load) {
        remarks.push(STOOD_STILL.to_owned());
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Observations;
    use crate::fit::RateOptions;

    fn still(velocity: impl Fn(f64) -> f64) -> bool {
        let mut slip = 0.0;
        let points = (0..60_u32).map(|day| {
            slip += velocity(f64::from(day));
            (f64::from(day), slip)
        });
        let observations = Observations::of_displacements(points);
        has_stood_still(&observations.rates(0..60, RateOptions::default()))
    }

    #[test]
    fn a_velocity_that_came_to_rest_stands_still_and_one_that_grows_or_scatters_does_not() {
        assert!(still(|day| 10.0 - 8.0 * (-day / 6.0).exp()));
        assert!(!still(|day| 10.0 * (day / 60.0).exp()));
        let scattered = |day: f64| 10.0 * (1.0 + 0.8 * ((day * 0.618).fract() - 0.5));
        assert!(!still(scattered));
    }
}
