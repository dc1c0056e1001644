//! Proper scores of a forecast of the time of failure (Gneiting and Raftery 2007), with the end of a record that
//! saw no failure taken as censoring.

use crate::forecast::Passage;

/// No forecast is scored beyond this many days.
pub const LONGEST_SCORED_DAYS: f64 = 60.0;
/// No forecast is scored beyond this many lengths of the record that it was made from.
pub const RECORDS_SCORED: f64 = 5.0;
/// A probability that is never given away, so that one bad surprise does not decide a mean of logarithms.
const SURPRISE: f64 = 0.01;
/// The log score is that of the probability given to a class of times: so many classes to a decade of days.
const CLASSES_A_DECADE: f64 = 10.0;
/// The classes begin at this many days.
const FIRST_CLASS_DAYS: f64 = 0.01;
/// The classes cover so many decades; sooner and later are classes of their own.
const DECADES: f64 = 4.0;

/// What came of a slope after a forecast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// It failed, so many days later.
    Failed(f64),
    /// It still stood when the record ended, so many days later.
    Stood(f64),
}

impl Outcome {
    /// Whether it had failed within `days`; `None` where the record ended before.
    pub fn within(self, days: f64) -> Option<bool> {
        match self {
            Self::Failed(after) => Some(after <= days),
            Self::Stood(for_days) => (for_days >= days).then_some(false),
        }
    }
}

/// How far a forecast from a record of `length_days` is scored, days.
pub fn scored_days(length_days: f64) -> f64 {
    LONGEST_SCORED_DAYS.min(RECORDS_SCORED * length_days)
}

/// The continuous ranked probability score, days: the integral of (F(t) - 1{t >= failure})^2 over 0 to `scored_days`,
/// or to the end of a record without a failure. A point forecast is a step, and scores its error.
pub fn crps_days(forecast: &Passage, outcome: Outcome, scored_days: f64) -> f64 {
    let (until, failure) = match outcome {
        Outcome::Failed(after) => (scored_days, after.max(0.0)),
        Outcome::Stood(for_days) => (scored_days.min(for_days), f64::INFINITY),
    };
    let (mut score, mut reached, mut at) = (0.0, 0.0_f64, 0.0_f64);
    let mut add = |from: f64, to: f64, reached: f64| {
        let before = (to.min(failure) - from).max(0.0);
        let after = (to - from.max(failure)).max(0.0);
        score += before * reached * reached + after * (1.0 - reached) * (1.0 - reached);
    };
    for (days, share) in forecast.times() {
        if *days >= until {
            break;
        }
        add(at, days.max(at), reached);
        (at, reached) = (days.max(at), (reached + share).min(1.0));
    }
    add(at, until.max(at), reached);
    score
}

/// Less the logarithm of the probability given to what came, to the tenth of a decade, nats; 1 % of all is spread
/// over the classes for what no forecaster expects.
pub fn log_score(forecast: &Passage, outcome: Outcome) -> f64 {
    let classes = CLASSES_A_DECADE * DECADES + 2.0;
    let given = match outcome {
        Outcome::Failed(after) => {
            let (from, to) = class_of(after);
            (forecast.chance_within(to) - forecast.chance_within(from)).max(0.0)
        }
        Outcome::Stood(for_days) => 1.0 - forecast.chance_within(for_days),
    };
    -((1.0 - SURPRISE) * given + SURPRISE / classes).ln()
}

/// The class of times that `days` lies in: after the first, up to and with the second.
fn class_of(days: f64) -> (f64, f64) {
    let edge = |class: f64| FIRST_CLASS_DAYS * 10f64.powf(class / CLASSES_A_DECADE);
    let class = ((days / FIRST_CLASS_DAYS).log10() * CLASSES_A_DECADE).ceil();
    if class <= 0.0 {
        (f64::NEG_INFINITY, FIRST_CLASS_DAYS)
    } else if class > CLASSES_A_DECADE * DECADES {
        (edge(CLASSES_A_DECADE * DECADES), f64::INFINITY)
    } else {
        (edge(class - 1.0), edge(class))
    }
}

