//! The monitor's memory as bytes: what a restart goes on from.
//!
//! A part for each benchmark, so that only what has changed since the last time is written, and one for the rest.
//! The bytes are MessagePack with the fields' names: floats come back bit for bit, infinities too.

use super::awaited::Awaited;
use super::covariates::Covariates;
use super::deadlines::Deadlines;
use super::event::Summary;
use super::in_force::LevelsInForce;
use super::past::Past;
use super::queue::Queue;
use super::search::SearchJob;
use super::sensor::Sensors;
use super::site::SiteAlert;
use super::together::FailureComparisons;
use super::track::{PastReplay, Track};
use super::{Monitor, Settings};
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The part that belongs to no benchmark.
const REST: &str = "";
/// The part of the benchmark whose past is being gone through.
const WALK: &str = "\0past";

/// One piece of a monitor's memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryPart {
    /// Whose it is: a benchmark's id, or empty for what belongs to none.
    pub name: String,
    /// What is remembered; `None`: this benchmark is no longer known.
    pub body: Option<Vec<u8>>,
}

/// Bytes that are no monitor's memory.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// A part cannot be written as bytes.
    #[error("part {name:?} of the monitor's memory cannot be saved: {source}")]
    Unwritable {
        /// Which.
        name: String,
        /// Why.
        source: rmp_serde::encode::Error,
    },
    /// A part's bytes cannot be read.
    #[error("part {name:?} of the monitor's memory cannot be read: {source}")]
    Unreadable {
        /// Which.
        name: String,
        /// Why.
        source: rmp_serde::decode::Error,
    },
    /// The part that belongs to no benchmark is not there.
    #[error("the monitor's memory has no part for the site")]
    Incomplete,
}

#[derive(Debug, Serialize, Deserialize)]
struct Rest {
    settings: Settings,
    covariates: Covariates,
    sensors: Sensors,
    searches: Vec<SearchJob>,
    #[serde(default)]
    site: SiteAlert,
    #[serde(default)]
    together: FailureComparisons,
    #[serde(default)]
    awaited: Awaited,
    #[serde(default)]
    late: BTreeSet<BenchmarkId>,
    #[serde(default, rename = "settles")]
    in_batches: bool,
    #[serde(default)]
    clock_wrong: Option<Timestamp>,
    #[serde(default)]
    past: Past,
    #[serde(default)]
    queue: Queue,
    summary: Summary,
    last_time: Option<Timestamp>,
}

impl Monitor {
    /// What has changed since [`Monitor::is_saved`] was last said: a part for each such benchmark, and the rest in
    /// any case.
    ///
    /// # Errors
    /// [`SavedError::Unwritable`].
    pub fn save(&self) -> Result<Vec<MemoryPart>, SavedError> {
        let mut parts = Vec::with_capacity(self.changed.len() + 1);
        for id in &self.changed {
            let track = self.tracks.get(id);
            let body = track.map(|track| bytes(id.as_str(), track)).transpose()?;
            let name = id.as_str().to_owned();
            parts.push(MemoryPart { name, body });
        }
        let rest = Rest {
            settings: self.settings.clone(),
            covariates: self.covariates.clone(),
            sensors: self.sensors.clone(),
            searches: self.searches.clone(),
            site: self.site.clone(),
            together: self.together.clone(),
            awaited: self.awaited.clone(),
            late: self.late.clone(),
            in_batches: self.in_batches,
            clock_wrong: self.clock_wrong,
            past: self.past.clone(),
            queue: self.queue.clone(),
            summary: self.summary,
            last_time: self.last_time,
        };
        let walk = self.walk.as_ref();
        let body = walk.map(|walk| bytes(WALK, walk)).transpose()?;
        let name = WALK.to_owned();
        parts.push(MemoryPart { name, body });
        let body = Some(bytes(REST, &rest)?);
        let name = REST.to_owned();
        parts.push(MemoryPart { name, body });
        Ok(parts)
    }

    /// What [`Monitor::save`] gave is kept safely.
    pub fn is_saved(&mut self) {
        self.changed.clear();
    }

    /// The monitor whose [`Monitor::save`] gave these parts, the latest of each name.
    ///
    /// # Errors
    /// [`SavedError`] when they are not all there, or from a version that remembered something else.
    pub fn restore(parts: &[MemoryPart]) -> Result<Self, SavedError> {
        let (mut rest, mut walk, mut tracks) = (None, None, BTreeMap::new());
        for MemoryPart { name, body } in parts {
            let Some(body) = body else { continue };
            if name == REST {
                rest = Some(value::<Rest>(name, body)?);
            } else if name == WALK {
                walk = Some(value::<PastReplay>(name, body)?);
            } else {
                let track: Track = value(name, body)?;
                tracks.insert(BenchmarkId::new(name.as_str()), track);
            }
        }
        let rest = rest.ok_or(SavedError::Incomplete)?;
        let mut deadlines = Deadlines::default();
        for (id, track) in &tracks {
            deadlines.set(id, track.deadline());
        }
        Ok(Self {
            settings: rest.settings,
            in_force: LevelsInForce::of(&tracks),
            deadlines,
            tracks,
            changed: BTreeSet::new(),
            covariates: rest.covariates,
            sensors: rest.sensors,
            searches: rest.searches,
            site: rest.site,
            together: rest.together,
            awaited: rest.awaited,
            late: rest.late,
            in_batches: rest.in_batches,
            clock_wrong: rest.clock_wrong,
            past: rest.past,
            queue: rest.queue,
            walk,
            summary: rest.summary,
            last_time: rest.last_time,
        })
    }
}

fn bytes(name: &str, value: &impl Serialize) -> Result<Vec<u8>, SavedError> {
    rmp_serde::to_vec_named(value).map_err(|source| SavedError::Unwritable {
        name: name.to_owned(),
        source,
    })
}

fn value<T: for<'de> Deserialize<'de>>(name: &str, body: &[u8]) -> Result<T, SavedError> {
    rmp_serde::from_slice(body).map_err(|source| SavedError::Unreadable {
        name: name.to_owned(),
        source,
    })
}
