//! One instrument's values in time, and what the detectors ask of them alike: order, scale, resolution.

use crate::effects::quantiles::median;
use crate::reading::{Channel, SECONDS_PER_DAY, Series, Timestamp};
use std::cmp::Ordering;

/// Values that agree to this share of the largest are the same number written twice.
const SAME_NUMBER: f64 = 1e-12;
/// Shares of the largest value under which a step between values is rounding of the arithmetic.
const FINEST_STEP: f64 = 1e-11;
/// Fewer values do not show a common step.
const FEWEST_ON_STEP: usize = 8;
/// Values with this many decimals or more were computed, and say nothing of the instrument's step.
const COMPUTED_DECIMALS: i32 = 6;
/// A number has no more.
const MOST_DECIMALS: i32 = 17;
/// Values in a row whose common step is taken, one so many times the finest, and how near to a whole number of steps a value on it stands.
const IN_A_ROW: usize = 4;
/// So many steps are tried.
const MOST_STEPS: usize = 16;
const COARSE: f64 = 100.0;
const ON_STEP: f64 = 1e-3;

/// The values of a benchmark or a channel, in time order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    /// When each was measured.
    pub times: Vec<Timestamp>,
    /// The same in days since the first.
    pub days: Vec<f64>,
    /// The values, in the unit of their source.
    pub values: Vec<f64>,
}

impl Trace {
    pub(super) fn of_series(series: &Series) -> Self {
        let rows = series.readings.iter();
        Self::of_rows(rows.map(|reading| (reading.time, reading.value)))
    }

    pub(super) fn of_channel(channel: &Channel) -> Self {
        let rows = channel.samples.iter();
        Self::of_rows(rows.map(|sample| (sample.time, sample.value)))
    }

    fn of_rows(rows: impl Iterator<Item = (Timestamp, f64)>) -> Self {
        let (times, values): (Vec<Timestamp>, Vec<f64>) = rows.unzip();
        let seconds = |time: &Timestamp| time.as_microsecond() as f64 / 1e6;
        let first = times.first().map_or(0.0, seconds);
        let day = |time| (seconds(time) - first) / SECONDS_PER_DAY;
        Self {
            days: times.iter().map(day).collect(),
            times,
            values,
        }
    }

