//! One benchmark: each new reading grows t_max, refits, and may change regime, intercept and level.

use super::drift::{self, Drift};
use super::event::{AlertState, Event, EventKind, FailureTime, InverseVelocity, RegimeReport};
use super::history::{History, Source, Taken};
use super::silence::Silence;
use crate::alert::{Entered, Evidence, Latch, Level, Policy, Transition};
use crate::fit::Rate;
use crate::forecast::{HORIZON_DAYS, InverseVelocityLine, Outlook, Panel};
use crate::reading::{BenchmarkId, Reading, SECONDS_PER_DAY, Timestamp, after_days};
use crate::regime::{Regime, Tracker, label};
use jiff::SignedDuration;

/// The line goes through this share of the rates, newest last, and no fewer than [`FEWEST_IN_LINE`].
const LINE_SHARE: f64 = 0.25;
const FEWEST_IN_LINE: usize = 8;
/// An intercept beyond this many lengths of the record is no prediction.
const FARTHEST_INTERCEPT: f64 = 3.0;

/// Rates whose median is the settled velocity.
const SETTLED: usize = 5;
/// So many readings in a row with one value are a stuck sensor, or a resolution too coarse to tell.
const STUCK: usize = 24;

/// Everything the monitor knows of one benchmark.
#[derive(Debug)]
pub(super) struct Track {
    benchmark: BenchmarkId,
    history: History,
    panel: Panel,
    regime: Tracker,
    intercept: Drift,
    transition: Drift,
    latch: Latch,
    silence: Silence,
    /// Until when something that happened asks for a look, and what.
    look: Option<(Timestamp, &'static str)>,
    faulted: bool,
    backwards: bool,
    newest: Option<Timestamp>,
}

impl Track {
    pub(super) fn new(benchmark: BenchmarkId, source: Source, epoch: Timestamp) -> Self {
        Self {
            benchmark,
            history: History::new(source, epoch),
            panel: Panel::default(),
            regime: Tracker::default(),
            intercept: Drift::default(),
            transition: Drift::default(),
            latch: Latch::default(),
            silence: Silence::default(),
            look: None,
            faulted: false,
            backwards: false,
            newest: None,
        }
    }

    pub(super) fn level(&self) -> Level {
        self.latch.level()
    }

    pub(super) fn deadline(&self) -> Option<Timestamp> {
        self.silence.deadline()
    }

    /// Takes one reading.
    pub(super) fn take(
        &mut self,
        policy: &Policy,
        source: Source,
        reading: &Reading,
    ) -> Vec<Event> {
        let taken = self.history.take(source, reading);
        let mut events: Vec<Event> = self.complaint(taken, reading.time).into_iter().collect();
        match taken {
            Taken::Known | Taken::OtherQuantity | Taken::OutOfRange(_) => return events,
            Taken::Newest => self.newest = Some(reading.time),
            // What came late or was corrected is judged at once, as of the newest reading.
            Taken::Late | Taken::Corrected(_) => {}
        }
        let time = self.newest.unwrap_or(reading.time);
        if let Some(since) = self.silence.broken_by(reading.time) {
            let text = format!("benchmark {} reads again", self.benchmark);
            events.push(self.unknown((time, since), AlertState::Resolved, text));
        }
        let outlook = self.panel.update(
            &self.history.observations,
            policy.critical_velocity_mm_per_day,
        );
        if let Some(outlook) = &outlook {
            events.extend(self.refit(policy, time, outlook));
        }
        events.extend(self.alert(policy, time, outlook.as_ref()));
        events
    }

    /// What is wrong with a reading, where something is.
    fn complaint(&mut self, taken: Taken, time: Timestamp) -> Option<Event> {
        let (kind, text) = match taken {
            Taken::Newest if self.history.identical() == STUCK => {
                let text = format!(
                    "benchmark {}: {STUCK} readings in a row are the same",
                    self.benchmark
                );
                ("stuck", text)
            }
            Taken::Newest | Taken::Known => return None,
            Taken::Late => (
                "out-of-order",
                format!("the reading of {time} came after later ones"),
            ),
            Taken::Corrected(before) => {
                let text = format!(
                    "the reading of {time} was corrected; it was {before} {}",
                    self.unit()
                );
                ("corrected", text)
            }
            Taken::OutOfRange(value) => {
                let text = format!(
                    "the reading of {time} is {value:e} {}: no slope does that",
                    self.unit()
                );
                ("out-of-range", text)
            }
            Taken::OtherQuantity if self.faulted => return None,
            Taken::OtherQuantity => {
                self.faulted = true;
                let text = format!(
                    "benchmark {} gives a second quantity; only the first is monitored",
                    self.benchmark
                );
                ("second-quantity", text)
            }
        };
        Some(self.fault(
            self.newest.map_or(time, |newest| newest.max(time)),
            kind,
            text,
        ))
    }

