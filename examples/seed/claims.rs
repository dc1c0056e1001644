//! What the paper says, what the same study gives here, and whether the two agree.

use crate::document::{Studies, list, m_text, number, years};
use crate::la_clapiere::{self, Fit, IMPOSED_M, PAPER_M, PAPER_X_I};
use crate::recorded::vaiont_day;
use crate::synthetic::{M, Study};
use crate::vaiont::{Benchmark, PAPER_LINE_DAY, Side, best_on};
use anyhow::{Context, Result};
use slipwatch::inversion::{SweepReport, SweepRow};
use slipwatch::reading::Quantity;

/// One statement of the paper.
#[derive(Debug)]
pub(crate) struct Claim {
    pub(crate) paper: String,
    pub(crate) here: String,
    pub(crate) agrees: bool,
    pub(crate) readings: Readings,
}

/// What a study inverts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Readings {
    /// A reconstruction tuned by hand towards this very statement.
    Tuned,
    /// A reconstruction not tuned towards it.
    Reconstructed,
    /// Seeded series of the law.
    Synthetic,
}

/// m this close to the paper's is the paper's.
const SAME_M: f64 = 0.05;
/// Days between the zeros of two straight lines that are one.
const SAME_DAY: f64 = 1.0;
/// Difference of two exponents of dv/dt that are one.
const SAME_ALPHA: f64 = 0.1;
/// A relative difference of rms under which neither fit is preferred.
const SLIGHT: f64 = 0.1;
/// The share of the synthetic series in which something must be found to be recoverable.
const FOUND: f64 = 0.9;
/// A share of the rows that is nearly all of them.
const NEARLY_ALL: f64 = 0.8;

/// Every statement, in the order of the document.
pub(crate) fn claims(studies: &Studies) -> Result<Vec<Claim>> {
    let mut claims = of_vaiont(&studies.vaiont);
    claims.extend(of_la_clapiere(studies)?);
    claims.extend(of_growing(&studies.growing)?);
    claims.push(of_velocity(&studies.growing_velocity));
    claims.extend(of_synthetic(&studies.synthetic)?);
    Ok(claims)
}

fn ids<'a>(
    benchmarks: &'a [Benchmark],
    claim: impl Fn(&Benchmark) -> bool + 'a,
) -> Vec<&'static str> {
    let met = benchmarks.iter().filter(|one| claim(one));
    met.map(|one| one.id).collect()
}

/// Whether the best m of a benchmark is the paper's.
pub(crate) fn has_the_papers_m(benchmark: &Benchmark) -> bool {
    let best = benchmark.free.parameters.m.best;
    best.is_some_and(|m| (m - benchmark.paper_m).abs() <= SAME_M)
}

/// By how much the best law below m = 1 fits worse than the best law at or above it, relative to that.
pub(crate) fn excess_below_one(benchmark: &Benchmark) -> Option<f64> {
    let rms = |side| best_on(side, &benchmark.free).and_then(|one| one.rms);
    let above = rms(Side::Above).into_iter().chain(rms(Side::At));
    let above = above.reduce(f64::min)?;
    Some(rms(Side::Below)? / above - 1.0)
}

/// What `of` says of each benchmark.
fn each(benchmarks: &[Benchmark], of: impl Fn(&Benchmark) -> String) -> String {
    let texts = benchmarks
        .iter()
        .map(|one| format!("{} ({})", of(one), one.id));
    texts.collect::<Vec<_>>().join(", ")
}

fn of_vaiont(benchmarks: &[Benchmark]) -> Vec<Claim> {
    let same_m = ids(benchmarks, has_the_papers_m);
    let unstable = benchmarks.iter().filter(|one| one.paper_m >= 1.0);
    let is_slight = |one: &Benchmark| {
        excess_below_one(one).is_some_and(|excess| (0.0..SLIGHT).contains(&excess))
    };
    vec![
        Claim {
            paper: "Vaiont: m = 1.35 (5), 1.24 (63), 0.99 (67), 1.00 (50)".to_owned(),
            here: format!(
                "best m = {}; the paper's within {SAME_M} for {}",
                each(benchmarks, |one| m_text(one.free.parameters.m.best)),
                list(&same_m)
            ),
            agrees: same_m.len() == benchmarks.len(),
            readings: Readings::Tuned,
        },
        Claim {
            paper: "Vaiont: laws with m < 1 fit with an rms only slightly larger".to_owned(),
            here: format!(
                "rms of the best m < 1 against the best m ≥ 1: {} (below 0: m < 1 fits better)",
                each(benchmarks, |one| {
                    let percent = |excess: f64| format!("{:+.0} %", 100.0 * excess);
                    excess_below_one(one).map_or("–".to_owned(), percent)
                })
            ),
            agrees: unstable.into_iter().all(is_slight),
            readings: Readings::Tuned,
        },
        of_the_line(benchmarks),
        of_alpha(benchmarks),
    ]
}

