//! Points that fill a cube evenly, the same every time: Halton's sequence, and normal deviates of them.
//! Thirty lines; the crates for it bring generators of their own.

use statrs::function::erf::erfc_inv;
use std::f64::consts::SQRT_2;

/// The first primes, a base for each dimension.
const BASES: [u32; 5] = [2, 3, 5, 7, 11];

/// The `index`-th point of the Halton sequence in five dimensions, each in (0, 1).
pub(super) fn halton(index: u32) -> [f64; 5] {
    BASES.map(|base| radical_inverse(index + 1, base))
}

fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut share) = (0.0, 1.0 / f64::from(base));
    while index > 0 {
        value += share * f64::from(index % base);
        index /= base;
        share /= f64::from(base);
    }
    value
}

/// Quantile of the standard normal.
pub(super) fn normal_quantile(u: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_quantile_is_that_of_the_tables() {
        for (u, z) in [
            (0.5, 0.0),
            (0.975, 1.959_963_985),
            (0.05, -1.644_853_627),
            (0.001, -3.090_232_306),
        ] {
            assert!((normal_quantile(u) - z).abs() < 1e-8, "{u}");
        }
    }
}
