//! How large the noise of one reading is beside that of another, where nobody says it.

use super::quantiles::upper_median;
use crate::reading::Quantity;

/// Readings on each side by which the velocity beside one is taken.
const NEIGHBOURS: usize = 4;
/// The same of displacements, of which a velocity is the difference.
const DISPLACED: usize = 8;
/// Fewest of them.
const FEWEST_BESIDE: usize = 3;
/// Fewer displacements do not show whether their noise goes with the velocity: of monthly ones, of which each season moves the slope anew,
/// the motion between two readings passes for it.
const FEWEST: usize = 150;
/// Below these shares of the usual velocity the noise of displacements goes no lower.
const FLOORS: [f64; 3] = [0.1, 0.5, 2.0];
/// The noise of displacements goes with the velocity where the readings are so much likelier for it, in -2 ln likelihood.
const LIKELIER: f64 = 20.0;

/// How far each reading stands from the line through its neighbours, scaled to one reading's own error.
pub(super) fn local_misfits(t: &[f64], y: &[f64]) -> Vec<f64> {
    let inner = t.windows(3).zip(y.windows(3)).map(|(t, y)| {
        let share = (t[1] - t[0]) / (t[2] - t[0]);
        let line = y[0] + share * (y[2] - y[0]);
        (y[1] - line) / (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt()
    });
    let inner: Vec<f64> = inner.collect();
    let first = inner.first().copied().unwrap_or(0.0);
    let last = inner.last().copied().unwrap_or(0.0);
    std::iter::once(first)
        .chain(inner)
        .chain(std::iter::once(last))
        .collect()
}

/// Standard deviation of each reading's white noise, up to a common factor, as the readings show it.
pub(super) fn weights(quantity: Quantity, t: &[f64], y: &[f64], misfits: &[f64]) -> Vec<f64> {
    match quantity {
        Quantity::Displacement => of_displacements(t, y),
        Quantity::Velocity => of_velocities(y, misfits),
    }
}

/// Whichever of an absolute and a relative error makes their scatter likelier.
fn of_velocities(y: &[f64], misfits: &[f64]) -> Vec<f64> {
    let ones = vec![1.0; y.len()];
    let level = (0..y.len()).map(|i| {
        let from = i.saturating_sub(NEIGHBOURS);
        let until = (i + NEIGHBOURS + 1).min(y.len());
        upper_median(y[from..until].iter().map(|y| y.abs()).collect())
    });
    let level: Vec<f64> = level.collect();
    let floor = 0.05 * upper_median(level.clone());
    if floor <= 0.0 {
        return ones;
    }
    let level = unit_median(level.iter().map(|v| v.max(floor)).collect());
    if negative_ln_likelihood(misfits, &level) < negative_ln_likelihood(misfits, &ones) {
        level
    } else {
        ones
    }
}

/// One error, but where the scatter clearly goes with the velocity: it is blurred over the time that a reading takes, or read against
/// what moves. How the motion bends must not pass for scatter, which it does where it is fastest.
fn of_displacements(t: &[f64], y: &[f64]) -> Vec<f64> {
    let ones = vec![1.0; y.len()];
    if y.len() < FEWEST {
        return ones;
    }
    let misfits = cubic_misfits(t, y);
    let speeds = speeds(t, y);
    let usual = upper_median(speeds.clone());
    if usual <= 0.0 {
        return ones;
    }
    let mut least = negative_ln_likelihood(&misfits, &ones) - 0.5 * LIKELIER;
    let mut chosen = ones;
    for floor in FLOORS {
        let floored = speeds.iter().map(|speed| speed.max(floor * usual));
        let with = unit_median(floored.collect());
        let size = negative_ln_likelihood(&misfits, &with);
        if size < least {
            (least, chosen) = (size, with);
        }
    }
    chosen
}

/// -ln likelihood of the misfits, of heavy tails, under these relative sizes.
fn negative_ln_likelihood(misfits: &[f64], weight: &[f64]) -> f64 {
    let scaled: Vec<f64> = misfits.iter().zip(weight).map(|(m, w)| m / w).collect();
    let size = upper_median(scaled.iter().map(|one| one.abs()).collect()).max(1e-300);
    let logs: f64 = weight.iter().map(|w| w.ln()).sum();
    let tails = scaled
        .iter()
        .map(|one| 2.0 * (one / size / 2.0).powi(2).ln_1p());
    weight.len() as f64 * size.ln() + logs + tails.sum::<f64>()
}

/// How far each reading stands from the cubic through the two on each side, scaled to one reading's own error.
fn cubic_misfits(t: &[f64], y: &[f64]) -> Vec<f64> {
    let inner = t.windows(5).zip(y.windows(5)).map(|(t, y)| {
        let beside = [0, 1, 3, 4];
        let shares = beside.map(|one| {
            let others = beside.iter().filter(|other| **other != one);
            let factors = others.map(|other| (t[2] - t[*other]) / (t[one] - t[*other]));
            factors.product::<f64>()
        });
        let curve: f64 = shares
            .iter()
            .zip(beside)
            .map(|(share, one)| share * y[one])
            .sum();
        let squares: f64 = shares.iter().map(|share| share * share).sum();
        (y[2] - curve) / (1.0 + squares).sqrt()
    });
    let inner: Vec<f64> = inner.collect();
    let end = |one: Option<&f64>| vec![one.copied().unwrap_or(0.0); 2];
    [end(inner.first()), inner.clone(), end(inner.last())].concat()
}

/// How fast the slope moves at each reading, by the means of those on either side.
fn speeds(t: &[f64], y: &[f64]) -> Vec<f64> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let at = |i: usize| {
        // Nearer to an end fewer: the velocity there is not that of the middle.
        let to_the_end = i.min(t.len() - 1 - i);
        let beside = to_the_end.clamp(FEWEST_BESIDE, DISPLACED);
        let from = i.saturating_sub(beside).min(t.len() - 2 * beside);
        let (middle, until) = (from + beside, from + 2 * beside);
        let moved = mean(&y[middle..until]) - mean(&y[from..middle]);
        (moved / (mean(&t[middle..until]) - mean(&t[from..middle]))).abs()
    };
    (0..t.len()).map(at).collect()
}

