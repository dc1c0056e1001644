//! A reset is one jump, also where a mean straddles it; a rise over several readings is none.

use crate::effects::candidates::jump;
use crate::effects::fixture::{daily, generator, normals, series};
use crate::effects::ready::Ready;
use crate::effects::{Kind, Options};
use crate::reading::Quantity;

const DAYS: usize = 200;
const AT: usize = 120;
/// mm.
const SIZE: f64 = 12.0;

/// Whether a jump before reading `AT`, of readings that `added` is added to, goes on over the readings beside it.
fn goes_on(added: impl Fn(usize) -> f64) -> bool {
    let days = daily(DAYS);
    let noise = normals(&mut generator(1), DAYS);
    let values = days.iter().zip(noise).enumerate();
    let values: Vec<f64> = values
        .map(|(day, (moved, noise))| moved + 0.2 * noise + added(day))
        .collect();
    let series = series(Quantity::Displacement, &days, &values);
    let ready = Ready::of(&series, &[], &mut Vec::new()).unwrap();
    let options = Options::default();
    let mut search = ready.search(&options, false);
    let base = search.null(&ready.plain).unwrap();
    let found = search
        .refitted(&base, &jump(&ready.problem, Kind::OFFSET, AT))
        .unwrap();
    assert_eq!(found.term.kind, Kind::OFFSET);
    search.takes_several_readings(&found.fitted)
}

#[test]
fn a_reset_is_one_jump() {
    assert!(!goes_on(|day| if day < AT { 0.0 } else { SIZE }));
}

#[test]
fn a_mean_that_straddles_a_reset_makes_it_no_rise() {
    assert!(!goes_on(|day| match day {
        _ if day < AT => 0.0,
        AT => 0.4 * SIZE,
        _ => SIZE,
    }));
}

#[test]
fn a_rise_over_five_readings_is_no_reset() {
    let risen = |day: usize| ((day as f64 - AT as f64 + 3.0) / 5.0).clamp(0.0, 1.0);
    assert!(goes_on(|day| SIZE * risen(day)));
}
