//! The log-load f(t) on the block: the change of (tau/sigma')/A, piecewise linear between knots.

use super::law::LawError;

/// f(t): the value of the first knot before it, of the last after it, linear between two, and where two
/// knots share a day, a step. The velocity given to the law is that of f = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// (days, log-load), in the order of time.
    knots: Vec<(f64, f64)>,
}

/// A stretch of time in which the load is linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadStretch {
    pub(super) until: f64,
    /// f where the stretch is entered.
    pub(super) log_load: f64,
    /// df/dt, 1/day.
    pub(super) per_day: f64,
}

impl Load {
    /// From (days, log-load), days not decreasing; two knots of one day are a step there.
    ///
    /// # Errors
    /// [`LawError`] where a number is not finite or a day comes before the one before it.
    pub fn new(knots: Vec<(f64, f64)>) -> Result<Self, LawError> {
        let mut latest = f64::NEG_INFINITY;
        for (days, log_load) in &knots {
            if !(days.is_finite() && *days >= latest) {
                return Err(LawError {
                    name: "days of the load",
                    value: *days,
                    expected: "finite numbers that do not decrease",
                });
            }
            if !log_load.is_finite() {
                return Err(LawError {
                    name: "log-load",
                    value: *log_load,
                    expected: "a finite number",
                });
            }
            latest = *days;
        }
        Ok(Self { knots })
    }

    /// f at `t`; on a step, its value after it.
    pub fn at(&self, t: f64) -> f64 {
        self.stretch(t, 0).0.log_load
    }

    /// The stretch from `t` on, and how many knots lie at or before `t`, of which `passed` are known.
    pub(super) fn stretch(&self, t: f64, passed: usize) -> (LoadStretch, usize) {
        let later = self.knots.get(passed..).unwrap_or_default();
        let passed = passed + later.partition_point(|(days, _)| *days <= t);
        let before = passed.checked_sub(1).and_then(|k| self.knots.get(k));
        let stretch = match (before, self.knots.get(passed)) {
            (Some(&(from, f_from)), Some(&(to, f_to))) => {
                let per_day = (f_to - f_from) / (to - from);
                LoadStretch {
                    until: to,
                    log_load: f_from + per_day * (t - from),
                    per_day,
                }
            }
            (before, after) => LoadStretch {
                until: after.map_or(f64::INFINITY, |(to, _)| *to),
                log_load: before.or(after).map_or(0.0, |(_, f)| *f),
                per_day: 0.0,
            },
        };
        (stretch, passed)
    }
}
