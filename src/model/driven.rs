//! The law where the load answers to the motion, or where friction and state change on the way.
//!
//! v = `v_i` e^f / y, dy/dt = a y^p - b e^f with f = f(t) - eta v - k X, X the slip; y may jump, and a and b
//! change, at given times. Second-order Rosenbrock steps (ROS2 of Verwer et al., 1999, L-stable) in ln y: made
//! for the refits of effects, where noise is a part in a hundred and the same grid is solved ten thousand
//! times. [`LoadedLaw`](super::LoadedLaw) is the precise solution where f is a function of time alone.

use super::Law;

/// L-stable: 1 - 1/sqrt(2).
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// ln y and the load change by no more than this in a step: an error of some 1e-3 of v, and of some 1e-2 close to a failure.
const LARGEST_CHANGE: f64 = 0.25;
/// p = 1 - 1/m with a finite m.
const LARGEST_P: f64 = 0.99;
/// More steps than this between two nodes, and the block runs away there.
const MOST_STEPS: usize = 400;
/// Newton steps for v under a load that falls with it; each squares the error.
const NEWTON_STEPS: usize = 8;

/// What drives the block, on nodes of increasing time.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// Days, increasing; the law's t = 0 is the first.
    pub nodes: &'a [f64],
    /// f(t) at the nodes, linear between them.
    pub log_load: &'a [f64],
    /// What happens at nodes, in their order.
    pub events: &'a [Event],
    /// eta: the log-load lost per mm/day of velocity, not negative.
    pub per_velocity: f64,
    /// k: the log-load lost per mm of slip.
    pub per_slip: f64,
}

/// A sudden change at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// The index of the node.
    pub node: usize,
    /// Added to the log-load from here on.
    pub log_load: f64,
    /// Added to ln y here.
    pub ln_y: f64,
    /// Added to a from here on, 1/day.
    pub a: f64,
    /// Added to b from here on, 1/day.
    pub b: f64,
    /// Added to p from here on; it stays under 1.
    pub p: f64,
}

/// The block's state along the nodes, right after what happens there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Driven {
    /// ln y.
    pub ln_y: Vec<f64>,
    /// Velocity, mm/day.
    pub velocity: Vec<f64>,
    /// Slip since the first node, mm.
    pub slip: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct State {
    ln_y: f64,
    slip: f64,
    velocity: f64,
}

#[derive(Debug, Clone, Copy)]
struct Friction {
    a: f64,
    b: f64,
    p: f64,
    v_i: f64,
    ln_v_i: f64,
    per_velocity: f64,
    per_slip: f64,
}

impl Driven {
    /// Solves the law along the nodes, reusing the room of `self`; `false` where it runs away before the last.
    pub fn solve(&mut self, law: &Law, drive: &Drive) -> bool {
        for room in [&mut self.ln_y, &mut self.velocity, &mut self.slip] {
            room.clear();
            room.reserve(drive.nodes.len());
        }
        let mut friction = Friction {
            a: law.a,
            b: law.b,
            p: law.p,
            v_i: law.v_i,
            ln_v_i: law.v_i.ln(),
            per_velocity: drive.per_velocity,
            per_slip: drive.per_slip,
        };
        let mut state = State {
            ln_y: 0.0,
            slip: 0.0,
            velocity: law.v_i,
        };
        let (mut extra, mut events) = (0.0, drive.events.iter().peekable());
        for (k, (&t, &f)) in drive.nodes.iter().zip(drive.log_load).enumerate() {
            if k > 0 {
                let (before, f_before) = (drive.nodes[k - 1], drive.log_load[k - 1]);
                let loads = (f_before + extra, f + extra);
                let Some(next) = friction.cross(state, t - before, loads) else {
                    return false;
                };
                state = next;
            }
            while let Some(event) = events.next_if(|event| event.node <= k) {
                extra += event.log_load;
                state.ln_y += event.ln_y;
                friction.a = (friction.a + event.a).max(0.0);
                friction.b += event.b;
                friction.p = (friction.p + event.p).min(LARGEST_P);
            }
            state.velocity = friction.velocity(state.ln_y, state.slip, f + extra);
            self.ln_y.push(state.ln_y);
            self.velocity.push(state.velocity);
            self.slip.push(state.slip);
        }
        true
    }
}

