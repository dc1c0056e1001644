//! The solution of the law from t = 0 on: velocity, displacement, state, failure and transition time.

use super::law::Law;
use super::tail;
use super::taylor::Segment;

/// How exact a solution is to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accuracy {
    /// Close to the limit of f64, for results that are shown.
    Full,
    /// About 1e-10 relative, for the many solutions inside a fit.
    Fit,
}

impl Accuracy {
    fn order(self) -> usize {
        match self {
            Self::Full => 28,
            Self::Fit => 16,
        }
    }

    /// A bound on the work: more segments than a solution within f64's range needs, or than a fit can
    /// use (a law that needs more is about to leave its domain).
    fn most_segments(self) -> usize {
        match self {
            Self::Full => 4000,
            Self::Fit => 48,
        }
    }

    /// ln y below which the last stretch before failure is solved by the time that remains.
    fn ln_y_of_tail(self) -> f64 {
        match self {
            Self::Full => -2.0,
            Self::Fit => -5.0,
        }
    }
}

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
    segments: Vec<Segment>,
    /// Where the segments stop: (t, ln y, `slip / v_i`) at the start of the tail before failure.
    tail: Option<(f64, f64, f64)>,
    failure_days: Option<f64>,
}

impl Trajectory {
    /// Solves `law` over `[0, end_days]`.
    pub fn solve(law: &Law, end_days: f64, accuracy: Accuracy) -> Self {
        let failure_days = tail::fails_from(law, 0.0).then(|| tail::remaining_days(law, 0.0));
        let mut segments = Vec::with_capacity(16);
        let mut tail = None;
        let (mut t, mut y, mut slip) = (0.0, 1.0, 0.0);
        while t <= end_days && segments.len() < accuracy.most_segments() {
            if failure_days.is_some() && f64::ln(y) < accuracy.ln_y_of_tail() {
                tail = Some((t, f64::ln(y), slip));
                break;
            }
            let mut segment = Segment::expand(law, accuracy.order(), t, (y, slip));
            segment.span = segment
                .span
                .min((end_days - t).max(0.0) * 1.01 + f64::MIN_POSITIVE);
            let next = t + segment.span;
            (y, slip) = segment.at(next);
            segments.push(segment);
            if !(next > t && y > 0.0 && y.is_finite() && slip.is_finite()) {
                break;
            }
            t = next;
        }
        Self {
            law: *law,
            segments,
            tail,
            failure_days,
        }
    }

    /// Days from t = 0 to the singularity, where there is one, within the solved span or beyond.
    pub fn failure_days(&self) -> Option<f64> {
        self.failure_days
    }

    /// The motion `t` days after the start; `None` from the singularity on.
    pub fn at(&self, t: f64) -> Option<Motion> {
        if self.failure_days.is_some_and(|failure| t >= failure) {
            return None;
        }
        if let (Some((start, ..)), Some(failure)) = (self.tail, self.failure_days)
            && t > start
        {
            return self.before_failure(failure - t);
        }
        let index = self
            .segments
            .partition_point(|segment| segment.start <= t)
            .saturating_sub(1);
        let segment = self.segments.get(index)?;
        if t > segment.start + segment.span * (1.0 + 1e-9) {
            return None;
        }
        let (y, slip) = segment.at(t);
        (y > 0.0).then(|| self.motion(y, slip))
    }

    /// The motion `remaining` days before the singularity, exact however few they are.
    pub fn before_failure(&self, remaining: f64) -> Option<Motion> {
        let (start, ln_y_start, slip_start) = self.tail?;
        let failure = self.failure_days?;
        if !(remaining > 0.0 && remaining <= failure) {
            return None;
        }
        if remaining > failure - start {
            return self.at(failure - remaining);
        }
        let ln_y = tail::ln_y_with_remaining(&self.law, remaining, ln_y_start);
        let slip = slip_start + tail::slip_between(&self.law, ln_y_start, ln_y);
        Some(Motion {
            y: ln_y.exp(),
            velocity: self.law.v_i * (-ln_y).exp(),
            displacement: self.law.v_i * slip,
        })
    }

    fn motion(&self, y: f64, slip: f64) -> Motion {
        Motion {
            y,
            velocity: self.law.v_i / y,
            displacement: self.law.v_i * slip,
        }
    }
}
