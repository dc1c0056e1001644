//! Benchmarks that fail together: one failure time for those that share it, and which of them do.
//!
//! Given the time at which a mass fails, its benchmarks are independent but for the load that they share:
//! each has its own m and D. What benchmark i says alone, `p_i`, is a density over ln of the remaining time
//! with a cell for "never", under the prior `p0`, flat in ln of the time and even between a failure and
//! none. A group then says `p0 * product (p_i / p0)^w`, and it is a group as far as its parts agree better
//! about one failure time than each about its own: the Bayes factor of two parts is the sum of `p_a p_b / p0`.
//!
//! The shared load moves all forecasts alike. With a correlation rho of their errors (`dependence`), n equally sharp
//! forecasts are worth `n / (1 + (n - 1) rho)` independent ones, hence `w = 1 / (1 + (n - 1) rho)`, where n
//! counts forecasts by their sharpness, so that one that says little takes nothing from one that says much.
//!
//! The best partition is found by agglomeration from single benchmarks. A forecast wavers from one reading
//! to the next, and membership does not: the ln of a Bayes factor is its mean over snapshots of late, late being
//! measured by the time that is left.

use super::{Dependence, HORIZON_DAYS, Passage};
use crate::fit::FINEST_DAYS;

/// How far apart, in ln of the remaining time, the members of one mass may fail: standard deviation, and
/// the bandwidth of the densities.
const SCATTER: f64 = 0.05;
/// Chance that a benchmark's forecast says nothing of its failure.
const DOUBT: f64 = 0.03;
/// Prior chance of no failure within the horizon.
const NEVER: f64 = 0.5;
/// Prior odds that two benchmarks of one site fail together.
const ODDS: f64 = 4.0;
/// An agreement is judged over the snapshots at which this many times as long was left, at most.
const LATE: f64 = 1.4;
/// The grid: its first time, days, the width of a cell in ln of the time, and as many cells as reach the
/// horizon.
const SOONEST: f64 = FINEST_DAYS / 8.0;
const CELL: f64 = 0.025;
const CELLS: usize = 478;
/// Times in a cell by which it is said.
const WITHIN: u32 = 8;
/// Reach of the kernel, cells.
const REACH: usize = 10;
/// With less than this chance that it has not failed yet, a forecast that is overtaken says nothing.
const OVERTAKEN: f64 = 0.02;

/// What one benchmark predicts: how likely its readings are for each failure time, the last for none.
#[derive(Debug, Clone, PartialEq)]
pub struct FailureTimeLikelihood {
    /// By cell of the grid of failure times, the last for none.
    of_each_time: Vec<f64>,
    /// Their logarithms.
    ln_of_each_time: Vec<f64>,
    /// What its posterior alone says beyond the prior: of a narrow one, as one over its width.
    sharpness: f64,
}

/// What all benchmarks of a site predict at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// From then to the failure that is expected by now, days.
    pub left_days: f64,
    /// One of every benchmark, where it has one.
    pub likelihoods: Vec<Option<FailureTimeLikelihood>>,
}

/// Benchmarks that fail together, or one alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Places of its benchmarks in a snapshot, in order.
    pub members: Vec<usize>,
    /// Probability of each that it belongs there; of one alone, that it belongs to no other group.
    pub probabilities: Vec<f64>,
    /// The first snapshot from which on it has been just this group.
    pub since: usize,
    /// When it fails, from the last snapshot.
    pub passage: Passage,
}

/// Probabilities of the cells, the last that of no failure.
type Density = Vec<f64>;

impl FailureTimeLikelihood {
    /// That of `passage`, seen `later_days` after it was made without a failure.
    pub fn of(passage: &Passage, later_days: f64) -> Self {
        let mut density = vec![0.0; CELLS + 1];
        let to_come = passage.times().iter();
        let to_come = to_come.map(|(days, share)| (days - later_days, share));
        for (days, share) in to_come.filter(|(days, _)| *days > 0.0) {
            density[cell(days)] += share;
        }
        let left = 1.0 - passage.chance_within(later_days.max(0.0));
        if left < OVERTAKEN {
            return Self::nothing();
        }
        let within: f64 = density[..CELLS].iter().sum();
        density[CELLS] += (left - within).max(0.0);
        smooth(&mut density[..CELLS]);
        let total: f64 = density.iter().sum();
        let likelihood = density.iter().enumerate().map(|(index, share)| {
            DOUBT + (1.0 - DOUBT) * share / total.max(f64::MIN_POSITIVE) / prior(index)
        });
        Self::new(likelihood.collect())
    }