impl Friction {
    /// v from ln v + eta v = `ln v_i` + f - ln y - k X.
    fn velocity(&self, ln_y: f64, slip: f64, log_load: f64) -> f64 {
        let target = self.ln_v_i + log_load - ln_y - self.per_slip * slip;
        if self.per_velocity <= 0.0 {
            return target.exp();
        }
        // From above eta v = target and below ln v = target, whichever is less: Newton's steps stay below.
        let mut ln_v = target.min((target.max(1.0) / self.per_velocity).ln());
        for _ in 0..NEWTON_STEPS {
            let v = ln_v.exp();
            ln_v -= (ln_v + self.per_velocity * v - target) / (1.0 + self.per_velocity * v);
        }
        ln_v.exp()
    }

    /// d ln y / dt at velocity v.
    fn slope(&self, ln_y: f64, velocity: f64) -> f64 {
        let healing = if self.a == 0.0 {
            0.0
        } else {
            self.a * ((self.p - 1.0) * ln_y).exp()
        };
        healing - self.b / self.v_i * velocity
    }

    /// From node to node, the load going linearly; `None` where the block runs away.
    fn cross(&self, mut state: State, span: f64, (from, to): (f64, f64)) -> Option<State> {
        let per_day = (to - from) / span;
        state.velocity = self.velocity(state.ln_y, state.slip, from);
        let (mut t, mut steps) = (0.0, 0);
        while t < span {
            let slope = self.slope(state.ln_y, state.velocity);
            let wear = self.b / self.v_i * state.velocity;
            // The rate at which a small departure grows: beside an unstable steady state it outruns the slope.
            let growth = ((self.p - 1.0) * (slope + wear) + wear).max(0.0);
            let feedback = self.per_slip.abs() * state.velocity;
            let pace = slope.abs() + per_day.abs() + feedback + 0.3 * growth;
            let mut h = (LARGEST_CHANGE / pace).min(span - t);
            // No sliver at the end.
            if span - t < 1.5 * h {
                h = span - t;
            }
            state = self.step(state, slope, h, (from + per_day * t, per_day));
            t += h;
            steps += 1;
            let sound = state.ln_y.is_finite() && state.velocity.is_finite();
            if steps > MOST_STEPS || !sound || state.slip.abs() > 1e12 {
                return None;
            }
        }
        Some(state)
    }

    fn step(&self, state: State, slope: f64, h: f64, (f, per_day): (f64, f64)) -> State {
        let State {
            ln_y,
            slip,
            velocity,
        } = state;
        let shed = 1.0 / (1.0 + self.per_velocity * velocity);
        let wear = self.b / self.v_i * velocity;
        let healing = slope + wear;
        let jacobian = (self.p - 1.0) * healing + wear * shed;
        // What the load does to the slope by itself within the step.
        let drift = -wear * shed * (per_day - self.per_slip * velocity);
        let denominator = 1.0 - GAMMA * h * jacobian;
        if denominator <= 0.05 {
            // Runaway faster than the step resolves.
            return State {
                ln_y: f64::NAN,
                ..state
            };
        }
        let k_1 = (slope + GAMMA * h * drift) / denominator;
        let f_end = f + per_day * h;
        let slip_end = slip + h * velocity;
        let v_trial = self.velocity(ln_y + h * k_1, slip_end, f_end);
        let trial = self.slope(ln_y + h * k_1, v_trial);
        let k_2 = (trial - 2.0 * k_1 - GAMMA * h * drift) / denominator;
        let next = ln_y + h * (1.5 * k_1 + 0.5 * k_2);
        let v_next = self.velocity(next, slip + 0.5 * h * (velocity + v_trial), f_end);
        // Hermite's rule with the slopes of v at both ends.
        let growth = |v: f64, slope: f64| {
            v * (per_day - slope - self.per_slip * v) / (1.0 + self.per_velocity * v)
        };
        let bend = growth(velocity, slope) - growth(v_next, self.slope(next, v_next));
        State {
            ln_y: next,
            slip: slip + h * (0.5 * (velocity + v_next) + h * bend / 12.0),
            velocity: v_next,
        }
    }
}

#[cfg(test)]
mod tests;
