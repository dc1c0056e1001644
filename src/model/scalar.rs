//! A number, alone or with its derivatives by r, kappa and p, so that one solver gives both.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What the solver asks of a number.
pub(super) trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A number that depends on no parameter.
    fn constant(value: f64) -> Self;
    /// The number without its derivatives.
    fn value(self) -> f64;
    /// Times a number that depends on no parameter.
    fn scaled(self, factor: f64) -> Self;
    /// f of this number, given f's value and slope here.
    fn through(self, value: f64, slope: f64) -> Self;
    /// f of two numbers, given f's value and both its slopes here.
    fn through_two(self, other: Self, value: f64, slopes: (f64, f64)) -> Self;

    fn ln(self) -> Self {
        let value = self.value();
        self.through(value.ln(), 1.0 / value)
    }

    fn exp(self) -> Self {
        let exp = self.value().exp();
        self.through(exp, exp)
    }

    fn exp_m1(self) -> Self {
        let value = self.value();
        self.through(value.exp_m1(), value.exp())
    }

    /// (y^p - 1)/p, where this number is ln y.
    fn box_cox_of_ln(self, p: Self) -> Self {
        let (ln_y, p_value) = (self.value(), p.value());
        let slopes = ((p_value * ln_y).exp(), box_cox_by_p(ln_y, p_value));
        self.through_two(p, box_cox_of_ln(ln_y, p_value), slopes)
    }

    /// ln y, where this number is (y^p - 1)/p.
    fn inverse_box_cox_ln(self, p: Self) -> Self {
        let (z, p_value) = (self.value(), p.value());
        let value = inverse_box_cox_ln(z, p_value);
        let slopes = (
            1.0 / (1.0 + p_value * z),
            inverse_box_cox_ln_by_p(z, p_value),
        );
        self.through_two(p, value, slopes)
    }
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn scaled(self, factor: f64) -> Self {
        self * factor
    }

    fn through(self, value: f64, _: f64) -> Self {
        value
    }

    fn through_two(self, _: Self, value: f64, _: (f64, f64)) -> Self {
        value
    }
}

/// A number and its derivatives by r, kappa and p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dual {
    pub(super) value: f64,
    pub(super) by: [f64; 3],
}

impl Dual {
    /// The parameter of this place among r, kappa and p.
    pub(super) fn parameter(value: f64, place: usize) -> Self {
        let mut by = [0.0; 3];
        by[place] = 1.0;
        Self { value, by }
    }

    fn combined(self, other: Self, value: f64, slopes: (f64, f64)) -> Self {
        let [a, b, c] = self.by;
        let [d, e, f] = other.by;
        let (s, t) = slopes;
        Self {
            value,
            by: [s * a + t * d, s * b + t * e, s * c + t * f],
        }
    }
}

impl Scalar for Dual {
    fn constant(value: f64) -> Self {
        Self {
            value,
            by: [0.0; 3],
        }
    }

    fn value(self) -> f64 {
        self.value
    }

    fn scaled(self, factor: f64) -> Self {
        self.through(self.value * factor, factor)
    }

    fn through(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            by: self.by.map(|by| slope * by),
        }
    }

    fn through_two(self, other: Self, value: f64, slopes: (f64, f64)) -> Self {
        self.combined(other, value, slopes)
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.combined(other, self.value + other.value, (1.0, 1.0))
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.combined(other, self.value - other.value, (1.0, -1.0))
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        self.combined(other, value, (other.value, self.value))
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        self.combined(other, value, (1.0 / other.value, -value / other.value))
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self.scaled(-1.0)
    }
}

/// (y^p - 1)/p at ln y, and ln y at p = 0.
pub(super) fn box_cox_of_ln(ln_y: f64, p: f64) -> f64 {
    if p == 0.0 {
        ln_y
    } else {
        (p * ln_y).exp_m1() / p
    }
}

/// ln y with (y^p - 1)/p = z; NaN where there is none.
pub(super) fn inverse_box_cox_ln(z: f64, p: f64) -> f64 {
    if p == 0.0 { z } else { (p * z).ln_1p() / p }
}

/// The derivative of the Box-Cox transform by p, (y^p ln y - bc)/p, through p = 0.
pub(super) fn box_cox_by_p(ln_y: f64, p: f64) -> f64 {
    let x = p * ln_y;
    if x.abs() > 0.5 {
        return (x.exp() * ln_y - x.exp_m1() / p) / p;
    }
    // ln^2 y times the sum of x^k / (k! (k + 2)): (x e^x - e^x + 1)/x^2 cancels near 0.
    let (mut power, mut sum) = (1.0, 0.5);
    for k in 1..14 {
        let k_f = f64::from(k);
        power *= x / k_f;
        sum += power / (k_f + 2.0);
    }
    ln_y * ln_y * sum
}

/// The derivative of ln(1 + p z)/p by p, through p = 0.
fn inverse_box_cox_ln_by_p(z: f64, p: f64) -> f64 {
    let x = p * z;
    if x.abs() > 0.1 {
        return (z / (1.0 + x) - x.ln_1p() / p) / p;
    }
    // z^2 times the sum of -(k + 1)/(k + 2) (-x)^k.
    let (mut power, mut sum) = (1.0, 0.0);
    for k in 0..18 {
        let k_f = f64::from(k);
        sum -= power * (k_f + 1.0) / (k_f + 2.0);
        power *= -x;
    }
    z * z * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_by_p_are_one_function_on_both_sides_of_their_series() {
        for (x, tolerance) in [(0.5, 1e-14), (-0.5, 1e-14)] {
            let at = |x: f64| box_cox_by_p(0.7, x / 0.7);
            let (below, above) = (at(x * (1.0 - 1e-15)), at(x * (1.0 + 1e-15)));
            assert!((below / above - 1.0).abs() < tolerance, "{below} {above}");
        }
        for x in [0.1, -0.1] {
            let at = |x: f64| inverse_box_cox_ln_by_p(0.7, x / 0.7);
            let (below, above) = (at(x * (1.0 - 1e-15)), at(x * (1.0 + 1e-15)));
            assert!((below / above - 1.0).abs() < 1e-12, "{below} {above}");
        }
    }
}
