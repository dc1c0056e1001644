//! What the paper says of Vaiont, what the same study gives here, and whether the two agree.

use super::claims::{Claim, Readings, SAME_M};
use super::document::{list, m_text, number};
use super::given_up::last_gain;
use super::recorded::{displacements, vaiont_day};
use super::vaiont::{Benchmark, PAPER_LINE_DAY, Side, best_on};
use anyhow::Result;

/// Days between the zeros of two straight lines that are one.
const SAME_DAY: f64 = 1.0;
/// Difference of two exponents of dv/dt that are one.
const SAME_ALPHA: f64 = 0.1;
/// A relative difference of rms under which neither fit is preferred.
const SLIGHT: f64 = 0.1;
/// Velocities whose ratio stays between this and its inverse are alike.
const ALIKE: f64 = 0.7;
/// Velocities of the paper, mm/day: about the first, and more than the second.
const SLOWEST: std::ops::Range<f64> = 4.5..6.0;
const FASTEST: f64 = 200.0;
/// Displacements of the paper, m.
const DISPLACEMENTS: std::ops::RangeInclusive<f64> = 0.8..=4.0;

/// Every statement, in the order of the document.
pub(crate) fn of_vaiont(benchmarks: &[Benchmark]) -> Result<Vec<Claim>> {
    Ok(vec![
        of_m(benchmarks),
        of_laws_below_one(benchmarks),
        of_the_line(benchmarks),
        of_alpha(benchmarks),
        of_velocities(benchmarks),
        of_likeness(benchmarks),
        of_exhaustion(benchmarks)?,
    ])
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

fn of_m(benchmarks: &[Benchmark]) -> Claim {
    let same_m = ids(benchmarks, has_the_papers_m);
    Claim {
        paper: "Vaiont: m = 1.35 (5), 1.24 (63), 0.99 (67), 1.00 (50)".to_owned(),
        here: format!(
            "best m = {}; the paper's within {SAME_M} for {}",
            each(benchmarks, |one| m_text(one.free.parameters.m.best)),
            list(&same_m)
        ),
        agrees: same_m.len() == benchmarks.len(),
        readings: Readings::Tuned,
    }
}

fn of_laws_below_one(benchmarks: &[Benchmark]) -> Claim {
    let is_slight = |one: &Benchmark| {
        excess_below_one(one).is_some_and(|excess| (0.0..SLIGHT).contains(&excess))
    };
    let mut above = benchmarks.iter().filter(|one| one.paper_m > 1.0);
    Claim {
        paper: "Vaiont: laws with m < 1 fit 5 and 63 with an rms only slightly larger".to_owned(),
        here: format!(
            "rms of the best m < 1 against the best m ≥ 1: {} (below 0: m < 1 fits better)",
            each(benchmarks, |one| {
                let percent = |excess: f64| format!("{:+.0} %", 100.0 * excess);
                excess_below_one(one).map_or("–".to_owned(), percent)
            })
        ),
        agrees: above.all(is_slight),
        readings: Readings::Tuned,
    }
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
    let below = ids(benchmarks, |one| {
        alpha(one).is_some_and(|best| best < 2.0 - SAME_ALPHA)
    });
    Claim {
        paper: "Vaiont: 5, 63 and 50 close to 1/(t_c - t), where α of dv/dt = A v^α is 2; 67 bends upwards in 1/v, where it is less".to_owned(),
        here: format!(
            "α = {}; within {SAME_ALPHA} of 2 for {}, less for {}",
            each(benchmarks, |one| number(alpha(one))),
            list(&near),
            list(&below)
        ),
        agrees: near == ["5", "63", "50"] && below == ["67"],
        readings: Readings::Tuned,
    }
}

fn of_velocities(benchmarks: &[Benchmark]) -> Claim {
    let values = || {
        let readings = benchmarks.iter().flat_map(|one| &one.series.readings);
        readings.map(|reading| reading.value)
    };
    let slowest = values().fold(f64::INFINITY, f64::min);
    let fastest = values().fold(0.0, f64::max);
    let metres = |one: &Benchmark| {
        let summed = displacements(&one.series);
        summed.readings.last().map(|last| last.value / 1000.0)
    };
    let within = |one: &Benchmark| metres(one).is_some_and(|slip| DISPLACEMENTS.contains(&slip));
    Claim {
        paper:
            "Vaiont: velocities from 5 to more than 200 mm/day, displacements between 0.8 and 4 m"
                .to_owned(),
        here: format!(
            "{} to {} mm/day; {} m",
            number(Some(slowest)),
            number(Some(fastest)),
            each(benchmarks, |one| number(metres(one)))
        ),
        agrees: SLOWEST.contains(&slowest) && fastest > FASTEST && benchmarks.iter().all(within),
        readings: Readings::Tuned,
    }
}

fn of_likeness(benchmarks: &[Benchmark]) -> Claim {
    let of = |id: &str| {
        let one = benchmarks.iter().find(|one| one.id == id);
        one.map_or(&[][..], |one| one.series.readings.as_slice())
    };
    let ratios = of("5").iter().zip(of("63")).map(|(a, b)| b.value / a.value);
    let low = ratios.clone().fold(f64::INFINITY, f64::min);
    let high = ratios.fold(0.0, f64::max);
    let ends = |id: &str| Some((of(id).first()?.value, of(id).last()?.value));
    let rise = |id: &str| ends(id).map(|(first, last)| last - first);
    let share = rise("50")
        .zip(rise("5"))
        .map(|(small, large)| small / large);
    let times = ends("50").map(|(first, last)| last / first);
    Claim {
        paper: "Vaiont: 5 and 63 alike; 50's acceleration small in absolute value, significant in relative value".to_owned(),
        here: format!(
            "63 over 5 from {low:.2} to {high:.2}; 50 rises by {} of what 5 rises by, and to {} times its first velocity",
            number(share),
            number(times)
        ),
        agrees: low > ALIKE
            && high < 1.0 / ALIKE
            && share.is_some_and(|share| share < ALIKE)
            && times.is_some_and(|times| times > 10.0),
        readings: Readings::Tuned,
    }
}

fn of_exhaustion(benchmarks: &[Benchmark]) -> Result<Claim> {
    let mut gains = Vec::new();
    for one in benchmarks {
        gains.push((one.id, last_gain(&one.series)?));
    }
    let curved = |one: &Benchmark| {
        one.least_squares
            .best()
            .is_some_and(|best| best.law.kappa < 0.0)
    };
    let bends = ids(benchmarks, curved);
    let exhausted = |gain: &(&str, Option<f64>)| gain.1.is_some_and(|gain| gain < 1.0);
    let texts: Vec<String> = gains
        .iter()
        .map(|(id, gain)| format!("{} ({id})", number(*gain)))
        .collect();
    Ok(Claim {
        paper: "Vaiont: the increase of the velocity exhausts itself before the critical time, for every benchmark".to_owned(),
        here: format!(
            "ln v gains {} of what 1/({PAPER_LINE_DAY} - t) gains over the last four days; but 1/v bends upwards in {} only",
            texts.join(", "),
            list(&bends)
        ),
        agrees: gains.iter().all(exhausted) && bends.len() == benchmarks.len(),
        readings: Readings::Tuned,
    })
}
