//! Each fault is found in a made-up series, and its look-alike is left alone.

use super::*;
use crate::reading::{BenchmarkId, CovariateKind, Reading, Sample, Unit, after_days};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

mod peaks;
mod totals;
mod units;
const COUNT: usize = 400;

/// Independent, standard deviation one.
fn noise(seed: u64) -> Vec<f64> {
    let mut generator = Pcg64::seed_from_u64(seed);
    (0..COUNT)
        .map(|_| generator.sample(StandardNormal))
        .collect()
}

fn walk(seed: u64) -> Vec<f64> {
    let step = |sum: &mut f64, step: f64| {
        *sum += step;
        Some(*sum)
    };
    noise(seed).into_iter().scan(0.0, step).collect()
}

/// One value a day, written to `decimals`.
fn days(decimals: i32, value: impl Fn(usize) -> f64) -> Vec<(Timestamp, f64)> {
    let start: Timestamp = "2001-01-01T00:00:00Z".parse().unwrap();
    let written = |value: f64| {
        let scale = 10_f64.powi(decimals);
        (value * scale).round() / scale
    };
    (0..COUNT)
        .map(|day| (after_days(start, day as f64).unwrap(), written(value(day))))
        .collect()
}

fn day(day: usize) -> Timestamp {
    days(1, |_| 0.0)[day].0
}

fn readings(unit: Unit, rows: &[(Timestamp, f64)]) -> Series {
    let reading = |&(time, value): &(Timestamp, f64)| Reading {
        time,
        value,
        sigma: None,
    };
    Series {
        benchmark: BenchmarkId::new("a"),
        unit,
        averaging: None,
        readings: rows.iter().map(reading).collect(),
    }
}

fn channel(name: &str, unit: &str, rows: &[(Timestamp, f64)]) -> Channel {
    let sample = |&(time, value): &(Timestamp, f64)| Sample { time, value };
    Channel {
        name: name.to_owned(),
        unit: Some(unit.to_owned()),
        stated: None,
        samples: rows.iter().map(sample).collect(),
    }
}

fn inspect_displacement(decimals: i32, value: impl Fn(usize) -> f64) -> Inspected {
    inspect(&readings(Unit::MM, &days(decimals, value)), &[])
}

fn inspect_channel(name: &str, unit: &str, value: impl Fn(usize) -> f64) -> Inspected {
    let channel = channel(name, unit, &days(4, value));
    inspect(&readings(Unit::MM, &[]), &[channel])
}

fn found(inspected: &Inspected) -> Vec<(FaultKind, Timestamp)> {
    let faults = inspected.faults.iter();
    faults.map(|fault| (fault.kind, fault.at)).collect()
}

/// 1.0 from that day on.
fn since(from: usize, day: usize) -> f64 {
    if day >= from { 1.0 } else { 0.0 }
}

#[test]
fn clean_readings_and_channels_come_back_as_they_went_in() {
    let (noise, walk) = (noise(1), walk(2));
    let series = readings(Unit::MM, &days(2, |day| 0.1 * day as f64 + noise[day]));
    let channels = [
        channel("lake_level_m", "m", &days(3, |day| 0.02 * walk[day])),
        channel(
            "rain_mm",
            "mm",
            &days(1, |day| (10.0 * noise[day]).max(0.0)),
        ),
    ];
    let inspected = inspect(&series, &channels);
    assert_eq!(inspected.faults, []);
    assert_eq!(
        (&inspected.series, inspected.channels.as_slice()),
        (&series, &channels[..])
    );
    assert!(inspected.flags.is_empty() && inspected.remarks.is_empty());
}

