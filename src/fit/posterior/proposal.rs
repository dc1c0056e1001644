//! Where to draw laws from: normal approximations about the mode on either side of kappa = 0, one for each
//! texture of the scatter, each ending where p or kappa leaves its range.

use super::Draft;
use super::mode::{CHANGE, KAPPA, LN_V, ModeBench, ModeProblem, P, Point, Sign};
use super::prior;
use super::scatter::Texture;
use crate::fit::quasi_random::{kronecker, normal_quantile, normal_share};
use crate::model::Law;
use nalgebra::{Matrix4, SMatrix, SVector};

/// A [`Point`] and ln of the size of the scatter.
pub(super) type Whole = SVector<f64, 5>;
type Root = SMatrix<f64, 5, 5>;

/// Place of ln of the size in a [`Whole`].
const SIZE: usize = 4;

/// Widths of the proposal, over the approximation's own, and the share of each.
const WIDTHS: [(f64, f64); 2] = [(1.15, 0.75), (3.0, 0.25)];
/// The share of draws that go to all textures evenly, whatever their evidence.
const EVEN: f64 = 0.1;
/// Draws that weights must be worth for a shape to be estimated from them.
const WORTH: f64 = 20.0;
/// Draws that say nothing of a shape if they are worth fewer.
const LEAST_WORTH: f64 = 8.0;
/// The share of the old shape that the new one keeps.
const RIDGE: f64 = 0.03;
/// The least probability that a range is given: far beyond it numbers end.
const LEAST_MASS: f64 = 1e-250;
/// ln of the square root of 2 pi.
const LN_ROOT_2_PI: f64 = 0.918_938_533_204_672_8;

/// The laws on one side of kappa = 0.
#[derive(Debug, Clone)]
pub(super) struct Side<'a> {
    pub(super) problem: ModeProblem<'a>,
    components: Vec<Component>,
    /// Where in the range of the span draws are made, in units of its reach.
    spans: (f64, f64),
    /// ln of the evidence, by the approximations.
    pub(super) log_evidence: f64,
}

/// The approximation for one texture.
#[derive(Debug, Clone, Copy)]
struct Component {
    centre: Whole,
    root: Root,
    log_evidence: f64,
    share: f64,
}

/// A range of a standard normal number, and the probability of it.
#[derive(Debug, Clone, Copy)]
struct NormalStretch {
    low: f64,
    high: f64,
    mass: f64,
}

impl NormalStretch {
    fn new((low, high): (f64, f64), mean: f64, spread: f64) -> Self {
        let (low, high) = ((low - mean) / spread, (high - mean) / spread);
        // In the tail where the numbers are small: shares near 1 have no digits left.
        let mass = if low > 0.0 {
            normal_share(-low) - normal_share(-high)
        } else {
            normal_share(high) - normal_share(low)
        };
        Self {
            low,
            high,
            mass: mass.max(LEAST_MASS),
        }
    }

    /// The number below which the share `u` of the stretch lies.
    fn quantile(&self, u: f64) -> f64 {
        let z = if self.low > 0.0 {
            -normal_quantile((normal_share(-self.low) - u * self.mass).clamp(1e-290, 1.0))
        } else {
            normal_quantile((normal_share(self.low) + u * self.mass).clamp(1e-290, 1.0 - 1e-16))
        };
        z.clamp(self.low, self.high)
    }
}

impl<'a> Side<'a> {
    /// The approximations about the mode at `at`, whose residuals and derivatives the bench holds.
    pub(super) fn new(
        problem: ModeProblem<'a>,
        bench: &ModeBench,
        at: Point,
        textures: &[Texture],
        log_size: f64,
    ) -> Option<Self> {
        let mut size = log_size;
        let mut components = Vec::with_capacity(textures.len());
        for texture in textures {
            let one = Component::new(&problem, bench, at, texture, size)?;
            size = one.centre[SIZE];
            components.push(one);
        }
        let logs: Vec<f64> = components.iter().map(|one| one.log_evidence).collect();
        let log_evidence = log_sum(&logs);
        let even = EVEN / logs.len() as f64;
        for component in &mut components {
            component.share = even + (1.0 - EVEN) * (component.log_evidence - log_evidence).exp();
        }
        log_evidence.is_finite().then_some(Self {
            problem,
            components,
            spans: (-1.0, 1.0),
            log_evidence,
        })
    }

