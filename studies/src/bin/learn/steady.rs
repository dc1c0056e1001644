//! docs/steady-creep.md: steady creep, and a rate that doubles and stays, as loggers read them.

use crate::judge::{Calls, Chances, FEWEST_READINGS};
use crate::looks::{first, in_two};
use crate::source;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::fit::Observations;
use slipwatch::forecast::Network;
use std::fmt::Write as _;
use studies::random::{happens, log_uniform, normal, uniform};

const FIRST_SEED: u64 = 4_000_000;
/// Ranges over which the logarithm is even: mm/day, mm, days between readings, days in all.
const RATES: (f64, f64) = (0.02, 200.0);
const NOISES: (f64, f64) = (0.02, 5.0);
const INTERVALS: (f64, f64) = (1.0 / 1440.0, 30.0);
const LENGTHS: (f64, f64) = (4.0, 730.0);
/// The share of slopes at rest.
const AT_REST: f64 = 0.1;
/// Readings of a series: at least, and at most where that is not under the shortest length.
const READINGS: (f64, f64) = (40.0, 2500.0);
/// Readings of a series that are judged, at most.
const JUDGED: usize = 250;
/// A rate doubles somewhere in this part of a series, and has settled when this share of what is left has passed.
const CHANGES: (f64, f64) = (0.3, 0.7);
const SETTLED: f64 = 0.25;
/// Memories of the noises whose sum is the flicker: powers of four of the interval.
const FLICKERS: [i32; 6] = [0, 1, 2, 3, 4, 5];
/// The fine noise of a quantised series, in resolutions.
const FINE: f64 = 0.3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Noise {
    White,
    Flicker,
    Quantised,
}

const NOISE_KINDS: [Noise; 3] = [Noise::White, Noise::Flicker, Noise::Quantised];

/// What was called in one series.
#[derive(Debug)]
struct CreepCalls {
    noise: Noise,
    doubles: bool,
    /// Red, and orange or red, at any time (after the change, where there is one) and after it has settled.
    ever: (bool, bool),
    settled: (bool, bool),
}

pub(crate) fn write(network: &Network, series: u64) -> anyhow::Result<()> {
    let jobs: Vec<(u64, bool)> = (0..series)
        .flat_map(|seed| [(seed, false), (seed, true)])
        .collect();
    let called = in_two(&jobs, |(seed, doubles)| {
        vec![follow(*seed, *doubles, network)]
    });
    source::document("docs/steady-creep.md", &text(&called, series)?)
}

/// The readings of a series, and when its rate changes, days.
fn draw(seed: u64, doubles: bool) -> (Noise, Observations, f64) {
    let mut generator = Pcg64::seed_from_u64(2 * (FIRST_SEED + seed) + u64::from(doubles));
    let noise = NOISE_KINDS[usize::try_from(seed % 3).unwrap_or(0)];
    let interval = log_uniform(&mut generator, INTERVALS.0, INTERVALS.1);
    let most = (READINGS.1 * interval).max(LENGTHS.0);
    let days = log_uniform(&mut generator, LENGTHS.0, LENGTHS.1).clamp(READINGS.0 * interval, most);
    let rests = happens(&mut generator, AT_REST);
    let rate = log_uniform(&mut generator, RATES.0, RATES.1) * f64::from(u8::from(!rests));
    let size = log_uniform(&mut generator, NOISES.0, NOISES.1);
    let change = days * uniform(&mut generator, CHANGES.0, CHANGES.1);
    let mut flickers = [0.0; FLICKERS.len()];
    let mut values = Vec::new();
    let mut t_days = 0.0;
    while t_days < days {
        let more = if doubles {
            (t_days - change).max(0.0)
        } else {
            0.0
        };
        let position = rate * (t_days + more);
        let drawn = normal(&mut generator);
        let value = match noise {
            Noise::White => position + size * drawn,
            Noise::Flicker => position + size * flicker(&mut flickers, &mut generator),
            Noise::Quantised => ((position + FINE * size * drawn) / size).round() * size,
        };
        values.push((t_days, value));
        t_days += interval;
    }
    (noise, Observations::of_displacements(values), change)
}

