//! La Clapière, 1982.9 to 1995: monthly displacement of benchmark 10 and the Tinée's daily flow.
//!
//! "Paper" is Helmstetter et al. (2004); everything else is invented within what it leaves open.

use super::interpolation::between;
use super::loaded_law::Block;
use super::noise::{ColouredNoise, rounded};
use super::provenance::Provenance;
use super::tinee;
use anyhow::{Context, Result};
use jiff::civil::{Date, date};
use jiff::tz::TimeZone;
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::reading::{
    BenchmarkId, Channel, Reading, Recording, Sample, Series, Timestamp, Unit, days_since,
};

/// File name of the recording.
pub(crate) const FILE: &str = "la-clapiere-1982-1995-reconstruction.mcap";
/// Paper: 1982.9, monthly. Invented: the day of the month and the hour (00:00 UTC).
const FIRST_READING: Date = date(1982, 11, 25);
/// Paper: to 1995. Invented: the month.
const LAST_READING: Date = date(1995, 11, 25);
/// Invented: the flow is known from three months before, so that its past can act.
const FIRST_FLOW: Date = date(1982, 9, 1);
/// Invented.
const SEED: u64 = 1982;

/// Paper: the fit of 1982.9 to 1987.9.
const M: f64 = 0.98;
/// Paper: the same fit.
const X_I: f64 = 39.0;
/// Invented: T in days, for 80 mm/day in the summer of 1987 and 90 in its October (paper).
const T_DAYS: f64 = 2.395;
/// Paper: 1.5 m/yr in 1975-1982, which is the fit's first velocity.
const INITIAL_MM_PER_DAY: f64 = 1500.0 / 365.25;

/// Invented: how fast the slope answers the river, days.
const RESPONSE_DAYS: f64 = 15.0;
/// Invented: ln(velocity) per m3/s of the flow's response, for the paper's seasonal maxima.
const RIVER_GAIN: f64 = 0.0159;
/// Invented: the response at which the river leaves the velocity as it is.
const RIVER_ZERO_M3_S: f64 = 15.01;
/// Part of the river's effect that acts, by year. Paper: a model of the river tuned on 1982-1986
/// fails after, and the seasons never come back. Invented: when the river loses its hold.
const RIVER_HOLD: [(f64, f64); 2] = [(1985.94, 1.0), (1986.27, 0.0)];
/// ln(velocity) that neither the fit nor the river has, by year. Invented, and the one thing that was
/// searched for: with it refits over a growing time have 0 < m < 1, and their transition recedes (paper).
const EXTRA: [(f64, f64); 17] = [
    (1982.9, 0.0),
    (1983.5, -0.083),
    (1984.0, -0.096),
    (1984.5, -0.033),
    (1985.0, 0.003),
    (1985.5, 0.0),
    (1986.0, 0.015),
    (1986.25, -0.007),
    (1986.5, -0.052),
    (1986.75, -0.073),
    (1987.0, -0.147),
    (1987.2, -0.079),
    (1987.4, -0.07),
    (1987.55, -0.062),
    (1987.7, -0.09),
    (1987.8, -0.093),
    (1987.95, -0.071),
];

/// Paper: the regime changes at the end of 1987, and the seasons never come back.
const CHANGE: Date = date(1987, 11, 25);
/// Invented: B/A after the change.
const M_AFTER: f64 = 0.8;
/// Invented: the steady velocity after it, slightly above the level before 1986 (paper), mm/day.
const STEADY_AFTER_MM_PER_DAY: f64 = 7.5;
/// Invented: relaxation time to it, days, for a sixth of the peak over 1988-1990 (paper).
const RELAXATION_AFTER_DAYS: f64 = 1200.0;

/// Invented: standard error of a monthly position, mm.
const NOISE_MM: f64 = 3.0;
const STEPS_PER_DAY: u32 = 8;
const DAYS_PER_YEAR: f64 = 365.25;

/// One day of the years in which the river acts on the slope.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Day {
    /// Its start.
    pub(crate) time: Timestamp,
    /// Decimal year.
    pub(crate) year: f64,
    /// The Tinée's flow, m3/s.
    pub(crate) flow_m3_s: f64,
    /// What the river adds to ln(velocity), while it holds.
    pub(crate) river: f64,
}

