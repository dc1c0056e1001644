//! What a refit says: the regime, the failure time, and predicted times that moved.

use super::call::EARLY;
use super::forecast::Forecast;
use super::{Track, days};
use crate::alert::{AlertCause, Policy};
use crate::forecast::{HORIZON_DAYS, InverseVelocityLine, Outlook, Passage};
use crate::monitor::drift;
use crate::monitor::event::{
    Event, EventKind, FailureTime, InverseVelocity, Plain, RegimeReport, Unexplained,
};
use crate::monitor::recent;
use crate::reading::{Timestamp, after_days};
use crate::regime::{Regime, label};

/// An intercept beyond this many lengths of the record is no prediction.
const FARTHEST_INTERCEPT: f64 = 3.0;

impl Track {
    pub(super) fn refit(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: &Forecast,
    ) -> Vec<Event> {
        // The line and the inflection are those of what is observed, whatever explains it.
        let outlook = &forecast.plain;
        let now = outlook.now_days;
        let line = InverseVelocityLine::fit(recent(&outlook.rates));
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
        let mut events =
            vec![self.refit_event(policy, time, forecast, line, intercept, transition)];
        events.extend(self.flip(policy, time, forecast.in_force(days(policy.outlook))));
        events.extend(self.surprise(policy, time, forecast));
        let least = (length / 40.0).max(0.02);
        events.extend(self.drifts(policy, time, outlook, intercept, transition, least));
        events
    }

    /// A reading that the law in force did not expect.
    fn surprise(&mut self, policy: &Policy, time: Timestamp, forecast: &Forecast) -> Option<Event> {
        let surprise_nats = forecast.surprise_nats()?;
        if self.declared.is_shaken(time) {
            return None;
        }
        self.look_until(policy, time, AlertCause::UnexplainedResidual);
        let unexplained = Unexplained::Reading {
            surprise_nats,
            velocity_mm_per_day: forecast.plain.rates.last().map(|rate| rate.velocity),
        };
        Some(self.event(time, EventKind::UnexplainedResidual(unexplained)))
    }

    /// What of the intercept and the transition time has moved, by `least` days.
    fn drifts(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        outlook: &Outlook,
        intercept: Option<f64>,
        transition: Option<f64>,
        least: f64,
    ) -> Vec<Event> {
        let now = outlook.now_days;
        let mut events = Vec::new();
        if let Some(moved) = self.intercept.update(now, intercept, least) {
            let expected = outlook
                .law
                .and_then(|law| drift::expected_by_the_law(&law, recent(&outlook.rates), now));
            if moved.to_days < moved.from_days {
                self.look_until(policy, time, AlertCause::InterceptDriftingIn);
            }
            events.extend(
                self.drift_event(time, moved, |from, to| EventKind::InterceptDrift {
                    from,
                    to,
                    drift_days_per_day: moved.drift_days_per_day,
                    expected_days_per_day: expected,
                }),
            );
        }
        if let Some(moved) = self.transition.update(now, transition, 2.0 * least) {
            if moved.to_days < moved.from_days {
                self.look_until(policy, time, AlertCause::TransitionDriftingIn);
            }
            events.extend(
                self.drift_event(time, moved, |from, to| EventKind::TransitionDrift {
                    from,
                    to,
                    drift_days_per_day: moved.drift_days_per_day,
                }),
            );
        }
        events
    }

    fn refit_event(
        &self,
        policy: &Policy,
        time: Timestamp,
        forecast: &Forecast,
        line: Option<InverseVelocityLine>,
        intercept: Option<f64>,
        transition: Option<f64>,
    ) -> Event {
        let at = |days: Option<f64>| days.and_then(|days| after_days(self.history.epoch, days));
        let outlook = forecast.in_force(days(policy.outlook));
        let plain = forecast.known_load.as_ref().map(|known_load| {
            Box::new(Plain {
                regime: report(&forecast.plain),
                failure_time: self.reported(forecast.plain.now_days, &forecast.plain.collapse),
                is_explained: known_load.is_explained,
            })
        });
        self.event(
            time,
            EventKind::Refit {
                t_max: time,
                regime: report(outlook),
                failure_time: self.reported(outlook.now_days, &outlook.collapse),
                critical_velocity_time: Box::new(self.reported(outlook.now_days, &outlook.passage)),
                probability_of_acceleration: outlook.accelerating,
                inverse_velocity: InverseVelocity {
                    failure_time: at(intercept),
                    r_squared: line.map(|line| line.r_squared),
                },
                transition_time: at(transition),
                velocity_mm_per_day: forecast.plain.rates.last().map(|rate| rate.velocity),
                chance_within_evacuation_time: forecast.chance_within(days(policy.evacuation_time)),
                chance_within_outlook: forecast.chance_within(days(policy.outlook)),
                called: None,
                plain,
            },
        )
    }

    fn reported(&self, now_days: f64, passage: &Passage) -> FailureTime {
        let quantile = |share| {
            let days = passage.quantile(share, HORIZON_DAYS)?;
            after_days(self.history.epoch, now_days + days)
        };
        FailureTime {
            low: quantile(EARLY),
            median: quantile(0.5),
            high: quantile(0.95),
            probability: passage.chance_within(HORIZON_DAYS),
            horizon_days: HORIZON_DAYS,
        }
    }

    fn flip(&mut self, policy: &Policy, time: Timestamp, outlook: &Outlook) -> Option<Event> {
        let flip = self.regime.update(&outlook.regimes)?;
        if flip.to == Regime::UnstableAccelerating && flip.from != Regime::Undetermined {
            self.look_until(policy, time, AlertCause::RegimeFlip);
        }
        let kind = EventKind::RegimeFlip {
            from: flip.from,
            to: flip.to,
            probability: flip.probability,
        };
        Some(self.event(time, kind))
    }

    fn drift_event(
        &self,
        time: Timestamp,
        moved: drift::MovedIntercept,
        kind: impl FnOnce(Timestamp, Timestamp) -> EventKind,
    ) -> Option<Event> {
        let from = after_days(self.history.epoch, moved.from_days)?;
        let to = after_days(self.history.epoch, moved.to_days)?;
        Some(self.event(time, kind(from, to)))
    }
}

fn report(outlook: &Outlook) -> RegimeReport {
    let of = |regime| outlook.regimes.get(&regime).copied().unwrap_or(0.0);
    RegimeReport {
        label: label(&outlook.regimes),
        probability_unstable: of(Regime::UnstableAccelerating) + of(Regime::UnstableDecelerating),
        probability_accelerating: of(Regime::UnstableAccelerating) + of(Regime::StableAccelerating),
        probabilities: outlook.regimes.clone(),
        r_per_day: outlook.law.map(|law| law.r),
        kappa_per_day: outlook.law.map(|law| law.kappa),
    }
}
