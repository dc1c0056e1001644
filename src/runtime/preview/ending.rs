//! What is missing at the files' ends, and nothing else shows: where everything that they end with is refused, and where a header that comes
//! again has no column of a benchmark any more.

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

/// By source the rows, and the columns that are gone.
#[derive(Debug, Default)]
pub(super) struct RefusedEnds {
    rows: BTreeMap<String, RefusedEnd>,
    gone: Vec<String>,
}

impl RefusedEnds {
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
        let gone = fed.remarks.iter().filter(|remark| remark.is_loss);
        let gone = gone.map(|remark| format!("source {source:?}: {file}: {remark}"));
        self.gone.extend(gone);
    }

    /// A line for each.
    pub(super) fn lines(&self) -> Vec<String> {
        let rows = self.rows.iter().filter(|(_, end)| end.count >= FEWEST_ROWS);
        let rows = rows.map(|(source, end)| {
            let RefusedEnd { at, why, count } = end;
            format!("source {source:?}: from {at} on all rows are refused ({count} of them), the first: {why}")
        });
        rows.chain(self.gone.iter().cloned()).collect()
    }
}
