//! Points that fill a cube evenly, the same every time: Halton's sequence and, where dimensions are many,
//! Kronecker's; and normal deviates of them.

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

/// The probability that a standard normal number is below `z`, to 1e-7 relative in either tail
/// (Press et al., Numerical Recipes, section 6.2).
pub(super) fn normal_share(z: f64) -> f64 {
    const C: [f64; 10] = [
        0.170_872_77,
        -0.822_152_23,
        1.488_515_87,
        -1.135_203_98,
        0.278_868_07,
        -0.186_288_06,
        0.096_784_18,
        0.374_091_96,
        1.000_023_68,
        -1.265_512_23,
    ];
    let x = z.abs() * std::f64::consts::FRAC_1_SQRT_2;
    let t = 1.0 / (1.0 + 0.5 * x);
    let series = C.iter().fold(0.0, |sum, c| sum * t + c);
    let tail = 0.5 * t * (series - x * x).exp();
    if z > 0.0 { 1.0 - tail } else { tail }
}

/// Quantile of the standard normal, to 1e-9 relative: Acklam's rational approximation.
pub(super) fn normal_quantile(u: f64) -> f64 {
    const A: [f64; 6] = [
        -39.696_830_286_653_76,
        220.946_098_424_520_5,
        -275.928_510_446_968_7,
        138.357_751_867_269,
        -30.664_798_066_147_16,
        2.506_628_277_459_239,
    ];
    const B: [f64; 5] = [
        -54.476_098_798_224_06,
        161.585_836_858_040_9,
        -155.698_979_859_886_6,
        66.801_311_887_719_72,
        -13.280_681_552_885_72,
    ];
    const C: [f64; 6] = [
        -0.007_784_894_002_430_293,
        -0.322_396_458_041_136_5,
        -2.400_758_277_161_838,
        -2.549_732_539_343_734,
        4.374_664_141_464_968,
        2.938_163_982_698_783,
    ];
    const D: [f64; 4] = [
        0.007_784_695_709_041_462,
        0.322_467_129_070_039_8,
        2.445_134_137_142_996,
        3.754_408_661_907_416,
    ];
    let horner = |c: &[f64], x: f64| c.iter().fold(0.0, |sum, c| sum * x + c);
    let in_tail = |u: f64| {
        let q = (-2.0 * u.ln()).sqrt();
        horner(&C, q) / (horner(&D, q) * q + 1.0)
    };
    if u < 0.024_25 {
        in_tail(u)
    } else if u > 1.0 - 0.024_25 {
        -in_tail(1.0 - u)
    } else {
        let q = u - 0.5;
        horner(&A, q * q) * q / (horner(&B, q * q) * q * q + 1.0)
    }
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
            assert!((normal_share(z) / u - 1.0).abs() < 1e-6, "{z}");
        }
    }
}