/// Displacement and velocity of the benchmark at the start of a day.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReconstructedMotion {
    /// When.
    pub(crate) time: Timestamp,
    /// Decimal year.
    pub(crate) year: f64,
    /// Since the first reading, mm.
    pub(crate) slip_mm: f64,
    /// Instantaneous, mm/day.
    pub(crate) velocity: f64,
}

/// What acts: to tell how much of the slip each accounts for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Parts {
    /// The paper's fit alone.
    Fit,
    /// The river too.
    River,
    /// All, as recorded.
    All,
}

/// The reconstruction, from its constants and seed alone.
///
/// # Errors
/// When a constant makes no law or no date.
pub(crate) fn recording() -> Result<Recording> {
    let days = days()?;
    let noise = ColouredNoise::new(SEED + 2, NOISE_MM, 0.0);
    let due = |motion: &ReconstructedMotion| {
        motion.time.to_zoned(TimeZone::UTC).day() == FIRST_READING.day()
    };
    let motions = motions(&days, Parts::All)?;
    let readings = motions.iter().filter(|motion| due(motion)).zip(noise);
    let readings = readings.map(|(motion, noise)| Reading {
        time: motion.time,
        value: rounded(motion.slip_mm + noise, 0),
        sigma: Some(NOISE_MM),
    });
    let series = Series {
        benchmark: BenchmarkId::new("10"),
        unit: Unit::MM,
        averaging: None,
        readings: readings.collect(),
    };
    let flow = days.iter().map(|day| Sample {
        time: day.time,
        value: day.flow_m3_s,
    });
    let channel = Channel {
        name: "tinee_flow_m3_s".to_owned(),
        unit: Some("m3_s".to_owned()),
        stated: None,
        samples: flow.collect(),
    };
    Ok(Recording {
        series: vec![series],
        channels: vec![channel],
        provenance: provenance().entries(),
    })
}

/// The benchmark at the start of every day from the first reading to the last, without noise.
///
/// # Errors
/// When a constant makes no law or no date.
pub(crate) fn motions(days: &[Day], parts: Parts) -> Result<Vec<ReconstructedMotion>> {
    let (start, change) = (midnight(FIRST_READING)?, midnight(CHANGE)?);
    let fit = fitted_law()?;
    let solution = Trajectory::solve(&fit, days_since(start, change) + 1.0, Accuracy::Full);
    let mut motions: Vec<ReconstructedMotion> = Vec::new();
    let mut after: Option<(Law, Block)> = None;
    for day in days.iter().filter(|day| day.time >= start) {
        let velocity = if let Some((law, block)) = &mut after {
            *block = block.advance(law, |_| 0.0, 1.0, STEPS_PER_DAY);
            block.velocity(law, 0.0)
        } else {
            let motion = solution.at(days_since(start, day.time));
            let fitted = motion.context("the law ends too early")?.velocity;
            fitted * more(day, parts).exp()
        };
        if day.time >= change && after.is_none() {
            after = Some((law_after(velocity), Block::START));
        }
        let before = motions.last();
        let slip_mm = before.map_or(0.0, |one| {
            one.slip_mm + f64::midpoint(one.velocity, velocity)
        });
        motions.push(ReconstructedMotion {
            time: day.time,
            year: day.year,
            slip_mm,
            velocity,
        });
    }
    Ok(motions)
}

/// The law of the paper's fit.
fn fitted_law() -> Result<Law> {
    let scale = INITIAL_MM_PER_DAY * (M * X_I.ln()).exp();
    Ok(Law::from_paper(M, X_I, T_DAYS, scale)?)
}

/// What the other parts add to ln(velocity) before the change.
fn more(day: &Day, parts: Parts) -> f64 {
    let river = between(&RIVER_HOLD, day.year) * day.river;
    match parts {
        Parts::Fit => 0.0,
        Parts::River => river,
        Parts::All => river + between(&EXTRA, day.year),
    }
}

