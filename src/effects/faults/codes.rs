//! Values that stand for "no value": loggers' codes, and what the unit does not allow.

use super::nature::Nature;
use super::trace::Trace;

/// Numbers that loggers write where they have none (Campbell, USGS, NOAA, the largest of 16 and of 32 bits, and common usage).
const CODES: [f64; 26] = [
    -7999.0,
    -6999.0,
    6999.0,
    7999.0,
    -9999.0,
    9999.0,
    -9999.9,
    -99999.0,
    99999.0,
    -999.0,
    999.0,
    -999.9,
    999.9,
    -999.99,
    9999.9,
    -9999.99,
    -888.0,
    -32768.0,
    32767.0,
    -999_999.0,
    999_999.0,
    -8888.0,
    65_535.0,
    4_294_967_295.0,
    f32::MAX as f64,
    1e30,
];

/// Whether loggers write this number where they have none.
pub fn is_code(value: f64) -> bool {
    CODES.contains(&value)
}

/// Which values are no measurements. `nature` is absent for a benchmark's own readings.
pub(super) fn out_of_range(trace: &Trace, nature: Option<Nature>) -> Vec<bool> {
    let mut wrong = nature.map_or_else(
        || vec![false; trace.len()],
        |nature| nature.impossible(trace),
    );
    for (index, is_code) in codes(trace).into_iter().enumerate() {
        wrong[index] |= is_code;
    }
    wrong
}

/// The codes among the values: far from both neighbours that are none, so that a displacement
/// which happens to pass through 999 mm is left alone.
fn codes(trace: &Trace) -> Vec<bool> {
    let is_code: Vec<bool> = trace.values.iter().map(|v| is_code(*v)).collect();
    let rest = trace
        .values
        .iter()
        .zip(&is_code)
        .filter(|(_, code)| !**code);
    let bounds = rest.fold(None, |bounds: Option<(f64, f64)>, (&value, _)| {
        let (low, high) = bounds.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    });
    let Some((low, high)) = bounds else {
        return vec![false; trace.len()];
    };
    let far = 0.5 * (high - low);
    let before = nearest(&trace.values, &is_code);
    let mut after: Vec<Option<f64>> = {
        let values: Vec<f64> = trace.values.iter().rev().copied().collect();
        let codes: Vec<bool> = is_code.iter().rev().copied().collect();
        nearest(&values, &codes)
    };
    after.reverse();
    let is_far = |index: usize, neighbour: Option<f64>| {
        neighbour.is_none_or(|neighbour| (trace.values[index] - neighbour).abs() > far)
    };
    (0..trace.len())
        .map(|index| is_code[index] && is_far(index, before[index]) && is_far(index, after[index]))
        .collect()
}

/// For each value the last one before it that is no code.
fn nearest(values: &[f64], is_code: &[bool]) -> Vec<Option<f64>> {
    let mut last = None;
    let of = |(value, code): (&f64, &bool)| {
        let before = last;
        if !code {
            last = Some(*value);
        }
        before
    };
    values.iter().zip(is_code).map(of).collect()
}
