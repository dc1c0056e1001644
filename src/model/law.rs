//! The parameters of the law, in the regular form and in the paper's.

use crate::regime::Regime;
use serde::{Deserialize, Serialize};

/// The law under constant load, in its regular coordinates. Times are in days, velocities in any
/// unit per day; displacement comes out in that unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Law {
    /// Velocity at t = 0.
    pub v_i: f64,
    /// Initial slope of the inverse-velocity plot, 1/day; positive: accelerating.
    pub r: f64,
    /// Curvature of the inverse-velocity plot, 1/day; positive: m > 1.
    pub kappa: f64,
    /// 1 - 1/m, with m = B/A.
    pub p: f64,
    /// Healing rate a = m / `theta_i`, 1/day, kept apart because kappa = a p loses it at m = 1.
    pub a: f64,
    /// Slip rate over `D_c` times m, b = r + a, 1/day, kept apart because that sum loses it where b is
    /// small beside a: far from a steady state that is much faster.
    pub b: f64,
}

/// The paper's parameters; `x_i`, T and D do not exist at m = 1, where S `theta_i` is the control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperParameters {
    /// m = B/A; infinite where p = 1.
    pub m: f64,
    /// Initial state `x_i`.
    pub x_i: Option<f64>,
    /// Time unit T = `D_c/D`, days.
    pub t_unit_days: Option<f64>,
    /// Velocity scale D, in the unit of [`Law::v_i`], a length per day.
    pub d: Option<f64>,
    /// Characteristic slip `D_c`, in that length.
    pub d_c: Option<f64>,
    /// S `theta_i` = b/a.
    pub s_theta_i: Option<f64>,
}

/// Parameters that make no law.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} is {value}: expected {expected}")]
pub struct LawError {
    /// The parameter.
    pub name: &'static str,
    /// What was given.
    pub value: f64,
    /// What would do.
    pub expected: &'static str,
}

impl Law {
    /// From the paper's parameters, m neither 0 nor 1. `t_unit_days` is T, `d` the velocity scale D.
    ///
    /// # Errors
    /// [`LawError`] names the parameter that makes no law.
    pub fn from_paper(m: f64, x_i: f64, t_unit_days: f64, d: f64) -> Result<Self, LawError> {
        if !m.is_finite() || m == 0.0 || (m - 1.0).abs() < f64::EPSILON {
            let expected = "a finite number other than 0 and 1 (at m = 1 give S theta)";
            return Err(LawError {
                name: "m",
                value: m,
                expected,
            });
        }
        positive("x_i", x_i)?;
        positive("t_unit_days", t_unit_days)?;
        positive("scale", d)?;
        let a = m / (x_i * t_unit_days);
        let over_one = decimal_minus_one(m);
        // S theta_i = x_i^(1-m). Powers lose nothing where the exponent is large, nor ln(1 + z) beside 1.
        let ln_s_theta = -over_one * decimal_ln(x_i);
        let s_theta = x_i.powf(-over_one);
        Ok(Self {
            v_i: d * x_i.powf(-m),
            r: if ln_s_theta.abs() < 1.0 {
                a * ln_s_theta.exp_m1()
            } else {
                a * (s_theta - 1.0)
            },
            kappa: over_one / (x_i * t_unit_days),
            p: over_one / m,
            a,
            b: a * s_theta,
        })
    }

    /// At m = 1, from S `theta_i`, the contacts' initial age `theta_i` in days and the initial velocity.
    ///
    /// # Errors
    /// [`LawError`] names the parameter that makes no law.
    pub fn at_unit_m(s_theta_i: f64, theta_i_days: f64, v_i: f64) -> Result<Self, LawError> {
        positive("s_theta", s_theta_i)?;
        positive("t_unit_days", theta_i_days)?;
        positive("scale", v_i)?;
        let a = 1.0 / theta_i_days;
        Ok(Self {
            v_i,
            r: a * (s_theta_i - 1.0),
            kappa: 0.0,
            p: 0.0,
            a,
            b: a * s_theta_i,
        })
    }

    /// From the regular coordinates of a fit; a = kappa/p, and at p = 0 it is unknown (kappa must be 0).
    pub fn from_fit(v_i: f64, r: f64, kappa: f64, p: f64) -> Self {
        let a = if p == 0.0 { f64::NAN } else { kappa / p };
        Self {
            v_i,
            r,
            kappa,
            p,
            a,
            b: a + r,
        }
    }

    /// The paper's parameters of this law.
    pub fn paper(&self) -> PaperParameters {
        let m = 1.0 / (1.0 - self.p);
        let positive = |value: f64| Some(value).filter(|value| value.is_finite() && *value > 0.0);
        let s_theta_i = positive(self.b / self.a);
        let d_c = positive(m * self.v_i / self.b);
        // x_i = y_s^(-1/m)
        let x_i = self
            .ln_y_steady()
            .filter(|_| self.p != 0.0 && s_theta_i.is_some())
            .and_then(|ln_y| positive((-ln_y * (1.0 - self.p)).exp()));
        let t_unit_days = x_i.map(|x| m / (self.a * x)).filter(|t| t.is_finite());
        let d = x_i
            .map(|x| self.v_i * (m * x.ln()).exp())
            .filter(|d| d.is_finite());
        PaperParameters {
            m,
            x_i,
            t_unit_days,
            d,
            d_c,
            s_theta_i,
        }
    }

