//! From a refit to the level in force, and the words for it.

use super::forecast::{Forecast, LookAhead};
use super::{Track, days};
use crate::alert::{
    AlertCause, AlertEvidence, Entered, Policy, Transition, chance_in_words, hours_in_words,
};
use crate::fit::Rate;
use crate::forecast::HORIZON_DAYS;
use crate::monitor::event::{AlertState, CalledLevel, Event, EventKind, LevelChance};
use crate::monitor::motion::{moves_backwards, observed, settled};
use crate::reading::Timestamp;
use jiff::SignedDuration;

/// The early quantile of the time of collapse that rules may ask for, as reported.
pub(super) const EARLY: f64 = 0.05;

impl Track {
    /// The level that follows from the evidence; the refit among the events in `refit` gets what it calls for.
    pub(super) fn alert(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: Option<&Forecast>,
        refit: &mut [Event],
    ) -> Vec<Event> {
        let ahead = LookAhead::of(policy, forecast);
        let rates = forecast.map_or(&[][..], |forecast| &forecast.plain.rates);
        let look = self.look.filter(|(until, _)| time < *until);
        let mut evidence = ahead.evidence(policy, forecast, self.observed(time, rates));
        evidence.causes = look.map(|(_, cause)| cause).into_iter().collect();
        let mut events: Vec<Event> = Vec::new();
        // Until it moves forward again: one reading more or less does not change the matter.
        let still = self.backwards && settled(rates).is_some_and(|velocity| velocity < 0.0);
        let was_backwards = std::mem::replace(&mut self.backwards, still || moves_backwards(rates));
        if self.backwards && !was_backwards {
            let text = format!(
                "benchmark {} moves upslope: is the sign of its readings right?",
                self.benchmark
            );
            events.push(self.fault(time, "moves-backwards", text));
        }
        if self.backwards {
            self.look_until(policy, time, AlertCause::MovesBackwards);
            evidence.causes.push(AlertCause::MovesBackwards);
        }
        evidence.early_quantile_days = forecast.and_then(|forecast| {
            let outlook = forecast.in_force(days(policy.outlook));
            outlook.collapse.quantile(EARLY, HORIZON_DAYS)
        });
        self.held.update(policy, &mut evidence);
        for event in refit {
            if let EventKind::Refit { called, .. } = &mut event.kind {
                *called = self.called(policy, &evidence, ahead).map(Box::new);
            }
        }
        let transitions = self.latch.update(policy, &evidence);
        self.levels.note(time, &self.latch);
        let reported = transitions
            .iter()
            .map(|change| self.alert_event(time, policy, &evidence, ahead, change));
        events.extend(reported);
        events
    }

    /// What the evidence calls for by itself; `None` without a forecast.
    fn called(
        &self,
        policy: &Policy,
        evidence: &AlertEvidence,
        ahead: LookAhead,
    ) -> Option<CalledLevel> {
        let call = policy.call(evidence);
        let of = |chance: f64, span: SignedDuration, at_least: f64| LevelChance {
            chance,
            within_hours: days(span) * 24.0,
            at_least,
        };
        let red = evidence.chance_for_red?;
        let outlook = evidence.chance_within_outlook?;
        Some(CalledLevel {
            level: call.level,
            rule: call.rule.into_owned(),
            pending: self.held.pending(policy, evidence),
            red: of(red, ahead.red, policy.red_chance),
            orange: of(outlook, ahead.orange, policy.orange_chance),
            yellow: of(outlook, ahead.orange, policy.yellow_chance),
        })
    }

    /// A rule that the config has changed begins anew, though it has the same name.
    pub(in crate::monitor) fn forget_changed_rules(&mut self, before: &Policy, now: &Policy) {
        self.held.forget_changed(before, now);
    }

