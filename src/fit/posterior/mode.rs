//! Where a posterior is highest on one side of kappa = 0, and how it falls off there.

use super::past::{PastShape, PastSolution};
use super::prior::{P_PRIOR, log_cauchy};
use super::scatter::Texture;
use super::window::Window;
use crate::fit::damped::{Damping, Descendable, DescentEnd, StepOutcome, descend};
use crate::fit::newest_slope::SLOPE_PER_INTERVAL;
use nalgebra::{Matrix4, Vector4};

/// The coordinates of every search and draw: p; asinh of kappa L; asinh of the change of ln y over the
/// window as if it were small, which is r L for small kappa L and r / kappa for a large one (there the
/// readings know the change, and r hardly); ln of the present velocity.
pub(super) type Point = Vector4<f64>;

/// Places in a [`Point`].
pub(super) const P: usize = 0;
pub(super) const KAPPA: usize = 1;
pub(super) const CHANGE: usize = 2;
pub(super) const LN_V: usize = 3;

/// Which sign kappa has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    Positive,
    Negative,
}

/// The laws with one sign of kappa that hold for `span_days` back from the present of a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct ModeProblem<'a> {
    pub(super) window: &'a Window,
    pub(super) span_days: f64,
    pub(super) sign: Sign,
    /// Half the width, in ln, of the range that the span stands for.
    pub(super) span_reach: f64,
    /// ln of the prior probability of that range.
    pub(super) log_prior: f64,
}

/// Buffers that every evaluation uses again.
#[derive(Debug)]
pub(super) struct ModeBench {
    past: PastSolution,
    pub(super) residuals: Vec<f64>,
    there: Vec<f64>,
    pub(super) columns: [Vec<f64>; 4],
    pub(super) evaluations: usize,
}

/// The most probable point for one texture and size of the scatter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    pub(super) at: Point,
    pub(super) cost: f64,
}

/// Step of a derivative by differences: far above the rounding, far below the scale of a coordinate, which is 1.
const JACOBIAN_STEP: f64 = 1e-4;
/// The longest step that a search may take in one coordinate.
const LONGEST_STEP: f64 = 1.5;
const DAMPING: Damping = Damping {
    tighten: 8.0,
    least_tightened: 1e-3,
    least: 1e-9,
    most: 1e7,
    ..Damping::PLAIN
};
/// A gain of less in ln probability is none.
const LEAST_GAIN: f64 = 5e-3;
/// Below this kappa L the coordinate of change is no longer corrected for kappa.
const LEAST_CORRECTED: f64 = -2.0;
/// The prior confines no coordinate less than this, as steps see it.
const LEAST_BEND: f64 = 0.05;

impl Sign {
    pub(super) const BOTH: [Self; 2] = [Self::Positive, Self::Negative];

    /// Where p may be.
    pub(super) fn p_range(self) -> (f64, f64) {
        match self {
            Self::Positive => (0.0, P_PRIOR.1),
            Self::Negative => (P_PRIOR.0, 0.0),
        }
    }

    /// Where asinh of kappa L may be.
    pub(super) fn kappa_range(self) -> (f64, f64) {
        match self {
            Self::Positive => (1e-9, 12.0),
            Self::Negative => (-12.0, -1e-9),
        }
    }
}

impl ModeBench {
    pub(super) fn new(count: usize) -> Self {
        Self {
            past: PastSolution::default(),
            residuals: vec![0.0; count],
            there: vec![0.0; count],
            columns: [(); 4].map(|()| vec![0.0; count]),
            evaluations: 0,
        }
    }
}

/// (1 - exp(-z)) / z: the change over the window for r L = 1 and a kappa L of z.
fn change_per_slope(kappa_length: f64) -> f64 {
    let z = kappa_length.max(LEAST_CORRECTED);
    if z.abs() < 1e-6 {
        1.0 - 0.5 * z
    } else {
        -(-z).exp_m1() / z
    }
}