#[test]
fn a_reset_is_named_with_its_size_and_taken_out() {
    let walk = walk(3);
    let level = |day: usize| 2.0 + 0.01 * walk[day];
    let inspected = inspect_channel("lake_m", "m", |day| level(day) - 0.5 * since(200, day));
    assert_eq!(found(&inspected), [(FaultKind::Reset, day(200))]);
    let size = inspected.faults[0].size.unwrap();
    assert!((size - 0.5).abs() < 0.05, "{size}");
    assert_eq!(inspected.flags, ["covariate-reset"]);
    for (sample, day) in inspected.channels[0].samples.iter().zip(0..) {
        assert!(
            (sample.value - level(day)).abs() < 0.05,
            "{day}: {sample:?}"
        );
    }
}

#[test]
fn a_daily_mean_over_a_reset_goes_and_the_reset_stays_one() {
    let walk = walk(4);
    let inspected = inspect_channel("lake_m", "m", |day| {
        0.01 * walk[day] + 0.2 * since(200, day) + 0.3 * since(201, day)
    });
    assert_eq!(found(&inspected), [(FaultKind::Reset, day(200))]);
    let size = inspected.faults[0].size.unwrap();
    assert!((size + 0.5).abs() < 0.05, "{size}");
    assert_eq!(inspected.channels[0].samples.len(), COUNT - 1);
}

#[test]
fn what_water_does_by_itself_is_no_reset() {
    let (noise, walk) = (noise(5), walk(6));
    let faultless = |name: &str, unit: &str, value: &dyn Fn(usize) -> f64| {
        let inspected = inspect_channel(name, unit, value);
        assert_eq!(inspected.faults, [], "{name}");
    };
    // A flood rises in a day and falls for a month.
    let flood = |day: usize| since(200, day) * (-(day as f64 - 200.0) / 10.0).exp();
    faultless("stage_m", "m", &|day| flood(day) + 0.005 * noise[day]);
    // One of nine days ends as suddenly as it began.
    let box_flood = |day: usize| since(200, day) - since(209, day);
    faultless("creek_m", "m", &|day| box_flood(day) + 0.01 * walk[day]);
    // A reservoir is filled by half a metre over four days.
    let fill = |day: usize| ((day as f64 - 200.0) / 4.0).clamp(0.0, 1.0);
    faultless("reservoir_m", "m", &|day| {
        0.5 * fill(day) + 0.002 * noise[day]
    });
    let season = |day: usize| (day as f64 / 58.0).sin();
    faultless("pool_m", "m", &|day| 15.0 * season(day) + 0.05 * noise[day]);
    // A river rises for good.
    faultless("river_m3_s", "m3_s", &|day| {
        100.0 + 80.0 * since(200, day) + noise[day]
    });
    let shower = |day: usize| {
        if noise[day] > 1.5 {
            20.0 * noise[day]
        } else {
            0.0
        }
    };
    faultless("rain_mm", "mm", &shower);
}

#[test]
fn what_is_stated_of_a_channel_stands_over_its_dry_spells() {
    let value = |day: usize| match day {
        100..300 => 0.0,
        350 => 400.0,
        _ => 50.0 + noise(5)[day],
    };
    let mut gauge = channel("gauge_3", "m", &days(4, value));
    let nothing = readings(Unit::MM, &[]);
    let faults = |one: &Channel| found(&inspect(&nothing, std::slice::from_ref(one)));
    assert_eq!(faults(&gauge), [], "what stands at zero for long is rain");
    gauge.stated = Some(CovariateKind::Humidity);
    assert!(faults(&gauge).contains(&(FaultKind::OutOfRange, day(350))));
}

#[test]
fn one_reset_seen_makes_a_smaller_one_beside_it_believed() {
    let (quiet, loud) = (walk(7), walk(8));
    let smaller = channel(
        "creek_m",
        "m",
        &days(4, |day| 0.02 * loud[day] + 0.17 * since(200, day)),
    );
    let larger = channel(
        "lake_m",
        "m",
        &days(4, |day| 0.01 * quiet[day] - 0.6 * since(200, day)),
    );
    let none = readings(Unit::MM, &[]);
    let alone = inspect(&none, std::slice::from_ref(&smaller));
    let together = inspect(&none, &[smaller, larger]);
    assert_eq!(alone.faults, []);
    let at = [(FaultKind::Reset, day(200)); 2];
    assert_eq!(found(&together), at);
}

