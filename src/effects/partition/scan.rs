//! When benchmarks part, and into which groups: motion in constant proportion is a matrix of rank one, and
//! its loadings are other ones after a partition.

use super::alignment::differences;
use crate::effects::quantiles::robust_deviation;
use nalgebra::{DMatrix, DVector};

/// Fewest columns on either side of a break.
pub(super) const SHORTEST: usize = 5;
/// Memories of the displacement's noise that are tried, per step; 1 is a random walk.
const MEMORIES: [f64; 5] = [0.0, 0.5, 0.8, 0.95, 1.0];
/// Blocks in which loadings are free when the noise is chosen.
const BLOCKS: usize = 3;
/// Groups whose velocities' ratio changes by less than this, in ln, are still one.
pub(super) const LEAST_CHANGE: f64 = 0.14;
/// A misfit under this share of the motion is rounding.
const ROUNDING: f64 = 1e-11;
/// A benchmark's noise is at least this share of the typical one, so that none has nearly all the weight.
const LEAST_NOISE: f64 = 0.2;

/// How the noise of the displacements runs on, and whether it grows with the velocity.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ScanNoise {
    memory: f64,
    /// What each innovation is divided by.
    sizes: Vec<f64>,
}

impl ScanNoise {
    /// The innovations of a displacement.
    pub(super) fn whiten(&self, row: &[f64]) -> Vec<f64> {
        let pairs = row.windows(2).zip(&self.sizes);
        pairs
            .map(|(two, size)| (two[1] - self.memory * two[0]) / size)
            .collect()
    }

    /// Whether an offset of the reading stays in all innovations after it.
    pub(super) fn keeps_offsets(&self) -> bool {
        self.memory < 1.0
    }
}

/// Innovations of all benchmarks, each in units of its own noise.
#[derive(Debug, Clone)]
pub(super) struct Scan {
    /// Rows: benchmarks, columns: innovations.
    pub(super) columns: DMatrix<f64>,
    /// What a row of displacements was divided by, mm.
    pub(super) scales: Vec<f64>,
    /// Of the displacements.
    pub(super) noise: ScanNoise,
}

/// A break at which the loadings change most.
#[derive(Debug, Clone)]
pub(super) struct Break {
    /// The column in which it lies: the ones before and the ones after belong to one motion each.
    pub(super) column: usize,
    /// The group of each row, 0 being that of the first.
    pub(super) groups: Vec<usize>,
    /// Loadings before.
    pub(super) loadings: DVector<f64>,
    /// What each group's loadings are multiplied by after, that of the first row's group by 1.
    pub(super) factors: Vec<f64>,
    /// Fall of the BIC against constant loadings.
    pub(super) gain: f64,
}

impl Scan {
    /// Of displacements at common times; rows of benchmarks.
    pub(super) fn of(rows: &[Vec<f64>]) -> Option<Self> {
        let scales = scales(rows)?;
        let scaled: Vec<Vec<f64>> = rows
            .iter()
            .zip(&scales)
            .map(|(row, scale)| row.iter().map(|value| (value - row[0]) / scale).collect())
            .collect();
        let (noise, columns) = noises(&scaled)
            .into_iter()
            .map(|noise| {
                let columns = matrix(&scaled, &noise);
                (score(&columns, &noise), noise, columns)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, noise, columns)| (noise, columns))?;
        Some(Self {
            columns,
            scales,
            noise,
        })
    }

    /// The same with other innovations.
    pub(super) fn with(&self, columns: DMatrix<f64>) -> Self {
        Self {
            columns,
            ..self.clone()
        }
    }

    /// The break with the greatest gain.
    pub(super) fn strongest(&self) -> Option<Break> {
        let count = self.columns.ncols();
        let is_centred = self.noise.keeps_offsets();
        let mut before = ScanMoments::none(self.columns.nrows());
        let mut after = ScanMoments::of(&self.columns, 0..count);
        let mut best: Option<(f64, usize)> = None;
        let mut guess = DVector::from_element(self.columns.nrows(), 1.0);
        for column in 0..count.saturating_sub(SHORTEST) {
            after.take(&self.columns, column);
            if column >= SHORTEST {
                let (b, a) = (before.gram(is_centred), after.gram(is_centred));
                let total = b.trace() + a.trace();
                let (one, loadings) = largest(&(&b + &a), &guess);
                let parts = largest(&b, &loadings).0 + largest(&a, &loadings).0;
                guess = loadings;
                let floor = ROUNDING * total;
                let gain = ((total - one).max(floor) / (total - parts).max(floor)).ln();
                if best.is_none_or(|best| gain > best.0) {
                    best = Some((gain, column));
                }
            }
            before.give(&self.columns, column);
        }
        best.map(|(_, column)| self.grouped(column))
    }

