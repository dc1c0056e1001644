//! The records as lines of JSON, written and read again.

use crate::corpus::SubjectKind;
use crate::record::{HORIZONS_DAYS, Record, SeriesForecasts};
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use slipwatch::forecast::Passage;
use slipwatch::reading::Timestamp;
use slipwatch::score::{METHODS, Outcome};

#[derive(Serialize, Deserialize)]
struct Line {
    series: String,
    kind: String,
    family: String,
    epoch: Option<Timestamp>,
    method: String,
    lead_days: Option<f64>,
    now_days: f64,
    failed_after_days: Option<f64>,
    stood_for_days: Option<f64>,
    passage: Option<Vec<(f64, f64)>>,
    chances: [f64; HORIZONS_DAYS.len()],
    pit: Option<f64>,
    covered: Option<bool>,
}

/// Every record, a line of JSON each.
pub(crate) fn written(series: &[SeriesForecasts]) -> serde_json::Result<String> {
    let mut out = String::new();
    for one in series {
        for record in &one.records {
            out.push_str(&serde_json::to_string(&Line::of(one, record))?);
            out.push('\n');
        }
    }
    Ok(out)
}

/// What [`written`] wrote.
pub(crate) fn read(lines: &str) -> Result<Vec<SeriesForecasts>> {
    let mut series: Vec<SeriesForecasts> = Vec::new();
    for line in lines.lines() {
        let line: Line = serde_json::from_str(line)?;
        if series.last().is_none_or(|last| last.name != line.series) {
            series.push(SeriesForecasts {
                name: line.series.clone(),
                kind: SubjectKind::of(&line.kind)
                    .with_context(|| format!("no kind {}", line.kind))?,
                family: line.family.clone(),
                epoch: line.epoch,
                records: Vec::new(),
            });
        }
        if let Some(last) = series.last_mut() {
            last.records.push(line.record()?);
        }
    }
    Ok(series)
}

impl Line {
    fn of(one: &SeriesForecasts, record: &Record) -> Self {
        let (failed_after_days, stood_for_days) = match record.outcome {
            Outcome::Failed(days) => (Some(days), None),
            Outcome::Stood(days) => (None, Some(days)),
        };
        Self {
            series: one.name.clone(),
            kind: one.kind.name().to_owned(),
            family: one.family.clone(),
            epoch: one.epoch,
            method: record.method.to_owned(),
            lead_days: record.lead_days,
            now_days: record.now_days,
            failed_after_days,
            stood_for_days,
            passage: record.said.as_ref().map(|said| said.times().to_vec()),
            chances: record.chances,
            pit: record.pit,
            covered: record.covered,
        }
    }

    fn record(self) -> Result<Record> {
        let mut known = METHODS.iter().map(|method| method.name);
        let method = known.find(|name| *name == self.method);
        let failed = self.failed_after_days.map(Outcome::Failed);
        let outcome = failed.or(self.stood_for_days.map(Outcome::Stood));
        Ok(Record {
            method: method.with_context(|| format!("no method {}", self.method))?,
            lead_days: self.lead_days,
            now_days: self.now_days,
            outcome: outcome.context("neither failed nor stood")?,
            said: self.passage.map(Passage::from_times),
            chances: self.chances,
            pit: self.pit,
            covered: self.covered,
        })
    }
}
