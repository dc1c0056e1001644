//! When a slope will collapse by Voight's relation with any exponent.
//!
//! Towards a collapse at `t_f` the velocity grows as `(t_f - t)^-p`, p = 1 / (alpha - 1) (Voight 1988). The straight line
//! through inverse velocity is the case p = 1; where p is 2 that line meets zero at half of the time that remains. Here `t_f`,
//! p, the roughness of the motion and the beginning of the acceleration are all unknown, and the posterior of `t_f` is summed over
//! the others. The rates before the beginning keep no law: ln of each differs from the next one's by [`STEP`]. Motion that
//! keeps no such law leaves `t_f` open, and so does an exponential, which ends at no time of its own.

use super::Passage;
use crate::fit::Rate;

/// Newest rates of the windows within which the law is kept.
const WINDOWS: [usize; 7] = [8, 12, 18, 28, 42, 64, 96];
/// Standard deviation of the step of ln from one rate to the next where no law is kept.
const STEP: f64 = 0.5;
/// Lattice of the time that remains: from this share of the shortest window to this multiple of the longest.
const TIMES: usize = 64;
const REMAINS: (f64, f64) = (0.03, 20.0);
/// Bounds of p, its median and the standard deviation of its logarithm: alpha is 2 in the median of published failures and
/// mostly between 1.5 and 3.
const POWERS: (f64, f64) = (0.2, 25.0);
const USUAL_POWER: (f64, f64) = (1.0, 0.6);
/// A law of a larger power is as good as an exponential, and one by which the velocity has grown by less than this within its
/// window is as good as one velocity: neither says when it ends.
const LARGEST_POWER: f64 = 5.0;
const LEAST_GROWTH: f64 = 2.0;
/// Lattice of the standard deviation of ln of a rate about the law, beside the rate's own error.
const ROUGHNESSES: [f64; 5] = [0.006, 0.025, 0.08, 0.25, 0.8];
/// Newton's steps to the most likely power; the curvature there is at least this share of that of a straight line, and sums of
/// squares under the last figure are none.
const NEWTON: usize = 3;
const LEAST_CURVE: f64 = 0.3;
const LEAST_SUM: f64 = 1e-12;
/// The most that the misfits of neighbours are taken to be correlated.
const MOST_CORRELATION: f64 = 0.5;
/// A rate counts that is so many times its standard error.
const CLEAR_ERRORS: f64 = 2.0;
/// The standard deviation of ln of the time that remains, and the roughness, by which the law is known so badly that little of it
/// counts. Set on simulated slopes: those whose motion is rough, or that keep no law, lose nothing by it.
const KNOWN: f64 = 0.5;
const SMOOTH: f64 = 0.1;

/// What Voight's relation gives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FreeExponent {
    /// Days to the collapse; the chances sum to 1.
    pub(super) passage: Passage,
    /// How well the law is kept and says when it ends, 0 to 1.
    pub(super) is_kept: f64,
}

/// One rate that moves.
#[derive(Debug, Clone, Copy)]
struct MovingRate {
    /// Of its middle, days before now.
    ago: f64,
    /// Its length, days.
    length: f64,
    ln_velocity: f64,
    /// Variance of that by the instrument.
    variance: f64,
}

/// The law of the most likely power with one time that remains and one roughness, in one window.
#[derive(Debug, Clone, Copy)]
struct ExponentCell {
    window: usize,
    remains: f64,
    roughness: f64,
    power: f64,
    ln_likelihood: f64,
    /// ln of the prior density of the power, times the width within which the rates leave it.
    ln_prior: f64,
}

/// ShapeSums over the rates of a window that are the same for every time that remains: of the weights, of their logarithms, and of
/// y and its square times the weights.
#[derive(Debug, Clone, Copy, Default)]
struct Fixed {
    weight: f64,
    ln_weights: f64,
    y: f64,
    yy: f64,
}

/// Weighted sums of x, b, x y, b y, x x, x b and b b over the rates of a window: ln v = c + p x + p (p + 1) b, where x is
/// -ln of the time that remained and b what the length of a rate adds to its mean.
type ShapeSums = [f64; 7];