    /// Between two refits: plain thresholds and the site's own rules act at every reading. They may raise the level; it
    /// falls only where there is a forecast too.
    pub(super) fn raise(&mut self, policy: &Policy, time: Timestamp) -> Option<Event> {
        if policy.thresholds.is_empty() && policy.rules.is_empty() {
            return None;
        }
        // The rates are those of the whole record: only where they can matter.
        let needs_rates = policy.needs_rates();
        let mut evidence = if needs_rates {
            self.observed(time, &self.history.rates())
        } else {
            self.observed(time, &[])
        };
        self.held.update(policy, &mut evidence);
        if policy.call(&evidence).level <= self.latch.level() {
            return None;
        }
        if !needs_rates {
            evidence = AlertEvidence {
                due: evidence.due,
                ..self.observed(time, &self.history.rates())
            };
        }
        let change = self.latch.raise(policy, &evidence)?;
        self.levels.note(time, &self.latch);
        Some(self.alert_event(
            time,
            policy,
            &evidence,
            LookAhead::of(policy, None),
            &change,
        ))
    }

    /// What the readings show by themselves.
    fn observed(&self, time: Timestamp, rates: &[Rate]) -> AlertEvidence {
        AlertEvidence {
            has_effect: self.watch.has_effect(),
            ..observed(&self.history.observations, rates, time)
        }
    }

    fn alert_event(
        &self,
        time: Timestamp,
        policy: &Policy,
        evidence: &AlertEvidence,
        ahead: LookAhead,
        change: &Transition,
    ) -> Event {
        let text = self.text(policy, evidence, ahead, change);
        self.alert_of(time, change, text)
    }

    pub(super) fn alert_of(&self, time: Timestamp, change: &Transition, text: String) -> Event {
        let state = match change.entered {
            Entered::Yes => AlertState::Firing,
            Entered::No => AlertState::Resolved,
        };
        let kind = EventKind::Alert {
            level: change.level,
            state,
            key: format!("{}/{}/{}", self.benchmark, change.level, change.since),
            rule: change.rule.clone().into_owned(),
            text,
        };
        self.event(time, kind)
    }

    fn text(
        &self,
        policy: &Policy,
        evidence: &AlertEvidence,
        ahead: LookAhead,
        change: &Transition,
    ) -> String {
        let verb = match change.entered {
            Entered::Yes => "",
            Entered::No => " ends",
        };
        let velocity = evidence
            .velocity_mm_per_day
            .map_or_else(String::new, |velocity| {
                format!("; velocity {velocity:.3} mm/day")
            });
        let grounds = grounds(policy, evidence, &change.rule);
        let chance = |name: &str, chance: Option<f64>, span: SignedDuration| {
            chance.map_or_else(String::new, |chance| {
                let chance = chance_in_words(chance);
                format!("; chance {chance} within {name} ({})", hours_in_words(span))
            })
        };
        let outlook = if ahead.orange < policy.outlook {
            format!(
                "five times the record's length, which is shorter than the outlook of {},",
                hours_in_words(policy.outlook)
            )
        } else {
            "the outlook".to_owned()
        };
        format!(
            "benchmark {}: {}{verb} ({}){grounds}{}{}{velocity}; the critical velocity is {} mm/day",
            self.benchmark,
            change.level,
            change.rule,
            chance(
                &format!(
                    "{} and until the next reading",
                    policy.red_within_in_words()
                ),
                evidence.chance_for_red,
                ahead.red
            ),
            chance(&outlook, evidence.chance_within_outlook, ahead.orange),
            policy.critical_velocity_mm_per_day,
        )
    }
}

/// The figures that a rule rests on, where the text has them nowhere else.
fn grounds(policy: &Policy, evidence: &AlertEvidence, rule: &str) -> String {
    let figure = |name: &str, value: Option<f64>, unit: &str| {
        value.map_or_else(String::new, |value| format!("; {name} {value:.3} {unit}"))
    };
    match (rule, policy.declared_rule(rule)) {
        (_, Some(declared)) => format!("; {}", declared.words(Some(evidence))),
        ("displacement-threshold", None) => figure(
            "displacement since the first reading",
            evidence.displacement_mm,
            "mm",
        ),
        ("acceleration-threshold", None) => figure(
            "acceleration",
            evidence.acceleration_mm_per_day2,
            "mm/day per day",
        ),
        _ => String::new(),
    }
}
