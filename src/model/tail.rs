//! The last stretch before a finite-time singularity, as a function of the time that remains.
//!
//! Time cannot resolve it (`t_c` - t cancels), so y is solved for from
//! `t_c - t = integral from 0 to y of dy / (r - kappa bc(y; p))`.

use super::coefficients::Coefficients;
use super::law::Law;

/// Nodes and weights of 16-point Gauss-Legendre quadrature on [-1, 1] (positive half).
const NODES: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_87),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_89),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_095),
];

/// Beyond this many e-folds below y the rest of the integral is under the rounding of the sum.
const DEEPEST_E_FOLD: f64 = 42.0;

/// More panels than an integral within f64's range needs, which halve towards a steady state.
const MOST_PANELS: usize = 3000;

/// Whether the law runs into a finite-time singularity from inverse velocity `exp(ln_y)` on.
pub(super) fn fails_from(law: &Law, ln_y: f64) -> bool {
    law.kappa >= 0.0 && law.p < 1.0 && slope_at_ln(law, ln_y) < 0.0
}

/// Days from inverse velocity `exp(ln_y)` to the singularity; needs [`fails_from`].
pub(super) fn remaining_days(law: &Law, ln_y: f64) -> f64 {
    days_between(law, ln_y, ln_y - DEEPEST_E_FOLD)
}

/// Days that the law takes to accelerate from one inverse velocity to a smaller one.
pub(super) fn days_between(law: &Law, ln_y_from: f64, ln_y_to: f64) -> f64 {
    if law.kappa == 0.0 {
        // m = 1: y is a straight line.
        return ln_y_from.exp() * -(ln_y_to - ln_y_from).exp_m1() / law.r;
    }
    // y = y_from exp(-s): days = y_from * integral of exp(-s) / (r - kappa bc(y)) ds
    let integrand = |s: f64| (-s).exp() / -slope_at_ln(law, ln_y_from - s);
    ln_y_from.exp() * integrate_down(law, (ln_y_from, ln_y_to), integrand)
}

/// Slip over `v_i` between two inverse velocities of an acceleration: d slip / d ln y = 1 / slope.
pub(super) fn slip_between(law: &Law, ln_y_from: f64, ln_y_to: f64) -> f64 {
    integrate_down(law, (ln_y_from, ln_y_to), |s| {
        1.0 / -slope_at_ln(law, ln_y_from - s)
    })
}

/// Integrates over s = `ln(y_from / y)`. Panels keep their distance from the pole of 1/slope (the steady
/// state, behind or ahead), so that 16 nodes reach rounding on each.
fn integrate_down(law: &Law, span: (f64, f64), integrand: impl Fn(f64) -> f64) -> f64 {
    let end = span.0 - span.1;
    let pole = law
        .ln_y_steady()
        .map_or(f64::INFINITY, |pole| span.0 - pole);
    let smoothest = 1.5 / law.p.abs().max(1.0);
    let (mut from, mut sum, mut lost) = (0.0, 0.0, 0.0);
    for _ in 0..MOST_PANELS {
        if from >= end {
            break;
        }
        let clearance = if pole > from {
            0.5 * (pole - from)
        } else {
            from - pole
        };
        let least = (4.0 * f64::EPSILON * from).max(f64::MIN_POSITIVE);
        let to =
            (from + clearance.clamp(least, smoothest.max(0.5 * from).min(6.0).max(least))).min(end);
        // Kahan's summation: a time to failure is asked to its last digits just before it.
        let term = panel(&integrand, from, to) - lost;
        let next = sum + term;
        lost = (next - sum) - term;
        sum = next;
        from = to;
    }
    sum
}

/// 16-point Gauss-Legendre quadrature over one panel.
fn panel(integrand: &impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let (middle, half) = (f64::midpoint(from, to), (to - from) / 2.0);
    let mut sum = 0.0;
    for (x, w) in NODES {
        sum += w * (integrand(middle - half * x) + integrand(middle + half * x));
    }
    half * sum
}

/// ln y with `remaining` days left, by Newton's method in logarithms from below `ln_y_start`.
pub(super) fn ln_y_with_remaining(law: &Law, remaining: f64, ln_y_start: f64) -> f64 {
    let mut ln_y = ln_y_start.min((remaining * -slope_at_ln(law, ln_y_start)).ln());
    for _ in 0..60 {
        let days = remaining_days(law, ln_y);
        // d ln(days) / d ln(y) = y / (days * -slope)
        let gain = ln_y.exp() / (days * -slope_at_ln(law, ln_y));
        let step = (remaining / days).ln() / gain;
        ln_y = (ln_y + step).min(ln_y_start);
        if step.abs() < 1e-15 * ln_y.abs().max(1.0) {
            break;
        }
    }
    ln_y
}

/// dy/dt at ln y, 1/day.
pub(super) fn slope_at_ln(law: &Law, ln_y: f64) -> f64 {
    Coefficients::of(law).slope_at_ln(ln_y)
}
