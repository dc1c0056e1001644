//! The scores, a table for each site and each fate, a row for each lead and method.

use crate::corpus::SubjectKind;
use crate::record::{Record, SeriesForecasts};
use crate::sums::{SEED, cell, crps, one_if, said, sums};
use slipwatch::score::{Method, Sum, log_score, mean, ratio};
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fmt::Write as _;

const HEAD: &str = "| when | method | forecasts | silent | CRPS, days | ours over it | log score, nats | in 90 % |\n\
                    |---|---|---|---|---|---|---|---|\n";

const ABOUT: &str = "Forecasts as they would have been made, scored against what came. In brackets, 90 % intervals of a bootstrap \
over series. A method that had nothing to say is scored as saying that no failure comes; `silent` counts it. `ours over it` is the \
first method's mean CRPS over that of the row: under 1, the first is better. `in 90 %`: failures within the central 90 % of \
those that gave a forecast; a point forecast has no interval. Series of \
one site share their failure, so the intervals of several are too narrow; one series alone has none.\n";

/// The whole text.
pub(crate) fn text(series: &[SeriesForecasts], methods: &[&Method]) -> String {
    let mut out = ABOUT.to_owned();
    let families: BTreeSet<(SubjectKind, &str)> = series
        .iter()
        .map(|one| (one.kind, one.family.as_str()))
        .collect();
    for (kind, family) in families {
        let of_family = series.iter();
        let of_family: Vec<&SeriesForecasts> = of_family
            .filter(|one| (one.kind, one.family.as_str()) == (kind, family))
            .collect();
        let heading = format!("{family} ({}, {} series)", kind.name(), of_family.len());
        let records = of_family.iter().flat_map(|one| &one.records);
        let mut leads: Vec<Option<f64>> = records.map(|record| record.lead_days).collect();
        leads.sort_by(|a, b| b.partial_cmp(a).unwrap_or(Ordering::Equal));
        leads.dedup();
        // Writing to a string cannot fail.
        let _ = write!(out, "\n## {heading}\n\n{HEAD}");
        for lead in leads {
            rows(&mut out, lead, (&of_family, methods));
        }
    }
    out
}

fn rows(out: &mut String, lead: Option<f64>, (series, methods): (&[&SeriesForecasts], &[&Method])) {
    let sums = |method: &Method, score: &dyn Fn(&Record) -> Option<f64>| {
        let at_lead = |record: &Record| (record.lead_days == lead).then(|| score(record))?;
        sums(series, method.name, &at_lead)
    };
    let before = match lead {
        Some(days) if days <= 1.0 => format!("{:.0} h before it failed", 24.0 * days),
        Some(days) => format!("{days} d before it failed"),
        None => "over the record".to_owned(),
    };
    let ours = methods
        .first()
        .map(|method| sums(method, &|one| Some(crps(one))));
    for method in methods {
        let theirs = sums(method, &|one| Some(crps(one)));
        let count = |sums: &[Sum]| sums.iter().fold(0.0, |all, sum| all + sum.count);
        let silent = sums(method, &|one| one.said.is_none().then_some(1.0));
        let nats = sums(method, &|one| Some(log_score(&said(one), one.outcome)));
        let held = sums(method, &|one| one.covered.map(one_if));
        let over = ours.as_ref().and_then(|ours| ratio(ours, &theirs, SEED));
        let _ = writeln!(
            out,
            "| {before} | {} | {} | {} | {} | {} | {} | {} |",
            method.name,
            count(&theirs),
            count(&silent),
            cell(mean(&theirs, SEED)),
            cell(over),
            cell(mean(&nats, SEED)),
            cell(mean(&held, SEED)),
        );
    }
}
