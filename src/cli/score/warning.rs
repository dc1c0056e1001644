//! Which levels would have been called, and how long before the failure.

use super::hours;
use crate::alert::{Level, Policy};
use crate::cli::replay;
use crate::monitor::{Event, Settings, levels_in};
use crate::reading::{BenchmarkId, Channel, DAYS_PER_YEAR, Recording, Series, TimeSpan, Timestamp};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Hours in a year.
const YEAR_HOURS: f64 = DAYS_PER_YEAR * 24.0;

/// The levels in force over a record, up to the failure where there was one.
#[derive(Debug, Clone, Default, PartialEq, JsonSchema, Serialize)]
pub(super) struct Warning {
    /// When each was first called.
    pub(super) first_yellow: Option<Timestamp>,
    /// See `first_yellow`.
    pub(super) first_orange: Option<Timestamp>,
    /// See `first_yellow`.
    pub(super) first_red: Option<Timestamp>,
    /// Hours each was in force.
    pub(super) hours_at: BTreeMap<Level, f64>,
    /// Hours of record.
    pub(super) hours: f64,
    /// Hours of orange or red in a year of it.
    pub(super) hours_per_year: f64,
}

/// Replays the series, and keeps when levels began and ended until `until`.
pub(super) fn of(
    series: &Series,
    channels: &[Channel],
    policy: &Policy,
    until: Timestamp,
) -> anyhow::Result<Warning> {
    let recording = Recording {
        series: vec![series.clone()],
        channels: channels.to_vec(),
        ..Recording::default()
    };
    let settings = Settings {
        policy: policy.clone(),
        ..Settings::default()
    };
    let events = replay::events(&recording, &settings, Some(until))?;
    let first = series.readings.first().map_or(until, |first| first.time);
    Ok(warning(&events, &series.benchmark, first, until))
}

fn warning(
    events: &[Event],
    benchmark: &BenchmarkId,
    first: Timestamp,
    until: Timestamp,
) -> Warning {
    let (mut stretches, unknown) = levels_in(events, Some(benchmark), TimeSpan::new(first, until));
    stretches.retain(|stretch| stretch.level != Level::Green);
    stretches.extend(unknown);
    let begun = |level| {
        let mut of_level = stretches.iter().filter(|stretch| stretch.level == level);
        of_level.next().map(|stretch| stretch.from)
    };
    let mut hours_at: BTreeMap<Level, f64> = BTreeMap::new();
    for stretch in &stretches {
        *hours_at.entry(stretch.level).or_default() += hours(stretch.from, stretch.to);
    }
    let length = hours(first, until);
    let at = |level| hours_at.get(&level).copied().unwrap_or(0.0);
    let warned = at(Level::Orange) + at(Level::Red);
    Warning {
        first_yellow: begun(Level::Yellow),
        first_orange: begun(Level::Orange),
        first_red: begun(Level::Red),
        hours_per_year: if length > 0.0 {
            warned / length * YEAR_HOURS
        } else {
            0.0
        },
        hours: length,
        hours_at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::{AlertState, EventKind};

    #[test]
    fn a_level_is_in_force_until_it_ends_or_a_higher_one_is_called() {
        let at = |hour: i64| Timestamp::from_second(hour * 3600).unwrap();
        let benchmark = BenchmarkId::new("P");
        let change = |hour, level, state| Event {
            time: at(hour),
            benchmark: Some(benchmark.clone()),
            kind: EventKind::Alert {
                level,
                state,
                key: format!("P/{hour}"),
                rule: String::new(),
                text: String::new(),
            },
        };
        let events = [
            change(10, Level::Orange, AlertState::Firing),
            change(12, Level::Orange, AlertState::Resolved),
            change(15, Level::Orange, AlertState::Firing),
            change(20, Level::Red, AlertState::Firing),
        ];
        let warning = warning(&events, &benchmark, at(0), at(24));
        assert_eq!(warning.first_red, Some(at(20)));
        assert_eq!(warning.first_yellow, None);
        assert!((warning.hours_at[&Level::Orange] - 7.0).abs() < 1e-12);
        assert!((warning.hours_at[&Level::Red] - 4.0).abs() < 1e-12);
        assert!((warning.hours_per_year - 11.0 / 24.0 * YEAR_HOURS).abs() < 1e-9);
    }
}
