//! Points that fill a cube evenly, the same every time: Halton's sequence, and normal deviates of it.

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
