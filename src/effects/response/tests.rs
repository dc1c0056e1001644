//! Responses have the delay and the memory that they are called by.

use super::*;
use crate::effects::fixture::{channel, correlation, epoch, generator, normals};

/// Values a day.
const A_DAY: f64 = 10.0;
const START: f64 = 50.0;
const DAYS: f64 = 300.0;

/// A covariate that goes from 0 to 1 on day `START`, and its days.
fn step() -> (Driver, Vec<f64>) {
    let count = (1..).take_while(|k| f64::from(*k) <= DAYS * A_DAY);
    let days: Vec<f64> = count.map(|k| f64::from(k) / A_DAY).collect();
    let values: Vec<f64> = days
        .iter()
        .map(|day| f64::from(u8::from(*day >= START)))
        .collect();
    let driver = Driver::new(0, &channel("step", &days, &values), epoch()).unwrap();
    (driver, days)
}

/// The response to the step, from 0 to 1.
fn response_to_step(response: Response) -> Vec<(f64, f64)> {
    let (driver, days) = step();
    let column = driver.respond(response, &days).unwrap();
    let (first, last) = (column[0], column[column.len() - 1]);
    let scaled = column.iter().map(|value| (value - first) / (last - first));
    days.iter().copied().zip(scaled).collect()
}

fn of(form: Form, stages: u8, mean_days: f64) -> Response {
    Response {
        form,
        stages,
        mean_days,
        before: 0.0,
    }
}

fn noise(count: usize) -> Driver {
    let days: Vec<f64> = (0..count).map(|day| day as f64).collect();
    let values = normals(&mut generator(4), count);
    Driver::new(0, &channel("noise", &days, &values), epoch()).unwrap()
}

#[test]
fn a_step_comes_through_with_the_mean_delay_of_its_response() {
    for stages in [1, 2] {
        for mean in [0.0, 2.0, 12.0] {
            let passed = response_to_step(of(Form::Level, stages, mean));
            let missing = passed.iter().filter(|(day, _)| *day >= START);
            let delay = missing.map(|(_, value)| 1.0 - value).sum::<f64>() / A_DAY;
            // Half a value's spacing: the covariate goes linearly.
            assert!(
                (delay - mean).abs() < 0.06 + 0.005 * mean,
                "{stages} {mean} {delay}"
            );
        }
    }
}

#[test]
fn ninety_five_percent_of_a_step_have_come_through_within_the_memory() {
    for stages in [1, 2] {
        let response = of(Form::Level, stages, 12.0);
        let passed = response_to_step(response);
        let (day, _) = passed
            .into_iter()
            .find(|(_, value)| *value >= 0.95)
            .unwrap();
        let memory = day - START;
        assert!(
            (memory - response.memory_days()).abs() < 0.15,
            "{stages} {memory}"
        );
    }
}

#[test]
fn two_stages_answer_later_at_first_than_one() {
    let early = |stages| {
        let passed = response_to_step(of(Form::Level, stages, 12.0));
        let at = passed.into_iter().find(|(day, _)| *day >= START + 2.0);
        at.unwrap().1
    };
    assert!(early(2) < 0.4 * early(1), "{} {}", early(2), early(1));
}

#[test]
fn the_response_by_rate_sums_up_to_the_response_by_level() {
    let driver = noise(800);
    let days: Vec<f64> = (0..800).map(f64::from).collect();
    for (stages, mean) in [(1, 0.0), (1, 8.0), (2, 8.0)] {
        let level = driver
            .respond(of(Form::Level, stages, mean), &days)
            .unwrap();
        let rate = driver.respond(of(Form::Rate, stages, mean), &days).unwrap();
        let slopes: Vec<f64> = level.windows(2).map(|w| w[1] - w[0]).collect();
        let alike = correlation(&slopes, &rate[1..]);
        assert!(alike > 0.999_999, "{stages} {mean} {alike}");
    }
}

#[test]
fn a_response_has_mean_zero_and_deviation_one_at_the_nodes_and_needs_some_movement() {
    let driver = noise(500);
    let nodes: Vec<f64> = (0..300).map(|k| 100.3 + f64::from(k)).collect();
    let column = driver.respond(of(Form::Level, 1, 5.0), &nodes).unwrap();
    let n = column.len() as f64;
    assert!(column.iter().sum::<f64>().abs() < 1e-9 * n);
    assert!((column.iter().map(|u| u * u).sum::<f64>() / n - 1.0).abs() < 1e-9);
    let still = step().0.respond(of(Form::Level, 1, 5.0), &[1.0, 5.0, 20.0]);
    assert!(still.is_none());
}

