//! Laws between those of the table: the coordinates that they are drawn in, and their prior.
//!
//! | what | prior |
//! |---|---|
//! | p | even on either side of 0, m from 0.5 to 2.5 |
//! | slope r | as in the table of laws: either sign alike, nearly even in ln r |
//! | the lesser of loading and healing over r, where the load may change | log-logistic about 1 |
//! | or kappa times the length of the record, where it may not | Cauchy |
//! | scatter of a reading, and standard deviation of what remembers | log-normal; the latter 0 with a probability of its own |
//! | its memory | even in its log from one sampling interval to the length of the record |
//! | what of the variance of a difference of readings is the readings' and not the motion's | even |

use super::Cell;
use super::assumptions::Assumptions;
use super::gains::{LoadNoise, RateRecord};
use super::past::PastShape;
use super::prior::{P_PRIOR, SlopePrior, above_kept};
use crate::model::Law;
use crate::reading::upper_median;
use nalgebra::SVector;
use rand::RngExt;
use rand_pcg::Pcg64;

/// p; ln of the lesser of loading and healing or, where that has the prior, of |kappa|, 1/day; ln of 1 + |r| over the lowest of the table, with the sign of r; ln of the scatter, of the
/// standard deviation of what remembers, and of its memory in days; the readings' share of a difference's variance. Laws that hardly accelerate are next to those that hardly
/// slow down, and m a little above 1 next to m a little below.
pub(super) type Point = SVector<f64, 7>;

/// Where each of them stands in a [`Point`].
pub(super) const P: usize = 0;
pub(super) const CURVATURE: usize = 1;
pub(super) const SLOPE: usize = 2;
pub(super) const SCATTER: usize = 3;
const SIGMA: usize = 4;
const MEMORY: usize = 5;
const SHARED: usize = 6;

/// Scale of the logistic prior of ln of the lesser of loading and healing over the slope.
const RATIO_SCALE: f64 = 1.2;
/// Medians of the scatter and of the standard deviation of what remembers, and the standard deviation of the log of either.
const SCATTER_PRIOR: (f64, f64) = (0.03, 1.0);
const SIGMA_PRIOR: (f64, f64) = (0.04, 1.0);
/// How far from a law of the table laws are looked for, in p and in the logarithms of the others.
const AROUND: (f64, f64) = (0.25, 0.7);

/// Where the coordinate of what remembers lies below the first of these standard deviations under its median, nothing remembers; the
/// second is how far that goes.
const NOTHING_REMEMBERS: (f64, f64) = (3.0, 3.0);

/// Where points lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct Space {
    slope: SlopePrior,
    assumed: Assumptions,
    /// ln of the shortest and of the longest memory, days.
    memories: (f64, f64),
    /// Days from the first reading to the last.
    length: f64,
}

/// A law but for its velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct DrawnShape {
    pub(super) past: PastShape,
    /// Loading and healing, 1/day.
    b: f64,
    c: f64,
}

/// ln of the density of a logistic number about 0.
fn ln_logistic(value: f64, scale: f64) -> f64 {
    let z = value.abs() / scale;
    -z - 2.0 * (-z).exp().ln_1p() - scale.ln()
}

impl Space {
    pub(super) fn new(slope: SlopePrior, record: &RateRecord) -> Self {
        let length = record.from[0];
        let mut spacings: Vec<f64> = record.to.windows(2).map(|two| two[0] - two[1]).collect();
        let spacing = upper_median(&mut spacings);
        let shortest = spacing.unwrap_or(length).clamp(1e-6 * length, 0.5 * length);
        Self {
            slope,
            assumed: record.assumed,
            memories: (shortest.ln(), length.ln()),
            length,
        }
    }

