//! Which benchmarks of one site fail together, since when it is seen, and when they fail.

use super::report::FittedFailureTime;
use super::{Inversion, InversionOptions};
use crate::fit::Rate;
use crate::forecast::{
    Dependence, FEWEST_READINGS, FailureTimeLikelihood, Passage, Snapshot, by_the_law, groups,
    measurably_moves,
};
use crate::reading::{BenchmarkId, Series, Timestamp, after_days, days_since};
use schemars::JsonSchema;
use serde::Serialize;

/// Past times within that in which all benchmarks were read, by which "since" is reported: evenly in ln of the
/// time to the failure that is expected now, as forecasts change.
const SNAPSHOTS: usize = 24;
/// That time over the time looked back on, within bounds that leave no step too coarse or too fine.
const LEFT: (f64, f64) = (0.02, 1.0);
/// A benchmark not read for more than this share of its own record says nothing of today.
const SILENT: f64 = 1.0 / 3.0;

/// What the benchmarks of one site say together.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct TogetherReport {
    /// Benchmarks that share one failure time.
    pub groups: Vec<GroupReport>,
    /// Benchmarks that share it with no other.
    pub apart: Vec<ApartReport>,
    /// Benchmarks without a forecast of today, which are not judged.
    pub silent: Vec<BenchmarkId>,
    /// The first of the snapshots.
    pub judged_from: Timestamp,
    /// How many there are; they lie closer as the failure comes closer.
    pub looks: usize,
}

/// Benchmarks that share one failure time.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct GroupReport {
    /// Which.
    pub benchmarks: Vec<BenchmarkId>,
    /// How probably each fails with the others, in the same order.
    pub probabilities: Vec<f64>,
    /// The look from which on they have been a group; [`TogetherReport::judged_from`]: from the first.
    pub since: Timestamp,
    /// When they pass the critical velocity together, by the law.
    pub failure_time: FittedFailureTime,
}

/// A benchmark on its own.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct ApartReport {
    /// Which.
    pub benchmark: BenchmarkId,
    /// How probably it fails with no group and no other benchmark.
    pub probability: f64,
    /// The look from which on it has stood apart.
    pub since: Timestamp,
}

/// Judges the benchmarks of `series`, by the first series of each, with what `options` let be used; `None`
/// where fewer than two have a forecast.
pub fn together(series: &[Series], options: &InversionOptions) -> Option<TogetherReport> {
    let mut each: Vec<Inversion> = Vec::new();
    for one in series {
        if each
            .iter()
            .all(|known| known.series.benchmark != one.benchmark)
        {
            each.push(Inversion::new(one, options));
        }
    }
    let ends = each.iter().filter_map(|one| one.series.readings.last());
    let now = ends.map(|reading| reading.time).max()?;
    let (current, silent): (Vec<Inversion>, Vec<Inversion>) = each
        .into_iter()
        .partition(|one| is_current(one, now) && likelihood(one, now).is_some());
    if current.len() < 2 {
        return None;
    }
    let (times, looks) = looks(&current, now)?;
    let rates: Vec<(Vec<Rate>, f64)> = current
        .iter()
        .map(|one| (one.rates(), one.days_at(now)))
        .collect();
    let rates: Vec<(&[Rate], f64)> = rates.iter().map(|one| (&*one.0, one.1)).collect();
    let dependence = Dependence::measured(&rates);
    let name = |member: &usize| current[*member].series.benchmark.clone();
    let (alone, together): (Vec<_>, Vec<_>) = groups(&looks, &dependence)
        .into_iter()
        .partition(|group| group.members.len() == 1);
    let groups = together.iter().map(|group| GroupReport {
        benchmarks: group.members.iter().map(name).collect(),
        probabilities: group.probabilities.clone(),
        since: times[group.since],
        failure_time: FittedFailureTime::from_passage(options, Some((now, &group.passage))),
    });
    let apart = alone.iter().flat_map(|group| {
        let members = group.members.iter().zip(&group.probabilities);
        members.map(|(member, probability)| ApartReport {
            benchmark: name(member),
            probability: *probability,
            since: times[group.since],
        })
    });
    Some(TogetherReport {
        groups: groups.collect(),
        apart: apart.collect(),
        silent: silent.into_iter().map(|one| one.series.benchmark).collect(),
        judged_from: times[0],
        looks: times.len(),
    })
}

impl Inversion {
    /// Days from the first reading to `time`.
    fn days_at(&self, time: Timestamp) -> f64 {
        let first = self.series.readings.first();
        first.map_or(0.0, |first| days_since(first.time, time))
    }
}

/// Whether the newest reading is no further back than is usual.
fn is_current(inversion: &Inversion, now: Timestamp) -> bool {
    let readings = &inversion.series.readings;
    let (Some(first), Some(last)) = (readings.first(), readings.last()) else {
        return false;
    };
    days_since(last.time, now) <= SILENT * days_since(first.time, last.time)
}

/// What the readings up to `time` predict; `None` where too few do, or none that moves.
fn predicted(inversion: &Inversion, time: Timestamp) -> Option<(Passage, f64)> {
    let mut observations = inversion.observations.clone();
    let days = inversion.days_at(time);
    observations.values.retain(|value| value.t_days <= days);
    let critical = inversion.options.critical_velocity_mm_per_day;
    let passage = by_the_law(&observations, critical)?;
    let now_days = observations.values.last()?.t_days;
    let rates = observations.all_rates();
    measurably_moves(&rates).then_some((passage, days - now_days))
}

/// The snapshots and their times: all benchmarks have readings enough by the first, and the last is now.
fn looks(inversions: &[Inversion], now: Timestamp) -> Option<(Vec<Timestamp>, Vec<Snapshot>)> {
    let ready = inversions.iter().filter_map(|one| {
        let spaced = one.observations.spaced(FEWEST_READINGS);
        let days = spaced.last()?.t_days;
        after_days(one.series.readings.first()?.time, days)
    });
    let first = ready.max()?;
    let span = days_since(first, now);
    let medians = inversions.iter().filter_map(|one| {
        let (passage, later) = predicted(one, now)?;
        Some(passage.quantile(0.5, f64::INFINITY)? - later)
    });
    let soonest = medians.fold(f64::INFINITY, f64::min);
    let left = soonest.clamp(LEFT.0 * span, LEFT.1 * span);
    let back = |index: usize| {
        let share = index as f64 / (SNAPSHOTS - 1) as f64;
        left * (((left + span) / left.max(f64::MIN_POSITIVE)).powf(share) - 1.0)
    };
    let at = |index: usize| {
        if index == SNAPSHOTS - 1 {
            return Some(first);
        }
        after_days(now, -back(index))
    };
    let mut times: Vec<Timestamp> = (0..SNAPSHOTS).rev().filter_map(at).collect();
    times.dedup();
    let looks = times.iter().map(|time| Snapshot {
        left_days: left + days_since(*time, now),
        likelihoods: inversions
            .iter()
            .map(|one| likelihood(one, *time))
            .collect(),
    });
    let looks = looks.collect();
    Some((times, looks))
}

fn likelihood(inversion: &Inversion, time: Timestamp) -> Option<FailureTimeLikelihood> {
    let (passage, later) = predicted(inversion, time)?;
    Some(FailureTimeLikelihood::of(&passage, later))
}
