//! The monitor's memory as bytes: what a restart goes on from.
//!
//! A part for each benchmark, so that only what has changed since the last time is written, and one for the rest.
//! The bytes are MessagePack with the fields' names: floats come back bit for bit, infinities too.

use super::batches::Batches;
use super::benchmarks::Benchmarks;
use super::covariates::Covariates;
use super::outages::Outages;
use super::past::Past;
use super::search::SearchJob;
use super::site::SiteAlert;
use super::tally::Tally;
use super::together::FailureComparisons;
use super::track::{PastReplay, Track};
use super::{Monitor, Settings};
use crate::reading::BenchmarkId;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The part that belongs to no benchmark.
const REST: &str = "";
/// The part of the benchmark whose past is being judged.
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
        source: erased_serde::Error,
    },
    /// The part that belongs to no benchmark is not there.
    #[error("the monitor's memory has no part for the site")]
    Incomplete,
}

/// What is read of the part that belongs to no benchmark.
#[derive(Debug, Deserialize)]
struct Rest {
    settings: Settings,
    covariates: Covariates,
    searches: Vec<SearchJob>,
    #[serde(default)]
    site: SiteAlert,
    #[serde(default)]
    together: FailureComparisons,
    // Their fields stand beside the others, as all did in the first version; they hold little.
    #[serde(flatten)]
    outages: Outages,
    #[serde(default)]
    past: Past,
    #[serde(default)]
    dropped: BTreeMap<BenchmarkId, u32>,
    #[serde(default)]
    anew: BTreeMap<BenchmarkId, String>,
    #[serde(flatten)]
    batches: Batches,
    #[serde(flatten)]
    tally: Tally,
}

/// What is written of it: the same fields.
#[derive(Debug, Serialize)]
struct RestOf<'a> {
    settings: &'a Settings,
    covariates: &'a Covariates,
    searches: &'a [SearchJob],
    site: &'a SiteAlert,
    together: &'a FailureComparisons,
    #[serde(flatten)]
    outages: &'a Outages,
    past: &'a Past,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    dropped: &'a BTreeMap<BenchmarkId, u32>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    anew: &'a BTreeMap<BenchmarkId, String>,
    #[serde(flatten)]
    batches: &'a Batches,
    #[serde(flatten)]
    tally: &'a Tally,
}

impl Monitor {
    /// What has changed since [`Monitor::mark_saved`] was last called: a part for each such benchmark, and the rest in
    /// any case.
    ///
    /// # Errors
    /// [`SavedError::Unwritable`].
    pub fn save(&self) -> Result<Vec<MemoryPart>, SavedError> {
        let mut parts = Vec::new();
        for (id, track) in self.benchmarks.changed() {
            let body = track.map(|track| bytes(id.as_str(), track)).transpose()?;
            let name = id.as_str().to_owned();
            parts.push(MemoryPart { name, body });
        }
        let rest = RestOf {
            settings: &self.settings,
            covariates: &self.covariates,
            searches: &self.searches,
            site: &self.site,
            together: &self.together,
            outages: &self.outages,
            past: &self.past,
            dropped: &self.dropped,
            anew: &self.anew,
            batches: &self.batches,
            tally: &self.tally,
        };
        let walk = self.past.walk();
        let body = walk.map(|walk| bytes(WALK, walk)).transpose()?;
        let name = WALK.to_owned();
        parts.push(MemoryPart { name, body });
        let body = Some(bytes(REST, &rest)?);
        let name = REST.to_owned();
        parts.push(MemoryPart { name, body });
        Ok(parts)
    }

    /// What [`Monitor::save`] gave is kept safely.
    pub fn mark_saved(&mut self) {
        self.benchmarks.mark_saved();
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
        Ok(Self {
            settings: rest.settings,
            benchmarks: Benchmarks::restored(tracks),
            covariates: rest.covariates,
            searches: rest.searches,
            site: rest.site,
            together: rest.together,
            outages: rest.outages,
            past: rest.past.with_walk(walk),
            dropped: rest.dropped,
            anew: rest.anew,
            batches: rest.batches,
            tally: rest.tally,
        })
    }
}

