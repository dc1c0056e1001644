//! The downhill simplex (Nelder and Mead 1965), its work bounded by count.
//! Written here because crates for it (argmin) bound time or tolerance, and a rival must do the same work on any machine.

/// A share of the cost: simplices whose corners differ by less have arrived.
const SAME: f64 = 1e-12;

/// The lowest place found from `start`, with its cost, by at most `most` evaluations and a shrinking's more;
/// what is not a number counts as infinite, which is how a box is kept.
pub(super) fn descend<const N: usize>(
    cost: impl Fn(&[f64; N]) -> f64,
    start: [f64; N],
    steps: [f64; N],
    most: usize,
) -> ([f64; N], f64) {
    let price = |at: [f64; N]| {
        let cost = cost(&at);
        (at, if cost.is_nan() { f64::INFINITY } else { cost })
    };
    let mut corners = vec![price(start)];
    for (axis, step) in steps.iter().enumerate() {
        let mut at = start;
        at[axis] += step;
        corners.push(price(at));
    }
    let mut evaluations = corners.len();
    loop {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (corners[0], corners[N]);
        if evaluations >= most || worst.1 - best.1 <= SAME * best.1.abs() {
            return best;
        }
        let centre: [f64; N] = std::array::from_fn(|axis| {
            corners[..N].iter().map(|(at, _)| at[axis]).sum::<f64>() / N as f64
        });
        // Along the line from the worst corner through the middle of the others.
        let along = |reach: f64| -> [f64; N] {
            std::array::from_fn(|axis| centre[axis] + reach * (centre[axis] - worst.0[axis]))
        };
        let reflected = price(along(1.0));
        evaluations += 1;
        if reflected.1 < corners[N - 1].1 && reflected.1 >= best.1 {
            corners[N] = reflected;
            continue;
        }
        let reach = if reflected.1 < best.1 {
            2.0
        } else if reflected.1 < worst.1 {
            0.5
        } else {
            -0.5
        };
        let other = price(along(reach));
        evaluations += 1;
        let better = if other.1 < reflected.1 {
            other
        } else {
            reflected
        };
        if better.1 < worst.1 {
            corners[N] = better;
            continue;
        }
        for corner in &mut corners[1..] {
            *corner = price(std::array::from_fn(|axis| {
                f64::midpoint(corner.0[axis], best.0[axis])
            }));
        }
        evaluations += N;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_bent_valley_is_found() {
        let valley =
            |at: &[f64; 2]| (1.0 - at[0]).powi(2) + 100.0 * (at[1] - at[0] * at[0]).powi(2);
        let (at, _) = descend(valley, [-1.2, 1.0], [0.3, 0.3], 400);
        assert!(
            (at[0] - 1.0).abs() < 1e-3 && (at[1] - 1.0).abs() < 2e-3,
            "{at:?}"
        );
    }

    #[test]
    fn a_wall_is_not_passed_and_the_work_is_bounded() {
        let calls = std::cell::Cell::new(0);
        let bounded = |at: &[f64; 1]| {
            calls.set(calls.get() + 1);
            if at[0] < 2.0 { f64::NAN } else { at[0] }
        };
        let (at, cost) = descend(bounded, [5.0], [1.0], 60);
        assert!((2.0..2.1).contains(&at[0]), "{at:?}");
        assert!((cost - at[0]).abs() < 1e-12);
        assert!(calls.get() <= 62, "{}", calls.get());
    }
}
