//! Networks of least cross entropy, by Adam (Kingma and Ba 2015) with a step that shrinks, and their mean.

use crate::looks::in_two;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::forecast::{INPUTS, Network, UNITS};

/// Networks that are trained from different first weights; the mean of their ln odds is steadier where nothing was learnt.
pub(crate) const NETWORKS: usize = 4;
const BATCH: usize = 256;
/// The first step, and its least share.
const STEP: (f32, f32) = (0.004, 0.02);
const MOMENTS: (f32, f32) = (0.9, 0.999);
/// Pull of each weight towards 0.
const DECAY: f32 = 1e-5;
/// Standard deviation of the first weights.
const FIRST: f64 = 0.25;

/// One span of one look.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) inputs: [f32; INPUTS],
    /// Whether a collapse came within the span.
    pub(crate) came: bool,
    pub(crate) weight: f32,
}

/// One of the networks.
#[derive(Debug, Clone)]
struct One {
    /// For each input those of all units, so that the compiler takes several units at once.
    hidden: [[f32; UNITS]; INPUTS],
    output: [f32; UNITS],
    direct: [f32; INPUTS],
}

/// Moments of the gradient of one network.
struct Adam {
    first: One,
    second: One,
    steps: i32,
}

/// The mean of the first `networks`, each trained in so many passes over `rows`.
pub(crate) fn train(rows: &[Row], passes: usize, networks: usize) -> Network {
    let seeds: Vec<u64> = (1..).take(networks).collect();
    let each = in_two(&seeds, |seed| vec![one(rows, passes, *seed)]);
    let mut mean = Network::silent();
    let share = 1.0 / networks as f32;
    for (one, first) in each.iter().zip((0..).step_by(UNITS)) {
        for (unit, output) in one.output.iter().enumerate() {
            mean.hidden[first + unit] = one.hidden.map(|weights| weights[unit]);
            mean.output[first + unit] = share * output;
        }
        for (slot, weight) in mean.direct.iter_mut().zip(&one.direct) {
            *slot += share * weight;
        }
    }
    mean
}

fn one(rows: &[Row], passes: usize, seed: u64) -> One {
    let mut generator = Pcg64::seed_from_u64(seed);
    let mut network = nothing();
    for weight in network.hidden.iter_mut().flatten() {
        let z: f64 = generator.sample(StandardNormal);
        *weight = (FIRST * z) as f32;
    }
    let mut adam = Adam {
        first: nothing(),
        second: nothing(),
        steps: 0,
    };
    let all = (passes * rows.len() / BATCH).max(1) as f32;
    let mut order: Vec<usize> = (0..rows.len()).collect();
    for _ in 0..passes {
        for index in (1..order.len()).rev() {
            order.swap(index, generator.random_range(0..=index));
        }
        for batch in order.chunks(BATCH) {
            let mut gradient = nothing();
            for index in batch {
                add(&network, &rows[*index], &mut gradient);
            }
            let share = 1.0 - 0.95 * adam.steps as f32 / all;
            adam.step(
                &mut network,
                &gradient,
                (batch.len(), STEP.0 * share.max(STEP.1)),
            );
        }
    }
    network
}

fn nothing() -> One {
    One {
        hidden: [[0.0; UNITS]; INPUTS],
        output: [0.0; UNITS],
        direct: [0.0; INPUTS],
    }
}

/// Adds the gradient of one row.
fn add(network: &One, row: &Row, gradient: &mut One) {
    let (mut units, mut ln_odds) = ([0.0_f32; UNITS], 0.0);
    let of_inputs = network.hidden.iter().zip(&network.direct);
    for ((weights, direct), input) in of_inputs.zip(&row.inputs) {
        for (unit, weight) in units.iter_mut().zip(weights) {
            *unit += weight * input;
        }
        ln_odds += direct * input;
    }
    for (unit, output) in units.iter_mut().zip(&network.output) {
        *unit = unit.tanh();
        ln_odds += *unit * output;
    }
    let chance = 1.0 / (1.0 + (-ln_odds).exp());
    let error = (chance - if row.came { 1.0 } else { 0.0 }) * row.weight;
    let mut back = [0.0_f32; UNITS];
    for (unit, value) in units.iter().enumerate() {
        gradient.output[unit] += error * value;
        back[unit] = error * network.output[unit] * (1.0 - value * value);
    }
    let of_inputs = gradient.hidden.iter_mut().zip(&mut gradient.direct);
    for ((slots, direct), input) in of_inputs.zip(&row.inputs) {
        for (slot, back) in slots.iter_mut().zip(&back) {
            *slot += back * input;
        }
        *direct += error * input;
    }
}

/// All weights of a network, in one order.
fn weights(network: &mut One) -> impl Iterator<Item = &mut f32> {
    let hidden = network.hidden.iter_mut().flatten();
    hidden.chain(&mut network.output).chain(&mut network.direct)
}

impl Adam {
    fn step(&mut self, network: &mut One, gradient: &One, (count, size): (usize, f32)) {
        self.steps += 1;
        let unbiased = |moment: f32| 1.0 - moment.powi(self.steps);
        let (of_first, of_second) = (unbiased(MOMENTS.0), unbiased(MOMENTS.1));
        let mut gradient = gradient.clone();
        let slopes = weights(&mut gradient);
        let moments = weights(&mut self.first).zip(weights(&mut self.second));
        for ((weight, slope), (first, second)) in weights(network).zip(slopes).zip(moments) {
            let slope = *slope / count as f32 + DECAY * *weight;
            *first = MOMENTS.0 * *first + (1.0 - MOMENTS.0) * slope;
            *second = MOMENTS.1 * *second + (1.0 - MOMENTS.1) * slope * slope;
            let root = (*second / of_second).sqrt() + 1e-7;
            *weight -= size * (*first / of_first) / root;
        }
    }
}
