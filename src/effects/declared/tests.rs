//! What is declared is judged: what is there stands, and what is not does not.

use super::*;
use crate::effects::fixture::{NOISE, cause, driven_by_the_lake, jump, through};

fn judged(causes: &[Cause]) -> Explanation {
    let (series, channels) = driven_by_the_lake();
    explain_given(&series, &channels, causes, &Options::default(), &mut |_| {})
}

fn refusals(explanation: &Explanation) -> Vec<Option<&str>> {
    let each = explanation.given.iter();
    each.map(|one| one.rejected_because.as_deref()).collect()
}

#[test]
fn what_is_there_stands_in_the_order_in_which_it_was_declared_and_the_error_falls_to_the_noise() {
    let said = judged(&[jump(), through("lake")]);
    assert_eq!(refusals(&said), [None, None]);
    let kinds: Vec<Kind> = said
        .given
        .iter()
        .map(|one| one.effect.as_ref().unwrap().effect)
        .collect();
    assert_eq!(kinds, [Kind::OFFSET, Kind::HYDROLOGICAL]);
    let jump = said.given[0].effect.as_ref().unwrap();
    assert!((jump.size.unwrap() + 15.0).abs() < 1.0, "{jump:?}");
    // It was drawn as e^(0.5 sin), whose standard deviation is .707, and the law's state takes nothing of it back.
    let lake = said.given[1].effect.as_ref().unwrap();
    let factor = lake.velocity_factor_per_sd.unwrap();
    assert!((factor - 0.354_f64.exp()).abs() < 0.05, "{lake:?}");
    assert!(said.given[1].held_out.unwrap() < 0.5, "{:?}", said.given[1]);
    let fit = said.error.fit;
    assert!(
        fit.after.unwrap() < 1.3 * NOISE && fit.before.unwrap() > 5.0 * NOISE,
        "{fit:?}"
    );
    assert!(
        said.error.held_out.after < said.error.held_out.before,
        "{:?}",
        said.error
    );
    let both = [said.verdict.effect, said.also[0].effect];
    assert!(
        both.contains(&Kind::OFFSET) && both.contains(&Kind::HYDROLOGICAL),
        "{both:?}"
    );
    assert_eq!(said.candidates.len(), 2);
}

#[test]
fn what_is_not_there_does_not_stand_and_what_is_there_stands_beside_it() {
    let said = judged(&[through("other"), jump()]);
    let refusals = refusals(&said);
    assert!(
        refusals[0].is_some() && refusals[1].is_none(),
        "{refusals:?}"
    );
    assert_eq!(said.verdict.effect, Kind::OFFSET);
    assert!(said.also.is_empty());
    assert_ne!(said.explained, Explained::Full);
    assert!(said.remarks.iter().any(|remark| remark == ALL_IN));
}

#[test]
fn what_a_record_cannot_show_is_said_to_be_no_part_of_its_law() {
    let said = judged(&[cause(Kind::INTERVAL_MEAN), cause(Kind::TIDE)]);
    assert_eq!(refusals(&said), [Some(NOT_SEEN); 2]);
    assert!(said.given.iter().all(|one| one.effect.is_none()));
    assert_eq!(said.verdict.effect, Kind::UNEXPLAINED);
    assert_eq!(said.explained, Explained::None);
}

#[test]
fn of_too_few_readings_nothing_is_judged() {
    let (mut series, channels) = driven_by_the_lake();
    series.readings.truncate(3);
    let options = Options::default();
    let said = explain_given(&series, &channels, &[jump()], &options, &mut |_| {});
    assert_eq!(refusals(&said), [Some(TOO_FEW)]);
}

#[test]
fn of_readings_that_fall_nothing_that_is_declared_is_judged() {
    let (mut series, _) = driven_by_the_lake();
    for reading in &mut series.readings {
        reading.value = -reading.value;
    }
    let said = explain_given(&series, &[], &[jump()], &Options::default(), &mut |_| {});
    assert_eq!(refusals(&said), [Some(UPSLOPE)]);
    assert_eq!(said.verdict.effect, Kind::UNEXPLAINED);
    assert!(said.remarks.iter().any(|remark| remark == upslope::REMARK));
}

#[test]
fn a_declared_time_that_is_not_the_one_that_fits_best_is_remarked() {
    let said = |hours: i64| {
        let at = jump()
            .at
            .map(|at| at + jiff::SignedDuration::from_hours(hours));
        judged(&[Cause { at, ..jump() }, through("lake")]).remarks
    };
    let moved = |remarks: &[String]| remarks.iter().any(|one| one.contains("it fits best at"));
    assert!(!moved(&said(0)) && moved(&said(96)), "{:?}", said(96));
    let late = jump()
        .at
        .map(|at| at + jiff::SignedDuration::from_hours(15 * 24));
    let kept = judged(&[Cause { at: late, ..jump() }, through("lake")]);
    let at = kept.given[0].effect.as_ref().unwrap().at.unwrap();
    assert!(days_since(late.unwrap(), at).abs() < 3.5, "{at}");
}
