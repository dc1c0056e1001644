//! Coordinates in which every point is a law: unbounded but for a box, and regular over the record.
//!
//! With constant load the velocity only rises or only falls. Anchored at one end of the record, with
//! the direction and the branch of m fixed, the law is free in the initial slope, in ln |ln `y_s`| (`y_s`
//! the steady state, on the side where a and b have one sign) and in ln |m|. A branch with m < 1 relaxes
//! forwards in time and one with m > 1 backwards, so each is anchored where it starts to relax. Where m
//! is small the velocity has a knee, and the slope is given by the time of the knee: in the slope itself
//! the misfit is a narrow, curved valley.

use super::curve::CurveShape;
use crate::model::Law;

/// The largest m that is looked for; beyond it m > 1 is an exponential for any record.
pub(super) const HIGHEST_M: f64 = 29.0;
/// The lowest m that is looked for.
pub(super) const LOWEST_M: f64 = -20.0;
/// m itself is no nearer to 0 than this, where there is no law.
const LEAST_SIZE_OF_M: f64 = 1e-3;
/// m is no nearer to 1 than exp(1e-8) within a branch: m = 1 is a law by itself.
pub(super) const LEAST_LN_M: f64 = 1e-8;
/// |ln `x_i`| = |ln `y_s` / m| stays under this, so that `x_i` and kappa are numbers.
const MOST_LN_X: f64 = 690.0;
/// Under m = 1 it is |m| that gives way to a far steady state, but only up to here: one so far off is none.
const SMALL_M: f64 = 0.5;

/// Bounds of ln(|r| L), L the record's length.
const LN_SLOPE: (f64, f64) = (-14.0, 16.0);
/// Bounds of ln |ln `y_s`|: from a steady state that is all but reached to none.
const LN_STEADY: (f64, f64) = (-12.0, 20.0);
/// Bounds of ln(time of the knee / L).
const LN_KNEE: (f64, f64) = (-16.0, 14.0);
/// A rising y has a knee worth the name under this ln |m| and this ln `y_s`.
const KNEE_ON_RISE: (f64, f64) = (-1.0, 15.0);

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

/// What the first coordinate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Abscissa {
    /// ln(|r| L).
    Slope,
    /// ln of the time at which y, were it a straight line, would reach the steady state.
    Knee,
}

/// (slope or knee, ln |ln `y_s`|, ln |m|).
pub(super) type ChartPoint = [f64; 3];

/// One set of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Chart {
    pub(super) branch: Branch,
    pub(super) direction: Direction,
    abscissa: Abscissa,
}

/// How ln |slope| and ln(y over steady y) at the anchor change with the first two coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chain {
    pub(super) slope_by_first: f64,
    pub(super) slope_by_second: f64,
    pub(super) excess_by_second: f64,
}

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

    /// The end of the record from which its laws relax.
    pub(super) fn anchor(self) -> Anchor {
        match self {
            Self::AboveOne => Anchor::End,
            Self::BelowOne | Self::BelowZero => Anchor::Start,
        }
    }

    /// p = 1 - 1/m, without the cancellation near m = 1.
    pub(super) fn p(self, ln_m: f64) -> f64 {
        match self {
            Self::AboveOne | Self::BelowOne => -(-ln_m).exp_m1(),
            Self::BelowZero => 1.0 + (-ln_m).exp(),
        }
    }
}

impl Direction {
    /// Both.
    pub(super) const BOTH: [Self; 2] = [Self::Accelerating, Self::Decelerating];
}

impl Chart {
    /// The chart of a law with that slope, |ln `y_s`| and ln |m| at its anchor, and its point there.
    pub(super) fn locate(
        branch: Branch,
        direction: Direction,
        slope: f64,
        steady: f64,
        ln_m: f64,
    ) -> (Self, ChartPoint) {
        let has_knee = match (branch, direction) {
            (Branch::BelowOne, Direction::Accelerating) => true,
            (Branch::BelowZero, Direction::Decelerating) => {
                ln_m < KNEE_ON_RISE.0 && steady < KNEE_ON_RISE.1
            }
            _ => false,
        };
        let mut chart = Self {
            branch,
            direction,
            abscissa: Abscissa::Slope,
        };
        let mut first = slope.abs().ln();
        if has_knee {
            chart.abscissa = Abscissa::Knee;
            first = chart.rise(steady).ln() - first;
        }
        (chart, [first, steady.ln(), ln_m])
    }

