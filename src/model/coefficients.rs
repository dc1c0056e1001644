//! The coefficients of the law as the solver reads them, with or without derivatives.

use super::law::Law;
use super::scalar::{Dual, Scalar};

/// dy/dt = -r + kappa bc(y; p) = a y^p - b.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coefficients<S> {
    pub(super) r: S,
    pub(super) kappa: S,
    pub(super) p: S,
    a: S,
    b: S,
}

/// Beyond this |ln y^p| the difference a y^p - b loses less than kappa bc(y; p) - r.
const FAR_IN_LN_POWER: f64 = 0.7;

impl Coefficients<f64> {
    pub(super) fn of(law: &Law) -> Self {
        Self {
            r: law.r,
            kappa: law.kappa,
            p: law.p,
            a: law.a,
            b: law.b,
        }
    }

    /// Of the same law while the log-load keeps the value that `gain` is the exponential of.
    pub(super) fn under(law: &Law, gain: f64) -> Self {
        let b = law.b * gain;
        Self {
            r: law.r + law.b * (gain - 1.0),
            kappa: law.kappa,
            p: law.p,
            a: law.a,
            b,
        }
    }
}

impl Coefficients<Dual> {
    /// With derivatives by r, kappa and p: there a is kappa/p, and b is a + r.
    pub(super) fn of(law: &Law) -> Self {
        let r = Dual::parameter(law.r, 0);
        let kappa = Dual::parameter(law.kappa, 1);
        let p = Dual::parameter(law.p, 2);
        let a = kappa / p;
        let b = a + r;
        Self {
            r,
            kappa,
            p,
            a: Dual { value: law.a, ..a },
            b: Dual { value: law.b, ..b },
        }
    }
}

impl<S: Scalar> Coefficients<S> {
    /// dy/dt at ln y, 1/day.
    pub(super) fn slope_at_ln(&self, ln_y: S) -> S {
        if (self.p * ln_y).value().abs() > FAR_IN_LN_POWER {
            self.a * (self.p * ln_y).exp() - self.b
        } else {
            self.kappa * ln_y.box_cox_of_ln(self.p) - self.r
        }
    }

    /// ln of the y at which dy/dt is zero; NaN where there is none.
    pub(super) fn ln_y_steady(&self) -> S {
        let z = self.r / self.kappa;
        if (self.p * z).value() < -0.5 {
            // b is the small difference of two numbers there, and has been kept.
            (self.b / self.a).ln() / self.p
        } else {
            z.inverse_box_cox_ln(self.p)
        }
    }
}
