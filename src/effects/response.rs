//! What a covariate does to the slope after a while: its exponential or gamma response, by level or by rate.

mod changed;

use super::act::{mean_and_deviation, standardise};
use super::kind::Form;
use crate::reading::{Channel, CovariateKind, DAYS_PER_YEAR, RunningTotal, Timestamp, days_since};

/// A covariate's values on an even grid of days, standardised by nothing: in its own unit.
#[derive(Debug, Clone)]
pub(super) struct Driver {
    /// Its place among the covariates that were given.
    pub(super) index: usize,
    pub(super) name: String,
    /// What it measures.
    pub(super) kind: CovariateKind,
    /// Day of the first value.
    start: f64,
    /// Days from one to the next.
    step: f64,
    values: Vec<f64>,
    /// Whether each value is what came since the one before it, as of rain, and not what was at its time.
    is_total: bool,
    /// Times without values, as the days of the last one before and of the first one after.
    gaps: Vec<(f64, f64)>,
}

/// Fewer years say less of what is usual at a date than the mean of all does.
const FEWEST_YEARS: usize = 2;
/// A covariate's values are kept on this many points at most, and of one that is followed live no more samples.
pub const MOST_SAMPLES: usize = 8192;

/// Samples this many times as far apart as they usually are have others missing between them.
const GAP: f64 = 8.0;
const HALF: f64 = 0.5;

/// A gauge that reports only while it rains: fewest spells without a value, their least share of the values, the largest share of values that
/// are zero, and from how many spacings on a spell is dry.
const FEWEST_SPELLS: usize = 8;
const SPELLS: f64 = 0.02;
const ZEROS: f64 = 0.02;
const DRY: f64 = 1.5;

/// Of what had gathered before a covariate's first value less than this share is nothing.
const REMEMBERED: f64 = 0.02;
/// This share of a step is rounding.
const ROUNDING: f64 = 1e-6;
/// A mean delay of less than this share of the step between values is none.
const SHORTEST: f64 = 1e-3;

/// A response: the mean of an exponential distribution, or of a gamma distribution of shape 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Response {
    pub(super) form: Form,
    /// Exponentials one after another: 1 or 2.
    pub(super) stages: u8,
    /// Mean delay, days.
    pub(super) mean_days: f64,
    /// By so much, in the covariate's unit, what had gathered before its first value differs from what is usual; 0 where that is not fitted.
    pub(super) before: f64,
}

impl Response {
    /// By when 95 % of the response has passed, days.
    pub(super) fn memory_days(&self) -> f64 {
        // -ln .05, and the same quantile of a gamma distribution of shape 2 and mean 1.
        let quantile = if self.stages == 1 { 2.9957 } else { 2.3719 };
        quantile * self.mean_days
    }

    /// Whether it remembers more than half of a record of so many days.
    pub(super) fn outlasts_half_of(&self, span_days: f64) -> bool {
        self.memory_days() > 0.5 * span_days
    }
}

impl Driver {
    /// The one of `drivers` with this index.
    pub(super) fn at(drivers: &[Self], index: Option<usize>) -> Option<&Self> {
        drivers.iter().find(|one| Some(one.index) == index)
    }

    /// The channel, which stands at `index` among those that were given, in days since `epoch`: linear between its samples, rain evenly over
    /// the time before each; `None` where it holds no change.
    pub(super) fn new(index: usize, channel: &Channel, epoch: Timestamp) -> Option<Self> {
        let samples: Vec<(f64, f64)> = channel
            .samples
            .iter()
            .map(|sample| (days_since(epoch, sample.time), sample.value))
            .collect();
        let (first, last) = (samples.first()?, samples.last()?);
        if samples.len() < 4
            || samples
                .iter()
                .all(|(_, value)| value.total_cmp(&first.1).is_eq())
        {
            return None;
        }
        let (span, start) = (last.0 - first.0, first.0);
        let apart = samples.windows(2).map(|pair| pair[1].0 - pair[0].0);
        let spacing =
            super::quantiles::upper_median(apart.collect()).max(span / (MOST_SAMPLES - 1) as f64);
        let count = (span / spacing).round().max(3.0);
        let step = span / count;
        let mut gaps = gaps(&samples, spacing);
        let is_total = channel.kind() == CovariateKind::Rain;
        let samples = if is_total && comes_only_when_it_rains(&samples, gaps.len()) {
            gaps.clear();
            with_dry_spells(samples, spacing)
        } else {
            samples
        };
        let values = if is_total {
            amounts(samples, (spacing, &gaps), (step, count))
        } else {
            on_a_grid(&samples, step, count)
        };
        Some(Self {
            index,
            name: channel.name.clone(),
            kind: channel.kind(),
            start,
            step,
            values,
            is_total,
            gaps,
        })
    }

