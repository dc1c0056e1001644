//! Values that from one row on are in another unit: all of them so many times as large.

use super::trace::{Trace, resolution};
use crate::effects::quantiles::median;
use crate::reading::LineFit;

/// Between mm, cm, m and km, and between them and inches and feet.
const TIMES: [f64; 5] = [10.0, 100.0, 1000.0, 25.4, 304.8];
/// Values on either side from which a line is learnt, at most and at least.
const BESIDE: usize = 16;
const FEWEST: usize = 8;
/// The jump is so many times the usual step before it or after it.
const LEAP: f64 = 20.0;
/// The lines on either side meet within so many standard errors, in one unit,
const MEET: f64 = 4.0;
/// the values scatter about them, and step, alike within this factor,
const ALIKE: f64 = 3.0;
/// and so do the velocities, or they do not differ by more than their error.
const SLOPES_ALIKE: f64 = 2.0;
/// Most changes of the unit in one record.
const MOST: usize = 4;

/// A change of the unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UnitSlip {
    /// The first row in the other unit.
    pub(super) from: usize,
    /// How many times as large the values are from there on.
    pub(super) times: f64,
}

/// A straight line through values.
struct SideLine {
    /// Where it is at the boundary, and its standard error.
    level: f64,
    level_error: f64,
    /// A day, and its standard error.
    slope: f64,
    slope_error: f64,
    /// Of the values about it.
    scatter: f64,
}

impl SideLine {
    /// Through (days from the boundary, value); `None` with fewer than [`FEWEST`].
    fn through(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        if points.len() < FEWEST {
            return None;
        }
        let line = LineFit::through(points)?;
        let (t, y, slope) = (line.mean_x, line.mean_y, line.slope());
        let off = |point: &(f64, f64)| point.1 - y - slope * (point.0 - t);
        let left: f64 = points.iter().map(|point| off(point).powi(2)).sum();
        let scatter = (left / (n - 2.0)).sqrt();
        Some(Self {
            level: y - slope * t,
            level_error: scatter * (1.0 / n + t * t / line.xx).sqrt(),
            slope,
            slope_error: scatter / line.xx.sqrt(),
            scatter,
        })
    }
}

/// The changes of the unit, each of what the ones before it have left, oldest first.
pub(super) fn unit_slips(trace: &Trace) -> Vec<UnitSlip> {
    let mut trace = trace.clone();
    let mut slips: Vec<UnitSlip> = Vec::new();
    while slips.len() < MOST {
        let Some(slip) = clearest(&trace) else {
            break;
        };
        for value in &mut trace.values[slip.from..] {
            *value /= slip.times;
        }
        slips.push(slip);
    }
    slips.sort_by_key(|slip| slip.from);
    slips
}

/// The one with the largest jump.
fn clearest(trace: &Trace) -> Option<UnitSlip> {
    let steps = trace.increments();
    let mut order: Vec<usize> = (0..steps.len()).collect();
    order.sort_by(|&a, &b| steps[b].abs().total_cmp(&steps[a].abs()));
    // After a change to smaller values the jump is the largest step, after one to larger ones many steps are as large.
    let ratios = (1..steps.len()).filter(|row| {
        let usual = |range: std::ops::Range<usize>| {
            let sizes: Vec<f64> = steps[range].iter().map(|step| step.abs()).collect();
            median(&sizes)
        };
        let before = usual(row.saturating_sub(BESIDE)..*row);
        let size = steps[*row].abs();
        size > LEAP * before && size > 0.0
    });
    let jumps = order
        .iter()
        .take(MOST)
        .copied()
        .chain(ratios.take(2 * MOST));
    let found = jumps.filter_map(|row| Some((steps[row].abs(), slip_at(trace, row + 1)?)));
    // Of equal ones the first.
    let largest = found.min_by(|a, b| b.0.total_cmp(&a.0));
    largest.map(|(_, slip)| slip)
}