    /// The grams of the columns before and after one.
    fn sides(&self, column: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let gram = |range| ScanMoments::of(&self.columns, range).gram(self.noise.keeps_offsets());
        (gram(0..column), gram(column + 1..self.columns.ncols()))
    }

    /// The groups into which the rows part at `column`.
    fn grouped(&self, column: usize) -> Break {
        let (b, a) = self.sides(column);
        let pooled = largest(&(&b + &a), &DVector::from_element(b.nrows(), 1.0)).1;
        let before = largest(&b, &pooled).1;
        let after = largest(&a, &pooled).1;
        let ratio = |row: usize| after[row] * before[row].signum() / before[row].abs().max(1e-9);
        let mut order: Vec<usize> = (0..b.nrows()).collect();
        order.sort_by(|x, y| ratio(*x).total_cmp(&ratio(*y)));
        let constant = self.gain(&b, &a, &vec![0; b.nrows()], &pooled);
        let mut best = (vec![0; b.nrows()], constant.clone());
        for wanted in 2..=b.nrows().min(4) {
            let more = (1..order.len()).filter_map(|cut| {
                let labels = cut_at(&best.0, &order, cut)?;
                let labels = self.settled(&b, &a, labels, &before);
                (labels.iter().max() == Some(&(wanted - 1))).then(|| {
                    let fit = self.gain(&b, &a, &labels, &before);
                    (labels, fit)
                })
            });
            let Some(more) = more.max_by(|x, y| x.1.gain.total_cmp(&y.1.gain)) else {
                break;
            };
            // A third group must be as plain as the parting itself.
            let margin = if wanted == 2 { 0.0 } else { 10.0 };
            if wanted > 2 && (more.1.gain < best.1.gain + margin || !are_apart(&more.1.factors)) {
                break;
            }
            best = more;
        }
        let gain = best.1.gain - constant.gain;
        Break {
            column,
            groups: best.0,
            loadings: best.1.loadings,
            factors: best.1.factors,
            gain,
        }
    }

    /// Moves single rows to the other groups while that fits better.
    fn settled(
        &self,
        b: &DMatrix<f64>,
        a: &DMatrix<f64>,
        labels: Vec<usize>,
        guess: &DVector<f64>,
    ) -> Vec<usize> {
        let groups = labels.iter().max().map_or(1, |most| most + 1);
        let mut labels = labels;
        let mut best = self.gain(b, a, &labels, guess).gain;
        for row in 0..labels.len() {
            for group in 0..groups {
                let mut moved = labels.clone();
                moved[row] = group;
                if moved == labels || (0..groups).any(|one| !moved.contains(&one)) {
                    continue;
                }
                let gain = self.gain(b, a, &moved, guess).gain;
                if gain > best {
                    (labels, best) = (moved, gain);
                }
            }
        }
        in_order(&labels)
    }

    /// How well loadings that change by group explain both sides; the gain is minus the BIC.
    fn gain(
        &self,
        b: &DMatrix<f64>,
        a: &DMatrix<f64>,
        labels: &[usize],
        guess: &DVector<f64>,
    ) -> Fit {
        let groups = labels.iter().max().map_or(1, |most| most + 1);
        let mut loadings = guess.clone();
        let mut weights = DVector::from_element(groups, 1.0);
        let mut explained = 0.0;
        for _ in 0..6 {
            let basis = DMatrix::from_fn(loadings.len(), groups, |row, group| {
                if labels[row] == group {
                    loadings[row]
                } else {
                    0.0
                }
            });
            let norms: Vec<f64> = basis
                .column_iter()
                .map(|one| one.norm().max(1e-12))
                .collect();
            let unit = DMatrix::from_fn(loadings.len(), groups, |row, group| {
                basis[(row, group)] / norms[group]
            });
            let (value, vector) = largest(
                &(unit.transpose() * a * &unit),
                &DVector::from_vec(norms.clone()),
            );
            weights = DVector::from_fn(groups, |group, _| vector[group] / norms[group]);
            explained = value + (loadings.transpose() * b * &loadings)[(0, 0)];
            let factor = DVector::from_fn(loadings.len(), |row, _| weights[labels[row]]);
            let size = loadings.component_mul(&factor).norm_squared().max(1e-12);
            // Where both sides' misfit is stationary in the loadings.
            let pull =
                b * &loadings + factor.component_mul(&(a * factor.component_mul(&loadings))) / size;
            let share = loadings.dot(&(b * &loadings));
            let weight = factor.map(|one| share + value * one * one / size);
            loadings = pull
                .component_div(&weight.map(|one| one.max(1e-300)))
                .normalize();
        }
        let total = a.trace() + b.trace();
        let count = (self.columns.ncols() - 1) as f64;
        let rows = labels.len() as f64;
        let data = (rows - 1.0) * count;
        let misfit = (total - explained).max(ROUNDING * total);
        // A break has a time beside its factors.
        let parameters = if groups > 1 { groups as f64 } else { 0.0 };
        let reference = weights[0];
        Fit {
            gain: -data * misfit.ln() - parameters * data.ln(),
            factors: weights.iter().map(|one| one / reference).collect(),
            loadings,
        }
    }
}