    /// The gap in its values, as its first day and its last, from which its values of that day are not known: within the gap, or within
    /// `memory` days of its end. Before the first value there is one.
    pub(super) fn gap_at(&self, day: f64, memory: f64) -> Option<(f64, f64)> {
        let before = (f64::NEG_INFINITY, self.start);
        let mut all = std::iter::once(before).chain(self.gaps.iter().copied());
        all.find(|(from, until)| (*from..=until + memory).contains(&day))
    }

    /// Its gaps within these days.
    pub(super) fn gaps_within(&self, first: f64, last: f64) -> impl Iterator<Item = (f64, f64)> {
        let all = self.gaps.iter().copied();
        all.filter(move |(from, until)| *until > first && *from < last)
    }

    /// The share of `nodes` that the channel covers.
    pub(super) fn coverage(&self, nodes: &[f64]) -> f64 {
        let end = self.start + self.step * (self.values.len() - 1) as f64;
        let slack = self.step;
        let inside = nodes
            .iter()
            .filter(|t| **t >= self.start - slack && **t <= end + slack);
        inside.count() as f64 / nodes.len() as f64
    }

    /// Whether it reaches the top hundredth of its values between two days.
    pub(super) fn is_high(&self, from: f64, until: f64) -> bool {
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        let top = sorted[sorted.len() - 1 - sorted.len() / 100];
        let day = |k: usize| self.start + k as f64 * self.step;
        let mut each = self.values.iter().enumerate();
        // Of rain that seldom falls the top hundredth holds dry days: they are not high.
        let is_high = |value: f64| value >= top && value > sorted[0];
        each.any(|(k, value)| is_high(*value) && (from..=until).contains(&day(k)))
    }

    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether what had gathered before its first value still counts on that day.
    pub(super) fn remembers_its_start(&self, response: Response, day: f64) -> bool {
        response.mean_days >= SHORTEST * self.step
            && (-(day - self.start).max(0.0) / response.mean_days).exp() > REMEMBERED
    }

    /// The standard deviation of its values.
    pub(super) fn spread(&self) -> f64 {
        mean_and_deviation(&self.values).1
    }

    /// Days from one value to the next.
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// The same covariate at another time: shifted round its own ends, and backwards if `mirrored`.
    pub(super) fn shifted(&self, by: usize, mirrored: bool) -> Self {
        let mut values = self.values.clone();
        if mirrored {
            values.reverse();
        }
        let by = by % values.len();
        values.rotate_left(by);
        Self {
            values,
            name: String::new(),
            gaps: Vec::new(),
            ..*self
        }
    }

    /// The same covariate with its values so many days earlier.
    pub(super) fn earlier(&self, days: f64) -> Self {
        let gaps = self.gaps.iter();
        Self {
            start: self.start - days,
            gaps: gaps
                .map(|(from, until)| (from - days, until - days))
                .collect(),
            ..self.clone()
        }
    }

