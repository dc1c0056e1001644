//! A crisis as it unfolds: one row for some refits and for everything that changes.

use super::crisis::Crisis;
use crate::alert::Level;
use crate::monitor::{AlertState, Event, EventKind, FailureTime, Unexplained};
use crate::reading::{BenchmarkId, Timestamp, days_since};
use std::collections::BTreeMap;
use std::fmt::Write;

/// What became of one benchmark, for the table at the end.
#[derive(Debug, Clone, Default)]
pub(super) struct Record {
    pub(super) first: BTreeMap<Level, Timestamp>,
    pub(super) level: Option<Level>,
    pub(super) forecasts: Vec<(Timestamp, FailureTime)>,
    refits: usize,
}

/// Follows the events of one crisis.
#[derive(Debug)]
pub(super) struct Timeline {
    /// Refits between two rows.
    every: usize,
    pub(super) records: BTreeMap<BenchmarkId, Record>,
}

/// The columns' heads.
pub(super) const HEAD: &str = "t_max       point    v mm/day  regime (probability)          failure: median [5 % .. 95 %]          1/v is zero  level";

impl Timeline {
    pub(super) fn new(crisis: &Crisis, readings: usize) -> Self {
        let rows = 14;
        Self {
            every: (readings / rows / crisis.benchmarks.len()).max(1),
            records: BTreeMap::new(),
        }
    }

    /// The row or line for an event, where it is worth one.
    pub(super) fn tell(&mut self, event: &Event) -> Option<String> {
        let id = event.benchmark.as_ref()?;
        let record = self.records.entry(id.clone()).or_default();
        match &event.kind {
            EventKind::Refit { failure_time, .. } => {
                record.forecasts.push((event.time, *failure_time));
                record.refits += 1;
                (record.refits % self.every == 1 || self.every == 1)
                    .then(|| row(id, event, record.level))
                    .flatten()
            }
            EventKind::Alert {
                level, state, rule, ..
            } => {
                match state {
                    AlertState::Firing if *level != Level::Unknown => {
                        record.first.entry(*level).or_insert(event.time);
                        record.level = Some(*level);
                    }
                    AlertState::Resolved if record.level == Some(*level) => record.level = None,
                    AlertState::Firing | AlertState::Resolved => {}
                }
                let verb = if *state == AlertState::Firing {
                    "begins"
                } else {
                    "ends"
                };
                Some(format!(
                    "{}  {id:<8} >>> {level} {verb} ({rule})",
                    day(event.time)
                ))
            }
            EventKind::RegimeFlip {
                from,
                to,
                probability,
            } => Some(format!(
                "{}  {id:<8}   regime flips from {from} to {to} ({probability:.2})",
                day(event.time)
            )),
            EventKind::InterceptDrift { .. } | EventKind::TransitionDrift { .. } => {
                drift(id, event)
            }
            EventKind::UnexplainedResidual(what) => Some(format!(
                "{}  {id:<8}   {}",
                day(event.time),
                unexplained(what)
            )),
            EventKind::EffectFound {
                effect, channel, ..
            } => Some(format!(
                "{}  {id:<8}   consistent with {effect} {}",
                day(event.time),
                channel.as_deref().unwrap_or("")
            )),
            EventKind::EffectDropped { effect, .. } => Some(format!(
                "{}  {id:<8}   no longer consistent with {effect}",
                day(event.time)
            )),
            EventKind::Fault { kind, .. } => {
                Some(format!("{}  {id:<8}   fault: {kind}", day(event.time)))
            }
            EventKind::Declared { text, .. } | EventKind::Correction { text, .. } => {
                Some(format!("{}  {text}", day(event.time)))
            }
            EventKind::Order { .. } | EventKind::Summary(_) => None,
        }
    }
}

fn unexplained(what: &Unexplained) -> String {
    match what {
        Unexplained::Reading {
            velocity_mm_per_day,
            ..
        } => format!(
            "a reading that nobody expected: {:.1} mm/day",
            velocity_mm_per_day.unwrap_or(f64::NAN)
        ),
        Unexplained::Structure { load_sd, since, .. } => format!(
            "its velocity wanders by {load_sd:.1} e-folds about the law since {}",
            day(*since)
        ),
    }
}

fn drift(id: &BenchmarkId, event: &Event) -> Option<String> {
    let (what, from, to, figures) = match &event.kind {
        EventKind::InterceptDrift {
            from,
            to,
            drift_days_per_day,
            expected_days_per_day,
        } => {
            let expected = expected_days_per_day.map_or_else(String::new, |drift| {
                // Rounded here: a minus nought reads like a mistake.
                let drift = (10.0 * drift).round() / 10.0 + 0.0;
                format!(", {drift:+.1} expected by the fitted law")
            });
            (
                "1/v intercept",
                from,
                to,
                format!(" ({drift_days_per_day:+.1} days a day{expected})"),
            )
        }
        EventKind::TransitionDrift { from, to, .. } => ("transition time", from, to, String::new()),
        EventKind::Refit { .. }
        | EventKind::RegimeFlip { .. }
        | EventKind::UnexplainedResidual(_)
        | EventKind::EffectFound { .. }
        | EventKind::EffectDropped { .. }
        | EventKind::Alert { .. }
        | EventKind::Fault { .. }
        | EventKind::Declared { .. }
        | EventKind::Correction { .. }
        | EventKind::Order { .. }
        | EventKind::Summary(_) => return None,
    };
    let (from, to) = (day(*from), day(*to));
    Some(format!(
        "{}  {id:<8}   {what} drifts from {from} to {to}{figures}",
        day(event.time)
    ))
}

fn row(id: &BenchmarkId, event: &Event, level: Option<Level>) -> Option<String> {
    let EventKind::Refit {
        regime,
        failure_time,
        inverse_velocity,
        velocity_mm_per_day,
        ..
    } = &event.kind
    else {
        return None;
    };
    let probability = regime.probabilities.get(&regime.label).copied();
    let sure = probability.map_or_else(String::new, |p| format!(" ({p:.2})"));
    let mut line = format!("{}  {:<8}", day(event.time), id.as_str());
    let velocity = velocity_mm_per_day.unwrap_or(f64::NAN);
    let _ = write!(
        line,
        " {velocity:>8.2}  {:<29}",
        format!("{}{sure}", regime.label)
    );
    let _ = write!(line, " {:<38}", forecast(failure_time));
    let zero = inverse_velocity
        .failure_time
        .map_or_else(|| "-".to_owned(), day);
    let _ = write!(line, " {zero:<12} {}", level.unwrap_or(Level::Green));
    Some(line)
}

/// `1963-10-09 [10-08 .. 10-12] 0.98`, or how unlikely failure is.
fn forecast(failure: &FailureTime) -> String {
    let Some(median) = failure.median else {
        return format!(
            "none likely ({:.2} in {:.0} days)",
            failure.probability, failure.horizon_days
        );
    };
    let short = |time: Option<Timestamp>| time.map_or_else(|| "never".to_owned(), day);
    format!(
        "{} [{} .. {}]",
        day(median),
        &short(failure.low),
        &short(failure.high)
    )
}

/// The date alone.
pub(super) fn day(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d").to_string()
}

/// Days from `time` to `end`, as words.
pub(super) fn lead(end: Timestamp, time: Timestamp) -> String {
    format!("{:.1} d before", days_since(time, end))
}
