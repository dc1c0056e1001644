//! The inversion of the constant-load law by unweighted least squares: global, over every branch of m.
//!
//! Velocity and zero are projected out; what is left, on each of the eight charts that hold the laws
//! with m other than 1, is searched on a fixed grid, polished by Levenberg-Marquardt from the best
//! points of each m of the grid, and polished again from the best of those. Nothing is random.

use super::chart::{
    Anchor, Branch, CHARTS, Chart, Direction, HIGHEST_M, LEAST_LN_M, LOWEST_M, law_at_unit_m,
    slope_bounds, unit_m_starts,
};
use super::least_squares::{self, Limits, Optimum};
use super::projection::PointReadings;
use super::simplex;
use crate::model::{Accuracy, Law, Trajectory};
use nalgebra::{SVector, Vector1, Vector3};
use std::fmt;

/// A law that fits, at a local minimum of the misfit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// The law, t = 0 at the first reading, velocity in the readings' unit (a length's per day).
    pub law: Law,
    /// Modelled displacement at the first reading; 0 for velocities.
    pub displacement_at_start: f64,
    /// Root mean square of the residuals, in the readings' unit.
    pub rms: f64,
    /// Where the search ended: inside the box of m, or at its side.
    pub place: Place,
}

/// Whether m is free where a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A minimum within the branch.
    Inside,
    /// The misfit still falls beyond the bound of m.
    AtBoundOfM,
}

/// What is held in an inversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exponent {
    /// m is fitted.
    Free,
    /// m is this.
    Fixed(f64),
}

/// Why an inversion ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// At a minimum.
    Converged,
    /// At a minimum over the box of m, at this side of it.
    AtBoundOfM(f64),
    /// The bound on evaluations was reached first.
    Stopped,
    /// Fewer readings than would leave one over.
    TooFew {
        /// Readings given.
        given: usize,
        /// Readings needed.
        needed: usize,
    },
    /// Every reading is the same number.
    AllEqual,
    /// No law that moves forward fits better than none.
    NoForwardMotion,
    /// The m asked for is no law, or outside the box.
    NotAnExponent(f64),
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converged => f.write_str("converged"),
            Self::AtBoundOfM(m) => write!(f, "m at its bound: {m:.4}"),
            Self::Stopped => f.write_str("stopped at the bound on evaluations"),
            Self::TooFew { given, needed } => {
                write!(f, "too few readings: {given}, at least {needed} needed")
            }
            Self::AllEqual => f.write_str("all readings are equal"),
            Self::NoForwardMotion => f.write_str("no forward motion"),
            Self::NotAnExponent(m) => write!(
                f,
                "m = {m} cannot be fixed: expected {LOWEST_M} to {HIGHEST_M}, not 0"
            ),
        }
    }
}

/// The inversion's result.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstantLoad {
    /// The distinct minima, best first, among them the best with m > 1, m = 1 and m < 1.
    pub minima: Vec<Solution>,
    /// Laws solved.
    pub evaluations: usize,
    /// Why it ended.
    pub outcome: Outcome,
}

/// Evaluations of a first and of a last polish.
const POLISH: (usize, usize) = (60, 1500);
/// Starts for each m of the grid, and last polishes for each chart.
const STARTS: (usize, usize) = (2, 3);
/// A last polish is begun afresh while it gained more than this, relative, and at most so often.
const RESTART_GAIN: f64 = 1e-7;
const MOST_RESTARTS: usize = 6;
/// First step and evaluations of the simplex; it is tried where the cost is within this of the best.
const SIMPLEX: (f64, usize) = (0.3, 400);
const NEAR_BEST: f64 = 1.5;
/// Minima kept beside the best with m > 1, m = 1 and m < 1.
const MOST_MINIMA: usize = 8;
/// Relative difference of rms under which two results are one minimum.
const SAME_RMS: f64 = 1e-3;
/// A branch that gains less than this on m = 1, relative to its rms, has run into m = 1.
const GAIN_OVER_UNIT_M: f64 = 1e-7;
/// A search that ends this near to a bound of ln m has run into it.
const AT_BOUND: f64 = 1e-3;
/// A minimum must leave less than this share of the rms about a constant velocity.
const WORTH_MENTION: f64 = 0.999;
/// And no more than so many times the rms of the best.
const WORST: f64 = 3.0;