    /// The regime, from the signs of r and kappa; kappa = 0 is m = 1, unstable when it accelerates.
    pub fn regime(&self) -> Regime {
        match (self.kappa >= 0.0, self.r > 0.0) {
            (true, true) => Regime::UnstableAccelerating,
            (true, false) => Regime::UnstableDecelerating,
            (false, true) => Regime::StableAccelerating,
            (false, false) => Regime::StableDecelerating,
        }
    }

    /// The same motion seen backwards in time.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            r: -self.r,
            kappa: -self.kappa,
            a: -self.a,
            b: -self.b,
            ..*self
        }
    }

    /// The same solution with t = 0 moved to where the inverse velocity is `y`.
    #[must_use]
    pub fn from_y(&self, y: f64) -> Self {
        let shrink = ((self.p - 1.0) * y.ln()).exp();
        Self {
            v_i: self.v_i / y,
            r: -self.slope(y) / y,
            kappa: self.kappa * shrink,
            p: self.p,
            a: self.a * shrink,
            b: self.b / y,
        }
    }

    /// The state at inverse velocity y: the paper's x, or `theta/theta_i` at m = 1.
    pub fn state(&self, y: f64) -> Option<f64> {
        if self.p == 0.0 {
            return Some(y);
        }
        // y = (x/x_i)^m
        let x_i = self.paper().x_i;
        x_i.map(|x_i| x_i * (y.ln() * (1.0 - self.p)).exp())
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), LawError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(LawError {
        name,
        value,
        expected: "a finite number above 0",
    })
}

/// m - 1 for the decimal number that m was written as: 1.001 is not a binary fraction, and the
/// subtraction would keep its rounding, a thousand times magnified, in every time to failure.
fn decimal_minus_one(m: f64) -> f64 {
    let text = m.to_string();
    let near_one = text.strip_prefix("1.").map(|digits| format!("0.{digits}"));
    let exact = match (near_one, text.strip_prefix("0.")) {
        (Some(difference), _) => difference.parse().ok(),
        (None, Some(digits)) if digits.len() <= 17 => {
            let places = digits.len();
            let scale = 10_u64.pow(u32::try_from(places).unwrap_or(0));
            digits
                .parse::<u64>()
                .ok()
                .map(|n| -((scale - n) as f64) / scale as f64)
        }
        (None, _) => None,
    };
    exact.unwrap_or(m - 1.0)
}

/// ln of the decimal number that x was written as.
fn decimal_ln(x: f64) -> f64 {
    if (0.5..1.5).contains(&x) {
        decimal_minus_one(x).ln_1p()
    } else {
        x.ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_parameters_survive_the_regular_form() {
        for (m, x_i) in [
            (1.35, 0.6),
            (0.98, 39.0),
            (-20.0, 1.2),
            (29.0, 0.9),
            (0.5, 4.0),
        ] {
            let law = Law::from_paper(m, x_i, 3.0, 7.0).unwrap();
            let back = law.paper();
            for (name, got, want) in [
                ("m", back.m, m),
                ("x_i", back.x_i.unwrap(), x_i),
                ("T", back.t_unit_days.unwrap(), 3.0),
                ("D", back.d.unwrap(), 7.0),
                ("D_c", back.d_c.unwrap(), 21.0),
            ] {
                assert!(
                    (got / want - 1.0).abs() < 1e-10,
                    "m={m}: {name} {got} not {want}"
                );
            }
        }
    }

    #[test]
    fn the_regime_is_that_of_the_papers_table() {
        let cases = [
            (1.35, 0.6, Regime::UnstableAccelerating),
            (1.35, 2.0, Regime::UnstableDecelerating),
            (0.98, 39.0, Regime::StableAccelerating),
            (0.98, 0.5, Regime::StableDecelerating),
            (-1.0, 3.0, Regime::StableDecelerating),
            (-0.5, 0.4, Regime::StableAccelerating),
        ];
        for (m, x_i, regime) in cases {
            assert_eq!(
                Law::from_paper(m, x_i, 1.0, 1.0).unwrap().regime(),
                regime,
                "m={m}"
            );
        }
    }

    #[test]
    fn a_law_that_cannot_be_is_refused_by_name() {
        let error = Law::from_paper(1.0, 0.5, 1.0, 1.0).unwrap_err();
        assert!(error.to_string().starts_with("m is 1"), "{error}");
        let error = Law::from_paper(1.35, -0.5, 1.0, 1.0).unwrap_err();
        assert!(error.to_string().starts_with("x_i is -0.5"), "{error}");
    }
}
