//! A header that comes again in the middle of a file: what of the readings it changes.

use super::Remark;
use super::columns::{Column, Layout};
use crate::reading::{BenchmarkId, Unit};

/// The readings of a header: the column's name, whose they are, and in which unit.
#[derive(Debug, Clone, Default)]
pub(super) struct HeaderReadings(Vec<(String, BenchmarkId, Unit)>);

impl HeaderReadings {
    fn of(layout: &Layout) -> Self {
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
        Self(readings.collect())
    }

    /// Takes the header at `line`, with remarks on what it changes.
    pub(super) fn follow(&mut self, line: u64, layout: &mut Layout) {
        let now = Self::of(layout);
        for (name, benchmark, unit) in &self.0 {
            let quantity = unit.quantity();
            let mut same = now.0.iter();
            let same =
                same.find(|(_, other, unit)| other == benchmark && unit.quantity() == quantity);
            let id = benchmark.as_str();
            let text = match same {
                Some((.., is)) if is == unit => continue,
                Some((other, _, is)) => format!(
                    "line {line}: a header that comes again has {other:?} in {is}, and it was {name:?} in {unit} before: values are given in the \
                     first of both units; is the header right?"
                ),
                None => format!(
                    "line {line}: a header that comes again has no column {name:?}, where the readings of benchmark {id:?} stood: below it there are \
                     none of them. Put what follows into a file of its own, with a [[benchmark]] column that names its column"
                ),
            };
            layout.remarks.push(Remark {
                about: format!("benchmark {id:?}"),
                text,
            });
        }
        *self = now;
    }
}
