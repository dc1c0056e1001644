//! Where a law goes: its slope, its steady state, its inflection, its failure, and when.

use super::box_cox::inverse_box_cox_ln;
use super::coefficients::Coefficients;
use super::law::Law;
use super::tail;

impl Law {
    /// dy/dt at inverse velocity y, 1/day.
    pub fn slope(&self, y: f64) -> f64 {
        Coefficients::of(self).slope_at_ln(y.ln())
    }

    /// ln of the y at which dy/dt is zero, where there is one.
    pub fn ln_y_steady(&self) -> Option<f64> {
        if self.kappa == 0.0 {
            return None;
        }
        let ln_y = Coefficients::of(self).ln_y_steady();
        ln_y.is_finite().then_some(ln_y)
    }

    /// ln of the y at which the velocity inflects: y*^p = 2b / ((2-p) a).
    fn ln_y_transition(&self) -> Option<f64> {
        if self.kappa == 0.0 || self.p >= 2.0 {
            return None;
        }
        // y*^p = 1 + p z with z = (2r/kappa + 1) / (2 - p), which stays finite at p = 0.
        let z = (2.0 * self.r / self.kappa + 1.0) / (2.0 - self.p);
        let ln_y = inverse_box_cox_ln(z, self.p);
        ln_y.is_finite().then_some(ln_y)
    }

    /// Days from t = 0 to the singularity; `None` where there is none.
    pub fn failure_days(&self) -> Option<f64> {
        tail::fails_from(self, 0.0).then(|| tail::remaining_days(self, 0.0))
    }

    /// Days from t = 0 until the velocity first reaches `velocity`; `None` when it never does.
    pub fn days_to_velocity(&self, velocity: f64) -> Option<f64> {
        let ln_y = (self.v_i / velocity).ln();
        if ln_y >= 0.0 {
            return Some(0.0);
        }
        let stops_short =
            self.kappa < 0.0 && self.ln_y_steady().is_some_and(|steady| steady >= ln_y);
        if self.r <= 0.0 || self.r.is_nan() || stops_short {
            return None;
        }
        Some(tail::days_between(self, 0.0, ln_y)).filter(|days| days.is_finite())
    }

    /// Days from t = 0 to the velocity's inflection, negative where it is past; `None` where there is none.
    pub fn transition_days(&self) -> Option<f64> {
        let ln_y = self.ln_y_transition()?;
        if ln_y <= 0.0 {
            return self.days_to_velocity(self.v_i * (-ln_y).exp());
        }
        let past = self.r > 0.0 && self.slope(ln_y.exp()) < 0.0;
        past.then(|| -tail::days_between(self, ln_y, 0.0))
            .filter(|days| days.is_finite())
    }
}
