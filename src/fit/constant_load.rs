//! The inversion of the constant-load law by unweighted least squares: global, over every branch of m.
//!
//! Velocity and zero are projected out; what is left is three numbers, and for each m the laws are one
//! curve, stretched and shifted in time. Nothing is random.

use super::chart::{Branch, HIGHEST_M, LEAST_LN_M, LOWEST_M};
use super::global_search::{FoundMinimum, GlobalSearch};
use super::lattice::Lattice;
use super::point_readings::PointReadings;
use super::solution::{EndOfSearch, Exponent, Solution};
use crate::model::Law;
use std::fmt;

/// Why an inversion ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FitOutcome {
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
    /// Displacements on one rising line, to the last digit: interpolated, or a constant velocity without an instrument's error.
    StraightLine,
    /// No law that moves forward fits better than none.
    NoForwardMotion,
    /// The m asked for is no law, or outside the box.
    NotAnExponent(f64),
}

impl FitOutcome {
    /// Whether the readings hold no motion that any law, or any regime, could be distinguished from.
    pub fn says_nothing(&self) -> bool {
        match self {
            Self::TooFew { .. } | Self::AllEqual | Self::StraightLine | Self::NoForwardMotion => {
                true
            }
            Self::Converged | Self::AtBoundOfM(_) | Self::Stopped | Self::NotAnExponent(_) => false,
        }
    }
}

impl fmt::Display for FitOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converged => f.write_str("converged"),
            Self::AtBoundOfM(m) => write!(f, "m at its bound: {m:.4}"),
            Self::Stopped => f.write_str("stopped at the bound on evaluations"),
            Self::TooFew { given, needed } => {
                write!(f, "too few readings: {given}, at least {needed} needed")
            }
            Self::AllEqual => f.write_str("all readings are equal"),
            Self::StraightLine => f.write_str(
                "all readings lie exactly on one straight line, without any scatter: they allow no judgement of the regime",
            ),
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
    pub outcome: FitOutcome,
}

/// Minima kept beside the best with m > 1, m = 1 and m < 1.
const MOST_MINIMA: usize = 8;
/// Relative difference of rms under which two results are one minimum.
const SAME_RMS: f64 = 1e-3;
/// A branch that gains less than this on m = 1, relative to its rms, has run into m = 1.
const GAIN_OVER_UNIT_M: f64 = 1e-7;
/// A minimum must leave less than this share of the rms about a constant velocity.
const WORTH_MENTION: f64 = 0.999;
/// And no more than so many times the rms of the best.
const WORST: f64 = 3.0;

impl ConstantLoad {
    /// Inverts the readings.
    pub fn fit(readings: &PointReadings, exponent: Exponent) -> Self {
        Self::fit_on(readings, exponent, Lattice::Regular)
    }

    /// The same, begun at other places.
    pub fn fit_on(readings: &PointReadings, exponent: Exponent, lattice: Lattice) -> Self {
        if let Some(outcome) = refuse(readings, exponent) {
            return Self {
                minima: Vec::new(),
                evaluations: 0,
                outcome,
            };
        }
        let mut search = GlobalSearch::new(readings, exponent, lattice);
        let found = search.run();
        conclude(&search, readings, found, exponent)
    }

    /// The best of all.
    pub fn best(&self) -> Option<&Solution> {
        self.minima.first()
    }
}

/// What makes an inversion pointless.
fn refuse(readings: &PointReadings, exponent: Exponent) -> Option<FitOutcome> {
    let is_one = exponent == Exponent::Fixed(1.0);
    if let Exponent::Fixed(m) = exponent
        && !(is_one || (Branch::of(m).is_some() && (LOWEST_M..=HIGHEST_M).contains(&m)))
    {
        return Some(FitOutcome::NotAnExponent(m));
    }
    let nonlinear = if exponent == Exponent::Free { 3 } else { 2 };
    let (given, needed) = (readings.count(), readings.linear_unknowns() + nonlinear + 1);
    if given < needed {
        return Some(FitOutcome::TooFew { given, needed });
    }
    if readings.all_equal() {
        return Some(FitOutcome::AllEqual);
    }
    readings
        .is_rising_line()
        .then_some(FitOutcome::StraightLine)
}

/// Ranks what was found.
fn conclude(
    search: &GlobalSearch,
    readings: &PointReadings,
    mut found: Vec<FoundMinimum>,
    exponent: Exponent,
) -> ConstantLoad {
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    prefer_unit_m(&mut found);
    let outcome = match found.first() {
        None => FitOutcome::NoForwardMotion,
        Some(best) if !best.converged => FitOutcome::Stopped,
        Some(best) if best.solution.place == EndOfSearch::AtBoundOfM => {
            FitOutcome::AtBoundOfM(m_of(&best.solution))
        }
        Some(_) => FitOutcome::Converged,
    };
    let flat = readings.rms(search.cost_of_no_change());
    ConstantLoad {
        minima: distinct(&found, flat, exponent),
        evaluations: search.evaluations(),
        outcome,
    }
}

fn m_of(solution: &Solution) -> f64 {
    1.0 / (1.0 - solution.law.p)
}

/// Where a branch has only run into m = 1, that is the better account; what is left of the branch is
/// the law next to it, whose `x_i`, T and D mean nothing.
fn prefer_unit_m(found: &mut [FoundMinimum]) {
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
        one.solution.place = EndOfSearch::Inside;
    }
    let gains = |one: &FoundMinimum| one.solution.rms < unit_rms * (1.0 - GAIN_OVER_UNIT_M);
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

/// The branch of m on which a law stands; none at m = 1.
fn branch(law: &Law) -> Option<Branch> {
    Branch::of(1.0 / (1.0 - law.p))
}

/// The minima that differ, best first, and the best of m > 1, m = 1 and m < 1 whatever their worth.
fn distinct(found: &[FoundMinimum], flat: f64, exponent: Exponent) -> Vec<Solution> {
    let best = found.first().map_or(0.0, |best| best.solution.rms);
    let mut kept: Vec<Solution> = Vec::new();
    for FoundMinimum { solution, .. } in found {
        let first_of_side = kept.iter().all(|one| side(&one.law) != side(&solution.law));
        let same = |one: &Solution| {
            let bound = solution.place == EndOfSearch::AtBoundOfM && one.place == solution.place;
            let close = (one.rms - solution.rms).abs() <= SAME_RMS * solution.rms;
            (close || bound)
                && branch(&one.law) == branch(&solution.law)
                && (one.law.r > 0.0) == (solution.law.r > 0.0)
        };
        let is_reported = solution.rms < WORTH_MENTION * flat && solution.rms <= WORST * best;
        let new = is_reported && !kept.iter().any(same);
        if first_of_side || (new && kept.len() < MOST_MINIMA && exponent == Exponent::Free) {
            kept.push(*solution);
        }
    }
    kept
}
