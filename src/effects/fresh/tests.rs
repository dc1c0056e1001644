//! A law keeps its motion when it is written in the terms of more readings.

use super::*;
use crate::effects::fixture::{daily, generator, normals, series, steady};
use crate::effects::kind::Kind;
use crate::effects::term::MIDDLE;
use crate::effects::{Options, explain};

const COUNT: usize = 120;
const PART: usize = 70;

fn moves_alike(kind: Kind, act: Act) {
    let whole = steady(Quantity::Displacement, &daily(COUNT), 1);
    let part = whole.until(PART);
    let term = Term {
        kind,
        channel: None,
        response: None,
        at: None,
        share: MIDDLE,
        act,
    };
    let mut scratch = Scratch::default();
    let start = plain_starts(&part).swap_remove(1).with_size(&term, 0.4);
    let white = [Whitener::new(&part, Noise::WHITE)];
    let fitted = refit_from(&part, &[start], &white, &mut scratch).unwrap();
    let longer = in_terms_of(&whole, &part, &fitted, &term);
    assert!(scratch.predict(&whole, &longer.terms, &longer.parameters));
    let pairs = scratch.prediction.iter().zip(&fitted.prediction);
    for (longer, shorter) in pairs.take(PART) {
        assert!(
            (longer - shorter).abs() < 1e-6,
            "{kind}: {longer} {shorter}"
        );
    }
}

#[test]
fn a_law_with_a_rate_limit_moves_alike_in_the_terms_of_more_readings() {
    moves_alike(Kind::RATE_LIMIT, Act::PerVelocity);
}

#[test]
fn a_law_with_a_changing_geometry_moves_alike_in_the_terms_of_more_readings() {
    moves_alike(Kind::GEOMETRY, Act::PerSlip);
}

/// Velocities that fall by half within two days, read daily with two gaps, with a noise of 0.6 % of each.
#[test]
fn a_slope_that_slows_down_within_its_first_readings_lacks_nothing() {
    let gap = |day: f64| {
        if day > 129.0 {
            33.0
        } else if day > 34.0 {
            21.0
        } else {
            0.0
        }
    };
    let days: Vec<f64> = daily(292).iter().map(|day| day + gap(*day)).collect();
    let law = [-1.482, -167.2, 5.197, -1.133];
    for seed in 1..4 {
        let mut scratch = Scratch::default();
        let any = steady(Quantity::Velocity, &days, seed);
        assert!(scratch.predict(&any, &[], &law));
        let noise = normals(&mut generator(seed), days.len());
        let both = scratch.prediction.iter().zip(noise);
        let values: Vec<f64> = both.map(|(v, noise)| v * (1.0 + 0.006 * noise)).collect();
        let series = series(Quantity::Velocity, &days, &values);
        let found = explain(&series, &[], &[], &Options::default(), &mut |_| {});
        assert_eq!(found.verdict.effect, Kind::NONE, "seed {seed}");
    }
}
