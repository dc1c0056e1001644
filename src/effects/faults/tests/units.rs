//! The unit in which readings are given makes no fault of them.

use super::*;

/// Every sixth value was computed, and has digits without end: one of them stands twice.
fn partly_computed(unit: f64) -> Vec<(Timestamp, f64)> {
    let walk = walk(23);
    let value = |day: usize| {
        let original = if day == 300 { 60 } else { day };
        let tenths = (900.0 + 30.0 * walk[original] + 4.0 * original as f64).round() / 10.0;
        let value = if original.is_multiple_of(6) {
            tenths + walk[original].sin() / 30.0
        } else {
            tenths
        };
        // As it is printed, and read again.
        (value * unit).to_string().parse::<f64>().unwrap()
    };
    days(17, |_| 0.0)
        .into_iter()
        .enumerate()
        .map(|(day, (time, _))| (time, value(day)))
        .collect()
}

#[test]
fn the_same_readings_in_other_units_have_the_same_faults() {
    let own = inspect(&readings(Unit::MM, &partly_computed(1.0)), &[]);
    assert!(
        found(&own).contains(&(FaultKind::RepeatedRows, day(300))),
        "{:?}",
        own.faults
    );
    for (unit, size) in [
        ("m", 1e-3),
        ("cm", 0.1),
        ("in", 1.0 / 25.4),
        ("ft", 1.0 / 304.8),
    ] {
        let unit: Unit = Unit::parse(unit).unwrap();
        let other = inspect(&readings(unit, &partly_computed(size)), &[]);
        assert_eq!(found(&other), found(&own), "{unit}");
    }
}
