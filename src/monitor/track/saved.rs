//! A track as it is read from the disk: one flat map by the fields' names, whatever parts a track has by now, so that states of
//! earlier versions are read. `#[serde(flatten)]` would read it as well, and take eight times as long: it holds every reading as
//! a map of its own before the parts take what is theirs, and a restart reads thousands of records.

use super::Track;
use super::alarm::{Alarm, Levels, Occurrences, Overdue};
use super::forecaster::{Adopted, Forecaster, Pace, Watch};
use super::pending::{Lookback, PastReview, Pending};
use super::quality::{DataQuality, Unknown};
use super::record::{BenchmarkRecord, HeldReading, LateRun};
use super::refit::FitChanges;
use crate::alert::{AlertCause, Held, Latch};
use crate::forecast::LawForecaster;
use crate::monitor::declared::Declarations;
use crate::monitor::drift::Drift;
use crate::monitor::history::History;
use crate::monitor::kept::KeptForecast;
use crate::monitor::silence::Silence;
use crate::reading::other_unit::OtherUnit;
use crate::reading::{BenchmarkId, Suspicion, Timestamp};
use crate::regime::Tracker;
use serde::Deserialize;
use std::collections::BTreeSet;

/// The fields of all parts. What the first version did not write has a default.
#[derive(Debug, Deserialize)]
pub(super) struct SavedTrack {
    benchmark: BenchmarkId,
    history: History,
    silence: Silence,
    newest: Option<Timestamp>,
    #[serde(default)]
    declared: Declarations,
    #[serde(default)]
    ahead: Option<HeldReading>,
    #[serde(default)]
    late_run: LateRun,
    #[serde(default)]
    dropped: u32,

    #[serde(default)]
    unknown: Unknown,
    #[serde(default)]
    spoilt_by: Option<f64>,
    #[serde(default)]
    others: u32,
    faulted: bool,
    #[serde(default)]
    accepted: BTreeSet<Suspicion>,
    #[serde(default)]
    other_unit: Option<OtherUnit>,

    panel: LawForecaster,
    #[serde(default)]
    pace: Pace,
    watch: Watch,
    adopted: Option<Adopted>,

    regime: Tracker,
    intercept: Drift,
    transition: Drift,

    latch: Latch,
    #[serde(default)]
    held: Held,
    look: Option<(Timestamp, AlertCause)>,
    backwards: bool,
    #[serde(default)]
    levels: Levels,
    #[serde(default)]
    kept: Option<KeptForecast>,
    #[serde(default)]
    overdue: Option<Overdue>,
    #[serde(default)]
    occurrences: Occurrences,

    #[serde(default)]
    lookback: Option<Lookback>,
    #[serde(default)]
    owes: bool,
    #[serde(default)]
    queued_since: Option<Timestamp>,
    #[serde(default)]
    record: PastReview,
}

impl From<SavedTrack> for Track {
    fn from(saved: SavedTrack) -> Self {
        Self {
            record: BenchmarkRecord::from_saved(
                saved.benchmark,
                saved.history,
                saved.silence,
                saved.newest,
                saved.declared,
                saved.ahead,
                saved.dropped,
            )
            .with_late_run(saved.late_run),
            quality: DataQuality::from_saved(
                saved.unknown,
                saved.spoilt_by,
                saved.others,
                saved.faulted,
                saved.accepted,
                saved.other_unit,
            ),
            forecaster: Forecaster::from_saved(saved.panel, saved.pace, saved.watch, saved.adopted),
            changes: FitChanges::from_saved(saved.regime, saved.intercept, saved.transition),
            alarm: Alarm::from_saved(
                saved.latch,
                saved.held,
                saved.look,
                saved.backwards,
                saved.levels,
                saved.kept,
                saved.overdue,
            )
            .with(saved.occurrences),
            pending: Pending::from_saved(
                saved.lookback,
                saved.owes,
                saved.queued_since,
                saved.record,
            ),
        }
    }
}
