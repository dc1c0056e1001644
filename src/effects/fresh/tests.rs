//! A law keeps its motion when it is written in the terms of more readings.

use super::*;
use crate::effects::fixture::{daily, steady};
use crate::effects::kind::Kind;
use crate::effects::term::MIDDLE;

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
    let longer = in_terms_of(&whole, (&part, &fitted), &term);
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
    moves_alike(Kind::RateLimit, Act::PerVelocity);
}

#[test]
fn a_law_with_a_changing_geometry_moves_alike_in_the_terms_of_more_readings() {
    moves_alike(Kind::Geometry, Act::PerSlip);
}
