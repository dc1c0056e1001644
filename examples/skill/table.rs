//! The scores: by kind and lead before failures, by family where slopes stood.

use crate::record::{Record, Told};
use slipwatch::forecast::Passage;
use slipwatch::score::{
    Interval, Method, Outcome, Sum, crps_days, is_covered, log_score, mean, ratio, scored_days,
};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Of the bootstrap.
const SEED: u64 = 1;

const HEAD: &str = "| method | forecasts | silent | CRPS, days | ours over it | log score, nats | in 90 % |\n\
                    |---|---|---|---|---|---|---|\n";

const ABOUT: &str = "Forecasts as they would have been made, scored against what came. In brackets, 90 % intervals of a bootstrap \
over series. A method that had nothing to say is scored as saying that no failure comes; `silent` counts it. `ours over it` is the \
first method's mean CRPS over that of the row: under 1, the first is better. `in 90 %`: failures within the central 90 % of \
those that spoke; a point forecast has no interval.\n";

/// The whole text.
pub(crate) fn text(told: &[Told], methods: &[&Method]) -> String {
    let mut out = ABOUT.to_owned();
    let kinds: BTreeSet<_> = told.iter().map(|one| one.kind).collect();
    for kind in kinds {
        let of_kind: Vec<&Told> = told.iter().filter(|one| one.kind == kind).collect();
        let mut leads: Vec<f64> = records(&of_kind).filter_map(|one| one.lead_days).collect();
        leads.sort_by(|a, b| b.total_cmp(a));
        leads.dedup();
        for lead in leads {
            let heading = if lead < 1.0 || kind.name() == "measured" {
                format!(
                    "{}, {:.0} hours before the failure",
                    kind.name(),
                    24.0 * lead
                )
            } else {
                format!("{}, {lead} days before the failure", kind.name())
            };
            section(&mut out, &heading, (&of_kind, methods), |record| {
                record.lead_days == Some(lead)
            });
        }
        let stood = |one: &&&Told| one.records.iter().any(|record| record.lead_days.is_none());
        let families: BTreeSet<&str> = of_kind
            .iter()
            .filter(stood)
            .map(|one| &*one.family)
            .collect();
        for family in families {
            let of_family: Vec<&Told> = of_kind
                .iter()
                .copied()
                .filter(|one| one.family == family)
                .collect();
            let heading = format!("{}, {family}, which stood", kind.name());
            section(&mut out, &heading, (&of_family, methods), |_| true);
        }
    }
    out
}

fn records<'a>(told: &'a [&Told]) -> impl Iterator<Item = &'a Record> {
    told.iter().flat_map(|one| &one.records)
}

fn section(
    out: &mut String,
    heading: &str,
    (told, methods): (&[&Told], &[&Method]),
    is_meant: impl Fn(&Record) -> bool,
) {
    // Writing to a string cannot fail.
    let _ = write!(out, "\n## {heading}\n\n{HEAD}");
    let sums = |method: &Method, score: &dyn Fn(&Record) -> Option<f64>| -> Vec<Sum> {
        let of = |one: &&Told| {
            let meant = one.records.iter();
            let meant = meant.filter(|record| record.method == method.name && is_meant(record));
            meant
                .filter_map(score)
                .fold(Sum::default(), |sum, score| Sum {
                    sum: sum.sum + score,
                    count: sum.count + 1.0,
                })
        };
        let each = told.iter().map(of);
        each.filter(|sum| sum.count > 0.0).collect()
    };
    let ours = methods
        .first()
        .map(|method| sums(method, &|one| Some(crps(one))));
    for method in methods {
        let theirs = sums(method, &|one| Some(crps(one)));
        let count = |sums: &[Sum]| sums.iter().map(|sum| sum.count).sum::<f64>();
        let silent = sums(method, &|one| one.said.is_none().then_some(1.0));
        let nats = sums(method, &|one| Some(log_score(&said(one), one.outcome)));
        let held = sums(method, &covered);
        let over = ours.as_ref().and_then(|ours| ratio(ours, &theirs, SEED));
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {} | {} | {} |",
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

fn said(record: &Record) -> Passage {
    record.said.clone().unwrap_or_default()
}

/// The first reading is day 0 of every record.
fn crps(record: &Record) -> f64 {
    crps_days(&said(record), record.outcome, scored_days(record.now_days))
}

/// Whether its interval held the failure, 1 or 0; `None` without a failure or an interval.
fn covered(record: &Record) -> Option<f64> {
    let Outcome::Failed(after) = record.outcome else {
        return None;
    };
    let said = record.said.as_ref()?;
    (said.times().len() > 1).then(|| f64::from(u8::from(is_covered(said, after))))
}

fn cell(interval: Option<Interval>) -> String {
    interval.map_or("–".to_owned(), |interval| {
        let Interval { best, low, high } = interval;
        format!("{best:.3} ({low:.3} to {high:.3})")
    })
}
