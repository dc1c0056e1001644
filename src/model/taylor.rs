//! One Taylor step of the law: y, its Box-Cox transform and the slip, to any order by recurrence.

use super::law::{Law, box_cox};

/// The highest order that a segment can hold.
pub(super) const MAX_ORDER: usize = 30;

/// y(t) and the slip over `v_i` from `start`, as polynomials in t - start, good up to `span`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    pub(super) start: f64,
    pub(super) span: f64,
    order: usize,
    y: [f64; MAX_ORDER + 1],
    slip: [f64; MAX_ORDER + 1],
}

impl Segment {
    /// Expands the law about `start`, where the inverse velocity is `y_0` and the slip `slip_0`.
    ///
    /// With B = bc(y; p): y' = -r + kappa B and y B' = y' (1 + p B); with u = 1/y: y u = 1.
    pub(super) fn expand(law: &Law, order: usize, start: f64, at: (f64, f64)) -> Self {
        let (y_0, slip_0) = at;
        let mut y = [0.0; MAX_ORDER + 1];
        let mut slip = [0.0; MAX_ORDER + 1];
        let mut b = [0.0; MAX_ORDER + 1];
        let mut u = [0.0; MAX_ORDER + 1];
        y[0] = y_0;
        slip[0] = slip_0;
        b[0] = box_cox(y_0, law.p);
        u[0] = 1.0 / y_0;
        let power = 1.0 + law.p * b[0];
        for k in 0..order {
            let next = (k + 1) as f64;
            y[k + 1] = if k == 0 {
                law.kappa * b[0] - law.r
            } else {
                law.kappa * b[k] / next
            };
            slip[k + 1] = u[k] / next;
            // Coefficient k of y' (1 + p B), less the known part of y B'.
            let mut sum = next * y[k + 1] * power;
            let mut product = y[k + 1] * u[0];
            for j in 1..=k {
                let j_f = j as f64;
                sum += (next - j_f) * y[k + 1 - j] * law.p * b[j] - j_f * b[j] * y[k + 1 - j];
                product += y[k + 1 - j] * u[j];
            }
            b[k + 1] = sum / (next * y_0);
            u[k + 1] = -product * u[0];
        }
        let radius = radius(&y, order).min(radius(&u, order));
        Self {
            start,
            span: radius * step_fraction(order),
            order,
            y,
            slip,
        }
    }

    /// (y, `slip / v_i`) at time `t`.
    pub(super) fn at(&self, t: f64) -> (f64, f64) {
        let h = t - self.start;
        let mut y = self.y[self.order];
        let mut slip = self.slip[self.order];
        for k in (0..self.order).rev() {
            y = y * h + self.y[k];
            slip = slip * h + self.slip[k];
        }
        (y, slip)
    }
}

/// Estimates the radius of convergence from the two last coefficients.
fn radius(c: &[f64; MAX_ORDER + 1], order: usize) -> f64 {
    let one = |k: usize| {
        if c[k] == 0.0 {
            f64::INFINITY
        } else {
            (c[0] / c[k]).abs().powf(1.0 / k as f64)
        }
    };
    one(order).min(one(order - 1))
}

/// The share of the radius that keeps the remainder near 1e-16 (order 28) or 1e-11 (order 16).
fn step_fraction(order: usize) -> f64 {
    if order >= 24 { 0.26 } else { 0.2 }
}
