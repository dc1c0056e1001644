//! From a refit to the level in force, and the words for it.

use super::{Alarm, BesideForecast};
use crate::alert::{
    AlertCause, AlertEvidence, Entered, Level, Policy, REPORTED_CHANCE, RedCourse, Transition,
    percent_in_words, span_in_words,
};
use crate::forecast::HORIZON_DAYS;
use crate::monitor::event::{AlertState, CalledLevel, Event, EventKind, LevelChance};
use crate::monitor::motion::{are_first, moves_backwards, settled};
use crate::monitor::track::forecast::{EARLY, Forecast, LookAhead};
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::{Timestamp, days_of, figure, shortest};
use jiff::SignedDuration;

impl Alarm {
    /// The level that follows from the evidence; the refit among the events in `refit` gets what it calls for.
    pub(super) fn alert(
        &mut self,
        beside: BesideForecast<'_>,
        policy: &Policy,
        time: Timestamp,
        forecast: Option<&Forecast>,
        refit: &mut [Event],
    ) -> Vec<Event> {
        let record = beside.record;
        let ahead = LookAhead::of(policy, forecast);
        let rates = forecast.map_or(&[][..], |forecast| &forecast.plain.rates);
        let attention = (self.attention_until).filter(|(until, _)| time < *until);
        let mut evidence = ahead.evidence(policy, forecast, beside.evidence(policy, time, rates));
        evidence.causes = attention.map(|(_, cause)| cause).into_iter().collect();
        let mut events: Vec<Event> = Vec::new();
        // Until it moves forward again: one reading more or less does not change the matter.
        let still = self.backwards && settled(rates).is_some_and(|velocity| velocity < 0.0);
        let was_backwards = std::mem::replace(&mut self.backwards, still || moves_backwards(rates));
        if self.backwards && !was_backwards {
            let text = format!(
                "benchmark {} moves upslope: is the sign of its readings right? Where they fall as it moves downslope, \
                 components = [\"COLUMN\"] and direction = [-1] in its [[benchmark]] say so",
                record.benchmark()
            );
            events.push(record.fault(time, "moves-backwards", text));
        }
        if self.backwards {
            let cause = AlertCause::MovesBackwards;
            if was_backwards {
                self.attend_further(policy, time, cause);
            } else {
                self.note_cause(policy, time, cause);
            }
            evidence.causes.push(cause);
        }
        evidence.unusual = self.occurrences.calling(time);
        evidence.early_quantile_days = forecast.and_then(|forecast| {
            let outlook = forecast.in_force(days_of(policy.outlook));
            outlook.collapse.quantile(EARLY, HORIZON_DAYS)
        });
        evidence.was_red = self.was_red(policy, time);
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
            .map(|change| alert_event(record, time, policy, &evidence, ahead, change));
        events.extend(reported);
        events
    }

