//! Noise without the parts that a fit could take for its law.
//!
//! What is left between readings and a law of least rms has no part along any change of the law's
//! unknowns, or the rms would not be the least. Noise drawn at random has such parts.

/// Directions whose new part is smaller than this, relative, add nothing.
const LEAST_NEW_PART: f64 = 1e-9;

/// The sum of weighted series of one length.
pub(crate) fn combined(parts: &[(f64, &Vec<f64>)]) -> Vec<f64> {
    let count = parts.first().map_or(0, |(_, series)| series.len());
    let at = |index: usize| {
        parts
            .iter()
            .map(|(weight, series)| weight * series[index])
            .sum()
    };
    (0..count).map(at).collect()
}

/// `noise` without its parts along `directions`.
pub(crate) fn without(directions: &[Vec<f64>], mut noise: Vec<f64>) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for direction in directions {
        let before = length(direction);
        let mut new = direction.clone();
        remove(&basis, &mut new);
        let after = length(&new);
        if after > LEAST_NEW_PART * before {
            basis.push(new.iter().map(|value| value / after).collect());
        }
    }
    remove(&basis, &mut noise);
    noise
}

/// Takes the parts along an orthonormal basis away; twice, for what rounding leaves the first time.
fn remove(basis: &[Vec<f64>], series: &mut [f64]) {
    for _ in 0..2 {
        for direction in basis {
            let part = dot(direction, series);
            for (value, along) in series.iter_mut().zip(direction) {
                *value -= part * along;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(series: &[f64]) -> f64 {
    dot(series, series).sqrt()
}
