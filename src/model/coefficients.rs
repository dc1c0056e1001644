//! The coefficients of the law as the solver reads them.

use super::box_cox::{box_cox_of_ln, inverse_box_cox_ln};
use super::law::Law;

/// dy/dt = -r + kappa bc(y; p) = a y^p - b.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coefficients {
    pub(super) r: f64,
    pub(super) kappa: f64,
    pub(super) p: f64,
    a: f64,
    b: f64,
}

/// Beyond this |ln y^p| the difference a y^p - b loses less than kappa bc(y; p) - r.
const FAR_IN_LN_POWER: f64 = 0.7;

impl Coefficients {
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

    /// dy/dt at ln y, 1/day.
    pub(super) fn slope_at_ln(&self, ln_y: f64) -> f64 {
        if (self.p * ln_y).abs() > FAR_IN_LN_POWER {
            self.a * (self.p * ln_y).exp() - self.b
        } else {
            self.kappa * box_cox_of_ln(ln_y, self.p) - self.r
        }
    }

    /// ln of the y at which dy/dt is zero; NaN where there is none.
    pub(super) fn ln_y_steady(&self) -> f64 {
        let z = self.r / self.kappa;
        if self.p * z < -0.5 {
            // b is the small difference of two numbers there, and has been kept.
            (self.b / self.a).ln() / self.p
        } else {
            inverse_box_cox_ln(z, self.p)
        }
    }
}
