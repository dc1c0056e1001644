//! From a source's lines and messages to what the monitor takes: which benchmarks, which columns.

use crate::config::{Benchmark, Broker, FileSource, SourceKind};
use crate::monitor::{Input, Measured};
use crate::reading::{BenchmarkId, Conventions, Dialect, Quantity, Timestamp, Unit};
use crate::runtime::ingest::{
    ColumnMap, Item, Meaning, Measure, ReadOptions, Remark, TextFormat, TextRows, VectorMap,
    unit_in_name, unpacked_name,
};
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// One value on its way to the monitor.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// When it was measured.
    pub time: Timestamp,
    /// The value.
    pub input: Input,
}

impl Arrival {
    /// Where it stands among others: by time, and at one time the covariates before the readings, each by name, and of a benchmark the
    /// displacement before the velocity: the first reading decides which of both is watched.
    pub fn rank(&self) -> (Timestamp, bool, &str, Option<Quantity>) {
        let is_reading = self.input.read_benchmark().is_some();
        let quantity = match self.input.measured() {
            Some(Measured::Reading { unit, .. }) => Some(unit.quantity()),
            Some(Measured::Sample { .. }) | None => None,
        };
        (self.time, is_reading, self.input.series_name(), quantity)
    }
}

/// Under this name stands how a source is read whose benchmarks the config does not name.
pub(super) fn whatever() -> BenchmarkId {
    BenchmarkId::new("")
}

/// What one source's files mean.
#[derive(Debug, Clone)]
pub(in crate::runtime) struct Decoder {
    kind: SourceKind,
    conventions: Conventions,
    dialect: Dialect,
    /// Day 0 of a column `t_days`, where the config says it.
    epoch: Option<Timestamp>,
    /// With none, whatever benchmarks the files name are taken, but for those of other sources.
    wanted: Vec<Benchmark>,
    /// See [`Decoder::read_as`]; each place in a file that is kept has it too.
    read_as: Arc<BTreeMap<BenchmarkId, String>>,
    /// Benchmarks that the config takes from another source.
    elsewhere: BTreeSet<BenchmarkId>,
    /// What of the source's files has been remarked on, so that a thousand files say it once.
    remarked: Arc<Mutex<BTreeSet<String>>>,
}

impl Decoder {
    pub(in crate::runtime) fn new(source: &FileSource, benchmarks: &[Benchmark]) -> Self {
        let conventions = source.conventions.clone();
        let wanted = of_source(&source.id, benchmarks);
        let of_source = source.read_as();
        let named = wanted
            .iter()
            .map(|one| (one.id.clone(), one.read_as(&of_source)));
        let mut read_as: BTreeMap<BenchmarkId, String> = named.collect();
        if wanted.is_empty() {
            read_as.insert(whatever(), of_source);
        }
        Self {
            kind: source.kind,
            read_as: Arc::new(read_as),
            conventions,
            dialect: source.dialect.clone(),
            epoch: source.epoch,
            wanted,
            elsewhere: of_others(&source.id, benchmarks),
            remarked: Arc::default(),
        }
    }

    /// What decides which numbers the readings of each benchmark are that the config names; none of messages, which keep no place.
    pub(super) fn read_as(&self) -> &Arc<BTreeMap<BenchmarkId, String>> {
        &self.read_as
    }

    /// For messages, each of which is a text of NDJSON.
    pub(in crate::runtime) fn of_messages(broker: &Broker, benchmarks: &[Benchmark]) -> Self {
        Self {
            kind: SourceKind::Ndjson,
            conventions: broker.conventions.clone(),
            dialect: Dialect::default(),
            epoch: None,
            wanted: of_source(&broker.id, benchmarks),
            read_as: Arc::default(),
            elsewhere: of_others(&broker.id, benchmarks),
            remarked: Arc::default(),
        }
    }

    /// Whether no file of the source has been remarked on for this before.
    pub(super) fn is_news(&self, remark: &Remark) -> bool {
        let mut reported = self.remarked.lock().unwrap_or_else(PoisonError::into_inner);
        reported.insert(remark.about.clone())
    }

