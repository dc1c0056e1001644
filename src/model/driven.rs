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
/// More steps than this between two nodes, and the velocity is taken to become infinite there.
const MOST_STEPS: usize = 400;
/// Most Newton steps for v under a load that falls with it; each squares the error.
const NEWTON_STEPS: usize = 8;
/// A Newton step of ln v this small leaves an error of its square.
const CONVERGED: f64 = 1e-6;
/// Where the balance moves by no more than this at once, the last velocity is a start for the next.
const NEAR_LN_V: f64 = 1.0;

/// What drives the block, on nodes of increasing time.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// Days, increasing; the law's t = 0 is the first.
    pub nodes: &'a [f64],
    /// f(t) at the nodes, linear between them.
    pub log_load: &'a [f64],
    /// What happens, in the order of time.
    pub events: &'a [LoadEvent],
    /// eta: the log-load lost per mm/day of velocity, not negative.
    pub per_velocity: f64,
    /// k: the log-load lost per mm of slip.
    pub per_slip: f64,
}

/// A sudden change, at a node or before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadEvent {
    /// The index of the first node that it does not come after.
    pub node: usize,
    /// Days from the event to that node, less than from the node before it; 0: at the node.
    pub early: f64,
    /// Added to the log-load from here on.
    pub log_load: f64,
    /// Added to ln y here.
    pub ln_y: f64,
    /// Added to ln a from here on.
    pub ln_a: f64,
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

/// What the log-load is at one time.
#[derive(Debug, Clone, Copy)]
struct LoadPoint {
    t: f64,
    log_load: f64,
}

#[derive(Debug, Clone, Copy)]
struct State {
    ln_y: f64,
    slip: f64,
    speed: Speed,
    /// a y^(p-1), 1/day.
    healing: f64,
}

#[derive(Debug, Clone, Copy)]
struct Speed {
    ln_v: f64,
    v: f64,
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
    /// Solves the law along the nodes, reusing the room of `self`; `false` where the velocity becomes infinite before
    /// the last.
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
        let first = drive.log_load.first().copied().unwrap_or(0.0);
        let still = Speed {
            ln_v: friction.ln_v_i,
            v: law.v_i,
        };
        let mut state = friction.state(0.0, 0.0, first, still);
        let (mut extra, mut events) = (0.0, drive.events.iter().peekable());
        for (k, (&t, &log_load)) in drive.nodes.iter().zip(drive.log_load).enumerate() {
            // Where the block has come to, and the load declared there.
            let node = LoadPoint { t, log_load };
            let mut here = k.checked_sub(1).map_or(node, |before| LoadPoint {
                t: drive.nodes[before],
                log_load: drive.log_load[before],
            });
            loop {
                let event = events.next_if(|event| event.node <= k);
                let there = match event {
                    Some(event) if event.early > 0.0 => between(here, node, t - event.early),
                    _ => node,
                };
                if there.t > here.t {
                    let (from, to) = (here.log_load + extra, there.log_load + extra);
                    let Some(next) = friction.cross(state, there.t - here.t, from, to) else {
                        return false;
                    };
                    (state, here) = (next, there);
                }
                let Some(event) = event else { break };
                extra += event.log_load;
                friction.change(event);
                let ln_y = state.ln_y + event.ln_y;
                state = friction.state(ln_y, state.slip, here.log_load + extra, state.speed);
            }
            self.ln_y.push(state.ln_y);
            self.velocity.push(state.speed.v);
            self.slip.push(state.slip);
        }
        true
    }
}

/// The point at `t` on the line from one to the other; the one where `t` is before it.
fn between(from: LoadPoint, to: LoadPoint, t: f64) -> LoadPoint {
    if t <= from.t {
        return from;
    }
    let share = (t - from.t) / (to.t - from.t);
    LoadPoint {
        t,
        log_load: from.log_load + share * (to.log_load - from.log_load),
    }
}

impl Friction {
    fn change(&mut self, event: &LoadEvent) {
        self.a *= event.ln_a.exp();
        self.b += event.b;
        self.p = (self.p + event.p).min(LARGEST_P);
    }

    /// The block under a log-load, its velocity somewhere near `last`.
    fn state(&self, ln_y: f64, slip: f64, log_load: f64, last: Speed) -> State {
        State {
            ln_y,
            slip,
            speed: self.speed(ln_y, slip, log_load, last),
            healing: self.healing(ln_y),
        }
    }

