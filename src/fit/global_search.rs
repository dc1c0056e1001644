//! The search: on every chart a fixed grid, Levenberg-Marquardt from its best points, and last what
//! follows valleys that derivatives lose: a profile over m, a simplex.

use super::chart::{
    Anchor, Branch, CHARTS, Chart, Direction, law_at_unit_m, slope_bounds, unit_m_starts,
};
use super::constant_load::{Exponent, Place, SAME_RMS, Solution};
use super::least_squares::{self, Limits, Optimum};
use super::projection::PointReadings;
use super::simplex;
use crate::model::{Accuracy, Law, Trajectory};
use nalgebra::{SVector, Vector1, Vector3};

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
/// Charts whose best end is followed over m, in how many steps, with how many evaluations each.
const PROFILED: usize = 2;
const PROFILE_STEPS: f64 = 24.0;
const PROFILE_EVALUATIONS: usize = 24;
/// A search that ends this near to a bound of ln m has run into it.
const AT_BOUND: f64 = 1e-3;

/// A polished point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) solution: Solution,
    pub(super) cost: f64,
    pub(super) termination: least_squares::Termination,
}

/// One search over one record.
pub(super) struct Search<'a> {
    pub(super) readings: &'a PointReadings,
    basis: Vec<f64>,
    residuals: Vec<f64>,
    pub(super) evaluations: usize,
}

impl<'a> Search<'a> {
    pub(super) fn new(readings: &'a PointReadings) -> Self {
        Self {
            readings,
            basis: Vec::with_capacity(readings.count()),
            residuals: vec![0.0; readings.count()],
            evaluations: 0,
        }
    }

    /// The ends of all searches, in no order.
    pub(super) fn run(&mut self, exponent: Exponent) -> Vec<Found> {
        let mut found = Vec::new();
        if exponent != Exponent::Fixed(1.0) {
            let region = |chart: Chart| Region::new(chart, exponent);
            let mut ends: Vec<(Region, Optimum<3>)> = Vec::new();
            for region in CHARTS.into_iter().filter_map(region) {
                let minima = self.minima(&region);
                ends.extend(minima.into_iter().map(|end| (region, end)));
            }
            self.sharpen(&mut ends);
            found.extend(
                ends.iter()
                    .filter_map(|(region, end)| self.law_of(region, end)),
            );
        }
        if matches!(exponent, Exponent::Free | Exponent::Fixed(1.0)) {
            found.extend(self.unit_m());
        }
        found
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
            if done.len() <= PROFILED && !region.is_fixed() {
                self.profile(region, end);
            }
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

    /// Follows the minimum over ln |m| either way, the rest refitted, and goes on from the lowest point.
    fn profile(&mut self, region: &Region, end: &mut Optimum<3>) {
        let (chart, length) = (region.chart, self.readings.length_days());
        let law = |at: &Vector3<f64>| chart.law(at, length);
        let step = (region.high[2] - region.low[2]) / PROFILE_STEPS;
        let mut lowest = end.clone();
        for sign in [-1.0, 1.0] {
            let mut here = end.at;
            loop {
                here[2] += sign * step;
                if here[2] < region.low[2] || here[2] > region.high[2] {
                    break;
                }
                let (mut low, mut high) = (region.low, region.high);
                (low[2], high[2]) = (here[2], here[2]);
                let limits = limits((low, high), PROFILE_EVALUATIONS);
                let Some(held) = self.polish(here, chart.anchor, &limits, law) else {
                    break;
                };
                here = held.at;
                if held.cost < lowest.cost {
                    lowest = held;
                }
            }
        }
        if lowest.cost < end.cost
            && let Some(settled) = self.settle(lowest, region)
        {
            *end = settled;
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
        ..Limits::evaluations(most_evaluations)
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
