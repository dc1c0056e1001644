//! The table at the end: what was called when, against what happened.

use super::crisis::{Crisis, End};
use super::timeline::{DemoRecord, day};
use crate::alert::{Level, chance_in_words};
use crate::reading::{BenchmarkId, Timestamp, days_since};

/// The table's head.
pub(super) const HEAD: &str = concat!(
    "                                first orange   first red      10 days before\n",
    "crisis                 point    days before    days before    the end: days off"
);

/// One benchmark's line of the table.
pub(super) fn line(crisis: &Crisis, id: &BenchmarkId, record: &DemoRecord) -> String {
    let failed = crisis.failed();
    let first = |level: Level| match (record.first.get(&level), failed) {
        (Some(time), Some(failed)) => format!("{:.1}", days_since(*time, failed)),
        (Some(time), None) => format!("false, {}", time.strftime("%Y-%m")),
        (None, _) => "never".to_owned(),
    };
    format!(
        "{:<22} {:<8} {:<14} {:<14} {}",
        crisis.site,
        id.as_str(),
        first(Level::Orange),
        first(Level::Red),
        failed.map_or_else(|| "-".to_owned(), |failed| ten_days_before(failed, record)),
    )
}

/// What happened in the end, and what kind of data it is known by.
pub(super) fn happened(crisis: &Crisis) -> String {
    let end = match crisis.end {
        End::Failed(_) => {
            let failed = crisis.failed();
            failed.map_or_else(String::new, |time| format!("failed on {}", day(time)))
        }
        End::Stood(words) => words.to_owned(),
    };
    format!("{}, {}: {end}", crisis.site, crisis.kind)
}

fn ten_days_before(failed: Timestamp, record: &DemoRecord) -> String {
    let made = record
        .forecasts
        .iter()
        .rev()
        .find(|(time, _)| days_since(*time, failed) >= 10.0);
    let Some((_, forecast)) = made else {
        return "none".to_owned();
    };
    match forecast.median {
        Some(median) => format!("{:+.1}", days_since(failed, median)),
        None => format!("no failure ({})", chance_in_words(forecast.probability)),
    }
}
