//! What the paper says, what the same study gives here, and whether the two agree.

use super::claims_vaiont::of_vaiont;
use super::document::{Studies, m_text, number, years};
use super::la_clapiere::{self, Fit, IMPOSED_M, PAPER_M, PAPER_X_I};
use super::synthetic::{M, Study};
use super::valley::AS_GOOD;
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
pub(crate) const SAME_M: f64 = 0.05;
/// The share of the synthetic series in which something must be found to be recoverable.
const FOUND: f64 = 0.9;
/// A share of the rows that is nearly all of them.
const NEARLY_ALL: f64 = 0.8;
/// A share of the variance that is an explanation, and one that is none.
const EXPLAINED: f64 = 0.5;
const UNEXPLAINED: f64 = 0.1;

/// Every statement, in the order of the document.
pub(crate) fn claims(studies: &Studies) -> Result<Vec<Claim>> {
    let mut claims = of_vaiont(&studies.vaiont)?;
    claims.extend(of_la_clapiere(studies)?);
    claims.extend(of_growing(&studies.growing)?);
    claims.push(of_velocity(&studies.growing_velocity));
    claims.extend(of_the_river(studies));
    claims.extend(of_synthetic(&studies.synthetic)?);
    Ok(claims)
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
    let valley = studies.valley.as_ref().context("no fit of La Clapière")?;
    let (low, high) = valley
        .x_i(AS_GOOD)
        .context("no x_i is as good as the best")?;
    let (lowest, highest) = valley.m(AS_GOOD).context("no m is as good as the best")?;
    let accelerates_to_a_steady_velocity =
        m.is_some_and(|m| 0.0 < m && m < 1.0) && x_i.is_some_and(|x_i| x_i > 1.0);
    let rms = |fit: &Fit| fit.report.rms.context("no rms");
    let (best, straight, worse) = (rms(free)?, rms(unit)?, rms(imposed)?);
    Ok(vec![
        Claim {
            paper: format!("La Clapière, 1982.9 to 1987.9: m = {PAPER_M}, x_i = {PAPER_X_I}"),
            here: format!(
                "m = {}, x_i = {}; with an rms within {:.0} % of the least: m from {} to {}, x_i from {} to {}",
                m_text(m),
                number(x_i),
                100.0 * AS_GOOD,
                m_text(Some(lowest)),
                m_text(Some(highest)),
                number(Some(low)),
                number(Some(high))
            ),
            agrees: same && (low..=high).contains(&PAPER_X_I),
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
            readings: Readings::Tuned,
        },
        Claim {
            paper: "secondary best fits from m = -3000 to m = 29 before the end of 1986".to_owned(),
            here: format!(
                "minima from m = {} to m = {} (searched from -20 to 29 only)",
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
            readings: Readings::Tuned,
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

fn of_the_river(studies: &Studies) -> [Claim; 2] {
    let river = &studies.river;
    let percent = |share: Option<f64>| {
        share.map_or("–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
    };
    let learned = river.before.is_some_and(|share| share > EXPLAINED);
    let fails = river.after.is_some_and(|share| share < UNEXPLAINED);
    [
        Claim {
            paper: "the river explains the seasons of 1982 to 1985, and what was tuned on it fails in 1986 and 1987".to_owned(),
            here: format!(
                "of the variance of ln v about the fit the flow explains {} to the end of 1985; taken away with that gain it makes the rms of 1986 and 1987 {} times what it was",
                percent(river.before),
                number(river.after.map(|share| (1.0 - share).sqrt()))
            ),
            agrees: learned && fails,
            readings: Readings::Tuned,
        },
        Claim {
            paper: "six times slower than the peak over 1988 to 1990".to_owned(),
            here: format!("{} times, by the fastest month", number(river.fall)),
            agrees: river.fall.is_some_and(|fall| (5.0..=7.0).contains(&fall)),
            readings: Readings::Tuned,
        },
    ]
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