#[test]
fn a_raw_logger_beside_its_corrected_values_shows_even_its_smallest_reset() {
    let walk = walk(9);
    let level = |day: usize| 2.0 + 0.02 * walk[day];
    let corrected = channel("lake_level_m", "m", &days(4, level));
    let raw = channel(
        "lake_raw_m",
        "m",
        &days(4, |day| {
            level(day) - 0.6 * since(100, day) + 0.01 * since(300, day)
        }),
    );
    let inspected = inspect(&readings(Unit::MM, &[]), &[corrected.clone(), raw]);
    let at = [day(100), day(300)].map(|time| (FaultKind::Reset, time));
    assert_eq!(found(&inspected), at);
    let of_raw = |fault: &Fault| fault.channel.as_deref() == Some("lake_raw_m");
    assert!(inspected.faults.iter().all(of_raw));
    let sizes: Vec<f64> = inspected.faults.iter().filter_map(|f| f.size).collect();
    assert!(
        (sizes[0] - 0.6).abs() < 1e-3 && (sizes[1] + 0.01).abs() < 1e-3,
        "{sizes:?}"
    );
    for (a, b) in inspected.channels[1].samples.iter().zip(&corrected.samples) {
        assert!((a.value - b.value).abs() < 1e-3, "{a:?} {b:?}");
    }
    assert!(
        inspected
            .remarks
            .iter()
            .any(|remark| remark.contains("one instrument"))
    );
}

#[test]
fn a_copied_block_goes_with_the_channel_values_copied_with_it() {
    let (noise, rain) = (noise(10), noise(11));
    let source = |day: usize| {
        if (300..304).contains(&day) {
            day - 150
        } else {
            day
        }
    };
    let series = readings(
        Unit::MM,
        &days(1, |day| {
            0.1 * day as f64 + 3.0 * noise[source(day)] - 0.1 * (day - source(day)) as f64
        }),
    );
    let rain = channel(
        "rain_mm",
        "mm",
        &days(1, |day| (30.0 * rain[source(day)]).max(0.0)),
    );
    let inspected = inspect(&series, &[rain]);
    let [first] = inspected.faults.as_slice() else {
        panic!("{:?}", inspected.faults);
    };
    assert_eq!((first.kind, first.at), (FaultKind::RepeatedRows, day(300)));
    assert_eq!(
        (first.until, first.copy_of),
        (Some(day(303)), Some(day(150)))
    );
    assert_eq!(inspected.series.readings.len(), COUNT - 4);
    let wet = (150..154).filter(|&day| noise_is_wet(day)).count();
    assert!(wet > 0);
    assert_eq!(inspected.channels[0].samples.len(), COUNT - wet);
    assert_eq!(inspected.flags, ["repeated-rows"]);
}

#[test]
fn a_row_of_a_coarse_reading_is_a_copy_where_all_channels_agree_and_none_where_the_reading_alone_does()
 {
    let noises = [30, 31, 32, 33].map(noise);
    let [noise, rain, level, heat] = &noises;
    let copied = |day: usize| if day == 300 { 150 } else { day };
    let series = readings(Unit::MM, &days(1, |day| 20.0 * noise[copied(day)]));
    let with = |source: &dyn Fn(usize) -> usize| {
        let channels = [
            channel(
                "rain_mm",
                "mm",
                &days(2, |day| (30.0 * rain[source(day)]).abs()),
            ),
            channel(
                "level_m",
                "m",
                &days(2, |day| 150.0 + 10.0 * level[source(day)]),
            ),
            channel("air_c", "c", &days(2, |day| 10.0 * heat[source(day)])),
        ];
        inspect(&series, &channels)
    };
    let full = with(&copied);
    assert_eq!(found(&full), [(FaultKind::RepeatedRows, day(300))]);
    assert_eq!(full.faults[0].copy_of, Some(day(150)));
    assert!(
        full.channels
            .iter()
            .all(|one| one.samples.len() == COUNT - 1)
    );
    assert_eq!(with(&|day| day).faults, []);
}

