//! Rain that is given as a running total stands still on dry days, and repeats nothing by that.

use super::*;

#[test]
fn dry_days_of_a_running_total_are_no_copies() {
    let motion = walk(40);
    let series = readings(Unit::MM, &days(1, |day| 0.5 * day as f64 + motion[day]));
    let mut random = Pcg64::seed_from_u64(41);
    let amounts: Vec<f64> = (0..COUNT)
        .map(|_| {
            let is_wet = random.random::<f64>() < 0.25;
            let amount = -12.0 * (1.0 - random.random::<f64>()).ln();
            if is_wet { amount } else { 0.0 }
        })
        .collect();
    let total = days(6, |day| amounts[..=day].iter().sum());
    let inspected = inspect(&series, &[channel("rain_mm", "mm", &total)]);
    assert_eq!(inspected.faults, []);
    assert_eq!(inspected.channels[0].samples.len(), COUNT);
}
