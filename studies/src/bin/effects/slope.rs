//! The block's motion with effects inside its law: by the crate's solution where the effects are a load
//! that is a function of time, by Runge-Kutta steps where the load follows the motion or the law jumps.

use slipwatch::model::{Accuracy, Law, Load, LoadedLaw};

/// One effect inside the law.
#[derive(Debug, Clone)]
pub(crate) enum SlopeEffect {
    /// (days, log-load), linear between; several add up.
    Load(Vec<(f64, f64)>),
    /// y is multiplied by `factor` at `day`.
    StateReset { day: f64, factor: f64 },
    /// Another law from `day` on, started again with y = 1 at the velocity reached.
    FrictionChange { day: f64, law: Law },
    /// f = -eta v, eta in days over the unit of length.
    RateLimit { eta: f64 },
    /// f = -k slip, k in one over the unit of length.
    Geometry { k: f64 },
}

/// Velocity and displacement at the times asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Path {
    pub(crate) velocity: Vec<f64>,
    pub(crate) displacement: Vec<f64>,
}

/// A step changes nothing by more than this share.
const STEP: f64 = 0.02;
/// A path that needs more is one that fails.
const MOST_STEPS: usize = 2_000_000;
/// Newton's iterations on ln v under a rate limit.
const ITERATIONS: usize = 30;

/// The path over `days` (increasing, from 0), `None` where the block fails within them.
pub(crate) fn path(law: &Law, effects: &[SlopeEffect], days: &[f64]) -> Option<Path> {
    let load = load(effects)?;
    let only_loads = effects
        .iter()
        .all(|one| matches!(one, SlopeEffect::Load(_)));
    if only_loads {
        under_load(law, &load, days)
    } else {
        Stepper::new(law, effects, &load).walk(days)
    }
}

/// The sum of the loads, on the knots of all.
fn load(effects: &[SlopeEffect]) -> Option<Load> {
    let loads: Vec<&Vec<(f64, f64)>> = effects
        .iter()
        .filter_map(|one| match one {
            SlopeEffect::Load(knots) => Some(knots),
            SlopeEffect::StateReset { .. }
            | SlopeEffect::FrictionChange { .. }
            | SlopeEffect::RateLimit { .. }
            | SlopeEffect::Geometry { .. } => None,
        })
        .collect();
    match loads.as_slice() {
        [] => Load::new(vec![(0.0, 0.0)]).ok(),
        [one] => Load::new((*one).clone()).ok(),
        several => {
            let mut days: Vec<f64> = several
                .iter()
                .flat_map(|one| one.iter().map(|k| k.0))
                .collect();
            days.sort_by(f64::total_cmp);
            let mut knots = Vec::new();
            let parts: Vec<Load> = several
                .iter()
                .filter_map(|one| Load::new((*one).clone()).ok())
                .collect();
            let sum = |day: f64| parts.iter().map(|part| part.at(day)).sum::<f64>();
            days.dedup();
            for day in days {
                // `at` a step is its value after it.
                knots.push((day, sum(day.next_down())));
                knots.push((day, sum(day)));
            }
            Load::new(knots).ok()
        }
    }
}

fn under_load(law: &Law, load: &Load, days: &[f64]) -> Option<Path> {
    let loaded = LoadedLaw::new(law, load, Accuracy::Fit).ok()?;
    let mut motions = vec![None; days.len()];
    loaded.motions(days, &mut motions);
    let mut path = Path::default();
    for motion in motions {
        let motion = motion?;
        path.velocity.push(motion.velocity);
        path.displacement.push(motion.displacement);
    }
    Some(path)
}

/// A jump of the state or of the law.
#[derive(Debug, Clone, Copy)]
enum Jump {
    Reset(f64),
    Law(Law),
}

struct Stepper<'a> {
    law: Law,
    load: &'a Load,
    eta: f64,
    k: f64,
    /// By day, the latest first.
    jumps: Vec<(f64, Jump)>,
    /// Days at which the load bends.
    knots: Vec<f64>,
    ln_y: f64,
    slip: f64,
}

impl<'a> Stepper<'a> {
    fn new(law: &Law, effects: &[SlopeEffect], load: &'a Load) -> Self {
        let mut stepper = Self {
            law: *law,
            load,
            eta: 0.0,
            k: 0.0,
            jumps: Vec::new(),
            knots: Vec::new(),
            ln_y: 0.0,
            slip: 0.0,
        };
        for effect in effects {
            match effect {
                SlopeEffect::Load(knots) => stepper.knots.extend(knots.iter().map(|knot| knot.0)),
                SlopeEffect::StateReset { day, factor } => {
                    stepper.jumps.push((*day, Jump::Reset(*factor)));
                }
                SlopeEffect::FrictionChange { day, law } => {
                    stepper.jumps.push((*day, Jump::Law(*law)));
                }
                SlopeEffect::RateLimit { eta } => stepper.eta += eta,
                SlopeEffect::Geometry { k } => stepper.k += k,
            }
        }
        stepper
            .jumps
            .sort_by(|one, other| other.0.total_cmp(&one.0));
        stepper
            .knots
            .extend(stepper.jumps.iter().map(|jump| jump.0));
        stepper
    }

