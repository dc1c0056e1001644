//! Comparisons of means over series, with bootstrap intervals: series are drawn again, never single forecasts, which
//! depend on one another within a series.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

/// How often the series are drawn again.
const DRAWS: usize = 2000;

/// A figure with the 90 % interval that drawing the series again gives it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// Of the series as they are.
    pub best: f64,
    /// The 5 % quantile.
    pub low: f64,
    /// The 95 % quantile.
    pub high: f64,
}

/// The sum of scores over one series, and how many there are.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sum {
    /// Of the scores.
    pub sum: f64,
    /// Forecasts scored.
    pub count: f64,
}

/// The mean over all series of a score; `None` without any.
pub fn mean(series: &[Sum], seed: u64) -> Option<Interval> {
    let of = |draw: &mut dyn Iterator<Item = usize>| {
        let (sum, count) = draw.fold((0.0, 0.0), |(sum, count), index| {
            (sum + series[index].sum, count + series[index].count)
        });
        sum / count
    };
    interval(series.len(), seed, &of)
}

/// The mean of `ours` over that of `theirs`, series by series the same; `None` without any.
pub fn ratio(ours: &[Sum], theirs: &[Sum], seed: u64) -> Option<Interval> {
    let of = |draw: &mut dyn Iterator<Item = usize>| {
        let (mut above, mut below) = (Sum::default(), Sum::default());
        for index in draw {
            let (one, other) = (ours[index], theirs[index]);
            above = above.and(one);
            below = below.and(other);
        }
        (above.sum / above.count) / (below.sum / below.count)
    };
    interval(ours.len().min(theirs.len()), seed, &of)
}

impl Sum {
    fn and(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            count: self.count + other.count,
        }
    }
}

fn interval(
    count: usize,
    seed: u64,
    of: &dyn Fn(&mut dyn Iterator<Item = usize>) -> f64,
) -> Option<Interval> {
    if count == 0 {
        return None;
    }
    let best = of(&mut (0..count));
    let mut generator = Pcg64::seed_from_u64(seed);
    let mut drawn: Vec<f64> = (0..DRAWS)
        .map(|_| of(&mut (0..count).map(|_| generator.random_range(0..count))))
        .filter(|value| value.is_finite())
        .collect();
    drawn.sort_by(f64::total_cmp);
    let tail = drawn.len() / 20;
    (best.is_finite() && !drawn.is_empty()).then(|| Interval {
        best,
        low: drawn[tail],
        high: drawn[drawn.len() - 1 - tail],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_one_series_has_no_width_and_of_many_holds_the_truth() {
        let one = |sum| Sum { sum, count: 1.0 };
        let alone = ratio(&[one(1.0)], &[one(2.0)], 1).unwrap();
        assert_eq!((alone.low, alone.best, alone.high), (0.5, 0.5, 0.5));
        let ours: Vec<Sum> = (0..200).map(|i| one(1.0 + f64::from(i % 7))).collect();
        let theirs: Vec<Sum> = (0..200).map(|i| one(2.0 + f64::from(i % 5))).collect();
        let many = ratio(&ours, &theirs, 1).unwrap();
        assert!(many.low < many.best && many.best < many.high, "{many:?}");
        assert!((many.best - 1.0).abs() < 0.01, "{many:?}");
        assert_eq!(ratio(&ours, &theirs, 1).unwrap(), many);
    }

    #[test]
    fn nothing_to_compare_has_no_interval() {
        assert_eq!(mean(&[], 1), None);
    }
}