/// Whether the unconditional interval of 90 % holds the failure; an end that is not reached is later than anything.
pub fn is_covered(forecast: &Passage, failed_after_days: f64) -> bool {
    let quantile = |share| {
        forecast
            .quantile(share, f64::INFINITY)
            .unwrap_or(f64::INFINITY)
    };
    (quantile(0.05)..=quantile(0.95)).contains(&failed_after_days)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::function::erf::erf_inv;

    fn point(days: f64) -> Passage {
        Passage::from_times(vec![(days, 1.0)])
    }

    #[test]
    fn a_point_forecast_scores_its_error_and_one_of_never_the_time_left() {
        let crps = |forecast: &Passage, failed| crps_days(forecast, Outcome::Failed(failed), 60.0);
        assert!((crps(&point(7.0), 10.0) - 3.0).abs() < 1e-12);
        assert!((crps(&point(13.0), 10.0) - 3.0).abs() < 1e-12);
        assert!((crps(&Passage::default(), 10.0) - 50.0).abs() < 1e-12);
        // Beyond what is scored nothing counts.
        assert!((crps(&point(100.0), 10.0) - 50.0).abs() < 1e-12);
        assert!(crps(&point(100.0), 70.0).abs() < 1e-12);
    }

    #[test]
    fn the_score_of_a_normal_forecast_is_that_of_the_closed_form() {
        // 2,000 quantiles of N(10, 2): sigma (z (2 Phi(z) - 1) + 2 phi(z) - 1/sqrt(pi)), at z = 0.
        let count = 2000;
        let times = (0..count).map(|i| {
            let u = (f64::from(i) + 0.5) / f64::from(count);
            (
                10.0 + std::f64::consts::SQRT_2 * 2.0 * erf_inv(2.0 * u - 1.0),
                1.0 / f64::from(count),
            )
        });
        let crps = crps_days(
            &Passage::from_times(times.collect()),
            Outcome::Failed(10.0),
            60.0,
        );
        let closed =
            2.0 * (2.0 / (std::f64::consts::TAU).sqrt() - 1.0 / std::f64::consts::PI.sqrt());
        assert!((crps - closed).abs() < 2e-3, "{crps} {closed}");
    }

    #[test]
    fn a_slope_that_stood_costs_what_was_feared_until_the_record_ends() {
        let forecast = Passage::from_times(vec![(2.0, 0.5)]);
        let crps = crps_days(&forecast, Outcome::Stood(10.0), 60.0);
        assert!((crps - 8.0 * 0.25).abs() < 1e-12, "{crps}");
        assert!(crps_days(&Passage::default(), Outcome::Stood(10.0), 60.0).abs() < 1e-12);
    }

    #[test]
    fn the_log_score_asks_for_the_class_of_the_failure() {
        let sure = log_score(&point(10.0), Outcome::Failed(10.0));
        let off = log_score(&point(14.0), Outcome::Failed(10.0));
        assert!(sure < 0.011 && off > 8.0, "{sure} {off}");
        let half = Passage::from_times(vec![(10.0, 0.5)]);
        let stood = log_score(&half, Outcome::Stood(20.0));
        assert!((stood - 2f64.ln()).abs() < 0.02, "{stood}");
    }

    #[test]
    fn coverage_counts_an_end_that_is_not_reached_as_later_than_anything() {
        let half = Passage::from_times(vec![(1.0, 0.04), (5.0, 0.46)]);
        assert!(is_covered(&half, 300.0));
        assert!(is_covered(&half, 5.0));
        assert!(!is_covered(&half, 0.5));
    }

    #[test]
    fn an_outcome_beyond_the_record_is_unknown() {
        assert_eq!(Outcome::Stood(3.0).within(5.0), None);
        assert_eq!(Outcome::Stood(6.0).within(5.0), Some(false));
        assert_eq!(Outcome::Failed(4.0).within(5.0), Some(true));
        assert_eq!(Outcome::Failed(6.0).within(5.0), Some(false));
    }
}