    /// The same covariate shifted by a share of its record, and backwards if `mirrored`: a level by its changes, so that none comes in
    /// where its end meets its beginning, what fell by its amounts.
    pub(super) fn moved_by(&self, share: f64, mirrored: bool) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of a length"
        )]
        let by = (share * self.len() as f64).round() as usize;
        if self.is_total {
            return self.shifted(by, mirrored);
        }
        let mut changes: Vec<f64> = self.values.windows(2).map(|w| w[1] - w[0]).collect();
        if mirrored {
            changes.reverse();
        }
        let by = by % changes.len();
        changes.rotate_left(by);
        let mut level = self.values[0];
        let later = changes.into_iter().map(|change| {
            level += change;
            level
        });
        Self {
            values: std::iter::once(self.values[0]).chain(later).collect(),
            name: self.name.clone(),
            gaps: Vec::new(),
            ..*self
        }
    }

    /// Its response at `nodes`, mean 0 and standard deviation 1 there; `None` where it does not move.
    pub(super) fn respond(&self, response: Response, nodes: &[f64]) -> Option<Vec<f64>> {
        standardise(self.respond_in_unit(response, nodes))
    }

    /// The same in the channel's own unit (per day, for a rate).
    pub(super) fn respond_in_unit(&self, response: Response, nodes: &[f64]) -> Vec<f64> {
        let mut level = self.values.clone();
        // What one stage gives is linear between its values, whatever it was given.
        let mut is_total = self.is_total;
        let mut settled = None;
        for _ in 0..response.stages {
            if response.form == Form::Rate && response.mean_days < 0.5 * self.step {
                break;
            }
            let mean = response.mean_days / f64::from(response.stages);
            if mean >= SHORTEST * self.step {
                let from = settled.unwrap_or_else(|| self.settled(mean) + response.before);
                filter(&mut level, self.step, (mean, from), is_total);
                is_total = false;
                settled = Some(level[0]);
            }
        }
        if response.form == Form::Rate {
            level = self.rate(&level, response);
        }
        self.read(&level, nodes, is_total)
    }

    /// To what a response of mean `mean` days has settled before the first value: of what comes and goes to its mean, or, where there are years of
    /// it, to what it is at that date of the others; else to that value.
    fn settled(&self, mean: f64) -> f64 {
        match self.kind {
            CovariateKind::Rain | CovariateKind::Flow => {
                let usual = self.values.iter().sum::<f64>() / self.values.len() as f64;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a number of steps"
                )]
                let place = |year: f64| (year * DAYS_PER_YEAR / self.step).round() as usize;
                let places = (1..).map(f64::from).map(place);
                let places: Vec<usize> = places
                    .take_while(|place| *place < self.values.len())
                    .collect();
                if places.len() < FEWEST_YEARS {
                    return usual;
                }
                let mut level = self.values.clone();
                filter(&mut level, self.step, (mean, usual), self.is_total);
                let others = places.iter().map(|place| level[*place]);
                others.sum::<f64>() / places.len() as f64
            }
            CovariateKind::Level
            | CovariateKind::Temperature
            | CovariateKind::Humidity
            | CovariateKind::Pressure
            | CovariateKind::Other => self.values[0],
        }
    }

    /// d/dt of the response: by the exponential's own equation, or from one value to the next.
    fn rate(&self, filtered: &[f64], response: Response) -> Vec<f64> {
        let changes = filtered.windows(2).map(|w| (w[1] - w[0]) / self.step);
        let mut slopes: Vec<f64> = changes.collect();
        let before = if response.mean_days < 0.5 * self.step || response.before != 0.0 {
            slopes.first().copied().unwrap_or(0.0)
        } else {
            0.0
        };
        slopes.insert(0, before);
        slopes
    }

    /// The values at `nodes`: linear between them, of totals that of the time in which a node lies.
    fn read(&self, values: &[f64], nodes: &[f64], are_totals: bool) -> Vec<f64> {
        let last = values.len() - 1;
        let value = |t: &f64| {
            let place = ((t - self.start) / self.step).clamp(0.0, last as f64);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 0 and the number of values"
            )]
            let before = (place.floor() as usize).min(last.saturating_sub(1));
            let share = place - before as f64;
            let share = if are_totals {
                // A node at the end of a total's time is in it, rounding or not.
                (share - ROUNDING).ceil()
            } else {
                share
            };
            values[before] + share * (values[before + 1] - values[before])
        };
        nodes.iter().map(value).collect()
    }
}

/// Where samples stand further apart than they usually do.
fn gaps(samples: &[(f64, f64)], spacing: f64) -> Vec<(f64, f64)> {
    let pairs = samples.windows(2).map(|pair| (pair[0].0, pair[1].0));
    let long = pairs.filter(|(from, until)| until - from > GAP * spacing);
    long.collect()
}

/// Whether a gauge reports only while it rains: it hardly ever reports nothing, and often not at all.
fn comes_only_when_it_rains(samples: &[(f64, f64)], gaps: usize) -> bool {
    let values = || samples.iter().map(|(_, value)| *value);
    let count = samples.len() as f64;
    let zeros = values().filter(|value| *value == 0.0).count();
    let is_often = gaps >= FEWEST_SPELLS && gaps as f64 > SPELLS * count;
    let total = RunningTotal::of(&values().collect::<Vec<f64>>());
    is_often && (zeros as f64) < ZEROS * count && total.is_none()
}

/// Nothing falls between samples further apart than usual, but for the step before the later one.
fn with_dry_spells(samples: Vec<(f64, f64)>, spacing: f64) -> Vec<(f64, f64)> {
    let mut all: Vec<(f64, f64)> = Vec::with_capacity(2 * samples.len());
    for (t, value) in samples {
        let before = all.last().map(|last| last.0);
        if before.is_some_and(|before| t - before > DRY * spacing) {
            all.push((t - spacing, 0.0));
        }
        all.push((t, value));
    }
    all
}

