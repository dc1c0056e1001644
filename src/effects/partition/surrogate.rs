//! Whether benchmarks that stay in proportion would seem to part as plainly, by their own noise alone.

use super::scan::{Break, Scan};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Most that the noise of a row correlates with that of the row before it.
const LONGEST_MEMORY: f64 = 0.97;

/// The chance that `count` seeded copies of the motion without a partition show as much.
pub(super) fn p_value(scan: &Scan, found: &Break, count: usize, seed: u64) -> f64 {
    let motion = motion(scan, found);
    let noises: Vec<(f64, f64)> = left(scan, found).iter().map(own_noise).collect();
    let mut random = Pcg64::seed_from_u64(seed);
    let as_much = (0..count).filter(|_| {
        let columns = copy(&motion, &noises, &mut random);
        let gain = scan
            .with(columns)
            .strongest()
            .map_or(f64::NEG_INFINITY, |one| one.gain);
        gain >= found.gain
    });
    (1 + as_much.count()) as f64 / (1 + count) as f64
}

/// All rows in the proportions before the break.
fn motion(scan: &Scan, found: &Break) -> DMatrix<f64> {
    let latent = scan.columns.transpose() * &found.loadings;
    &found.loadings * latent.transpose()
}

/// What the break leaves of each row, before and after together.
fn left(scan: &Scan, found: &Break) -> Vec<DVector<f64>> {
    let (rows, count) = (scan.columns.nrows(), scan.columns.ncols());
    let after = DVector::from_fn(rows, |row, _| {
        found.loadings[row] * found.factors[found.groups[row]]
    })
    .normalize();
    let sides = [
        (0..found.column, &found.loadings),
        (found.column + 1..count, &after),
    ];
    let mut left = vec![Vec::new(); rows];
    for (range, loadings) in sides {
        let side = scan.columns.columns_range(range).clone_owned();
        let centre = if scan.noise.keeps_offsets() {
            side.column_mean()
        } else {
            DVector::zeros(rows)
        };
        let side = DMatrix::from_fn(rows, side.ncols(), |row, column| {
            side[(row, column)] - centre[row]
        });
        let off = &side - loadings * (loadings.transpose() * &side);
        for (row, values) in left.iter_mut().enumerate() {
            values.extend(off.row(row).iter());
        }
    }
    left.into_iter().map(DVector::from_vec).collect()
}

/// Memory and size of a row's noise; a fit takes part of both away.
fn own_noise(left: &DVector<f64>) -> (f64, f64) {
    let count = left.len() as f64;
    let seen = super::ratio::lag_one(left);
    let memory = (seen + 2.0 * (1.0 + 3.0 * seen) / count).clamp(-0.5, LONGEST_MEMORY);
    (
        memory,
        (left.norm_squared() / (count - 4.0).max(1.0)).sqrt(),
    )
}

fn copy(motion: &DMatrix<f64>, noises: &[(f64, f64)], random: &mut impl Rng) -> DMatrix<f64> {
    let mut columns = motion.clone();
    // Fitting the common motion takes one row's worth of noise away.
    let rows = noises.len() as f64;
    let share = (rows / (rows - 1.0)).sqrt();
    for (row, (memory, size)) in noises.iter().enumerate() {
        let mut noise: f64 = size * random.sample::<f64, _>(StandardNormal);
        for column in 0..columns.ncols() {
            columns[(row, column)] += share * noise;
            noise = memory * noise
                + (1.0 - memory * memory).sqrt() * size * random.sample::<f64, _>(StandardNormal);
        }
    }
    columns
}
