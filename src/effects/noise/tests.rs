//! Noise drawn from its own equation comes out white, its size and memory are found, and its state smoothed.

use super::*;
use crate::effects::fixture::{daily, generator, normals, series, steady, with_gaps};
use crate::effects::frame::Frame;
use crate::effects::quantiles::upper_median;

const COUNT: usize = 900;
/// Substeps from which the gathered load is summed.
const SUBSTEPS: usize = 20;

/// Noise of this model at the problem's times, and what remembers in it: from the process itself, in small steps.
fn drawn(problem: &Problem, noise: Noise, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut random = generator(seed);
    let white = normals(&mut random, problem.t.len());
    let mut state = normals(&mut random, 1)[0];
    if noise.days.is_infinite() {
        state = 0.0;
    }
    let mut gathered = 0.0;
    let mut longer = if noise.longer > 0.0 {
        normals(&mut random, 1)[0]
    } else {
        0.0
    };
    let (mut readings, mut states) = (Vec::new(), Vec::new());
    for (i, white) in white.into_iter().enumerate() {
        let dt = problem.t[i] - problem.t[i.saturating_sub(1)];
        if noise.longer > 0.0 {
            let decay = (-dt / noise.longer).exp();
            longer = decay * longer + (1.0 - decay * decay).sqrt() * normals(&mut random, 1)[0];
        }
        for step in normals(&mut random, if i > 0 { SUBSTEPS } else { 0 }) {
            let h = dt / SUBSTEPS as f64;
            let decay = (-h / noise.days).exp();
            let before = state;
            state = if noise.days.is_infinite() {
                state + (h / problem.spacing).sqrt() * step
            } else {
                decay * state + (1.0 - decay * decay).sqrt() * step
            };
            gathered += 0.5 * (before + state) * h / noise.days;
        }
        let remembered = match (noise.memory, problem.quantity) {
            (Memory::None, _) => 0.0,
            (Memory::Load, Quantity::Displacement) => gathered,
            _ => state + longer,
        };
        readings.push(problem.weight[i] * white + noise.ratio * remembered);
        states.push(state);
    }
    (readings, states)
}

fn models() -> Vec<Noise> {
    let of = |(memory, days, ratio, longer)| Noise {
        memory,
        days,
        ratio,
        longer,
    };
    [
        (Memory::Reading, 10.0, 2.0, 0.0),
        (Memory::Reading, f64::INFINITY, 0.5, 0.0),
        (Memory::Reading, 2.0, 1.0, 40.0),
        (Memory::Load, 15.0, 3.0, 0.0),
        (Memory::Load, 40.0, 1.0, 0.0),
    ]
    .map(of)
    .to_vec()
}

fn problems() -> Vec<Problem> {
    let quantities = [Quantity::Displacement, Quantity::Velocity];
    let of = |quantity| [daily(COUNT), with_gaps(COUNT, 25, 6)].map(|t| steady(quantity, &t, 1));
    quantities.into_iter().flat_map(of).collect()
}

#[test]
fn colouring_gives_back_the_column_that_was_whitened_under_every_noise_of_the_bank() {
    for problem in problems() {
        let column = normals(&mut generator(2), COUNT);
        let bank = Noise::bank(&problem);
        assert!(bank.len() > 20, "{}", bank.len());
        for whitener in bank {
            let back = whitener.colour(&whitener.innovations(&column));
            let off = back.iter().zip(&column).map(|(a, b)| (a - b).abs());
            let off = off.fold(0.0_f64, f64::max);
            assert!(off < 1e-8, "{:?}: {off:e}", whitener.noise);
        }
    }
}

#[test]
fn innovations_of_white_noise_are_the_readings_over_their_weights() {
    let mut problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    problem.weight = (0..COUNT).map(|i| 1.0 + 0.5 * (i as f64).sin()).collect();
    let column = normals(&mut generator(3), COUNT);
    let whitener = Whitener::new(&problem, Noise::WHITE);
    for (i, u) in whitener.innovations(&column).into_iter().enumerate() {
        assert!((u - column[i] / problem.weight[i]).abs() < 1e-12);
    }
}