/// Whether the rain of the copied block falls then.
fn noise_is_wet(day: usize) -> bool {
    noise(11)[day] > 0.002
}

#[test]
fn equal_values_of_a_coarse_instrument_are_no_copies() {
    let (noise, rain) = (noise(12), noise(13));
    let series = readings(Unit::MM, &days(0, |day| 3.0 * noise[day]));
    let channels = [
        channel("rain_mm", "mm", &days(0, |day| (5.0 * rain[day]).max(0.0))),
        channel("flow_cfs", "cfs", &days(0, |day| 140.0 + rain[day])),
        // Follows the readings, so that equal readings go with equal temperatures.
        channel("rock_c", "c", &days(0, |day| 10.0 + 3.0 * noise[day])),
        channel(
            "tide_m",
            "m",
            &days(6, |day| (day as f64 * 0.1 * std::f64::consts::PI).sin()),
        ),
    ];
    assert_eq!(inspect(&series, &channels).faults, []);
}

#[test]
fn a_stuck_instrument_keeps_only_its_first_value() {
    let noise = noise(14);
    let stuck = |day: usize| if (200..220).contains(&day) { 200 } else { day };
    let inspected = inspect_displacement(2, |day| noise[stuck(day)]);
    assert_eq!(found(&inspected), [(FaultKind::Stuck, day(200))]);
    assert_eq!(inspected.faults[0].values, 20);
    assert_eq!(inspected.series.readings.len(), COUNT - 19);
}

#[test]
fn a_slope_at_rest_is_not_stuck() {
    let noise = noise(15);
    // A crackmeter read to 0.1 mm moves by 4 mm in a month and rests for half a year.
    let creep = |day: usize| {
        4.0 * (day as f64 - 50.0).clamp(0.0, 30.0) / 30.0
            + 4.0 * (day as f64 - 300.0).clamp(0.0, 30.0) / 30.0
    };
    assert_eq!(
        inspect_displacement(1, |day| creep(day) + 0.02 * noise[day]).faults,
        []
    );
    // The same read finely by an instrument without noise, moving by jerks.
    let jerks: Vec<f64> = noise.iter().map(|z| 2.0 * z.abs()).collect();
    let slip = |day: usize| {
        let moves = |day: &usize| (day / 60).is_multiple_of(2);
        (0..=day).filter(moves).map(|day| jerks[day]).sum::<f64>()
    };
    assert_eq!(inspect_displacement(1, slip).faults, []);
    let dry = inspect_channel("river_cfs", "cfs", |day| (140.0 + 0.3 * noise[day]).round());
    assert_eq!(dry.faults, []);
}

#[test]
fn a_reading_far_off_that_comes_back_is_taken_out() {
    let noise = noise(16);
    let spike = |day: usize| if day == 200 { 25.0 } else { 0.0 };
    let inspected = inspect_displacement(2, |day| 0.1 * day as f64 + noise[day] + spike(day));
    assert_eq!(found(&inspected), [(FaultKind::Outlier, day(200))]);
    assert_eq!(inspected.series.readings.len(), COUNT - 1);
    let pair = |day: usize| {
        if (200..202).contains(&day) {
            -30.0
        } else {
            0.0
        }
    };
    let inspected = inspect_displacement(2, |day| noise[day] + pair(day));
    assert_eq!(found(&inspected), [(FaultKind::Outlier, day(200))]);
    assert_eq!(inspected.faults[0].values, 2);
}

