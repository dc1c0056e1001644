//! Coordinates in which every point is a law: unbounded but for a box, and regular over the record.
//!
//! With constant load the velocity only rises or only falls. Anchored at one end of the record, with
//! the direction and the branch of m fixed, the law is free in ln |r|, in ln |ln `y_s`| (`y_s` the steady
//! state, on the side where a and b have one sign) and in ln |m|. A branch with m < 1 relaxes forwards in
//! time and one with m > 1 backwards, so each is anchored where it starts to relax; where the velocity is
//! greatest at the other end, that end makes a second chart.

use crate::model::Law;
use nalgebra::Vector3;

/// The largest m that is looked for; beyond it m > 1 is an exponential for any record.
pub(super) const HIGHEST_M: f64 = 29.0;
/// The lowest m that is looked for.
pub(super) const LOWEST_M: f64 = -20.0;
/// m itself is no nearer to 0 than this, where there is no law.
const LEAST_SIZE_OF_M: f64 = 1e-3;
/// m is no nearer to 1 than exp(1e-8) within a branch: m = 1 is a law by itself.
pub(super) const LEAST_LN_M: f64 = 1e-8;

/// Bounds of ln(|r| L), L the record's length.
const LN_SLOPE: (f64, f64) = (-14.0, 16.0);
/// Bounds of ln |ln `y_s|`: from a steady state that is all but reached to none.
const LN_STEADY: (f64, f64) = (-12.0, 20.0);

/// Where the search looks first: |r| L.
const SLOPES: [f64; 8] = [0.03, 0.2, 0.7, 2.0, 6.0, 20.0, 80.0, 400.0];
/// Where the search looks first: |ln `y_s`|.
const STEADY: [f64; 7] = [0.05, 0.3, 1.0, 3.0, 8.0, 25.0, 100.0];

/// The ranges of m that hold different laws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Branch {
    /// m > 1.
    AboveOne,
    /// 0 < m < 1.
    BelowOne,
    /// m < 0.
    BelowZero,
}

/// Which way the velocity goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// It rises.
    Accelerating,
    /// It falls.
    Decelerating,
}

/// The end of the record where y = 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// The first reading.
    Start,
    /// The last reading.
    End,
}

/// One set of coordinates (ln |r| L, ln |ln `y_s`|, ln |m|).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Chart {
    pub(super) branch: Branch,
    pub(super) direction: Direction,
    pub(super) anchor: Anchor,
}

const fn chart(branch: Branch, direction: Direction, anchor: Anchor) -> Chart {
    Chart {
        branch,
        direction,
        anchor,
    }
}

/// Every law with m other than 1 stands on one of these.
pub(super) const CHARTS: [Chart; 8] = [
    chart(Branch::AboveOne, Direction::Accelerating, Anchor::End),
    chart(Branch::AboveOne, Direction::Decelerating, Anchor::End),
    chart(Branch::AboveOne, Direction::Decelerating, Anchor::Start),
    chart(Branch::BelowOne, Direction::Accelerating, Anchor::Start),
    chart(Branch::BelowOne, Direction::Accelerating, Anchor::End),
    chart(Branch::BelowOne, Direction::Decelerating, Anchor::Start),
    chart(Branch::BelowZero, Direction::Accelerating, Anchor::Start),
    chart(Branch::BelowZero, Direction::Decelerating, Anchor::Start),
];

impl Branch {
    /// The branch of m; `None` where m is 0 or 1.
    pub(super) fn of(m: f64) -> Option<Self> {
        match m {
            m if m > 1.0 => Some(Self::AboveOne),
            m if m > 0.0 && m < 1.0 => Some(Self::BelowOne),
            m if m < 0.0 => Some(Self::BelowZero),
            _ => None,
        }
    }

    /// Bounds of ln |m|.
    pub(super) fn ln_m(self) -> (f64, f64) {
        match self {
            Self::AboveOne => (LEAST_LN_M, HIGHEST_M.ln()),
            Self::BelowOne => (LEAST_SIZE_OF_M.ln(), -LEAST_LN_M),
            Self::BelowZero => (LEAST_SIZE_OF_M.ln(), (-LOWEST_M).ln()),
        }
    }

    /// The m's where the search looks first.
    pub(super) fn grid(self) -> [f64; 5] {
        match self {
            Self::AboveOne => [1.05, 1.35, 2.0, 5.0, 20.0],
            Self::BelowOne => [0.95, 0.6, 0.25, 0.08, 0.02],
            Self::BelowZero => [-12.0, -2.0, -0.6, -0.15, -0.02],
        }
    }

    /// p = 1 - 1/m, without the cancellation near m = 1.
    fn p(self, ln_m: f64) -> f64 {
        match self {
            Self::AboveOne | Self::BelowOne => -(-ln_m).exp_m1(),
            Self::BelowZero => 1.0 + (-ln_m).exp(),
        }
    }
}

impl Chart {
    /// The law at a point, y = 1 and velocity 1 at the anchor; `length` is the record's, days.
    pub(super) fn law(self, at: &Vector3<f64>, length: f64) -> Law {
        let p = self.branch.p(at[2]);
        let r = self.direction.signed(at[0].exp() / length);
        // b/a = y_s^p and r = b - a; whatever y_s, a and b come out with the sign of m.
        let kappa = r * p / (p * self.steady_side() * at[1].exp()).exp_m1();
        Law::from_fit(1.0, r, kappa, p)
    }

    /// The sign of ln `y_s`: m < 1 goes to the steady velocity, m > 1 comes from it.
    fn steady_side(self) -> f64 {
        let comes_from_it = self.branch == Branch::AboveOne;
        if comes_from_it == (self.direction == Direction::Accelerating) {
            1.0
        } else {
            -1.0
        }
    }

    /// Lowest and highest corner of the chart.
    pub(super) fn corners(self) -> (Vector3<f64>, Vector3<f64>) {
        let ln_m = self.branch.ln_m();
        (
            Vector3::new(LN_SLOPE.0, LN_STEADY.0, ln_m.0),
            Vector3::new(LN_SLOPE.1, LN_STEADY.1, ln_m.1),
        )
    }

    /// The points of one m where the search looks first.
    pub(super) fn points(ln_m: f64) -> impl Iterator<Item = Vector3<f64>> {
        SLOPES.into_iter().flat_map(move |slope| {
            STEADY
                .into_iter()
                .map(move |steady| Vector3::new(slope.ln(), steady.ln(), ln_m))
        })
    }
}

impl Direction {
    /// r of that size in this direction.
    pub(super) fn signed(self, slope: f64) -> f64 {
        match self {
            Self::Accelerating => slope,
            Self::Decelerating => -slope,
        }
    }
}

/// The law at m = 1, velocity 1 at the anchor, from ln(|r| L).
pub(super) fn law_at_unit_m(direction: Direction, ln_slope: f64, length: f64) -> Law {
    Law::from_fit(1.0, direction.signed(ln_slope.exp() / length), 0.0, 0.0)
}

/// Where the search for m = 1 starts, and its bounds: ln(|r| L).
pub(super) fn unit_m_starts() -> impl Iterator<Item = f64> {
    SLOPES.into_iter().map(f64::ln)
}

/// Bounds of ln(|r| L).
pub(super) fn slope_bounds() -> (f64, f64) {
    LN_SLOPE
}
