//! How drills stand: what became of the last one, kept in the state folder over restarts.

use super::kept;
use crate::reading::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// In the folder of the drills.
const FILE: &str = "last.json";

/// What a drill that passed took.
#[derive(Debug, Clone, Copy)]
pub(super) struct PassedDrill {
    pub(super) latency: Duration,
    pub(super) acknowledged: Option<Duration>,
}

/// How drills stand.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize, Deserialize)]
#[schemars(rename = "Drills")]
pub struct DrillRecord {
    /// Since when there are drills.
    pub since: Timestamp,
    /// When the newest one began.
    pub started: Option<Timestamp>,
    /// When the last one that passed ended.
    pub passed_at: Option<Timestamp>,
    /// Of that one: from the readings being appended to their file to the first hook's start, seconds.
    pub latency_seconds: Option<f64>,
    /// Of that one: from the first hook's start to the acknowledgement, seconds; `None` where none was asked for.
    pub acknowledged_seconds: Option<f64>,
    /// Why the newest one failed; `None` where it passed.
    pub failure: Option<String>,
    /// When it is an alarm that none has passed.
    pub overdue_after: Timestamp,
    /// How many have passed.
    pub passed: u64,
    /// How many have failed.
    pub failed: u64,
}

impl DrillRecord {
    /// Before the first one.
    pub(super) fn new(now: Timestamp) -> Self {
        Self {
            since: now,
            started: None,
            passed_at: None,
            latency_seconds: None,
            acknowledged_seconds: None,
            failure: None,
            overdue_after: now,
            passed: 0,
            failed: 0,
        }
    }

    /// As it stands in a state folder; `None` where there is none, or none that can be read.
    pub fn read(state_dir: &Path) -> Option<Self> {
        kept::read(&folder(state_dir).join(FILE))
    }

    /// Nobody sees half of it.
    pub(super) fn write(&self, state_dir: &Path) -> io::Result<()> {
        kept::write(&folder(state_dir), FILE, self)
    }

    pub(super) fn passes(&mut self, passed: PassedDrill, now: Timestamp) {
        tracing::info!(?passed, "the drill has passed");
        self.passed_at = Some(now);
        self.latency_seconds = Some(passed.latency.as_secs_f64());
        self.acknowledged_seconds = passed.acknowledged.map(|one| one.as_secs_f64());
        self.failure = None;
        self.passed += 1;
    }

    pub(super) fn fails(&mut self, why: String) {
        self.failure = Some(why);
        self.failed += 1;
    }

    /// Whether none has passed for too long.
    pub fn is_overdue(&self, now: Timestamp) -> bool {
        now > self.overdue_after
    }
}

/// Where drills are held.
pub(super) fn folder(state_dir: &Path) -> PathBuf {
    state_dir.join("drill")
}
