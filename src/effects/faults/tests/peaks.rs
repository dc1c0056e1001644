//! What rain and rivers cannot reach is a fault, and their peaks are none.

use super::*;

#[test]
fn rain_and_rivers_have_peaks_but_not_a_thousand_times_the_next() {
    let noise = noise(23);
    let wet = |day: usize| {
        if noise[day] > 1.0 {
            10.0 * noise[day]
        } else {
            0.0
        }
    };
    for (name, unit) in [("rain_mm", "mm"), ("discharge_m3s", "m3/s")] {
        for absurd in [65_535.0, 1e300, 30_000.0] {
            let inspected =
                inspect_channel(name, unit, |day| if day == 100 { absurd } else { wet(day) });
            let faults = found(&inspected);
            assert_eq!(faults.len(), 1, "{name} {absurd}: {faults:?}");
            assert_eq!(faults[0].1, day(100));
        }
        let flood = inspect_channel(name, unit, |day| if day == 100 { 500.0 } else { wet(day) });
        assert_eq!(found(&flood), []);
    }
}

#[test]
fn a_displacement_that_passes_a_code_and_a_river_that_flows_back_are_measured() {
    let passes = inspect_displacement(0, |day| 800.0 + day as f64 + (day % 3) as f64);
    let codes = passes
        .faults
        .iter()
        .filter(|f| f.kind == FaultKind::OutOfRange);
    assert_eq!(codes.count(), 0);
    let noise = noise(20);
    let tidal = inspect_channel("river_m3_s", "m3_s", |day| 50.0 * noise[day]);
    assert_eq!(tidal.faults, []);
}
