//! A slope that rain drives, beside a river that the rain feeds, and beside one that it does not.

use crate::effects::fixture::{channel, daily, generator, normals, series};
use crate::effects::{Explained, Explanation, Kind, Options, explain};
use crate::model::{Accuracy, Law, Load, LoadedLaw};
use crate::reading::Quantity;

const DAYS: usize = 400;

/// The mean of an exponential response with this delay, of a value a day.
fn delayed(values: &[f64], days: f64) -> Vec<f64> {
    let decay = (-1.0 / days).exp();
    let mut state = values.iter().sum::<f64>() / values.len() as f64;
    let each = values.iter().map(|value| {
        state = decay * state + (1.0 - decay) * value;
        state
    });
    each.collect()
}

/// A slope that rain drives, explained from the rain and from a river: the one that the rain feeds, or another.
fn beside_a_river(is_fed: bool) -> Explanation {
    let days = daily(DAYS);
    let mut random = generator(7);
    let mut rain = || -> Vec<f64> {
        let storms = normals(&mut random, DAYS).into_iter();
        storms.map(|one| (one - 0.8).max(0.0) * 20.0).collect()
    };
    let (fallen, elsewhere) = (rain(), rain());
    let felt = delayed(&fallen, 10.0);
    let mean = felt.iter().sum::<f64>() / DAYS as f64;
    let knots = days.iter().zip(&felt);
    let load = Load::new(knots.map(|(day, f)| (*day, 0.35 * (f - mean))).collect()).unwrap();
    let law = Law::from_paper(0.8, 3.0, 400.0, 1.5).unwrap();
    let loaded = LoadedLaw::new(&law, &load, Accuracy::Fit).unwrap();
    let mut motions = vec![None; DAYS];
    loaded.motions(&days, &mut motions);
    let noise = normals(&mut random, DAYS);
    let values = motions.iter().zip(noise);
    let values: Vec<f64> = values
        .map(|(motion, noise)| motion.unwrap().displacement + noise)
        .collect();
    let source = if is_fed { &fallen } else { &elsewhere };
    let river: Vec<f64> = delayed(source, 4.0).iter().map(|flow| 3.0 + flow).collect();
    let channels = [
        channel("rain_mm", &days, &fallen),
        channel("river_flow_m3_s", &days, &river),
    ];
    let series = series(Quantity::Displacement, &days, &values);
    explain(&series, &channels, &[], &Options::default(), &mut |_| {})
}

#[test]
fn of_rain_and_the_river_it_feeds_neither_is_claimed() {
    let found = beside_a_river(true);
    assert_eq!(found.verdict.effect, Kind::HYDROLOGICAL);
    let called = found.verdict.channel.as_deref();
    let rivals = found.cannot_separate_from.iter();
    let rivals: Vec<Option<&str>> = rivals.map(|rival| rival.channel.as_deref()).collect();
    let both = [Some("rain_mm"), Some("river_flow_m3_s")];
    assert!(
        both.iter()
            .all(|one| *one == called || rivals.contains(one)),
        "{called:?}, {rivals:?}"
    );
    assert_ne!(found.explained, Explained::Full);
}

#[test]
fn rain_is_claimed_beside_a_river_that_it_does_not_feed() {
    let found = beside_a_river(false);
    assert_eq!(found.verdict.channel.as_deref(), Some("rain_mm"));
    assert!(
        found
            .cannot_separate_from
            .iter()
            .all(|rival| rival.channel.is_none()),
        "{:?}",
        found.cannot_separate_from
    );
}
