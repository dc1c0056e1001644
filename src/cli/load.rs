//! A file of log-loads: CSV of `days,log_load`, one knot of the load a line.

use crate::model::Load;
use crate::runtime::ingest::IngestError;
use csv::StringRecord;
use std::path::Path;

/// The columns, in their order.
const COLUMNS: [&str; 2] = ["days", "log_load"];

/// Reads the knots of a load.
pub(super) fn read_load(file: &Path) -> anyhow::Result<Load> {
    let text = std::fs::read_to_string(file).map_err(|source| IngestError::Read {
        file: file.into(),
        source,
    })?;
    let mut lines = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut records = lines.records();
    let found = records.next().transpose()?.unwrap_or_default();
    if found.iter().ne(COLUMNS) {
        return Err(IngestError::BadHeader {
            file: file.into(),
            line: 1,
            found: format!("{:?}, not days,log_load", text.lines().next().unwrap_or("")),
        }
        .into());
    }
    let mut knots: Vec<(f64, f64)> = Vec::new();
    for record in records {
        let knot = knot(file, &record?, knots.last().map(|knot| knot.0))?;
        knots.push(knot);
    }
    if knots.is_empty() {
        let file = file.into();
        return Err(IngestError::Empty {
            file,
            missing: "row",
        }
        .into());
    }
    Ok(Load::new(knots)?)
}

/// One line; days may not be before `latest`.
fn knot(
    file: &Path,
    record: &StringRecord,
    latest: Option<f64>,
) -> Result<(f64, f64), IngestError> {
    let line = record.position().map_or(0, csv::Position::line);
    if record.len() != COLUMNS.len() {
        return Err(IngestError::Line {
            file: file.into(),
            line,
            found: format!("{} fields", record.len()),
            expected: COLUMNS.len(),
        });
    }
    let cell = |column: usize, expected: &'static str, fits: &dyn Fn(f64) -> bool| {
        let value = &record[column];
        let number = value.parse().ok().filter(|number: &f64| number.is_finite());
        number
            .filter(|number| fits(*number))
            .ok_or_else(|| IngestError::Field {
                file: file.into(),
                line,
                column: COLUMNS[column].to_owned(),
                value: value.to_owned(),
                expected,
            })
    };
    let not_earlier = |days: f64| latest.is_none_or(|latest| days >= latest);
    let days = cell(
        0,
        "a number of days, none before the line above",
        &not_earlier,
    )?;
    let log_load = cell(1, "a number: the change of (tau/sigma')/A", &|_| true)?;
    Ok((days, log_load))
}