#[test]
fn innovations_of_drawn_noise_have_variance_one_and_no_memory_with_and_without_gaps() {
    for problem in problems() {
        for (k, noise) in models().into_iter().enumerate() {
            let whitener = Whitener::new(&problem, noise);
            let (readings, _) = drawn(&problem, noise, 100 + k as u64);
            let u = whitener.innovations(&readings);
            let n = u.len() as f64;
            let variance = u.iter().map(|u| u * u).sum::<f64>() / n;
            let lag = u.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / (n * variance);
            // Four standard errors.
            let what = (problem.quantity, noise);
            assert!(
                (variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(),
                "{what:?} {variance}"
            );
            assert!(lag.abs() < 4.0 / n.sqrt(), "{what:?} {lag}");
        }
    }
}

#[test]
fn noise_is_likeliest_under_its_own_memory() {
    for problem in problems() {
        for memory in [Memory::Reading, Memory::Load] {
            let of = |days| Noise {
                memory,
                days,
                ratio: 3.0,
                longer: 0.0,
            };
            let (readings, _) = drawn(&problem, of(12.0), 7);
            let deviance = |days: &f64| {
                let frame = Frame::new(Whitener::new(&problem, of(*days)), &readings, &[]);
                frame.deviance(frame.misfit)
            };
            let tried = [1.5, 4.0, 12.0, 36.0, 108.0];
            let best = tried
                .into_iter()
                .min_by(|a, b| deviance(a).total_cmp(&deviance(b)))
                .unwrap();
            assert!(
                (best - 12.0_f64).abs() < 1e-9,
                "{:?} {memory:?}: {best}",
                problem.quantity
            );
        }
    }
}

#[test]
fn the_smoother_holds_nine_of_ten_true_states_within_its_ninety_percent() {
    for problem in problems() {
        for (k, noise) in models().into_iter().enumerate() {
            if noise.days.is_infinite() {
                continue;
            }
            let (mut held, mut count, mut gained) = (0.0, 0.0, 0.0);
            for draw in 0..8 {
                let (readings, states) = drawn(&problem, noise, 1000 + 10 * k as u64 + draw);
                let smoothed = Whitener::new(&problem, noise).smooth(&problem, &readings);
                for ((mean, variance), state) in smoothed.into_iter().zip(states) {
                    held += f64::from(u8::from((state - mean).abs() < 1.645 * variance.sqrt()));
                    gained += 1.0 - variance;
                    count += 1.0;
                }
            }
            let (held, gained) = (held / count, gained / count);
            let what = (problem.quantity, noise);
            assert!((held - 0.9).abs() < 0.04, "{what:?} {held}");
            assert!(gained > 0.3, "{what:?} {gained}");
        }
    }
}

#[test]
fn a_load_acts_on_no_reading_while_the_slope_stands_still() {
    let mut problem = steady(Quantity::Velocity, &daily(COUNT), 1);
    let usual = vec![1.0; COUNT - 100];
    problem.see(&[usual, vec![0.0; 100]].concat());
    let noise = Noise {
        memory: Memory::Load,
        days: 15.0,
        ratio: 3.0,
        longer: 0.0,
    };
    let whitener = Whitener::new(&problem, noise);
    let smoothed = whitener.smooth(&problem, &vec![0.0; COUNT]);
    let (moving, still) = (smoothed[COUNT / 2].1, smoothed[COUNT - 1].1);
    assert!(moving < 0.2 && still > 0.4, "{moving} {still}");
}

#[test]
fn a_walk_does_not_follow_a_jump_of_velocities_that_are_read_with_an_error_in_proportion() {
    let days = daily(200);
    let jump = 120;
    let noise = normals(&mut generator(5), days.len());
    let level = |i: usize| if i < jump { 10.0 } else { 40.0 };
    let values: Vec<f64> = (0..days.len())
        .map(|i| level(i) * (1.0 + 0.03 * noise[i]))
        .collect();
    let problem = Problem::new(&series(Quantity::Velocity, &days, &values), &[]).unwrap();
    assert!(problem.is_relative);
    let walk = Noise {
        memory: Memory::Reading,
        days: f64::INFINITY,
        ratio: 0.3,
        longer: 0.0,
    };
    // What a law leaves that moves not at all; the walk has followed the first level after some readings.
    let settled = 60;
    let innovations = Whitener::new(&problem, walk).innovations(&problem.y);
    let sizes: Vec<f64> = innovations[settled..].iter().map(|one| one.abs()).collect();
    let usual = upper_median(sizes.clone());
    let largest = (0..sizes.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]));
    assert_eq!(largest, Some(jump - settled));
    let jump = sizes[jump - settled];
    assert!(jump > 10.0 * usual, "{jump} {usual}");
}
