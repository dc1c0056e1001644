//! One Taylor step of the law: y, its Box-Cox transform and the slip, to any order by recurrence.

use super::coefficients::Coefficients;

/// The highest order that a segment can hold.
pub(super) const MAX_ORDER: usize = 30;

/// The coefficients of one polynomial.
pub(super) type TaylorSeries = [f64; MAX_ORDER + 1];

/// Where the block is at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlockPoint {
    /// Its inverse velocity over that at t = 0.
    pub(super) y: f64,
    /// Its slip over `v_i`, days.
    pub(super) slip: f64,
}

/// y(t) and the slip over `v_i` from `start`, as polynomials in (t - start) / `unit` of N coefficients at most.
///
/// The unit, days, is the law's own time there: in days the coefficients of a slope that takes 1e12 of them, or
/// 1e-13, leave the range of f64.
#[derive(Debug, Clone, Copy)]
pub(super) struct PowerSeries<const N: usize> {
    pub(super) start: f64,
    pub(super) unit: f64,
    pub(super) order: usize,
    pub(super) y: [f64; N],
    pub(super) slip: [f64; N],
}

impl<const N: usize> PowerSeries<N> {
    /// Where the block is at time `t`, days.
    pub(super) fn at(&self, t: f64) -> BlockPoint {
        let h = (t - self.start) / self.unit;
        let mut y = self.y[self.order];
        let mut slip = self.slip[self.order];
        for k in (0..self.order).rev() {
            y = y * h + self.y[k];
            slip = slip * h + self.slip[k];
        }
        BlockPoint { y, slip }
    }
}

/// The law about one time, good for `span` days from there on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    pub(super) span: f64,
    series: PowerSeries<{ MAX_ORDER + 1 }>,
}

impl Segment {
    /// Expands the law about `start`, where the block is `at`.
    ///
    /// With G = kappa bc(y; p) and K = kappa y^p = kappa + p G: y' = -r + G and y G' = y' K; with u = 1/y:
    /// y u = 1. G and K are of the size of the law's own rates, where bc and y^p alone leave the range of f64.
    pub(super) fn expand(law: &Coefficients, order: usize, start: f64, at: BlockPoint) -> Self {
        let (y_0, slip_0) = (at.y, at.slip);
        let mut y = [0.0; MAX_ORDER + 1];
        let mut slip = [0.0; MAX_ORDER + 1];
        let mut u = [0.0; MAX_ORDER + 1];
        // G and G'; g[0] is never needed.
        let (mut g, mut g_slope) = (u, u);
        let ln_y = y_0.ln();
        let slope_per_day = law.slope_at_ln(ln_y);
        let k_per_day = law.kappa * (law.p * ln_y).exp();
        let unit = unit_days(&[slope_per_day / y_0, k_per_day / y_0]);
        let slope = slope_per_day * unit;
        let k_0 = k_per_day * unit;
        // Of slope p G + G K_0.
        let gain = slope * law.p + k_0;
        y[0] = y_0;
        slip[0] = slip_0;
        u[0] = 1.0 / y_0;
        let minus_u_0 = -u[0];
        for k in 0..order {
            let over_next = 1.0 / (k + 1) as f64;
            let y_slope = if k == 0 { slope } else { g[k] };
            y[k + 1] = y_slope * over_next;
            slip[k + 1] = u[k] * (unit * over_next);
            // Coefficient k of y' K, less the known part of y G'.
            let mut known = if k == 0 {
                slope * k_0
            } else {
                gain * g[k] + law.p * square(&g, k)
            };
            let mut product = y[k + 1] * u[0];
            for j in 0..k {
                known -= g_slope[j] * y[k - j];
                product += y[j + 1] * u[k - j];
            }
            g_slope[k] = known * u[0];
            g[k + 1] = g_slope[k] * over_next;
            u[k + 1] = product * minus_u_0;
        }
        let radius = radius(&y, order).min(radius(&u, order));
        Self {
            span: radius * unit * step_fraction(order),
            series: PowerSeries {
                start,
                unit,
                order,
                y,
                slip,
            },
        }
    }

    pub(super) fn start(&self) -> f64 {
        self.series.start
    }

    /// Where the block is at time `t`, days.
    pub(super) fn at(&self, t: f64) -> BlockPoint {
        self.series.at(t)
    }
}

/// Days in which the fastest of these rates, 1/day, changes something by its own size; 1 where none does.
pub(super) fn unit_days(rates: &[f64]) -> f64 {
    let sizes = rates.iter().map(|rate| rate.abs());
    let unit = 1.0 / sizes.fold(0.0, f64::max);
    if unit.is_finite() && unit > 0.0 {
        unit
    } else {
        1.0
    }
}

/// The sum of g_j g_(k-j) over 0 < j < k.
fn square(g: &TaylorSeries, k: usize) -> f64 {
    let mut half = 0.0;
    for j in 1..k.div_ceil(2) {
        half += g[j] * g[k - j];
    }
    let twice = 2.0 * half;
    if k > 0 && k.is_multiple_of(2) {
        twice + g[k / 2] * g[k / 2]
    } else {
        twice
    }
}

/// Estimates the radius of convergence from the two last coefficients.
pub(super) fn radius<const N: usize>(c: &[f64; N], order: usize) -> f64 {
    let one = |k: usize| {
        let share = (c[0] / c[k]).abs();
        if c[k] == 0.0 {
            f64::INFINITY
        } else {
            share.powf(1.0 / k as f64)
        }
    };
    one(order).min(one(order - 1))
}

/// The share of the radius that keeps the remainder near 1e-16 (order 28) or 1e-11 (order 16).
pub(super) fn step_fraction(order: usize) -> f64 {
    if order >= 24 { 0.26 } else { 0.2 }
}
