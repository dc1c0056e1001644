//! The exponent of dv/dt = A v^alpha (Fukuzono 1985, Voight 1988) by profile least squares in ln v.
//!
//! For alpha > 1, ln v = c - `ln(t_c` - t) / (alpha - 1); alpha = 1 is exponential growth, and below it
//! ln v = c + ln(t - `t_0`) / (1 - alpha). alpha = 2 is the straight line through inverse velocity.

use super::estimate::Estimate;
use crate::fit::Rate;
use crate::reading::CHI_SQUARED_90;

/// The exponents looked at: lowest, step, how many.
const ALPHAS: (f64, f64, u32) = (0.0, 0.01, 501);
/// Distances of the pole from the record looked at, over the record's length: lowest, highest, how many.
const POLES: (f64, f64, u32) = (1e-4, 1e3, 500);
/// Fewest rates for three unknowns and a scatter.
const FEWEST_RATES: usize = 6;
/// 90 % quantile of chi squared with one degree of freedom.
const DROP: f64 = CHI_SQUARED_90;
/// ln v is never known better than this.
const LEAST_SCATTER: f64 = 1e-4;

/// Sums of squares and products of ln v and a regressor about their means.
#[derive(Debug, Clone, Copy)]
struct Sums {
    vv: f64,
    vx: f64,
    xx: f64,
}

impl Sums {
    fn of(ln_v: &[f64], x: &[f64]) -> Self {
        let n = ln_v.len() as f64;
        let mean_v = ln_v.iter().sum::<f64>() / n;
        let mean_x = x.iter().sum::<f64>() / n;
        let mut sums = Self {
            vv: 0.0,
            vx: 0.0,
            xx: 0.0,
        };
        for (v, x) in ln_v.iter().zip(x) {
            sums.vv += (v - mean_v) * (v - mean_v);
            sums.vx += (v - mean_v) * (x - mean_x);
            sums.xx += (x - mean_x) * (x - mean_x);
        }
        sums
    }

    /// Sum of squared residuals when ln v rises by `slope` for each unit of the regressor.
    fn left(&self, slope: f64) -> f64 {
        (self.vv - 2.0 * slope * self.vx + slope * slope * self.xx).max(0.0)
    }
}

/// The exponent with its bounds of 90 %; `None` with too few rates that stand clear of their noise. A
/// bound that lies outside 0 to 5 is null, and so is a best value there.
pub(super) fn exponent(rates: &[Rate]) -> Option<Estimate> {
    let usable = rates
        .iter()
        .filter(|rate| rate.velocity > 2.0 * rate.sigma && rate.velocity > 0.0);
    let points: Vec<(f64, f64)> = usable.map(|r| (r.middle(), r.velocity.ln())).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return None;
    };
    let length = last.0 - first.0;
    if points.len() < FEWEST_RATES || length <= 0.0 {
        return None;
    }
    let profile = profile(&points, length);
    let (best, lowest) = profile
        .iter()
        .enumerate()
        .min_by(|a, b| a.1.left.total_cmp(&b.1.left))?;
    let least = LEAST_SCATTER * LEAST_SCATTER * points.len() as f64;
    let floor = lowest.left.max(least);
    let independent = points.len() as f64 * independence(&points, lowest);
    let agrees = |one: &Profiled| independent * (one.left.max(least) / floor).ln() <= DROP;
    let low = profile.iter().position(agrees)?;
    let high = profile.iter().rposition(agrees)?;
    let within =
        |index: usize| (index > 0 && index + 1 < profile.len()).then(|| profile[index].alpha);
    Some(Estimate {
        best: within(best),
        low: within(low),
        high: within(high),
    })
}

/// The best pole for one exponent.
#[derive(Debug, Clone, Copy)]
struct Profiled {
    alpha: f64,
    /// Days of the pole, and the slope on ln of the distance from it; no pole for an exponential.
    pole: Option<(f64, f64)>,
    left: f64,
}