#[test]
fn shifted_to_its_whole_length_or_twice_backwards_a_covariate_is_itself() {
    let driver = noise(137);
    for by in [0, 1, 60, 136] {
        let round = driver.shifted(by, false).shifted(driver.len() - by, false);
        assert_eq!(round.values, driver.values);
        let twice = driver.shifted(by, true).shifted(by, true);
        assert_eq!(twice.values, driver.values);
        let moved = driver.shifted(by, true);
        assert!(correlation(&moved.values, &driver.values).abs() < 0.3);
    }
}

#[test]
fn the_share_of_the_readings_time_that_a_channel_covers_is_counted() {
    let driver = noise(101);
    let nodes: Vec<f64> = (0..200).map(f64::from).collect();
    let covered = driver.coverage(&nodes);
    assert!((covered - 0.51).abs() < 0.011, "{covered}");
}

/// Rain by the day, in showers; each day's total stands at the end of the day.
fn rain(days: usize) -> (Driver, Vec<f64>) {
    let totals: Vec<f64> = (0..days)
        .map(|day| f64::from(day % 7 == 3) * 10.0 + f64::from(day % 11 == 5) * 4.0)
        .collect();
    let times: Vec<f64> = (1..=days).map(|day| day as f64).collect();
    let driver = Driver::new(0, &channel("rain_mm", &times, &totals), epoch()).unwrap();
    (driver, totals)
}

#[test]
fn rain_acts_while_it_falls_and_not_from_the_end_of_its_day_on() {
    let (driver, totals) = rain(120);
    let mean = 5.0;
    let nodes: Vec<f64> = (1..=4 * 119)
        .map(|quarter| 1.0 + f64::from(quarter) / 4.0)
        .collect();
    let given = driver.respond_in_unit(of(Form::Level, 1, mean), &nodes);
    // A store that fills evenly over each day, in small steps, from where what usually falls keeps it.
    let (parts, mut store) = (1000, totals.iter().sum::<f64>() / totals.len() as f64);
    let mut drained = Vec::new();
    for total in &totals {
        for _ in 0..parts {
            store += (total - store) / (mean * f64::from(parts));
        }
        drained.push(store);
    }
    let at_ends = nodes
        .iter()
        .zip(&given)
        .filter(|(day, _)| day.fract() < 1e-9);
    for (day, value) in at_ends {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole day"
        )]
        let right = drained[*day as usize - 1];
        assert!(
            (value - right).abs() < 0.01,
            "day {day}: {value} for {right}"
        );
    }
    // Without delay a quarter of the day on which it falls has its rain, and the quarter after that day has none.
    let at_once = driver.respond_in_unit(of(Form::Level, 1, 0.0), &[3.25, 4.0, 4.25]);
    assert_eq!(at_once, [10.0, 10.0, 0.0]);
}

#[test]
fn a_total_after_a_gap_falls_over_all_of_it_and_none_is_lost() {
    let times = [1.0, 2.0, 3.0, 4.0, 8.0, 9.0, 10.0];
    let totals = [0.0, 2.0, 0.0, 0.0, 8.0, 0.0, 1.0];
    let driver = Driver::new(0, &channel("rain_mm", &times, &totals), epoch()).unwrap();
    let days: Vec<f64> = (1..=10).map(f64::from).collect();
    let given = driver.respond_in_unit(of(Form::Level, 1, 0.0), &days);
    let right = [0.0, 2.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 0.0, 1.0];
    for (given, right) in given.iter().zip(right) {
        assert!((given - right).abs() < 1e-9, "{given} for {right}");
    }
}