    fn new(of_each_time: Vec<f64>) -> Self {
        let ln_of_each_time = of_each_time.iter().map(|one| one.ln()).collect();
        let mut likelihood = Self {
            of_each_time,
            ln_of_each_time,
            sharpness: 0.0,
        };
        likelihood.sharpness = information(&posterior(&[&likelihood], 1.0)).exp();
        likelihood
    }

    /// The same where it counts only with a probability.
    fn believed(&self, probability: f64) -> Self {
        let likelihood = self.of_each_time.iter();
        Self::new(
            likelihood
                .map(|one| 1.0 - probability + probability * one)
                .collect(),
        )
    }

    /// One that says nothing.
    fn nothing() -> Self {
        Self::new(vec![1.0; CELLS + 1])
    }
}

/// The groups that the snapshots support, oldest snapshot first, in the order of their first benchmarks.
pub fn groups(snapshots: &[Snapshot], dependence: &Dependence) -> Vec<Group> {
    let Some(count) = snapshots
        .iter()
        .map(|snapshot| snapshot.likelihoods.len())
        .min()
    else {
        return Vec::new();
    };
    let last = snapshots.len() - 1;
    let found = partition(window(snapshots, last), dependence, count);
    let mut groups: Vec<Group> = found
        .iter()
        .map(|part| Group {
            members: part.members.clone(),
            probabilities: belonging(window(snapshots, last), dependence, part, &found),
            since: last,
            passage: common_passage(&snapshots[last].likelihoods, dependence, &part.members),
        })
        .collect();
    let mut open = vec![true; groups.len()];
    for snapshot in (0..last).rev() {
        if open.iter().all(|open| !open) {
            break;
        }
        let before = partition(window(snapshots, snapshot), dependence, count);
        for (group, open) in groups.iter_mut().zip(&mut open) {
            *open &= before.iter().any(|part| part.members == group.members);
            if *open {
                group.since = snapshot;
            }
        }
    }
    groups.sort_by(|a, b| a.members.cmp(&b.members));
    groups
}

/// The late snapshots as seen at one of them.
fn window(snapshots: &[Snapshot], last: usize) -> &[Snapshot] {
    let is_early = |snapshot: &Snapshot| snapshot.left_days > LATE * snapshots[last].left_days;
    let early = snapshots[..last]
        .iter()
        .take_while(|snapshot| is_early(snapshot));
    &snapshots[early.count()..=last]
}

/// Benchmarks taken as one, with what they say at each snapshot.
#[derive(Debug, Clone)]
struct GroupPart {
    members: Vec<usize>,
    snapshots: Vec<Density>,
}

impl GroupPart {
    fn of(window: &[Snapshot], dependence: &Dependence, mut members: Vec<usize>) -> Self {
        members.sort_unstable();
        let shared = dependence.among(&members);
        let snapshot = |snapshot: &Snapshot| {
            let likelihoods = members
                .iter()
                .filter_map(|member| snapshot.likelihoods[*member].as_ref());
            combined(&likelihoods.collect::<Vec<_>>(), shared)
        };
        Self {
            snapshots: window.iter().map(snapshot).collect(),
            members,
        }
    }

    /// ln of the odds that these two are one.
    fn ln_odds(&self, other: &Self) -> f64 {
        let each = self.snapshots.iter().zip(&other.snapshots);
        let ln: f64 = each.map(|(a, b)| agreement(a, b).ln()).sum();
        ODDS.ln() + ln / self.snapshots.len() as f64
    }
}

/// When the benchmarks of `members` fail by their forecasts of now. The sharpest has its full weight, each
/// other as much as it is likely by now to share the failure of the rest: one that halts for a moment must
/// not lower the chance that the mass fails.
fn common_passage(
    now: &[Option<FailureTimeLikelihood>],
    dependence: &Dependence,
    members: &[usize],
) -> Passage {
    let shared = dependence.among(members);
    let known: Vec<&FailureTimeLikelihood> = members
        .iter()
        .filter_map(|one| now[*one].as_ref())
        .collect();
    let alone: Vec<Density> = known.iter().map(|one| posterior(&[*one], 1.0)).collect();
    let sharpest =
        (0..known.len()).max_by(|a, b| information(&alone[*a]).total_cmp(&information(&alone[*b])));
    let believed = (0..known.len()).map(|index| {
        if Some(index) == sharpest {
            return known[index].clone();
        }
        let rest = (0..known.len()).filter(|other| *other != index);
        let rest: Vec<&FailureTimeLikelihood> = rest.map(|other| known[other]).collect();
        let odds = ODDS * agreement(&alone[index], &combined(&rest, shared));
        known[index].believed(odds / (1.0 + odds))
    });
    let believed: Vec<FailureTimeLikelihood> = believed.collect();
    let common = combined(&believed.iter().collect::<Vec<_>>(), shared);
    // A cell's share is spread over it: a quantile is to be finer than the grid.
    let times = common[..CELLS]
        .iter()
        .enumerate()
        .flat_map(|(index, share)| {
            (0..WITHIN).map(move |step| {
                let place = index as f64 + (f64::from(step) + 0.5) / f64::from(WITHIN);
                (SOONEST * (place * CELL).exp(), share / f64::from(WITHIN))
            })
        });
    Passage::from_times(times.collect())
}

