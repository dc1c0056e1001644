//! The table at the end: what was called when, against what happened.

use super::crisis::{Crisis, End};
use super::timeline::{Record, day, lead};
use crate::alert::Level;
use crate::reading::{BenchmarkId, Timestamp, days_since};

/// The table's head.
pub(super) const HEAD: &str = "crisis                 point    kind                 first orange               first red                  ten days before          what happened";

/// One benchmark's line of the table.
pub(super) fn line(crisis: &Crisis, id: &BenchmarkId, record: &Record) -> String {
    let failed = crisis.failed();
    let first = |level: Level| match (record.first.get(&level), failed) {
        (Some(time), Some(failed)) => format!("{}, {}", day(*time), lead(failed, *time)),
        (Some(time), None) => format!("{} (false)", day(*time)),
        (None, _) => "never".to_owned(),
    };
    let happened = match crisis.end {
        End::Failed(_) => failed.map_or_else(String::new, |time| format!("failed {}", day(time))),
        End::Stood(words) => words.to_owned(),
    };
    format!(
        "{:<22} {:<8} {:<20} {:<26} {:<26} {:<24} {happened}",
        crisis.site,
        id.as_str(),
        crisis.kind,
        first(Level::Orange),
        first(Level::Red),
        failed.map_or_else(|| "-".to_owned(), |failed| ten_days_before(failed, record)),
    )
}

fn ten_days_before(failed: Timestamp, record: &Record) -> String {
    let made = record
        .forecasts
        .iter()
        .rev()
        .find(|(time, _)| days_since(*time, failed) >= 10.0);
    let Some((_, forecast)) = made else {
        return "none".to_owned();
    };
    match forecast.median {
        Some(median) => format!("{}, {:+.1} d off", day(median), days_since(failed, median)),
        None => format!("no failure ({:.2})", forecast.probability),
    }
}
