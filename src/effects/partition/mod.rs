//! Benchmarks that move as one until a time, and as groups after it.
//!
//! To move as one is to move in constant proportion, whatever the common motion does. A group is known by a
//! proportion that stays changed: one instrument's offset or stray reading makes none.

mod alignment;
mod ratio;
mod scan;
mod surrogate;

use super::explanation::{Candidate, Effect};
use super::kind::Kind;
use super::options::Options;
use crate::reading::{BenchmarkId, Series, Timestamp, after_days};
use alignment::Alignment;
use ratio::Pair;
use scan::{Break, LEAST_CHANGE, Scan, apart};
use std::ops::Range;

/// A partition is accepted with a chance under this of being noise.
const P_VALUE: f64 = 0.01;
/// What moves as one strays from the common motion by less than this share of it.
pub(super) const AS_ONE: f64 = 0.12;

/// How benchmarks parted.
#[derive(Debug, Clone, PartialEq)]
pub struct Partition {
    /// When.
    pub at: Timestamp,
    /// Between when and when, 90 %.
    pub at_interval: [Timestamp; 2],
    /// Who stayed together, in the order given; those whose record does not fit the others' are in none.
    pub groups: Vec<Vec<BenchmarkId>>,
    /// The velocity of the second group over that of the first, at the end against before.
    pub size: f64,
    /// Fall of the BIC against constant proportions.
    pub bic_gain: f64,
    /// Chance that noise alone shows as much.
    pub p_value: f64,
    /// Whether the proportions pass for constant on both sides of the break.
    pub is_full: bool,
}

impl Partition {
    /// As one of the effects.
    pub fn effect(&self) -> Effect {
        Effect {
            at: Some(self.at),
            at_interval: Some(self.at_interval),
            groups: Some(self.groups.clone()),
            size: Some(self.size),
            bic_gain: self.bic_gain,
            p_value: Some(self.p_value),
            ..Effect::of(Kind::PARTITION)
        }
    }
}

/// Looks whether benchmarks that moved as one part into groups; the second says why not, where there is none.
/// Deterministic for a seed of `options`, of which the number of surrogates and the margin count too.
pub fn partition(series: &[&Series], options: &Options) -> (Option<Partition>, Candidate) {
    let mut candidate = Candidate {
        effect: Kind::PARTITION,
        channel: None,
        form: None,
        at: None,
        lag_days: None,
        bic_gain: 0.0,
        p_value: None,
        held_out: None,
        rejected_because: None,
    };
    match search(series, options, &mut candidate) {
        Ok(found) => (Some(found), candidate),
        Err(reason) => {
            candidate.rejected_because = Some(reason);
            (None, candidate)
        }
    }
}

/// The same for one benchmark among its neighbours. Nothing where it has none.
pub fn partition_candidate(
    series: &Series,
    neighbours: &[&Series],
    options: &Options,
) -> (Option<Effect>, Option<Candidate>) {
    let others = neighbours
        .iter()
        .copied()
        .filter(|one| one.benchmark != series.benchmark);
    let all: Vec<&Series> = std::iter::once(series).chain(others).collect();
    if all.len() < 2 {
        return (None, None);
    }
    let (found, mut candidate) = partition(&all, options);
    let takes_part = |found: &Partition| {
        found
            .groups
            .iter()
            .flatten()
            .any(|one| *one == series.benchmark)
    };
    let found = found.filter(takes_part);
    if found.is_none() && candidate.rejected_because.is_none() {
        candidate.rejected_because =
            Some("its neighbours parted, and its own record does not reach".to_owned());
    }
    (found.map(|found| found.effect()), Some(candidate))
}

