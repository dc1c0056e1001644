//! How far neighbours share what moves their forecasts: the correlation of their velocities about the law.

use crate::fit::Rate;
use nalgebra::{Matrix4, Vector4};

/// Correlation of the errors of forecasts where residuals show none: a load too slow to show in them.
const UNSEEN: f64 = 0.25;
/// That where too few rates overlap to estimate it; residuals of simulated masses that share their whole load
/// correlate by .45, the errors of their forecasts by .2 to .5.
const UNKNOWN: f64 = 0.6;
/// Fewest rates in common, for the four coefficients that are fitted to each.
const FEWEST_RATES: usize = 9;
/// The curve that is taken from ln v is a cubic in ln of the time ago, over this share of the common time.
const NEAR_SHARE: f64 = 0.1;

/// The correlation of each two benchmarks' forecasts.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependence {
    pairs: Vec<Vec<f64>>,
}

/// (days ago, ln of the velocity), oldest first.
type CommonMotion = Vec<(f64, f64)>;

impl Dependence {
    /// From the rates of each benchmark, oldest first, with the present on their own clock, days.
    pub fn measured(benchmarks: &[(&[Rate], f64)]) -> Self {
        let motions: Vec<CommonMotion> = benchmarks
            .iter()
            .map(|(rates, now)| motion(rates, *now))
            .collect();
        let pair = |i: usize, j: usize| {
            correlation(&motions[i], &motions[j])
                .map_or(UNKNOWN, |seen| UNSEEN + (1.0 - UNSEEN) * seen.max(0.0))
        };
        Self {
            pairs: (0..motions.len())
                .map(|i| (0..i).map(|j| pair(i, j)).collect())
                .collect(),
        }
    }

    /// Where nothing is known of the motion of `count` benchmarks.
    pub fn unknown(count: usize) -> Self {
        Self {
            pairs: (0..count).map(|i| vec![UNKNOWN; i]).collect(),
        }
    }

    /// The mean over the pairs of `members`; 1 for one alone.
    pub(super) fn among(&self, members: &[usize]) -> f64 {
        let pairs = members.iter().enumerate().flat_map(|(index, one)| {
            let others = members[..index].iter();
            others.map(|other| self.pairs[*one.max(other)][*one.min(other)])
        });
        let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), rho| (sum + rho, count + 1.0));
        if count > 0.0 { sum / count } else { 1.0 }
    }
}

fn motion(rates: &[Rate], now: f64) -> CommonMotion {
    let clear = rates
        .iter()
        .filter(|rate| rate.velocity > 0.0 && rate.velocity > 2.0 * rate.sigma);
    clear
        .map(|rate| (now - rate.middle(), rate.velocity.ln()))
        .collect()
}

/// Of what is left of two motions when their curves are taken away, at the times of the sparser one.
fn correlation(a: &CommonMotion, b: &CommonMotion) -> Option<f64> {
    let (a, b) = if a.len() <= b.len() { (a, b) } else { (b, a) };
    let common: Vec<(f64, f64, f64)> = a
        .iter()
        .filter_map(|(ago, ln)| Some((*ago, *ln, at(b, *ago)?)))
        .collect();
    if common.len() < FEWEST_RATES {
        return None;
    }
    let (newest, oldest) = (common[common.len() - 1].0, common[0].0);
    let near = NEAR_SHARE * (oldest - newest).max(f64::MIN_POSITIVE);
    let places: Vec<f64> = common
        .iter()
        .map(|(ago, ..)| ((ago - newest) / near).ln_1p())
        .collect();
    let left_of = |values: Vec<f64>| residuals(&places, &values);
    let one = left_of(common.iter().map(|(_, ln, _)| *ln).collect())?;
    let other = left_of(common.iter().map(|(.., ln)| *ln).collect())?;
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let size = (product(&one, &one) * product(&other, &other)).sqrt();
    (size > 0.0).then(|| product(&one, &other) / size)
}

/// ln of the velocity at a time between two rates.
fn at(motion: &CommonMotion, ago: f64) -> Option<f64> {
    let after = motion.partition_point(|(days, _)| *days > ago);
    let later = motion.get(after)?;
    if later.0 >= ago {
        return Some(later.1);
    }
    let earlier = motion.get(after.checked_sub(1)?)?;
    let share = (earlier.0 - ago) / (earlier.0 - later.0);
    Some(earlier.1 + share * (later.1 - earlier.1))
}

/// What a cubic by least squares leaves.
fn residuals(places: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let basis = |s: f64| Vector4::new(1.0, s, s * s, s * s * s);
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for (place, value) in places.iter().zip(values) {
        let row = basis(*place);
        normal += row * row.transpose();
        right += row * *value;
    }
    let coefficients = normal.cholesky()?.solve(&right);
    let pairs = places.iter().zip(values);
    Some(
        pairs
            .map(|(place, value)| value - basis(*place).dot(&coefficients))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::ReadingError;

    fn rates(wobble: impl Fn(f64) -> f64) -> Vec<Rate> {
        let rate = |day: u32| Rate {
            from: f64::from(day),
            to: f64::from(day) + 1.0,
            velocity: 300.0 / (70.0 - f64::from(day)) * wobble(f64::from(day)).exp(),
            sigma: 0.0,
            readings: 1,
            error: ReadingError::Own,
        };
        (0..60).map(rate).collect()
    }

    #[test]
    fn neighbours_that_speed_up_together_depend_on_each_other_by_their_wobble_alone() {
        let common = rates(|day| 0.1 * (1.7 * day).sin());
        let also = rates(|day| 0.3 * (1.7 * day).sin());
        let own = rates(|day| 0.1 * (2.9 * day).cos());
        let all: Vec<(&[Rate], f64)> = [&common, &also, &own]
            .iter()
            .map(|rates| (rates.as_slice(), 60.0))
            .collect();
        let dependence = Dependence::measured(&all);
        assert!(dependence.among(&[0, 1]) > 0.95);
        assert!(dependence.among(&[0, 2]) < UNSEEN + 0.15);
        assert!((dependence.among(&[0, 1]) - dependence.among(&[1, 0])).abs() < 1e-12);
    }

    #[test]
    fn what_does_not_overlap_is_not_known() {
        let (one, other) = (rates(|_| 0.0), rates(|_| 0.0));
        let dependence = Dependence::measured(&[(&one, 60.0), (&other, 200.0)]);
        assert_eq!(dependence, Dependence::unknown(2));
    }
}
