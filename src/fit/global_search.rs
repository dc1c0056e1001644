//! The search: a lattice over the readings merged to a few, descents from its best places there, from
//! the best of those on all readings, and last from whatever may still be the best of all.

use super::chart::{Anchor, Branch, Chart, Direction};
use super::curve::{CurveWindow, Fineness, LawCurve};
use super::descent::{Descent, DescentEffort, SearchPoint};
use super::lattice::{self, CurveFamily, Lattice};
use super::point_readings::PointReadings;
use super::record::WeightedRecord;
use super::solution::{EndOfSearch, Exponent, Solution};
use super::unit_m::{UnitMLine, UnitMLines};
use crate::reading::Quantity;

/// On the merged readings: from the lattice to the floor of a basin, nearly.
const NEARLY: DescentEffort = DescentEffort {
    most_evaluations: 36,
    least_gain: 2e-3,
    fineness: Fineness::MIDDLE,
};
/// On all readings: enough to know which basins may hold the best.
const CLOSELY: DescentEffort = DescentEffort {
    most_evaluations: 40,
    least_gain: 3e-6,
    fineness: Fineness::FINE,
};
/// To the floor.
const WHOLLY: DescentEffort = DescentEffort {
    most_evaluations: 200,
    least_gain: 1e-9,
    fineness: Fineness::FINE,
};
/// A descent to the floor is begun again while it gained more than this, relative, and at most so often.
const RESTART_GAIN: f64 = 1e-7;
const MOST_RESTARTS: usize = 6;

/// A direction whose best place on the first lattice costs more times the best is not looked at again.
const PROMISING: f64 = 4.0;
/// Readings of which the law explains less than all but this share have many basins of like depth.
const HARD: f64 = 0.015;
/// How many places of each branch and direction go on to a descent, to all readings, to the floor.
#[derive(Debug, Clone, Copy)]
struct Breadth {
    nearly: usize,
    nearly_of_one_m: usize,
    closely: usize,
    /// Costs within so many times the best go on to a descent on all readings.
    closely_within: f64,
    /// Of one branch and direction, these many go to the floor.
    wholly: usize,
    /// Costs within so many times the best go to the floor.
    floor_within: f64,
}
/// For records that a few starts decide.
const EASY_BREADTH: Breadth = Breadth {
    nearly: 3,
    nearly_of_one_m: 1,
    closely: 6,
    closely_within: 3.0,
    wholly: 1,
    floor_within: 1.02,
};
/// For records of many valleys of nearly one cost.
const HARD_BREADTH: Breadth = Breadth {
    nearly: 5,
    nearly_of_one_m: 2,
    closely: 12,
    closely_within: 100.0,
    wholly: 6,
    floor_within: 1.06,
};
/// The first place of each branch and direction goes on to a descent on all readings within this, at
/// least, of the best cost.
const FIRST_WITHIN: f64 = 9.0;
/// A descent that did not end goes on from within so many times the best cost.
const UNFINISHED_WITHIN: f64 = 30.0;
/// Costs within this of each other, on one branch in one direction, are those of one basin.
const ONE_BASIN: f64 = 2e-4;

/// Small m beside a line in inverse velocity: m, and ln y_s beyond the line's end.
const BEYOND_LINE: [f64; 4] = [-0.25, 0.05, 0.4, 1.2];
const LEAST_EXCESS: f64 = 0.05;
/// Far from the steady state such a law is an exponential, which gains as much over the record as the line.
const NEARLY_EXPONENTIAL: f64 = -18.0;
/// The m's of the laws that are a straight line in inverse velocity far from the steady state, and that one.
const LINE_LIKE: [(Direction, Branch, f64); 7] = [
    (Direction::Accelerating, Branch::AboveOne, 1.15),
    (Direction::Accelerating, Branch::AboveOne, 5.0),
    (Direction::Accelerating, Branch::BelowOne, 0.03),
    (Direction::Accelerating, Branch::BelowOne, 0.4),
    (
        Direction::Accelerating,
        Branch::BelowZero,
        NEARLY_EXPONENTIAL,
    ),
    (Direction::Decelerating, Branch::BelowZero, -0.03),
    (Direction::Decelerating, Branch::BelowZero, -0.4),
];

/// A search that ends this near to a bound of ln m has run into it.
const AT_BOUND: f64 = 1e-3;