    /// v from ln v + eta v = `ln v_i` + f - ln y - k X; `last` is what it was before.
    fn speed(&self, ln_y: f64, slip: f64, log_load: f64, last: Speed) -> Speed {
        let target = self.ln_v_i + log_load - ln_y - self.per_slip * slip;
        if self.per_velocity <= 0.0 {
            return Speed {
                ln_v: target,
                v: target.exp(),
            };
        }
        let moved = target - last.ln_v - self.per_velocity * last.v;
        let mut ln_v = if moved.abs() < NEAR_LN_V {
            last.ln_v + moved / (1.0 + self.per_velocity * last.v)
        } else {
            // Below ln v = target and eta v = target, whichever is less.
            target.min((target.max(1.0) / self.per_velocity).ln())
        };
        for _ in 0..NEWTON_STEPS {
            let v = ln_v.exp();
            let by = (target - ln_v - self.per_velocity * v) / (1.0 + self.per_velocity * v);
            ln_v += by;
            if by.abs() < CONVERGED {
                let v = v * (1.0 + by * (1.0 + 0.5 * by));
                return Speed { ln_v, v };
            }
        }
        let v = ln_v.exp();
        Speed { ln_v, v }
    }

    /// What the contacts' healing adds to ln y, 1/day.
    fn healing(&self, ln_y: f64) -> f64 {
        if self.a == 0.0 {
            0.0
        } else {
            self.a * ((self.p - 1.0) * ln_y).exp()
        }
    }

    /// What slip takes from ln y at velocity v, 1/day.
    fn wear(&self, velocity: f64) -> f64 {
        self.b / self.v_i * velocity
    }

    /// From node to node, the load going linearly; `None` where the velocity becomes infinite.
    fn cross(&self, mut state: State, span: f64, from: f64, to: f64) -> Option<State> {
        let per_day = (to - from) / span;
        let (mut t, mut steps) = (0.0, 0);
        while t < span {
            let velocity = state.speed.v;
            let wear = self.wear(velocity);
            let slope = state.healing - wear;
            // The rate at which a small departure grows: beside an unstable steady state it outruns the slope.
            let growth = ((self.p - 1.0) * (slope + wear) + wear).max(0.0);
            let feedback = self.per_slip.abs() * velocity;
            let pace = slope.abs() + per_day.abs() + feedback + 0.3 * growth;
            let mut h = (LARGEST_CHANGE / pace).min(span - t);
            // No sliver at the end.
            if span - t < 1.5 * h {
                h = span - t;
            }
            state = self.step(state, h, from + per_day * t, per_day);
            t += h;
            steps += 1;
            let sound = state.ln_y.is_finite() && state.speed.v.is_finite();
            if steps > MOST_STEPS || !sound || state.slip.abs() > 1e12 {
                return None;
            }
        }
        if self.per_slip != 0.0 {
            // The step's own velocity is that of the slip as predicted.
            state.speed = self.speed(state.ln_y, state.slip, to, state.speed);
        }
        Some(state)
    }

    fn step(&self, state: State, h: f64, f: f64, per_day: f64) -> State {
        let State {
            ln_y,
            slip,
            speed,
            healing,
        } = state;
        let velocity = speed.v;
        let shed = 1.0 / (1.0 + self.per_velocity * velocity);
        let wear = self.wear(velocity);
        let slope = healing - wear;
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
        let ln_y_trial = ln_y + h * k_1;
        let trial = self.speed(ln_y_trial, slip + h * velocity, f_end, speed);
        let slope_trial = self.healing(ln_y_trial) - self.wear(trial.v);
        let k_2 = (slope_trial - 2.0 * k_1 - GAMMA * h * drift) / denominator;
        let next = ln_y + h * (1.5 * k_1 + 0.5 * k_2);
        let slip_next = slip + h * 0.5 * (velocity + trial.v);
        let last = self.state(next, slip_next, f_end, trial);
        let v_next = last.speed.v;
        // Hermite's rule with the slopes of v at both ends.
        let growth = |v: f64, slope: f64| {
            v * (per_day - slope - self.per_slip * v) / (1.0 + self.per_velocity * v)
        };
        let slope_next = last.healing - self.wear(v_next);
        let bend = growth(velocity, slope) - growth(v_next, slope_next);
        State {
            slip: slip + h * (0.5 * (velocity + v_next) + h * bend / 12.0),
            ..last
        }
    }
}

#[cfg(test)]
mod tests;