#[derive(Debug, Clone)]
struct Fit {
    gain: f64,
    factors: Vec<f64>,
    loadings: DVector<f64>,
}

/// The labels with the group across the `cut` divided there; `None` where the cut falls between groups.
fn cut_at(labels: &[usize], order: &[usize], cut: usize) -> Option<Vec<usize>> {
    let (low, high) = (labels[order[cut - 1]], labels[order[cut]]);
    if low != high {
        return None;
    }
    let new = labels.iter().max().map_or(1, |most| most + 1);
    let mut labels = labels.to_vec();
    for row in &order[cut..] {
        if labels[*row] == high {
            labels[*row] = new;
        }
    }
    Some(in_order(&labels))
}

/// How far a factor is from no change.
pub(super) fn apart(factor: f64) -> f64 {
    if factor > 0.0 {
        factor.ln().abs()
    } else {
        f64::INFINITY
    }
}

fn are_apart(factors: &[f64]) -> bool {
    let pairs = |index: usize| {
        factors[..index]
            .iter()
            .map(move |other| apart(factors[index] / other))
    };
    (0..factors.len())
        .flat_map(pairs)
        .all(|apart| apart >= LEAST_CHANGE)
}

/// Groups named in the order of their first rows.
fn in_order(labels: &[usize]) -> Vec<usize> {
    let mut met: Vec<usize> = Vec::new();
    let name = |label: &usize| {
        if let Some(known) = met.iter().position(|one| one == label) {
            return known;
        }
        met.push(*label);
        met.len() - 1
    };
    labels.iter().map(name).collect()
}

/// Sums over columns from which a gram comes.
#[derive(Debug, Clone)]
struct ScanMoments {
    count: f64,
    sum: DVector<f64>,
    squares: DMatrix<f64>,
}

impl ScanMoments {
    fn none(rows: usize) -> Self {
        Self {
            count: 0.0,
            sum: DVector::zeros(rows),
            squares: DMatrix::zeros(rows, rows),
        }
    }

    fn of(columns: &DMatrix<f64>, range: std::ops::Range<usize>) -> Self {
        let mut moments = Self::none(columns.nrows());
        range.for_each(|column| moments.give(columns, column));
        moments
    }

    fn give(&mut self, columns: &DMatrix<f64>, column: usize) {
        let column = columns.column(column);
        self.count += 1.0;
        self.sum += column;
        self.squares.ger(1.0, &column, &column, 1.0);
    }

    fn take(&mut self, columns: &DMatrix<f64>, column: usize) {
        let column = columns.column(column);
        self.count -= 1.0;
        self.sum -= column;
        self.squares.ger(-1.0, &column, &column, 1.0);
    }

    /// Products of the rows, about their means where these are free.
    fn gram(&self, is_centred: bool) -> DMatrix<f64> {
        let mut gram = self.squares.clone();
        if is_centred && self.count > 0.0 {
            gram.ger(-1.0 / self.count, &self.sum, &self.sum, 1.0);
        }
        gram
    }
}

/// The largest eigenvalue and its vector, by powers from a first guess.
pub(super) fn largest(gram: &DMatrix<f64>, guess: &DVector<f64>) -> (f64, DVector<f64>) {
    let mut vector = guess.normalize();
    let mut value = 0.0;
    for _ in 0..60 {
        let next = gram * &vector;
        let size = next.norm();
        if size <= 0.0 || !size.is_finite() {
            break;
        }
        vector = next / size;
        if (size - value).abs() <= 1e-10 * size {
            value = size;
            break;
        }
        value = size;
    }
    (value, vector)
}