fn bytes(name: &str, value: &impl Serialize) -> Result<Vec<u8>, SavedError> {
    rmp_serde::to_vec_named(value).map_err(|source| SavedError::Unwritable {
        name: name.to_owned(),
        source,
    })
}

fn value<T: DeserializeOwned>(name: &str, body: &[u8]) -> Result<T, SavedError> {
    from_bytes(body).map_err(|source| SavedError::Unreadable {
        name: name.to_owned(),
        source,
    })
}

/// The value that `rmp_serde::to_vec_named` wrote. All types share one decoder: compiled for each of them it is a tenth of the program.
///
/// # Errors
/// What in the bytes is not of the type.
pub(crate) fn from_bytes<T: DeserializeOwned>(body: &[u8]) -> Result<T, erased_serde::Error> {
    let mut decoder = rmp_serde::Deserializer::from_read_ref(body);
    erased_serde::deserialize(&mut <dyn erased_serde::Deserializer<'_>>::erase(
        &mut decoder,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alert::Level;
    use crate::monitor::{Input, Notice};
    use crate::reading::{Reading, Timestamp, Unit};
    use flate2::read::GzDecoder;
    use jiff::ToSpan;
    use serde_json::Value;
    use std::io::Read;
    use std::path::Path;

    /// What the map of a benchmark holds: that of the track before it had parts, with which states are on disks, and what was
    /// added since.
    const NAMES: [&str; 31] = [
        "accepted",
        "adopted",
        "ahead",
        "backwards",
        "benchmark",
        "declared",
        "faulted",
        "held",
        "history",
        "intercept",
        "kept",
        "latch",
        "late_run",
        "levels",
        "look",
        "lookback",
        "newest",
        "occurrences",
        "others",
        "overdue",
        "owes",
        "pace",
        "panel",
        "queued_since",
        "record",
        "regime",
        "silence",
        "spoilt_by",
        "transition",
        "unknown",
        "watch",
    ];

    fn time(hour: i64) -> Timestamp {
        let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
        start + hour.hours()
    }

    fn input(hour: i64, value: f64) -> Input {
        Input::Reading {
            benchmark: BenchmarkId::new("a"),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time: time(hour),
                value,
                sigma: None,
            },
        }
    }

    /// A monitor of a slope that runs away, with something in nearly every field: a reading far ahead that waits, one that
    /// came late and has not been judged, a sensor that was stuck, a level in force.
    fn monitor() -> Monitor {
        let mut monitor = Monitor::new(Settings::default());
        for hour in 0..106 {
            let left = (120 - if hour < 100 { hour.min(90) } else { hour }) as f64;
            monitor.step(time(hour), &input(hour, 200.0 * (120.0 / left).ln()));
        }
        monitor.step(time(106), &input(400, 900.0));
        monitor.step(time(106), &Input::Notice(Notice::InBatches));
        monitor.step(time(106), &input(50, 110.0));
        monitor
    }

    fn saved(monitor: &mut Monitor) -> Vec<MemoryPart> {
        let all: Vec<BenchmarkId> = monitor.benchmarks.all().keys().cloned().collect();
        for id in &all {
            monitor.benchmarks.note_changed(id);
        }
        monitor.save().unwrap()
    }

    fn map(part: &MemoryPart) -> Value {
        from_bytes(part.body.as_ref().unwrap()).unwrap()
    }

    /// Whether all that `old` has stands in `new`, which may have more.
    fn is_kept(old: &Value, new: &Value) -> bool {
        match (old, new) {
            (Value::Object(old), Value::Object(new)) => old
                .iter()
                .all(|(key, value)| new.get(key).is_some_and(|one| is_kept(value, one))),
            _ => old == new,
        }
    }

    #[test]
    fn a_benchmark_is_one_map_of_the_fields_that_earlier_versions_wrote() {
        let parts = saved(&mut monitor());
        let Value::Object(map) = map(&parts[0]) else {
            panic!("no map");
        };
        let mut names: Vec<&str> = map.keys().map(String::as_str).collect();
        names.sort_unstable();
        assert_eq!(names, NAMES);
        assert!(map["owes"] == true && map["ahead"].is_object() && map["lookback"].is_object());
    }

    #[test]
    fn what_belongs_to_no_benchmark_is_one_map_of_the_fields_that_earlier_versions_wrote() {
        let parts = saved(&mut monitor());
        let rest = parts.iter().find(|part| part.name == REST).unwrap();
        let Value::Object(map) = map(rest) else {
            panic!("no map");
        };
        let mut names: Vec<&str> = map.keys().map(String::as_str).collect();
        names.sort_unstable();
        let before = [
            "awaited",
            "clock_wrong",
            "covariates",
            "last_time",
            "late",
            "past",
            "queue",
            "searches",
            "sensors",
            "settings",
            "settles",
            "site",
            "summary",
            "together",
        ];
        assert_eq!(names, before);
    }

    #[test]
    fn what_is_written_is_read_to_the_bit_and_goes_on_as_the_one_that_wrote_it() {
        let mut before = monitor();
        let parts = saved(&mut before);
        let mut after = Monitor::restore(&parts).unwrap();
        assert_eq!(saved(&mut after), parts);
        let end = Input::Notice(Notice::BatchEnd);
        let mut said = 0;
        for hour in 107..116 {
            let reading = input(hour, 200.0 * (120.0 / (120 - hour) as f64).ln());
            for input in [&reading, &end] {
                let events = before.step(time(hour), input);
                assert_eq!(events, after.step(time(hour), input));
                said += events.len();
            }
        }
        assert!(said > 9);
        assert_eq!(saved(&mut after), saved(&mut before));
    }

    #[test]
    fn a_past_that_is_being_gone_through_is_read_too() {
        let mut before = Monitor::new(Settings::default());
        before.step(time(0), &Input::Notice(Notice::Past));
        for hour in 0..100 {
            before.step(time(hour), &input(hour, 0.1 * (hour * hour) as f64));
        }
        before.step(time(100), &Input::Notice(Notice::Current));
        before.step(time(100), &Input::Notice(Notice::Retrace));
        assert!(before.past.walk().is_some());
        let mut after = Monitor::restore(&saved(&mut before)).unwrap();
        while before.owes_past() {
            let retrace = Input::Notice(Notice::Retrace);
            assert_eq!(
                before.step(time(100), &retrace),
                after.step(time(100), &retrace)
            );
        }
        assert_eq!(saved(&mut after), saved(&mut before));
    }

    #[test]
    fn what_the_first_version_saved_is_read_and_nothing_of_it_is_lost() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/state-0.1.0.db.gz");
        let mut bytes = Vec::new();
        GzDecoder::new(std::fs::File::open(file).unwrap())
            .read_to_end(&mut bytes)
            .unwrap();
        let copy = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(copy.path(), bytes).unwrap();
        let connection = rusqlite::Connection::open(copy.path()).unwrap();
        let mut query = connection.prepare("SELECT name, body FROM memory").unwrap();
        let parts = query.query_map([], |row| {
            let (name, body) = (row.get(0)?, Some(row.get(1)?));
            Ok(MemoryPart { name, body })
        });
        let parts: Vec<MemoryPart> = parts.unwrap().map(Result::unwrap).collect();
        // What the runtime keeps beside the monitor's parts is none of them.
        let ours = |part: &&MemoryPart| !part.name.starts_with('\0');
        let parts: Vec<MemoryPart> = parts.iter().filter(ours).cloned().collect();
        let mut monitor = Monitor::restore(&parts).unwrap();
        assert_eq!(monitor.level(&BenchmarkId::new("5")), Some(Level::Red));
        let old = parts.iter().find(|part| part.name == "5").unwrap();
        let new = saved(&mut monitor);
        assert!(is_kept(&map(old), &map(&new[0])), "{:?}", map(&new[0]));
    }
}
