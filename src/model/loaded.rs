//! The law while its load changes: v = `v_i` e^f / y, dy/dt = a y^p - b e^f.
//!
//! Taylor steps of a given order, from knot to knot of the load and no farther than the series reaches:
//! the error of a step of h is of order h^(order + 1). While the load stands still beside a steady state
//! that attracts, the closed form of the relaxation takes over. Nothing is kept but the step at hand: it does not
//! allocate. Not in it: the direct response of the contacts to a change
//! of normal stress (Linker and Dieterich, 1992).

use super::accuracy::Accuracy;
use super::coefficients::Coefficients;
use super::law::{Law, LawError};
use super::load::{Load, LoadStretch};
use super::relaxation::Relaxation;
use super::taylor::{BlockPoint, PowerSeries, radius, unit_days};
use super::trajectory::Motion;
use std::ops::ControlFlow;

/// The highest order of a step.
const MAX_ORDER: usize = 20;
/// A solution within f64's range needs no more steps between two knots.
const MOST_STEPS: usize = 20_000;
/// ln y at which what remains until failure is y over its slope, to rounding.
const LN_Y_OF_FAILURE: f64 = -37.0;
/// Halvings that find a time inside a step to rounding.
const HALVINGS: usize = 60;

/// The law under a load.
#[derive(Debug, Clone, Copy)]
pub struct LoadedLaw<'a> {
    law: Law,
    load: &'a Load,
    order: usize,
    fraction: f64,
    order_of_relaxation: usize,
}

/// Where the block is: its inverse velocity without the load's share, and its slip over `v_i`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BlockState {
    t: f64,
    y: f64,
    slip: f64,
    /// Knots of the load at or before t.
    passed: usize,
}

/// One Taylor step: y and slip as polynomials, f linear.
#[derive(Debug, Clone, Copy)]
struct TaylorStep {
    end: f64,
    stretch: LoadStretch,
    series: PowerSeries<{ MAX_ORDER + 1 }>,
    /// In place of the series, where the block stays beside a steady state.
    relaxation: Option<Relaxation>,
}

/// What comes after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Next {
    BlockState(BlockState),
    /// The singularity, at this day.
    Failure(f64),
    /// Out of what f64 resolves.
    Lost,
}

impl<'a> LoadedLaw<'a> {
    /// `law` under `load`, from t = 0 on.
    ///
    /// # Errors
    /// [`LawError`] where the law does not determine its healing rate a, which no constant load needs at m = 1.
    pub fn new(law: &Law, load: &'a Load, accuracy: Accuracy) -> Result<Self, LawError> {
        if !(law.a.is_finite() && law.b.is_finite()) {
            return Err(LawError {
                name: "a",
                value: law.a,
                expected: "a finite healing rate: under a load r and kappa are not enough at m = 1",
            });
        }
        // Both keep the remainder of a step near the accuracy's own: 0.2^20 and 0.12^12.
        let (order, fraction) = match accuracy {
            Accuracy::Full => (20, 0.16),
            Accuracy::Fit => (12, 0.12),
        };
        Ok(Self {
            law: *law,
            load,
            order,
            fraction,
            order_of_relaxation: accuracy.order(),
        })
    }