fn profile(points: &[(f64, f64)], length: f64) -> Vec<Profiled> {
    let ln_v: Vec<f64> = points.iter().map(|(_, v)| *v).collect();
    let (start, end) = (points[0].0, points[0].0 + length);
    let regress = |pole: f64| {
        let x: Vec<f64> = points.iter().map(|(t, _)| (pole - t).abs().ln()).collect();
        (pole, Sums::of(&ln_v, &x))
    };
    let after: Vec<(f64, Sums)> = distances(length).map(|d| regress(end + d)).collect();
    let before: Vec<(f64, Sums)> = distances(length).map(|d| regress(start - d)).collect();
    let days: Vec<f64> = points.iter().map(|(t, _)| t - start).collect();
    let exponential = Sums::of(&ln_v, &days);
    let exponential = exponential.left((exponential.vx / exponential.xx).max(0.0));
    (0..ALPHAS.2)
        .map(|index| {
            let alpha = ALPHAS.0 + ALPHAS.1 * f64::from(index);
            if (alpha - 1.0).abs() < 0.5 * ALPHAS.1 {
                return Profiled {
                    alpha: 1.0,
                    pole: None,
                    left: exponential,
                };
            }
            let slope = -1.0 / (alpha - 1.0);
            let poles = if alpha > 1.0 { &after } else { &before };
            let each = poles.iter().map(|(pole, sums)| Profiled {
                alpha,
                pole: Some((*pole, slope)),
                left: sums.left(slope),
            });
            let none = Profiled {
                alpha,
                pole: None,
                left: f64::INFINITY,
            };
            each.min_by(|a, b| a.left.total_cmp(&b.left))
                .unwrap_or(none)
        })
        .collect()
}

fn distances(length: f64) -> impl Iterator<Item = f64> {
    let (lowest, highest, count) = POLES;
    let step = (highest / lowest).ln() / f64::from(count - 1);
    (0..count).map(move |index| length * lowest * (step * f64::from(index)).exp())
}

/// The share of the rates that are independent, from the correlation of neighbouring residuals.
fn independence(points: &[(f64, f64)], best: &Profiled) -> f64 {
    let Some((pole, slope)) = best.pole else {
        return 1.0;
    };
    let bare: Vec<f64> = points
        .iter()
        .map(|(t, v)| v - slope * (pole - t).abs().ln())
        .collect();
    let mean = bare.iter().sum::<f64>() / bare.len() as f64;
    let squares: f64 = bare.iter().map(|r| (r - mean) * (r - mean)).sum();
    let products: f64 = bare
        .windows(2)
        .map(|pair| (pair[0] - mean) * (pair[1] - mean))
        .sum();
    if squares <= 0.0 {
        return 1.0;
    }
    let rho = (products / squares).clamp(0.0, 0.95);
    (1.0 - rho) / (1.0 + rho)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// dv/dt = v^alpha towards a pole at day 30, with a scatter of 3 %.
    fn rates(alpha: f64) -> Vec<Rate> {
        let scatter = [0.02, -0.03, 0.01, 0.03, -0.02, -0.01, 0.0];
        (0..28_u32)
            .map(|day| {
                let left = 30.0 - f64::from(day);
                let velocity = left.powf(-1.0 / (alpha - 1.0)) * (1.0 + scatter[day as usize % 7]);
                Rate {
                    from: f64::from(day),
                    to: f64::from(day),
                    velocity,
                    sigma: 0.0,
                    readings: 1,
                    error: crate::fit::ReadingError::Own,
                }
            })
            .collect()
    }

    #[test]
    fn the_exponent_of_a_power_law_acceleration_lies_within_its_interval() {
        for alpha in [1.6, 2.0, 2.6] {
            let found = exponent(&rates(alpha)).unwrap();
            let (low, high) = (found.low.unwrap(), found.high.unwrap());
            assert!(low <= alpha && alpha <= high, "{alpha}: {found:?}");
            assert!(high - low < 0.6, "{alpha}: {found:?}");
        }
    }

    #[test]
    fn five_rates_say_nothing_about_the_exponent() {
        assert_eq!(exponent(&rates(2.0)[..5]), None);
    }
}
