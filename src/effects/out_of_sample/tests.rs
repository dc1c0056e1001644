//! An event that gains a margin, but not as many as its shape alone must, stands where it predicts the later block.

use super::super::candidates::once;
use super::super::fixture::lake_and_step;
use super::super::kind::Kind;
use super::super::options::Options;
use super::super::ready::Ready;
use super::*;

/// What share of the error a step of the load before day 110 leaves of the later block, where it gains 15, and whether it is judged to stand.
fn predicted(step: f64) -> (Option<f64>, bool) {
    let (series, channels) = lake_and_step(step, 5);
    let ready = Ready::of(&series, &channels, &mut Vec::new()).unwrap();
    let options = Options::default();
    let mut search = ready.search(&options, false);
    let null = search.null(&ready.plain).unwrap();
    let ground = search.ground(&null).unwrap();
    let lake = search.through_covariates(&null, &ground, None);
    let lake = lake.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
    let base = lake.unwrap().fitted;
    let term = once(Kind::LOAD_STEP, 110).next().unwrap();
    let found = search.refitted(&base, &term).unwrap();
    let one = Refitted {
        gain: 15.0,
        p_value: 1e-4,
        ..found
    };
    let share = search.predicted_after_all(&base, &one);
    (share, search.judged(&base, &one).1.is_none())
}

#[test]
fn a_step_beside_the_lake_that_predicts_the_later_block_stands_with_a_smaller_gain() {
    let (share, stands) = predicted(1.0);
    assert!(share.unwrap() < FAR_NEARER, "{share:?}");
    assert!(stands);
}

#[test]
fn a_step_that_is_not_there_does_not_stand_with_a_smaller_gain() {
    assert_eq!(predicted(0.0), (None, false));
}
