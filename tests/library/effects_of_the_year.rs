//! What comes and goes with the year in the readings is not said of the slope.

use crate::drawn::{YEAR, normal, read_daily, yearly};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use slipwatch::effects::{Explanation, Kind, Options, explain};

const DAYS: u32 = 1200;

/// A steady slope of so many mm/day, read each day with an error of 1.5 mm and a yearly wave of `wave_mm`, beside the air's temperature and a lake that have
/// nothing to do with it.
fn read(mm_per_day: f64, wave_mm: f64, seed: u64) -> Explanation {
    let mut generator = Pcg64::seed_from_u64(seed);
    let series = read_daily(DAYS, |day| {
        let phase = std::f64::consts::TAU * (day - 200.0) / YEAR;
        mm_per_day * day + wave_mm * phase.cos() + 1.5 * normal(&mut generator)
    });
    let channels = [
        yearly("air_temperature_c", DAYS, 15.0, &mut generator),
        yearly("lake_level_m", DAYS, 130.0, &mut generator),
    ];
    let options = Options {
        surrogates: 99,
        ..Options::default()
    };
    explain(&series, &channels, &[], &options, &mut |_| ())
}

fn has_channel(explanation: &Explanation) -> bool {
    let mut effects = std::iter::once(&explanation.verdict).chain(&explanation.also);
    effects.any(|effect| effect.channel.is_some())
}

#[test]
fn a_wave_of_the_year_in_the_readings_of_a_slope_that_hardly_moves_is_of_the_readings() {
    let said = read(0.01, 3.0, 1);
    assert_eq!(said.verdict.effect, Kind::SEASONAL_READING);
    assert!(!has_channel(&said));
    assert_eq!(said.verdict.unit.as_deref(), Some("mm"));
    let size = said.verdict.size.unwrap();
    assert!((size - 3.0).abs() < 0.3, "{size}");
    assert_eq!(said.verdict.period_days, Some(YEAR));
}

#[test]
fn where_waves_would_change_the_velocity_by_little_they_are_of_the_readings_too() {
    for seed in [2, 3] {
        let said = read(0.3, 0.8, seed);
        assert!(!has_channel(&said), "{seed}: {:?}", said.verdict);
    }
}
