//! The scorecard for people.

use super::{ScoreReport, hours};
use crate::alert::{Level, chance_in_words};
use crate::cli::table::{TextTable, time};
use crate::reading::Timestamp;
use crate::score::{Lead, Score};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Errors and scores of leads under this are given in hours.
const HOURS_UNDER_DAYS: f64 = 2.0;

pub(super) fn text(report: &ScoreReport) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = match report.failure_time {
        Some(failure) => writeln!(
            out,
            "benchmark {}, failed {}",
            report.benchmark,
            time(Some(failure))
        ),
        None => writeln!(out, "benchmark {}, did not fail", report.benchmark),
    };
    let _ = writeln!(out, "\n{}\n", meaning(report));
    out.push_str(&table(report).to_string());
    out.push('\n');
    out.push_str(&warning(report));
    out
}

/// What the table's figures are.
pub(super) fn meaning(report: &ScoreReport) -> String {
    if report.failure_time.is_some() {
        let line = "Median less failure, and in brackets the CRPS: above 0 the forecast is late, which is the unsafe side.";
        let is_beyond = |lead: &Lead| lead.remaining_days > lead.scored_days;
        if report.card.leads.iter().any(is_beyond) {
            format!(
                "{line}\nNo CRPS where the failure lies beyond what a forecast is scored to: five record lengths, at most 60 days."
            )
        } else {
            line.to_owned()
        }
    } else {
        let looks = report.card.looks.len();
        format!(
            "Over {looks} forecasts: mean CRPS, days, and the highest chance of a failure within 400 days."
        )
    }
}

/// The scores.
pub(super) fn table(report: &ScoreReport) -> TextTable {
    if report.failure_time.is_some() {
        leads(report)
    } else {
        looks(report)
    }
}

/// A row for each method, a column for each lead.
fn leads(report: &ScoreReport) -> TextTable {
    let heads = report.card.leads.iter().map(|lead| {
        if lead.lead_days < HOURS_UNDER_DAYS {
            format!("{:.0} h before", 24.0 * lead.lead_days)
        } else {
            format!("{:.0} d before", lead.lead_days)
        }
    });
    let mut table = TextTable::headed(std::iter::once("method".to_owned()).chain(heads));
    for method in &report.card.methods {
        let cells = report.card.leads.iter().map(|lead| {
            let (factor, unit) = if lead.lead_days < HOURS_UNDER_DAYS {
                (24.0, "h")
            } else {
                (1.0, "d")
            };
            lead.scores.get(method).map_or_else(String::new, |score| {
                let crps = factor * score.crps_days;
                let is_scored = lead.remaining_days <= lead.scored_days;
                let crps = is_scored.then(|| format!("{crps:.1}"));
                cell(score, factor, unit, crps.as_deref().unwrap_or("-"))
            })
        });
        table.row(std::iter::once((*method).to_owned()).chain(cells));
    }
    table
}

fn cell(score: &Score, factor: f64, unit: &str, crps: &str) -> String {
    if !score.said {
        return format!("- ({crps})");
    }
    match score.error_days {
        Some(error) => format!("{:+.1} {unit} ({crps})", factor * error),
        None => format!("never ({crps})"),
    }
}

fn looks(report: &ScoreReport) -> TextTable {
    let mut table = TextTable::headed(["method", "CRPS", "highest chance", "said"]);
    for method in &report.card.methods {
        let of = |look: &BTreeMap<&'static str, Score>| look.get(method).cloned();
        let scores: Vec<Score> = report
            .card
            .looks
            .iter()
            .filter_map(|look| of(&look.scores))
            .collect();
        let sum = scores.iter().map(|score| score.crps_days).sum::<f64>();
        let crps = (!scores.is_empty()).then(|| sum / scores.len() as f64);
        let highest = scores
            .iter()
            .map(|score| score.probability)
            .max_by(f64::total_cmp);
        let said = scores.iter().filter(|score| score.said).count();
        table.row([
            (*method).to_owned(),
            crps.map_or("-".to_owned(), |crps| format!("{crps:.2}")),
            highest.map_or("-".to_owned(), chance_in_words),
            format!("{said} of {}", scores.len()),
        ]);
    }
    table
}

fn warning(report: &ScoreReport) -> String {
    let warning = &report.warning;
    let mut out = String::new();
    let firsts: [(Level, Option<Timestamp>); 3] = [
        (Level::Yellow, warning.first_yellow),
        (Level::Orange, warning.first_orange),
        (Level::Red, warning.first_red),
    ];
    for (level, first) in firsts {
        let at = warning.hours_at.get(&level).copied().unwrap_or(0.0);
        let _ = match (first, report.failure_time) {
            (None, _) => writeln!(out, "{level}: never"),
            (Some(first), Some(failure)) => writeln!(
                out,
                "{level}: first {}, {:.0} h before the failure; in force {at:.0} h",
                time(Some(first)),
                hours(first, failure)
            ),
            (Some(first), None) => {
                writeln!(
                    out,
                    "{level}: first {}; in force {at:.0} h",
                    time(Some(first))
                )
            }
        };
    }
    let _ = writeln!(
        out,
        "orange or red in {:.0} hours a year of {:.0} h of record",
        warning.hours_per_year, warning.hours
    );
    out
}
