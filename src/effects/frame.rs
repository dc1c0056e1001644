//! Linear algebra of the refits: what a few more columns take off the misfit, under one noise model or the best of several.

use super::noise::{Memory, Whitener};

/// A column that keeps less than this of its length beside the others adds nothing that rounding would not.
const LEAST_LEFT: f64 = 1e-5;

/// The residual and the model's own directions, as innovations under one noise model.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub(super) whitener: Whitener,
    /// Orthonormal directions that the model can already take.
    directions: Vec<Vec<f64>>,
    /// What they leave of the residual.
    pub(super) residual: Vec<f64>,
    pub(super) misfit: f64,
}

impl Frame {
    pub(super) fn new(whitener: Whitener, residual: &[f64], jacobian: &[Vec<f64>]) -> Self {
        let mut directions: Vec<Vec<f64>> = Vec::with_capacity(jacobian.len());
        for column in whitener.whiten_all(&slices(jacobian)) {
            if let Some(unit) = orthonormal(column, &directions) {
                directions.push(unit);
            }
        }
        let mut residual = whitener.whiten(residual);
        clear(&mut residual, &directions);
        let misfit = dot(&residual, &residual);
        Self {
            whitener,
            directions,
            residual,
            misfit,
        }
    }

    /// -2 ln likelihood, the size of the noise profiled out, were the misfit `misfit`.
    pub(super) fn deviance(&self, misfit: f64) -> f64 {
        self.whitener.deviance(misfit)
    }

    /// What the noise model's parameters cost in the BIC.
    pub(super) fn cost(&self) -> f64 {
        self.whitener.cost()
    }

    /// Orthonormal directions that `columns` add to the model's.
    pub(super) fn new_directions(&self, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut added: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
        for column in columns {
            let whitened = self.whitener.whiten(column);
            if let Some(mut unit) = orthonormal(whitened, &self.directions) {
                clear(&mut unit, &added);
                if let Some(unit) = normal(unit, LEAST_LEFT) {
                    added.push(unit);
                }
            }
        }
        added
    }

    /// What these directions take off the misfit of an orthogonalised residual.
    pub(super) fn taken(directions: &[Vec<f64>], residual: &[f64]) -> f64 {
        directions
            .iter()
            .map(|unit| dot(unit, residual).powi(2))
            .sum()
    }

    /// What each of `columns` alone would take off the misfit: by its products with the directions, which leave its own
    /// length and its share of the residual, that is orthogonal to them.
    fn taken_by_each(&self, columns: &[Vec<f64>]) -> Vec<f64> {
        let taken = |white: &Vec<f64>| {
            let length = dot(white, white);
            let known = self.directions.iter().map(|unit| dot(unit, white).powi(2));
            let left = length - known.sum::<f64>();
            if left.is_finite() && left > LEAST_LEFT * LEAST_LEFT * length {
                dot(white, &self.residual).powi(2) / left
            } else {
                0.0
            }
        };
        let white = self.whitener.whiten_all(&slices(columns));
        white.iter().map(taken).collect()
    }

    /// The innovations of noise in the readings, without what the model can take; noise has no motion.
    pub(super) fn project_noise(&self, readings: &[f64]) -> Vec<f64> {
        let mut residual = self.whitener.innovations(readings);
        residual.push(0.0);
        clear(&mut residual, &self.directions);
        residual
    }
}

/// The same residual under several noise models.
#[derive(Debug, Clone)]
pub(super) struct Frames {
    pub(super) each: Vec<Frame>,
}

impl Frames {
    pub(super) fn new(bank: &[Whitener], residual: &[f64], jacobian: &[Vec<f64>]) -> Self {
        let frame = |whitener: &Whitener| Frame::new(whitener.clone(), residual, jacobian);
        Self {
            each: bank.iter().map(frame).collect(),
        }
    }

    /// The least -2 ln likelihood over the noise models, with what their own parameters cost.
    pub(super) fn deviance(&self) -> f64 {
        let each = self.each.iter();
        each.map(|frame| frame.deviance(frame.misfit) + frame.cost())
            .fold(f64::INFINITY, f64::min)
    }

    /// The same with `columns` added.
    pub(super) fn deviance_with(&self, columns: &[Vec<f64>]) -> f64 {
        let each = self.each.iter().map(|frame| {
            let taken = Frame::taken(&frame.new_directions(columns), &frame.residual);
            frame.deviance(frame.misfit - taken) + frame.cost()
        });
        each.fold(f64::INFINITY, f64::min)
    }