/// Each row's noise, mm: its typical motion times how far it scatters about the others' in proportion.
fn scales(rows: &[Vec<f64>]) -> Option<Vec<f64>> {
    let steps: Vec<Vec<f64>> = rows.iter().map(|row| differences(row)).collect();
    let gram = |rows: &[Vec<f64>]| {
        DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
            rows[i]
                .iter()
                .zip(&rows[j])
                .map(|(x, y)| x * y)
                .sum::<f64>()
        })
    };
    let sizes: Vec<f64> = steps
        .iter()
        .map(|row| row.iter().map(|x| x * x).sum::<f64>().sqrt())
        .collect();
    if sizes.iter().any(|size| !size.is_normal()) {
        return None;
    }
    let unit: Vec<Vec<f64>> = steps
        .iter()
        .zip(&sizes)
        .map(|(row, size)| row.iter().map(|x| x / size).collect())
        .collect();
    let loadings = largest(&gram(&unit), &DVector::from_element(rows.len(), 1.0)).1;
    let amplitudes: Vec<f64> = loadings
        .iter()
        .zip(&sizes)
        .map(|(l, size)| {
            let floor = 0.1 / (rows.len() as f64).sqrt();
            size * if l.abs() < floor { floor } else { *l }
        })
        .collect();
    let scatter = |i: usize, j: usize| {
        let pairs = steps[i].iter().zip(&steps[j]);
        let apart: Vec<f64> = pairs
            .map(|(x, y)| x / amplitudes[i] - y / amplitudes[j])
            .collect();
        let bends: Vec<f64> = apart.windows(2).map(|two| two[1] - two[0]).collect();
        (0.5 * robust_deviation(&bends)).powi(2).max(1e-24)
    };
    let count = rows.len() as f64;
    let sums: Vec<f64> = (0..rows.len())
        .map(|i| {
            (0..rows.len())
                .filter(|j| *j != i)
                .map(|j| scatter(i, j))
                .sum()
        })
        .collect();
    let all = sums.iter().sum::<f64>() / (2.0 * (count - 1.0));
    let least = LEAST_NOISE * LEAST_NOISE * all / count;
    let own = sums.iter().map(|sum| {
        if rows.len() > 2 {
            (sum - all) / (count - 2.0)
        } else {
            0.5 * all
        }
    });
    Some(
        own.zip(&amplitudes)
            .map(|(own, amplitude)| amplitude * own.max(least).sqrt())
            .collect(),
    )
}

/// The models of noise that are tried: additive of several memories, and in proportion to the velocity.
fn noises(scaled: &[Vec<f64>]) -> Vec<ScanNoise> {
    let count = scaled[0].len() - 1;
    let additive = MEMORIES.iter().map(|memory| ScanNoise {
        memory: *memory,
        sizes: vec![1.0; count],
    });
    let speed: Vec<f64> = (0..count)
        .map(|step| {
            scaled
                .iter()
                .map(|row| (row[step + 1] - row[step]).abs())
                .sum::<f64>()
        })
        .collect();
    let typical = (speed.iter().map(|x| x * x).sum::<f64>() / count as f64)
        .sqrt()
        .max(f64::MIN_POSITIVE);
    let relative = [0.3, 0.03].map(|floor: f64| ScanNoise {
        memory: 1.0,
        sizes: speed.iter().map(|x| (x / typical).hypot(floor)).collect(),
    });
    additive.chain(relative).collect()
}

fn matrix(scaled: &[Vec<f64>], noise: &ScanNoise) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = scaled.iter().map(|row| noise.whiten(row)).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |row, column| rows[row][column])
}

/// Minus twice the log-likelihood of a noise, up to a constant: loadings are free in every block, so that
/// a partition is no noise.
fn score(columns: &DMatrix<f64>, noise: &ScanNoise) -> f64 {
    let (rows, count) = (columns.nrows(), columns.ncols());
    let mut misfit = 0.0;
    let mut free = 0.0;
    for block in 0..BLOCKS {
        let range = block * count / BLOCKS..(block + 1) * count / BLOCKS;
        free += range.len() as f64 - 1.0 - if noise.keeps_offsets() { 1.0 } else { 0.0 };
        let gram = ScanMoments::of(columns, range).gram(noise.keeps_offsets());
        let total = gram.trace();
        misfit +=
            (total - largest(&gram, &DVector::from_element(rows, 1.0)).0).max(ROUNDING * total);
    }
    let sizes: f64 = noise.sizes.iter().map(|size| size.ln()).sum();
    (rows as f64 - 1.0) * (count as f64 * (misfit / free).ln() + 2.0 * sizes)
}
