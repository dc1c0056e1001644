//! What is taken for granted before the readings, on the scale of the window's length L.
//!
//! | what | prior |
//! |---|---|
//! | ln of the present velocity | flat |
//! | r L, kappa L | Cauchy, scale 3 |
//! | r times the newest sampling interval | besides, normal with standard deviation 1.5, as under a load: what would be over well within one interval rests on one reading |
//! | p | uniform in (0, 0.6) where kappa > 0 (m from 1 to 2.5), in (-1, 0) where kappa < 0 (m from 0.5 to 1) |
//! | the law | S > 0, and velocities within the window stay within a factor of e^14 |
//! | scatter of a rate about the law, relative | log-normal, median 0.05, standard deviation of the log 0.9; Student t with 7 degrees of freedom |
//! | its correlated share of the variance | none (probability 0.4), or all but a white share that is even in its log from 0.003 to 0.9 |
//! | its correlation time | between one sampling interval and the length of the record, even in its log |
//! | onset | the first reading (1/2), or later, even in the log of its distance from the present, with eight rates after it |

/// Scale of the prior on kappa L and on r L.
pub(super) const CAUCHY_SCALE: f64 = 3.0;
/// The prior of p spans this, m from 0.5 to 2.5.
pub const P_PRIOR: (f64, f64) = (-1.0, 0.6);
/// Median of the prior on the relative scatter, and the standard deviation of its log.
pub(super) const SCATTER: (f64, f64) = (0.05, 0.9);
/// Probability that the scatter has no memory.
pub(super) const WITHOUT_MEMORY: f64 = 0.4;
/// Shares of the variance that the correlated part may have: middles of four parts of that range.
pub(super) const SLOW_SHARES: [f64; 4] = [0.56, 0.894, 0.975, 0.994];
/// Probability that the law holds from the first reading on.
pub(super) const FROM_THE_FIRST: f64 = 0.5;

/// ln of the Cauchy density of a number in units of the window's length, up to a constant.
pub(super) fn log_cauchy(value: f64) -> f64 {
    let z = value / CAUCHY_SCALE;
    -(z * z).ln_1p()
}

/// ln of the prior density of ln size of the scatter, up to a constant.
pub(super) fn log_size(log_size: f64) -> f64 {
    let z = (log_size - SCATTER.0.ln()) / SCATTER.1;
    -0.5 * z * z
}
