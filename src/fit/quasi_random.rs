//! Points that fill a cube evenly, the same every time: Halton's sequence and, where dimensions are many,
//! Kronecker's; and normal deviates of them.

use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

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

/// Powers of the inverse of the root of x^9 = x + 1: the steps whose multiples fill eight dimensions
/// evenly (Roberts 2018, after the golden ratio, the case of one dimension).
const STEPS: [f64; 8] = [
    0.921_599_319_633_982_9,
    0.849_345_305_949_820_3,
    0.782_756_056_097_671_4,
    0.721_387_448_738_993_7,
    0.664_830_181_950_351_4,
    0.612_707_043_357_580_9,
    0.564_670_394_293_295_8,
    0.520_399_851_198_154_4,
];

/// The `index`-th point of the sequence in eight dimensions, each in (0, 1).
pub(super) fn kronecker(index: u32) -> [f64; 8] {
    STEPS.map(|step| {
        (0.5 + step * f64::from(index + 1))
            .fract()
            .clamp(1e-9, 1.0 - 1e-9)
    })
}

/// The probability that a standard normal number is below `z`.
pub(super) fn normal_share(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// Quantile of the standard normal.
pub(super) fn normal_quantile(u: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_quantile_and_share_are_those_of_the_tables() {
        for (u, z) in [
            (0.5, 0.0),
            (0.975, 1.959_963_985),
            (0.05, -1.644_853_627),
            (0.001, -3.090_232_306),
        ] {
            assert!((normal_quantile(u) - z).abs() < 1e-8, "{u}");
            assert!((normal_share(z) / u - 1.0).abs() < 1e-8, "{z}");
        }
    }
}