#[test]
fn what_the_ground_did_is_no_outlier() {
    let noise = noise(17);
    let step = inspect_displacement(2, |day| noise[day] + 200.0 * since(200, day));
    assert_eq!(step.faults, []);
    let newest = inspect_displacement(2, |day| noise[day] + 200.0 * since(COUNT - 1, day));
    assert_eq!(newest.faults, []);
    let left = |day: usize| 402.0 - day as f64;
    let failing = inspect_displacement(2, |day| -500.0 * left(day).ln() + noise[day]);
    assert_eq!(failing.faults, []);
    for seed in 100..130 {
        let relative = self::noise(seed);
        let speed = |day: usize| 500.0 / left(day) * (0.3 * relative[day]).exp();
        let failing = inspect(&readings(Unit::MM_PER_DAY, &days(3, speed)), &[]);
        assert_eq!(failing.faults, [], "{seed}");
    }
    // Rain sets off a burst that dies down within days.
    let burst = |day: usize| 40.0 * since(200, day) * (-(day as f64 - 200.0) / 2.0).exp();
    let speed = |day: usize| 5.0 + 0.2 * noise[day] + burst(day);
    let raining = inspect(&readings(Unit::MM_PER_DAY, &days(3, speed)), &[]);
    assert_eq!(raining.faults, []);
}

#[test]
fn many_far_readings_are_heavy_tails_and_stay() {
    let noise = noise(18);
    let tails = |day: usize| if day % 30 == 15 { 40.0 } else { 0.0 };
    let inspected = inspect_displacement(2, |day| noise[day] + tails(day));
    assert_eq!(inspected.series.readings.len(), COUNT);
}

#[test]
fn codes_and_impossible_values_are_taken_out() {
    let noise = noise(19);
    let code = |value: f64, day: usize| {
        if (200..203).contains(&day) {
            -9999.0
        } else {
            value
        }
    };
    let inspected = inspect_displacement(2, |day| code(noise[day], day));
    assert_eq!(found(&inspected), [(FaultKind::OutOfRange, day(200))]);
    assert_eq!(inspected.faults[0].size, Some(-9999.0));
    let wet = |day: usize| if noise[day] > 1.0 { noise[day] } else { 0.0 };
    let rain = inspect_channel(
        "rain_mm",
        "mm",
        |day| if day == 100 { -0.5 } else { wet(day) },
    );
    assert_eq!(found(&rain), [(FaultKind::OutOfRange, day(100))]);
    assert_eq!(rain.channels[0].samples.len(), COUNT - 1);
}

#[test]
fn straight_lines_and_noiseless_curves_are_flagged_and_kept() {
    let walk = walk(21);
    let lines = |day: usize| {
        let from = day / 10 * 10;
        let to = (from + 10).min(COUNT - 1);
        let share = (day - from) as f64 / (to - from).max(1) as f64;
        walk[from] + share * (walk[to] - walk[from])
    };
    let curve = |day: usize| 50.0 * (day as f64 / 20.0).sin();
    for inspected in [
        inspect_displacement(3, lines),
        inspect_displacement(5, curve),
    ] {
        assert_eq!(inspected.flags, ["interpolated"]);
        assert_eq!(inspected.series.readings.len(), COUNT);
        assert!(
            inspected.remarks[0].contains("worth little"),
            "{:?}",
            inspected.remarks
        );
    }
}

#[test]
fn a_good_instrument_on_a_slope_that_speeds_up_is_not_interpolated() {
    let noise = noise(22);
    // From 0 to 40 mm a day, read to 0.1 mm.
    let slip = |day: usize| 0.05 * (day as f64).powi(2) + 0.1 * noise[day];
    assert_eq!(inspect_displacement(2, slip).flags, Vec::<String>::new());
}

#[test]
fn a_tide_that_comes_round_to_the_same_digits_is_no_copy() {
    let tide = |day: usize| (day as f64 / 150.0 * std::f64::consts::TAU).sin();
    assert_eq!(inspect_channel("tide_m", "m", tide).faults, []);
}

#[test]
fn nothing_and_little_are_inspected_too() {
    for count in 0..8 {
        let rows = &days(1, |day| day as f64)[..count];
        let one = channel("lake_m", "m", rows);
        let inspected = inspect(&readings(Unit::MM, rows), std::slice::from_ref(&one));
        assert_eq!((inspected.faults, inspected.channels), (vec![], vec![one]));
    }
}
