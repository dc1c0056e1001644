//! The shapes of the law, seen from the present: ln y against |r| t, backward and forward, in tables.
//!
//! In units of the present slope, b - c = 1 or -1 and dy/dt = c y^p - b, where c is the present healing.

use super::prior::UNSTABLE;
use crate::regime::Regime;
use std::sync::LazyLock;

/// Shapes that are computed together: they share every index into their tables.
pub(super) const LANES: usize = 4;

/// Exponents p = 1 - 1/m of accelerating and of slowing laws, m from 0.63 to 1.43.
const ACCELERATING_P: [f64; 4] = [-0.6, -0.2, 0.1, 0.3];
const SLOWING_P: [f64; 2] = [-0.4, 0.2];
/// Healing over net slope: c for a law that accelerates, b for one that slows down.
const ACCELERATING_RATIO: [f64; LANES] = [0.1, 0.5, 2.0, 8.0];
const SLOWING_RATIO: [f64; LANES] = [0.2, 0.7, 2.0, 6.0];

/// Step and length of the table of the past, in ln(1 + |r| t): up to e^14 times the time to failure.
const PAST_STEP: f64 = 0.0625;
const PAST: usize = 225;
/// Step and length of the table of the future, in ln(v / v now).
const FUTURE_STEP: f64 = 0.125;
const FUTURE: usize = 161;
/// Steps of integration for one of a table.
const FINER: usize = 8;
/// ln y of a past whose velocity was infinite.
const NEVER: f64 = -40.0;

/// One shape of the law.
#[derive(Debug)]
pub(super) struct Shape {
    /// 1 - 1/m.
    pub(super) p: f64,
    accelerating: bool,
    /// Loading and healing now, in units of |r|.
    b: f64,
    c: f64,
    pub(super) ln_prior: f64,
    /// |r| times the days until the velocity has grown to e^(i steps) of what it is.
    future: Vec<f64>,
}

/// Shapes that are computed together, and their pasts.
#[derive(Debug)]
pub(super) struct Block {
    /// The first of its shapes in [`SHAPES`].
    pub(super) first: usize,
    past: Vec<[f64; LANES]>,
}

/// A place in the tables of the past.
#[derive(Debug, Clone, Copy)]
pub(super) struct TablePlace {
    index: u32,
    share: f64,
}

pub(super) static SHAPES: LazyLock<Vec<Shape>> = LazyLock::new(shapes);
pub(super) static BLOCKS: LazyLock<Vec<Block>> = LazyLock::new(|| {
    (0..SHAPES.len())
        .step_by(LANES)
        .map(|first| Block {
            first,
            past: past(&SHAPES[first..first + LANES]),
        })
        .collect()
});

fn shapes() -> Vec<Shape> {
    let mut shapes = Vec::new();
    let unstable = |p: f64| if p > 0.0 { UNSTABLE } else { 1.0 - UNSTABLE };
    for p in ACCELERATING_P {
        let of_sign = ACCELERATING_P.iter().filter(|q| **q * p > 0.0).count();
        for ratio in ACCELERATING_RATIO {
            let prior = 0.5 * unstable(p) / (of_sign * LANES) as f64;
            shapes.push(Shape::new(p, 1.0 + ratio, ratio, prior));
        }
    }
    for p in SLOWING_P {
        for ratio in SLOWING_RATIO {
            let prior = 0.5 * unstable(p) / LANES as f64;
            shapes.push(Shape::new(p, ratio, 1.0 + ratio, prior));
        }
    }
    shapes
}

impl Shape {
    fn new(p: f64, b: f64, c: f64, prior: f64) -> Self {
        let mut shape = Self {
            p,
            accelerating: b > c,
            b,
            c,
            ln_prior: prior.ln(),
            future: Vec::new(),
        };
        shape.future = shape.days_by_velocity();
        shape
    }

    pub(super) fn regime(&self) -> Regime {
        match (self.p > 0.0, self.accelerating) {
            (true, true) => Regime::UnstableAccelerating,
            (true, false) => Regime::UnstableDecelerating,
            (false, true) => Regime::StableAccelerating,
            (false, false) => Regime::StableDecelerating,
        }
    }

    /// r and kappa, 1/day, of the law whose present slope is `r` in size.
    pub(super) fn slope_and_curvature(&self, r: f64) -> (f64, f64) {
        ((self.b - self.c) * r, self.p * self.c * r)
    }

    /// The lesser of loading and healing, in units of |r|.
    pub(super) fn lesser(&self) -> f64 {
        self.b.min(self.c)
    }

    /// ln of the velocity that it will keep over the velocity now, where it is stable and accelerates.
    pub(super) fn ln_kept(&self) -> Option<f64> {
        (self.accelerating && self.p < 0.0).then(|| -(self.b / self.c).ln() / self.p)
    }

