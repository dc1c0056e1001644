//! The figures before and after are those of one problem, and of fits that are no worse with more freedom.

use super::super::explain::explain;
use super::super::explanation::Explanation;
use super::super::fixture::{daily, generator, lake, normals, series};
use super::super::given::put_in;
use super::super::{fixture, options};
use super::*;
use crate::reading::Quantity;

/// Extensometer E3 of Preonzo (CC BY 4.0, Ma et al., IEEE Access 13, 2025, digitised), until 27 April 2012, the last reading 300 mm too large.
const WITH_A_SPIKE: [f64; 19] = [
    668.2, 670.6, 671.8, 673.0, 674.2, 675.4, 677.8, 680.2, 683.8, 686.2, 688.5, 690.9, 694.5,
    696.9, 701.7, 705.3, 710.1, 714.9, 1026.8,
];

fn explained(quantity: Quantity, values: &[f64]) -> Explanation {
    let series = series(quantity, &daily(values.len()), values);
    let options = options::Options {
        surrogates: 99,
        ..options::Options::default()
    };
    explain(&series, &[], &[], &options, &mut |_| ())
}

#[test]
fn where_no_effect_entered_all_figures_are_the_same_before_and_after() {
    let said = explained(Quantity::Displacement, &WITH_A_SPIKE);
    assert!(said.verdict.effect.is_an_end(), "{:?}", said.verdict);
    let error = &said.error;
    for change in [error.fit, error.held_out, error.held_out_step] {
        assert!(change.before.is_some());
        assert_eq!(change.before, change.after);
    }
    assert_eq!(said.curves.before, said.curves.after);
    assert_eq!(said.curves.before_held_out, said.curves.after_held_out);
    assert_eq!(said.residual.runs.before, said.residual.runs.after);
}

#[test]
fn a_single_reading_far_off_at_the_end_is_not_nothing_and_not_explained() {
    let said = explained(Quantity::Displacement, &WITH_A_SPIKE);
    assert_eq!(said.verdict.effect, Kind::UNEXPLAINED);
    assert_eq!(said.explained, Explained::None);
    let of_newest = "until more is read";
    assert!(said.remarks.iter().any(|one| one.contains(of_newest)));
    let said = explained(Quantity::Displacement, &WITH_A_SPIKE[..18]);
    assert!(!said.remarks.iter().any(|one| one.contains(of_newest)));
}

#[test]
fn a_law_with_more_freedom_is_never_farther_from_the_readings() {
    let days = daily(120);
    for (seed, quantity) in [(1, Quantity::Velocity), (2, Quantity::Displacement)] {
        let noise = normals(&mut generator(seed), days.len());
        let mut moved = 0.0;
        let values = lake(&days).into_iter().zip(noise).map(|(level, noise)| {
            let velocity = (0.02 * moved + 0.3 * level).exp();
            moved += 0.5;
            match quantity {
                Quantity::Velocity => velocity * (1.0 + 0.1 * noise),
                Quantity::Displacement => moved + 0.3 * noise,
            }
        });
        let series = series(quantity, &days, &values.collect::<Vec<f64>>());
        let ready = Ready::of(&series, &[], &mut Vec::new()).unwrap();
        let options = options::Options::default();
        let mut search = ready.search(&options, false);
        let null = search.null(&ready.plain).unwrap();
        for kind in [Kind::FRICTION_CHANGE, Kind::INTERVAL_MEAN, Kind::LOAD_STEP] {
            let cause = fixture::cause(kind);
            let (full, _) = put_in(&mut search, null.clone(), &[cause]).unwrap();
            let scratch = &mut Scratch::default();
            let after = least_squares(&ready.problem, &ready.plain, &full, scratch).unwrap();
            let [before, after] =
                [&ready.plain, &after].map(|fitted| fitted.rms(&ready.problem, 0..days.len()));
            assert!(after <= before, "{kind}: {before} to {after}");
        }
    }
}

#[test]
fn readings_that_are_equal_or_one_of_them_one_count_off_show_no_effect() {
    let of = |value: f64, off: f64| {
        let mut values = vec![value; 60];
        values[41] += off;
        explained(Quantity::Velocity, &values)
    };
    for (value, off) in [(3.0, 0.0), (0.0, 0.0), (0.5, 0.0), (0.5, 0.1), (1.27, 0.01)] {
        let said = of(value, off);
        assert_eq!(
            said.verdict.effect,
            Kind::NONE,
            "{value} and {off}: {:?}",
            said.also
        );
        assert!(said.also.is_empty(), "{value} and {off}");
    }
}
