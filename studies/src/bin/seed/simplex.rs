//! The paper's own kind of fit: a simplex over (m, `x_i`, T) from many starting points, D by linear least
//! squares, for the least rms of the velocity.
//!
//! The paper does not state where its simplexes began, nor when they ended; that is chosen here.

use super::recorded::vaiont_day;
use anyhow::Result;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::reading::Series;

/// Starting points.
pub(crate) const STARTS: usize = 200;
const SEED: u64 = 2004;
/// Steps of one simplex, and how often it is begun afresh where it ended.
const STEPS: usize = 300;
const RESTARTS: usize = 80;
/// Simplexes that go on after their first round.
const KEPT: usize = 3;
/// Where m begins.
const M: std::ops::Range<f64> = -2.0..3.0;
/// Standard deviation of `ln x_i`, and of ln of the age T `x_i` over the length of the record.
const SPREAD_OF_X_I: f64 = 4.0;
const SPREAD_OF_AGE: f64 = 2.0;

/// m, `ln x_i` and ln T in days.
type Point = [f64; 3];

/// The best end of all simplexes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SimplexFit {
    pub(crate) m: f64,
    pub(crate) rms: f64,
}

/// The least rms of a benchmark's velocity.
pub(crate) fn fit(series: &Series) -> Result<Option<SimplexFit>> {
    let mut readings = Vec::new();
    for reading in &series.readings {
        readings.push((vaiont_day(reading.time)?, reading.value));
    }
    let first = readings.first().map_or(0.0, |one| one.0);
    for reading in &mut readings {
        reading.0 -= first;
    }
    let length = readings.last().map_or(0.0, |one| one.0);
    let mut random = Pcg64::seed_from_u64(SEED);
    let mut ends = Vec::new();
    for _ in 0..STARTS {
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let ln_x_i = SPREAD_OF_X_I * normal();
        let ln_age = length.ln() + SPREAD_OF_AGE * normal();
        let start = [random.random_range(M), ln_x_i, ln_age - ln_x_i];
        ends.push(descend(&readings, start));
    }
    ends.sort_by(|a, b| a.1.total_cmp(&b.1));
    ends.truncate(KEPT);
    for end in &mut ends {
        for _ in 0..RESTARTS {
            *end = descend(&readings, end.0);
        }
    }
    let best = ends.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let best = best.filter(|(_, rms)| rms.is_finite());
    Ok(best.map(|([m, ..], rms)| SimplexFit { m, rms }))
}

/// rms of the velocity about the law with the best D; infinite where there is no law.
fn rms(readings: &[(f64, f64)], [m, ln_x_i, ln_t]: Point) -> f64 {
    let length = readings.last().map_or(0.0, |one| one.0);
    let Ok(law) = Law::from_paper(m, ln_x_i.exp(), ln_t.exp(), 1.0) else {
        return f64::INFINITY;
    };
    let solution = Trajectory::solve(&law, length * (1.0 + 1e-12), Accuracy::Fit);
    // Over the initial velocity, which alone may be beyond the range of numbers.
    let mut shape = Vec::with_capacity(readings.len());
    for (day, _) in readings {
        match solution.at(*day) {
            Some(motion) => shape.push(motion.velocity / law.v_i),
            None => return f64::INFINITY,
        }
    }
    let dot = |of: fn(f64, f64) -> f64| -> f64 {
        let pairs = shape.iter().zip(readings);
        pairs.map(|(model, (_, value))| of(*model, *value)).sum()
    };
    let scale = dot(|model, value| model * value) / dot(|model, _| model * model);
    let squares: f64 = shape
        .iter()
        .zip(readings)
        .map(|(model, (_, value))| (value - scale * model).powi(2))
        .sum();
    let rms = (squares / readings.len() as f64).sqrt();
    if rms.is_finite() && scale > 0.0 {
        rms
    } else {
        f64::INFINITY
    }
}

/// One simplex of Nelder and Mead, from its start to its end.
fn descend(readings: &[(f64, f64)], start: Point) -> (Point, f64) {
    let cost = |point: Point| (point, rms(readings, point));
    let mut simplex = vec![cost(start)];
    for (index, step) in [0.1, 0.5, 0.5].into_iter().enumerate() {
        let mut corner = start;
        corner[index] += step;
        simplex.push(cost(corner));
    }
    for _ in 0..STEPS {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let worst = simplex[3];
        let mean = |index: usize| simplex[..3].iter().map(|one| one.0[index]).sum::<f64>() / 3.0;
        let centre = [mean(0), mean(1), mean(2)];
        let along = |factor: f64| cost(between(centre, worst.0, factor));
        let reflected = along(-1.0);
        let next = if reflected.1 < simplex[0].1 {
            let expanded = along(-2.0);
            if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            }
        } else if reflected.1 < simplex[2].1 {
            reflected
        } else {
            along(if reflected.1 < worst.1 { -0.5 } else { 0.5 })
        };
        if next.1 < worst.1 {
            simplex[3] = next;
        } else {
            let best = simplex[0].0;
            for corner in &mut simplex[1..] {
                *corner = cost(between(best, corner.0, 0.5));
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0]
}

/// `from`, moved by a part of the way to `to`.
fn between(from: Point, to: Point, part: f64) -> Point {
    let at = |index: usize| from[index] + part * (to[index] - from[index]);
    [at(0), at(1), at(2)]
}
