//! A cause that is there takes the error down, where it is given; one that is not does not.

use super::*;
use crate::effects::fixture::{NOISE, cause, driven_by_the_lake, jump, through};

fn given(causes: &[Cause], from: Option<Timestamp>) -> ErrorChange {
    let (series, channels) = driven_by_the_lake();
    error_given(&series, &channels, causes, from, &Options::default()).unwrap()
}

#[test]
fn with_both_causes_told_the_error_is_that_of_the_noise_and_the_held_out_one_falls() {
    let error = given(&[through("lake"), jump()], None);
    let (fit, held) = (error.fit, error.held_out);
    assert!(fit.after.unwrap() < 1.3 * NOISE, "{fit:?}");
    assert!(fit.before.unwrap() > 5.0 * NOISE, "{fit:?}");
    assert!(held.after.unwrap() < 0.3 * held.before.unwrap(), "{held:?}");
}

#[test]
fn another_channel_and_a_kind_that_is_no_term_help_little() {
    let right = given(&[through("lake"), jump()], None).fit.after.unwrap();
    let wrong = given(&[through("other"), jump()], None).fit.after.unwrap();
    assert!(wrong > 2.0 * right, "{wrong} {right}");
    let nothing = given(&[cause(Kind::PARTITION), through("missing")], None).fit;
    let (before, after) = (nothing.before.unwrap(), nothing.after.unwrap());
    assert!((after / before - 1.0).abs() < 0.01, "{nothing:?}");
}

#[test]
fn the_block_begins_where_it_is_told_to() {
    let from = after_days(crate::effects::fixture::epoch(), 200.0);
    assert_eq!(given(&[through("lake")], from).held_out_from, from);
}