/// The end of a search.
#[derive(Debug, Clone, Copy)]
pub(super) struct FoundMinimum {
    pub(super) solution: Solution,
    pub(super) cost: f64,
    pub(super) converged: bool,
}

/// One search over one record.
pub(super) struct GlobalSearch<'a> {
    readings: &'a PointReadings,
    exponent: Exponent,
    lattice: Lattice,
    full: WeightedRecord,
    descent: Descent,
    lines: UnitMLines,
}

impl<'a> GlobalSearch<'a> {
    pub(super) fn new(readings: &'a PointReadings, exponent: Exponent, lattice: Lattice) -> Self {
        let full = readings.record();
        Self {
            readings,
            exponent,
            lattice,
            descent: Descent::new(full.quantity, full.count()),
            lines: UnitMLines::new(full.count()),
            full,
        }
    }

    /// Laws solved so far.
    pub(super) fn evaluations(&self) -> usize {
        self.descent.evaluations + self.lines.evaluations
    }

    /// Sum of squares that a law without any curvature of its own leaves.
    pub(super) fn cost_of_no_change(&self) -> f64 {
        self.full.cost_of_no_change()
    }

    /// The ends of all descents, in no order.
    pub(super) fn run(&mut self) -> Vec<FoundMinimum> {
        let merged = self.full.merged();
        let shift = self.lattice.shifts(usize::MAX)[0];
        let lines = Direction::BOTH.map(|direction| self.lines.minima(&merged, direction, shift));
        let mut found = Vec::new();
        if self.exponent != Exponent::Fixed(1.0) {
            let ends = self.curved(&merged, &lines);
            found.extend(ends.iter().filter_map(|end| self.found(end)));
        }
        if matches!(self.exponent, Exponent::Free | Exponent::Fixed(1.0)) {
            for minima in &lines {
                let line = self.lines.best(&self.full, minima);
                found.extend(line.and_then(|line| self.found_line(&line)));
            }
        }
        found
    }

    fn holds_m(&self) -> bool {
        self.exponent != Exponent::Free
    }

    /// The minima with m other than 1.
    fn curved(&mut self, merged: &WeightedRecord, lines: &[Vec<UnitMLine>; 2]) -> Vec<SearchPoint> {
        let places = self.places(merged, lines);
        let lowest = lowest(&places, None);
        let breadth = if lowest > HARD * merged.cost_of_no_change() {
            HARD_BREADTH
        } else {
            EASY_BREADTH
        };
        let holds_m = self.holds_m();
        let is_promising = |place: &SearchPoint| {
            let direction = Some(place.chart.direction);
            self::lowest(&places, direction) <= PROMISING * lowest
        };
        let chosen: Vec<SearchPoint> = places.iter().copied().filter(is_promising).collect();
        let mut near = Vec::new();
        for place in of_each(&chosen, breadth) {
            let mut place = self.descent.descend(merged, &place, &NEARLY, holds_m);
            // What was merged may hold the very readings that distinguish basins.
            let fineness = CLOSELY.fineness;
            place.cost = self
                .descent
                .cost(&self.full, place.chart, &place.at, fineness);
            near.push(place);
        }
        sort(&mut near);
        let mut close = Vec::new();
        for place in worth_all_readings(&near, breadth) {
            close.push(self.descent.descend(&self.full, &place, &CLOSELY, holds_m));
        }
        sort(&mut close);
        close.dedup_by(|a, b| is_same_group(a, b) && a.cost - b.cost <= ONE_BASIN * b.cost);
        let floor = breadth.floor_within * self::lowest(&close, None);
        let may_fall_from = UNFINISHED_WITHIN * self::lowest(&close, None);
        let mut refined: Vec<SearchPoint> = Vec::new();
        let may_fall = |place: &&mut SearchPoint| !place.converged && place.cost <= may_fall_from;
        for place in close
            .iter_mut()
            .filter(|place| place.cost <= floor || may_fall(place))
        {
            if refined
                .iter()
                .filter(|one| is_same_group(one, place))
                .count()
                < breadth.wholly
            {
                refine(&mut self.descent, &self.full, place, holds_m);
                refined.push(*place);
            }
        }
        close
    }