/// The Bayes factor of one failure time against two.
fn agreement(a: &Density, b: &Density) -> f64 {
    let cells = a.iter().zip(b).enumerate();
    let sum: f64 = cells.map(|(index, (a, b))| a * b / prior(index)).sum();
    sum.max(f64::MIN_POSITIVE)
}

/// Parts that no merging makes more probable.
fn partition(window: &[Snapshot], dependence: &Dependence, count: usize) -> Vec<GroupPart> {
    let mut parts: Vec<GroupPart> = (0..count)
        .map(|member| GroupPart::of(window, dependence, vec![member]))
        .collect();
    let mut ln_odds: Vec<Vec<f64>> = (0..count)
        .map(|i| (0..i).map(|j| parts[i].ln_odds(&parts[j])).collect())
        .collect();
    loop {
        let pairs = (0..parts.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let best = pairs.max_by(|a, b| ln_odds[a.0][a.1].total_cmp(&ln_odds[b.0][b.1]));
        let Some((i, j)) = best.filter(|(i, j)| ln_odds[*i][*j] > 0.0) else {
            return parts;
        };
        let gone = parts.remove(i);
        ln_odds.remove(i);
        for row in &mut ln_odds[i..] {
            row.remove(i);
        }
        let members = [parts[j].members.as_slice(), &gone.members].concat();
        parts[j] = GroupPart::of(window, dependence, members);
        for other in (0..parts.len()).filter(|other| *other != j) {
            ln_odds[other.max(j)][other.min(j)] = parts[j].ln_odds(&parts[other]);
        }
    }
}

/// How probably each member belongs where it is.
fn belonging(
    window: &[Snapshot],
    dependence: &Dependence,
    part: &GroupPart,
    all: &[GroupPart],
) -> Vec<f64> {
    let probability = |ln_odds: f64| 1.0 / (1.0 + (-ln_odds).exp());
    if part.members.len() == 1 {
        let others = all.iter().filter(|other| other.members != part.members);
        let nearest = others.map(|other| part.ln_odds(other));
        return vec![1.0 - nearest.map(probability).fold(0.0, f64::max)];
    }
    let members = part.members.iter().map(|member| {
        let rest = part.members.iter().filter(|other| *other != member);
        let rest = GroupPart::of(window, dependence, rest.copied().collect());
        probability(GroupPart::of(window, dependence, vec![*member]).ln_odds(&rest))
    });
    members.collect()
}

/// What all of `likelihoods` say under one failure time; `shared`: the correlation of their errors.
fn combined(likelihoods: &[&FailureTimeLikelihood], shared: f64) -> Density {
    let sharpness = likelihoods.iter().map(|likelihood| likelihood.sharpness);
    let (sum, squares) = sharpness.fold((0.0, 0.0), |(sum, squares), s: f64| {
        (sum + s, squares + s * s)
    });
    let count = if squares > 0.0 {
        sum * sum / squares
    } else {
        1.0
    };
    posterior(likelihoods, 1.0 / (1.0 + (count - 1.0) * shared))
}

/// The prior times all likelihoods to the power `weight`, normalised.
fn posterior(likelihoods: &[&FailureTimeLikelihood], weight: f64) -> Density {
    let (ln_a_cell, ln_never) = (prior(0).ln(), prior(CELLS).ln());
    let ln = |index: usize| {
        let each = likelihoods
            .iter()
            .map(|likelihood| likelihood.ln_of_each_time[index]);
        let ln_prior = if index < CELLS { ln_a_cell } else { ln_never };
        ln_prior + weight * each.sum::<f64>()
    };
    let ln: Vec<f64> = (0..=CELLS).map(ln).collect();
    let best = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let shares: Vec<f64> = ln.iter().map(|ln| (ln - best).exp()).collect();
    let total: f64 = shares.iter().sum();
    shares.into_iter().map(|share| share / total).collect()
}

/// What a density says that the prior does not, nats; of a narrow one, e to this grows as one over its width.
fn information(density: &Density) -> f64 {
    let cells = density
        .iter()
        .enumerate()
        .filter(|(_, share)| **share > 0.0);
    cells
        .map(|(index, share)| share * (share / prior(index)).ln())
        .sum()
}

fn prior(index: usize) -> f64 {
    if index == CELLS {
        NEVER
    } else {
        (1.0 - NEVER) / CELLS as f64
    }
}

/// Where a time falls; beyond the horizon into the cell of "never".
fn cell(days: f64) -> usize {
    let place = ((days / SOONEST).ln() / CELL).max(0.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and bounded"
    )]
    let index = place as usize;
    if days > HORIZON_DAYS {
        CELLS
    } else {
        index.min(CELLS - 1)
    }
}

