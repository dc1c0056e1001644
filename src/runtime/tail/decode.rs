//! From a source's lines and messages to what the monitor takes: which benchmarks, which columns.

use crate::config::{Benchmark, Source, SourceKind};
use crate::monitor::Input;
use crate::reading::{BenchmarkId, Conventions, Quantity, Timestamp, Unit};
use crate::runtime::ingest::{
    ColumnMap, Item, Measure, ReadOptions, TextFormat, TextRows, unpacked_name,
};
use jiff::SignedDuration;
use std::path::Path;

/// One value on its way to the monitor.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// When it was measured.
    pub time: Timestamp,
    /// The value.
    pub input: Input,
}

/// What one source's files mean.
#[derive(Debug, Clone)]
pub(super) struct Decoder {
    kind: SourceKind,
    conventions: Conventions,
    /// With none, whatever benchmarks the files name are taken.
    wanted: Vec<Benchmark>,
}

impl Decoder {
    pub(super) fn new(source: &Source, benchmarks: &[Benchmark]) -> Self {
        let of_source = |benchmark: &&Benchmark| benchmark.source == source.id;
        Self {
            kind: source.kind,
            conventions: source.conventions.clone(),
            wanted: benchmarks.iter().filter(of_source).cloned().collect(),
        }
    }

    /// The reader of the lines of `file`; `None` for recordings.
    pub(super) fn text_rows(&self, file: &Path) -> Option<TextRows> {
        let format = match self.kind {
            SourceKind::Csv => TextFormat::Csv,
            SourceKind::Ndjson => TextFormat::Ndjson,
            SourceKind::Toa5 => TextFormat::Toa5,
            SourceKind::Mcap => return None,
        };
        let name = file.with_file_name(unpacked_name(file));
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
        let columns = self.wanted.iter().filter_map(|benchmark| {
            let (column, unit) = (benchmark.column.as_ref()?, benchmark.unit?);
            let ours = claims(column) == 1 || benchmark.id.as_str() == stem;
            ours.then(|| ColumnMap {
                column: column.clone(),
                benchmark: benchmark.id.clone(),
                measure: Measure::Reading(unit),
            })
        });
        ReadOptions {
            columns: columns.collect(),
            conventions: self.conventions.clone(),
            ..ReadOptions::default()
        }
    }

    /// Whether files that are packed belong to the source too.
    pub(super) fn takes_packed(&self) -> bool {
        self.kind != SourceKind::Mcap
    }

    /// The item as the monitor takes it; `None` when nobody asked for it.
    pub(super) fn arrival(&self, item: Item) -> Option<Arrival> {
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

    fn knows(&self, benchmark: &BenchmarkId) -> bool {
        self.wanted.is_empty() || self.wanted(benchmark).is_some()
    }

    fn wants(&self, benchmark: &BenchmarkId, unit: Unit) -> bool {
        let Some(wanted) = self.wanted(benchmark) else {
            return self.wanted.is_empty();
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
