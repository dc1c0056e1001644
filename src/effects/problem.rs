//! The readings of one benchmark as the refits see them: days and mm, weights, and the nodes of the law's solution.

use super::faults::resolution;
use super::quantiles::upper_median;
use super::weights::{local_misfits, unit_median, weights};
use crate::fit::Observations;
use crate::reading::{
    Channel, NORMAL_MEDIAN, Quantity, SECONDS_PER_DAY, Series, Timestamp, days_since,
    rounding_error,
};

/// More readings than this are averaged in blocks.
pub(super) const MOST_READINGS: usize = 3000;
/// The law is solved on about this many nodes at least, where channels are as fine.
const NODES: f64 = 1500.0;
/// No more nodes than this between two readings, where they stand evenly: a response smooths what is finer.
const NODES_A_READING: f64 = 4.0;
/// Where the most nodes a reading are no more than this altogether they cost little, and the law is solved on them whatever the channels are: what is
/// found of few readings is not to depend on how often a channel is read that has nothing to do with it.
const FEW_NODES: f64 = 400.0;
/// Of the largest reading.
const FINEST: f64 = 1e-9;
/// Share of the usual velocity under which a load has no hold on the noise: there the readings give no velocity.
const LEAST_SEEN: f64 = 0.1;

/// One benchmark's readings.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    pub(super) quantity: Quantity,
    /// For velocities, days over which each is the mean; 0: of the moment.
    pub(super) averaging_days: f64,
    /// Day 0.
    pub(super) epoch: Timestamp,
    /// Days, increasing.
    pub(super) t: Vec<f64>,
    /// mm or mm/day.
    pub(super) y: Vec<f64>,
    /// Standard deviation of a reading's white noise, up to a common factor; its median is 1.
    pub(super) weight: Vec<f64>,
    /// Days on which the law is solved; every reading stands on one.
    pub(super) nodes: Vec<f64>,
    /// Which node each reading stands on.
    pub(super) node_of: Vec<usize>,
    /// The first readings, which are fitted; the others are held out.
    pub(super) used: usize,
    /// Median days between readings.
    pub(super) spacing: f64,
    /// Rough white noise of a reading, in mm or mm/day.
    pub(super) scatter: f64,
    /// Standard deviation of what the readings' own digits leave open, in mm or mm/day: no noise is smaller.
    pub(super) rounding: f64,
    /// The velocity that an undeclared load multiplies, at each reading, mm/day: the plain law's by least
    /// squares, so that every model is judged under the same noise.
    pub(super) seen: Vec<f64>,
    /// Whether the weights go with the velocities beside each reading.
    pub(super) is_relative: bool,
}

impl Problem {
    /// The fitted readings less a prediction of all readings.
    pub(super) fn residual(&self, prediction: &[f64]) -> Vec<f64> {
        let both = self.y.iter().zip(prediction).take(self.used);
        both.map(|(y, prediction)| y - prediction).collect()
    }

    /// From cleaned readings; `channels` say how fine the load may change. `None` with fewer than eight.
    pub(super) fn new(series: &Series, channels: &[Channel]) -> Option<Self> {
        let mut observations = Observations::of(series);
        if observations.averaging_days > 0.0 {
            // Means that overlap repeat each other.
            observations.values = observations.spaced(usize::MAX);
        }
        let epoch = series.readings.first()?.time;
        let (t, y, sigma) = blocks(&observations);
        if t.len() < 8 {
            return None;
        }
        let spacing = upper_median(t.windows(2).map(|pair| pair[1] - pair[0]).collect());
        let misfits = local_misfits(&t, &y);
        let weight = match &sigma {
            Some(sigma) => unit_median(sigma.clone()),
            None => weights(observations.quantity, &t, &y, &misfits),
        };
        let is_relative =
            sigma.is_none() && weight.iter().any(|one| one.to_bits() != 1.0_f64.to_bits());
        let relative = misfits.iter().zip(&weight).map(|(m, w)| (m / w).abs());
        let rounding = rounding(series, &y);
        let scatter = (upper_median(relative.collect()) / NORMAL_MEDIAN).max(rounding);
        let fine = channels
            .iter()
            .filter_map(channel_spacing)
            .fold(spacing, f64::min);
        let (nodes, node_of) = nodes(&t, observations.averaging_days, fine);
        let seen = vec![1.0; t.len()];
        Some(Self {
            seen,
            is_relative,
            quantity: observations.quantity,
            averaging_days: observations.averaging_days,
            epoch,
            used: t.len(),
            t,
            y,
            weight,
            nodes,
            node_of,
            spacing,
            scatter,
            rounding,
        })
    }

    /// Takes the plain law's velocities for those that an undeclared load multiplies.
    pub(super) fn see(&mut self, velocity: &[f64]) {
        let usual = upper_median(velocity.to_vec());
        let seen = velocity.iter().map(|v| v.max(LEAST_SEEN * usual));
        self.seen = seen.collect();
    }

