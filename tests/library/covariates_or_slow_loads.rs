//! A covariate is what acted only where a slow load that nothing measures does not do nearly as well.

use crate::drawn::{channel, normal, read_daily, yearly};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use slipwatch::effects::{Explanation, Kind, Options, explain};
use slipwatch::reading::{Channel, Series};

/// A slope of that velocity, mm/day, by the day, read each day with an error of `noise` mm.
fn series(days: u32, velocity: impl Fn(f64) -> f64, noise: f64, generator: &mut Pcg64) -> Series {
    let mut moved = 0.0;
    read_daily(days, |day| {
        let parts = (0..24).map(|hour| velocity(day - 1.0 + (f64::from(hour) + 0.5) / 24.0));
        moved += parts.sum::<f64>() / 24.0;
        moved + noise * normal(generator)
    })
}

fn said(series: &Series, channels: &[Channel]) -> Explanation {
    explain(series, channels, &[], &Options::default(), &mut |_| ())
}

#[test]
fn warmth_does_not_explain_a_slope_that_fails_by_a_power_law() {
    let mut generator = Pcg64::seed_from_u64(5);
    let power = |day: f64| 0.4 * (1.0 - day / 215.0).powf(-1.6);
    let slope = series(200, power, 0.8, &mut generator);
    let warmth = yearly("air_temperature_c", 200, 15.0, &mut generator);
    let explanation = said(&slope, &[warmth]);
    let mut effects = std::iter::once(&explanation.verdict).chain(&explanation.also);
    assert!(
        effects.all(|one| one.channel.is_none()),
        "{:?}",
        explanation.verdict
    );
}

#[test]
fn a_lake_that_is_drawn_down_once_explains_the_motion_that_comes_with_it() {
    let mut generator = Pcg64::seed_from_u64(6);
    let level = |day: f64| 170.0 - 10.0 * ((day - 40.0) / 15.0).clamp(0.0, 1.0);
    // It seeps out of the slope within days.
    let seeped = |day: f64| {
        let each = (0..40).map(|before| f64::from(before) * 0.5);
        let weights = each.map(|before| ((-before / 5.0).exp(), level(day - before)));
        let (sum, total) = weights.fold((0.0, 0.0), |(sum, total), (weight, level)| {
            (sum + weight * level, total + weight)
        });
        sum / total
    };
    let velocity = |day: f64| 0.5 * (0.12 * (170.0 - seeped(day))).exp();
    let slope = series(120, velocity, 0.3, &mut generator);
    let explanation = said(&slope, &[channel("lake_level_m", 120, level)]);
    assert_eq!(
        explanation.verdict.effect,
        Kind::HYDROLOGICAL,
        "{:?}",
        explanation.candidates
    );
}