fn search(
    series: &[&Series],
    options: &Options,
    candidate: &mut Candidate,
) -> Result<Partition, String> {
    let aligned = Alignment::of(series).ok_or_else(|| {
        format!(
            "fewer than {} times at which two benchmarks or more move and are known",
            alignment::FEWEST_TIMES
        )
    })?;
    let scan = Scan::of(&aligned.rows).ok_or("a benchmark does not move")?;
    let found = scan.strongest().ok_or("too few times in common")?;
    candidate.bic_gain = found.gain;
    candidate.at = after_days(aligned.epoch, aligned.days[found.column]);
    if found.gain < options.bic_margin {
        return Err("the proportions stay constant".to_owned());
    }
    if found.factors.len() > 2 && 2 * found.factors.len() > found.groups.len() {
        return Err("the benchmarks move independently, not in groups".to_owned());
    }
    stray(&scan, &aligned, &found)?;
    let p_value = surrogate::p_value(&scan, &found, options.surrogates, options.seed);
    candidate.p_value = Some(p_value);
    let enough = P_VALUE.max(1.0 / (1.0 + options.surrogates as f64));
    if p_value > enough {
        return Err("noise alone shows as much".to_owned());
    }
    let furthest = (1..found.factors.len())
        .max_by(|a, b| apart(found.factors[*a]).total_cmp(&apart(found.factors[*b])))
        .ok_or("the proportions stay constant")?;
    let (pair, is_turned) = Pair::of(&scan, &aligned.days, &aligned.rows, &found, (0, furthest));
    let course = pair.course()?;
    if apart(course.most) < LEAST_CHANGE {
        return Err("the ratio of the velocities hardly changes".to_owned());
    }
    let time = |days| after_days(aligned.epoch, days).ok_or("outside the calendar");
    let at = time(course.at)?;
    candidate.at = Some(at);
    let members = |group: usize| {
        let rows = (0..found.groups.len()).filter(|row| found.groups[*row] == group);
        rows.map(|row| series[aligned.members[row]].benchmark.clone())
            .collect()
    };
    // The first group and the one furthest from it stand first.
    let others = (1..found.factors.len()).filter(|group| *group != furthest);
    Ok(Partition {
        at,
        at_interval: [time(course.interval.0)?, time(course.interval.1)?],
        groups: [0, furthest]
            .into_iter()
            .chain(others)
            .map(members)
            .collect(),
        size: if is_turned {
            1.0 / course.size
        } else {
            course.size
        },
        bic_gain: found.gain,
        p_value,
        is_full: !course.is_left,
    })
}

/// Refuses benchmarks that had not moved as one before, and groups that do not after.
fn stray(scan: &Scan, aligned: &Alignment, found: &Break) -> Result<(), String> {
    let rows: Vec<usize> = (0..aligned.rows.len()).collect();
    // Column k is of the time k + 1, and the break lies in a column.
    if !are_one(scan, aligned, found, (&rows, 0..found.column + 1)) {
        return Err("the benchmarks had not moved as one before".to_owned());
    }
    for group in 0..found.factors.len() {
        let members: Vec<usize> = rows
            .iter()
            .copied()
            .filter(|row| found.groups[*row] == group)
            .collect();
        if !are_one(
            scan,
            aligned,
            found,
            (&members, found.column + 1..aligned.days.len()),
        ) {
            return Err("the groups do not move as one after".to_owned());
        }
    }
    Ok(())
}

/// Whether the displacements of some rows, at some times, stay in proportion.
fn are_one(
    scan: &Scan,
    aligned: &Alignment,
    found: &Break,
    (rows, times): (&[usize], Range<usize>),
) -> bool {
    let centred = |row: usize| {
        let values = times
            .clone()
            .map(|time| aligned.rows[row][time] / scan.scales[row]);
        let mean = values.clone().sum::<f64>() / times.len() as f64;
        values.map(|value| value - mean).collect::<Vec<f64>>()
    };
    let own: Vec<Vec<f64>> = rows.iter().map(|row| centred(*row)).collect();
    let weight: f64 = rows.iter().map(|row| found.loadings[*row].powi(2)).sum();
    let common: Vec<f64> = (0..times.len())
        .map(|time| {
            rows.iter()
                .zip(&own)
                .map(|(row, own)| found.loadings[*row] * own[time])
                .sum::<f64>()
                / weight
        })
        .collect();
    rows.iter().zip(&own).all(|(row, own)| {
        let off = own
            .iter()
            .zip(&common)
            .map(|(own, common)| (own - found.loadings[*row] * common).powi(2));
        let rms = (off.sum::<f64>() / own.len() as f64).sqrt();
        let low = own.iter().copied().fold(f64::INFINITY, f64::min);
        let high = own.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        rms <= AS_ONE * (high - low)
    })
}
