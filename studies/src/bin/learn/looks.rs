//! Looks at simulated slopes: what was seen, and what came.

use crate::descent::Row;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::fit::Observations;
use slipwatch::forecast::{INPUTS, Indicators, Members, Network};
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::{Family, Simulated};

/// Fewest readings before a look.
const FEWEST_READINGS: usize = 12;
/// Looks before the end of an acceleration, after one that stopped, and anywhere in a life.
const BEFORE: usize = 6;
const AFTER: usize = 2;
const ANYWHERE: usize = 4;
/// Of so many more looks anywhere, so many are kept in which an acceleration is the likeliest.
const LIKELIEST: (usize, usize) = (16, 3);
/// The share of looks that know no more than the newest readings, the logarithm of whose number is even: a slope is watched for
/// days as well as for years, and its record is no longer because it stands.
const CUT: f64 = 0.4;
/// Looks before an end reach back so far, days.
const FARTHEST_DAYS: f64 = 60.0;
/// The shortest lead, intervals between readings: of looks for training, and of looks for judging.
const LAST_LOOK: (f64, f64) = (1.0, 2.0);
/// The same, days.
const SHORTEST_DAYS: f64 = 1.0 / 24.0;
/// The share of the standing slopes that the first network is asked about, at how many readings, and the looks that are
/// kept of each slope: by the chance within a day and within thirty.
const ASKED: (f64, usize) = (0.5, 80);
const KEPT: (usize, usize) = (4, 3);
/// How much a look at a slope that accelerated and stopped counts. What share of accelerations stops is known of
/// famous slopes alone (Veslemannen 15 of 16 alarms, Brienz 1 of 2, Vaiont 2 of 3); the looks before a stop are
/// taken to be a tenth as many as those before a collapse, so that a slope that runs away is believed.
const STOPPED: f32 = 0.1;
/// How much a look at a slope counts that rain drives: it is what most slopes do that stand.
const RAIN: f32 = 3.0;
/// How much a look at a slope counts that runs up once: by Voight's relation, and by the slider block's law. A line
/// through inverse velocity was late or early by a day at most in the middle half of 14 failures (Leinauer and Krautblatter
/// 2023): slopes that hand over, pause or fail in pieces are the smaller part.
const PLAIN: (f32, f32) = (3.0, 2.0);

/// One look.
#[derive(Debug)]
pub(crate) struct Look {
    pub(crate) family: Family,
    seed: u64,
    /// (span, days; what is known of it).
    questions: Vec<(f64, [f32; INPUTS])>,
    /// Days to the collapse, or to the end of the life without one.
    left_days: f64,
    fails: bool,
}

/// Looks at the first so many slopes of each family.
pub(crate) fn of_families(slopes: u64) -> Vec<Look> {
    let jobs: Vec<(Family, u64)> = Family::ALL
        .iter()
        .flat_map(|family| (0..slopes).map(|seed| (*family, seed)))
        .collect();
    in_two(&jobs, |(family, seed)| {
        at(&Simulated::draw(*family, *seed), *seed)
    })
}

/// What `work` makes of each job, on two threads that each take the next one, in the order of the jobs.
pub(crate) fn in_two<J: Sync, T: Send>(jobs: &[J], work: impl Fn(&J) -> Vec<T> + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let take = || {
        let mut made = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(index) else {
                return made;
            };
            made.push((index, work(job)));
        }
    };
    let mut made = std::thread::scope(|scope| {
        let beside = scope.spawn(take);
        let mut made = take();
        made.extend(beside.join().unwrap_or_default());
        made
    });
    made.sort_by_key(|(index, _)| *index);
    made.into_iter().flat_map(|(_, each)| each).collect()
}

/// The rows for training that one look gives: a span each, as far as it is known whether a collapse came within it.
pub(crate) fn rows(look: &Look) -> impl Iterator<Item = Row> {
    let weight = weight(look.family);
    let known = look.questions.iter().filter_map(move |(span, inputs)| {
        let came = look.fails && look.left_days <= *span;
        (look.fails || look.left_days >= *span).then_some(Row {
            inputs: *inputs,
            came,
            weight,
        })
    });
    known.collect::<Vec<Row>>().into_iter()
}

/// How much a look at a family counts: most published failures run up once, most of those that stand do nothing of the
/// kind.
fn weight(family: Family) -> f32 {
    match family {
        Family::Voight => PLAIN.0,
        Family::Law => PLAIN.1,
        Family::Rain => RAIN,
        Family::Stopped | Family::Plateau => STOPPED,
        Family::Exponential
        | Family::Handover
        | Family::LogPeriodic
        | Family::Paused
        | Family::Pieces
        | Family::Levelled
        | Family::Steady
        | Family::TwoRates
        | Family::Season
        | Family::Reservoir
        | Family::FreezeThaw
        | Family::StickSlip
        | Family::Resets => 1.0,
    }
}

fn at(slope: &Simulated, seed: u64) -> Vec<Look> {
    let values = &slope.observations.values;
    if values.len() <= FEWEST_READINGS {
        return Vec::new();
    }
    let mut generator = Pcg64::seed_from_u64(seed ^ 0x5555);
    let mut counts = Vec::new();
    if let Some(end) = slope.collapse_days.or(slope.stopped_days) {
        counts.extend(about(slope, (end, LAST_LOOK.0), &mut generator));
    }
    let mut anywhere = || generator.random_range(FEWEST_READINGS..=values.len());
    counts.extend((0..ANYWHERE).map(|_| anywhere()));
    let mut likely: Vec<(f64, usize)> = (0..LIKELIEST.0)
        .filter_map(|_| {
            let count = anywhere();
            let known = first(&slope.observations, count);
            Some((Indicators::of(&known)?.accelerating(), count))
        })
        .collect();
    likely.sort_by(|a, b| b.0.total_cmp(&a.0));
    counts.extend(likely.iter().take(LIKELIEST.1).map(|(_, count)| *count));
    let looks = counts
        .into_iter()
        .filter_map(|count| look(slope, seed, count));
    looks.collect()
}