    /// Time run backwards.
    pub(super) fn backwards(&self) -> Self {
        let last = self.days.last().copied().unwrap_or_default();
        Self {
            times: self.times.iter().rev().copied().collect(),
            days: self.days.iter().rev().map(|day| last - day).collect(),
            values: self.values.iter().rev().copied().collect(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// From each value to the next.
    pub(super) fn increments(&self) -> Vec<f64> {
        self.values
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect()
    }

    /// Days from each value to the next.
    pub(super) fn intervals(&self) -> Vec<f64> {
        self.days.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }
}

/// The largest distance from zero.
pub(super) fn extreme(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// A number for each value, the same for the same value, however the last digits were written.
pub(super) fn symbols(values: &[f64], scale: f64) -> Vec<u32> {
    let tolerance = SAME_NUMBER * scale;
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut symbols = vec![0; values.len()];
    let mut symbol = 0;
    for pair in order.windows(2) {
        symbol += u32::from(values[pair[1]] - values[pair[0]] > tolerance);
        symbols[pair[1]] = symbol;
    }
    symbols
}

/// The resolution of each value: one in its last decimal, or the step on which all values with
/// about as many decimals stand, where that is coarser (a converted unit has decimals without end).
/// Of those with many, some may stand on no step: they are finer.
pub(super) fn resolutions(values: &[f64]) -> Vec<f64> {
    let scale = extreme(values);
    let decimals: Vec<i32> = values.iter().map(|&value| decimals(value, scale)).collect();
    let class = |computed: bool| -> Vec<f64> {
        let of_class = values.iter().zip(&decimals);
        let members =
            of_class.filter(|(_, decimals)| (**decimals >= COMPUTED_DECIMALS) == computed);
        members.map(|(value, _)| *value).collect()
    };
    let (printed, computed) = (common_step(&class(false)), class(true));
    let of_computed = common_step(&computed);
    let grid = CommonGrid::of(&computed).filter(|grid| grid.step > of_computed);
    let of = |(value, decimals): (&f64, &i32)| {
        let step = if *decimals < COMPUTED_DECIMALS {
            printed
        } else {
            let own = grid.as_ref().filter(|grid| grid.holds(*value));
            own.map_or(of_computed, |grid| grid.step)
        };
        step.max(0.1_f64.powi(*decimals))
    };
    values.iter().zip(&decimals).map(of).collect()
}

/// The resolution of most values.
pub(in crate::effects) fn resolution(values: &[f64]) -> f64 {
    median(&resolutions(values))
}

/// How many decimals show a value; the arithmetic's last digits, among values as large as `scale`, do not count.
fn decimals(value: f64, scale: f64) -> i32 {
    let is_shown = |decimals: &i32| {
        let unit = 10.0_f64.powi(*decimals);
        ((value * unit).round() / unit - value).abs() <= SAME_NUMBER * scale
    };
    (0..MOST_DECIMALS).find(is_shown).unwrap_or(MOST_DECIMALS)
}

/// Values a step apart, on which most of a trace stand.
struct CommonGrid {
    anchor: f64,
    step: f64,
}

impl CommonGrid {
    /// A step that groups of a few values in a row have in common, that of the most groups first, on which most values stand.
    fn of(values: &[f64]) -> Option<Self> {
        let finest = FINEST_STEP * extreme(values);
        if values.len() < FEWEST_ON_STEP {
            return None;
        }
        let of_group = |group: &[f64]| {
            let apart = group.iter().map(|value| (value - group[0]).abs());
            let step = apart.fold(0.0, |step, apart| common_divisor(step, apart, finest));
            let anchor = group[0];
            (step > COARSE * finest).then_some(Self { anchor, step })
        };
        let mut grids: Vec<Self> = values.windows(IN_A_ROW).filter_map(of_group).collect();
        grids.sort_by(|a, b| a.step.total_cmp(&b.step));
        let alike = grids.chunk_by(|a, b| b.step - a.step < ON_STEP * a.step);
        let mut alike: Vec<&[Self]> = alike.collect();
        alike.sort_by_key(|group| std::cmp::Reverse(group.len()));
        // Where the values go evenly a few in a row have a multiple of the step in common.
        let mut tried = alike
            .iter()
            .take(MOST_STEPS)
            .filter_map(|group| group.first());
        let holds_most = |grid: &&Self| {
            let held = values.iter().filter(|value| grid.holds(**value));
            2 * held.count() > values.len()
        };
        let Self { anchor, step } = *tried.find(holds_most)?;
        Some(Self { anchor, step })
    }

    fn holds(&self, value: f64) -> bool {
        let steps = (value - self.anchor) / self.step;
        (steps - steps.round()).abs() < ON_STEP
    }
}

/// The largest step of which all differences are multiples; the arithmetic's own where there is none.
fn common_step(values: &[f64]) -> f64 {
    let finest = FINEST_STEP * extreme(values);
    let Some(&first) = values.first() else {
        return finest;
    };
    if values.len() < FEWEST_ON_STEP {
        return finest;
    }
    let mut step = 0.0;
    for value in values {
        step = common_divisor(step, (value - first).abs(), finest);
        if step > 0.0 && step <= 4.0 * finest {
            return finest;
        }
    }
    step
}

/// Euclid's algorithm on numbers known to `tolerance`.
fn common_divisor(a: f64, b: f64, tolerance: f64) -> f64 {
    let (mut large, mut small) = if a.partial_cmp(&b) == Some(Ordering::Less) {
        (b, a)
    } else {
        (a, b)
    };
    while small > tolerance {
        let rest = large % small;
        let rest = if small - rest < tolerance { 0.0 } else { rest };
        (large, small) = (small, rest);
    }
    large
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_converted_unit_keeps_the_step_of_the_instrument() {
        let hundredths_of_a_foot: Vec<f64> = (0..50_u32)
            .map(|index| f64::from(300 + (index * 7) % 23) * 0.01 * 0.3048)
            .collect();
        let step = resolution(&hundredths_of_a_foot);
        assert!((step - 0.003_048).abs() < 1e-9, "{step}");
    }

    /// Tenths, none of them a whole number, and of every fifth value 13 digits more, in millimetres.
    fn mostly_tenths() -> Vec<f64> {
        let value = |index: u32| {
            let last = 1 + (index * index) % 9;
            let tenths = f64::from(3000 + 10 * ((index * index * 37) % 91) + last) * 0.1;
            let digits = f64::from((index * 7919) % 1013).sqrt() / 1013.0_f64.sqrt();
            if index.is_multiple_of(5) {
                tenths + 0.1 * digits
            } else {
                (tenths * 10.0).round() / 10.0
            }
        };
        (1..74).map(value).collect()
    }

    #[test]
    fn the_same_values_in_other_units_have_the_same_resolution() {
        let values = mostly_tenths();
        let own = resolutions(&values);
        assert!(
            own.iter()
                .filter(|step| (**step - 0.1).abs() < 1e-9)
                .count()
                > 50
        );
        for unit in [0.001, 1.0 / 25.4, 1.0 / 304.8, 0.1] {
            let other: Vec<f64> = values.iter().map(|value| value * unit).collect();
            for (own, other) in own.iter().zip(resolutions(&other)) {
                let is_same = if *own > 1e-3 {
                    (other - own * unit).abs() < 1e-6 * other
                } else {
                    other < 1e-3 * unit
                };
                assert!(is_same, "{own} as {other} in units of 1/{unit}");
            }
        }
    }

    #[test]
    fn a_number_with_many_digits_is_finer_than_its_neighbours() {
        let steps = resolutions(&[
            1436.1,
            1_437.783_015_618_142_6,
            1_428.522_663_453_401_5,
            1492.0,
        ]);
        assert!((steps[0] - 0.1).abs() < 1e-12, "{steps:?}");
        assert!(steps[1] < 1e-7, "{steps:?}");
    }

    #[test]
    fn the_same_number_with_fewer_digits_is_the_same() {
        let values = [1_437.783_015_618_142_6, 1428.5, 1_437.783_015_618_14];
        let symbols = symbols(&values, 1437.0);
        assert_eq!(symbols[0], symbols[2]);
        assert_ne!(symbols[0], symbols[1]);
    }
}
