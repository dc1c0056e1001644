//! The weights of least CRPS, by gradient descent with moments (Adam: Kingma and Ba 2015).

use super::looks::Look;
use slipwatch::forecast::{FEATURES, LINE_SPREAD, MEMBERS, Members};
use slipwatch::score::scored_days;

/// Times at which the distributions are compared, in equal ratios over the scored span.
const GRID: usize = 48;
const STEPS: usize = 1500;
const RATE: f64 = 0.03;
/// The penalty on the squares of what is learnt, features taken over their standard deviations.
const RIDGE: f64 = 1e-5;
const LEARNT: usize = FEATURES * (MEMBERS - 1) + 1;

pub(crate) struct Batch {
    rows: Vec<Row>,
    /// Mean and standard deviation of each feature.
    scales: [(f64, f64); FEATURES],
}

struct Row {
    features: [f64; FEATURES],
    misses: [f64; MEMBERS],
    /// ln of what the weights are multiplied by.
    room: [f64; MEMBERS],
    /// At each time of the grid: the members' chances of failure by then, and the share of the time left.
    chances: Vec<[f64; MEMBERS]>,
    spans: Vec<f64>,
    failed: Vec<f64>,
}

/// What a member gives to failing within `days`.
pub(crate) fn chance(members: &Members, member: usize, days: f64) -> f64 {
    if member == 0 {
        let within = members.law.iter().take_while(|(time, _)| *time <= days);
        return within.map(|(_, share)| share).sum();
    }
    let line = members.lines.get(member - 1).copied().flatten();
    line.map_or(0.0, |at| normal((days / at).ln() / LINE_SPREAD))
}