impl ModeProblem<'_> {
    /// The point of a law of this shape and velocity now.
    pub(super) fn point(&self, shape: PastShape, ln_v: f64) -> Point {
        let kappa_length = shape.kappa * self.span_days;
        let change = shape.r * self.span_days * change_per_slope(kappa_length);
        Point::new(shape.p, kappa_length.asinh(), change.asinh(), ln_v)
    }

    pub(super) fn shape(&self, at: &Point) -> PastShape {
        let kappa_length = at[KAPPA].sinh();
        let r_length = at[CHANGE].sinh() / change_per_slope(kappa_length);
        PastShape {
            r: r_length / self.span_days,
            kappa: kappa_length / self.span_days,
            p: at[P],
        }
    }

    /// Fills the bench's residuals; false outside the prior's range.
    pub(super) fn evaluate(&self, bench: &mut ModeBench, at: &Point) -> bool {
        self.evaluate_over(bench, at, self.span_days)
    }

    /// The same, where the law of that point has held for another span.
    pub(super) fn evaluate_over(&self, bench: &mut ModeBench, at: &Point, span_days: f64) -> bool {
        bench.evaluations += 1;
        let shape = self.shape(at);
        // b and m have one sign: where the law would need S < 0 there is none.
        let b_over_m = shape.kappa + shape.p * shape.r;
        let exists = match self.sign {
            Sign::Positive => b_over_m > 0.0,
            Sign::Negative => b_over_m < 0.0,
        };
        let (past, out) = (&mut bench.past, &mut bench.residuals);
        exists && (self.window).residuals(past, at[LN_V], shape, span_days, out)
    }

    /// ln of the prior density at a point.
    pub(super) fn prior(&self, at: &Point) -> f64 {
        self.prior_over(at, 0.0)
    }

    /// The same, where the law of that point has held for exp(`reach`) times the span: r and kappa are what
    /// they were, and larger in units of it.
    pub(super) fn prior_over(&self, at: &Point, reach: f64) -> f64 {
        let kappa_length = at[KAPPA].sinh();
        let per_slope = change_per_slope(kappa_length);
        let r_length = at[CHANGE].sinh() / per_slope;
        let outrun = r_length * self.window.interval_days / (self.span_days * SLOPE_PER_INTERVAL);
        let of_r =
            log_cauchy(r_length * reach.exp()) + at[CHANGE].cosh().ln() - per_slope.ln() + reach;
        let of_kappa = log_cauchy(kappa_length * reach.exp()) + at[KAPPA].cosh().ln() + reach;
        of_r + of_kappa - 0.5 * outrun * outrun
    }

    /// Slope of the prior, and how sharply it confines each coordinate: positive, as a step needs it.
    pub(super) fn prior_slope(&self, at: &Point) -> (Point, Point) {
        let step = 1e-3;
        let here = self.prior(at);
        let (mut slope, mut bend) = (Point::zeros(), Point::repeat(LEAST_BEND));
        for axis in [KAPPA, CHANGE] {
            let moved = |by: f64| {
                let mut there = *at;
                there[axis] += by;
                self.prior(&there)
            };
            let (less, more) = (moved(-step), moved(step));
            slope[axis] = (more - less) / (2.0 * step);
            bend[axis] = bend[axis].max((2.0 * here - more - less) / (step * step));
        }
        bend[P] = 1.0;
        bend[LN_V] = 0.0;
        (slope, bend)
    }

    /// Derivatives of the residuals, which the bench holds for `at`.
    fn differentiate(&self, bench: &mut ModeBench, at: &Point) {
        for axis in 0..4 {
            let mut taken = 0.0;
            for step in [JACOBIAN_STEP, -JACOBIAN_STEP] {
                let mut moved = *at;
                moved[axis] += step;
                bench.evaluations += 1;
                let shape = self.shape(&moved);
                let (past, out) = (&mut bench.past, &mut bench.there);
                if (self.window).residuals(past, moved[LN_V], shape, self.span_days, out) {
                    taken = step;
                    break;
                }
            }
            let pairs = bench.there.iter().zip(&bench.residuals);
            for (slot, (moved, here)) in bench.columns[axis].iter_mut().zip(pairs) {
                *slot = if taken == 0.0 {
                    0.0
                } else {
                    (moved - here) / taken
                };
            }
        }
    }

    fn clamp(&self, mut at: Point) -> Point {
        let (low, high) = self.sign.p_range();
        at[P] = at[P].clamp(low, high);
        let (low, high) = self.sign.kappa_range();
        at[KAPPA] = at[KAPPA].clamp(low, high);
        at
    }

    /// What is made least: -ln of the posterior's density.
    fn cost(&self, texture: &Texture, residuals: &[f64], at: &Point, size: f64) -> f64 {
        -texture.log_likelihood(self.window, residuals, size) - self.prior(at)
    }

    /// Levenberg-Marquardt from `start`, at most `rounds` steps; the bench is left with the residuals at the
    /// mode and their derivatives there or a small step before. `None` where the start lies outside the
    /// prior's range.
    pub(super) fn search(
        &self,
        bench: &mut ModeBench,
        start: Point,
        texture: &Texture,
        size: f64,
        rounds: usize,
    ) -> Option<Mode> {
        let at = self.clamp(start);
        if !self.evaluate(bench, &at) {
            return None;
        }
        let mut climb = Uphill {
            problem: self,
            texture,
            size,
            at,
            cost: self.cost(texture, &bench.residuals, &at, size),
            here: bench.residuals.clone(),
            normal: Matrix4::zeros(),
            slope: Point::zeros(),
            bench,
        };
        let end = descend(&mut climb, &DAMPING, rounds);
        climb.bench.residuals.copy_from_slice(&climb.here);
        if end == DescentEnd::OutOfRounds {
            self.differentiate(climb.bench, &climb.at);
        }
        let Uphill { at, cost, .. } = climb;
        cost.is_finite().then_some(Mode { at, cost })
    }
}