/// Spreads every cell by [`SCATTER`]; what would leave the grid stays at its end.
fn smooth(cells: &mut [f64]) {
    let kernel: Vec<f64> = (0..=2 * REACH)
        .map(|step| {
            let off = (step as f64 - REACH as f64) * CELL / SCATTER;
            (-0.5 * off * off).exp()
        })
        .collect();
    let total: f64 = kernel.iter().sum();
    let sharp = cells.to_vec();
    cells.fill(0.0);
    for (index, share) in sharp.iter().enumerate() {
        for (step, weight) in kernel.iter().enumerate() {
            let to = (index + step).saturating_sub(REACH).min(sharp.len() - 1);
            cells[to] += share * weight / total;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A forecast whose ln is normal about that of `days`, two standard deviations being `width`.
    fn about(days: f64, width: f64) -> Passage {
        let of_step = |step: i32| f64::from(step) / 20.0;
        let share = |z: f64| (-0.5 * z * z).exp();
        let total: f64 = (-60..=60).map(|step| share(of_step(step))).sum();
        let times = (-60..=60).map(|step| {
            let z = of_step(step);
            (days * (0.5 * width * z).exp(), share(z) / total)
        });
        Passage::from_times(times.collect())
    }

    fn of_one_look(passages: &[Passage]) -> Vec<Group> {
        let likelihoods = passages
            .iter()
            .map(|one| Some(FailureTimeLikelihood::of(one, 0.0)));
        let snapshot = Snapshot {
            left_days: 10.0,
            likelihoods: likelihoods.collect(),
        };
        groups(&[snapshot], &Dependence::unknown(passages.len()))
    }

    fn width(passage: &Passage) -> f64 {
        let at = |share| passage.quantile(share, HORIZON_DAYS).unwrap();
        (at(0.95) / at(0.05)).ln()
    }

    #[test]
    fn the_grid_ends_with_the_horizon() {
        let end = SOONEST * (CELLS as f64 * CELL).exp();
        assert!((HORIZON_DAYS..HORIZON_DAYS * 1.02).contains(&end), "{end}");
    }

    #[test]
    fn two_that_agree_are_one_narrower_forecast_in_whatever_order() {
        let (a, b) = (about(10.0, 0.8), about(12.0, 0.8));
        let one = of_one_look(&[a.clone(), b.clone()]);
        assert_eq!(one[0].members, [0, 1]);
        assert!(width(&one[0].passage) < 0.95 * width(&a));
        let other = of_one_look(&[b, a]);
        let median = |groups: &[Group]| groups[0].passage.quantile(0.5, HORIZON_DAYS);
        assert_eq!(median(&one), median(&other));
    }

    #[test]
    fn a_hundred_that_share_their_load_are_not_a_hundred_opinions() {
        let many = of_one_look(&vec![about(10.0, 0.8); 100]);
        let two = of_one_look(&vec![about(10.0, 0.8); 2]);
        // Worth 1.67 independent ones at the most, and two are worth 1.25.
        let ratio = width(&many[0].passage) / width(&two[0].passage);
        assert!((0.6..0.95).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_neighbour_that_halts_does_not_talk_a_mass_out_of_its_failure() {
        let halts = Passage::from_times(vec![(300.0, 1e-3)]);
        for group in of_one_look(&[about(2.0, 0.5), halts.clone(), halts]) {
            if group.members.contains(&0) {
                assert!(group.passage.chance_within(5.0) > 0.9);
            } else {
                assert!(group.passage.chance_within(5.0) < 0.1);
            }
        }
    }

    #[test]
    fn what_has_been_overtaken_says_nothing() {
        assert_eq!(
            FailureTimeLikelihood::of(&about(2.0, 0.5), 9.0),
            FailureTimeLikelihood::nothing()
        );
        assert_ne!(
            FailureTimeLikelihood::of(&about(2.0, 0.5), 1.0),
            FailureTimeLikelihood::nothing()
        );
    }
}
