//! A network of one hidden layer, whose weights are learnt elsewhere.

use super::collapse::INPUTS;

/// Hidden units: 32 of each of four networks that were taught apart, and whose mean is taken.
pub const HIDDEN: usize = 4 * 32;

/// Weights of a network from [`INPUTS`] numbers to a chance.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Of each hidden unit, for each input.
    pub hidden: [[f32; INPUTS]; HIDDEN],
    /// Of the output, for each hidden unit.
    pub output: [f32; HIDDEN],
    /// Of the output, for each input.
    pub direct: [f32; INPUTS],
}

impl Network {
    /// The chance that it gives; ln of its odds changes by no more than the weights allow, whatever the inputs.
    pub fn chance(&self, inputs: &[f64; INPUTS]) -> f64 {
        1.0 / (1.0 + (-self.ln_odds(inputs)).exp())
    }

    fn ln_odds(&self, inputs: &[f64; INPUTS]) -> f64 {
        let sum = |weights: &[f32; INPUTS]| {
            let terms = weights.iter().zip(inputs);
            terms
                .map(|(weight, input)| f64::from(*weight) * input)
                .sum::<f64>()
        };
        let hidden = self.hidden.iter().zip(&self.output);
        let units = hidden.map(|(weights, output)| f64::from(*output) * sum(weights).tanh());
        sum(&self.direct) + units.sum::<f64>()
    }
}