/// The standard normal distribution (Abramowitz and Stegun 7.1.26).
fn normal(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let sum = t
        * (0.254_829_592
            + t * (-0.284_496_736
                + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let half = 0.5 * sum * (-x * x).exp();
    if z > 0.0 { 1.0 - half } else { half }
}

impl Row {
    fn of(look: &Look) -> Self {
        let scored = scored_days(look.length);
        let end = if look.failed {
            scored
        } else {
            scored.min(look.remaining)
        };
        let mut edges: Vec<f64> = (0..=GRID)
            .map(|index| end * 400f64.powf(index as f64 / GRID as f64 - 1.0))
            .collect();
        edges.push(0.0);
        if look.failed && look.remaining < end {
            edges.push(look.remaining);
        }
        edges.sort_by(f64::total_cmp);
        let left = if look.failed { look.remaining } else { end };
        let (mut chances, mut spans, mut failed) = (Vec::new(), Vec::new(), Vec::new());
        for pair in edges.windows(2) {
            let middle = f64::midpoint(pair[0], pair[1]);
            chances.push(std::array::from_fn(|member| {
                chance(&look.members, member, middle)
            }));
            spans.push((pair[1] - pair[0]) / left);
            failed.push(f64::from(look.failed && middle >= look.remaining));
        }
        Self {
            features: look.members.features(),
            misses: look.members.misses,
            room: look.members.room().map(f64::ln),
            chances,
            spans,
            failed,
        }
    }
}

impl Batch {
    pub(crate) fn of(looks: &[Look]) -> Self {
        let mut rows: Vec<Row> = looks.iter().map(Row::of).collect();
        let mut scales = [(0.0, 1.0); FEATURES];
        for (feature, scale) in scales.iter_mut().enumerate().skip(1) {
            let mean =
                rows.iter().map(|row| row.features[feature]).sum::<f64>() / rows.len() as f64;
            let square = rows
                .iter()
                .map(|row| (row.features[feature] - mean).powi(2))
                .sum::<f64>();
            *scale = (mean, (square / rows.len() as f64).sqrt());
            for row in &mut rows {
                row.features[feature] = (row.features[feature] - scale.0) / scale.1;
            }
        }
        Self { rows, scales }
    }

    /// The gates, for features as they are, and how harshly misses count.
    pub(crate) fn least_crps(&self) -> ([[f64; FEATURES]; MEMBERS - 1], f64) {
        let mut learnt = [0.0; LEARNT];
        for member in 0..MEMBERS - 1 {
            learnt[member * FEATURES] = -2.0;
        }
        let (mut first, mut second) = ([0.0; LEARNT], [0.0; LEARNT]);
        for step in 1..=STEPS {
            let (score, gradient) = self.score(&learnt);
            if step % 100 == 0 {
                eprintln!("step {step}: CRPS over the time left {score:.5}");
            }
            let power = i32::try_from(step).unwrap_or(i32::MAX);
            let rate = RATE * if step > STEPS / 2 { 0.3 } else { 1.0 };
            for index in 0..LEARNT {
                let slope = gradient[index] + 2.0 * RIDGE * learnt[index];
                first[index] = 0.9 * first[index] + 0.1 * slope;
                second[index] = 0.999 * second[index] + 0.001 * slope * slope;
                let mean = first[index] / (1.0 - 0.9f64.powi(power));
                let square: f64 = second[index] / (1.0 - 0.999f64.powi(power));
                learnt[index] -= rate * mean / (square.sqrt() + 1e-9);
            }
        }
        (self.as_they_are(&learnt), learnt[LEARNT - 1])
    }

    fn as_they_are(&self, learnt: &[f64; LEARNT]) -> [[f64; FEATURES]; MEMBERS - 1] {
        std::array::from_fn(|member| {
            let mut gate = [0.0; FEATURES];
            gate[0] = learnt[member * FEATURES];
            for feature in 1..FEATURES {
                let (mean, deviation) = self.scales[feature];
                gate[feature] = learnt[member * FEATURES + feature] / deviation;
                gate[0] -= gate[feature] * mean;
            }
            gate
        })
    }

    /// The mean CRPS, each over the time left, and its gradient; half of the rows on each of two threads.
    fn score(&self, learnt: &[f64; LEARNT]) -> (f64, [f64; LEARNT]) {
        let half = self.rows.len().div_ceil(2);
        let sums: Vec<(f64, [f64; LEARNT])> = std::thread::scope(|scope| {
            let parts: Vec<_> = self
                .rows
                .chunks(half)
                .map(|part| scope.spawn(move || sum(part, learnt)))
                .collect();
            parts
                .into_iter()
                .filter_map(|part| part.join().ok())
                .collect()
        });
        let count = self.rows.len() as f64;
        let mut gradient = [0.0; LEARNT];
        let mut score = 0.0;
        for (part, slopes) in sums {
            score += part / count;
            for (sum, slope) in gradient.iter_mut().zip(slopes) {
                *sum += slope / count;
            }
        }
        (score, gradient)
    }
}

fn sum(rows: &[Row], learnt: &[f64; LEARNT]) -> (f64, [f64; LEARNT]) {
    let mut score = 0.0;
    let mut gradient = [0.0; LEARNT];
    for row in rows {
        let weights = weights(row, learnt);
        let mut by_weight = [0.0; MEMBERS];
        for ((chances, span), failed) in row.chances.iter().zip(&row.spans).zip(&row.failed) {
            let chance: f64 = weights
                .iter()
                .zip(chances)
                .map(|(weight, chance)| weight * chance)
                .sum();
            let off = chance - failed;
            score += off * off * span;
            for (slope, chance) in by_weight.iter_mut().zip(chances) {
                *slope += 2.0 * off * span * chance;
            }
        }
        let mean: f64 = weights
            .iter()
            .zip(&by_weight)
            .map(|(weight, slope)| weight * slope)
            .sum();
        for member in 1..MEMBERS {
            let slope = weights[member] * (by_weight[member] - mean);
            for feature in 0..FEATURES {
                gradient[(member - 1) * FEATURES + feature] += slope * row.features[feature];
            }
            gradient[LEARNT - 1] -= slope * row.misses[member];
        }
    }
    (score, gradient)
}

fn weights(row: &Row, learnt: &[f64; LEARNT]) -> [f64; MEMBERS] {
    let mut weights = row.room;
    for member in 1..MEMBERS {
        let gate = &learnt[(member - 1) * FEATURES..member * FEATURES];
        let terms = gate
            .iter()
            .zip(&row.features)
            .map(|(by, feature)| by * feature);
        weights[member] =
            terms.sum::<f64>() - learnt[LEARNT - 1] * row.misses[member] + row.room[member];
    }
    let most = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = weights.iter().map(|weight| (weight - most).exp()).sum();
    weights.map(|weight| (weight - most).exp() / total)
}
