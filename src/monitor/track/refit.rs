//! What a refit says: the regime, the failure time, and what of both is other than at the refits before.

use super::forecast::{EARLY, Forecast};
use super::record::BenchmarkRecord;
use crate::alert::{AlertCause, Policy};
use crate::forecast::{FARTHEST_INTERCEPT, HORIZON_DAYS, InverseVelocityLine, Outlook, Passage};
use crate::monitor::drift::{self, Drift};
use crate::monitor::event::{
    ChancesOfCollapse, Event, EventKind, FailureTime, InverseVelocity, Plain, RegimeReport,
    Unexplained,
};
use crate::monitor::motion::settled;
use crate::reading::{Timestamp, after_days, days_of};
use crate::regime::{Regime, Tracker, label};
use serde::Serialize;

/// A line calls for attention when it falls by so many standard errors of its slope.
const CLEARLY: f64 = 4.0;

/// What refits have reported so far of a benchmark, from which the next one may differ.
#[derive(Debug, Default, Serialize)]
pub(super) struct FitChanges {
    regime: Tracker,
    intercept: Drift,
    transition: Drift,
}

/// The times that a refit predicts, days.
#[derive(Debug, Clone, Copy)]
struct PredictedTimes {
    line: Option<InverseVelocityLine>,
    intercept: Option<f64>,
    transition: Option<f64>,
    /// Length of the record.
    length: f64,
}

impl FitChanges {
    pub(super) fn from_saved(regime: Tracker, intercept: Drift, transition: Drift) -> Self {
        Self {
            regime,
            intercept,
            transition,
        }
    }

    /// What the refit of `time` says, and what of it calls for attention, in order.
    pub(super) fn refit(
        &mut self,
        record: &BenchmarkRecord,
        policy: &Policy,
        time: Timestamp,
        forecast: &Forecast,
    ) -> (Vec<Event>, Vec<AlertCause>) {
        // The line and the inflection are those of what is observed, whatever explains it.
        let outlook = &forecast.plain;
        let predicted = PredictedTimes::of(outlook);
        let mut causes = Vec::new();
        let mut events = vec![refit_event(record, policy, time, forecast, predicted)];
        let in_force = forecast.in_force(days_of(policy.outlook));
        events.extend(self.flip(record, time, in_force, &mut causes));
        events.extend(surprise(record, time, forecast, &mut causes));
        events.extend(self.drifts(record, time, outlook, predicted, &mut causes));
        (events, causes)
    }

    /// What of the intercept and the transition time has moved.
    fn drifts(
        &mut self,
        record: &BenchmarkRecord,
        time: Timestamp,
        outlook: &Outlook,
        predicted: PredictedTimes,
        causes: &mut Vec<AlertCause>,
    ) -> Vec<Event> {
        let now = outlook.now_days;
        let least = (predicted.length / 40.0).max(0.02);
        let mut events = Vec::new();
        if let Some(moved) = self.intercept.update(now, predicted.intercept, least) {
            let expected = outlook.law.and_then(|law| {
                drift::expected_by_the_law(&law, InverseVelocityLine::newest(&outlook.rates), now)
            });
            // A slope that moves backwards has no inverse velocity that meets zero.
            let is_forward = settled(&outlook.rates).is_none_or(|velocity| velocity >= 0.0);
            // Noise about a steady velocity gives a line, now and then, that meets zero.
            let falls = predicted.line.map_or(0.0, |line| line.falls_by_errors);
            if moved.to_days < moved.from_days && is_forward && falls >= CLEARLY {
                causes.push(AlertCause::InterceptDriftingIn);
            }
            let kind = |from, to| EventKind::InterceptDrift {
                from,
                to,
                drift_days_per_day: moved.drift_days_per_day,
                expected_days_per_day: expected,
            };
            events.extend(drift_event(record, time, moved, kind));
        }
        let transition = predicted.transition;
        if let Some(moved) = self.transition.update(now, transition, 2.0 * least) {
            if moved.to_days < moved.from_days {
                causes.push(AlertCause::TransitionDriftingIn);
            }
            let kind = |from, to| EventKind::TransitionDrift {
                from,
                to,
                drift_days_per_day: moved.drift_days_per_day,
            };
            events.extend(drift_event(record, time, moved, kind));
        }
        events
    }

    fn flip(
        &mut self,
        record: &BenchmarkRecord,
        time: Timestamp,
        outlook: &Outlook,
        causes: &mut Vec<AlertCause>,
    ) -> Option<Event> {
        let flip = self.regime.update(&outlook.regimes)?;
        if flip.to == Regime::UnstableAccelerating && flip.from != Regime::Undetermined {
            causes.push(AlertCause::RegimeFlip);
        }
        let kind = EventKind::RegimeFlip {
            from: flip.from,
            to: flip.to,
            probability: flip.probability,
        };
        Some(record.event(time, kind))
    }
}

impl PredictedTimes {
    fn of(outlook: &Outlook) -> Self {
        let now = outlook.now_days;
        let line = InverseVelocityLine::fit(InverseVelocityLine::newest(&outlook.rates));
        let length = now - outlook.rates.first().map_or(now, |rate| rate.from);
        let intercept = line
            .and_then(|line| line.intercept_days)
            .filter(|days| *days > now - 1.0 && *days < now + FARTHEST_INTERCEPT * length);
        // An inflection is a prediction only while it lies ahead of a slope that accelerates.
        let accelerating = report(outlook).probability_accelerating > 0.7;
        let transition = outlook
            .law
            .filter(|_| accelerating)
            .and_then(|law| law.transition_days())
            .map(|days| now + days)
            .filter(|days| *days > now && *days < now + FARTHEST_INTERCEPT * length);
        Self {
            line,
            intercept,
            transition,
            length,
        }
    }
}

