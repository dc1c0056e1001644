//! La Clapière, 1982.9 to 1995: monthly displacement of benchmark 10 and the Tinée's daily flow.
//!
//! "Paper" is Helmstetter et al. (2004); everything else is invented within what it leaves open.

use crate::interpolation::between;
use crate::loaded_law::Block;
use crate::noise::{ColouredNoise, rounded};
use crate::provenance::Provenance;
use anyhow::{Context, Result};
use jiff::civil::{Date, date};
use jiff::tz::TimeZone;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::model::Law;
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
/// Invented: T in days, by which the block is still far from its steady velocity in 1986.
const T_DAYS: f64 = 30.0;
/// Paper: 1.5 m/yr in 1975-1982, which the law has at its start under the year's mean load.
const INITIAL_MM_PER_DAY: f64 = 1500.0 / 365.25;

/// Invented: how fast the slope answers the river, days.
const RESPONSE_DAYS: f64 = 15.0;
/// Invented: log-load per m3/s of the flow's response, for the paper's seasonal maxima.
const RIVER_GAIN: f64 = 0.07;
/// Invented: the response at which the river's log-load is zero; e^f is about 1.15 in the mean of 1983-1985.
const RIVER_ZERO_M3_S: f64 = 16.8;
/// Log-load that is not the river's, by year. Paper: there is one in 1986 and 1987, after a
/// crack freed a block in 1985-1986. Invented: its course and size, for 80 and 90 mm/day in 1987.
const EXTRA_LOAD: [(f64, f64); 5] = [
    (1985.9, 0.0),
    (1986.5, 0.9),
    (1987.0, 0.785),
    (1987.6, 0.785),
    (1987.72, 0.295),
];

/// Paper: the regime changes at the end of 1987, and the seasons never come back.
const CHANGE: f64 = 1987.85;
/// Part of the river's log-load that acts, by year. Paper: a model of the river tuned on 1982-1986
/// fails after, and the seasons never come back. Invented: how the river's hold weakens.
const RIVER_HOLD: [(f64, f64); 4] = [(1986.0, 1.0), (1987.0, 0.3), (1987.85, 0.3), (1988.0, 0.0)];
/// Invented: B/A after the change.
const M_AFTER: f64 = 0.8;
/// Invented: the steady velocity after it, slightly above the level before 1986 (paper), mm/day.
const STEADY_AFTER_MM_PER_DAY: f64 = 5.6;
/// Invented: relaxation time to it, days, for a sixth of the peak over 1988-1990 (paper).
const RELAXATION_AFTER_DAYS: f64 = 2200.0;

/// Invented: standard error of a monthly position, mm.
const NOISE_MM: f64 = 10.0;
const STEPS_PER_DAY: u32 = 8;
const DAYS_PER_YEAR: f64 = 365.25;

/// The river, all invented but for its seasons: snow melt in spring, rain in autumn (paper).
mod river {
    pub(super) const BASE_M3_S: f64 = 8.0;
    pub(super) const MELT_PEAK_M3_S: f64 = 32.0;
    /// Relative range of the melt's peak from year to year, and range of its date in days.
    pub(super) const MELT_VARIES: f64 = 0.2;
    pub(super) const MELT_DAY: f64 = 147.0;
    pub(super) const MELT_DAY_VARIES: f64 = 10.0;
    /// Days by which the melt rises and falls (standard deviations of its two halves).
    pub(super) const MELT_RISE_DAYS: f64 = 20.0;
    pub(super) const MELT_FALL_DAYS: f64 = 28.0;
    pub(super) const STORMS: std::ops::RangeInclusive<u32> = 2..=4;
    pub(super) const STORM_DAYS: std::ops::Range<f64> = 265.0..335.0;
    pub(super) const STORM_M3_S: std::ops::Range<f64> = 12.0..45.0;
    pub(super) const RECESSION_DAYS: f64 = 9.0;
    /// Two rains of early October 1987, each within the range of the others.
    pub(super) const STORMS_OF_1987: [(f64, f64); 2] = [(275.0, 34.0), (284.0, 32.0)];
    /// Standard deviation of ln(flow) and its memory from day to day.
    pub(super) const NOISE: f64 = 0.08;
    pub(super) const NOISE_MEMORY: f64 = 0.7;
}