    /// The `index`-th law; `None` where the prior has none.
    pub(super) fn draw(
        &self,
        bench: &mut ModeBench,
        textures: &[Texture],
        index: u32,
    ) -> Option<Draft> {
        let problem = &self.problem;
        let u = kronecker(index);
        let (chosen, component) = self.pick(u[1])?;
        let (width, _) = WIDTHS[usize::from(u[6] >= WIDTHS[0].1)];
        let z = component.deviate(problem.sign, width, &u);
        let whole = component.centre + component.root * z;
        let at: Point = whole.fixed_rows::<4>(0).into_owned();
        let log_size = whole[SIZE];
        let shape = problem.shape(&at);
        let law = Law::from_fit(at[LN_V].exp(), shape.r, shape.kappa, shape.p);
        let along = self.spans.0 + (self.spans.1 - self.spans.0) * u[7];
        let reach = problem.span_reach * along;
        let span_days = problem.span_days * reach.exp();
        if !problem.evaluate_over(bench, &at, span_days) {
            return None;
        }
        let texture = &textures[chosen];
        let log_posterior =
            texture.log_likelihood(problem.window, &bench.residuals, log_size.exp())
                + problem.prior_over(&at, reach)
                + texture.log_prior
                + prior::log_size(log_size)
                + problem.log_prior_of_rest();
        Some(Draft {
            law,
            span_days,
            whole,
            along,
            texture: chosen,
            log_posterior,
            log_mixture: f64::NEG_INFINITY,
            log_weight: f64::NEG_INFINITY,
        })
    }

    /// ln of the density with which [`Self::draw`] gives this law and texture.
    pub(super) fn log_density(&self, draft: &Draft) -> f64 {
        let component = &self.components[draft.texture];
        let off = draft.whole - component.centre;
        if !(self.spans.0..=self.spans.1).contains(&draft.along) {
            return f64::NEG_INFINITY;
        }
        let narrowed = (2.0 / (self.spans.1 - self.spans.0)).ln();
        component
            .root
            .solve_lower_triangular(&off)
            .map_or(f64::NEG_INFINITY, |z| {
                component.log_density(self.problem.sign, &z) + narrowed
            })
    }

    /// The same side with its proposal drawn up again from what was drawn so far: where the weights lie, as
    /// one normal shape for all textures, each with its share. Weights are levelled until they are worth
    /// enough draws to estimate a shape from.
    pub(super) fn refitted(&self, drafts: &[Draft]) -> Option<Self> {
        let logs: Vec<f64> = drafts.iter().map(|draft| draft.log_weight).collect();
        let weights = levelled(&logs);
        let worth = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        if worth < LEAST_WORTH || worth.is_nan() {
            return None;
        }
        let mut centre = Whole::zeros();
        for (draft, weight) in drafts.iter().zip(&weights) {
            centre += draft.whole * *weight;
        }
        let mut covariance = Root::zeros();
        for (draft, weight) in drafts.iter().zip(&weights) {
            let off = draft.whole - centre;
            covariance += off * off.transpose() * *weight;
        }
        covariance *= 1.0 + 4.0 / worth;
        let widest = self
            .components
            .iter()
            .max_by(|a, b| a.share.total_cmp(&b.share))?;
        covariance += widest.root * widest.root.transpose() * RIDGE;
        let root = covariance.cholesky()?.l();
        let even = EVEN / self.components.len() as f64;
        let component = |(index, old): (usize, &Component)| {
            let of = drafts
                .iter()
                .zip(&weights)
                .filter(|(draft, _)| draft.texture == index);
            let met: f64 = of.map(|(_, weight)| weight).sum();
            Component {
                centre,
                root,
                share: even + (1.0 - EVEN) * met,
                ..*old
            }
        };
        // The spans that have weight, and a little on either side.
        let of_weight = || {
            drafts
                .iter()
                .zip(&weights)
                .filter(|(_, weight)| **weight > 2e-3)
        };
        let low = of_weight()
            .map(|(draft, _)| draft.along)
            .fold(1.0, f64::min);
        let high = of_weight()
            .map(|(draft, _)| draft.along)
            .fold(-1.0, f64::max);
        let margin = (0.2 * (high - low)).max(0.02);
        let spans = ((low - margin).max(-1.0), (high + margin).min(1.0));
        Some(Self {
            spans,
            components: self.components.iter().enumerate().map(component).collect(),
            ..self.clone()
        })
    }

    fn pick(&self, u: f64) -> Option<(usize, &Component)> {
        let mut left = u;
        let mut each = self.components.iter().enumerate();
        each.find(|(_, component)| {
            left -= component.share;
            left < 0.0
        })
        .or_else(|| self.components.iter().enumerate().next_back())
    }
}

impl ModeProblem<'_> {
    /// ln of the prior density of p and of the span.
    fn log_prior_of_rest(&self) -> f64 {
        let (low, high) = self.sign.p_range();
        self.log_prior - (high - low).ln()
    }
}