impl ConstantLoad {
    /// Inverts the readings.
    pub fn fit(readings: &PointReadings, exponent: Exponent) -> Self {
        if let Some(outcome) = refuse(readings, exponent) {
            return Self {
                minima: Vec::new(),
                evaluations: 0,
                outcome,
            };
        }
        let mut search = Search::new(readings);
        let mut found = Vec::new();
        if exponent != Exponent::Fixed(1.0) {
            let region = |chart: Chart| Region::new(chart, exponent);
            let mut ends: Vec<(Region, Optimum<3>)> = Vec::new();
            for region in CHARTS.into_iter().filter_map(region) {
                let minima = search.minima(&region);
                ends.extend(minima.into_iter().map(|end| (region, end)));
            }
            search.sharpen(&mut ends);
            found.extend(
                ends.iter()
                    .filter_map(|(region, end)| search.law_of(region, end)),
            );
        }
        if matches!(exponent, Exponent::Free | Exponent::Fixed(1.0)) {
            found.extend(search.unit_m());
        }
        search.conclude(found, exponent)
    }

    /// The best of all.
    pub fn best(&self) -> Option<&Solution> {
        self.minima.first()
    }
}

/// What makes an inversion pointless.
fn refuse(readings: &PointReadings, exponent: Exponent) -> Option<Outcome> {
    if let Exponent::Fixed(m) = exponent
        && !(m == 1.0 || (Branch::of(m).is_some() && (LOWEST_M..=HIGHEST_M).contains(&m)))
    {
        return Some(Outcome::NotAnExponent(m));
    }
    let nonlinear = if exponent == Exponent::Free { 3 } else { 2 };
    let (given, needed) = (readings.count(), readings.linear_unknowns() + nonlinear + 1);
    if given < needed {
        return Some(Outcome::TooFew { given, needed });
    }
    readings.all_equal().then_some(Outcome::AllEqual)
}

/// A polished point.
#[derive(Debug, Clone, Copy)]
struct Found {
    solution: Solution,
    cost: f64,
    termination: least_squares::Termination,
}

struct Search<'a> {
    readings: &'a PointReadings,
    basis: Vec<f64>,
    residuals: Vec<f64>,
    evaluations: usize,
}

impl<'a> Search<'a> {
    fn new(readings: &'a PointReadings) -> Self {
        Self {
            readings,
            basis: Vec::with_capacity(readings.count()),
            residuals: vec![0.0; readings.count()],
            evaluations: 0,
        }
    }

    fn cost(&mut self, law: &Law, anchor: Anchor) -> f64 {
        self.evaluations += 1;
        let (basis, residuals) = (&mut self.basis, &mut self.residuals);
        match self.readings.residuals(law, anchor, basis, residuals) {
            Some(_) => residuals.iter().map(|residual| residual * residual).sum(),
            None => f64::INFINITY,
        }
    }

    /// The best minima on one chart.
    fn minima(&mut self, region: &Region) -> Vec<Optimum<3>> {
        let (chart, length) = (region.chart, self.readings.length_days());
        let law = |at: &Vector3<f64>| chart.law(at, length);
        let first = limits((region.low, region.high), POLISH.0);
        let mut polished = Vec::new();
        for ln_m in region.grid() {
            let scored = Chart::points(ln_m).map(|at| (at, self.cost(&law(&at), chart.anchor)));
            let scored: Vec<(Vector3<f64>, f64)> = scored.collect();
            for start in lowest_apart(scored) {
                polished.extend(self.polish(start, chart.anchor, &first, law));
            }
        }
        polished.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        polished.dedup_by(|a, b| (a.cost - b.cost).abs() <= SAME_RMS * b.cost);
        polished.truncate(STARTS.1);
        polished
            .into_iter()
            .filter_map(|start| self.settle(start, region))
            .collect()
    }

    /// Polishes to the end, afresh as long as it gains: a curved valley stalls a search before its floor.
    fn settle(&mut self, start: Optimum<3>, region: &Region) -> Option<Optimum<3>> {
        let (chart, length) = (region.chart, self.readings.length_days());
        let limits = limits((region.low, region.high), POLISH.1);
        let mut best = start;
        for _ in 0..MOST_RESTARTS {
            let law = |at: &Vector3<f64>| chart.law(at, length);
            let next = self.polish(best.at, chart.anchor, &limits, law)?;
            let gain = best.cost - next.cost;
            best = next;
            if gain <= RESTART_GAIN * best.cost {
                break;
            }
        }
        Some(best)
    }

    /// Takes the best end of every chart that comes near the best of all through a simplex.
    fn sharpen(&mut self, ends: &mut [(Region, Optimum<3>)]) {
        ends.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let lowest = ends.first().map_or(0.0, |(_, end)| end.cost);
        let mut done: Vec<Chart> = Vec::new();
        for (region, end) in ends {
            let (chart, length) = (region.chart, self.readings.length_days());
            if end.cost > NEAR_BEST * lowest || done.contains(&chart) {
                continue;
            }
            done.push(chart);
            let (at, cost) = simplex::descend(end.at, SIMPLEX.0, SIMPLEX.1, |at| {
                let at = region.inside(at);
                self.cost(&chart.law(&at, length), chart.anchor)
            });
            if cost < end.cost {
                (end.at, end.cost) = (region.inside(&at), cost);
                if let Some(settled) = self.settle(end.clone(), region) {
                    *end = settled;
                }
            }
        }
    }

