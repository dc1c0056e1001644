//! The noise of the readings as a state-space model, and the innovations under it: exact for any sampling.
//!
//! A reading is off by white noise, and besides either by correlated noise of its own (Ornstein-Uhlenbeck, in
//! the limit a random walk, or the sum of two, in between what is called flicker noise), or by an undeclared
//! Ornstein-Uhlenbeck log-load on the block, which a displacement sums up over time. Kalman's filter turns any column into innovations, and the likelihood
//! follows from them; scaled by the white noise, of which the size is profiled out.

mod smoother;

use super::problem::Problem;
use crate::reading::Quantity;

/// An undeclared load that remembered longer than this part of the record would stand for any effect.
const LONGEST_LOAD: f64 = 24.0;

/// The undeclared load has no mean over the record: the model's whole motion is the readings', give or take this
/// share. Without it a noise that sums up would take the motion over, and leave the law none.
const WHOLE_MOTION: f64 = 0.1;

/// Flicker noise, the power of which goes as 1/f and which every station of a satellite system has, is white noise and two parts that are
/// remembered over so many median spacings, of the same size (after Keshner 1982; with one part a decade, and with more parts, drawn flicker noise was no likelier). Without it a straight line under such noise got an
/// offset in 6 of 31 drawn records.
const FLICKER: (f64, f64) = (2.0, 40.0);

/// Columns that go through the filter abreast.
const SIDE_BY_SIDE: usize = 4;

/// What remembers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Memory {
    /// Nothing: white noise.
    None,
    /// The reading.
    Reading,
    /// The load.
    Load,
}

/// One noise model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    pub(super) memory: Memory,
    /// Correlation time, days; infinite: a random walk.
    pub(super) days: f64,
    /// Of the reading: standard deviation over that of the white noise (of a walk: of its step over the
    /// median spacing). Of the load: e-folds times 'what one e-fold would change a reading by, over the white
    /// noise', namely by v (velocity) or v times `days` (displacement), v typical.
    pub(super) ratio: f64,
    /// Of the reading: correlation time of a second part, as large as the first, days; 0: there is none.
    pub(super) longer: f64,
}

impl Noise {
    pub(super) const WHITE: Self = Self {
        memory: Memory::None,
        days: 0.0,
        ratio: 0.0,
        longer: 0.0,
    };

    /// Standard deviation of all that the reading remembers, over that of the white noise (of a walk: of its step over the median spacing).
    pub(super) fn remembered(&self) -> f64 {
        let parts = if self.longer > 0.0 { 2.0_f64 } else { 1.0 };
        self.ratio * parts.sqrt()
    }

    /// The longest correlation time, days; `None` of a walk.
    pub(super) fn memory_days(&self) -> Option<f64> {
        let days = self.days.max(self.longer);
        days.is_finite().then_some(days)
    }

    /// Parameters that it adds to a model.
    pub(super) fn parameters(&self) -> f64 {
        if self.memory == Memory::None {
            0.0
        } else {
            2.0
        }
    }

    /// The noise models tried, for the readings that are fitted: a coarse grid over memory and size.
    pub(super) fn bank(problem: &Problem) -> Vec<Whitener> {
        let each = Self::grid(problem).into_iter();
        each.map(|noise| Whitener::new(problem, noise)).collect()
    }

    fn grid(problem: &Problem) -> Vec<Self> {
        let (spacing, span) = (problem.spacing, problem.span());
        let mut grid = vec![Self::WHITE];
        let memories = [3.0, 10.0, 30.0, 100.0].map(|k| k * spacing);
        let ratios = [0.3, 1.0, 3.0, 10.0];
        for days in memories.into_iter().filter(|days| *days < 0.34 * span) {
            let reading = |ratio| Self {
                memory: Memory::Reading,
                days,
                ratio,
                longer: 0.0,
            };
            grid.extend(ratios.map(reading));
        }
        grid.extend(Self::flicker(problem));
        let walk = |ratio| Self {
            memory: Memory::Reading,
            days: f64::INFINITY,
            ratio,
            longer: 0.0,
        };
        grid.extend([0.03, 0.1, 0.3, 1.0, 3.0].map(walk));
        let v = problem.typical_velocity() / problem.scatter;
        let mut days = span / LONGEST_LOAD;
        while days > 2.0 * spacing && days > span / 300.0 {
            let reach = match problem.quantity {
                Quantity::Displacement => v * days,
                Quantity::Velocity => v,
            };
            let load = |e_folds: f64| Self {
                memory: Memory::Load,
                days,
                ratio: e_folds * reach,
                longer: 0.0,
            };
            grid.extend([0.03, 0.1, 0.25, 0.6].map(load));
            days /= 3.0;
        }
        grid
    }