pub(super) fn unit_median(mut values: Vec<f64>) -> Vec<f64> {
    let middle = upper_median(values.clone());
    for value in &mut values {
        *value /= middle;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixture::{generator, normals};

    /// An acceleration to 60 mm/day with an error that goes with the velocity by this share, over one of 0.3 mm.
    fn weights_of(share: f64, seed: u64) -> Vec<f64> {
        let t: Vec<f64> = (0..400).map(f64::from).collect();
        let noise = normals(&mut generator(seed), t.len());
        let reading = |(t, noise): (&f64, f64)| {
            let left = 420.0 - t;
            let velocity = 1.0 + 1200.0 / left;
            t - 1200.0 * (left / 420.0).ln() + (0.3 + share * velocity) * noise
        };
        let y: Vec<f64> = t.iter().zip(noise).map(reading).collect();
        weights(Quantity::Displacement, &t, &y, &[])
    }

    #[test]
    fn displacements_have_one_error_where_it_does_not_clearly_go_with_the_velocity() {
        for seed in 0..20 {
            let one = weights_of(0.0, seed);
            assert!(
                one.iter().all(|weight| weight.total_cmp(&1.0).is_eq()),
                "{seed}"
            );
            let relative = weights_of(0.5, seed);
            let gain = relative[395] / relative[5];
            assert!(gain > 4.0, "{seed}: {gain}");
        }
    }

    #[test]
    fn a_smooth_motion_bends_most_where_it_is_fastest_and_has_one_error_still() {
        let t: Vec<f64> = (0..400).map(f64::from).collect();
        let rounded = |t: &f64| (-12_000.0 * ((420.0 - t) / 420.0).ln()).round() / 10.0;
        let y: Vec<f64> = t.iter().map(rounded).collect();
        let one = weights(Quantity::Displacement, &t, &y, &[]);
        assert!(one.iter().all(|weight| weight.total_cmp(&1.0).is_eq()));
    }
}