    /// The best places of the lattice, best first.
    fn places(&mut self, merged: &WeightedRecord, lines: &[Vec<UnitMLine>; 2]) -> Vec<SearchPoint> {
        let mut places = Vec::new();
        match self.exponent {
            Exponent::Free => {
                self.scan(merged, lattice::first(), &mut places);
                let best = lowest(&places, None);
                for direction in Direction::BOTH {
                    if lowest(&places, Some(direction)) <= PROMISING * best {
                        self.scan(merged, lattice::more(direction), &mut places);
                    }
                }
            }
            Exponent::Fixed(m) => {
                let branch = Branch::of(m).into_iter();
                let families = branch.flat_map(|branch| lattice::fixed(branch, m));
                self.scan(merged, families, &mut places);
            }
        }
        for line in lines.iter().flatten() {
            self.beside(merged, line, &mut places);
        }
        sort(&mut places);
        places
    }

    fn scan(
        &mut self,
        merged: &WeightedRecord,
        families: impl Iterator<Item = CurveFamily>,
        places: &mut Vec<SearchPoint>,
    ) {
        let holds_m = self.holds_m();
        for family in families {
            places.extend(family.scan(&mut self.descent, merged, self.lattice, holds_m));
        }
    }

    /// The laws that follow a straight line in inverse velocity until near its end.
    fn beside(&mut self, merged: &WeightedRecord, line: &UnitMLine, places: &mut Vec<SearchPoint>) {
        let slope = line.ln_slope.exp();
        let fall = slope.ln_1p();
        for (direction, branch, m) in LINE_LIKE {
            let m = match self.exponent {
                Exponent::Free => m,
                Exponent::Fixed(m) => m,
            };
            if direction != line.direction || Branch::of(m) != Some(branch) {
                continue;
            }
            let slope = if branch == Branch::BelowOne {
                slope / (1.0 + slope)
            } else if m < NEARLY_EXPONENTIAL + 1.0 {
                fall
            } else {
                slope
            };
            for beyond in BEYOND_LINE {
                let excess = (fall + beyond).max(LEAST_EXCESS);
                let (chart, at) = Chart::locate(branch, direction, slope, excess, m.abs().ln());
                let at = super::descent::inside(chart, &at, self.holds_m());
                let cost = self.descent.cost(merged, chart, &at, Fineness::MIDDLE);
                if cost.is_finite() {
                    places.push(SearchPoint {
                        chart,
                        at,
                        cost,
                        converged: false,
                    });
                }
            }
        }
    }

    /// The law of the end of a descent, at the first reading.
    fn found(&mut self, end: &SearchPoint) -> Option<FoundMinimum> {
        let (record, length) = (&self.full, self.readings.length_days());
        let (chart, shape) = (end.chart, end.chart.shape(&end.at));
        let curve = &mut self.descent.curve;
        if !curve.solve(&shape, 1.0, Fineness::EXACT) && !curve.solve(&shape, 1.0, Fineness::FINE) {
            return None;
        }
        let anchor = chart.anchor();
        let mut basis = vec![0.0; record.count()];
        curve.follow(&CurveWindow::WHOLE, record.times(anchor), &mut basis, None);
        let projected = record.project(anchor, &basis)?;
        let velocity = match record.quantity {
            Quantity::Velocity => projected.velocity,
            // Displacement from the end was counted backwards.
            Quantity::Displacement => projected.velocity.abs() / length,
        };
        let (law, slip) = match anchor {
            Anchor::Start => (chart.law(&shape, velocity, length), 0.0),
            Anchor::End => {
                let mut rates = LawCurve::new(Quantity::Velocity);
                if !rates.solve(&shape, 1.0, Fineness::FINE) {
                    return None;
                }
                let ln_y = rates.last_ln_y(&shape);
                let law = chart.law(&shape.moved(ln_y), velocity * (-ln_y).exp(), length);
                (
                    law,
                    basis.last().map_or(0.0, |last| last * projected.velocity),
                )
            }
        };
        let at_start = match record.quantity {
            Quantity::Velocity => 0.0,
            Quantity::Displacement => projected.offset + slip,
        };
        let place = if self.holds_m() || !is_at_bound_of_m(end) {
            EndOfSearch::Inside
        } else {
            EndOfSearch::AtBoundOfM
        };
        let solution = self
            .readings
            .solution(&law, at_start, projected.cost, place);
        Some(FoundMinimum {
            solution,
            cost: projected.cost,
            converged: end.converged,
        })
    }

