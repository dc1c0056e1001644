//! A network of one hidden layer, whose weights are learnt elsewhere.
//! Sixty lines of products; a crate for networks would be the largest dependency, and bind the bytes of a replay to its version.

/// Numbers that the network is given of one span.
pub const INPUTS: usize = 55;
/// Hidden units: those of eight networks that were trained apart, and whose mean is taken.
const HIDDEN: usize = 8 * UNITS;
/// Hidden units of one of them.
pub const UNITS: usize = 32;

/// Weights of a network from [`INPUTS`] numbers to a chance.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Of each hidden unit, for each input.
    pub hidden: Vec<[f32; INPUTS]>,
    /// Of the output, for each hidden unit.
    pub output: Vec<f32>,
    /// Of the output, for each input.
    pub direct: [f32; INPUTS],
}

impl Network {
    /// All weights 0.
    pub fn silent() -> Self {
        Self {
            hidden: vec![[0.0; INPUTS]; HIDDEN],
            output: vec![0.0; HIDDEN],
            direct: [0.0; INPUTS],
        }
    }

    /// From its text: a line for each hidden unit, its weights and then the output's for it; at last the direct ones. What is
    /// missing is 0.
    pub fn from_text(text: &str) -> Self {
        let mut lines = text.lines().map(|line| {
            let words = line.split_whitespace();
            words
                .map(|word| word.parse::<f32>().unwrap_or(0.0))
                .collect::<Vec<f32>>()
        });
        let mut network = Self::silent();
        let units = network.hidden.iter_mut().zip(&mut network.output);
        for ((weights, output), line) in units.zip(&mut lines) {
            for (slot, weight) in weights.iter_mut().zip(&line) {
                *slot = *weight;
            }
            *output = line.get(INPUTS).copied().unwrap_or(0.0);
        }
        for (slot, weight) in network
            .direct
            .iter_mut()
            .zip(lines.next().unwrap_or_default())
        {
            *slot = weight;
        }
        network
    }

    /// The text that gives it, to four decimals.
    pub fn text(&self) -> String {
        let figures = |weights: &[f32]| {
            let words: Vec<String> = weights
                .iter()
                .map(|weight| format!("{weight:.4}"))
                .collect();
            words.join(" ")
        };
        let units = self.hidden.iter().zip(&self.output);
        let lines = units.map(|(weights, output)| format!("{} {output:.4}\n", figures(weights)));
        lines.collect::<String>() + &figures(&self.direct) + "\n"
    }

    /// The chance that it gives; ln of its odds changes by no more than the weights allow, whatever the inputs.
    pub fn chance(&self, inputs: &[f64; INPUTS]) -> f64 {
        1.0 / (1.0 + (-self.ln_odds(inputs)).exp())
    }

    fn ln_odds(&self, inputs: &[f64; INPUTS]) -> f64 {
        let (together, _) = self.hidden.as_chunks::<TOGETHER>();
        let hidden = together.iter().flat_map(|units| sums(units, inputs));
        let units = hidden.zip(&self.output);
        let units = units.map(|(sum, output)| f64::from(*output) * sum.tanh());
        let [direct] = sums(&[self.direct], inputs);
        direct + units.sum::<f64>()
    }
}

/// Hidden units whose sums are taken side by side, because each addition waits for the one before.
const TOGETHER: usize = 8;
const _: () = assert!(HIDDEN.is_multiple_of(TOGETHER));

/// The weighted sum of the inputs for each row of weights.
fn sums<const ROWS: usize>(weights: &[[f32; INPUTS]; ROWS], inputs: &[f64; INPUTS]) -> [f64; ROWS] {
    let mut sums = [0.0; ROWS];
    for (index, input) in inputs.iter().enumerate() {
        for (sum, row) in sums.iter_mut().zip(weights) {
            *sum += f64::from(row[index]) * input;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_the_network_in_force_is_whole_and_gives_it_back() {
        let text = include_str!("learned.txt");
        let words = text.lines().map(|line| line.split_whitespace().count());
        let expected = std::iter::repeat_n(INPUTS + 1, HIDDEN).chain([INPUTS]);
        assert!(words.eq(expected));
        assert!(
            text.split_whitespace()
                .all(|word| word.parse::<f32>().is_ok())
        );
        assert_eq!(Network::from_text(text).text(), text);
    }
}