impl FreeExponent {
    /// After `rates`, the newest last; `None` with too few of them that move.
    pub(super) fn fit(rates: &[Rate], now_days: f64) -> Option<Self> {
        let moving = rates.iter().rev();
        let moving = moving.filter(|rate| rate.velocity > (CLEAR_ERRORS * rate.sigma).max(0.0));
        let points: Vec<MovingRate> = moving
            .map(|rate| MovingRate {
                ago: now_days - rate.middle(),
                length: rate.to - rate.from,
                ln_velocity: rate.velocity.ln(),
                variance: (rate.sigma / rate.velocity).powi(2),
            })
            .collect();
        if points.len() < WINDOWS[0] {
            return None;
        }
        let before = without_a_law(&points);
        let mut law = law(&points);
        for cell in &mut law {
            cell.ln_likelihood += before[cell.window];
        }
        let share = independent(&points, &law)?;
        let ln = |cell: &ExponentCell| share * cell.ln_likelihood + cell.ln_prior;
        let most = law.iter().map(ln).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = law.iter().map(|cell| (ln(cell) - most).exp()).collect();
        let all: f64 = weights.iter().sum();
        let mean = |of: &dyn Fn(&ExponentCell) -> f64| {
            let each = law.iter().zip(&weights);
            each.map(|(cell, weight)| weight * of(cell)).sum::<f64>() / all
        };
        let ln_days = mean(&|cell| cell.remains.ln());
        let square = mean(&|cell| (cell.remains.ln() - ln_days).powi(2));
        let ends = mean(&|cell| f64::from(u8::from(cell.ends(&points))));
        let roughness = mean(&|cell| cell.roughness.ln()).exp();
        let mut times = vec![(0.0, 0.0); TIMES];
        for (index, (cell, weight)) in law.iter().zip(&weights).enumerate() {
            let slot = &mut times[index % TIMES];
            *slot = (cell.remains, slot.1 + weight / all);
        }
        Some(Self {
            passage: Passage::from_times(times),
            is_kept: ends * ends * (-square / (KNOWN * KNOWN)).exp()
                / (1.0 + (roughness / SMOOTH).powi(2)),
        })
    }
}

impl ExponentCell {
    /// Whether the law says when it ends.
    fn ends(&self, points: &[MovingRate]) -> bool {
        let grown = self.power * (1.0 + length(points, self.window) / self.remains).ln();
        self.power < LARGEST_POWER && grown > LEAST_GROWTH.ln()
    }
}

impl Fixed {
    fn add(&mut self, weight: f64, y: f64) {
        self.weight += weight;
        self.ln_weights += weight.ln();
        self.y += weight * y;
        self.yy += weight * y * y;
    }

    /// ln of the likelihood with that sum of squared misfits, the level of the velocity integrated out.
    fn ln_likelihood(&self, squares: f64) -> f64 {
        -0.5 * squares.max(0.0) + 0.5 * self.ln_weights - 0.5 * self.weight.ln()
    }
}

/// Days from the oldest of the rates of a window to now.
fn length(points: &[MovingRate], window: usize) -> f64 {
    let oldest = &points[WINDOWS[window] - 1];
    oldest.ago + 0.5 * oldest.length
}

/// How many windows the rates fill.
fn windows(points: &[MovingRate]) -> usize {
    let filled = WINDOWS.iter().filter(|count| **count <= points.len());
    filled.count()
}

/// For each window ln of the likelihood of the rates before it.
fn without_a_law(points: &[MovingRate]) -> [f64; WINDOWS.len()] {
    WINDOWS.map(|count| {
        let before = points.get(count - 1..).unwrap_or_default();
        let steps = before.windows(2).map(|pair| {
            let variance = STEP * STEP + pair[0].variance + pair[1].variance;
            let step = pair[0].ln_velocity - pair[1].ln_velocity;
            -0.5 * (step * step / variance + variance.ln())
        });
        steps.sum()
    })
}