    fn law_of(&mut self, region: &Region, end: &Optimum<3>) -> Option<Found> {
        let law = region.chart.law(&end.at, self.readings.length_days());
        self.found(&law, region.chart.anchor, (end, region.place(&end.at)))
    }

    /// The best laws with m = 1, one in each direction: y is a straight line.
    fn unit_m(&mut self) -> Vec<Found> {
        let length = self.readings.length_days();
        let mut found = Vec::new();
        for (direction, anchor) in [
            (Direction::Accelerating, Anchor::End),
            (Direction::Decelerating, Anchor::Start),
        ] {
            let law = |at: &Vector1<f64>| law_at_unit_m(direction, at[0], length);
            let bounds = slope_bounds();
            let limits = limits((Vector1::new(bounds.0), Vector1::new(bounds.1)), POLISH.1);
            let starts: Vec<_> = unit_m_starts()
                .filter_map(|start| self.polish(Vector1::new(start), anchor, &limits, law))
                .collect();
            let best = starts.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
            found.extend(best.and_then(|optimum| {
                self.found(&law(&optimum.at), anchor, (&optimum, Place::Inside))
            }));
        }
        found
    }

    fn polish<const N: usize>(
        &mut self,
        start: SVector<f64, N>,
        anchor: Anchor,
        limits: &Limits<N>,
        law: impl Fn(&SVector<f64, N>) -> Law,
    ) -> Option<Optimum<N>> {
        let (readings, basis) = (self.readings, &mut self.basis);
        let mut solved = 0;
        let optimum = least_squares::minimise(start, readings.count(), limits, |at, out| {
            solved += 1;
            readings.residuals(&law(at), anchor, basis, out).is_some()
        });
        self.evaluations += solved;
        optimum
    }

    /// The law of an optimum, moved to the first reading.
    fn found<const N: usize>(
        &mut self,
        law: &Law,
        anchor: Anchor,
        end: (&Optimum<N>, Place),
    ) -> Option<Found> {
        let linear = self
            .readings
            .residuals(law, anchor, &mut self.basis, &mut self.residuals)?;
        let scaled = Law {
            v_i: linear.velocity,
            ..*law
        };
        let (law, displacement_at_start) = match anchor {
            Anchor::Start => (scaled, linear.displacement),
            Anchor::End => {
                let length = self.readings.length_days();
                let past = Trajectory::solve(&scaled.reversed(), length, Accuracy::Full);
                let motion = past.at(length)?;
                let start = same_direction(scaled.from_y(motion.y), &scaled);
                (start, linear.displacement - motion.displacement)
            }
        };
        Some(Found {
            solution: Solution {
                law,
                displacement_at_start,
                rms: self.readings.rms(end.0.cost),
                place: end.1,
            },
            cost: end.0.cost,
            termination: end.0.termination,
        })
    }

    fn conclude(&self, mut found: Vec<Found>, exponent: Exponent) -> ConstantLoad {
        let evaluations = self.evaluations;
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        prefer_unit_m(&mut found);
        let outcome = match found.first() {
            None => Outcome::NoForwardMotion,
            Some(best) if best.termination != least_squares::Termination::Converged => {
                Outcome::Stopped
            }
            Some(best) if best.solution.place == Place::AtBoundOfM => {
                Outcome::AtBoundOfM(m_of(&best.solution))
            }
            Some(_) => Outcome::Converged,
        };
        let flat = self.readings.rms(self.readings.cost_of_no_change());
        ConstantLoad {
            minima: distinct(&found, flat, exponent),
            evaluations,
            outcome,
        }
    }
}

/// A chart and the part of it that is searched.
#[derive(Debug, Clone, Copy)]
struct Region {
    chart: Chart,
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Region {
    /// `None` where a fixed m does not stand on the chart.
    fn new(chart: Chart, exponent: Exponent) -> Option<Self> {
        let (mut low, mut high) = chart.corners();
        if let Exponent::Fixed(m) = exponent {
            if Branch::of(m) != Some(chart.branch) {
                return None;
            }
            (low[2], high[2]) = (m.abs().ln(), m.abs().ln());
        }
        Some(Self { chart, low, high })
    }

    fn is_fixed(&self) -> bool {
        self.low[2] >= self.high[2]
    }

    /// ln |m| where the search looks first.
    fn grid(&self) -> Vec<f64> {
        if self.is_fixed() {
            return vec![self.low[2]];
        }
        let grid = self.chart.branch.grid();
        grid.iter().map(|m| m.abs().ln()).collect()
    }

    fn inside(&self, at: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| at[i].clamp(self.low[i], self.high[i]))
    }