/// The day on which the straight line through 1/v meets zero.
pub(crate) fn line_day(benchmark: &Benchmark) -> Option<f64> {
    let time = benchmark.free.inverse_velocity.failure_time?;
    vaiont_day(time).ok()
}

fn of_the_line(benchmarks: &[Benchmark]) -> Claim {
    let near = ids(benchmarks, |one| {
        line_day(one).is_some_and(|day| (day - PAPER_LINE_DAY).abs() <= SAME_DAY)
    });
    Claim {
        paper: format!(
            "Vaiont: the line through 1/v meets zero near day {PAPER_LINE_DAY}, for every benchmark"
        ),
        here: format!(
            "day {}; within {SAME_DAY:.0} day for {}",
            each(benchmarks, |one| number(line_day(one))),
            list(&near)
        ),
        agrees: near.len() == benchmarks.len(),
        readings: Readings::Tuned,
    }
}

fn of_alpha(benchmarks: &[Benchmark]) -> Claim {
    let alpha = |one: &Benchmark| one.free.inverse_velocity.alpha?.best;
    let near = ids(benchmarks, |one| {
        alpha(one).is_some_and(|best| (best - 2.0).abs() <= SAME_ALPHA)
    });
    Claim {
        paper: "dv/dt = A v^α: the universal α is 2".to_owned(),
        here: format!(
            "α = {}; within {SAME_ALPHA} of 2 for {}",
            each(benchmarks, |one| number(alpha(one))),
            list(&near)
        ),
        agrees: near.len() == benchmarks.len(),
        readings: Readings::Tuned,
    }
}

fn of_la_clapiere(studies: &Studies) -> Result<Vec<Claim>> {
    let [free, _, unit, imposed] = studies.fits.as_slice() else {
        anyhow::bail!("no fits of La Clapière");
    };
    let (m, x_i) = (
        free.report.parameters.m.best,
        free.report.parameters.x_i.best,
    );
    let same = m.is_some_and(|m| (m - PAPER_M).abs() <= SAME_M);
    let accelerates_to_a_steady_velocity =
        m.is_some_and(|m| 0.0 < m && m < 1.0) && x_i.is_some_and(|x_i| x_i > 1.0);
    let rms = |fit: &Fit| fit.report.rms.context("no rms");
    let (best, straight, worse) = (rms(free)?, rms(unit)?, rms(imposed)?);
    Ok(vec![
        Claim {
            paper: format!("La Clapière, 1982.9 to 1987.9: m = {PAPER_M}, x_i = {PAPER_X_I}"),
            here: format!("m = {}, x_i = {}", m_text(m), number(x_i)),
            agrees: same,
            readings: Readings::Tuned,
        },
        Claim {
            paper: "the same: 0 < m < 1 and x_i > 1, that is stable and accelerating".to_owned(),
            here: format!("{} by the posterior", free.report.regime.label),
            agrees: accelerates_to_a_steady_velocity,
            readings: Readings::Tuned,
        },
        Claim {
            paper: format!("the same: m = {IMPOSED_M} imposed, for comparison"),
            here: format!(
                "rms {worse:.0} mm, with x_i = {}, against {straight:.0} at m = 1 (the straight line in 1/v) and {best:.0} at the best",
                number(imposed.report.parameters.x_i.best)
            ),
            agrees: worse > best,
            readings: Readings::Tuned,
        },
    ])
}

/// Whether a row's best fit accelerates to a steady velocity with 0 < m < 1.
pub(crate) fn has_m_of_a_stable_law(row: &SweepRow) -> bool {
    row.m.is_some_and(|m| 0.0 < m && m < 1.0)
}

/// Whether a row's best fit has m < 1 and `x_i` > 1.
pub(crate) fn is_below_one_from_above(row: &SweepRow) -> bool {
    row.m.is_some_and(|m| m < 1.0) && row.x_i.is_some_and(|x_i| x_i > 1.0)
}

