//! The law's parameters at its start: the best fit's, which starts at the first reading, and what the
//! posterior of a constant load leaves open, each law of it at its own onset.
//!
//! A bound is null where it is the prior's and not the readings': m's where more than 4 % of the
//! probability stands in the outermost 5 % of the prior's range of p on that side, the others' where
//! most of the tail beyond the bound does; those of `x_i`, T and D also where m may be on either side of 1.

use super::{Inversion, law_in_mm_per_day};
use crate::fit::{Exponent, LawDraws, LawSample, P_PRIOR, Solution};
use crate::model::{Accuracy, Law, Trajectory};
use schemars::JsonSchema;
use serde::Serialize;

/// A best value and the bounds of 90 %.
#[derive(Debug, Clone, Copy, Default, PartialEq, JsonSchema, Serialize)]
pub struct Estimate {
    /// Of the best fit; `None` where that law has none.
    pub best: Option<f64>,
    /// 5 % quantile; `None` where it is unbounded.
    pub low: Option<f64>,
    /// 95 % quantile; `None` where it is unbounded.
    pub high: Option<f64>,
}

/// The law's parameters at the first reading.
#[derive(Debug, Clone, Copy, Default, PartialEq, JsonSchema, Serialize)]
pub struct Parameters {
    /// m = B/A.
    pub m: Estimate,
    /// Initial state.
    pub x_i: Estimate,
    /// T, days.
    pub t_unit_days: Estimate,
    /// D, in the readings' velocity unit (for displacements, their length per day).
    pub d: Estimate,
    /// `D_c`, in the readings' length.
    pub d_c: Estimate,
    /// S `theta_i`.
    pub s_theta_i: Estimate,
    /// Velocity, in the unit of D.
    pub v_i: Estimate,
    /// Initial slope of the inverse-velocity plot, 1/day.
    pub r_per_day: Estimate,
    /// Its curvature, 1/day.
    pub kappa_per_day: Estimate,
}

/// Quantiles that bound 90 %.
const LOW: f64 = 0.05;
const HIGH: f64 = 0.95;
/// The outermost share of the prior's range of p.
const EDGE: f64 = 0.05;
/// More probability than this at an edge leaves m unbounded there.
const MOST_AT_EDGE: f64 = 0.04;

/// One set of parameters, in the units of the report.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ParameterValues {
    pub(super) m: Option<f64>,
    pub(super) x_i: Option<f64>,
    pub(super) t_unit_days: Option<f64>,
    pub(super) d: Option<f64>,
    pub(super) d_c: Option<f64>,
    pub(super) s_theta_i: Option<f64>,
    pub(super) v_i: Option<f64>,
    pub(super) r_per_day: Option<f64>,
    pub(super) kappa_per_day: Option<f64>,
}

/// The parameters of the best fit.
pub(super) fn best(inversion: &Inversion, solution: Option<&Solution>) -> ParameterValues {
    solution.map_or_else(ParameterValues::default, |solution| {
        values(inversion, &law_in_mm_per_day(inversion, solution))
    })
}

/// Best values and their intervals.
pub(super) fn parameters(
    inversion: &Inversion,
    solution: Option<&Solution>,
    posterior: Option<&LawDraws>,
) -> Parameters {
    let best = best(inversion, solution);
    let samples = posterior.map_or_else(Vec::new, |posterior| at_start(inversion, posterior));
    let of_m = samples.as_slice();
    // x_i, T and D have their pole at m = 1: bounds on either side of it would bound nothing.
    let of_x = if stands_on_both_sides(&samples) {
        &[]
    } else {
        of_m
    };
    let with = |best: Option<f64>, of: &[Drawn], pick: &dyn Fn(&ParameterValues) -> Option<f64>| {
        Estimate {
            best,
            low: bound(of, BoundSide::Low, pick),
            high: bound(of, BoundSide::High, pick),
        }
    };
    Parameters {
        m: exponent(inversion, best.m, of_m),
        x_i: with(best.x_i, of_x, &|values| values.x_i),
        t_unit_days: with(best.t_unit_days, of_x, &|values| values.t_unit_days),
        d: with(best.d, of_x, &|values| values.d),
        d_c: with(best.d_c, of_m, &|values| values.d_c),
        s_theta_i: with(best.s_theta_i, of_m, &|values| values.s_theta_i),
        v_i: with(best.v_i, &samples, &|values| values.v_i),
        r_per_day: with(best.r_per_day, &samples, &|values| values.r_per_day),
        kappa_per_day: with(best.kappa_per_day, &samples, &|values| values.kappa_per_day),
    }
}

/// A law of the posterior, at its onset.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    values: ParameterValues,
    weight: f64,
    at_edge: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BoundSide {
    Low,
    High,
}