    /// Data time has come to `now` without a reading.
    pub(super) fn pass(&mut self, now: Timestamp) -> Vec<Event> {
        let Some(newest) = self.silence.begins(now) else {
            return Vec::new();
        };
        let latched = match self.latch.level() {
            Level::Green | Level::Unknown => String::new(),
            level @ (Level::Yellow | Level::Orange | Level::Red) => {
                format!("; {level} stays in force")
            }
        };
        let text = format!(
            "benchmark {}: no reading since {newest}{latched}",
            self.benchmark
        );
        vec![
            self.fault(now, "no-data", text.clone()),
            self.unknown((now, newest), AlertState::Firing, text),
        ]
    }

    fn refit(&mut self, policy: &Policy, time: Timestamp, outlook: &Outlook) -> Vec<Event> {
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
            vec![self.refit_event(policy, time, outlook, (line, intercept, transition))];
        events.extend(self.flip(policy, time, outlook));
        if let Some(surprise_nats) = outlook.surprise_nats {
            self.look_until(policy, time, "unexplained-residual");
            let velocity_mm_per_day = outlook.rates.last().map(|rate| rate.velocity);
            events.push(self.event(
                time,
                EventKind::UnexplainedResidual {
                    surprise_nats,
                    velocity_mm_per_day,
                },
            ));
        }
        let least = (length / 40.0).max(0.02);
        if let Some(moved) = self.intercept.update(now, intercept, least) {
            let expected = outlook
                .law
                .and_then(|law| drift::expected_by_the_law(&law, recent(&outlook.rates), now));
            if moved.to_days < moved.from_days {
                self.look_until(policy, time, "intercept-drifting-in");
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
                self.look_until(policy, time, "transition-drifting-in");
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
        outlook: &Outlook,
        (line, intercept, transition): (Option<InverseVelocityLine>, Option<f64>, Option<f64>),
    ) -> Event {
        let at = |days: Option<f64>| days.and_then(|days| after_days(self.history.epoch, days));
        let quantile = |share| {
            let days = outlook.passage.quantile(share, HORIZON_DAYS);
            at(days.map(|days| outlook.now_days + days))
        };
        self.event(
            time,
            EventKind::Refit {
                t_max: time,
                regime: report(outlook),
                failure_time: FailureTime {
                    low: quantile(0.05),
                    median: quantile(0.5),
                    high: quantile(0.95),
                    probability: outlook.passage.chance_within(HORIZON_DAYS),
                    horizon_days: HORIZON_DAYS,
                },
                inverse_velocity: InverseVelocity {
                    failure_time: at(intercept),
                    r_squared: line.map(|line| line.r_squared),
                },
                transition_time: at(transition),
                velocity_mm_per_day: outlook.rates.last().map(|rate| rate.velocity),
                chance_within_evacuation_time: outlook
                    .passage
                    .chance_within(days(policy.evacuation_time)),
                chance_within_outlook: outlook.passage.chance_within(days(policy.outlook)),
            },
        )
    }

    fn flip(&mut self, policy: &Policy, time: Timestamp, outlook: &Outlook) -> Option<Event> {
        let flip = self.regime.update(&outlook.regimes)?;
        if flip.to == Regime::UnstableAccelerating && flip.from != Regime::Undetermined {
            self.look_until(policy, time, "regime-flip");
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
        moved: drift::Moved,
        kind: impl FnOnce(Timestamp, Timestamp) -> EventKind,
    ) -> Option<Event> {
        let from = after_days(self.history.epoch, moved.from_days)?;
        let to = after_days(self.history.epoch, moved.to_days)?;
        Some(self.event(time, kind(from, to)))
    }

    fn alert(&mut self, policy: &Policy, time: Timestamp, outlook: Option<&Outlook>) -> Vec<Event> {
        let within = |span| outlook.map(|o| o.passage.chance_within(days(span)));
        let rates = outlook.map_or(&[][..], |outlook| &outlook.rates);
        let mut evidence = Evidence {
            now: time,
            chance_within_evacuation_time: within(policy.evacuation_time),
            chance_within_outlook: within(policy.outlook),
            velocity_mm_per_day: rates.last().map_or_else(
                || self.history.newest_velocity(),
                |rate| Some(rate.velocity),
            ),
            settled_velocity_mm_per_day: settled(rates),
            displacement_mm: self.history.displacement_mm(),
            acceleration_mm_per_day2: acceleration(rates),
            causes: self
                .look
                .filter(|(until, _)| time < *until)
                .map(|(_, cause)| cause)
                .into_iter()
                .collect(),
        };
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
            self.look_until(policy, time, "moves-backwards");
            evidence.causes.push("moves-backwards");
        }
        let transitions = self.latch.update(policy, &evidence);
        let told = transitions
            .iter()
            .map(|change| self.alert_event(time, policy, &evidence, change));
        events.extend(told);
        events
    }

    fn alert_event(
        &self,
        time: Timestamp,
        policy: &Policy,
        evidence: &Evidence,
        change: &Transition,
    ) -> Event {
        let state = match change.entered {
            Entered::Yes => AlertState::Firing,
            Entered::No => AlertState::Resolved,
        };
        let key = format!("{}/{}/{}", self.benchmark, change.level, change.since);
        let text = self.text(policy, evidence, change);
        self.event(
            time,
            EventKind::Alert {
                level: change.level,
                state,
                key,
                rule: change.rule.to_owned(),
                text,
            },
        )
    }

    fn text(&self, policy: &Policy, evidence: &Evidence, change: &Transition) -> String {
        let verb = match change.entered {
            Entered::Yes => "",
            Entered::No => " ends",
        };
        let velocity = evidence
            .velocity_mm_per_day
            .map_or_else(String::new, |velocity| {
                format!("; velocity {velocity:.3} mm/day")
            });
        let chance = |name: &str, chance: Option<f64>, span: SignedDuration| {
            chance.map_or_else(String::new, |chance| {
                let hours = span.as_secs() / 3600;
                format!("; chance {chance:.2} within {name} ({hours} h)")
            })
        };
        format!(
            "benchmark {}: {}{verb} ({}){}{}{velocity}; failure is {} mm/day",
            self.benchmark,
            change.level,
            change.rule,
            chance(
                "the evacuation time",
                evidence.chance_within_evacuation_time,
                policy.evacuation_time
            ),
            chance(
                "the outlook",
                evidence.chance_within_outlook,
                policy.outlook
            ),
            policy.critical_velocity_mm_per_day,
        )
    }

    fn look_until(&mut self, policy: &Policy, time: Timestamp, cause: &'static str) {
        self.look = time
            .checked_add(policy.steady_for)
            .ok()
            .map(|until| (until, cause));
    }

    /// A silence that began after the reading of `since`: part of the key, so that each is told anew.
    fn unknown(
        &self,
        (time, since): (Timestamp, Timestamp),
        state: AlertState,
        text: String,
    ) -> Event {
        let kind = EventKind::Alert {
            level: Level::Unknown,
            state,
            key: format!("{}/{}/{since}", self.benchmark, Level::Unknown),
            rule: "no-data".to_owned(),
            text,
        };
        self.event(time, kind)
    }

    fn fault(&self, time: Timestamp, kind: &str, text: String) -> Event {
        self.event(
            time,
            EventKind::Fault {
                kind: kind.to_owned(),
                text,
            },
        )
    }

    fn event(&self, time: Timestamp, kind: EventKind) -> Event {
        Event {
            time,
            kind,
            benchmark: Some(self.benchmark.clone()),
        }
    }

    fn unit(&self) -> &'static str {
        match self.history.observations.quantity {
            crate::reading::Quantity::Displacement => "mm",
            crate::reading::Quantity::Velocity => "mm/day",
        }
    }
}

/// The newest rates, through which the line goes.
fn recent(rates: &[Rate]) -> &[Rate] {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count within the slice"
    )]
    let share = (rates.len() as f64 * LINE_SHARE).round() as usize;
    &rates[rates.len().saturating_sub(share.max(FEWEST_IN_LINE))..]
}