    pub(super) fn anchor(self) -> Anchor {
        self.branch.anchor()
    }

    /// Whether y falls away from the anchor.
    fn y_falls(self) -> bool {
        (self.direction == Direction::Accelerating) == (self.anchor() == Anchor::Start)
    }

    /// How far y is from its steady state at the anchor.
    fn rise(self, steady: f64) -> f64 {
        if self.y_falls() {
            -(-steady).exp_m1()
        } else {
            steady.exp_m1()
        }
    }

    /// The law at a point, y = 1 at the anchor.
    pub(super) fn shape(self, at: &ChartPoint) -> CurveShape {
        let steady = at[1].exp();
        let size = match self.abscissa {
            Abscissa::Slope => at[0].exp(),
            Abscissa::Knee => self.rise(steady) * (-at[0]).exp(),
        };
        // Away from the anchor the law relaxes.
        let sign = if self.y_falls() { -1.0 } else { 1.0 };
        CurveShape {
            slope: sign * size,
            ln_steady: sign * steady,
            p: self.branch.p(at[2]),
        }
    }

    pub(super) fn chain(self, at: &ChartPoint) -> Chain {
        let steady = at[1].exp();
        let sign = if self.y_falls() { -1.0 } else { 1.0 };
        let excess_by_second = -sign * steady;
        match self.abscissa {
            Abscissa::Slope => Chain {
                slope_by_first: 1.0,
                slope_by_second: 0.0,
                excess_by_second,
            },
            Abscissa::Knee => {
                let rise = if self.y_falls() {
                    steady.exp_m1()
                } else {
                    -(-steady).exp_m1()
                };
                Chain {
                    slope_by_first: -1.0,
                    slope_by_second: steady / rise,
                    excess_by_second,
                }
            }
        }
    }

    /// Lowest and highest corner of the chart.
    pub(super) fn corners(self) -> (ChartPoint, ChartPoint) {
        let ln_m = self.branch.ln_m();
        let (first, steady) = match self.abscissa {
            Abscissa::Slope => (LN_SLOPE, LN_STEADY),
            Abscissa::Knee if self.y_falls() => (LN_KNEE, LN_STEADY),
            Abscissa::Knee => (LN_KNEE, (LN_STEADY.0, KNEE_ON_RISE.1.ln())),
        };
        ([first.0, steady.0, ln_m.0], [first.1, steady.1, ln_m.1])
    }

    /// The corners of the chart beside a point, where it ends because `x_i` does.
    pub(super) fn corners_beside(self, at: &ChartPoint) -> (ChartPoint, ChartPoint) {
        let (mut low, mut high) = self.corners();
        match self.branch {
            Branch::AboveOne => {
                let ln_m = at[2].clamp(low[2], high[2]);
                high[1] = high[1].min(MOST_LN_X.ln() + ln_m);
            }
            Branch::BelowOne | Branch::BelowZero => {
                low[2] = low[2].max((at[1] - MOST_LN_X.ln()).min(SMALL_M.ln()));
            }
        }
        (low, high)
    }

    /// The law of a shape on this chart, moved along to `ln_y`, with the velocity at its own anchor.
    pub(super) fn law(self, shape: &CurveShape, velocity: f64, length_days: f64) -> Law {
        let forwards = if self.anchor() == Anchor::Start {
            -1.0
        } else {
            1.0
        };
        let r = forwards * shape.slope / length_days;
        // b/a = y_s^p and r = b - a; whatever y_s, a and b come out with the sign of m.
        let kappa = r * shape.p / (shape.p * shape.ln_steady).exp_m1();
        let kappa = match self.branch {
            Branch::AboveOne => kappa.max(f64::MIN_POSITIVE),
            Branch::BelowOne | Branch::BelowZero => kappa.min(-f64::MIN_POSITIVE),
        };
        Law::from_fit(velocity, r, kappa, shape.p)
    }
}

/// Bounds of ln(|r| L).
pub(super) fn slope_bounds() -> (f64, f64) {
    LN_SLOPE
}
