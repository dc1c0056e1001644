//! From a source's lines and messages to what the monitor takes: which benchmarks, which columns.

use crate::config::{Benchmark, Source, SourceKind};
use crate::monitor::Input;
use crate::reading::{BenchmarkId, Quantity, Timestamp, Unit};
use crate::runtime::ingest::{ColumnMap, Item, Measure, ReadOptions};
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
    pub(super) kind: SourceKind,
    /// With none, whatever benchmarks the files name are taken.
    wanted: Vec<Benchmark>,
}

impl Decoder {
    pub(super) fn new(source: &Source, benchmarks: &[Benchmark]) -> Self {
        let of_source = |benchmark: &&Benchmark| benchmark.source == source.id;
        Self {
            kind: source.kind,
            wanted: benchmarks.iter().filter(of_source).cloned().collect(),
        }
    }

    /// How to read `file`. A column that several benchmarks claim is, in each file, that of the
    /// benchmark that the file is named after.
    pub(super) fn options(&self, file: &Path) -> ReadOptions {
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
            ..ReadOptions::default()
        }
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
