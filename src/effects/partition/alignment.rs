//! Several benchmarks' displacements at the same times, without jumps and stray readings.

use crate::effects::quantiles::{median, robust_deviation};
use crate::reading::{Quantity, Series, Timestamp, days_of, days_since};

/// Times in common that are worth having: more would follow noise, not motion.
const MOST_TIMES: usize = 61;
/// Fewest times in common: two stretches of five, and the break between.
pub(super) const FEWEST_TIMES: usize = 12;
/// A benchmark read over less than this share of the longest record is left out.
const LEAST_COVERAGE: f64 = 0.6;
/// Readings further apart than so many steps have nothing between them.
const WIDEST_GAP_STEPS: f64 = 2.1;
/// A reading this far, in robust standard deviations, outside what stands on either side is stray.
const OUTLYING: f64 = 6.0;
/// A difference this far, in robust standard deviations, from the neighbours' is a jump.
const JUMP: f64 = 5.0;
/// A jump spreads over so many steps at most.
const LONGEST_JUMP: usize = 3;

/// Displacements at common times.
#[derive(Debug, Clone)]
pub(super) struct Alignment {
    /// Days since `epoch`, increasing.
    pub(super) days: Vec<f64>,
    /// mm, a row a benchmark.
    pub(super) rows: Vec<Vec<f64>>,
    /// Which of the series given stand in the rows.
    pub(super) members: Vec<usize>,
    /// Day 0.
    pub(super) epoch: Timestamp,
}

/// (days, mm)
type AlignmentPath = Vec<(f64, f64)>;

impl Alignment {
    /// Of the series that have a record in common; `None` where it is shorter than [`FEWEST_TIMES`].
    pub(super) fn of(series: &[&Series]) -> Option<Self> {
        let epoch = series
            .iter()
            .filter_map(|one| one.readings.first())
            .min_by(|a, b| a.time.cmp(&b.time))?;
        let epoch = epoch.time;
        let paths: Vec<AlignmentPath> = series.iter().map(|one| path(one, epoch)).collect();
        let span = |path: &AlignmentPath| match (path.first(), path.last()) {
            (Some(first), Some(last)) => last.0 - first.0,
            _ => 0.0,
        };
        let longest = paths.iter().map(span).fold(0.0, f64::max);
        let members: Vec<usize> = (0..paths.len())
            .filter(|one| {
                paths[*one].len() >= FEWEST_TIMES && span(&paths[*one]) >= LEAST_COVERAGE * longest
            })
            .collect();
        if members.len() < 2 {
            return None;
        }
        let kept: Vec<&AlignmentPath> = members.iter().map(|one| &paths[*one]).collect();
        let (days, rows) = at_common_times(&kept)?;
        let mut aligned = Self {
            days,
            rows,
            members,
            epoch,
        };
        aligned.rows = without_jumps(&aligned.days, &aligned.rows)?;
        Some(aligned)
    }
}

/// The displacement by days; of velocities, what they add up to.
fn path(series: &Series, epoch: Timestamp) -> AlignmentPath {
    let factor = series.unit.factor();
    let values = series
        .readings
        .iter()
        .map(|one| (days_since(epoch, one.time), factor * one.value));
    let values = without_strays(&values.collect());
    match series.quantity() {
        Quantity::Displacement => values,
        Quantity::Velocity => {
            // A mean over the time before its stamp belongs to the middle of that time.
            let late = series.averaging.map_or(0.0, |span| 0.5 * days_of(span));
            let mut slip = 0.0;
            let mut path: AlignmentPath = Vec::with_capacity(values.len());
            for (index, (day, velocity)) in values.iter().enumerate() {
                if let Some((before, slower)) = index.checked_sub(1).map(|one| values[one]) {
                    slip += 0.5 * (velocity + slower) * (day - before);
                }
                path.push((day - late, slip));
            }
            path
        }
    }
}

/// Drops single readings that stand far outside both of their neighbours.
fn without_strays(path: &AlignmentPath) -> AlignmentPath {
    let bend = |three: &[(f64, f64)]| {
        let share = (three[1].0 - three[0].0) / (three[2].0 - three[0].0).max(f64::MIN_POSITIVE);
        three[1].1 - three[0].1 - share * (three[2].1 - three[0].1)
    };
    let limit = OUTLYING * robust_deviation(&path.windows(3).map(bend).collect::<Vec<f64>>());
    let is_stray = |three: &[(f64, f64)]| {
        let (low, high) = (three[0].1.min(three[2].1), three[0].1.max(three[2].1));
        limit > 0.0 && (three[1].1 > high + limit || three[1].1 < low - limit)
    };
    let keep = |index: &usize| {
        *index == 0 || *index + 1 == path.len() || !is_stray(&path[index - 1..=index + 1])
    };
    (0..path.len())
        .filter(keep)
        .map(|index| path[index])
        .collect()
}

/// Evenly spaced times at which every path is known.
fn at_common_times(paths: &[&AlignmentPath]) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let from = paths
        .iter()
        .map(|path| path[0].0)
        .fold(f64::NEG_INFINITY, f64::max);
    let to = paths
        .iter()
        .map(|path| path[path.len() - 1].0)
        .fold(f64::INFINITY, f64::min);
    let readings = |path: &&AlignmentPath| {
        path.iter()
            .filter(|one| one.0 >= from && one.0 <= to)
            .count()
    };
    let count = paths.iter().map(readings).min()?.min(MOST_TIMES);
    if count < FEWEST_TIMES || to <= from {
        return None;
    }
    let step = (to - from) / (count - 1) as f64;
    let mut days = Vec::new();
    let mut rows = vec![Vec::new(); paths.len()];
    for index in 0..count {
        let day = from + step * index as f64;
        let here: Option<Vec<f64>> = paths.iter().map(|path| at(path, day, step)).collect();
        if let Some(here) = here {
            days.push(day);
            rows.iter_mut()
                .zip(here)
                .for_each(|(row, value)| row.push(value));
        }
    }
    (days.len() >= FEWEST_TIMES).then_some((days, rows))
}