    /// Flicker noise of several sizes, as far as the record is long enough to show its memory. Velocities that are taken from displacements
    /// have none of it.
    fn flicker(problem: &Problem) -> Vec<Self> {
        let (days, longer) = (FLICKER.0 * problem.spacing, FLICKER.1 * problem.spacing);
        if problem.quantity == Quantity::Velocity || longer >= 0.34 * problem.span() {
            return Vec::new();
        }
        let sized = [0.5, 1.0, 2.0, 4.0].map(|ratio| Self {
            memory: Memory::Reading,
            days,
            ratio,
            longer,
        });
        sized.into()
    }
}

/// One reading's share of the filter; the state is what displacement has gathered, or what remembers longer, and what remembers.
#[derive(Debug, Clone, Copy)]
struct FilterStep {
    passage: StateTransition,
    /// How the two enter the reading.
    reads: [f64; 2],
    gain: [f64; 2],
    /// 1 / standard deviation of the innovation.
    scale: f64,
    /// 1 / weight of the reading.
    weight: f64,
}

/// Turns columns over the fitted readings into innovations of variance 1 (times that of the white noise).
#[derive(Debug, Clone)]
pub(super) struct Whitener {
    pub(super) noise: Noise,
    steps: Vec<FilterStep>,
    /// Sum of ln variance.
    pub(super) log_determinant: f64,
    /// Scale of one more reading, that of the whole motion.
    whole: f64,
    /// The white noise is no smaller, mm or mm/day.
    least: f64,
    quantity: Quantity,
}

/// State covariance: (gathered, gathered), (gathered, remembered), (remembered, remembered).
type Covariance = [f64; 3];

/// How the state comes from one reading to the next.
#[derive(Debug, Clone, Copy)]
struct StateTransition {
    /// What is left of what was gathered.
    keep: f64,
    /// What is gathered for one unit of what remembers.
    gather: f64,
    /// What is left of what remembers.
    decay: f64,
}

impl StateTransition {
    /// The state at the next reading, before it is read.
    fn on(self, gathered: f64, state: f64) -> (f64, f64) {
        (
            self.keep * gathered + self.gather * state,
            self.decay * state,
        )
    }

    const NONE: Self = Self {
        keep: 1.0,
        gather: 0.0,
        decay: 1.0,
    };
}

impl Whitener {
    /// For the first `problem.used` readings.
    pub(super) fn new(problem: &Problem, noise: Noise) -> Self {
        let used = problem.used;
        let mut steps = Vec::with_capacity(used);
        let mut log_determinant = 0.0;
        let typical = problem.typical_velocity();
        let mut p = stationary(noise);
        for (i, &speed) in problem.seen.iter().enumerate().take(used) {
            let dt = since_last(problem, i);
            let (passage, q) = transition(problem, noise, dt, speed / typical);
            p = advance(p, passage, q);
            let weight = problem.weight[i];
            let reads = match (noise.memory, problem.quantity) {
                (Memory::None, _) => [0.0, 0.0],
                (Memory::Reading, _) => {
                    // A walk in proportion to the velocities beside each reading would follow their jumps, and hide them.
                    let size = if problem.is_relative {
                        noise.ratio / weight
                    } else {
                        noise.ratio
                    };
                    [if noise.longer > 0.0 { size } else { 0.0 }, size]
                }
                (Memory::Load, Quantity::Displacement) => [noise.ratio / weight, 0.0],
                (Memory::Load, Quantity::Velocity) => [0.0, noise.ratio * speed / typical / weight],
            };
            let (gain, variance, after) = update(p, reads);
            p = after;
            log_determinant += variance.ln() + 2.0 * weight.ln();
            steps.push(FilterStep {
                passage,
                reads,
                gain,
                scale: 1.0 / variance.sqrt(),
                weight: 1.0 / weight,
            });
        }
        let motion = match problem.quantity {
            Quantity::Displacement => problem.typical_velocity() * problem.span(),
            Quantity::Velocity => problem.typical_velocity(),
        };
        let whole = 1.0 / (WHOLE_MOTION * motion).max(problem.scatter);
        Self {
            noise,
            steps,
            log_determinant,
            whole,
            least: problem.rounding,
            quantity: problem.quantity,
        }
    }

