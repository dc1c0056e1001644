//! What is taken for granted of the load and of how readings scatter: the one thing in which posteriors differ.

use super::prior::UNSTABLE;

/// Scale of the Cauchy prior of kappa times the length of the record, under a constant load.
pub(super) const KAPPA_SCALE: f64 = 3.0;

/// What is taken for granted besides the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumptions {
    /// Standard deviation of ln v about the law for each e-fold of the time to failure; 0: the law holds as it is.
    pub(super) drift: f64,
    /// Whether what remembers in the scatter is the load, today's in what the law gives of today; or else noise about the law.
    pub(super) load_changes: bool,
    /// Standard deviations, for one rate after another, of a velocity that follows no law yet.
    pub(super) drifts_before: &'static [f64],
    /// Probability that the law holds from the first rate on; `None`: every rate is as likely a start.
    pub(super) from_the_first: Option<f64>,
    /// Whether errors are followed to the readings that they come from: differences of displacement share that of the reading
    /// between them, means of several scatter less than one, and a reading that happens to be high counts for no more.
    pub(super) follows_errors: bool,
    /// Probability of m > 1, and whether slopes that are stable mostly keep a low velocity.
    pub(super) unstable: f64,
    pub(super) keeps_little: bool,
    /// Scale of the Cauchy prior of kappa times the length of the record, where laws that nearly keep m = 1 are as likely as others;
    /// `None`: of the lesser of loading and healing over the slope, as slopes are watched.
    pub(super) curvature: Option<f64>,
    /// Probability that the scatter remembers nothing.
    pub(super) without_memory: f64,
    /// Squares of standard deviations that no rate is doubted for.
    pub(super) undoubted: f64,
}

impl Assumptions {
    /// A load that nobody declared may change, and the law with it: what the monitor uses. The drift was learnt on
    /// Lanzada 2025, whose inverse velocity bends, and is no narrower for simulated slopes that keep the law exactly.
    pub const CHANGING_LOAD: Self = Self {
        drift: 0.2,
        load_changes: true,
        drifts_before: &[0.05, 0.15, 0.4],
        from_the_first: None,
        follows_errors: false,
        unstable: UNSTABLE,
        keeps_little: true,
        curvature: None,
        without_memory: 0.0,
        undoubted: 1.0,
    };
    /// The special case of a load that never changed: the law does not drift, readings scatter about it, and nothing is taken
    /// for granted of which side of m = 1 slopes are on, how near to it, nor of what they keep.
    pub const CONSTANT_LOAD: Self = Self {
        drift: 0.0,
        load_changes: false,
        drifts_before: &[0.0, 0.05, 0.15, 0.4],
        from_the_first: Some(0.5),
        follows_errors: true,
        unstable: 0.5,
        keeps_little: false,
        curvature: Some(KAPPA_SCALE),
        without_memory: 0.4,
        undoubted: 9.0,
    };
}