/// The posterior's laws, which start at the last rate, followed back to where each begins to hold.
fn at_start(inversion: &Inversion, posterior: &LawDraws) -> Vec<Drawn> {
    let back = |(sample, span): (&LawSample, &f64)| {
        let past = Trajectory::solve(&sample.law.reversed(), *span, Accuracy::Fit);
        let law = sample.law.from_y(past.at(*span)?.y);
        let width = EDGE * (P_PRIOR.1 - P_PRIOR.0);
        Some(Drawn {
            values: values(inversion, &law),
            weight: sample.weight,
            at_edge: law.p < P_PRIOR.0 + width || law.p > P_PRIOR.1 - width,
        })
    };
    let samples = posterior.ensemble.samples.iter();
    samples
        .zip(&posterior.spans_days)
        .filter_map(back)
        .collect()
}

/// Whether more than the share that an edge may hold has m above 1, and as much below.
fn stands_on_both_sides(samples: &[Drawn]) -> bool {
    let share = |above: bool| {
        let met = samples
            .iter()
            .filter(|one| one.values.m.is_some_and(|m| (m > 1.0) == above));
        met.map(|one| one.weight).sum::<f64>()
    };
    share(true) > MOST_AT_EDGE && share(false) > MOST_AT_EDGE
}

/// The parameters of a law whose velocity is in mm/day.
fn values(inversion: &Inversion, law: &Law) -> ParameterValues {
    let velocity = inversion.velocity_per_mm_per_day();
    let millimetres = inversion.length_unit().millimetres();
    let paper = law.paper();
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    // Underflow is as little a value as overflow.
    let normal = |value: Option<f64>| value.filter(|value| value.is_normal());
    ParameterValues {
        m: finite(paper.m),
        x_i: normal(paper.x_i),
        t_unit_days: normal(paper.t_unit_days),
        d: normal(paper.d.map(|d| d * velocity)),
        d_c: normal(paper.d_c.map(|d_c| d_c / millimetres)),
        s_theta_i: normal(paper.s_theta_i),
        v_i: finite(law.v_i * velocity),
        r_per_day: finite(law.r),
        kappa_per_day: finite(law.kappa),
    }
}

fn exponent(inversion: &Inversion, best: Option<f64>, samples: &[Drawn]) -> Estimate {
    if let Exponent::Fixed(m) = inversion.options.exponent {
        return Estimate {
            best: best.and(Some(m)),
            low: best.and(Some(m)),
            high: best.and(Some(m)),
        };
    }
    let at_edge = |above: bool| {
        let edge = samples
            .iter()
            .filter(|one| one.at_edge && one.values.m.is_some_and(|m| (m > 1.0) == above));
        edge.map(|one| one.weight).sum::<f64>()
    };
    let quantile_of_m = |side| quantile(samples, side, &|values| values.m).map(|(m, _)| m);
    Estimate {
        best,
        low: quantile_of_m(BoundSide::Low).filter(|_| at_edge(false) <= MOST_AT_EDGE),
        high: quantile_of_m(BoundSide::High).filter(|_| at_edge(true) <= MOST_AT_EDGE),
    }
}

/// One bound of 90 %, unless the tail beyond it is the prior's.
fn bound(
    samples: &[Drawn],
    side: BoundSide,
    pick: &dyn Fn(&ParameterValues) -> Option<f64>,
) -> Option<f64> {
    let (value, at_edge) = quantile(samples, side, pick)?;
    (at_edge <= 0.5).then_some(value)
}

/// The quantile on one side, and the share of the tail beyond it that stands at an edge of the prior.
/// Samples without the value (it lies beyond what a number can hold) count as beyond either bound.
fn quantile(
    samples: &[Drawn],
    side: BoundSide,
    pick: &dyn Fn(&ParameterValues) -> Option<f64>,
) -> Option<(f64, f64)> {
    let total: f64 = samples.iter().map(|one| one.weight).sum();
    let with = samples
        .iter()
        .filter_map(|one| Some((pick(&one.values)?, one)));
    let mut sorted: Vec<(f64, &Drawn)> = with.collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    if side == BoundSide::High {
        sorted.reverse();
    }
    let held: f64 = sorted.iter().map(|(_, one)| one.weight).sum();
    let tail = total
        * if side == BoundSide::Low {
            LOW
        } else {
            1.0 - HIGH
        };
    let (mut reached, mut at_edge) = (total - held, 0.0);
    if reached >= tail || samples.is_empty() {
        return None;
    }
    for (value, one) in sorted {
        reached += one.weight;
        if one.at_edge {
            at_edge += one.weight;
        }
        if reached >= tail {
            return Some((value, at_edge / reached));
        }
    }
    None
}