    /// Whether red was in force of late, before `time`.
    fn was_red(&self, policy: &Policy, time: Timestamp) -> bool {
        let since = time.saturating_sub(policy.red_of_late());
        since.is_ok_and(|since| self.levels.was_red_since(since))
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
            within_hours: days_of(span) * 24.0,
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

    /// A rule that the config has changed begins again, though it has the same name.
    pub(in crate::monitor::track) fn forget_changed_rules(
        &mut self,
        before: &Policy,
        now: &Policy,
    ) {
        self.held.forget_changed(before, now);
    }

    /// The config has changed from `former`: what the newest reading, of `time`, passes of the new thresholds and rules and did not pass
    /// of the former ones is called at once, not with the next reading.
    pub(in crate::monitor::track) fn raise_by_change(
        &mut self,
        beside: BesideForecast<'_>,
        former: &Policy,
        policy: &Policy,
        time: Timestamp,
    ) -> Option<Event> {
        if former.thresholds == policy.thresholds && former.rules == policy.rules {
            return None;
        }
        let evidence = beside.evidence(policy, time, &beside.record.history().rates());
        let is_more = policy.call(&evidence).level > former.call(&evidence).level;
        is_more.then(|| self.raise(beside, policy, time)).flatten()
    }

    /// Between two refits: plain thresholds and the site's own rules act at every reading, and the critical velocity before there is a
    /// forecast. They may raise the level; it falls only where there is a forecast too.
    pub(in crate::monitor::track) fn raise(
        &mut self,
        beside: BesideForecast<'_>,
        policy: &Policy,
        time: Timestamp,
    ) -> Option<Event> {
        let record = beside.record;
        let is_asked = !policy.thresholds.is_empty() || !policy.rules.is_empty();
        if !is_asked && !are_first(record.observations()) {
            return None;
        }
        // The rates are those of the whole record: only where they can matter.
        let needs_rates = policy.needs_rates();
        let mut evidence = if needs_rates {
            beside.evidence(policy, time, &record.history().rates())
        } else {
            beside.evidence(policy, time, &[])
        };
        self.held.update(policy, &mut evidence);
        if policy.call(&evidence).level <= self.latch.level() {
            return None;
        }
        if !needs_rates {
            evidence = AlertEvidence {
                due: evidence.due,
                ..beside.evidence(policy, time, &record.history().rates())
            };
        }
        let change = self.latch.raise(policy, &evidence)?;
        self.levels.note(time, &self.latch);
        let ahead = LookAhead::of(policy, None);
        Some(alert_event(record, time, policy, &evidence, ahead, &change))
    }
}

fn alert_event(
    record: &BenchmarkRecord,
    time: Timestamp,
    policy: &Policy,
    evidence: &AlertEvidence,
    ahead: LookAhead,
    change: &Transition,
) -> Event {
    let text = text(record, policy, evidence, ahead, change);
    alert_of(record, time, change, text)
}

pub(super) fn alert_of(
    record: &BenchmarkRecord,
    time: Timestamp,
    change: &Transition,
    text: String,
) -> Event {
    let state = match change.entered {
        Entered::Yes => AlertState::Firing,
        Entered::No => AlertState::Resolved,
    };
    let kind = EventKind::Alert {
        level: change.level,
        state,
        key: record.alert_key(change.level, change.since),
        rule: change.rule.clone().into_owned(),
        text,
    };
    record.event(time, kind)
}

fn text(
    record: &BenchmarkRecord,
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
            format!("; velocity {} mm/day", figure(velocity, 3))
        });
    let grounds = grounds(policy, evidence, &change.rule);
    let chance = |chance: Option<f64>, span: SignedDuration, name: &str| {
        chance.map_or_else(String::new, |chance| {
            let (chance, span) = (percent_in_words(chance), span_in_words(span));
            format!("; chance of collapse {chance} within {span} ({name})")
        })
    };
    let of_levels = match change.rule.as_ref() {
        REPORTED_CHANCE => (evidence.chance_within_outlook).map_or_else(String::new, |counted| {
            format!(", of which levels count {}", percent_in_words(counted))
        }),
        _ => String::new(),
    };
    let within_outlook = match change.rule.as_ref() {
        REPORTED_CHANCE => evidence.reported_within_outlook,
        _ => evidence.chance_within_outlook,
    };
    let is_pending = change.level == Level::Orange && evidence.red == RedCourse::IsNear;
    let pending = if is_pending && change.entered == Entered::Yes {
        policy.pending_red_in_words()
    } else {
        String::new()
    };
    let of_outlook = if ahead.orange < policy.outlook {
        let outlook = span_in_words(policy.outlook);
        format!("five times the record's length, shorter than the outlook of {outlook}")
    } else {
        "the outlook".to_owned()
    };
    let of_red = format!(
        "{} and until the next reading",
        policy.red_within_in_words()
    );
    format!(
        "benchmark {}: {}{verb}{grounds}{}{pending}{}{of_levels}{velocity}; critical velocity {} mm/day; rule {}",
        record.benchmark(),
        change.level,
        chance(evidence.chance_for_red, ahead.red, &of_red),
        chance(within_outlook, ahead.orange, &of_outlook),
        shortest(policy.critical_velocity_mm_per_day),
        change.rule,
    )
}

/// The figures that a rule rests on, where the text has them nowhere else.
fn grounds(policy: &Policy, evidence: &AlertEvidence, rule: &str) -> String {
    let shown = |name: &str, value: Option<f64>, unit: &str| {
        value.map_or_else(String::new, |value| {
            format!("; {name} {} {unit}", figure(value, 3))
        })
    };
    match (rule, policy.declared_rule(rule)) {
        (_, Some(declared)) => format!("; {}", declared.words(Some(evidence))),
        ("displacement-threshold", None) => shown(
            "displacement since the first reading",
            evidence.displacement_mm,
            "mm",
        ),
        ("acceleration-threshold", None) => shown(
            "acceleration",
            evidence.acceleration_mm_per_day2,
            "mm/day per day",
        ),
        _ => String::new(),
    }
}
