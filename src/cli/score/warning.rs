//! Which levels would have been called, and how long before the failure.

use super::hours;
use crate::alert::{Level, Policy};
use crate::cli::replay;
use crate::monitor::{AlertState, EventKind, Settings};
use crate::reading::{Channel, Recording, Series, Timestamp};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Hours in a year.
const YEAR_HOURS: f64 = 365.25 * 24.0;

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
    let changes: Vec<_> = events
        .iter()
        .filter_map(|event| {
            let EventKind::Alert { level, state, .. } = &event.kind else {
                return None;
            };
            Some((event.time, *level, *state))
        })
        .collect();
    let first = series.readings.first().map_or(until, |first| first.time);
    Ok(warning(&changes, first, until))
}

fn warning(
    changes: &[(Timestamp, Level, AlertState)],
    first: Timestamp,
    until: Timestamp,
) -> Warning {
    let begun = |level| {
        let mut begun = changes
            .iter()
            .filter(|(_, one, state)| *one == level && *state == AlertState::Firing);
        begun.next().map(|(time, ..)| *time)
    };
    let mut hours_at: BTreeMap<Level, f64> = BTreeMap::new();
    let mut since: BTreeMap<Level, Timestamp> = BTreeMap::new();
    for (time, level, state) in changes {
        match state {
            AlertState::Firing => {
                since.entry(*level).or_insert(*time);
            }
            AlertState::Resolved => {
                if let Some(from) = since.remove(level) {
                    *hours_at.entry(*level).or_default() += hours(from, *time);
                }
            }
        }
    }
    for (level, from) in since {
        *hours_at.entry(level).or_default() += hours(from, until);
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

    #[test]
    fn hours_are_counted_from_firing_to_resolved_and_to_the_end() {
        let at = |hour: i64| Timestamp::from_second(hour * 3600).unwrap();
        let changes = [
            (at(10), Level::Orange, AlertState::Firing),
            (at(12), Level::Orange, AlertState::Resolved),
            (at(20), Level::Red, AlertState::Firing),
        ];
        let warning = warning(&changes, at(0), at(24));
        assert_eq!(warning.first_red, Some(at(20)));
        assert_eq!(warning.first_yellow, None);
        assert!((warning.hours_at[&Level::Orange] - 2.0).abs() < 1e-12);
        assert!((warning.hours_at[&Level::Red] - 4.0).abs() < 1e-12);
        assert!((warning.hours_per_year - 0.25 * YEAR_HOURS).abs() < 1e-9);
    }
}
