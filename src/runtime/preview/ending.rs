//! Whether everything that the files end with is refused: the newest readings are missing then, and nothing else shows it.

use crate::reading::BenchmarkId;
use crate::runtime::ingest::Item;
use crate::runtime::tail::LinesRead;
use std::collections::BTreeMap;

/// Fewer rows at the end may be torn, or one logger's hiccup.
const FEWEST_ROWS: u64 = 5;

/// What has been refused since the last that was taken.
#[derive(Debug)]
struct RefusedEnd {
    /// The first of it.
    at: String,
    why: String,
    count: u64,
}

/// By source the rows, and by source and benchmark the readings in another unit.
#[derive(Debug, Default)]
pub(super) struct RefusedEnds {
    rows: BTreeMap<String, RefusedEnd>,
    units: BTreeMap<(String, BenchmarkId), RefusedEnd>,
}

impl RefusedEnds {
    /// A reading in another unit than before in its file.
    pub(super) fn refuse_unit(
        &mut self,
        source: &str,
        benchmark: &BenchmarkId,
        at: impl FnOnce() -> String,
        why: &str,
    ) {
        let key = (source.to_owned(), benchmark.clone());
        let end = self.units.entry(key).or_insert_with(|| RefusedEnd {
            at: at(),
            why: why.to_owned(),
            count: 0,
        });
        end.count += 1;
    }

    /// A reading that is taken.
    pub(super) fn take(&mut self, source: &str, benchmark: &BenchmarkId) {
        if !self.units.is_empty() {
            self.units.remove(&(source.to_owned(), benchmark.clone()));
        }
    }

    /// Lines of a source's file.
    pub(super) fn feed(&mut self, source: &str, fed: &LinesRead, file: &str) {
        let is_value = |item: &Item| matches!(item, Item::Reading { .. } | Item::Sample { .. });
        let taken = fed.items.iter().filter(|(_, item)| is_value(item));
        let newest = taken.map(|(line, _)| *line).max();
        if newest.is_some() {
            self.rows.remove(source);
        }
        for bad in fed
            .bad
            .iter()
            .filter(|bad| newest.is_none_or(|newest| bad.number > newest))
        {
            let end = self
                .rows
                .entry(source.to_owned())
                .or_insert_with(|| RefusedEnd {
                    at: format!("{file}, line {}", bad.number),
                    why: bad.error.to_string(),
                    count: 0,
                });
            end.count += 1;
        }
    }

    /// A line for each.
    pub(super) fn lines(&self) -> Vec<String> {
        let units = self.units.iter().map(|((_, benchmark), end)| {
            let RefusedEnd { at, why, count } = end;
            format!(
                "benchmark {:?}: from {at} on all readings are refused ({count} of them): {why}; a file has one unit for each benchmark, so \
                 let the logger begin another file, or write those rows in the former unit",
                benchmark.as_str()
            )
        });
        let rows = self.rows.iter().filter(|(_, end)| end.count >= FEWEST_ROWS);
        let rows = rows.map(|(source, end)| {
            let RefusedEnd { at, why, count } = end;
            format!("source {source:?}: from {at} on all rows are refused ({count} of them), the first: {why}")
        });
        units.chain(rows).collect()
    }
}
