//! Where the search looks first: for each of a few m one curve, of which many stretches are laid over
//! the record.

use super::chart::{Branch, Chart, Direction};
use super::curve::{CurveShape, CurveWindow, Fineness};
use super::descent::{Descent, SearchPoint};
use super::quasi_random::halton;
use super::record::WeightedRecord;

/// The m's that are looked at in any case, and those that are where a direction shows promise.
const FIRST: [(Branch, f64); 3] = [
    (Branch::AboveOne, 1.6),
    (Branch::BelowOne, 0.25),
    (Branch::BelowZero, -1.2),
];
/// The m's that follow in a direction that shows promise.
const MORE: [(Branch, f64); 7] = [
    (Branch::AboveOne, 1.05),
    (Branch::AboveOne, 6.0),
    (Branch::BelowOne, 0.8),
    (Branch::BelowOne, 0.03),
    (Branch::BelowZero, -8.0),
    (Branch::BelowZero, -0.12),
    (Branch::BelowZero, -0.012),
];
/// |ln `y_s`| at the anchor, from far to near.
const EXCESS: [f64; 7] = [12.0, 6.0, 3.6, 2.2, 1.2, 0.5, 0.1];
/// A curve is solved from here on.
const FARTHEST_LN_STEADY: f64 = 14.0;
/// Far from the steady state: the knee, as shares of the record.
const KNEES: [f64; 9] = [0.15, 0.4, 0.6, 0.76, 0.88, 0.97, 1.15, 1.8, 4.0];
/// Beyond the knee: the record's length in relaxation times.
const RELAXATIONS: [f64; 3] = [0.7, 3.0, 12.0];
/// A stretch begins before the knee when it begins so many times farther from the steady state.
const BEFORE_KNEE: f64 = 1.5;
/// How far a shifted lattice moves each of them, in logarithms: m, excess, knee, relaxation.
const SHIFTS: [f64; 4] = [0.3, 0.4, 0.15, 0.8];

/// The places where the search looks first. What it finds must not depend on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lattice {
    /// As it stands.
    #[default]
    Regular,
    /// Every place moved about, differently for each number.
    Shifted(u32),
}

impl Lattice {
    /// Numbers from -0.5 to 0.5 for one node of the lattice; 0 on the regular one.
    pub(super) fn shifts(self, node: usize) -> [f64; 5] {
        match self {
            Self::Regular => [0.0; 5],
            Self::Shifted(number) => {
                // Neighbouring numbers must not give neighbouring points.
                let index = u32::try_from(node).unwrap_or(0) % 977 + number.wrapping_mul(977);
                halton(index % 100_000_007).map(|share| share - 0.5)
            }
        }
    }
}

/// One curve and the direction in which it is followed.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurveFamily {
    branch: Branch,
    m: f64,
    pub(super) direction: Direction,
}

/// The families that are looked at in any case.
pub(super) fn first() -> impl Iterator<Item = CurveFamily> {
    Direction::BOTH
        .into_iter()
        .flat_map(|direction| of(&FIRST, direction))
}

/// The rest of those of one direction.
pub(super) fn more(direction: Direction) -> impl Iterator<Item = CurveFamily> {
    of(&MORE, direction)
}

/// The one family of a given m in each direction.
pub(super) fn fixed(branch: Branch, m: f64) -> impl Iterator<Item = CurveFamily> {
    Direction::BOTH
        .into_iter()
        .map(move |direction| CurveFamily {
            branch,
            m,
            direction,
        })
}

fn of(list: &'static [(Branch, f64)], direction: Direction) -> impl Iterator<Item = CurveFamily> {
    list.iter().map(move |(branch, m)| CurveFamily {
        branch: *branch,
        m: *m,
        direction,
    })
}

/// A stretch of a curve and what it leaves.
#[derive(Debug, Clone, Copy)]
struct Laid {
    window: CurveWindow,
    cost: f64,
}