/// Whether all of the latest rates stand clear of their noise on the wrong side of zero.
fn moves_backwards(rates: &[Rate]) -> bool {
    let latest = &rates[rates.len().saturating_sub(SETTLED)..];
    latest.len() == SETTLED
        && latest
            .iter()
            .all(|rate| rate.velocity < -3.0 * rate.sigma && rate.velocity < 0.0)
}

/// The median of the latest rates, mm/day.
fn settled(rates: &[Rate]) -> Option<f64> {
    let mut latest: Vec<f64> = rates
        .iter()
        .rev()
        .take(SETTLED)
        .map(|rate| rate.velocity)
        .collect();
    latest.sort_by(f64::total_cmp);
    latest.get(latest.len() / 2).copied()
}

fn acceleration(rates: &[Rate]) -> Option<f64> {
    let [.., before, newest] = rates else {
        return None;
    };
    let span = newest.middle() - before.middle();
    (span > 0.0).then(|| (newest.velocity - before.velocity) / span)
}

fn report(outlook: &Outlook) -> RegimeReport {
    let of = |regime| outlook.regimes.get(&regime).copied().unwrap_or(0.0);
    RegimeReport {
        label: label(&outlook.regimes),
        probability_unstable: of(Regime::UnstableAccelerating) + of(Regime::UnstableDecelerating),
        probability_accelerating: of(Regime::UnstableAccelerating) + of(Regime::StableAccelerating),
        probabilities: outlook.regimes.clone(),
    }
}

fn days(span: SignedDuration) -> f64 {
    span.as_secs_f64() / SECONDS_PER_DAY
}