/// A reading that the law in force did not expect.
fn surprise(
    record: &BenchmarkRecord,
    time: Timestamp,
    forecast: &Forecast,
    causes: &mut Vec<AlertCause>,
) -> Option<Event> {
    let surprise_nats = forecast.surprise_nats()?;
    if record.is_shaken(time) {
        return None;
    }
    causes.push(AlertCause::UnexplainedResidual);
    let unexplained = Unexplained::Reading {
        surprise_nats,
        velocity_mm_per_day: forecast.plain.rates.last().map(|rate| rate.velocity),
    };
    Some(record.event(time, EventKind::UnexplainedResidual(unexplained)))
}

fn refit_event(
    record: &BenchmarkRecord,
    policy: &Policy,
    time: Timestamp,
    forecast: &Forecast,
    predicted: PredictedTimes,
) -> Event {
    let epoch = record.history().epoch;
    let at = |days: Option<f64>| days.and_then(|days| after_days(epoch, days));
    let outlook = forecast.in_force(days_of(policy.outlook));
    let plain = forecast.known_load.as_ref().map(|known_load| {
        Box::new(Plain {
            regime: report(&forecast.plain),
            failure_time: reported(epoch, forecast.plain.now_days, &forecast.plain.collapse),
            is_explained: known_load.is_explained,
        })
    });
    let kind = EventKind::Refit {
        t_max: time,
        regime: report(outlook),
        failure_time: reported(epoch, outlook.now_days, &outlook.collapse),
        chances_of_collapse: Some(Box::new(chances(&outlook.expected))),
        critical_velocity_time: Box::new(reported(epoch, outlook.now_days, &outlook.passage)),
        probability_of_acceleration: outlook.accelerating,
        inverse_velocity: InverseVelocity {
            failure_time: at(predicted.intercept),
            r_squared: predicted.line.map(|line| line.r_squared),
        },
        transition_time: at(predicted.transition),
        velocity_mm_per_day: forecast.plain.rates.last().map(|rate| rate.velocity),
        chance_within_evacuation_time: forecast.chance_within(days_of(policy.evacuation_time)),
        chance_within_outlook: forecast.chance_within(days_of(policy.outlook)),
        called: None,
        plain,
    };
    record.event(time, kind)
}

fn reported(epoch: Timestamp, now_days: f64, passage: &Passage) -> FailureTime {
    let quantile = |share| {
        let days = passage.quantile(share, HORIZON_DAYS)?;
        after_days(epoch, now_days + days)
    };
    FailureTime {
        low: quantile(EARLY),
        median: quantile(0.5),
        high: quantile(0.95),
        probability: passage.chance_within(HORIZON_DAYS),
        horizon_days: HORIZON_DAYS,
    }
}

fn chances(expected: &Passage) -> ChancesOfCollapse {
    let [within_1_day, within_2_days, within_7_days, within_30_days] =
        [1.0, 2.0, 7.0, 30.0].map(|days| expected.chance_within(days));
    ChancesOfCollapse {
        within_1_day,
        within_2_days,
        within_7_days,
        within_30_days,
    }
}

fn drift_event(
    record: &BenchmarkRecord,
    time: Timestamp,
    moved: drift::MovedIntercept,
    kind: impl FnOnce(Timestamp, Timestamp) -> EventKind,
) -> Option<Event> {
    let epoch = record.history().epoch;
    let from = after_days(epoch, moved.from_days)?;
    let to = after_days(epoch, moved.to_days)?;
    Some(record.event(time, kind(from, to)))
}

fn report(outlook: &Outlook) -> RegimeReport {
    let of = |regime| outlook.regimes.get(&regime).copied().unwrap_or(0.0);
    RegimeReport {
        label: label(&outlook.regimes),
        // Rounding may bring a sum above 1.
        probability_unstable: (of(Regime::UnstableAccelerating) + of(Regime::UnstableDecelerating))
            .min(1.0),
        probability_accelerating: (of(Regime::UnstableAccelerating)
            + of(Regime::StableAccelerating))
        .min(1.0),
        probabilities: outlook
            .regimes
            .iter()
            .map(|(regime, share)| (*regime, share.min(1.0)))
            .collect(),
        r_per_day: outlook.law.map(|law| law.r),
        kappa_per_day: outlook.law.map(|law| law.kappa),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast::LawForecaster;
    use crate::monitor::track::fixture::{at, record};

    #[test]
    fn a_refit_is_reported_first_and_a_reading_that_nobody_expected_calls_for_attention() {
        let record = record((0..48).map(f64::from));
        let policy = Policy::default();
        let mut panel = LawForecaster::default();
        let mut plain = panel.update(record.observations(), 1000.0).unwrap();
        plain.surprise_nats = Some(12.0);
        let forecast = Forecast {
            plain,
            known_load: None,
        };
        let (events, causes) = FitChanges::default().refit(&record, &policy, at(47), &forecast);
        let EventKind::Refit {
            chances_of_collapse: Some(chances),
            ..
        } = &events[0].kind
        else {
            panic!("{events:?}");
        };
        let expected = &forecast.plain.expected;
        for (reported, days) in [(chances.within_2_days, 2.0), (chances.within_30_days, 30.0)] {
            assert!((reported - expected.chance_within(days)).abs() < 1e-12);
        }
        assert!(
            causes.contains(&AlertCause::UnexplainedResidual),
            "{causes:?}"
        );
    }
}