    /// The innovations of `column`, and last the change of the whole motion.
    pub(super) fn whiten(&self, column: &[f64]) -> Vec<f64> {
        let mut white = self.innovations(column);
        white.push(self.whole_motion(column));
        white
    }

    /// The same of several columns.
    pub(super) fn whiten_all(&self, columns: &[&[f64]]) -> Vec<Vec<f64>> {
        let mut all = Vec::with_capacity(columns.len());
        for some in columns.chunks(SIDE_BY_SIDE) {
            let lanes = std::array::from_fn(|lane| some[lane.min(some.len() - 1)]);
            let innovations = self.innovations_side_by_side(lanes);
            for (mut white, column) in innovations.into_iter().zip(some) {
                white.push(self.whole_motion(column));
                all.push(white);
            }
        }
        all
    }

    fn whole_motion(&self, column: &[f64]) -> f64 {
        let used = &column[..self.steps.len()];
        let motion = match self.quantity {
            Quantity::Displacement => used[used.len() - 1] - used[0],
            Quantity::Velocity => used.iter().sum::<f64>() / used.len() as f64,
        };
        motion * self.whole
    }

    /// -2 ln likelihood of innovations whose squares sum up to `misfit`, the size of the noise profiled out.
    pub(super) fn deviance(&self, misfit: f64) -> f64 {
        2.0 * self.steps.len() as f64 * self.sigma(misfit).ln() + self.log_determinant
    }

    /// The white noise whose innovations' squares sum up to `misfit`: what is nearer to the readings than they are written says nothing.
    pub(super) fn sigma(&self, misfit: f64) -> f64 {
        (misfit.max(0.0) / self.steps.len() as f64)
            .sqrt()
            .max(self.least)
    }

    /// What the noise's own parameters cost in the BIC.
    pub(super) fn cost(&self) -> f64 {
        self.noise.parameters() * (self.steps.len() as f64).ln()
    }

    /// The same without the whole motion.
    pub(super) fn innovations(&self, column: &[f64]) -> Vec<f64> {
        if self.noise.memory == Memory::None {
            let scaled = self
                .steps
                .iter()
                .zip(column)
                .map(|(step, value)| value * step.weight);
            return scaled.collect();
        }
        let (mut gathered, mut state) = (0.0, 0.0);
        let each = self.steps.iter().zip(column).map(|(step, value)| {
            (gathered, state) = step.passage.on(gathered, state);
            let innovation = value * step.weight - step.reads[0] * gathered - step.reads[1] * state;
            gathered += step.gain[0] * innovation;
            state += step.gain[1] * innovation;
            innovation * step.scale
        });
        each.collect()
    }

    /// Columns abreast in one pass: in each every value waits for the one before it, but not for those of the others.
    fn innovations_side_by_side(
        &self,
        columns: [&[f64]; SIDE_BY_SIDE],
    ) -> [Vec<f64>; SIDE_BY_SIDE] {
        if self.noise.memory == Memory::None {
            return columns.map(|column| self.innovations(column));
        }
        let used = self.steps.len();
        let columns = columns.map(|column| &column[..used]);
        // Room for the whole motion, which comes last.
        let mut white = columns.map(|_| {
            let mut room = Vec::with_capacity(used + 1);
            room.resize(used, 0.0);
            room
        });
        let mut into = white.each_mut().map(|room| &mut room[..used]);
        let (mut gathered, mut state) = ([0.0; SIDE_BY_SIDE], [0.0; SIDE_BY_SIDE]);
        for (i, step) in self.steps.iter().enumerate() {
            let mut innovations = columns.map(|column| column[i]);
            for (lane, innovation) in innovations.iter_mut().enumerate() {
                (gathered[lane], state[lane]) = step.passage.on(gathered[lane], state[lane]);
                *innovation = *innovation * step.weight
                    - step.reads[0] * gathered[lane]
                    - step.reads[1] * state[lane];
                gathered[lane] += step.gain[0] * *innovation;
                state[lane] += step.gain[1] * *innovation;
                *innovation *= step.scale;
            }
            for (room, innovation) in into.iter_mut().zip(innovations) {
                room[i] = innovation;
            }
        }
        white
    }

    /// -2 ln likelihood of the readings from `from` on, given those before, with white noise of `sigma`.
    pub(super) fn deviance_from(&self, errors: &[f64], from: usize, sigma: f64) -> f64 {
        let innovations = self.innovations(errors);
        let each = innovations.iter().zip(&self.steps).skip(from);
        each.map(|(u, step)| {
            let deviation = sigma / (step.scale * step.weight);
            (u / sigma).powi(2) + 2.0 * deviation.ln()
        })
        .sum()
    }