/// The amount of each of `count` steps from the first sample on, of amounts that came since the sample before each, or of their running
/// total; what came before the first sample is not known of a total, and counts as what usually comes.
fn amounts(
    samples: Vec<(f64, f64)>,
    (spacing, gaps): (f64, &[(f64, f64)]),
    (step, count): (f64, f64),
) -> Vec<f64> {
    let values: Vec<f64> = samples.iter().map(|(_, value)| *value).collect();
    let total = RunningTotal::of(&values);
    let is_running = total.is_some();
    let sums = match total {
        Some(total) => continued(samples, &total.set_back),
        None => summed(filled(samples, spacing, gaps)),
    };
    let sums = on_a_grid(&sums, step, count);
    let each = sums.windows(2).map(|pair| pair[1] - pair[0]);
    let first = if is_running {
        (sums[sums.len() - 1] - sums[0]) / count
    } else {
        values[0]
    };
    std::iter::once(first).chain(each).collect()
}

/// The running sum of amounts, each of which came since the sample before it; that of the first is not known to have come in any time.
fn summed(samples: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let mut sum = -samples.first().map_or(0.0, |(_, value)| *value);
    let each = samples.into_iter().map(|(t, value)| {
        sum += value;
        (t, sum)
    });
    each.collect()
}

/// A running total as if it had never been set back.
fn continued(mut samples: Vec<(f64, f64)>, set_back: &[usize]) -> Vec<(f64, f64)> {
    let mut before = 0.0;
    let mut from = 0;
    for end in set_back.iter().copied().chain([samples.len()]) {
        let last = samples[end - 1].1;
        for (_, value) in &mut samples[from..end] {
            *value += before;
        }
        (before, from) = (before + last, end);
    }
    samples
}

/// Amounts with the usual one in each gap: the first after it came since the gap's last step, and nobody knows what came before. Where that
/// first one is half of what usually comes in such a time, it is all that came in the gap.
fn filled(samples: Vec<(f64, f64)>, spacing: f64, gaps: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let known: f64 = samples.iter().skip(1).map(|(_, value)| value).sum();
    let missing: f64 = gaps
        .iter()
        .map(|(from, until)| until - from - spacing)
        .sum();
    let span = samples[samples.len() - 1].0 - samples[0].0;
    let usual = known / (span - missing).max(spacing);
    let mut all = Vec::with_capacity(samples.len() + gaps.len());
    let mut gaps = gaps.iter().peekable();
    for (until, value) in samples {
        let gap = gaps.next_if(|gap| gap.1.total_cmp(&until).is_eq());
        if let Some((from, _)) = gap.filter(|gap| value < HALF * usual * (until - gap.0)) {
            let last = until - spacing;
            all.push((last, usual * (last - from)));
        }
        all.push((until, value));
    }
    all
}

/// Samples, linear between them, at `count` steps from the first on.
fn on_a_grid(samples: &[(f64, f64)], step: f64, count: f64) -> Vec<f64> {
    let mut later = 1;
    let mut values = Vec::new();
    let mut k = 0.0;
    while k <= count {
        let t = samples[0].0 + k * step;
        while later + 1 < samples.len() && samples[later].0 < t {
            later += 1;
        }
        let ((t_0, u_0), (t_1, u_1)) = (samples[later - 1], samples[later]);
        values.push(u_0 + (u_1 - u_0) * ((t - t_0) / (t_1 - t_0)).clamp(0.0, 1.0));
        k += 1.0;
    }
    values
}

/// The exponential response of mean `mean` to values `step` apart, `settled` before the first. Between the values the input is linear; where
/// they are totals it is the later one throughout.
fn filter(values: &mut [f64], step: f64, (mean, settled): (f64, f64), are_totals: bool) {
    let ratio = step / mean;
    let decay = (-ratio).exp();
    // Of a linear input: the mean of the step's start and end under the exponential.
    let late = if are_totals {
        1.0 - decay
    } else {
        1.0 - (1.0 - decay) / ratio
    };
    let early = 1.0 - decay - late;
    let mut state = settled;
    let mut before = values[0];
    for value in values.iter_mut() {
        let now = *value;
        state = decay * state + early * before + late * now;
        before = now;
        *value = state;
    }
}

#[cfg(test)]
mod tests;
