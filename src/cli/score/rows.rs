//! A scorecard as rows of a table: one for each forecast that was scored.

use super::ScoreReport;
use super::warning::Warning;
use crate::reading::Timestamp;
use crate::score::Score;
use schemars::JsonSchema;
use serde::Serialize;

/// How one method did at one lead, or at one look at a slope that stood.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct ScoreRow<'a> {
    /// Which.
    benchmark: &'a str,
    /// When the slope failed; `None`: it had not.
    failure_time: Option<Timestamp>,
    /// Which method.
    method: &'a str,
    /// The lead that was asked for, days; `None` of a slope that stood.
    lead_days: Option<f64>,
    /// The latest measured-at time that any forecast here used.
    known_until: Timestamp,
    /// From there to the failure, days.
    remaining_days: Option<f64>,
    /// From there to the end of the record of a slope that stood, days.
    stood_days: Option<f64>,
    #[serde(flatten)]
    score: &'a Score,
    /// The levels that a replay called; the same in each row of a benchmark.
    warning: &'a Warning,
}

/// The rows of a report, by lead or look and then by method.
pub(super) fn of(report: &ScoreReport) -> Vec<ScoreRow<'_>> {
    let row = |known_until, method, score| ScoreRow {
        benchmark: &report.benchmark,
        failure_time: report.failure_time,
        method,
        lead_days: None,
        known_until,
        remaining_days: None,
        stood_days: None,
        score,
        warning: &report.warning,
    };
    let mut rows = Vec::new();
    for lead in &report.card.leads {
        rows.extend(lead.scores.iter().map(|(method, score)| ScoreRow {
            lead_days: Some(lead.lead_days),
            remaining_days: Some(lead.remaining_days),
            ..row(lead.known_until, method, score)
        }));
    }
    for look in &report.card.looks {
        rows.extend(look.scores.iter().map(|(method, score)| ScoreRow {
            stood_days: Some(look.stood_days),
            ..row(look.known_until, method, score)
        }));
    }
    rows
}