impl Component {
    fn new(
        problem: &ModeProblem<'_>,
        bench: &ModeBench,
        at: Point,
        texture: &Texture,
        log_size: f64,
    ) -> Option<Self> {
        let window = problem.window;
        let (slope, bend) = problem.prior_slope(&at);
        let bend = Matrix4::from_diagonal(&bend);
        let mut residuals = bench.residuals.clone();
        let (log_size, _) = texture.size(window, &residuals, log_size, 1);
        let mut step = Point::zeros();
        let mut covariance = Matrix4::identity();
        for _ in 0..2 {
            let size = log_size.exp();
            let normal = texture.normal(window, &residuals, &bench.columns, size);
            covariance = (normal.information + bend).cholesky()?.inverse();
            let more = covariance * (slope - bend * step - normal.gradient);
            let more = more.map(|one| one.clamp(-2.0, 2.0));
            step += more;
            for (index, residual) in residuals.iter_mut().enumerate() {
                for (axis, column) in bench.columns.iter().enumerate() {
                    *residual += column[index] * more[axis];
                }
            }
        }
        let (log_size, size_spread) = texture.size(window, &residuals, log_size, 1);
        let mut root = Root::zeros();
        root.fixed_view_mut::<4, 4>(0, 0)
            .copy_from(&covariance.cholesky()?.l());
        root[(SIZE, SIZE)] = size_spread;
        let mut one = Self {
            centre: Whole::zeros(),
            root,
            log_evidence: 0.0,
            share: 0.0,
        };
        one.centre.fixed_rows_mut::<4>(0).copy_from(&(at + step));
        one.centre[SIZE] = log_size;
        one.log_evidence = texture.log_likelihood(window, &residuals, log_size.exp())
            + problem.prior(&at)
            + slope.dot(&step)
            - 0.5 * step.dot(&(bend * step))
            + texture.log_prior
            + prior::log_size(log_size)
            + problem.log_prior_of_rest()
            + one.log_volume()
            + one.log_masses(problem.sign, 1.0, 0.0);
        Some(one)
    }

    /// ln of the volume of the approximation, in units of a standard normal one's density.
    fn log_volume(&self) -> f64 {
        let curved = (self.root[(0, 0)] * self.root[(1, 1)]).ln() + 2.0 * LN_ROOT_2_PI;
        let line =
            (self.root[(CHANGE, CHANGE)] * self.root[(LN_V, LN_V)] * self.root[(SIZE, SIZE)]).ln();
        curved + line + 3.0 * LN_ROOT_2_PI
    }

    fn p_stretch(&self, sign: Sign, width: f64) -> NormalStretch {
        NormalStretch::new(sign.p_range(), self.centre[P], width * self.root[(0, 0)])
    }

    /// The stretch of kappa, given the deviate of p.
    fn kappa_stretch(&self, sign: Sign, width: f64, z_p: f64) -> NormalStretch {
        let mean = self.centre[KAPPA] + self.root[(1, 0)] * z_p;
        NormalStretch::new(sign.kappa_range(), mean, width * self.root[(1, 1)])
    }

    fn log_masses(&self, sign: Sign, width: f64, z_p: f64) -> f64 {
        let p = self.p_stretch(sign, width);
        let kappa = self.kappa_stretch(sign, width, z_p);
        (p.mass * kappa.mass).max(LEAST_MASS).ln()
    }

    /// Standard deviates of a draw whose p and kappa are in their range.
    fn deviate(&self, sign: Sign, width: f64, u: &[f64; 8]) -> Whole {
        let p = width * self.p_stretch(sign, width).quantile(u[0]);
        let kappa = width * self.kappa_stretch(sign, width, p).quantile(u[2]);
        let free = |u: f64| width * normal_quantile(u);
        Whole::new(p, kappa, free(u[3]), free(u[4]), free(u[5]))
    }

    /// ln of the density that draws come from, the choice of texture among it.
    fn log_density(&self, sign: Sign, z: &Whole) -> f64 {
        let square = z.norm_squared();
        let one = |(width, share): (f64, f64)| {
            share.ln()
                - 0.5 * square / (width * width)
                - 5.0 * width.ln()
                - self.log_masses(sign, width, z[P])
        };
        log_sum(&WIDTHS.map(one)) - self.log_volume() + self.share.ln()
    }
}

/// Weights that sum to 1, raised to the power below 1 that makes them worth [`WORTH`] draws.
fn levelled(logs: &[f64]) -> Vec<f64> {
    let mut power = 1.0;
    loop {
        let scaled: Vec<f64> = logs.iter().map(|log| power * log).collect();
        let total = log_sum(&scaled);
        let weights: Vec<f64> = scaled.iter().map(|log| (log - total).exp()).collect();
        let worth = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        if worth >= WORTH.min(0.5 * logs.len() as f64) || power < 1e-3 {
            return weights;
        }
        power *= 0.8;
    }
}

/// ln of a sum of exponentials.
pub(super) fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return f64::NEG_INFINITY;
    }
    most + logs.iter().map(|one| (one - most).exp()).sum::<f64>().ln()
}