#[test]
fn the_first_day_after_a_long_gap_is_not_spread_over_it() {
    let days: Vec<f64> = (1..=100).map(f64::from).collect();
    let totals: Vec<f64> = days.iter().map(|day| 3.0 * (day % 2.0)).collect();
    let is_kept = |day: &f64| !(41.0..=60.0).contains(day);
    let kept = days.iter().zip(&totals).filter(|(day, _)| is_kept(day));
    let (times, mut amounts): (Vec<f64>, Vec<f64>) = kept.unzip();
    let given = |amounts: &[f64]| {
        let driver = Driver::new(0, &channel("rain_mm", &times, amounts), epoch()).unwrap();
        assert_eq!(driver.gap_at(50.0, 0.0), Some((40.0, 61.0)));
        assert_eq!(driver.gap_at(63.0, 1.0), None);
        assert!(driver.gap_at(63.0, 5.0).is_some());
        driver.respond_in_unit(of(Form::Level, 1, 0.0), &days)
    };
    let by_day = given(&amounts);
    for (day, (given, right)) in days.iter().zip(by_day.iter().zip(&totals)) {
        let right = if is_kept(day) { *right } else { 1.5 };
        assert!((given - right).abs() < 0.05, "{day}: {given} for {right}");
    }
    // What was read at once after the gap fell in it.
    amounts[40] = 42.0;
    let all_at_once = given(&amounts);
    assert!((all_at_once[49] - 2.0).abs() < 1e-9, "{}", all_at_once[49]);
}

#[test]
fn a_gauge_that_reports_only_while_it_rains_is_dry_between() {
    // Showers of two to five hours, four to sixteen hours apart, and a drought each ten days.
    let hours = 24 * 90;
    let (mut falls, mut left, mut dry) = (vec![0.0; hours], 0, 3);
    for (hour, fall) in falls.iter_mut().enumerate() {
        if left > 0 {
            *fall = 1.0 + (hour % 4) as f64;
            left -= 1;
        } else if dry > 0 {
            dry -= 1;
        } else {
            (left, dry) = (
                2 + hour % 4,
                if hour % 10 == 0 { 60 } else { 4 + hour % 13 },
            );
        }
    }
    let times: Vec<f64> = (0..hours).map(|hour| hour as f64 / 24.0).collect();
    let of_channel = |times: &[f64], values: &[f64]| {
        let driver = Driver::new(0, &channel("rain_mm", times, values), epoch()).unwrap();
        driver.respond(
            of(Form::Level, 1, 5.0),
            &[20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0],
        )
    };
    let whole = of_channel(&times, &falls).unwrap();
    let wet = times.iter().zip(&falls).filter(|(_, fall)| **fall > 0.0);
    let (wet_times, wet_falls): (Vec<f64>, Vec<f64>) = wet.unzip();
    let given = of_channel(&wet_times, &wet_falls).unwrap();
    for (given, right) in given.iter().zip(&whole) {
        assert!((given - right).abs() < 0.05, "{given} for {right}");
    }
}

#[test]
fn a_running_total_acts_as_the_amounts_that_it_sums() {
    let (by_day, totals) = rain(120);
    let mut sum = 300.0;
    let running = totals.iter().enumerate().map(|(day, amount)| {
        // Set back once.
        sum = if day == 70 { *amount } else { sum + amount };
        sum
    });
    let running: Vec<f64> = running.collect();
    let times: Vec<f64> = (1..=120).map(f64::from).collect();
    let driver = Driver::new(0, &channel("rain_mm", &times, &running), epoch()).unwrap();
    let days = &times[1..70];
    let [given, right] =
        [&driver, &by_day].map(|driver| driver.respond_in_unit(of(Form::Level, 1, 0.0), days));
    for (day, (given, right)) in days.iter().zip(given.iter().zip(&right)) {
        assert!((given - right).abs() < 1e-9, "{day}: {given} for {right}");
    }
}

#[test]
fn a_level_moved_to_another_time_has_the_same_changes_and_rain_the_same_amounts() {
    let level = noise(200);
    for mirrored in [false, true] {
        let moved = level.moved_by(0.3, mirrored);
        let changes = |driver: &Driver| {
            let pairs = driver.values.windows(2);
            let mut all: Vec<f64> = pairs.map(|pair| pair[1] - pair[0]).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        for (moved, own) in changes(&moved).iter().zip(changes(&level)) {
            assert!((moved - own).abs() < 1e-9, "{moved} {own}");
        }
        let (rain, _) = rain(120);
        let mut moved = rain.moved_by(0.3, mirrored).values;
        let mut own = rain.values.clone();
        assert_ne!(moved, own);
        moved.sort_by(f64::total_cmp);
        own.sort_by(f64::total_cmp);
        assert_eq!(moved, own);
    }
}