fn of_growing(growing: &SweepReport) -> Result<Vec<Claim>> {
    let rows = &growing.rows;
    let stable: Vec<bool> = rows.iter().map(has_m_of_a_stable_law).collect();
    let met = stable.iter().filter(|one| **one).count();
    let mut early = Vec::new();
    for row in rows {
        if la_clapiere::is_before_the_end_of_1986(row.t_max)? {
            early.extend(row.alternatives.range_of_m());
        }
    }
    let low = early.iter().map(|range| range.0).reduce(f64::min);
    let high = early.iter().map(|range| range.1).reduce(f64::max);
    let transitions: Vec<_> = rows.iter().filter_map(|row| row.transition_time).collect();
    let years = years(&transitions)?;
    let recedes = transitions.is_sorted() && 2 * transitions.len() > rows.len();
    Ok(vec![
        Claim {
            paper: "t_max from 2 to 5 years: 0 < m < 1 except in the first two refits".to_owned(),
            here: format!("0 < m < 1 in {met} of {} refits", rows.len()),
            agrees: stable.iter().skip(2).all(|one| *one),
            readings: Readings::Reconstructed,
        },
        Claim {
            paper: "secondary best fits from m = -3000 to m = 29 before the end of 1986".to_owned(),
            here: format!(
                "minima from m = {} to m = {} (we look from -20 to 29 only)",
                m_text(low),
                m_text(high)
            ),
            agrees: low.is_some_and(|m| m < 0.0) && high.is_some_and(|m| m > 1.0),
            readings: Readings::Reconstructed,
        },
        Claim {
            paper: "the transition time recedes as t_max grows".to_owned(),
            here: format!(
                "there is one in {} of {} refits: {years}",
                transitions.len(),
                rows.len()
            ),
            agrees: recedes,
            readings: Readings::Reconstructed,
        },
    ])
}

fn of_velocity(growing: &SweepReport) -> Claim {
    let rows = &growing.rows;
    let met = rows.iter().filter(|row| is_below_one_from_above(row));
    let is_doubted = |row: &&SweepRow| row.regime.probability_unstable.is_some_and(|p| p > 0.5);
    let doubted = met.clone().filter(is_doubted).count();
    let met = met.count();
    Claim {
        paper: "fits of the velocity: less stable, almost all with m < 1 and x_i > 1".to_owned(),
        here: format!(
            "m < 1 and x_i > 1 in {met} of {} refits, in {doubted} of which P(unstable) > .5",
            rows.len()
        ),
        agrees: met as f64 >= NEARLY_ALL * rows.len() as f64,
        readings: Readings::Reconstructed,
    }
}

/// The least share of m < 1 among the studies of `quantity` with scatter.
fn least_share_below_one(studies: &[Study], quantity: Quantity) -> Option<f64> {
    let met = studies
        .iter()
        .filter(|study| study.quantity == quantity && study.kind.scatter > 0.0);
    met.map(|study| study.share(|draw| draw.m < 1.0))
        .reduce(f64::min)
}

fn of_synthetic(studies: &[Study]) -> Result<[Claim; 2]> {
    let scattered = studies.iter().filter(|study| study.kind.scatter > 0.0);
    let near = |study: &Study| study.share(|draw| (draw.m - M).abs() <= SAME_M);
    let most_near = scattered.map(near).reduce(f64::max);
    let most_near = most_near.context("no synthetics")?;
    let least = |quantity| least_share_below_one(studies, quantity).context("no synthetics");
    let displacement = least(Quantity::Displacement)?;
    let velocity = least(Quantity::Velocity)?;
    Ok([
        Claim {
            paper: "synthetic series with m = 0.98, x_i = 39: m cannot be recovered".to_owned(),
            here: format!(
                "with scatter in the slip the best m is within {SAME_M} of it in {:.0} % at most",
                100.0 * most_near
            ),
            agrees: most_near < FOUND,
            readings: Readings::Synthetic,
        },
        Claim {
            paper: "the same: that m < 1 can".to_owned(),
            here: format!(
                "m < 1 is found in {:.1} % of displacements at least, in {:.1} % of velocities",
                100.0 * displacement,
                100.0 * velocity
            ),
            agrees: displacement >= FOUND,
            readings: Readings::Synthetic,
        },
    ])
}
