//! A cause that is there takes the error down, where it is given; one that is not does not.

use super::*;
use crate::effects::fixture::{channel, daily, generator, normals, series};
use crate::reading::Quantity;

const COUNT: usize = 240;
/// mm.
const NOISE: f64 = 0.2;

fn cause(kind: Kind) -> Cause {
    Cause {
        kind,
        channel: None,
        at: None,
    }
}

fn lake(days: &[f64]) -> Vec<f64> {
    days.iter().map(|day| (day / 9.0).sin()).collect()
}

/// 1 mm/day, by a factor of e^0.5 more where the lake is high, and a jump of the reading by 15 mm before day 100.
fn driven_by_the_lake() -> (Series, Vec<Channel>) {
    let days = daily(COUNT);
    let noise = normals(&mut generator(3), COUNT);
    let mut moved = 0.0;
    let values = lake(&days).into_iter().zip(noise).enumerate();
    let values = values.map(|(day, (level, noise))| {
        moved += (0.5 * level).exp();
        moved + NOISE * noise + if day >= 100 { -15.0 } else { 0.0 }
    });
    let values: Vec<f64> = values.collect();
    let other: Vec<f64> = days.iter().map(|day| (day / 4.0).cos()).collect();
    let channels = vec![
        channel("lake", &days, &lake(&days)),
        channel("other", &days, &other),
    ];
    (series(Quantity::Displacement, &days, &values), channels)
}

fn given(causes: &[Cause], from: Option<Timestamp>) -> ErrorChange {
    let (series, channels) = driven_by_the_lake();
    error_given(&series, &channels, causes, from, &Options::default()).unwrap()
}

fn through(name: &str) -> Cause {
    Cause {
        channel: Some(name.to_owned()),
        ..cause(Kind::Hydrological)
    }
}

fn jump() -> Cause {
    Cause {
        at: after_days(crate::effects::fixture::epoch(), 100.0),
        ..cause(Kind::Offset)
    }
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
    let nothing = given(&[cause(Kind::Partition), through("missing")], None).fit;
    let (before, after) = (nothing.before.unwrap(), nothing.after.unwrap());
    assert!((after / before - 1.0).abs() < 0.01, "{nothing:?}");
}

#[test]
fn the_block_begins_where_it_is_told_to() {
    let from = after_days(crate::effects::fixture::epoch(), 200.0);
    assert_eq!(given(&[through("lake")], from).held_out_from, from);
}
