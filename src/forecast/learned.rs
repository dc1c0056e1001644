//! What the panel has learnt on 1400 simulated slopes: written by `cargo run --release --example learn`.
#![allow(
    clippy::approx_constant,
    reason = "a learnt figure may come near to a constant"
)]

use super::members::{FEATURES, MEMBERS};
use super::weighing::{LEVELS, SITUATIONS, Weighing};

/// Of each member but the law: its window's line, and last the one that says the slope will stand.
const GATES: [[f64; FEATURES]; MEMBERS - 1] = [
    [-2.8388, -0.2322, 1.7037, -0.7130, -1.5347],
    [-4.3229, -0.2754, 2.6051, -0.4434, -0.5874],
    [-4.7124, -0.4323, 3.0741, 1.2662, -1.6870],
    [-3.9333, -0.2445, 2.7878, 0.3470, -2.0954],
    [2.4825, -0.8202, 1.9265, 0.8936, -5.9063],
    [-1.4204, -0.2927, 1.7883, -0.1704, -4.1593],
    [-1.9949, -0.2869, 1.7761, -0.0754, -3.9744],
    [-2.8845, -0.2653, 1.5773, 0.3391, -3.4670],
    [-2.7642, -0.2604, 1.4175, 0.3512, -4.3400],
];

/// How often a failure had come by the time at which it was given each probability, a row for each situation.
const RECALIBRATION: [[f64; LEVELS]; SITUATIONS] = [
    [
        0.0000, 0.0318, 0.0435, 0.0601, 0.0845, 0.1312, 0.2132, 0.3134, 0.4342, 0.5684, 0.6519,
        0.7346, 0.7848, 0.8350, 0.8648, 0.8962, 0.9205, 0.9375, 0.9502, 0.9707, 1.0000,
    ],
    [
        0.0000, 0.0015, 0.0070, 0.0251, 0.0641, 0.1236, 0.2121, 0.3219, 0.4340, 0.5475, 0.6249,
        0.7109, 0.7751, 0.8259, 0.8698, 0.9038, 0.9330, 0.9593, 0.9714, 0.9843, 1.0000,
    ],
    [
        0.0000, 0.0067, 0.0250, 0.0599, 0.1040, 0.1637, 0.2400, 0.3257, 0.4126, 0.5009, 0.5730,
        0.6528, 0.7082, 0.7664, 0.8173, 0.8582, 0.8972, 0.9318, 0.9560, 0.9798, 1.0000,
    ],
    [
        0.0000, 0.0312, 0.0648, 0.1102, 0.1624, 0.2174, 0.2836, 0.3397, 0.4109, 0.4802, 0.5433,
        0.6073, 0.6685, 0.7273, 0.7800, 0.8268, 0.8698, 0.9011, 0.9317, 0.9656, 1.0000,
    ],
];

/// The weighing in force.
pub const LEARNED: Weighing = Weighing {
    gates: GATES,
    harshness: 0.926,
    recalibration: RECALIBRATION,
};