/// The laws of all windows, roughnesses and times that remain, the last of these fastest.
fn law(points: &[MovingRate]) -> Vec<ExponentCell> {
    let windows = windows(points);
    let (low, high) = (
        REMAINS.0 * length(points, 0),
        REMAINS.1 * length(points, windows - 1),
    );
    let share = |index: usize| (index as f64 + 0.5) / TIMES as f64;
    let remains: Vec<f64> = (0..TIMES)
        .map(|index| low * (high / low).powf(share(index)))
        .collect();
    let shapes: Vec<Vec<[f64; 3]>> = remains.iter().map(|days| shape(points, *days)).collect();
    let fixed = ROUGHNESSES.map(|roughness| fixed(points, roughness));
    let weights = ROUGHNESSES.map(|roughness| weights(points, roughness));
    let mut sums: Vec<ShapeSums> = vec![[0.0; 7]; TIMES * ROUGHNESSES.len()];
    let mut law = Vec::with_capacity(windows * sums.len());
    let mut from = 0;
    for (window, count) in WINDOWS[..windows].iter().enumerate() {
        for (index, roughness) in ROUGHNESSES.iter().enumerate() {
            let weights = &weights[index][from..*count];
            for (time, shape) in shapes.iter().enumerate() {
                let sums = &mut sums[index * TIMES + time];
                add(sums, weights, &shape[from..*count]);
                let place = (window, remains[time], *roughness);
                law.push(cell(&fixed[index][window], sums, place));
            }
        }
        from = *count;
    }
    law
}

fn add(sums: &mut ShapeSums, weights: &[f64], shape: &[[f64; 3]]) {
    for (weight, [y, x, b]) in weights.iter().zip(shape) {
        let (wx, wb) = (weight * x, weight * b);
        let more = [wx, wb, wx * y, wb * y, wx * x, wx * b, wb * b];
        for (slot, value) in sums.iter_mut().zip(more) {
            *slot += value;
        }
    }
}

/// y, x and b of each rate; x and y without what is the same for all.
fn shape(points: &[MovingRate], remains: f64) -> Vec<[f64; 3]> {
    let newest = points[0].ln_velocity;
    let each = points.iter().map(|point| {
        let left = remains + point.ago;
        // The mean of a power law over a span, to the second order of the span over the time that remains.
        let b = (point.length / left).powi(2) / 24.0;
        [point.ln_velocity - newest, (remains / left).ln(), b]
    });
    each.collect()
}

fn weights(points: &[MovingRate], roughness: f64) -> Vec<f64> {
    let square = roughness * roughness;
    let each = points.iter().map(|point| 1.0 / (square + point.variance));
    each.collect()
}

/// For each window that the rates fill.
fn fixed(points: &[MovingRate], roughness: f64) -> Vec<Fixed> {
    let newest = points[0].ln_velocity;
    let weights = weights(points, roughness);
    let (mut sums, mut from) = (Fixed::default(), 0);
    let each = WINDOWS[..windows(points)].iter().map(|count| {
        for (point, weight) in points[from..*count].iter().zip(&weights[from..*count]) {
            sums.add(*weight, point.ln_velocity - newest);
        }
        from = *count;
        sums
    });
    each.collect()
}

