//! What each method predicted of La Clapière, which contemporaries expected to fall and which stands.

use crate::record::{Record, SeriesForecasts};
use crate::sums::{PANEL, Scored, grid};
use slipwatch::reading::{Timestamp, after_days};
use std::collections::BTreeMap;
use std::fmt::Write as _;

const SITE: &str = "La Clapière";
const METHODS: [&str; 6] = [
    PANEL,
    "inverse-velocity-line",
    "exponential-threshold",
    "river-weighted-line",
    "river-removed-line",
    "constant-load",
];
/// Contemporaries expected the collapse in these years (Vibert et al. 1988, Rat 1988).
const FEARED: [&str; 2] = ["1988", "1990"];
/// A median so many days away is given as one that is far.
const FAR_DAYS: f64 = 3652.5;

/// The section; empty without the series.
pub(crate) fn section(out: &mut String, scored: &Scored) {
    let Some(one) = scored.stood.iter().find(|one| one.family == SITE) else {
        return;
    };
    let Some(epoch) = one.epoch else {
        return;
    };
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n### {} ({})\n\nMedian date of failure by each method at each look of a year, in order (*never*: no median; *far*: beyond ten years; –: nothing to say). The panel looks \
         400 days ahead. It stood throughout.",
        one.name,
        one.kind.name()
    );
    let mut years: BTreeMap<String, BTreeMap<&str, Vec<String>>> = BTreeMap::new();
    for record in &one.records {
        if let Some(at) = after_days(epoch, record.now_days) {
            let year = years.entry(at.strftime("%Y").to_string()).or_default();
            let cells = year.entry(record.method).or_default();
            cells.push(cell(record, at));
        }
    }
    let row = |(year, of): (&String, &BTreeMap<&str, Vec<String>>)| {
        let cells = METHODS
            .iter()
            .map(|name| of.get(name).map_or("–".to_owned(), |cells| in_runs(cells)));
        std::iter::once(year.clone()).chain(cells).collect()
    };
    let rows: Vec<Vec<String>> = years.iter().map(row).collect();
    let mut head = vec!["year".to_owned()];
    head.extend(METHODS.map(str::to_owned));
    grid(out, &head, &rows);
    let _ = writeln!(
        out,
        "\nEvaluations at which a method's median predicted a collapse before the end of the record, and in {} to {}, when its contemporaries expected one:",
        FEARED[0], FEARED[1]
    );
    let head = ["method", "evaluations", "before the end", "in those years"];
    let rows = scored
        .methods
        .iter()
        .map(|name| false_ones(one, epoch, name));
    let rows: Vec<Vec<String>> = rows.collect();
    grid(out, &head.map(str::to_owned), &rows);
}

fn median(record: &Record, at: Timestamp) -> Option<Timestamp> {
    let days = record.said.as_ref()?.quantile(0.5, FAR_DAYS)?;
    after_days(at, days)
}

fn cell(record: &Record, at: Timestamp) -> String {
    let Some(said) = &record.said else {
        return "–".to_owned();
    };
    match median(record, at) {
        Some(median) => median.strftime("%Y-%m").to_string(),
        None if said.quantile(0.5, f64::INFINITY).is_some() => "far".to_owned(),
        None => "never".to_owned(),
    }
}

/// One word where all are the same.
fn in_runs(cells: &[String]) -> String {
    match cells.first() {
        Some(first) if cells.iter().all(|cell| cell == first) => first.clone(),
        _ => cells.join(", "),
    }
}

fn false_ones(one: &SeriesForecasts, epoch: Timestamp, name: &str) -> Vec<String> {
    let end = one
        .records
        .iter()
        .fold(0.0, |end: f64, record| match record.outcome {
            slipwatch::score::Outcome::Stood(for_days) => end.max(record.now_days + for_days),
            slipwatch::score::Outcome::Failed(_) => end,
        });
    let end = after_days(epoch, end);
    let records: Vec<&Record> = one
        .records
        .iter()
        .filter(|record| record.method == name)
        .collect();
    let medians: Vec<Timestamp> = records
        .iter()
        .filter_map(|record| median(record, after_days(epoch, record.now_days)?))
        .filter(|median| end.is_some_and(|end| *median < end))
        .collect();
    let feared = medians.iter().filter(|median| {
        let year = median.strftime("%Y").to_string();
        (FEARED[0]..=FEARED[1]).contains(&year.as_str())
    });
    vec![
        name.to_owned(),
        records.len().to_string(),
        medians.len().to_string(),
        feared.count().to_string(),
    ]
}
