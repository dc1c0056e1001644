//! A law from its rates at the start, as simulated slopes are drawn.

use slipwatch::model::Law;

/// From the velocity (a length per day) and healing `a` (1/day) at the start, `s_theta` = b/a of the loading b (1/day), and
/// p = 1 - 1/m.
pub fn law_from_healing(v_i: f64, a: f64, s_theta: f64, p: f64) -> Law {
    Law {
        v_i,
        r: a * (s_theta - 1.0),
        kappa: a * p,
        p,
        a,
        b: a * s_theta,
    }
}
