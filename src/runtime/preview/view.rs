//! What a look at a site's files has found.

use crate::config::ConfigProblem;
use crate::reading::{BenchmarkId, CovariateKind, Quantity, Sample, Timestamp, Unit};
use crate::runtime::ingest::Meaning;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// What lies in the files of a site now.
#[derive(Debug, Clone, Default, JsonSchema, Serialize)]
pub struct Preview {
    /// The sources that are files.
    pub sources: Vec<SourceView>,
    /// What would be watched.
    pub benchmarks: Vec<BenchmarkPreview>,
    /// What would be taken as covariates.
    pub covariates: Vec<CovariateView>,
    /// Benchmarks in the files that no `[[benchmark]]` asks for.
    pub unwatched: BTreeSet<BenchmarkId>,
    /// What no file feeds.
    #[serde(rename = "unfed")]
    pub without_readings: Vec<BenchmarkWithoutReadings>,
    /// What the files end with and the daemon refuses, and columns of benchmarks that a later header has no more, a line each: these are
    /// among the warnings.
    #[serde(skip)]
    pub refused_ends: Vec<String>,
    /// Covariates that the config states and no file has: these are among the warnings.
    #[serde(skip)]
    pub absent: Vec<ConfigProblem>,
    /// Whether everything was looked at, and not the first values of very many alone.
    pub is_whole: bool,
}

/// One source and its files.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct SourceView {
    /// Its id.
    pub id: String,
    /// Its kind.
    pub kind: &'static str,
    /// Its files' path.
    pub path: String,
    /// How times without an offset are understood.
    pub times: String,
    /// Its files.
    pub files: usize,
    /// The tables in them, those with the same columns as one.
    pub layouts: Vec<LayoutView>,
    /// What of them is refused, each kind once.
    pub refused: Vec<Refusal>,
    /// What else there is to know.
    pub remarks: Vec<String>,
    /// Benchmarks in its files that no `[[benchmark]]` asks for.
    #[serde(skip)]
    pub(super) unwatched: BTreeSet<BenchmarkId>,
    /// Marks of no value in the place of readings: how many, and how many of them for a value out of range.
    #[serde(skip)]
    pub(super) missing: BTreeMap<BenchmarkId, (u64, u64)>,
    /// Of these, how many are no mark, and cannot be used for what stands there.
    #[serde(skip)]
    pub(super) unread: BTreeMap<BenchmarkId, u64>,
    /// Why the first of its folder and files cannot be read that cannot.
    #[serde(skip)]
    pub(super) unreadable: Option<String>,
}

impl SourceView {
    /// Takes a problem of the folder or of a file, which is a remark too.
    pub(super) fn cannot_be_read(&mut self, problem: String) {
        self.unreadable.get_or_insert_with(|| problem.clone());
        self.remarks.push(problem);
    }
}

/// The columns of one file or of several.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct LayoutView {
    /// The first file that has them.
    pub file: PathBuf,
    /// How many have them.
    pub files: usize,
    /// The columns.
    pub columns: Vec<ColumnView>,
}

/// One column.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
pub struct ColumnView {
    /// Its name.
    pub name: String,
    /// What it is taken for.
    #[serde(flatten)]
    pub meaning: Meaning,
}

/// Rows of one kind that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
pub struct Refusal {
    /// How many.
    pub rows: u64,
    /// What is wrong with the first.
    pub first: String,
}

/// One quantity of a benchmark.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct BenchmarkPreview {
    /// Its id.
    pub id: BenchmarkId,
    /// Where its readings come from.
    pub source: String,
    /// Displacement or velocity.
    pub quantity: Quantity,
    /// Their unit.
    pub unit: String,
    /// How many the daemon would take, one of each time.
    pub readings: u64,
    /// Of these, how often a reading of the same time was corrected by another value: the last one counts.
    pub corrected: u64,
    /// Rows that say again what another one says: they are dropped.
    pub repeated: u64,
    /// Readings that lie so far ahead of the clock that the daemon does not take them.
    pub ahead: u64,
    /// Readings that should be there and are not: marks of no value, such as NAN or INF.
    pub missing: u64,
    /// Of the missing ones, how many were out of the instrument's range: INF, or a Campbell logger's -7999 or -99999.
    pub out_of_range: u64,
    /// The earliest, its time and value.
    pub first: (Timestamp, f64),
    /// The latest, its time and value.
    pub last: (Timestamp, f64),
    /// By how many mm a displacement has changed since the first, less what it jumped by at declared resets.
    #[serde(skip)]
    pub moved_mm: Option<f64>,
    /// The median time between the latest, s.
    pub every_s: Option<i64>,
    /// What in them hardly means what was intended, with its evidence.
    pub suspicions: Vec<String>,
    /// The first correction, where the unit changes, and the age of the newest reading where it is old.
    pub remarks: Vec<String>,
}

impl BenchmarkPreview {
    /// Before anything is counted; `first` is a reading of it.
    pub(super) fn new(
        id: BenchmarkId,
        source: String,
        unit: Unit,
        Sample { time, value }: Sample,
    ) -> Self {
        Self {
            id,
            source,
            quantity: unit.quantity(),
            unit: unit.to_string(),
            readings: 0,
            corrected: 0,
            repeated: 0,
            ahead: 0,
            missing: 0,
            out_of_range: 0,
            first: (time, value),
            last: (time, value),
            moved_mm: None,
            every_s: None,
            suspicions: Vec::new(),
            remarks: Vec::new(),
        }
    }
}

/// One covariate.
#[derive(Debug, Clone, JsonSchema, Serialize)]
pub struct CovariateView {
    /// Its name.
    pub name: String,
    /// Its unit, where the name says it.
    pub unit: Option<String>,
    /// What it measures: as `[[covariate]]` states it, or else as its unit and its name say.
    pub kind: CovariateKind,
    /// Whether the config states that.
    pub is_stated: bool,
    /// Where it comes from.
    pub source: String,
    /// How many values there are.
    pub values: u64,
    /// When the earliest was measured.
    pub first: Timestamp,
    /// When the latest was measured.
    pub last: Timestamp,
    /// What in them hardly means what was intended, with its evidence.
    pub suspicions: Vec<String>,
    /// Whether rain is taken as it falls or as a running total, and how often that is set back.
    pub remarks: Vec<String>,
}

/// A benchmark of the config without a reading, or a source without a benchmark.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
#[schemars(rename = "Unfed")]
pub struct BenchmarkWithoutReadings {
    /// The benchmark; none where a source was to give whatever benchmarks it has.
    pub benchmark: Option<BenchmarkId>,
    /// The source.
    pub source: String,
    /// What is wrong, and what to do about it.
    pub text: String,
}