    fn place(&self, at: &Vector3<f64>) -> Place {
        let side = at[2] <= self.low[2] + AT_BOUND || at[2] >= self.high[2] - AT_BOUND;
        if side && !self.is_fixed() && at[2].abs() > AT_BOUND {
            Place::AtBoundOfM
        } else {
            Place::Inside
        }
    }
}

fn limits<const N: usize>(
    corners: (SVector<f64, N>, SVector<f64, N>),
    most_evaluations: usize,
) -> Limits<N> {
    Limits {
        lowest: corners.0,
        highest: corners.1,
        scale: 1.0,
        most_evaluations,
    }
}

/// Near the steady state the slope is the difference of two equal numbers; its sign is known.
fn same_direction(start: Law, end: &Law) -> Law {
    let least = f64::EPSILON * start.kappa.abs().max(f64::MIN_POSITIVE);
    let r = if end.r > 0.0 {
        start.r.max(least)
    } else {
        start.r.min(-least)
    };
    Law { r, ..start }
}

/// The lowest points of a grid of one m that do not stand beside one another.
fn lowest_apart(mut scored: Vec<(Vector3<f64>, f64)>) -> Vec<Vector3<f64>> {
    scored.retain(|(_, cost)| cost.is_finite());
    scored.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut taken: Vec<Vector3<f64>> = Vec::new();
    for (at, _) in scored {
        if taken.len() < STARTS.0 && taken.iter().all(|other| (at - other).amax() > 2.0) {
            taken.push(at);
        }
    }
    taken
}

fn m_of(solution: &Solution) -> f64 {
    1.0 / (1.0 - solution.law.p)
}

/// Where a branch has only run into m = 1, that is the better account; what is left of the branch is
/// the law next to it, whose x_i, T and D mean nothing.
fn prefer_unit_m(found: &mut Vec<Found>) {
    let Some(unit) = found.iter().find(|one| one.solution.law.p == 0.0).copied() else {
        return;
    };
    let unit_rms = unit.solution.rms;
    for one in found.iter_mut() {
        let law = &mut one.solution.law;
        let same = (one.solution.rms - unit_rms).abs() <= GAIN_OVER_UNIT_M * unit_rms;
        if law.p == 0.0 || !same {
            continue;
        }
        let side = if law.p > 0.0 && law.p < 1.0 {
            1.0
        } else {
            -1.0
        };
        *law = Law {
            kappa: side * f64::MIN_POSITIVE,
            p: side * LEAST_LN_M,
            a: f64::NAN,
            ..unit.solution.law
        };
        one.solution.place = Place::Inside;
    }
    let gains = |one: &Found| one.solution.rms < unit_rms * (1.0 - GAIN_OVER_UNIT_M);
    if found.first().is_some_and(|best| !gains(best)) {
        // Stable: only the best law with m = 1 moves, to the front.
        let at = found.iter().position(|one| one.solution.law.p == 0.0);
        found[..=at.unwrap_or(0)].rotate_right(1);
    }
}

/// The side of m = 1 on which a law stands.
fn side(law: &Law) -> i8 {
    if law.p == 0.0 {
        0
    } else if law.p > 0.0 && law.p < 1.0 {
        1
    } else {
        -1
    }
}

/// The minima that differ, best first, and the best of m > 1, m = 1 and m < 1 whatever their worth.
fn distinct(found: &[Found], flat: f64, exponent: Exponent) -> Vec<Solution> {
    let best = found.first().map_or(0.0, |best| best.solution.rms);
    let mut kept: Vec<Solution> = Vec::new();
    for Found { solution, .. } in found {
        let first_of_side = kept.iter().all(|one| side(&one.law) != side(&solution.law));
        let same = |one: &Solution| {
            let bound = solution.place == Place::AtBoundOfM && one.place == solution.place;
            let close = (one.rms - solution.rms).abs() <= SAME_RMS * solution.rms;
            (close || bound)
                && side(&one.law) == side(&solution.law)
                && (one.law.r > 0.0) == (solution.law.r > 0.0)
        };
        let worthy = solution.rms < WORTH_MENTION * flat && solution.rms <= WORST * best;
        let new = worthy && !kept.iter().any(same);
        if first_of_side || (new && kept.len() < MOST_MINIMA && exponent == Exponent::Free) {
            kept.push(*solution);
        }
    }
    kept
}