/// The displacement on a day: a straight line through the readings about it, the nearer the heavier; across
/// a short gap, the line between its ends.
fn at(path: &AlignmentPath, day: f64, step: f64) -> Option<f64> {
    let after = path.partition_point(|one| one.0 < day);
    let later = *path.get(after.min(path.len() - 1))?;
    let earlier = if later.0 <= day {
        later
    } else {
        *path.get(after.checked_sub(1)?)?
    };
    if later.0 - earlier.0 > WIDEST_GAP_STEPS * step || later.0 < day - 1e-6 * step {
        return None;
    }
    // Half a step on either side: each reading counts once, and a kink is blurred within its step.
    let reach = 0.5 * step;
    let first = path.partition_point(|one| one.0 <= day - reach);
    let near = path[first..].iter().take_while(|one| one.0 < day + reach);
    let (mut w, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut is_before, mut is_after) = (false, false);
    for (t, value) in near {
        let off = (t - day) / reach;
        let weight = 1.0 - off.abs();
        is_before |= off <= 1e-6;
        is_after |= off >= -1e-6;
        w += weight;
        x += weight * off;
        y += weight * (value - earlier.1);
        xx += weight * off * off;
        xy += weight * off * (value - earlier.1);
    }
    if is_before && is_after && w > 0.1 {
        let spread = xx - x * x / w;
        let slope = if spread > 1e-6 {
            (xy - x * y / w) / spread
        } else {
            0.0
        };
        return Some(earlier.1 + (y - slope * x) / w);
    }
    let share = if later.0 > earlier.0 {
        (day - earlier.0) / (later.0 - earlier.0)
    } else {
        0.0
    };
    Some(earlier.1 + share * (later.1 - earlier.1))
}

/// Takes out of each row the differences that stand alone against all other rows: an offset of one
/// instrument is no motion.
fn without_jumps(days: &[f64], rows: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    // Velocities: across a gap a difference is longer, and no jump.
    let lengths = differences(days);
    let velocities = |row: &Vec<f64>| {
        differences(row)
            .iter()
            .zip(&lengths)
            .map(|(slip, days)| slip / days)
            .collect()
    };
    let steps: Vec<Vec<f64>> = rows.iter().map(velocities).collect();
    let scales: Vec<f64> = steps.iter().map(|row| scale(row)).collect();
    if scales.iter().any(|scale| !scale.is_normal()) {
        return None;
    }
    let count = steps[0].len();
    let mut cleaned = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let common = |step: usize| {
            let others = (0..rows.len()).filter(|other| *other != index);
            let shares = others.map(|other| steps[other][step] / scales[other]);
            median(&shares.collect::<Vec<f64>>())
        };
        let own: Vec<f64> = (0..count)
            .map(|step| steps[index][step] / scales[index] - common(step))
            .collect();
        let jumps = jumps(&own);
        let mut value = row[0];
        let mut clean = vec![value];
        for step in 0..count {
            let level = if jumps[step] {
                local_level(&own, &jumps, step)
            } else {
                own[step]
            };
            value += lengths[step] * scales[index] * (level + common(step));
            clean.push(value);
        }
        cleaned.push(clean);
    }
    Some(cleaned)
}

/// Which differences stand out against those on both sides, which agree with each other.
fn jumps(own: &[f64]) -> Vec<bool> {
    let mut found = vec![false; own.len()];
    let bends: Vec<f64> = own.windows(2).map(|two| two[1] - two[0]).collect();
    let noise = |of: &[f64]| robust_deviation(of) / std::f64::consts::SQRT_2;
    let least = noise(&bends).max(1e-9);
    for length in 1..=LONGEST_JUMP {
        for first in 3..own.len().saturating_sub(length + 2) {
            let before = median(&own[first.saturating_sub(6)..first]);
            let end = first + length;
            let after = median(&own[end..own.len().min(end + 6)]);
            let (low, high) = (before.min(after), before.max(after));
            // Faster motion is read with more noise.
            let near = &bends[first.saturating_sub(8)..bends.len().min(end + 8)];
            let limit = JUMP * least.max(noise(near));
            let stands_out = |value: &f64| *value > high + limit || *value < low - limit;
            if own[first..end].iter().all(stands_out) {
                found[first..end].fill(true);
            }
        }
    }
    found
}

fn local_level(own: &[f64], jumps: &[bool], step: usize) -> f64 {
    let near = step.saturating_sub(6)..own.len().min(step + 7);
    let level = near.filter(|one| !jumps[*one]).map(|one| own[one]);
    median(&level.collect::<Vec<f64>>())
}

/// Differences of successive values.
pub(super) fn differences(row: &[f64]) -> Vec<f64> {
    row.windows(2).map(|two| two[1] - two[0]).collect()
}

/// Typical size of a row's differences, with their sign on the whole.
fn scale(steps: &[f64]) -> f64 {
    let total: f64 = steps.iter().sum();
    let size: f64 = steps.iter().map(|step| step.abs()).sum();
    if total < -0.5 * size {
        -size / steps.len() as f64
    } else {
        size / steps.len() as f64
    }
}