/// The law of the most likely power, by Newton's steps from that without the length of the rates.
fn cell(
    fixed: &Fixed,
    sums: &ShapeSums,
    (window, remains, roughness): (usize, f64, f64),
) -> ExponentCell {
    let [x, b, xy, by, xx, xb, bb] = *sums;
    let [mean_y, mean_x, mean_b] = [fixed.y, x, b].map(|sum| sum / fixed.weight);
    let yy = fixed.yy - fixed.y * mean_y;
    let (xy, by) = (xy - x * mean_y, by - b * mean_y);
    let (xx, xb, bb) = (xx - x * mean_x, xb - x * mean_b, bb - b * mean_b);
    let bounded = |power: f64| power.clamp(POWERS.0, POWERS.1);
    let mut power = bounded(xy / xx.max(LEAST_SUM));
    for _ in 0..NEWTON {
        let (square, grows) = (power * (power + 1.0), 2.0 * power + 1.0);
        let slope =
            -xy - grows * by + power * xx + (square + power * grows) * xb + square * grows * bb;
        let curve =
            xx - 2.0 * by + 2.0 * (grows + power) * xb + (grows * grows + 2.0 * square) * bb;
        power = bounded(power - slope / curve.max(LEAST_CURVE * xx).max(LEAST_SUM));
    }
    let square = power * (power + 1.0);
    let straight = yy - 2.0 * power * xy + power * power * xx;
    let squares = straight + square * (2.0 * (power * xb - by) + square * bb);
    let from_usual = (power / USUAL_POWER.0).ln() / USUAL_POWER.1;
    let spread = USUAL_POWER.1 * power;
    ExponentCell {
        window,
        remains,
        roughness,
        power,
        ln_likelihood: fixed.ln_likelihood(squares),
        ln_prior: -0.5 * (from_usual * from_usual + (xx * spread * spread).ln_1p()),
    }
}

/// The share of the rates that are independent of each other, by the autocorrelation of their misfits to the best law.
fn independent(points: &[MovingRate], law: &[ExponentCell]) -> Option<f64> {
    let posterior = |cell: &ExponentCell| cell.ln_likelihood + cell.ln_prior;
    let best = law.iter();
    let best = best.max_by(|a, b| posterior(a).total_cmp(&posterior(b)))?;
    let points = &points[..WINDOWS[best.window]];
    let shape = shape(points, best.remains);
    let misfits = shape.iter().zip(weights(points, best.roughness));
    let misfits: Vec<f64> = misfits
        .map(|([y, x, b], weight)| {
            (y - best.power * x - best.power * (best.power + 1.0) * b) * weight.sqrt()
        })
        .collect();
    let mean = misfits.iter().sum::<f64>() / misfits.len() as f64;
    let square: f64 = misfits.iter().map(|one| (one - mean).powi(2)).sum();
    let pairs = misfits.windows(2);
    let product: f64 = pairs.map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    let correlation = (product / square.max(LEAST_SUM)).clamp(0.0, MOST_CORRELATION);
    Some((1.0 - correlation) / (1.0 + correlation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::ReadingError;

    /// Hourly rates of ten days, which end so many days before the collapse.
    fn rates(remains: f64, velocity: impl Fn(f64, u32) -> f64) -> Vec<Rate> {
        let hours = (0..96_u32).rev().map(|back| {
            let to = -f64::from(back) * 0.1;
            Rate {
                from: to - 0.1,
                to,
                velocity: velocity(remains - to + 0.05, back),
                sigma: 0.0,
                readings: 1,
                error: ReadingError::Own,
            }
        });
        hours.collect()
    }

    #[test]
    fn the_time_is_found_for_every_exponent_where_a_straight_line_finds_it_for_one() {
        for alpha in [1.5, 1.75, 2.0, 2.5, 3.0] {
            let power: f64 = 1.0 / (alpha - 1.0);
            let rates = rates(2.0, |left, _| 30.0 * left.powf(-power));
            let found = FreeExponent::fit(&rates, 0.0).unwrap();
            let median = found.passage.quantile(0.5, f64::INFINITY).unwrap();
            assert!((1.7..2.4).contains(&median), "{alpha}: {median}");
            assert!(found.is_kept > 0.5, "{alpha}: {found:?}");
        }
    }

    #[test]
    fn what_keeps_no_law_or_ends_at_no_time_does_not_count() {
        let exponential = rates(0.0, |left, _| 30.0 * (-left / 3.0).exp());
        let steady = rates(0.0, |_, _| 30.0);
        let rough = rates(2.0, |left, back| {
            30.0 / left * (1.5 * f64::from(back * back).sin()).exp()
        });
        for rates in [exponential, steady, rough] {
            let found = FreeExponent::fit(&rates, 0.0).unwrap();
            assert!(found.is_kept < 0.1, "{found:?}");
        }
        assert!(FreeExponent::fit(&[], 0.0).is_none());
    }
}
