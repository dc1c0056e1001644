//! What in a benchmark's readings hardly means what was intended: a wrong unit, a wrong zone, a mark for no value, a
//! reset that nobody declared.

use super::BenchmarkView;
use crate::reading::{Quantity, Timestamp};
use jiff::SignedDuration;

/// Numbers that loggers write where they have no value, as far as their digits go.
const MARKS: [f64; 12] = [
    99.0, 999.0, 999.9, 999.99, 6999.0, 7999.0, 8888.0, 9999.0, 9999.9, 32_768.0, 99_999.0,
    999_999.0,
];
/// So many times the span of the others a mark is away from them.
const AWAY: f64 = 5.0;
/// A fall of so many times the usual scatter of a step.
const FALL: f64 = 50.0;
/// Fewer readings show nothing.
const FEWEST: usize = 10;
/// A slope of which all readings lie within so many mm, and are given to a thousandth of one, may be in m.
const SMALL_MM: f64 = 2.0;
/// A slope that moved by more m than this may be in mm.
const LARGE_M: f64 = 100.0;

/// Lines for a person, each with its evidence; `now` is this machine's time.
pub(super) fn suspicions(
    view: &BenchmarkView,
    readings: &[(Timestamp, f64)],
    now: Timestamp,
) -> Vec<String> {
    let mut readings = readings.to_vec();
    readings.sort_by_key(|(time, _)| *time);
    let mut lines = Vec::new();
    if view.last.0 > now {
        let ahead = SignedDuration::from_secs(view.last.0.duration_since(now).as_secs());
        lines.push(format!(
            "the last reading, {}, is {ahead:#} ahead of this machine's clock: is the time_zone of the source right, and dst?",
            view.last.0
        ));
    }
    if readings.len() < FEWEST {
        return lines;
    }
    if let Some((mark, line)) = mark(&readings) {
        readings.retain(|(_, value)| same(*value, mark).is_none());
        lines.push(line);
    }
    if view.quantity == Quantity::Displacement {
        lines.extend(fall(&readings, &view.unit));
        lines.extend(scale(&readings, &view.unit));
    }
    lines
}

fn same(one: f64, other: f64) -> Option<()> {
    ((one - other).abs() < 1e-9).then_some(())
}

/// A number that marks no value elsewhere, far from all others.
fn mark(readings: &[(Timestamp, f64)]) -> Option<(f64, String)> {
    let is_mark = |value: f64| MARKS.iter().any(|mark| same(value.abs(), *mark).is_some());
    let (time, found) = *readings.iter().find(|(_, value)| is_mark(*value))?;
    let others = readings
        .iter()
        .map(|(_, value)| *value)
        .filter(|value| same(*value, found).is_none());
    let (low, high) = span(others)?;
    let away = (found - high).max(low - found);
    let count = readings
        .iter()
        .filter(|(_, value)| same(*value, found).is_some())
        .count();
    (away > AWAY * (high - low)).then(|| {
        let line = format!(
            "{found} stands {count} times, first at {time}, and all other readings lie between {low} and {high}: \
             if it means that there is no value, add missing = [{found}] to the source"
        );
        (found, line)
    })
}

fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |span, value| {
        let (low, high) = span.unwrap_or((value, value));
        Some((value.min(low), value.max(high)))
    })
}

/// A displacement that falls at once by far more than it ever does.
fn fall(readings: &[(Timestamp, f64)], unit: &str) -> Option<String> {
    let pairs = readings.iter().zip(readings.iter().skip(1));
    let steps: Vec<(Timestamp, Timestamp, f64)> = pairs
        .map(|(before, after)| (before.0, after.0, after.1 - before.1))
        .collect();
    let usual = median(steps.iter().map(|step| step.2))?;
    let scatter = 1.4826 * median(steps.iter().map(|step| (step.2 - usual).abs()))?;
    let scatter = scatter.max(median(steps.iter().map(|step| step.2.abs()))?);
    let (before, after, step) = *steps
        .iter()
        .min_by(|one, other| one.2.total_cmp(&other.2))?;
    (scatter > 0.0 && usual - step > FALL * scatter).then(|| {
        format!(
            "between {before} and {after} it fell by {:.3} {unit}, {:.0} times the usual scatter of a step: \
             if the sensor was reset, declare it with [[event]] kind = \"reset\"",
            -step,
            (usual - step) / scatter
        )
    })
}

/// A movement that is the size of another unit.
fn scale(readings: &[(Timestamp, f64)], unit: &str) -> Option<String> {
    let (low, high) = span(readings.iter().map(|(_, value)| *value))?;
    let moved = high - low;
    let is_in_thousandths = |value: f64| (value * 1000.0 - (value * 1000.0).round()).abs() < 1e-6;
    let is_finer = readings
        .iter()
        .any(|(_, value)| (value * 100.0 - (value * 100.0).round()).abs() > 1e-6);
    let in_thousandths = is_finer && readings.iter().all(|(_, value)| is_in_thousandths(*value));
    if unit == "mm" && moved > 0.0 && moved < SMALL_MM && in_thousandths {
        return Some(format!(
            "all readings lie within {moved:.3} mm and are given to 0.001 mm: if they are metres, say unit = \"m\""
        ));
    }
    (unit == "m" && moved > LARGE_M).then(|| {
        format!("the readings span {moved:.0} m: if they are millimetres, say unit = \"mm\"")
    })
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}