    fn found_line(&mut self, line: &UnitMLine) -> Option<FoundMinimum> {
        let length = self.readings.length_days();
        let (law, at_start) = self.lines.law(&self.full, line, length)?;
        let solution = self
            .readings
            .solution(&law, at_start, line.cost, EndOfSearch::Inside);
        Some(FoundMinimum {
            solution,
            cost: line.cost,
            converged: true,
        })
    }
}

/// Goes to the floor, and where m has run to its bound from the corner without a steady state too: an
/// exponential lies there, at the end of a valley that hardly falls.
fn refine(descent: &mut Descent, record: &WeightedRecord, place: &mut SearchPoint, holds_m: bool) {
    go_down(descent, record, place, holds_m);
    if !holds_m && is_at_bound_of_m(place) {
        let mut corner = *place;
        corner.at[1] = place.chart.corners().1[1];
        corner.cost = f64::INFINITY;
        go_down(descent, record, &mut corner, holds_m);
        if corner.cost < place.cost {
            *place = corner;
        }
    }
}

/// Goes down, again as long as it gains: a curved valley stalls a descent before its floor.
fn go_down(descent: &mut Descent, record: &WeightedRecord, place: &mut SearchPoint, holds_m: bool) {
    for _ in 0..MOST_RESTARTS {
        let next = descent.descend(record, place, &WHOLLY, holds_m);
        let gain = place.cost - next.cost;
        if next.cost <= place.cost {
            *place = next;
        }
        if gain <= RESTART_GAIN * next.cost || !gain.is_finite() && !next.cost.is_finite() {
            break;
        }
    }
}

/// The lowest cost of all places, or of those in one direction.
fn lowest(places: &[SearchPoint], direction: Option<Direction>) -> f64 {
    let of = |place: &&SearchPoint| direction.is_none_or(|wanted| place.chart.direction == wanted);
    let costs = places.iter().filter(of).map(|place| place.cost);
    costs.fold(f64::INFINITY, f64::min)
}

fn sort(places: &mut Vec<SearchPoint>) {
    places.retain(|place| place.cost.is_finite());
    places.sort_by(|a, b| a.cost.total_cmp(&b.cost));
}

fn is_same_group(a: &SearchPoint, b: &SearchPoint) -> bool {
    (a.chart.branch, a.chart.direction) == (b.chart.branch, b.chart.direction)
}

/// The first places of each branch and direction, few of them from the same m: one bad valley must not
/// take them all.
fn of_each(places: &[SearchPoint], breadth: Breadth) -> Vec<SearchPoint> {
    let mut taken: Vec<SearchPoint> = Vec::new();
    for place in places {
        let group = || taken.iter().filter(|one| is_same_group(one, place));
        let same_m = group().filter(|one| one.at[2].total_cmp(&place.at[2]).is_eq());
        if same_m.count() < breadth.nearly_of_one_m && group().count() < breadth.nearly {
            taken.push(*place);
        }
    }
    taken
}

/// The places that may turn out best when all readings count, and the best on each side of m = 1.
fn worth_all_readings(near: &[SearchPoint], breadth: Breadth) -> Vec<SearchPoint> {
    let lowest = lowest(near, None);
    let is_above_one = |place: &SearchPoint| place.chart.branch == Branch::AboveOne;
    let mut taken: Vec<SearchPoint> = Vec::new();
    for place in near {
        let has_side = taken
            .iter()
            .any(|one| is_above_one(one) == is_above_one(place));
        let is_first = !taken.iter().any(|one| is_same_group(one, place));
        let within = if is_first {
            FIRST_WITHIN.max(breadth.closely_within)
        } else {
            breadth.closely_within
        };
        let is_near = place.cost <= within * lowest;
        if !has_side || (taken.len() < breadth.closely && is_near) {
            taken.push(*place);
        }
    }
    taken
}

fn is_at_bound_of_m(end: &SearchPoint) -> bool {
    let (low, high) = end.chart.corners_beside(&end.at);
    let side = end.at[2] <= low[2] + AT_BOUND || end.at[2] >= high[2] - AT_BOUND;
    side && end.at[2].abs() > AT_BOUND
}