    /// What all readings range over, those of the later block too, mm or mm/day; where they are equal no error is beyond it.
    pub(super) fn range(&self) -> f64 {
        let least = self.y.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most > least {
            most - least
        } else {
            f64::INFINITY
        }
    }

    /// The same with only the first `used` readings fitted.
    pub(super) fn trained_on(&self, used: usize) -> Self {
        Self {
            used,
            ..self.clone()
        }
    }

    /// The first `count` readings alone, as if nothing had been read later.
    pub(super) fn until(&self, count: usize) -> Self {
        let mut part = self.trained_on(count);
        part.t.truncate(count);
        part.y.truncate(count);
        part.weight.truncate(count);
        part.seen.truncate(count);
        part.node_of.truncate(count);
        let last = part.node_of.last().copied().unwrap_or(0);
        part.nodes.truncate(last + 1);
        part
    }

    /// Days from the first reading to the last that is fitted.
    pub(super) fn span(&self) -> f64 {
        self.t[self.used - 1] - self.t[0]
    }

    /// Days from the first reading to the last, also where that is held out.
    pub(super) fn whole_span(&self) -> f64 {
        self.t[self.t.len() - 1] - self.t[0]
    }

    /// Mean velocity over the fitted readings, mm/day, positive.
    pub(super) fn typical_velocity(&self) -> f64 {
        let used = &self.y[..self.used];
        let v = match self.quantity {
            Quantity::Displacement => (used[used.len() - 1] - used[0]) / self.span(),
            Quantity::Velocity => used.iter().sum::<f64>() / used.len() as f64,
        };
        let least = match self.quantity {
            Quantity::Displacement => self.scatter / self.span(),
            Quantity::Velocity => 0.1 * self.scatter,
        };
        v.max(least)
    }
}

/// Readings as (days, value, stated sigma where all have one), averaged where there are too many.
fn blocks(observations: &Observations) -> (Vec<f64>, Vec<f64>, Option<Vec<f64>>) {
    let values = &observations.values;
    let size = values.len().div_ceil(MOST_READINGS).max(1);
    let mean = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let starts = (0..values.len()).step_by(size);
        starts
            .map(|start| {
                let end = (start + size).min(values.len());
                (start..end).map(of).sum::<f64>() / (end - start) as f64
            })
            .collect()
    };
    let stated = values.iter().all(|value| value.sigma.is_some());
    let sigma = stated.then(|| mean(&|i| values[i].sigma.unwrap_or(1.0)));
    (
        mean(&|i| values[i].t_days),
        mean(&|i| values[i].value),
        sigma,
    )
}

/// That of readings which are rounded to the step on which they stand, or to their last digit; nothing is known better than to `FINEST`
/// of the largest.
fn rounding(series: &Series, y: &[f64]) -> f64 {
    let values: Vec<f64> = series.readings.iter().map(|one| one.value).collect();
    let step = resolution(&values) * series.unit.factor();
    let most = y.iter().fold(1e-3_f64, |most, y| most.max(y.abs()));
    let together = values.len() as f64 / y.len() as f64;
    (rounding_error(step) / together.sqrt()).max(FINEST * most)
}

fn channel_spacing(channel: &Channel) -> Option<f64> {
    let gaps = channel.samples.windows(2);
    let gaps: Vec<f64> = gaps
        .map(|pair| days_since(pair[0].time, pair[1].time))
        .collect();
    (!gaps.is_empty()).then(|| upper_median(gaps).max(1.0 / SECONDS_PER_DAY))
}

/// Reading times, and between them as many more as `fine` days ask for, within bounds.
fn nodes(t: &[f64], averaging_days: f64, fine: f64) -> (Vec<f64>, Vec<usize>) {
    let span = t[t.len() - 1] - t[0];
    let usual = upper_median(t.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let finest = usual / NODES_A_READING;
    let fine = if span <= FEW_NODES * finest {
        finest
    } else {
        fine
    };
    let step = fine.max(span / NODES).max(finest);
    let (mut nodes, mut node_of) = (Vec::new(), Vec::new());
    if averaging_days > 0.0 {
        nodes.push(t[0] - averaging_days);
    }
    for &reading in t {
        if let Some(&before) = nodes.last() {
            let parts = ((reading - before) / step * 0.999).ceil().max(1.0);
            let mut part = 1.0;
            while part < parts {
                nodes.push(before + (reading - before) * part / parts);
                part += 1.0;
            }
        }
        node_of.push(nodes.len());
        nodes.push(reading);
    }
    (nodes, node_of)
}

/// The slip from the first of the times, days, to each: velocities, one a time, by the trapezium rule.
pub(super) fn slips(t: &[f64], velocity: &[f64]) -> Vec<f64> {
    let steps = velocity.windows(2).zip(t.windows(2));
    let each = steps.map(|(v, t)| 0.5 * (v[0] + v[1]) * (t[1] - t[0]));
    let sums = each.scan(0.0, |sum, step| {
        *sum += step;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

#[cfg(test)]
mod tests;