    /// The reader of the lines of `file`; `None` for recordings.
    pub(in crate::runtime) fn text_rows(&self, file: &Path) -> Option<TextRows> {
        let format = TextFormat::named(self.kind.name())?;
        let name = unpacked_name(file);
        Some(TextRows::new(format, &name, &self.options(&name)))
    }

    /// How to read `file`. A column that several benchmarks claim is, in each file, that of the
    /// benchmark that the file is named after.
    fn options(&self, file: &Path) -> ReadOptions {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let claims = |name: &str| {
            let column = |one: &&Benchmark| one.column.as_deref() == Some(name);
            self.wanted.iter().filter(column).count()
        };
        let vectors = self.wanted.iter().filter_map(|benchmark| {
            let vector = benchmark.vector.as_ref()?;
            let same = |one: &&Benchmark| {
                let columns = one.vector.as_ref().map(|vector| &vector.components);
                columns == Some(&vector.components)
            };
            let is_alone = self.wanted.iter().filter(same).count() == 1;
            let components = vector.components.iter().cloned();
            (is_alone || benchmark.id.as_str() == stem).then(|| VectorMap {
                benchmark: benchmark.id.clone(),
                unit: vector.unit,
                components: components.zip(vector.direction.iter().copied()).collect(),
            })
        });
        let columns = self.wanted.iter().filter_map(|benchmark| {
            let (column, unit) = (benchmark.column.as_ref()?, benchmark.unit?);
            let ours = claims(column) == 1 || benchmark.id.as_str() == stem;
            ours.then(|| ColumnMap {
                column: column.clone(),
                benchmark: benchmark.id.clone(),
                measure: Measure::Reading(unit),
            })
        });
        // Where no column is named, the unit counts before the one in the name of whichever has the benchmark's readings.
        let units = self.wanted.iter().filter_map(|one| {
            let by_name = one.column.is_none() && one.vector.is_none();
            Some((one.id.clone(), one.unit.filter(|_| by_name)?))
        });
        let defaults = ReadOptions::default();
        let of_a_column = self.wanted.iter().filter(|one| one.column.is_some());
        ReadOptions {
            columns: columns.collect(),
            reserved: of_a_column.map(|one| one.id.clone()).collect(),
            units: units.collect(),
            vectors: vectors.collect(),
            conventions: self.conventions.clone(),
            dialect: self.dialect.clone(),
            epoch: self.epoch.unwrap_or(defaults.epoch),
            ..defaults
        }
    }

    /// Whether nothing says when day 0 was of the columns `t_days` that its tables may have.
    pub(in crate::runtime) fn is_day_zero_open(&self) -> bool {
        self.kind == SourceKind::Csv && self.epoch.is_none() && self.dialect.time_columns.is_empty()
    }

    /// Whether files that are packed belong to the source too.
    pub(super) fn takes_packed(&self) -> bool {
        self.kind != SourceKind::Mcap
    }

    /// The item as the monitor takes it; `None` when nobody asked for it.
    pub(in crate::runtime) fn arrival(&self, item: Item) -> Option<Arrival> {
        match item {
            Item::Reading {
                benchmark,
                unit,
                averaging,
                reading,
            } => self.wants(&benchmark, unit).then(|| Arrival {
                time: reading.time,
                input: Input::Reading {
                    averaging: self.averaging(&benchmark, unit, averaging),
                    benchmark,
                    unit,
                    reading,
                },
            }),
            Item::Missing {
                benchmark,
                time,
                what,
            } => self.knows(&benchmark).then_some(Arrival {
                time,
                input: Input::Missing {
                    benchmark,
                    time,
                    what,
                },
            }),
            Item::Sample {
                channel,
                unit,
                sample,
            } => Some(Arrival {
                time: sample.time,
                input: Input::Sample {
                    channel,
                    unit,
                    sample,
                },
            }),
        }
    }

    /// Whether it takes readings of the benchmark.
    pub(in crate::runtime) fn knows(&self, benchmark: &BenchmarkId) -> bool {
        self.wanted(benchmark).is_some() || self.takes_any(benchmark)
    }

