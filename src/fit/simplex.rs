//! Nelder and Mead's simplex, for the last stretch of valleys with a kink, where derivatives mislead.

use nalgebra::SVector;

/// Lowers `cost` from `start` with first steps of `size`; returns the best point and its cost.
pub(super) fn descend<const N: usize>(
    start: SVector<f64, N>,
    size: f64,
    most_evaluations: usize,
    mut cost: impl FnMut(&SVector<f64, N>) -> f64,
) -> (SVector<f64, N>, f64) {
    let mut corners: Vec<(SVector<f64, N>, f64)> = vec![(start, cost(&start))];
    for i in 0..N {
        let mut at = start;
        at[i] += size;
        corners.push((at, cost(&at)));
    }
    let mut evaluations = N + 1;
    while evaluations < most_evaluations {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (corners[0].1, corners[N]);
        if worst.1 - best <= 1e-12 * best {
            break;
        }
        let middle = corners[..N]
            .iter()
            .fold(SVector::zeros(), |sum, (at, _)| sum + at)
            / N as f64;
        let mut reach = |share: f64| {
            let at = middle + (worst.0 - middle) * share;
            evaluations += 1;
            (at, cost(&at))
        };
        let mirrored = reach(-1.0);
        let moved = if mirrored.1 < best {
            let beyond = reach(-2.0);
            if beyond.1 < mirrored.1 {
                beyond
            } else {
                mirrored
            }
        } else if mirrored.1 < corners[N - 1].1 {
            mirrored
        } else if mirrored.1 < worst.1 {
            reach(-0.5)
        } else {
            reach(0.5)
        };
        if moved.1 < worst.1 {
            corners[N] = moved;
            continue;
        }
        let towards = corners[0].0;
        for corner in &mut corners[1..] {
            corner.0 = (corner.0 + towards) * 0.5;
            corner.1 = cost(&corner.0);
        }
        evaluations += N;
    }
    corners.sort_by(|a, b| a.1.total_cmp(&b.1));
    corners[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    #[test]
    fn a_kinked_curved_valley_is_followed_to_its_floor() {
        let cost = |at: &Vector2<f64>| (at[0] - 1.0).abs() + 10.0 * (at[1] - at[0] * at[0]).abs();
        let (at, _) = descend(Vector2::new(-0.5, 0.5), 0.3, 4000, cost);
        assert!((at - Vector2::new(1.0, 1.0)).norm() < 0.05, "{at}");
    }

    #[test]
    fn a_smooth_bowl_is_found_exactly() {
        let cost = |at: &Vector2<f64>| 1.0 + (at[0] - 3.0).powi(2) + 4.0 * (at[1] + 1.0).powi(2);
        let (at, _) = descend(Vector2::new(0.0, 0.0), 0.5, 1000, cost);
        assert!((at - Vector2::new(3.0, -1.0)).norm() < 1e-4, "{at}");
    }
}