/// A search for a mode under way.
struct Uphill<'a> {
    problem: &'a ModeProblem<'a>,
    texture: &'a Texture,
    size: f64,
    bench: &'a mut ModeBench,
    at: Point,
    cost: f64,
    /// The residuals at that point.
    here: Vec<f64>,
    /// What a step is found from.
    normal: Matrix4<f64>,
    slope: Point,
}

impl Descendable for Uphill<'_> {
    fn linearise(&mut self) -> bool {
        self.bench.residuals.copy_from_slice(&self.here);
        self.problem.differentiate(self.bench, &self.at);
        let (window, columns) = (self.problem.window, &self.bench.columns);
        let moments = self.texture.normal(window, &self.here, columns, self.size);
        let (slope, bend) = self.problem.prior_slope(&self.at);
        self.normal = moments.information + Matrix4::from_diagonal(&bend);
        self.slope = slope - moments.gradient;
        true
    }

    fn step(&mut self, damping: f64) -> StepOutcome {
        let mut matrix = self.normal;
        for axis in 0..4 {
            matrix[(axis, axis)] *= 1.0 + damping;
        }
        let step = matrix.cholesky();
        let step = step.map_or_else(Point::zeros, |root| root.solve(&self.slope));
        let there = self.at + step.map(|one| one.clamp(-LONGEST_STEP, LONGEST_STEP));
        let there = self.problem.clamp(there);
        if !self.problem.evaluate(self.bench, &there) {
            return StepOutcome::NoGain;
        }
        let residuals = &self.bench.residuals;
        let cost = (self.problem).cost(self.texture, residuals, &there, self.size);
        if cost < self.cost {
            let gain = self.cost - cost;
            (self.at, self.cost) = (there, cost);
            self.here.copy_from_slice(&self.bench.residuals);
            return StepOutcome::Gained { gain, ease: 0.1 };
        }
        StepOutcome::NoGain
    }

    fn goes_on(&self, gain: f64) -> bool {
        gain >= LEAST_GAIN
    }
}
