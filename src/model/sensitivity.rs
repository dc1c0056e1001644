//! How velocity, displacement and the time of failure answer to the parameters `v_i`, r, kappa and p.
//!
//! The same recurrences that solve the law carry its derivatives: exact, and through m = 1 as smooth as
//! the solution. Where a law was made from the paper's parameters, a and b follow r, kappa and p.

use super::accuracy::Accuracy;
use super::coefficients::Coefficients;
use super::law::Law;
use super::path::{PathPlace, SolutionPath};
use super::scalar::Dual;
use super::tail;
use super::trajectory::Motion;

/// Derivatives by each parameter of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gradient {
    /// By `v_i`, per its unit.
    pub v_i: f64,
    /// By r, days.
    pub r: f64,
    /// By kappa, days.
    pub kappa: f64,
    /// By p.
    pub p: f64,
}

/// A motion and how it changes with the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionWithGradients {
    /// The motion.
    pub motion: Motion,
    /// Of ln velocity.
    pub ln_velocity: Gradient,
    /// Of the displacement since t = 0.
    pub displacement: Gradient,
}

/// Days from t = 0, and how they change with the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DaysWithGradient {
    /// Days.
    pub days: f64,
    /// Of those days.
    pub gradient: Gradient,
}

/// A solution of the law with its derivatives, over [0, end) or up to its failure.
#[derive(Debug, Clone)]
pub struct Sensitivities {
    law: Law,
    path: SolutionPath<Dual>,
}

impl Sensitivities {
    /// Solves `law` and its derivatives over `[0, end_days]`.
    pub fn solve(law: &Law, end_days: f64, accuracy: Accuracy) -> Self {
        let mut solution = Self {
            law: *law,
            path: SolutionPath::empty(),
        };
        solution.solve_again(law, end_days, accuracy);
        solution
    }

    /// Solves another law in the room that this solution has taken, without allocating where that is
    /// enough.
    pub fn solve_again(&mut self, law: &Law, end_days: f64, accuracy: Accuracy) {
        self.law = *law;
        let coefficients = Coefficients::<Dual>::of(law);
        self.path.solve(law, &coefficients, end_days, accuracy);
    }

    /// The motion `t` days after the start with its derivatives at that time; `None` from the
    /// singularity on.
    pub fn at(&self, t: f64) -> Option<MotionWithGradients> {
        match self.path.place(t) {
            PathPlace::At(at) => Some(self.motion(at)),
            PathPlace::BeforeFailure(remaining) => self.before_failure(remaining),
            PathPlace::Nowhere => None,
        }
    }

    /// On the tail, time is an integral over y from where it starts; so are its derivatives at fixed y,
    /// and at fixed time y moves to make up for them.
    fn before_failure(&self, remaining: f64) -> Option<MotionWithGradients> {
        let (law, tail) = (&self.law, self.path.tail()?);
        let (y_0, slip_0) = tail.at;
        let ln_y_0 = y_0.value.ln();
        let ln_y = tail::ln_y_with_remaining(law, remaining, ln_y_0);
        let y = ln_y.exp();
        let (slope_0, slope) = (tail::slope_at_ln(law, ln_y_0), tail::slope_at_ln(law, ln_y));
        let days_by = tail::days_between_by(law, ln_y_0, ln_y);
        let slip_by = tail::slip_between_by(law, ln_y_0, ln_y);
        let later = |k: usize| y_0.by[k] / slope_0 - days_by[k];
        let y_by = |k: usize| slope * later(k);
        let slip =
            |k: usize| slip_0.by[k] + slip_by[k] + later(k) / y - y_0.by[k] / (slope_0 * y_0.value);
        let at = (
            Dual {
                value: y,
                by: [y_by(0), y_by(1), y_by(2)],
            },
            Dual {
                value: slip_0.value + tail::slip_between(law, ln_y_0, ln_y),
                by: [slip(0), slip(1), slip(2)],
            },
        );
        Some(self.motion(at))
    }

    fn motion(&self, (y, slip): (Dual, Dual)) -> MotionWithGradients {
        let v_i = self.law.v_i;
        let ln_velocity = y.by.map(|by| -by / y.value);
        let displacement = slip.by.map(|by| v_i * by);
        MotionWithGradients {
            motion: Motion {
                y: y.value,
                velocity: v_i / y.value,
                displacement: v_i * slip.value,
            },
            ln_velocity: Gradient::of(1.0 / v_i, ln_velocity),
            displacement: Gradient::of(slip.value, displacement),
        }
    }
}

impl Gradient {
    fn of(v_i: f64, [r, kappa, p]: [f64; 3]) -> Self {
        Self { v_i, r, kappa, p }
    }
}

impl Law {
    /// Days to the singularity with their derivatives; `None` where there is none.
    pub fn failure_with_gradient(&self) -> Option<DaysWithGradient> {
        let days = self.failure_days()?;
        let gradient = Gradient::of(0.0, tail::remaining_days_by(self, 0.0));
        Some(DaysWithGradient { days, gradient })
    }

    /// [`Law::days_to_velocity`] with their derivatives; `None` too where the velocity is reached at once,
    /// and the derivatives have two values.
    pub fn days_to_velocity_with_gradient(&self, velocity: f64) -> Option<DaysWithGradient> {
        let days = self.days_to_velocity(velocity).filter(|days| *days > 0.0)?;
        let ln_y = (self.v_i / velocity).ln();
        let by_v_i = ln_y.exp() / (self.v_i * tail::slope_at_ln(self, ln_y));
        let gradient = Gradient::of(by_v_i, tail::days_between_by(self, 0.0, ln_y));
        Some(DaysWithGradient { days, gradient })
    }
}
