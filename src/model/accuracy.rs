//! How exact a solution is to be.

/// How exact a solution is to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accuracy {
    /// Close to the limit of f64, for results that are shown.
    Full,
    /// About 1e-10 relative, for the many solutions inside a fit.
    Fit,
}

impl Accuracy {
    pub(super) fn order(self) -> usize {
        match self {
            Self::Full => 28,
            Self::Fit => 16,
        }
    }

    /// A bound on the work: more segments than a solution within f64's range needs, or than a fit can
    /// use (a law that needs more is about to leave its domain).
    pub(super) fn most_segments(self) -> usize {
        match self {
            Self::Full => 4000,
            Self::Fit => 48,
        }
    }

    /// ln y below which the last stretch before failure is solved by the time that remains.
    pub(super) fn ln_y_of_tail(self) -> f64 {
        match self {
            Self::Full => -2.0,
            Self::Fit => -5.0,
        }
    }
}
