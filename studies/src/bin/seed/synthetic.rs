//! Series made by the law with m = 0.98 and x_i = 39: what of it the inversion gives back.
//!
//! Paper: m, x_i, five years, and 1.5 m/yr at the start. Chosen here: monthly readings with an error of
//! 10 mm, a scatter of each month's slip, and when the velocity inflects, before the end or after it.

use super::recorded::velocities;
use anyhow::{Context, Result};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use slipwatch::fit::{Assumptions, ConstantLoad, LawDraws, Observation, Observations, RateOptions};
use slipwatch::inversion::{Inversion, InversionOptions};
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::reading::{
    BenchmarkId, Quantity, Reading, Series, Timestamp, Unit, after_days, days_since,
};

pub(crate) const M: f64 = 0.98;
pub(crate) const X_I: f64 = 39.0;
const START: &str = "1982-11-25T00:00:00Z";
const INITIAL_MM_PER_DAY: f64 = 1500.0 / 365.25;
const MONTHS: u32 = 60;
const DAYS_PER_MONTH: f64 = 365.25 / 12.0;
pub(crate) const READING_ERROR_MM: f64 = 10.0;
const SEED: u64 = 1987;

/// How a series differs from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SyntheticKind {
    /// When the velocity inflects.
    pub(crate) inflection_years: f64,
    /// Standard deviation of one month's slip about the law's, relative to it.
    pub(crate) scatter: f64,
}

pub(crate) const KINDS: [SyntheticKind; 4] = [
    SyntheticKind {
        inflection_years: 4.0,
        scatter: 0.0,
    },
    SyntheticKind {
        inflection_years: 4.0,
        scatter: 0.1,
    },
    SyntheticKind {
        inflection_years: 6.0,
        scatter: 0.1,
    },
    SyntheticKind {
        inflection_years: 6.0,
        scatter: 0.3,
    },
];

/// What one series gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Draw {
    /// m of the best fit.
    pub(crate) m: f64,
    /// Its initial state.
    pub(crate) x_i: Option<f64>,
    /// The posterior's probability of m < 1.
    pub(crate) probability_below_one: f64,
    /// 5 and 95 % quantiles of m.
    pub(crate) interval: (f64, f64),
}

/// Many series of one kind.
#[derive(Debug)]
pub(crate) struct Study {
    pub(crate) quantity: Quantity,
    pub(crate) kind: SyntheticKind,
    pub(crate) draws: Vec<Draw>,
}

/// Inverts `count` series of each kind.
pub(crate) fn studies(count: u64) -> Result<Vec<Study>> {
    let mut studies = Vec::new();
    for kind in KINDS {
        for quantity in [Quantity::Displacement, Quantity::Velocity] {
            studies.push(study(quantity, kind, count)?);
        }
    }
    Ok(studies)
}

/// Inverts `count` series of one kind.
pub(crate) fn study(quantity: Quantity, kind: SyntheticKind, count: u64) -> Result<Study> {
    let draws = (0..count).map(|index| {
        let displacements = series(SEED + index, &kind)?;
        match quantity {
            Quantity::Displacement => draw(&displacements),
            Quantity::Velocity => draw(&velocities(&displacements)?),
        }
    });
    Ok(Study {
        quantity,
        kind,
        draws: draws.collect::<Result<_>>()?,
    })
}

/// The law behind every series.
pub(crate) fn law(inflection_years: f64) -> Result<Law> {
    let d = INITIAL_MM_PER_DAY * X_I.powf(M);
    let unit = Law::from_paper(M, X_I, 1.0, d)?;
    let inflection = unit.transition_days().context("no inflection")?;
    let t_unit_days = inflection_years * 12.0 * DAYS_PER_MONTH / inflection;
    Ok(Law::from_paper(M, X_I, t_unit_days, d)?)
}

/// Displacements in mm; the same seed gives the same series.
fn series(seed: u64, kind: &SyntheticKind) -> Result<Series> {
    let law = law(kind.inflection_years)?;
    let end = f64::from(MONTHS) * DAYS_PER_MONTH;
    let solution = Trajectory::solve(&law, end, Accuracy::Full);
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let start: Timestamp = START.parse()?;
    let (mut slip, mut of_law) = (0.0, 0.0);
    let mut readings = Vec::new();
    for month in 0..=MONTHS {
        let day = f64::from(month) * DAYS_PER_MONTH;
        let motion = solution.at(day).context("the law ends")?;
        slip += (motion.displacement - of_law) * (1.0 + kind.scatter * normal());
        of_law = motion.displacement;
        readings.push(Reading {
            time: after_days(start, day).context("a day beyond the calendar")?,
            value: slip + READING_ERROR_MM * normal(),
            sigma: None,
        });
    }
    Ok(Series {
        benchmark: BenchmarkId::new("synthetic"),
        unit: Unit::MM,
        averaging: None,
        readings,
    })
}

fn draw(series: &Series) -> Result<Draw> {
    let least_squares: ConstantLoad =
        Inversion::new(series, &InversionOptions::default()).least_squares();
    let best = least_squares.best().context("no fit")?;
    let paper = best.law.paper();
    let posterior = posterior(series).context("no posterior")?;
    let mut ms: Vec<(f64, f64)> = posterior
        .ensemble
        .samples
        .iter()
        .map(|sample| (1.0 / (1.0 - sample.law.p), sample.weight))
        .collect();
    ms.sort_by(|a, b| a.0.total_cmp(&b.0));
    let below = ms.iter().filter(|(m, _)| *m < 1.0);
    Ok(Draw {
        m: paper.m,
        x_i: paper.x_i,
        probability_below_one: below.map(|(_, weight)| weight).sum(),
        interval: (quantile(&ms, 0.05), quantile(&ms, 0.95)),
    })
}

/// m does not change along a solution, so that the posterior's laws need not be followed back.
fn posterior(series: &Series) -> Option<LawDraws> {
    let first = series.readings.first()?.time;
    let values = series.readings.iter().map(|reading| Observation {
        t_days: days_since(first, reading.time),
        value: reading.value,
        sigma: reading.sigma,
    });
    let observations = Observations {
        quantity: series.quantity(),
        averaging_days: 0.0,
        values: values.collect(),
    };
    let rates = observations.rates(0..observations.values.len(), RateOptions::default());
    LawDraws::of(&rates, &Assumptions::CONSTANT_LOAD)
}

/// Of (value, weight) pairs in increasing order.
fn quantile(sorted: &[(f64, f64)], share: f64) -> f64 {
    let mut reached = 0.0;
    let at = sorted.iter().find(|(_, weight)| {
        reached += weight;
        reached >= share
    });
    at.or(sorted.last()).map_or(f64::NAN, |(value, _)| *value)
}

impl Study {
    /// The share of the series of which `claim` holds.
    pub(crate) fn share(&self, claim: impl Fn(&Draw) -> bool) -> f64 {
        let met = self.draws.iter().filter(|draw| claim(draw)).count();
        met as f64 / self.draws.len() as f64
    }

    /// The value that `share` of the series stay under.
    pub(crate) fn quantile(&self, share: f64, of: impl Fn(&Draw) -> f64) -> f64 {
        let weight = 1.0 / self.draws.len() as f64;
        let mut values: Vec<(f64, f64)> = self.draws.iter().map(|one| (of(one), weight)).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        quantile(&values, share)
    }
}
