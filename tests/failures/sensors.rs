//! Sensors that fail without falling silent.

use crate::notified::failing;
use crate::site::{Program, Site, eventually, get};
use jiff::SignedDuration;
use slipwatch::runtime::clock;
use std::time::Duration;

const HEADER: &str = "time,displacement_mm\n";
const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

fn changed(rows: &str, change: impl Fn(usize, f64) -> f64) -> String {
    let each = rows.lines().enumerate().map(|(number, line)| {
        let (time, value) = line.split_once(',').unwrap();
        format!("{time},{:.4}\n", change(number, value.parse().unwrap()))
    });
    each.collect()
}

/// A site whose benchmark 5 is at red 30 hours ago.
fn at_red(more: &str) -> (Site, Program) {
    let site = Site::new(&format!("{POLICY}{more}"));
    let earlier = |text: String| {
        let each = text.lines().map(|line| {
            let (time, value) = line.split_once(',').unwrap();
            let time: jiff::Timestamp = time.parse().unwrap();
            format!("{},{value}\n", time - SignedDuration::from_hours(30))
        });
        each.collect::<String>()
    };
    site.append(
        "incoming/5.csv",
        &format!("{HEADER}{}", earlier(failing(0..114))),
    );
    let program = site.caught_up();
    eventually("a red", || site.notified("5/red/", "firing") == 1);
    (site, program)
}

/// After a red the sensor gives `value` at so many hours before now.
fn is_unknown_and_stays_red(value: impl Fn(i64) -> f64) {
    let (site, program) = at_red("");
    for hour in (0..30).rev() {
        let time = clock::now() - SignedDuration::from_hours(hour);
        site.append("incoming/5.csv", &format!("{time},{:.4}\n", value(hour)));
    }
    eventually("unknown", || site.events().contains("stuck-sensor"));
    eventually("everything", || site.values().len() == 144);
    program.stop();
    let events = site.proven_events();
    assert_eq!(site.notified("5/red/", "resolved"), 0, "{events}");
    assert!(site.notified("5/unknown/", "firing") >= 1, "{events}");
}

/// The last one before.
fn last_value() -> f64 {
    200.0 * (120.0_f64 / 7.0).ln()
}

#[test]
fn a_sensor_that_repeats_its_value_after_a_red_is_unknown_and_the_red_stays() {
    is_unknown_and_stays_red(|_| last_value());
}

#[test]
fn a_sensor_that_jitters_at_the_end_of_its_range_after_a_red_is_unknown_and_the_red_stays() {
    is_unknown_and_stays_red(|hour| last_value() + 10.0 + 0.01 * ((hour * 7) % 5) as f64);
}