    fn walk(mut self, days: &[f64]) -> Option<Path> {
        let mut nodes: Vec<f64> = self.knots.iter().chain(days).copied().collect();
        nodes.retain(|day| *day >= 0.0);
        nodes.sort_by(f64::total_cmp);
        nodes.dedup();
        let mut asked = days.iter().peekable();
        let mut path = Path::default();
        let (mut at, mut steps) = (0.0, 0);
        for node in nodes {
            // Within a stretch between nodes the load is a straight line, which a step at its end would break.
            let ends = (self.load.at(at), self.load.at(node.next_down()));
            steps += self.advance((at, node), ends)?;
            if steps > MOST_STEPS {
                return None;
            }
            at = node;
            while self.jumps.last().is_some_and(|(day, _)| *day <= at) {
                let (day, jump) = self.jumps.pop()?;
                self.jump(jump, self.load.at(day));
            }
            if asked.next_if(|day| **day <= at).is_some() {
                path.velocity
                    .push(self.velocity(self.load.at(at), (self.ln_y, self.slip)));
                path.displacement.push(self.slip);
            }
        }
        Some(path)
    }

    fn jump(&mut self, jump: Jump, log_load: f64) {
        match jump {
            Jump::Reset(factor) => self.ln_y += factor.ln(),
            Jump::Law(law) => {
                let velocity = self.velocity(log_load, (self.ln_y, self.slip));
                // The load's present value stays in force: y = 1 at v_i e^f.
                let v_i = velocity / (log_load - self.k * self.slip).exp();
                self.law = Law { v_i, ..law };
                self.ln_y = 0.0;
            }
        }
    }

    /// From one day to another, while the load goes from one value to the other; the steps that it took.
    fn advance(&mut self, (from, to): (f64, f64), (f_0, f_1): (f64, f64)) -> Option<usize> {
        let span = to - from;
        let (mut done, mut steps) = (0.0, 0);
        while done < span {
            let f = |t: f64| f_0 + (f_1 - f_0) * t / span;
            let state = (self.ln_y, self.slip);
            let velocity = self.velocity(f(done), state);
            let healing = self.law.a * ((self.law.p - 1.0) * state.0).exp();
            let fastest = healing.abs()
                + (self.law.b * velocity / self.law.v_i).abs()
                + self.k.abs() * velocity
                + (f_1 - f_0).abs() / span;
            let h = (span - done).min(STEP / fastest);
            let k1 = self.slope(f(done), state);
            let k2 = self.slope(f(done + h / 2.0), after(state, k1, h / 2.0));
            let k3 = self.slope(f(done + h / 2.0), after(state, k2, h / 2.0));
            let k4 = self.slope(f(done + h), after(state, k3, h));
            self.ln_y += h / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
            self.slip += h / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
            done = if h >= span - done { span } else { done + h };
            steps += 1;
            if !(self.ln_y.is_finite() && self.slip.is_finite()) || steps > MOST_STEPS {
                return None;
            }
        }
        Some(steps)
    }

    /// d ln y / dt and d slip / dt; b e^f / y = b v / v_i.
    fn slope(&self, log_load: f64, state: (f64, f64)) -> (f64, f64) {
        let velocity = self.velocity(log_load, state);
        let healing = self.law.a * ((self.law.p - 1.0) * state.0).exp();
        (healing - self.law.b * velocity / self.law.v_i, velocity)
    }

    /// v = v_i e^f / y, where f may fall with v itself: ln v + eta v = ln v_i + f - ln y.
    fn velocity(&self, log_load: f64, (ln_y, slip): (f64, f64)) -> f64 {
        let free = self.law.v_i.ln() + log_load - self.k * slip - ln_y;
        if self.eta == 0.0 {
            return free.exp();
        }
        // Convex and rising in ln v: Newton from the right of the root never leaves its side.
        let mut ln_v = free;
        for _ in 0..ITERATIONS {
            let limit = self.eta * ln_v.exp();
            let change = (ln_v + limit - free) / (1.0 + limit);
            ln_v -= change;
            if change.abs() < 1e-14 {
                break;
            }
        }
        ln_v.exp()
    }
}

fn after(state: (f64, f64), slope: (f64, f64), h: f64) -> (f64, f64) {
    (state.0 + h * slope.0, state.1 + h * slope.1)
}