impl CurveFamily {
    /// The two best stretches that begin at different places.
    pub(super) fn scan(
        &self,
        descent: &mut Descent,
        record: &WeightedRecord,
        lattice: Lattice,
        holds_m: bool,
    ) -> Vec<SearchPoint> {
        let seed = self.seed();
        let shift = if holds_m {
            0.0
        } else {
            SHIFTS[0] * lattice.shifts(seed)[0]
        };
        let (low, high) = self.branch.ln_m();
        let ln_m = (self.m.abs().ln() * (1.0 + shift)).clamp(low, high);
        let p = self
            .branch
            .p(if holds_m { self.m.abs().ln() } else { ln_m });
        let (chart, _) = Chart::locate(self.branch, self.direction, 1.0, 1.0, ln_m);
        let sign = chart.shape(&[0.0; 3]).slope.signum();
        let shape = CurveShape {
            slope: sign,
            ln_steady: sign * FARTHEST_LN_STEADY,
            p,
        };
        // Followed until it all but stands still, or leaves the range of numbers.
        descent.curve.solve(&shape, f64::INFINITY, Fineness::COARSE);
        if descent.curve.count() < 3 {
            return Vec::new();
        }
        let best = lay(descent, record, chart, p, lattice, seed);
        let place = |laid: &Laid| {
            let node = laid.window.first_node;
            let slope = descent.curve.growth(node) * laid.window.span;
            let excess = descent.curve.ln_excess(node).abs();
            let (chart, at) = Chart::locate(self.branch, self.direction, slope, excess, ln_m);
            SearchPoint {
                chart,
                at,
                cost: laid.cost,
                converged: false,
            }
        };
        best.iter().map(place).collect()
    }

    fn seed(&self) -> usize {
        let all = FIRST.iter().chain(&MORE);
        let index = all.take_while(|(_, m)| (m - self.m).abs() > 1e-12).count();
        100 * (index + 10 * (self.direction as usize))
    }
}

/// Lays the curve over the record in all ways and keeps the two best that differ.
fn lay(
    descent: &mut Descent,
    record: &WeightedRecord,
    chart: Chart,
    p: f64,
    lattice: Lattice,
    seed: usize,
) -> Vec<Laid> {
    let knee_excess = 1.0 / p.abs().max(1.0);
    let knee = descent.curve.time_at_excess(knee_excess);
    let last = descent.curve.count() - 1;
    let relaxation = -descent.curve.ln_excess(last) / descent.curve.growth(last);
    let mut best: Vec<Laid> = Vec::with_capacity(3);
    let mut first_node = 0;
    for (index, excess) in EXCESS.iter().enumerate() {
        let shifts = lattice.shifts(seed + index);
        let excess = excess * (SHIFTS[1] * shifts[1]).exp();
        while first_node < last && descent.curve.ln_excess(first_node + 1).abs() >= excess {
            first_node += 1;
        }
        let start = descent.curve.time(first_node);
        let knees = KNEES.map(|share| (knee - start) / (share * (SHIFTS[2] * shifts[2]).exp()));
        let relaxations =
            RELAXATIONS.map(|count| relaxation * count * (SHIFTS[3] * shifts[3]).exp());
        let spans: &[f64] = if excess > BEFORE_KNEE * knee_excess {
            &knees
        } else {
            &relaxations
        };
        for span in spans {
            let window = CurveWindow {
                first_node,
                start,
                span: *span,
            };
            descent.evaluations += 1;
            let cost = descent.cost_of(record, chart, &window);
            keep(&mut best, Laid { window, cost });
        }
    }
    best
}

/// Keeps the best of each beginning, two beginnings at most.
fn keep(best: &mut Vec<Laid>, laid: Laid) {
    if !laid.cost.is_finite() {
        return;
    }
    let same = |one: &Laid| one.window.first_node == laid.window.first_node;
    if let Some(one) = best.iter_mut().find(|one| same(one)) {
        if laid.cost < one.cost {
            *one = laid;
        }
    } else {
        best.push(laid);
    }
    best.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    best.truncate(2);
}