    pub(super) fn shape(&self, at: &Point) -> DrawnShape {
        let r = self.size(at).copysign(at[SLOPE]);
        let c = if self.assumed.curvature.is_some() {
            at[CURVATURE].exp() / at[P].abs().max(1e-12)
        } else {
            at[CURVATURE].exp() + (-r).max(0.0)
        };
        let b = c + r;
        DrawnShape {
            past: PastShape {
                r,
                kappa: at[P] * c,
                p: at[P],
            },
            b,
            c,
        }
    }

    /// |r|, which goes to 0: a slope that has come to its steady velocity has less than the table's lowest.
    fn size(&self, at: &Point) -> f64 {
        self.slope.lowest * at[SLOPE].abs().exp_m1()
    }

    pub(super) fn noise(&self, at: &Point) -> LoadNoise {
        LoadNoise {
            scatter: at[SCATTER].exp(),
            sigma: if self.remembers(at) {
                at[SIGMA].exp()
            } else {
                0.0
            },
            tau: at[MEMORY].exp(),
            shared: at[SHARED],
            ln_evidence: 0.0,
        }
    }

    /// Whether anything remembers in the scatter.
    fn remembers(&self, at: &Point) -> bool {
        let (median, spread) = SIGMA_PRIOR;
        self.assumed.without_memory == 0.0 || at[SIGMA] > median.ln() - NOTHING_REMEMBERS.0 * spread
    }

    /// ln of the prior density of what remembers.
    fn ln_prior_of_memory(&self, at: &Point) -> f64 {
        let (median, spread) = SIGMA_PRIOR;
        let z = (at[SIGMA] - median.ln()) / spread;
        let without = self.assumed.without_memory;
        if self.remembers(at) {
            return (1.0 - without).ln() - 0.5 * z * z;
        }
        let (from, width) = NOTHING_REMEMBERS;
        if z < -from - width {
            return f64::NEG_INFINITY;
        }
        // The density that has the same whole as the normal one above it.
        (without * std::f64::consts::TAU.sqrt() / width).ln()
    }

    /// ln of the prior density of the curvature.
    fn ln_prior_of_curvature(&self, at: &Point, size: f64) -> f64 {
        let Some(scale) = self.assumed.curvature else {
            return ln_logistic(at[CURVATURE] - size.ln(), RATIO_SCALE);
        };
        let kappa = at[CURVATURE].exp() * self.length;
        // A slope whose loading would be negative is none.
        if self.shape(at).b > 0.0 {
            at[CURVATURE] - (kappa / scale).powi(2).ln_1p()
        } else {
            f64::NEG_INFINITY
        }
    }

    /// ln of the prior density, but for what a stable slope keeps; minus infinity outside of the range.
    pub(super) fn ln_prior(&self, at: &Point) -> f64 {
        let size = self.size(at).max(self.slope.lowest);
        let (shortest, longest) = self.memories;
        let is_inside = at[P] > P_PRIOR.0
            && at[P] < P_PRIOR.1
            && size <= self.slope.highest
            && (shortest..=longest).contains(&at[MEMORY])
            && (0.0..=1.0).contains(&at[SHARED]);
        if !is_inside {
            return f64::NEG_INFINITY;
        }
        let of_p = if at[P] > 0.0 {
            self.assumed.unstable / P_PRIOR.1
        } else {
            (1.0 - self.assumed.unstable) / -P_PRIOR.0
        };
        let of_curvature = self.ln_prior_of_curvature(at, size);
        let normal = |value: f64, (median, spread): (f64, f64)| {
            let z = (value - median.ln()) / spread;
            -0.5 * z * z
        };
        self.slope.ln_prior(of_p.ln() + of_curvature, size, None)
            + normal(at[SCATTER], SCATTER_PRIOR)
            + self.ln_prior_of_memory(at)
    }

    /// ln of the prior of what the law of that shape will keep, ln of whose velocity (mm/day) that is.
    pub(super) fn ln_prior_of_kept(&self, shape: &DrawnShape, ln_velocity: f64) -> f64 {
        let p = shape.past.p;
        if !(self.assumed.keeps_little && p < 0.0 && shape.b > shape.c) {
            return 0.0;
        }
        let above = above_kept(ln_velocity - (shape.b / shape.c).ln() / p);
        -0.5 * above * above
    }