fn spoils(change: impl Fn(usize, f64) -> f64) {
    let site = Site::new(POLICY);
    site.append("incoming/5.csv", HEADER);
    let program = site.caught_up();
    site.append("incoming/5.csv", &changed(&failing(0..114), change));
    eventually("unknown", || site.notified("5/unknown/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn a_benchmark_with_each_third_reading_spoilt_is_unknown() {
    spoils(|number, value| {
        if number % 3 == 0 {
            value + 300.0
        } else {
            value
        }
    });
}

#[test]
fn a_benchmark_whose_readings_alternate_in_sign_is_unknown() {
    spoils(|number, value| if number % 2 == 0 { -value } else { value });
}

/// Between 0 and 1, the same each time.
fn drawn(number: usize) -> f64 {
    let mixed = u32::try_from(number).unwrap().wrapping_mul(2_654_435_761) ^ 0x9e37_79b9;
    f64::from(mixed.wrapping_mul(2_246_822_519) >> 8) / f64::from(1_u32 << 24)
}

#[test]
fn a_benchmark_of_which_half_of_the_readings_lie_anywhere_is_unknown() {
    spoils(|number, value| {
        let is_wild = number >= 60 && drawn(number + 3001) < 0.5;
        value + f64::from(u8::from(is_wild)) * 600.0 * (drawn(number + 7001) - 0.5)
    });
}

#[test]
fn a_benchmark_that_gave_one_velocity_and_then_displacements_is_unknown() {
    let site = Site::new(POLICY);
    let now = clock::now();
    let rows: String = failing(1..114)
        .lines()
        .map(|line| {
            let (time, value) = line.split_once(',').unwrap();
            format!("{time},{value},\n")
        })
        .collect();
    let first = now - SignedDuration::from_hours(113);
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm,velocity_mm_per_day\n{first},,3\n{rows}"),
    );
    let program = site.caught_up();
    eventually("unknown", || site.notified("5/unknown/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn a_cell_that_is_no_number_hides_no_other_value_of_its_row() {
    // A rain gauge that fails beside a slope that moves, and one sensor beside another.
    for (header, row, fault) in [
        ("5_velocity_mm_per_day,rain_mm", "80,ERR", ""),
        (
            "4_velocity_mm_per_day,5_velocity_mm_per_day",
            "ERR,80",
            "benchmark 4: no reading",
        ),
    ] {
        let threshold = "[[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";
        let site = Site::new(&format!("{POLICY}{threshold}"));
        site.append("incoming/x.csv", &format!("time,{header}\n"));
        let at = |hours| clock::now() - SignedDuration::from_hours(hours);
        for hours in (10..24).rev() {
            site.append("incoming/x.csv", &format!("{},1,1\n", at(hours)));
        }
        let program = site.caught_up();
        for hours in (0..10).rev() {
            site.append("incoming/x.csv", &format!("{},{row}\n", at(hours)));
        }
        eventually("a red", || site.notified("5/red/", "firing") == 1);
        eventually("the rest", || {
            site.values().iter().filter(|one| one.0 == "5").count() == 24
        });
        program.stop();
        let events = site.proven_events();
        assert!(events.contains(fault), "{events}");
        let log = site.log();
        assert!(log.contains("ERR"), "the line is in quarantine: {log}");
    }
}

/// The readings that end an outage were measured before the alarm that it gave.
#[test]
fn a_benchmark_that_reads_again_with_a_backlog_is_unknown_nowhere() {
    let site = Site::new("");
    let address = site.listen();
    let start = clock::now() - SignedDuration::from_hours(240);
    let row = |hour: i64| {
        let moved = 0.1 * hour as f64 + 0.05 * (1.7 * hour as f64).sin();
        format!("{},{moved:.3}\n", start + SignedDuration::from_hours(hour))
    };
    let before: String = (0..200).map(row).collect();
    site.append("incoming/5.csv", &format!("{HEADER}{before}"));
    let program = site.caught_up();
    eventually("unknown", || site.notified("5/unknown/", "firing") == 1);
    let backlog: String = (200..240).map(row).collect();
    site.append("incoming/5.csv", &backlog);
    eventually("its end", || site.notified("5/unknown/", "resolved") == 1);
    let status = || site.printed(&["status", "--config", "site.toml", "--format", "json"]);
    let is_known = || {
        let listed = site.printed(&["alerts", "list", "--config", "site.toml"]);
        !status().contains("\"is_unknown\":true")
            && !listed.contains("unknown")
            && get(&address, "/api/site").contains("\"is_unknown\":false")
    };
    eventually("known again", is_known);
    program.stop();
    let program = site.caught_up();
    assert!(is_known(), "{}", status());
    program.stop();
    site.proven_events();
}

/// A file that is copied into a running daemon while it is written: nothing else shows what time it is.
#[test]
fn what_is_written_into_a_running_daemon_and_ends_days_ago_is_unknown() {
    let site = Site::new("");
    let start = clock::now() - SignedDuration::from_hours(300);
    let row = |hour: i64| {
        let moved = 0.1 * hour as f64 + 0.05 * (1.7 * hour as f64).sin();
        format!("{},{moved:.3}\n", start + SignedDuration::from_hours(hour))
    };
    let program = site.caught_up();
    site.append("incoming/5.csv", HEADER);
    for first in (0..200).step_by(20) {
        let block: String = (first..first + 20).map(row).collect();
        site.append("incoming/5.csv", &block);
        std::thread::sleep(Duration::from_millis(200));
    }
    eventually("all of it", || site.values().len() == 200);
    eventually("unknown", || site.notified("5/unknown/", "firing") == 1);
    let rest: String = (200..300).map(row).collect();
    site.append("incoming/5.csv", &rest);
    eventually("its end", || site.notified("5/unknown/", "resolved") == 1);
    program.stop();
    site.proven_events();
}

/// 14.
#[test]
fn steady_creep_is_reported_as_neither_orange_nor_red() {
    let site = Site::new("");
    let start = clock::now() - SignedDuration::from_hours(400);
    for benchmark in 5..8 {
        let seed = 100_003 * benchmark;
        let rows: String = (0..400)
            .map(|hour| {
                // 2.4 mm/day, with a noise of .3 mm.
                let noise: f64 = (0..12).map(|part| drawn(seed + 12 * hour + part)).sum();
                let time = start + SignedDuration::from_hours(i64::try_from(hour).unwrap());
                format!("{time},{:.3}\n", 0.1 * hour as f64 + 0.3 * (noise - 6.0))
            })
            .collect();
        site.append(
            &format!("incoming/{benchmark}.csv"),
            &format!("{HEADER}{rows}"),
        );
    }
    let program = site.caught_up();
    eventually("everything", || site.values().len() == 1200);
    program.stop();
    let events = site.proven_events();
    for benchmark in 5..8 {
        for level in ["orange", "red"] {
            let key = format!("{benchmark}/{level}/");
            assert_eq!(site.notified(&key, "firing"), 0, "{key}: {events}");
        }
    }
}
