//! Scores gathered by series, and how figures are written.

use crate::corpus::SubjectKind;
use crate::record::{Record, SeriesForecasts};
use slipwatch::forecast::{HORIZON_DAYS, Passage};
use slipwatch::score::{Interval, Sum, crps_days, mean, scored_days};
use std::fmt::Write as _;

/// Of the bootstrap.
pub(crate) const SEED: u64 = 1;
/// What the program itself says; every other method is a rival.
pub(crate) const OURS: [&str; 2] = ["panel", "slider-block"];
/// The first of them: what the monitor uses.
pub(crate) const PANEL: &str = OURS[0];

/// What is reported of each series, as the document groups it.
#[derive(Debug)]
pub(crate) struct Scored<'a> {
    pub(crate) methods: Vec<&'static str>,
    pub(crate) failing: Vec<&'a SeriesForecasts>,
    pub(crate) standing: Vec<&'a SeriesForecasts>,
    /// Measured and reconstructed, that failed.
    pub(crate) failed: Vec<&'a SeriesForecasts>,
    /// Measured and reconstructed, that stood.
    pub(crate) stood: Vec<&'a SeriesForecasts>,
}

impl<'a> Scored<'a> {
    pub(crate) fn of(series: &'a [SeriesForecasts], methods: Vec<&'static str>) -> Self {
        let those = |simulated: bool, failed: bool| {
            let is_meant = |one: &&SeriesForecasts| {
                let mut ends = one.records.iter().map(Record::remaining_days);
                let has_failed = ends.any(|days| days.is_some());
                (one.kind == SubjectKind::Simulated) == simulated && has_failed == failed
            };
            series.iter().filter(is_meant).collect()
        };
        Self {
            methods,
            failing: those(true, true),
            standing: those(true, false),
            failed: those(false, true),
            stood: those(false, false),
        }
    }

    pub(crate) fn rivals(&self) -> impl Iterator<Item = &'static str> {
        let methods = self.methods.iter().copied();
        methods.filter(|name| !OURS.contains(name))
    }

    /// The rival of the lowest mean CRPS over the records that `is_meant`, and that, days.
    pub(crate) fn best_rival(
        &self,
        series: &[&SeriesForecasts],
        is_meant: &dyn Fn(&Record) -> bool,
    ) -> Option<(&'static str, f64)> {
        let each = self.rivals().filter_map(|name| {
            let score = |record: &Record| is_meant(record).then(|| crps(record));
            Some((name, average(&sums(series, name, &score))?))
        });
        each.min_by(|one, other| one.1.total_cmp(&other.1))
    }
}

/// The scores of one method by series, the series without any left out.
pub(crate) fn sums(
    series: &[&SeriesForecasts],
    method: &str,
    score: &dyn Fn(&Record) -> Option<f64>,
) -> Vec<Sum> {
    let of = |one: &&SeriesForecasts| {
        let meant = one.records.iter().filter(|record| record.method == method);
        let scores = meant.filter_map(score);
        scores.fold(Sum::default(), |sum, score| Sum {
            sum: sum.sum + score,
            count: sum.count + 1.0,
        })
    };
    let each = series.iter().map(of);
    each.filter(|sum| sum.count > 0.0).collect()
}

/// The mean without its interval, which takes long.
pub(crate) fn average(sums: &[Sum]) -> Option<f64> {
    let (sum, count) = sums.iter().fold((0.0, 0.0), |(sum, count), one| {
        (sum + one.sum, count + one.count)
    });
    (count > 0.0).then(|| sum / count)
}

/// The mean of a score at the records that `is_meant`, with its interval.
pub(crate) fn mean_crps(
    series: &[&SeriesForecasts],
    method: &str,
    is_meant: &dyn Fn(&Record) -> bool,
) -> Option<Interval> {
    let score = |record: &Record| is_meant(record).then(|| crps(record));
    mean(&sums(series, method, &score), SEED)
}

/// What was said; of who said nothing, that no failure comes.
pub(crate) fn said(record: &Record) -> Passage {
    record.said.clone().unwrap_or_default()
}

/// The first reading is day 0 of every record.
pub(crate) fn crps(record: &Record) -> f64 {
    crps_days(&said(record), record.outcome, scored_days(record.now_days))
}

/// Median less failure, days; infinite where no median came, `None` where no failure did.
pub(crate) fn error_days(record: &Record) -> Option<f64> {
    let median = said(record).quantile(0.5, HORIZON_DAYS);
    Some(median.unwrap_or(f64::INFINITY) - record.remaining_days()?)
}

/// 1 where it is so.
pub(crate) fn one_if(is_so: bool) -> f64 {
    f64::from(u8::from(is_so))
}

pub(crate) fn cell(interval: Option<Interval>) -> String {
    interval.map_or("–".to_owned(), |interval| {
        let Interval { best, low, high } = interval;
        format!("{best:.3} ({low:.3} to {high:.3})")
    })
}

/// The same, shorter.
pub(crate) fn short_cell(interval: Option<Interval>) -> String {
    interval.map_or("–".to_owned(), |interval| {
        let Interval { best, low, high } = interval;
        format!("{best:.2} ({low:.2} to {high:.2})")
    })
}

pub(crate) fn percent(share: Option<f64>) -> String {
    share.map_or("–".to_owned(), |share| format!("{:.1} %", 100.0 * share))
}

/// A table in Markdown; the first column holds names.
pub(crate) fn grid(out: &mut String, head: &[String], rows: &[Vec<String>]) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "\n| {} |", head.join(" | "));
    let _ = writeln!(out, "|{}", "---|".repeat(head.len()));
    for row in rows {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
}

/// `first`, then each lead, days.
pub(crate) fn lead_head(first: &str, leads: &[f64], last: &[&str]) -> Vec<String> {
    let leads = leads.iter().map(|days| format!("{days} d"));
    let last = last.iter().map(|&name| name.to_owned());
    std::iter::once(first.to_owned())
        .chain(leads)
        .chain(last)
        .collect()
}