/// Slip, mm, at the end of each of the first five years under each choice of parts.
///
/// # Errors
/// When a constant makes no law or no date.
pub(crate) fn shares(days: &[Day]) -> Result<Vec<(f64, [f64; 3])>> {
    let all = [Parts::Fit, Parts::River, Parts::All].map(|parts| motions(days, parts));
    let [fit, river, all] = all;
    let (fit, river, all) = (fit?, river?, all?);
    let yearly = (1..=5).map(|years| years * 365 + years / 4);
    let rows = yearly.filter_map(|day| {
        let slips = [fit[day].slip_mm, river[day].slip_mm, all[day].slip_mm];
        Some((fit.get(day)?.year, slips))
    });
    Ok(rows.collect())
}

/// The law after the change: from the velocity that it meets to its own steady one.
fn law_after(v_i: f64) -> Law {
    let ln_y = (v_i / STEADY_AFTER_MM_PER_DAY).ln();
    let p = 1.0 - 1.0 / M_AFTER;
    // d(a y^p)/dy = -1 / relaxation, where a y^p = b
    let a = ((1.0 - p) * ln_y).exp() / (-p * RELAXATION_AFTER_DAYS);
    let b = a * (p * ln_y).exp();
    Law {
        v_i,
        r: b - a,
        kappa: a * p,
        p,
        a,
        b,
    }
}

/// The river, and what it does to the slope while it holds, day by day.
///
/// # Errors
/// When a constant makes no date.
pub(crate) fn days() -> Result<Vec<Day>> {
    let dates = FIRST_FLOW
        .series(jiff::Span::new().days(1))
        .take_while(|date| *date <= LAST_READING);
    let noise = ColouredNoise::new(SEED + 1, tinee::NOISE, tinee::NOISE_MEMORY);
    // The response starts from the base flow, and takes up each day's mean of two midnights.
    let kept = (-1.0 / RESPONSE_DAYS).exp();
    let (mut response, mut last) = (tinee::BASE_M3_S, tinee::BASE_M3_S);
    let years = tinee::years(SEED, FIRST_FLOW.year(), LAST_READING.year());
    let mut days = Vec::new();
    for (date, noise) in dates.zip(noise) {
        let flow = tinee::flow_m3_s(&years, date);
        response = kept * response + (1.0 - kept) * f64::midpoint(last, flow);
        last = flow;
        days.push(Day {
            time: midnight(date)?,
            year: decimal_year(date)?,
            flow_m3_s: rounded(flow * noise.exp(), 1),
            river: RIVER_GAIN * (response - RIVER_ZERO_M3_S),
        });
    }
    Ok(days)
}

fn midnight(date: Date) -> Result<Timestamp> {
    let zoned = date.to_zoned(TimeZone::UTC);
    Ok(zoned
        .with_context(|| format!("{date} has no midnight"))?
        .timestamp())
}

fn decimal_year(day: Date) -> Result<f64> {
    let start = midnight(date(1980, 1, 1))?;
    Ok(1980.0 + days_since(start, midnight(day)?) / DAYS_PER_YEAR)
}

fn provenance() -> Provenance<'static> {
    Provenance {
        title: "La Clapière, France, 1982.9 to 1995: displacement of benchmark 10",
        stated: "best m = 0.98 and x_i = 39 of the displacement to 1987.9; 0 < m < 1 over shorter times \
                 but for the first two, with a transition that recedes; 1.5 m/yr before 1982.9; seasonal velocity maxima of 1982 \
                 to 1985 of the order of or under 30 mm/day, after snow melt and autumn rain; 80 \
                 mm/day in summer and 90 in October 1987, which the river does not explain; six \
                 times slower over 1988-1990, slightly above the level before 1986 in the end, \
                 the seasons gone",
        invented: "readings on the 25th at 00:00 UTC; T; every value of the Tinée's flow; the \
                   slope's response time and gain to it, and when it ends; a slow change of ln(velocity) by 0.2 \
                   at most, searched for so that refits over a growing time come out as stated; the \
                   friction after the change; noise of 3 mm in displacement",
        seed: SEED,
    }
}