/// Counts of readings at leads spread evenly in their logarithm, since the acceleration could be seen, of so many `intervals` between
/// readings or more.
fn about(slope: &Simulated, (end, intervals): (f64, f64), generator: &mut impl Rng) -> Vec<usize> {
    let values = &slope.observations.values;
    let shortest = (intervals * slope.interval_days).max(SHORTEST_DAYS);
    let seen = end - slope.visible_days.min(end);
    let longest = FARTHEST_DAYS.min(seen).max(1.2 * shortest);
    let mut lead = || shortest * (longest / shortest).powf(generator.random::<f64>());
    let mut times: Vec<f64> = (0..BEFORE).map(|_| end - lead()).collect();
    if slope.stopped_days.is_some() {
        times.extend((0..AFTER).map(|_| end + lead()));
    }
    let counts = times
        .iter()
        .map(|days| values.partition_point(|value| value.t_days <= *days));
    counts.filter(|count| *count >= FEWEST_READINGS).collect()
}

/// Counts of readings before the end of a slope that judges.
pub(crate) fn about_the_end(slope: &Simulated, end: f64, seed: u64) -> Vec<usize> {
    let mut generator = Pcg64::seed_from_u64(seed ^ 0x5555);
    about(slope, (end, LAST_LOOK.1), &mut generator)
}

pub(crate) fn first(observations: &Observations, count: usize) -> Observations {
    Observations {
        values: observations.values[..count].to_vec(),
        ..observations.clone()
    }
}

/// The first `count` observations, or, in [`CUT`] of all cases, the newest of these alone.
fn newest(observations: &Observations, (seed, count): (u64, usize)) -> Observations {
    let mut known = first(observations, count);
    let index = seed.wrapping_mul(0x9E37_79B9).wrapping_add(count as u64);
    let mut generator = Pcg64::seed_from_u64(index);
    if generator.random::<f64>() < CUT && count > FEWEST_READINGS {
        let share = (FEWEST_READINGS as f64 / count as f64).powf(generator.random::<f64>());
        #[expect(clippy::cast_sign_loss, reason = "a share of a count")]
        let kept = (share * count as f64).round() as usize;
        known
            .values
            .drain(..count - kept.clamp(FEWEST_READINGS, count));
    }
    known
}

fn look(slope: &Simulated, seed: u64, count: usize) -> Option<Look> {
    let known = newest(&slope.observations, (seed, count));
    let now = known.values.last()?.t_days;
    let left_days = slope.collapse_days.unwrap_or(slope.end_days) - now;
    if left_days <= 0.0 {
        return None;
    }
    let asked = Indicators::of(&known)?.questions(&Members::of(&known));
    let single = |(days, inputs): (f64, [f64; INPUTS])| (days, inputs.map(|value| value as f32));
    Some(Look {
        family: slope.family,
        seed,
        questions: asked.into_iter().map(single).collect(),
        left_days,
        fails: slope.collapse_days.is_some(),
    })
}

/// Looks all over a part of the standing slopes, of which those that mislead are to be found.
pub(crate) fn of_standing(slopes: u64) -> Vec<Look> {
    #[expect(clippy::cast_sign_loss, reason = "a share of a count")]
    let asked = (slopes as f64 * ASKED.0) as u64;
    let stands = Family::ALL.iter().filter(|family| !family.fails());
    let jobs: Vec<(Family, u64)> = stands
        .flat_map(|family| (0..asked).map(|seed| (*family, seed)))
        .collect();
    in_two(&jobs, |(family, seed)| {
        let slope = Simulated::draw(*family, *seed);
        let all = slope.observations.values.len();
        let asked = (FEWEST_READINGS..=all).step_by((all / ASKED.1).max(1));
        let looks = asked.filter_map(|count| look(&slope, *seed, count));
        looks.collect()
    })
}

/// Of looks at standing slopes, in which those of a slope stand together, the ones in which `network` gives a collapse the
/// highest chances.
pub(crate) fn misleading<'a>(network: &Network, looks: &[&'a Look]) -> Vec<&'a Look> {
    let of_slopes = looks.chunk_by(|a, b| (a.family, a.seed) == (b.family, b.seed));
    let kept = of_slopes.flat_map(|looks| {
        let within = |look: &Look, days: f64| {
            let spans = look.questions.iter().filter(|(span, _)| *span <= days);
            let chances = spans.map(|(_, inputs)| network.chance(&inputs.map(f64::from)));
            chances.fold(0.0, f64::max)
        };
        let mut chances: Vec<(f64, f64, usize)> = looks
            .iter()
            .enumerate()
            .map(|(index, look)| (within(look, 1.5), within(look, 40.0), index))
            .collect();
        chances.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<usize> = chances.iter().take(KEPT.0).map(|one| one.2).collect();
        chances.sort_by(|a, b| b.1.total_cmp(&a.1));
        kept.extend(chances.iter().take(KEPT.1).map(|one| one.2));
        kept.sort_unstable();
        kept.dedup();
        kept.into_iter()
            .map(|index| looks[index])
            .collect::<Vec<&Look>>()
    });
    kept.collect()
}