/// The change of the unit before the value `from`.
fn slip_at(trace: &Trace, from: usize) -> Option<UnitSlip> {
    let boundary = f64::midpoint(trace.days[from - 1], trace.days[from]);
    let points = |rows: std::ops::Range<usize>, over: f64| -> Vec<(f64, f64)> {
        rows.map(|row| (trace.days[row] - boundary, trace.values[row] / over))
            .collect()
    };
    let before = SideLine::through(&points(from.saturating_sub(BESIDE)..from, 1.0))?;
    let later = from..(from + BESIDE).min(trace.len());
    let jump = (trace.values[from] - trace.values[from - 1]).abs();
    // Readings that do not move by their resolution say nothing of a line.
    let finest = resolution(&trace.values);
    // A few wrong values are no change of the unit: the others step as before.
    let usual_step = |rows: std::ops::Range<usize>| {
        let steps = trace.values[rows].windows(2);
        median(
            &steps
                .map(|pair| (pair[1] - pair[0]).abs())
                .collect::<Vec<_>>(),
        )
    };
    let step_before = usual_step(from.saturating_sub(BESIDE)..from);
    let step_after = usual_step(later.clone());
    let both = TIMES.into_iter().flat_map(|times| [times, times.recip()]);
    let fitting = both.filter_map(|times| {
        let after = SideLine::through(&points(later.clone(), times))?;
        let error = before.level_error.hypot(after.level_error);
        let is_known = before.scatter > 0.0 && after.scatter > 0.0 && error > 0.1 * finest;
        let off = (before.level - after.level).abs();
        let noise = (before.scatter.max(after.scatter) * times.min(1.0)).max(error);
        let meets = off <= MEET * error && jump > LEAP * noise;
        let slope_error = before.slope_error.hypot(after.slope_error);
        let differ = (before.slope - after.slope).abs();
        let is_alike = |a: f64, b: f64, factor: f64| a <= factor * b && b <= factor * a;
        let slopes =
            differ <= MEET * slope_error || is_alike(before.slope, after.slope, SLOPES_ALIKE);
        let scatter = is_alike(before.scatter, after.scatter, ALIKE);
        let steps = is_alike(step_before, step_after / times, ALIKE);
        let fits = is_known && meets && slopes && scatter && steps;
        fits.then_some((off / error, UnitSlip { from, times }))
    });
    let nearest = fitting.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map(|(_, slip)| slip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::{SECONDS_PER_DAY, Timestamp};
    use jiff::SignedDuration;

    fn trace(values: Vec<f64>) -> Trace {
        let time = |day: usize| {
            let seconds = day as f64 * SECONDS_PER_DAY;
            Timestamp::UNIX_EPOCH + SignedDuration::from_secs_f64(seconds)
        };
        Trace {
            times: (0..values.len()).map(time).collect(),
            days: (0..values.len()).map(|day| day as f64).collect(),
            values,
        }
    }

    fn creeping(of: impl Fn(usize, f64) -> f64) -> Trace {
        let mut state = 11_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5
        };
        let value = |day: usize| of(day, 20.0 + 0.8 * day as f64 + noise());
        trace((0..120).map(value).collect())
    }

    #[test]
    fn values_that_are_ten_or_a_thousand_times_as_large_from_a_date_on_are_in_another_unit() {
        for times in [10.0, 1000.0, 0.1, 0.001, 25.4] {
            let slipped = creeping(|day, value| if day < 70 { value } else { value * times });
            let found = unit_slips(&slipped);
            assert_eq!(found.len(), 1, "{times}: {found:?}");
            assert_eq!(found[0].from, 70, "{times}");
            assert!((found[0].times / times - 1.0).abs() < 1e-9, "{found:?}");
        }
        let and_back = creeping(|day, value| {
            if (40..80).contains(&day) {
                10.0 * value
            } else {
                value
            }
        });
        let found: Vec<usize> = unit_slips(&and_back).iter().map(|slip| slip.from).collect();
        assert_eq!(found, [40, 80]);
    }

    #[test]
    fn an_offset_an_acceleration_and_a_step_of_the_velocity_are_none() {
        let offset =
            |size: f64| creeping(move |day, value| if day < 70 { value } else { value + size });
        for size in [684.0, 68.0, -68.0, 7000.0] {
            assert_eq!(unit_slips(&offset(size)), [], "{size}");
        }
        let faster = creeping(|day, value| value + 8.0 * day.saturating_sub(70) as f64);
        assert_eq!(unit_slips(&faster), []);
        let fails = creeping(|day, value| value - 60.0 * (1.0 - day as f64 / 120.3).ln());
        assert_eq!(unit_slips(&fails), []);
    }
}
