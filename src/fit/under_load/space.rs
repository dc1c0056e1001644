//! Laws between those of the table: the coordinates that they are drawn in, and their prior.
//!
//! | what | prior |
//! |---|---|
//! | p | even on either side of 0, m from 0.5 to 2.5 |
//! | slope r | as in the table of laws: either sign alike, nearly even in ln r |
//! | the lesser of loading and healing over r | log-logistic about 1 |
//! | scatter of a reading, and standard deviation of what remembers | log-normal |
//! | its memory | even in its log from one sampling interval to the length of the record |
//! | what of the variance of a difference of readings is the readings' and not the motion's | even |

use super::Cell;
use super::assumptions::Assumptions;
use super::gains::{LoadNoise, RateRecord};
use super::past::PastShape;
use super::prior::{P_PRIOR, SlopePrior, above_kept};
use nalgebra::SVector;
use rand::RngExt;
use rand_pcg::Pcg64;

/// p; ln of the lesser of loading and healing, 1/day; ln of |r| over the lowest, with the sign of r; ln of the scatter, of the
/// standard deviation of what remembers, and of its memory in days; the readings' share of a difference's variance. Laws that hardly accelerate are next to those that hardly
/// slow down, and m a little above 1 next to m a little below.
pub(super) type Point = SVector<f64, 7>;

const P: usize = 0;
const LESSER: usize = 1;
const SLOPE: usize = 2;
const SCATTER: usize = 3;
const SIGMA: usize = 4;
const MEMORY: usize = 5;
const SHARED: usize = 6;

/// Scale of the logistic prior of ln of the lesser of loading and healing over the slope.
pub(super) const RATIO_SCALE: f64 = 1.2;
/// Medians of the scatter and of the standard deviation of what remembers, and the standard deviation of the log of either.
const SCATTER_PRIOR: (f64, f64) = (0.03, 1.0);
const SIGMA_PRIOR: (f64, f64) = (0.04, 1.0);
/// How far from a law of the table laws are looked for, in p and in the logarithms of the others.
const AROUND: (f64, f64) = (0.25, 0.7);

/// Where points lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct Space {
    slope: SlopePrior,
    assumed: Assumptions,
    /// ln of the shortest and of the longest memory, days.
    memories: (f64, f64),
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
pub(super) fn ln_logistic(value: f64, scale: f64) -> f64 {
    let z = value.abs() / scale;
    -z - 2.0 * (-z).exp().ln_1p() - scale.ln()
}

impl Space {
    pub(super) fn new(slope: SlopePrior, record: &RateRecord) -> Self {
        let length = record.from[0];
        let mut spacings: Vec<f64> = record.to.windows(2).map(|two| two[0] - two[1]).collect();
        spacings.sort_by(f64::total_cmp);
        let spacing = spacings.get(spacings.len() / 2).copied();
        let shortest = spacing.unwrap_or(length).clamp(1e-6 * length, 0.5 * length);
        Self {
            slope,
            assumed: record.assumed,
            memories: (shortest.ln(), length.ln()),
        }
    }

    pub(super) fn shape(&self, at: &Point) -> DrawnShape {
        let size = self.slope.lowest * at[SLOPE].abs().exp();
        let lesser = at[LESSER].exp();
        let (b, c) = if at[SLOPE] > 0.0 {
            (lesser + size, lesser)
        } else {
            (lesser, lesser + size)
        };
        DrawnShape {
            past: PastShape {
                r: size.copysign(at[SLOPE]),
                kappa: at[P] * c,
                p: at[P],
            },
            b,
            c,
        }
    }

    pub(super) fn noise(at: &Point) -> LoadNoise {
        LoadNoise {
            scatter: at[SCATTER].exp(),
            sigma: at[SIGMA].exp(),
            tau: at[MEMORY].exp(),
            shared: at[SHARED],
            ln_evidence: 0.0,
        }
    }

    /// ln of the prior density, but for what a stable slope keeps; minus infinity outside of the range.
    pub(super) fn ln_prior(&self, at: &Point) -> f64 {
        let size = self.slope.lowest * at[SLOPE].abs().exp();
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
        let of_ratio = ln_logistic(at[LESSER] - size.ln(), RATIO_SCALE);
        let normal = |value: f64, (median, spread): (f64, f64)| {
            let z = (value - median.ln()) / spread;
            -0.5 * z * z
        };
        self.slope.ln_prior(of_p.ln() + of_ratio, size, None)
            + normal(at[SCATTER], SCATTER_PRIOR)
            + normal(at[SIGMA], SIGMA_PRIOR)
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

    /// A point about a law of the table.
    pub(super) fn near(&self, cell: &Cell, generator: &mut Pcg64) -> Point {
        let mut spread = |width: f64| width * (2.0 * generator.random::<f64>() - 1.0);
        let shape = cell.shape();
        let (p_around, ln_around) = AROUND;
        let p = (shape.p + spread(p_around)).clamp(P_PRIOR.0 + 1e-3, P_PRIOR.1 - 1e-3);
        let (r, _) = shape.slope_and_curvature(cell.r);
        let slope = (cell.r / self.slope.lowest).ln() + spread(0.3 * ln_around);
        let (shortest, longest) = self.memories;
        let memory = cell.tau.ln() + spread(ln_around);
        Point::from([
            p,
            (shape.lesser() * cell.r).ln() + spread(ln_around),
            slope.max(1e-6).copysign(r),
            cell.scatter.ln() + spread(ln_around),
            cell.sigma.ln() + spread(ln_around) - ln_around,
            memory.clamp(shortest, longest),
            0.5 + spread(0.5),
        ])
    }
}
