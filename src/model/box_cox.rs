//! The Box-Cox transform of the inverse velocity, by which the law is one equation through m = 1.

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