    /// Whether it takes a benchmark that the config does not name for it.
    fn takes_any(&self, benchmark: &BenchmarkId) -> bool {
        self.wanted.is_empty() && !self.is_elsewhere(benchmark)
    }

    /// Whether the config takes a benchmark from another source, and not from this one.
    pub(in crate::runtime) fn is_elsewhere(&self, benchmark: &BenchmarkId) -> bool {
        self.elsewhere.contains(benchmark)
    }

    /// Columns whose name says another unit than the config.
    pub(in crate::runtime) fn doubtful_units(&self) -> impl Iterator<Item = String> {
        self.wanted.iter().flat_map(|benchmark| {
            let of_column = |name: &str| unit_in_name(name).or_else(|| Unit::in_brackets_of(name));
            let column = benchmark.column.iter().map(move |one| (one, of_column(one)));
            let components = benchmark.vector.iter().flat_map(|one| &one.components);
            let components = components.map(|one| (one, Unit::at_end_of(one)));
            column.chain(components).filter_map(|(column, named)| {
                let unit = benchmark.unit?;
                let named = named.filter(|named| *named != unit)?;
                Some(format!(
                    "column {column:?} is named as one in {named}, and [[benchmark]] {:?} takes it in {unit}: is its unit right?",
                    benchmark.id.as_str()
                ))
            })
        })
    }

    /// What a column is taken for: a second quantity of a benchmark is not read.
    pub(in crate::runtime) fn meant(&self, meaning: Meaning) -> Meaning {
        let is_left_out = if let Meaning::Reading { benchmark, unit } = &meaning {
            let unit = Unit::parse(unit).ok();
            self.wanted(benchmark).is_some()
                && unit.is_some_and(|unit| !self.wants(benchmark, unit))
        } else {
            false
        };
        if is_left_out {
            Meaning::Unused
        } else {
            meaning
        }
    }

    fn wants(&self, benchmark: &BenchmarkId, unit: Unit) -> bool {
        let Some(wanted) = self.wanted(benchmark) else {
            return self.takes_any(benchmark);
        };
        let quantity = wanted.quantity.or(wanted.unit.map(Unit::quantity));
        quantity.is_none_or(|quantity| quantity == unit.quantity())
    }

    fn averaging(
        &self,
        benchmark: &BenchmarkId,
        unit: Unit,
        stated: Option<SignedDuration>,
    ) -> Option<SignedDuration> {
        match unit.quantity() {
            Quantity::Velocity => stated.or_else(|| self.wanted(benchmark)?.averaging),
            Quantity::Displacement => stated,
        }
    }

    fn wanted(&self, benchmark: &BenchmarkId) -> Option<&Benchmark> {
        self.wanted.iter().find(|one| one.id == *benchmark)
    }
}

/// How the daemon reads a file of this source.
pub fn options_of(source: &FileSource, benchmarks: &[Benchmark], file: &Path) -> ReadOptions {
    Decoder::new(source, benchmarks).options(&unpacked_name(file))
}

/// Whether the daemon takes readings of a benchmark, in this unit, from the files of this source.
pub fn is_taken(
    source: &FileSource,
    benchmarks: &[Benchmark],
    benchmark: &BenchmarkId,
    unit: Unit,
) -> bool {
    Decoder::new(source, benchmarks).wants(benchmark, unit)
}

fn of_others(id: &str, benchmarks: &[Benchmark]) -> BTreeSet<BenchmarkId> {
    let others = benchmarks.iter().filter(|one| one.source != id);
    let others = others.map(|one| one.id.clone());
    let own = |other: &BenchmarkId| {
        let mut own = benchmarks.iter().filter(|one| one.source == id);
        own.any(|one| one.id == *other)
    };
    others.filter(|other| !own(other)).collect()
}

fn of_source(id: &str, benchmarks: &[Benchmark]) -> Vec<Benchmark> {
    let ours = |benchmark: &&Benchmark| benchmark.source == id;
    benchmarks.iter().filter(ours).cloned().collect()
}
