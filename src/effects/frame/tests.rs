//! The short way to the likeliest noise is the long one.

use super::*;
use crate::effects::fixture::{daily, generator, normals, steady};
use crate::effects::noise::Noise;
use crate::reading::Quantity;

const COUNT: usize = 203;

fn columns(seed: u64) -> Vec<Vec<f64>> {
    let mut generator = generator(seed);
    (0..5).map(|_| normals(&mut generator, COUNT)).collect()
}

fn quiet_and_sum(seed: u64) -> [Vec<f64>; 2] {
    let steps = normals(&mut generator(seed), COUNT);
    let mut sum = 0.0;
    let walk = steps.iter().map(|step| {
        sum += step;
        sum
    });
    [walk.collect(), steps.clone()]
}

#[test]
fn the_likeliest_noise_is_that_of_the_frames_also_where_a_direction_is_given_twice() {
    let mut told_apart = std::collections::BTreeSet::new();
    for quantity in [Quantity::Displacement, Quantity::Velocity] {
        let bank = Noise::bank(&steady(quantity, &daily(COUNT), 1));
        for seed in 2..8 {
            let mut jacobian = columns(seed);
            jacobian.push(jacobian[1].iter().map(|value| 3.0 * value).collect());
            for residual in quiet_and_sum(100 + seed) {
                let short = likeliest(&bank, &residual, &jacobian);
                assert_eq!(short, Frames::new(&bank, &residual, &jacobian).best());
                told_apart.insert(short);
            }
        }
    }
    assert!(told_apart.len() > 1, "{told_apart:?}");
}

#[test]
fn what_is_left_of_a_residual_is_the_misfit_of_its_frame() {
    let jacobian = columns(3);
    let residual = quiet_and_sum(4)[0].clone();
    for whitener in Noise::bank(&steady(Quantity::Displacement, &daily(COUNT), 1)) {
        let mut all = slices(&jacobian);
        all.push(&residual);
        let left = left_of_last(&whitener.whiten_all(&all));
        let misfit = Frame::new(whitener, &residual, &jacobian).misfit;
        assert!((left / misfit - 1.0).abs() < 1e-9, "{left} {misfit}");
    }
}

#[test]
fn columns_abreast_become_what_each_becomes_alone() {
    let columns = columns(5);
    for whitener in Noise::bank(&steady(Quantity::Velocity, &daily(COUNT), 1)) {
        let abreast = whitener.whiten_all(&slices(&columns));
        for (white, column) in abreast.iter().zip(&columns) {
            assert_eq!(*white, whitener.whiten(column));
        }
    }
}