    /// |r| times the days until the velocity has grown by e^`ln_growth`; infinite where it never does.
    pub(super) fn days_to(&self, ln_growth: f64) -> f64 {
        if ln_growth <= 0.0 {
            return 0.0;
        }
        let (place, share) = place(ln_growth / FUTURE_STEP, FUTURE);
        let (before, after) = (self.future[place], self.future[place + 1]);
        if after.is_infinite() {
            return f64::INFINITY;
        }
        before + share * (after - before)
    }

    fn days_by_velocity(&self) -> Vec<f64> {
        let mut days = vec![0.0];
        let mut reached = 0.0;
        for step in 0..(FUTURE - 1) * FINER {
            let y = (-(step as f64 + 0.5) * FUTURE_STEP / FINER as f64).exp();
            let slope = self.b - self.c * y.powf(self.p);
            let moves_on = self.accelerating && slope > 1e-9;
            reached += if moves_on {
                y * FUTURE_STEP / FINER as f64 / slope
            } else {
                f64::INFINITY
            };
            if (step + 1).is_multiple_of(FINER) {
                days.push(reached);
            }
        }
        days
    }

    /// d ln y / du backward in time, u = ln(1 + |r| t).
    fn growth(&self, ln_y: f64, u: f64) -> f64 {
        (self.b - self.c * (self.p * ln_y).exp()) * (u - ln_y).exp()
    }

    /// ln y one step of integration further back, by Runge and Kutta's fourth order.
    fn further_back(&self, ln_y: f64, u: f64) -> f64 {
        let h = PAST_STEP / FINER as f64;
        let k1 = self.growth(ln_y, u);
        let k2 = self.growth(ln_y + 0.5 * h * k1, u + 0.5 * h);
        let k3 = self.growth(ln_y + 0.5 * h * k2, u + 0.5 * h);
        let k4 = self.growth(ln_y + h * k3, u + h);
        let moved = h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        if moved.is_finite() && moved > -5.0 {
            ln_y + moved
        } else {
            NEVER
        }
    }
}

fn past(shapes: &[Shape]) -> Vec<[f64; LANES]> {
    let mut ln_y = [0.0; LANES];
    let mut past = vec![ln_y];
    for step in 0..(PAST - 1) * FINER {
        let u = step as f64 * PAST_STEP / FINER as f64;
        for (slot, shape) in ln_y.iter_mut().zip(shapes) {
            if *slot > NEVER {
                *slot = shape.further_back(*slot, u).max(NEVER);
            }
        }
        if (step + 1).is_multiple_of(FINER) {
            past.push(ln_y);
        }
    }
    past
}

fn place(at: f64, length: usize) -> (usize, f64) {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and bounded below"
    )]
    let index = (at as usize).min(length - 2);
    (index, (at - index as f64).min(1.0))
}

impl TablePlace {
    /// Where u = ln(1 + |r| t) stands.
    pub(super) fn of(u: f64) -> Self {
        let (index, share) = place(u / PAST_STEP, PAST);
        Self {
            index: u32::try_from(index).unwrap_or(0),
            share,
        }
    }
}

impl Block {
    /// ln y of its shapes there.
    pub(super) fn ln_y(&self, place: TablePlace) -> [f64; LANES] {
        let index = place.index as usize;
        let (before, after) = (&self.past[index], &self.past[index + 1]);
        std::array::from_fn(|lane| before[lane] + place.share * (after[lane] - before[lane]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Accuracy, Law, Trajectory};

    #[test]
    fn the_tables_are_the_law() {
        for block in BLOCKS.iter() {
            for lane in 0..LANES {
                let shape = &SHAPES[block.first + lane];
                let (r, kappa) = shape.slope_and_curvature(0.02);
                let law = Law::from_fit(3.0, r, kappa, shape.p);
                for ago in [5.0, 40.0, 300.0] {
                    let back = Trajectory::solve(&law.reversed(), ago, Accuracy::Full);
                    let Some(motion) = back.at(ago) else {
                        continue;
                    };
                    // A past twenty times as fast is near its singularity, where the table is coarse.
                    if motion.y < 0.05 {
                        continue;
                    }
                    let ln_y = block.ln_y(TablePlace::of((0.02_f64 * ago).ln_1p()))[lane];
                    assert!(
                        (ln_y - motion.y.ln()).abs() < 0.05,
                        "{shape:?} {ago}: {ln_y}"
                    );
                }
                for growth in [1.2_f64, 3.0, 100.0] {
                    // Beside the velocity that it keeps, the table ends a step early.
                    let near = |kept: f64| (kept - growth.ln()).abs() < FUTURE_STEP;
                    if shape.ln_kept().is_some_and(near) {
                        continue;
                    }
                    let days = shape.days_to(growth.ln()) / 0.02;
                    match law.days_to_velocity(3.0 * growth) {
                        Some(exact) => assert!((days / exact - 1.0).abs() < 0.03, "{days} {exact}"),
                        None => assert!(days.is_infinite(), "{shape:?} {growth}: {days}"),
                    }
                }
            }
        }
    }
}