    /// The motion at each of `times`, days that do not decrease, into the same place of `out`; `None`
    /// before t = 0, from the singularity on, and for a time that comes before the last.
    pub fn motions(&self, times: &[f64], out: &mut [Option<Motion>]) {
        out.fill(None);
        let mut asked = times.iter().zip(out.iter_mut()).peekable();
        while asked.next_if(|(t, _)| **t < 0.0).is_some() {}
        self.follow(times.last().copied().unwrap_or(0.0), |step| {
            while let Some((t, slot)) = asked.next_if(|(t, _)| **t < step.end) {
                if *t >= step.series.start {
                    *slot = Some(self.motion(step, *t));
                }
            }
            if asked.peek().is_none() {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
    }

    /// Days to the singularity, if it comes by `horizon` (finite) days.
    pub fn failure_days(&self, horizon: f64) -> Option<f64> {
        self.follow(horizon, |_| ControlFlow::Continue(()))
            .filter(|days| *days <= horizon)
    }

    /// Days until the velocity first reaches `velocity`, if it does by `horizon` (finite) days. A rise and fall
    /// within one step is seen by its top; steps are shorter than the solution's own time.
    pub fn days_to_velocity(&self, velocity: f64, horizon: f64) -> Option<f64> {
        let mut found = None;
        let failure = self.follow(horizon, |step| {
            found = self.passage(step, velocity);
            if found.is_some() {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        found.or(failure).filter(|days| *days <= horizon)
    }

    /// Gives every step from t = 0 to `end` to `see`, which may end it; the day of the failure, if met.
    fn follow(&self, end: f64, mut see: impl FnMut(&TaylorStep) -> ControlFlow<()>) -> Option<f64> {
        let mut block = BlockState {
            t: 0.0,
            y: 1.0,
            slip: 0.0,
            passed: 0,
        };
        let mut steps = 0;
        while block.t <= end {
            let (stretch, passed) = self.load.stretch(block.t, block.passed);
            steps = if passed == block.passed { steps + 1 } else { 0 };
            block.passed = passed;
            let mut step =
                TaylorStep::expand(&self.law, self.order, self.fraction, &block, stretch);
            if let Some(relaxation) = self.relaxation(&block, stretch) {
                step.relaxation = Some(relaxation);
                step.end = stretch.until;
            }
            step.end = step.end.min(end.next_up());
            if see(&step).is_break() {
                return None;
            }
            match step.next(&self.law, &block) {
                Next::BlockState(next) if steps < MOST_STEPS => block = next,
                Next::Failure(days) => return Some(days),
                Next::BlockState(_) | Next::Lost => return None,
            }
        }
        None
    }

    /// The rest of a stretch whose load stands still, beside a steady state that attracts.
    fn relaxation(&self, block: &BlockState, stretch: LoadStretch) -> Option<Relaxation> {
        if stretch.per_day != 0.0 {
            return None;
        }
        let gain = stretch.log_load.exp();
        let coefficients = Coefficients::under(&self.law, gain);
        let at = BlockPoint {
            y: block.y,
            slip: block.slip / gain,
        };
        Relaxation::new(&coefficients, self.order_of_relaxation, block.t, at)
            .filter(|relaxation| relaxation.end.is_infinite())
    }

    fn motion(&self, step: &TaylorStep, t: f64) -> Motion {
        let BlockPoint { y, slip } = step.at(t);
        Motion {
            y,
            velocity: self.law.v_i * step.log_load(t).exp() / y,
            displacement: self.law.v_i * slip,
        }
    }

    /// When within the step the velocity first reaches `velocity`.
    fn passage(&self, step: &TaylorStep, velocity: f64) -> Option<f64> {
        let reaches = |t: f64| self.motion(step, t).velocity >= velocity;
        if reaches(step.series.start) {
            return Some(step.series.start);
        }
        let top = if step.growth(step.series.start) > 0.0 && step.growth(step.end) < 0.0 {
            first(step, |t| step.growth(t) <= 0.0)
        } else {
            step.end
        };
        // Past the singularity y is not a number of the law.
        let passed = |t: f64| reaches(t) || step.at(t).y <= 0.0;
        passed(top).then(|| first(&TaylorStep { end: top, ..*step }, passed))
    }
}

/// The first time within the step at which what holds at its end holds.
fn first(step: &TaylorStep, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut before, mut after) = (step.series.start, step.end);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(before, after);
        if holds(middle) {
            after = middle;
        } else {
            before = middle;
        }
    }
    after
}

impl TaylorStep {
    /// Expands about the block. With W = y^p and G = e^f: y' = a W - b G, y W' = p W y', G' = f' G, and
    /// the slip's slope is V = G/y: y V = G.
    fn expand(
        law: &Law,
        order: usize,
        fraction: f64,
        block: &BlockState,
        stretch: LoadStretch,
    ) -> Self {
        let gain = stretch.log_load.exp();
        let (w_0, u_0) = ((law.p * block.y.ln()).exp(), 1.0 / block.y);
        let unit = unit_days(&[law.a * w_0 * u_0, law.b * gain * u_0, stretch.per_day]);
        let (a, b, turn) = (law.a * unit, law.b * gain * unit, stretch.per_day * unit);
        let mut y = [0.0; MAX_ORDER + 1];
        let mut slip = [0.0; MAX_ORDER + 1];
        let (mut w, mut g, mut v) = (y, y, y);
        (y[0], slip[0], w[0], g[0], v[0]) = (block.y, block.slip, w_0, 1.0, gain * u_0);
        for k in 0..order {
            let next = (k + 1) as f64;
            y[k + 1] = (a * w[k] - b * g[k]) / next;
            slip[k + 1] = unit * v[k] / next;
            g[k + 1] = turn * g[k] / next;
            let (mut known, mut product) = (0.0, gain * g[k + 1]);
            for j in 0..=k {
                // (k + 1) y_0 w_(k+1) = sum over i > 0 of (p i - (k + 1 - i)) y_i w_(k+1-i)
                let i = (j + 1) as f64;
                known += (law.p * i - (next - i)) * y[j + 1] * w[k - j];
                product -= y[j + 1] * v[k - j];
            }
            w[k + 1] = known * u_0 / next;
            v[k + 1] = product * u_0;
        }
        let radius = radius(&y, order).min(radius(&v, order));
        Self {
            end: (block.t + fraction * radius * unit).min(stretch.until),
            stretch,
            series: PowerSeries {
                start: block.t,
                unit,
                order,
                y,
                slip,
            },
            relaxation: None,
        }
    }

    /// The block at the end of the step.
    fn next(&self, law: &Law, block: &BlockState) -> Next {
        let PowerSeries { start, unit, y, .. } = &self.series;
        let remaining = -y[0] / y[1] * unit;
        // Elsewhere y^p grows without bound as y falls, and stops it.
        let can_fail = remaining > 0.0 && (law.a == 0.0 || (0.0..1.0).contains(&law.p));
        let stands = self.end <= *start;
        if can_fail && (stands || y[0].ln() < LN_Y_OF_FAILURE) {
            return Next::Failure(start + remaining);
        }
        if stands {
            return Next::Lost;
        }
        let BlockPoint { y, slip } = self.at(self.end);
        if !(y > 0.0 && y.is_finite() && slip.is_finite()) {
            return Next::Lost;
        }
        Next::BlockState(BlockState {
            t: self.end,
            y,
            slip,
            passed: block.passed,
        })
    }

    fn log_load(&self, t: f64) -> f64 {
        self.stretch.log_load + self.stretch.per_day * (t - self.series.start)
    }

    /// Where the block is at time `t`, days.
    fn at(&self, t: f64) -> BlockPoint {
        if let Some(relaxation) = &self.relaxation {
            let BlockPoint { y, slip } = relaxation.at(t);
            let slip = slip * self.stretch.log_load.exp();
            return BlockPoint { y, slip };
        }
        self.series.at(t)
    }

    /// d ln v / dt times the step's unit: what the load adds, less what the contacts do. A relaxation
    /// has no extreme, and 0 here.
    fn growth(&self, t: f64) -> f64 {
        if self.relaxation.is_some() {
            return 0.0;
        }
        let PowerSeries {
            start,
            unit,
            order,
            ref y,
            ..
        } = self.series;
        let h = (t - start) / unit;
        let mut slope = 0.0;
        for k in (1..=order).rev() {
            slope = slope * h + k as f64 * y[k];
        }
        self.stretch.per_day * unit - slope / self.at(t).y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Trajectory;

    /// A law with a and b apart, and a load that rises, jumps down, and rises again.
    fn rising() -> (Law, Load) {
        let law = Law::from_paper(1.35, 0.6, 3.0, 1.0).unwrap();
        let knots = vec![(0.0, 0.0), (0.7, 0.4), (0.7, -0.3), (2.0, 0.1)];
        (law, Load::new(knots).unwrap())
    }

    /// y and the slip after a day in equal steps of one order, all within one stretch.
    fn fixed_steps(law: &Law, order: usize, count: u32) -> (f64, f64) {
        let load = Load::new(vec![(0.0, 0.0), (10.0, 7.0)]).unwrap();
        let mut block = BlockState {
            t: 0.0,
            y: 1.0,
            slip: 0.0,
            passed: 0,
        };
        for k in 1..=count {
            let stretch = load.stretch(block.t, 0).0;
            let mut step = TaylorStep::expand(law, order, 1.0, &block, stretch);
            step.end = f64::from(k) / f64::from(count);
            let Next::BlockState(next) = step.next(law, &block) else {
                panic!("lost");
            };
            block = next;
        }
        (block.y, block.slip)
    }

    #[test]
    fn an_error_falls_as_the_step_to_the_power_of_the_order() {
        let (law, _) = rising();
        let exact = fixed_steps(&law, 20, 64);
        for order in [2, 4, 6, 8] {
            let error = |count| {
                let (y, slip) = fixed_steps(&law, order, count);
                ((y - exact.0).abs(), (slip - exact.1).abs())
            };
            let (coarse, fine) = (error(32), error(64));
            for (coarse, fine) in [(coarse.0, fine.0), (coarse.1, fine.1)] {
                let measured = (coarse / fine).log2();
                let expected = order as f64;
                assert!(
                    (measured - expected).abs() < 0.35,
                    "order {order}: {measured}"
                );
            }
        }
    }

    #[test]
    fn without_healing_inverse_velocity_is_a_line_in_the_loads_own_time() {
        let law = Law {
            v_i: 2.0,
            r: 0.3,
            kappa: 0.0,
            p: 0.0,
            a: 0.0,
            b: 0.3,
        };
        let (_, load) = rising();
        let rise = |f: (f64, f64), days: f64| (f.1.exp() - f.0.exp()) * days / (f.1 - f.0);
        let to_step = rise((0.0, 0.4), 0.7);
        let f = -0.3 + 0.4 * 0.8 / 1.3;
        let to_end = to_step + rise((-0.3, f), 0.8);
        for accuracy in [Accuracy::Fit, Accuracy::Full] {
            let loaded = LoadedLaw::new(&law, &load, accuracy).unwrap();
            let mut motions = [None; 3];
            loaded.motions(&[0.7, 1.5, 1e3], &mut motions);
            for (motion, (warped, f)) in motions.iter().zip([(to_step, -0.3_f64), (to_end, f)]) {
                let motion = motion.unwrap();
                let y = 1.0 - 0.3 * warped;
                assert!((motion.y / y - 1.0).abs() < 1e-12, "{} not {y}", motion.y);
                let velocity = 2.0 * f.exp() / y;
                assert!((motion.velocity / velocity - 1.0).abs() < 1e-12);
                // d slip = v dt = -(v_i / b) dy / y
                let slip = -2.0 / 0.3 * y.ln();
                assert!((motion.displacement / slip - 1.0).abs() < 1e-10);
            }
            assert_eq!(motions[2], None);
            let at_knot = to_step + rise((-0.3, 0.1), 1.3);
            let failure = 2.0 + (1.0 / 0.3 - at_knot) / 0.1_f64.exp();
            let found = loaded.failure_days(10.0).unwrap();
            assert!(
                (found / failure - 1.0).abs() < 1e-12,
                "{found} not {failure}"
            );
            assert_eq!(loaded.failure_days(failure - 0.1), None);
        }
    }

    #[test]
    fn under_a_load_that_stays_the_law_is_the_constant_one() {
        for (m, x_i) in [
            (1.35, 0.6),
            (1.35, 2.0),
            (0.5, 4.0),
            (0.98, 0.5),
            (-1.0, 3.0),
        ] {
            let law = Law::from_paper(m, x_i, 2.0, 5.0).unwrap();
            for f in [0.0, 0.3, -0.5_f64] {
                let load = Load::new(vec![(0.0, f)]).unwrap();
                let loaded = LoadedLaw::new(&law, &load, Accuracy::Full).unwrap();
                let b = law.b * f.exp();
                let same = Law {
                    v_i: law.v_i * f.exp(),
                    r: b - law.a,
                    b,
                    ..law
                };
                let days: Vec<f64> = (1..40).map(f64::from).collect();
                let mut motions = vec![None; days.len()];
                loaded.motions(&days, &mut motions);
                let constant = Trajectory::solve(&same, 40.0, Accuracy::Full);
                for (day, motion) in days.iter().zip(&motions) {
                    let expected = constant.at(*day);
                    assert_eq!(motion.is_some(), expected.is_some(), "m={m} f={f} {day}");
                    let (Some(motion), Some(expected)) = (motion, expected) else {
                        continue;
                    };
                    assert!((motion.velocity / expected.velocity - 1.0).abs() < 1e-10);
                    let slip = motion.displacement / expected.displacement - 1.0;
                    assert!(slip.abs() < 1e-10, "m={m} x_i={x_i} f={f} {day}: {slip:e}");
                }
                if let Some(failure) = same.failure_days() {
                    let found = loaded.failure_days(100.0).unwrap();
                    assert!((found / failure - 1.0).abs() < 1e-12);
                }
                let fast = same.days_to_velocity(7.0);
                let found = loaded.days_to_velocity(7.0, 1e4);
                match (found, fast) {
                    (Some(a), Some(b)) => assert!((a - b).abs() < 1e-9 * b.max(1.0)),
                    (a, b) => assert_eq!(a, b, "m={m} x_i={x_i} f={f}"),
                }
            }
        }
    }

    #[test]
    fn a_step_of_the_load_jumps_the_velocity_and_not_the_displacement() {
        let (law, load) = rising();
        let loaded = LoadedLaw::new(&law, &load, Accuracy::Full).unwrap();
        let mut motions = [None; 2];
        loaded.motions(&[0.7 - 1e-12, 0.7], &mut motions);
        let [before, after] = motions.map(Option::unwrap);
        let jump = (after.velocity / before.velocity).ln();
        assert!((jump + 0.7).abs() < 1e-9, "{jump}");
        assert!((after.displacement - before.displacement).abs() < 1e-10);
        let up = Load::new(vec![(0.0, 0.0), (1.0, 0.0), (1.0, 2.0)]).unwrap();
        let loaded = LoadedLaw::new(&law, &up, Accuracy::Full).unwrap();
        let mut motions = [None];
        loaded.motions(&[1.0], &mut motions);
        let reached = motions[0].unwrap().velocity * 0.99;
        assert_eq!(loaded.days_to_velocity(reached, 5.0), Some(1.0));
    }

    #[test]
    fn a_velocity_that_a_passing_load_reaches_for_an_hour_is_seen() {
        let law = Law::from_paper(0.5, 1.1, 30.0, 1.0).unwrap();
        let load = Load::new(vec![(0.0, 0.0), (5.0, 1.0), (9.0, 0.0)]).unwrap();
        let loaded = LoadedLaw::new(&law, &load, Accuracy::Fit).unwrap();
        let mut motions = [None];
        loaded.motions(&[5.0], &mut motions);
        let top = motions[0].unwrap().velocity;
        let found = loaded.days_to_velocity(top * 0.9999, 100.0).unwrap();
        assert!((4.9..5.0).contains(&found), "{found}");
        assert_eq!(loaded.days_to_velocity(top * 1.0001, 100.0), None);
    }

    #[test]
    fn a_velocity_that_is_reached_between_two_steps_only_is_seen() {
        // The law would accelerate, the load falls: a top that no knot marks.
        let law = Law::from_paper(0.5, 4.0, 1.0, 1.0).unwrap();
        let load = Load::new(vec![(0.0, 0.0), (100.0, -10.0)]).unwrap();
        let loaded = LoadedLaw::new(&law, &load, Accuracy::Fit).unwrap();
        let days: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let mut motions = vec![None; days.len()];
        loaded.motions(&days, &mut motions);
        let velocities = motions.iter().flatten().map(|motion| motion.velocity);
        let top = velocities.fold(0.0, f64::max);
        let at = motions
            .iter()
            .position(|motion| motion.unwrap().velocity >= top);
        let at = days[at.unwrap()];
        assert!((0.5..15.0).contains(&at), "{at}");
        // Just under the top, where no step happens to end.
        let found = loaded.days_to_velocity(top * (1.0 - 1e-9), 20.0).unwrap();
        assert!((found - at).abs() < 0.01, "{found} not {at}");
        assert_eq!(loaded.days_to_velocity(top * (1.0 + 1e-6), 20.0), None);
    }

    #[test]
    fn a_stable_block_is_followed_for_ever_once_its_load_stands_still() {
        let law = Law::from_paper(0.9, 4.0, 1.0, 1.0).unwrap();
        let load = Load::new(vec![(0.0, 0.0), (30.0, 0.2), (60.0, 0.1)]).unwrap();
        let loaded = LoadedLaw::new(&law, &load, Accuracy::Full).unwrap();
        let mut motions = [None; 4];
        loaded.motions(&[1e3, 1e6, 1e9, 1e15], &mut motions);
        // a y^p = b e^f and m = 1 / (1 - p): v = D e^(f / (1 - m)).
        let steady = (0.1_f64 / 0.1).exp();
        let mut before = (0.0, 0.0);
        for (t, motion) in [1e3, 1e6, 1e9, 1e15].into_iter().zip(motions) {
            let motion = motion.unwrap();
            assert!((motion.velocity / steady - 1.0).abs() < 1e-9, "{t}");
            let mean = (motion.displacement - before.1) / (t - before.0);
            assert!(t < 1e5 || (mean / steady - 1.0).abs() < 1e-9, "{t}: {mean}");
            before = (t, motion.displacement);
        }
    }

    #[test]
    fn a_load_or_a_law_that_cannot_be_is_refused_by_name() {
        let error = Load::new(vec![(1.0, 0.0), (0.5, 0.0)]).unwrap_err();
        assert_eq!((error.name, error.value), ("days of the load", 0.5));
        let error = Load::new(vec![(1.0, f64::NAN)]).unwrap_err();
        assert_eq!(error.name, "log-load");
        let load = Load::new(Vec::new()).unwrap();
        let law = Law::from_fit(1.0, 0.1, 0.0, 0.0);
        assert_eq!(
            LoadedLaw::new(&law, &load, Accuracy::Fit).unwrap_err().name,
            "a"
        );
    }
}