/// One day of the years in which the river acts on the slope.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Day {
    /// Its start.
    pub(crate) time: Timestamp,
    /// Decimal year.
    pub(crate) year: f64,
    /// The Tinée's flow, m3/s.
    pub(crate) flow_m3_s: f64,
    /// The river's log-load on the slope, while it holds.
    pub(crate) river_load: f64,
}

/// Displacement and velocity of the benchmark at the start of a day.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// When.
    pub(crate) time: Timestamp,
    /// Decimal year.
    pub(crate) year: f64,
    /// Since the first reading, mm.
    pub(crate) slip_mm: f64,
    /// Instantaneous, mm/day.
    pub(crate) velocity: f64,
}

/// Which loads act: to tell how much of the slip each accounts for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loads {
    /// Neither the river nor the extra load: the law alone.
    Neither,
    /// The river alone.
    River,
    /// Both, as recorded.
    Both,
}

/// The reconstruction, from its constants and seed alone.
///
/// # Errors
/// When a constant makes no law or no date.
pub(crate) fn recording() -> Result<Recording> {
    let days = days()?;
    let noise = ColouredNoise::new(SEED + 2, NOISE_MM, 0.0);
    let due = |motion: &Motion| motion.time.to_zoned(TimeZone::UTC).day() == FIRST_READING.day();
    let motions = motions(&days, Loads::Both)?;
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
pub(crate) fn motions(days: &[Day], loads: Loads) -> Result<Vec<Motion>> {
    let scale = INITIAL_MM_PER_DAY * (M * X_I.ln()).exp();
    let before = Law::from_paper(M, X_I, T_DAYS, scale)?;
    let after = law_after(before.v_i);
    let start = midnight(FIRST_READING)?;
    let mut block = Block::START;
    let mut motions = Vec::new();
    for pair in days.windows(2).filter(|pair| pair[0].time >= start) {
        let (today, tomorrow) = (pair[0], pair[1]);
        let first = block.days;
        let load = |t: f64| {
            let part = t - first;
            let river = today.river_load + part * (tomorrow.river_load - today.river_load);
            let year = today.year + part / DAYS_PER_YEAR;
            let river = river * between(&RIVER_HOLD, year);
            match loads {
                Loads::Neither => 0.0,
                Loads::River => river,
                Loads::Both => river + between(&EXTRA_LOAD, year),
            }
        };
        let law = if today.year < CHANGE { &before } else { &after };
        motions.push(Motion {
            time: today.time,
            year: today.year,
            slip_mm: block.slip_mm,
            velocity: block.velocity(law, load(first)),
        });
        block = block.advance(law, load, 1.0, STEPS_PER_DAY);
    }
    Ok(motions)
}

/// Slip, mm, at the end of each of the first five years under each choice of loads.
///
/// # Errors
/// When a constant makes no law or no date.
pub(crate) fn shares(days: &[Day]) -> Result<Vec<(f64, [f64; 3])>> {
    let law_alone = motions(days, Loads::Neither)?;
    let with_river = motions(days, Loads::River)?;
    let with_both = motions(days, Loads::Both)?;
    let yearly = (1..=5).map(|years| years * 365 + years / 4);
    let rows = yearly.filter_map(|day| {
        let year = law_alone.get(day)?.year;
        Some((
            year,
            [
                law_alone[day].slip_mm,
                with_river[day].slip_mm,
                with_both[day].slip_mm,
            ],
        ))
    });
    Ok(rows.collect())
}

/// The law after the change: it relaxes to its own steady velocity under the extra load that remains.
fn law_after(v_i: f64) -> Law {
    let remaining = EXTRA_LOAD[EXTRA_LOAD.len() - 1].1;
    // Under the log-load f, the steady y is v_i e^f / v, and there a y^p = b e^f.
    let ln_y = (v_i / STEADY_AFTER_MM_PER_DAY).ln() + remaining;
    let p = 1.0 - 1.0 / M_AFTER;
    // d(a y^p)/dy = -1 / relaxation
    let a = ((1.0 - p) * ln_y).exp() / (-p * RELAXATION_AFTER_DAYS);
    let b = a * (p * ln_y - remaining).exp();
    Law {
        v_i,
        r: b - a,
        kappa: a * p,
        p,
        a,
        b,
    }
}

/// The river and its hold on the slope, day by day.
///
/// # Errors
/// When a constant makes no date.
pub(crate) fn days() -> Result<Vec<Day>> {
    let mut random = Pcg64::seed_from_u64(SEED);
    let mut seasons = Vec::new();
    for year in FIRST_FLOW.year()..=LAST_READING.year() {
        seasons.push(Season::draw(year, &mut random));
    }
    let noise = ColouredNoise::new(SEED + 1, river::NOISE, river::NOISE_MEMORY);
    let dates = FIRST_FLOW
        .series(jiff::Span::new().days(1))
        .take_while(|date| *date <= LAST_READING.saturating_add(jiff::Span::new().days(1)));
    // The response starts from the base flow, and takes up each day's mean of two midnights.
    let kept = (-1.0 / RESPONSE_DAYS).exp();
    let (mut response, mut last) = (river::BASE_M3_S, river::BASE_M3_S);
    let mut days = Vec::new();
    for (date, noise) in dates.zip(noise) {
        let rain_and_melt: f64 = seasons.iter().map(|season| season.flow(date)).sum();
        let flow = rounded((river::BASE_M3_S + rain_and_melt) * noise.exp(), 1);
        response = kept * response + (1.0 - kept) * f64::midpoint(last, flow);
        last = flow;
        days.push(Day {
            time: midnight(date)?,
            year: decimal_year(date)?,
            flow_m3_s: flow,
            river_load: RIVER_GAIN * (response - RIVER_ZERO_M3_S),
        });
    }
    Ok(days)
}

/// The melt and the storms of one year.
struct Season {
    start: Date,
    melt_peak_m3_s: f64,
    melt_day: f64,
    /// Day of the year and flow at its peak, m3/s.
    storms: Vec<(f64, f64)>,
}

impl Season {
    fn draw(year: i16, random: &mut Pcg64) -> Self {
        let vary = |random: &mut Pcg64, range: f64| random.random_range(-range..range);
        let melt_peak_m3_s = river::MELT_PEAK_M3_S * (1.0 + vary(random, river::MELT_VARIES));
        let melt_day = river::MELT_DAY + vary(random, river::MELT_DAY_VARIES);
        let mut storms = Vec::new();
        for _ in 0..random.random_range(river::STORMS) {
            let day = random.random_range(river::STORM_DAYS).round();
            storms.push((day, random.random_range(river::STORM_M3_S)));
        }
        if year == 1987 {
            storms = river::STORMS_OF_1987.to_vec();
        }
        Self {
            start: date(year, 1, 1),
            melt_peak_m3_s,
            melt_day,
            storms,
        }
    }

    /// What this year's melt and storms add to the flow on a date, m3/s.
    fn flow(&self, date: Date) -> f64 {
        let day = f64::from((date - self.start).get_days());
        let from_peak = day - self.melt_day;
        let width = if from_peak < 0.0 {
            river::MELT_RISE_DAYS
        } else {
            river::MELT_FALL_DAYS
        };
        let melt = self.melt_peak_m3_s * (-0.5 * (from_peak / width).powi(2)).exp();
        let storm = |(at, peak): &(f64, f64)| {
            if day < *at {
                0.0
            } else {
                peak * ((at - day) / river::RECESSION_DAYS).exp()
            }
        };
        melt + self.storms.iter().map(storm).sum::<f64>()
    }
}

fn midnight(date: Date) -> Result<Timestamp> {
    let zoned = date.to_zoned(TimeZone::UTC);
    Ok(zoned
        .with_context(|| format!("{date} has no midnight"))?
        .timestamp())
}

fn decimal_year(day: Date) -> Result<f64> {
    let new_year = midnight(date(day.year(), 1, 1))?;
    let year_days = f64::from(day.days_in_year());
    Ok(f64::from(day.year()) + days_since(new_year, midnight(day)?) / year_days)
}

fn provenance() -> Provenance<'static> {
    Provenance {
        title: "La Clapière, France, 1982.9 to 1995: displacement of benchmark 10",
        stated: "m = 0.98 and x_i = 39; 1.5 m/yr before 1982.9; seasonal velocity maxima of 1982 \
                 to 1985 of the order of or under 30 mm/day, after snow melt and autumn rain; 80 \
                 mm/day in summer and 90 in October 1987, which the river does not explain; six \
                 times slower over 1988-1990, slightly above the level before 1986 in the end, \
                 the seasons gone",
        invented: "readings on the 25th at 00:00 UTC; T; every value of the Tinée's flow; the \
                   slope's response time and gain to it; the course and size of the extra log-load \
                   of 1986-1987; the date and friction of the change; noise of 10 mm in displacement",
        seed: SEED,
    }
}