    /// Root mean square errors of the readings from `from` on, each predicted from those before it, mm or mm/day.
    pub(super) fn step_errors_from(&self, errors: &[f64], from: usize) -> f64 {
        let innovations = self.innovations(errors);
        let each = innovations.iter().zip(&self.steps).skip(from);
        let squares = each.map(|(u, step)| (u / (step.scale * step.weight)).powi(2));
        (squares.sum::<f64>() / (errors.len() - from) as f64).sqrt()
    }

    /// The column whose innovations these are.
    pub(super) fn colour(&self, innovations: &[f64]) -> Vec<f64> {
        let (mut gathered, mut state) = (0.0, 0.0);
        let each = self.steps.iter().zip(innovations).map(|(step, u)| {
            (gathered, state) = step.passage.on(gathered, state);
            let innovation = u / step.scale;
            let value =
                (innovation + step.reads[0] * gathered + step.reads[1] * state) / step.weight;
            gathered += step.gain[0] * innovation;
            state += step.gain[1] * innovation;
            value
        });
        each.collect()
    }
}

/// Days from the reading before; 0 of the first.
fn since_last(problem: &Problem, i: usize) -> f64 {
    i.checked_sub(1)
        .map_or(0.0, |last| problem.t[i] - problem.t[last])
}

/// The covariance of the state before the first reading.
fn stationary(noise: Noise) -> Covariance {
    let one = |is_there: bool| f64::from(u8::from(is_there));
    [one(noise.longer > 0.0), 0.0, one(noise.days.is_finite())]
}

/// What the state does over `dt` days at a velocity `relative` to the typical one, and the noise that comes in.
fn transition(
    problem: &Problem,
    noise: Noise,
    dt: f64,
    relative: f64,
) -> (StateTransition, Covariance) {
    let left = |days: f64| (-dt / days).exp();
    match noise.memory {
        Memory::None => (StateTransition::NONE, [0.0; 3]),
        _ if noise.days.is_infinite() => (StateTransition::NONE, [0.0, 0.0, dt / problem.spacing]),
        Memory::Reading => {
            let decay = left(noise.days);
            let (keep, q) = if noise.longer > 0.0 {
                let keep = left(noise.longer);
                (keep, 1.0 - keep * keep)
            } else {
                (1.0, 0.0)
            };
            let passage = StateTransition {
                keep,
                gather: 0.0,
                decay,
            };
            (passage, [q, 0.0, 1.0 - decay * decay])
        }
        Memory::Load => {
            let d = dt / noise.days;
            let decay = (-d).exp();
            if problem.quantity == Quantity::Velocity {
                let passage = StateTransition {
                    decay,
                    ..StateTransition::NONE
                };
                return (passage, [0.0, 0.0, 1.0 - decay * decay]);
            }
            let gather = 1.0 - decay;
            // Of the sum of an Ornstein-Uhlenbeck process, by its series where it would cancel.
            let sum = if d < 0.01 {
                2.0 / 3.0 * d * d * d * (1.0 - 0.75 * d)
            } else {
                2.0 * d - 3.0 + 4.0 * decay - decay * decay
            };
            let noise = [
                relative * relative * sum,
                relative * gather * gather,
                1.0 - decay * decay,
            ];
            let passage = StateTransition {
                keep: 1.0,
                gather: relative * gather,
                decay,
            };
            (passage, noise)
        }
    }
}

fn advance(p: Covariance, by: StateTransition, q: Covariance) -> Covariance {
    let StateTransition {
        keep,
        gather,
        decay,
    } = by;
    [
        keep * keep * p[0] + 2.0 * keep * gather * p[1] + gather * gather * p[2] + q[0],
        decay * (keep * p[1] + gather * p[2]) + q[1],
        decay * decay * p[2] + q[2],
    ]
}

/// (gain, variance of the innovation, covariance after), the white noise's variance being 1.
fn update(p: Covariance, reads: [f64; 2]) -> ([f64; 2], f64, Covariance) {
    let cross = [
        p[0] * reads[0] + p[1] * reads[1],
        p[1] * reads[0] + p[2] * reads[1],
    ];
    let variance = 1.0 + reads[0] * cross[0] + reads[1] * cross[1];
    let gain = cross.map(|c| c / variance);
    let after = [
        (p[0] - gain[0] * cross[0]).max(0.0),
        p[1] - gain[0] * cross[1],
        (p[2] - gain[1] * cross[1]).max(0.0),
    ];
    (gain, variance, after)
}

#[cfg(test)]
mod tests;