    /// A law of the table as a point.
    pub(super) fn at(&self, cell: &Cell) -> Point {
        self.moved(cell, |_| 0.0)
    }

    /// A point about a law of the table.
    pub(super) fn near(&self, cell: &Cell, generator: &mut Pcg64) -> Point {
        self.moved(cell, |width| {
            width * (2.0 * generator.random::<f64>() - 1.0)
        })
    }

    /// A law of today whose readings scatter by so much, of which nothing remembers where that may be; `None` where the coordinates
    /// have no place for it.
    pub(super) fn of_law(&self, law: &Law, scatter: f64) -> Option<Point> {
        let p = law.p.clamp(P_PRIOR.0 + 1e-3, P_PRIOR.1 - 1e-3);
        let curvature = if self.assumed.curvature.is_some() {
            law.kappa.abs().max(1e-6 / self.length)
        } else {
            law.a.min(law.b)
        };
        let (shortest, longest) = self.memories;
        let at = Point::from([
            p,
            curvature.ln(),
            (law.r.abs() / self.slope.lowest).ln_1p().copysign(law.r),
            scatter.ln(),
            SIGMA_PRIOR.0.ln() - (NOTHING_REMEMBERS.0 + 0.5 * NOTHING_REMEMBERS.1) * SIGMA_PRIOR.1,
            f64::midpoint(shortest, longest),
            0.5,
        ]);
        let is_of_one_side = law.kappa * p >= 0.0;
        (is_of_one_side && self.ln_prior(&at).is_finite()).then_some(at)
    }

    /// The same law under any memory of the scatter that may be.
    pub(super) fn with_any_memory(&self, at: &Point, generator: &mut Pcg64) -> Point {
        let mut with = *at;
        let (shortest, longest) = self.memories;
        with[SIGMA] = SIGMA_PRIOR.0.ln() - NOTHING_REMEMBERS.0 * generator.random::<f64>();
        with[MEMORY] = shortest + (longest - shortest) * generator.random::<f64>();
        with[SHARED] = generator.random::<f64>();
        with
    }

    /// The same law where nothing remembers, if that may be.
    pub(super) fn without_memory(&self, at: &Point, generator: &mut Pcg64) -> Point {
        let mut without = *at;
        if self.assumed.without_memory > 0.0 {
            let ((median, spread), (from, width)) = (SIGMA_PRIOR, NOTHING_REMEMBERS);
            let below = from + width * generator.random::<f64>();
            without[SIGMA] = median.ln() - below * spread;
        }
        without
    }

    /// A law of the table, each coordinate moved by what `spread` gives for a width.
    fn moved(&self, cell: &Cell, mut spread: impl FnMut(f64) -> f64) -> Point {
        let shape = cell.shape();
        let (p_around, ln_around) = AROUND;
        let p = (shape.p + spread(p_around)).clamp(P_PRIOR.0 + 1e-3, P_PRIOR.1 - 1e-3);
        let (r, _) = shape.slope_and_curvature(cell.r);
        let slope = (cell.r / self.slope.lowest).ln_1p() + spread(0.3 * ln_around);
        let lesser = (shape.lesser() * cell.r).ln() + spread(ln_around);
        let curvature = if self.assumed.curvature.is_some() {
            let healing = lesser.exp() + (-cell.r.copysign(r)).max(0.0);
            (healing * p.abs().max(1e-6)).ln()
        } else {
            lesser
        };
        let (shortest, longest) = self.memories;
        let memory = cell.tau.ln() + spread(ln_around);
        Point::from([
            p,
            curvature,
            slope.max(1e-6).copysign(r),
            cell.scatter.ln() + spread(ln_around),
            cell.sigma.ln() + spread(ln_around) - ln_around,
            memory.clamp(shortest, longest),
            0.5 + spread(0.5),
        ])
    }
}
