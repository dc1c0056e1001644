//! The solution of the law from t = 0 on: velocity and displacement at any time, and the failure.

use super::accuracy::Accuracy;
use super::coefficients::Coefficients;
use super::law::Law;
use super::path::{PathPlace, SolutionPath};
use super::tail;
use super::taylor::BlockPoint;

/// Position on a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Inverse velocity over its initial value, `v_i / v`.
    pub y: f64,
    /// Velocity, in the unit of `v_i`.
    pub velocity: f64,
    /// Displacement since t = 0, in the unit of `v_i` times days.
    pub displacement: f64,
}

/// A solution of the law over [0, end) or up to its failure, whichever comes first.
#[derive(Debug, Clone)]
pub struct Trajectory {
    law: Law,
    path: SolutionPath,
}

impl Trajectory {
    /// Solves `law` over `[0, end_days]`.
    pub fn solve(law: &Law, end_days: f64, accuracy: Accuracy) -> Self {
        let mut trajectory = Self {
            law: *law,
            path: SolutionPath::empty(),
        };
        trajectory.solve_again(law, end_days, accuracy);
        trajectory
    }

    /// Solves another law in the room that this solution has taken: where that is enough, as it is from
    /// the second of many like laws on, without allocating.
    pub fn solve_again(&mut self, law: &Law, end_days: f64, accuracy: Accuracy) {
        self.law = *law;
        let coefficients = Coefficients::of(law);
        self.path.solve(law, &coefficients, end_days, accuracy);
    }

    /// Days from t = 0 to the singularity, where there is one, within the solved span or beyond.
    pub fn failure_days(&self) -> Option<f64> {
        match self.path.tail() {
            Some(tail) => Some(tail.failure_days),
            None => self.law.failure_days(),
        }
    }

    /// The motion `t` days after the start; `None` from the singularity on.
    pub fn at(&self, t: f64) -> Option<Motion> {
        match self.path.place(t) {
            PathPlace::At(at) => Some(self.motion(at)),
            PathPlace::BeforeFailure(remaining) => self.before_failure(remaining),
            PathPlace::Nowhere => None,
        }
    }

    /// The motion `remaining` days before the singularity, exact however few they are.
    pub fn before_failure(&self, remaining: f64) -> Option<Motion> {
        let tail = self.path.tail()?;
        if !(remaining > 0.0 && remaining <= tail.failure_days) {
            return None;
        }
        if remaining > tail.failure_days - tail.start {
            return self.at(tail.failure_days - remaining);
        }
        let ln_y_start = tail.at.y.ln();
        let ln_y = tail::ln_y_with_remaining(&self.law, remaining, ln_y_start);
        let slip = tail.at.slip + tail::slip_between(&self.law, ln_y_start, ln_y);
        Some(Motion {
            y: ln_y.exp(),
            velocity: self.law.v_i * (-ln_y).exp(),
            displacement: self.law.v_i * slip,
        })
    }

    fn motion(&self, BlockPoint { y, slip }: BlockPoint) -> Motion {
        Motion {
            y,
            velocity: self.law.v_i / y,
            displacement: self.law.v_i * slip,
        }
    }
}