    /// The same with each of `columns` alone.
    pub(super) fn deviance_with_each(&self, columns: &[Vec<f64>]) -> Vec<f64> {
        let mut least = vec![f64::INFINITY; columns.len()];
        for frame in &self.each {
            for (least, taken) in least.iter_mut().zip(frame.taken_by_each(columns)) {
                *least = least.min(frame.deviance(frame.misfit - taken) + frame.cost());
            }
        }
        least
    }

    /// Those of the readings that were fitted, under the noise model that makes them likeliest.
    pub(super) fn innovations(&self) -> &[f64] {
        let residual = &self.each[self.best()].residual;
        &residual[..residual.len() - 1]
    }

    /// Whether the noise model that makes the residual likeliest remembers.
    pub(super) fn remembers(&self) -> bool {
        self.each[self.best()].whitener.noise.memory != Memory::None
    }

    /// Which of the noise models makes the residual likeliest.
    pub(super) fn best(&self) -> usize {
        let deviance = |frame: &Frame| frame.deviance(frame.misfit) + frame.cost();
        let order =
            |a: &usize, b: &usize| deviance(&self.each[*a]).total_cmp(&deviance(&self.each[*b]));
        (0..self.each.len()).min_by(order).unwrap_or_default()
    }
}

/// Which of the noise models makes the residual likeliest where the model may go along its own directions: as
/// [`Frames::best`], by the normal equations and without the directions themselves.
pub(super) fn likeliest(bank: &[Whitener], residual: &[f64], jacobian: &[Vec<f64>]) -> usize {
    let mut columns = slices(jacobian);
    columns.push(residual);
    let deviance = |whitener: &Whitener| {
        let misfit = left_of_last(&whitener.whiten_all(&columns));
        whitener.deviance(misfit) + whitener.cost()
    };
    let each = bank.iter().map(deviance).enumerate();
    let best = each.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(0, |(index, _)| index)
}

/// Square of what the other columns leave of the last: Cholesky's factor of their products, columns that add nothing
/// passed over.
fn left_of_last(columns: &[Vec<f64>]) -> f64 {
    let Some((last, others)) = columns.split_last() else {
        return 0.0;
    };
    // Rows of the factor by column kept, each with the length of its column.
    let mut kept: Vec<(&[f64], f64, Vec<f64>)> = Vec::with_capacity(others.len());
    let shares = |column: &[f64], kept: &[(&[f64], f64, Vec<f64>)]| {
        let mut row: Vec<f64> = Vec::with_capacity(kept.len() + 1);
        for (other, length, factor) in kept {
            let known: f64 = row.iter().zip(factor).map(|(a, b)| a * b).sum();
            row.push((dot(column, other) / length - known) / factor[row.len()]);
        }
        row
    };
    for column in others {
        let length = dot(column, column).sqrt();
        if !(length.is_finite() && length > 0.0) {
            continue;
        }
        let mut row = shares(column, &kept);
        for share in &mut row {
            *share /= length;
        }
        let left = 1.0 - row.iter().map(|share| share * share).sum::<f64>();
        if left > LEAST_LEFT * LEAST_LEFT {
            row.push(left.sqrt());
            kept.push((column, length, row));
        }
    }
    let taken = shares(last, &kept);
    dot(last, last) - taken.iter().map(|share| share * share).sum::<f64>()
}

fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// In partial sums abreast, which need not wait for one another.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    const ABREAST: usize = 8;
    let (a_whole, a_rest) = a.as_chunks::<ABREAST>();
    let (b_whole, b_rest) = b.as_chunks::<ABREAST>();
    let mut sums = [0.0; ABREAST];
    for (x, y) in a_whole.iter().zip(b_whole) {
        for lane in 0..ABREAST {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

/// Takes the directions' share out of `column`.
fn clear(column: &mut [f64], directions: &[Vec<f64>]) {
    for unit in directions {
        let share = dot(unit, column);
        for (value, by) in column.iter_mut().zip(unit) {
            *value -= share * by;
        }
    }
}

fn orthonormal(mut column: Vec<f64>, directions: &[Vec<f64>]) -> Option<Vec<f64>> {
    let length = dot(&column, &column).sqrt();
    if !(length.is_finite() && length > 0.0) {
        return None;
    }
    for value in &mut column {
        *value /= length;
    }
    clear(&mut column, directions);
    // Once more: the first pass leaves rounding where columns are nearly alike.
    clear(&mut column, directions);
    normal(column, LEAST_LEFT)
}

fn normal(mut column: Vec<f64>, least: f64) -> Option<Vec<f64>> {
    let length = dot(&column, &column).sqrt();
    if !(length.is_finite() && length > least) {
        return None;
    }
    for value in &mut column {
        *value /= length;
    }
    Some(column)
}

#[cfg(test)]
mod tests;
