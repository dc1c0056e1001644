//! A header that comes again in the middle of a file: what of the readings it changes.

use super::Remark;
use super::columns::{Column, Layout};
use crate::reading::{BenchmarkId, Unit};

/// A column of readings: its name, whose they are, and in which unit.
type ReadingColumn = (String, BenchmarkId, Unit);

/// The readings of a header, and what columns there have been.
#[derive(Debug, Clone, Default)]
pub(super) struct HeaderReadings {
    readings: Vec<ReadingColumn>,
    /// Of every header so far, each name once.
    names: Vec<String>,
}

impl HeaderReadings {
    fn of(layout: &Layout) -> Vec<ReadingColumn> {
        let columns = layout.names.iter().zip(&layout.columns);
        let readings = columns.filter_map(|(name, column)| {
            if let Column::Reading {
                benchmark, unit, ..
            } = column
            {
                Some((name.clone(), benchmark.clone(), *unit))
            } else {
                None
            }
        });
        readings.collect()
    }

    /// The columns' names, of every header so far.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Takes the header at `line`, with remarks on what it changes.
    pub(super) fn follow(&mut self, line: u64, layout: &mut Layout) {
        let now = Self::of(layout);
        for (name, benchmark, unit) in &self.readings {
            let quantity = unit.quantity();
            let mut same = now.iter();
            let same =
                same.find(|(_, other, unit)| other == benchmark && unit.quantity() == quantity);
            let id = benchmark.as_str();
            let (about, text) = match same {
                Some((.., is)) if is == unit => continue,
                Some((other, _, is)) => (
                    format!("benchmark {id:?}"),
                    format!(
                        "line {line}: a header that comes again has {other:?} in {is}, and it was {name:?} in {unit} before: values are given in the \
                     first of both units; is the header right?"
                    ),
                ),
                None => (
                    format!("benchmark {id:?}, column {name:?}"),
                    format!(
                        "line {line}: a header that comes again has no column {name:?}, where the readings of benchmark {id:?} stood: below it there are \
                     none of them. Put what follows into a file of its own, with a [[benchmark]] column that names its column"
                    ),
                ),
            };
            layout.remarks.push(Remark {
                is_loss: same.is_none(),
                about,
                text,
            });
        }
        self.readings = now;
        let fresh = layout
            .names
            .iter()
            .filter(|name| !self.names.contains(name));
        let fresh: Vec<String> = fresh.cloned().collect();
        self.names.extend(fresh);
    }
}