fn flicker(each: &mut [f64; FLICKERS.len()], generator: &mut impl Rng) -> f64 {
    for (one, power) in each.iter_mut().zip(FLICKERS) {
        let kept = (-f64::powi(4.0, -power)).exp();
        *one = kept * *one + (1.0 - kept * kept).sqrt() * normal(generator);
    }
    each.iter().sum::<f64>() / (FLICKERS.len() as f64).sqrt()
}

fn follow(seed: u64, doubles: bool, network: &Network) -> CreepCalls {
    let (noise, observations, change) = draw(seed, doubles);
    let values = &observations.values;
    let end = values.last().map_or(0.0, |last| last.t_days);
    let (from, settled) = if doubles {
        (change, change + SETTLED * (end - change))
    } else {
        (0.0, 0.0)
    };
    let begin = values.partition_point(|value| value.t_days < from);
    let begin = begin.max(FEWEST_READINGS);
    let step = values.len().saturating_sub(begin).div_ceil(JUDGED).max(1);
    let mut called = CreepCalls {
        noise,
        doubles,
        ever: (false, false),
        settled: (false, false),
    };
    let mut calls = Calls::of_a_day();
    for count in (begin..=values.len()).step_by(step) {
        let Some(chances) = Chances::of(&first(&observations, count), network) else {
            continue;
        };
        let level = calls.level(values[count - 1].t_days, &chances);
        let (is_red, is_orange) = (level == Level::Red, level >= Level::Orange);
        called.ever.0 |= is_red;
        called.ever.1 |= is_orange;
        if values[count - 1].t_days >= settled {
            called.settled.0 |= is_red;
            called.settled.1 |= is_orange;
        }
    }
    called
}

fn text(called: &[CreepCalls], series: u64) -> anyhow::Result<String> {
    let mut out = format!(
        "# Steady creep, and a rate that doubles and stays\n\n\
         Written by `cargo run --release -p studies --bin learn -- --steady {series}`. {series} series of one rate and {series} whose rate doubles at once and stays, \
         drawn over {} to {} mm/day (a tenth at rest), noise of {} to {} mm, a minute to a month between readings, {} days to two years (at \
         most {} readings, unless these are fewer than {} days), each judged at {JUDGED} of its readings by the network in force. Evacuation time 24 h; the chances by \
         which levels go, without the policy's latch. No level is due in any of them. *Settled*: after a quarter of what is left of the record since \
         the change.\n\n\
         | noise | series | one rate: orange or red | of which red | doubles: orange or red | of which red | settled: orange or red | of which red |\n\
         |---|---|---|---|---|---|---|---|\n",
        RATES.0, RATES.1, NOISES.0, NOISES.1, LENGTHS.0, READINGS.1, LENGTHS.0
    );
    let mut rows: Vec<(String, Vec<&CreepCalls>)> = NOISE_KINDS
        .iter()
        .map(|noise| {
            let own = called.iter().filter(|one| one.noise == *noise);
            (format!("{noise:?}"), own.collect())
        })
        .collect();
    rows.push(("all".to_owned(), called.iter().collect()));
    for (name, own) in rows {
        let count = |doubles: bool, is: &dyn Fn(&CreepCalls) -> bool| {
            let own = own.iter().filter(|one| one.doubles == doubles);
            own.filter(|one| is(one)).count()
        };
        writeln!(
            out,
            "| {name} | {} | {} | {} | {} | {} | {} | {} |",
            count(false, &|_| true),
            count(false, &|one| one.ever.1),
            count(false, &|one| one.ever.0),
            count(true, &|one| one.ever.1),
            count(true, &|one| one.ever.0),
            count(true, &|one| one.settled.1),
            count(true, &|one| one.settled.0),
        )?;
    }
    Ok(out)
}
