//! Exports that are issued again, whole and in any order, and what a reload changes of what is called.

use crate::notified::failing;
use crate::reread::{FAR, HEADER, POLICY, THRESHOLD, benchmark, reload, rows_of};
use crate::site::{Site, eventually};
use jiff::SignedDuration;
use slipwatch::runtime::clock;
use std::fs;

/// An export of so many hourly rows of slow creep.
fn export(rows: i32, zero: f64, is_newest_first: bool) -> String {
    let rows = rows_of(rows, |row| zero + 0.01 * f64::from(row));
    let mut lines: Vec<&str> = rows.lines().collect();
    if is_newest_first {
        lines.reverse();
    }
    format!("{HEADER}{}\n", lines.join("\n"))
}

/// The file of `b` is replaced by one that holds `text`, of so many rows.
fn replaced(site: &Site, text: &str, rows: usize) {
    site.append("new", text);
    let known = site.values().len();
    fs::rename(site.path("new"), site.path("incoming/b.csv")).unwrap();
    eventually("them anew", || site.values().len() >= known + rows);
}

fn watched(more: &str) -> Site {
    Site::new(&format!("{}{POLICY}{more}", benchmark("b", "")))
}

#[test]
fn an_export_that_is_issued_again_with_another_zero_calls_no_red() {
    // Also one that is read in several pieces, and one with its newest row on top.
    for (rows, is_newest_first) in [(100, false), (700, false), (200, true), (700, true)] {
        let site = watched(FAR);
        let count = usize::try_from(rows).unwrap();
        site.append("incoming/b.csv", &export(rows, 100.0, is_newest_first));
        let program = site.caught_up();
        eventually("the readings", || site.values().len() >= count);
        for zero in [20.0, 180.0] {
            let text = export(rows, zero, is_newest_first);
            let one_more = format!(
                "{HEADER}{},{}\n",
                clock::now(),
                zero + 0.01 * f64::from(rows)
            );
            let text = if is_newest_first {
                text.replacen(HEADER, &one_more, 1)
            } else {
                text
            };
            replaced(&site, &text, count);
        }
        let more = format!("{},180.5\n", clock::now());
        if !is_newest_first {
            site.append("incoming/b.csv", &more);
            eventually("one more", || site.values().len() > 3 * count);
        }
        program.stop();
        assert_eq!(site.notified("b/red/", ""), 0, "{rows}: {}", site.events());
        site.proven_events();
    }
}

#[test]
fn an_export_with_another_zero_that_comes_while_the_history_is_judged_calls_no_red_of_the_past() {
    let site = watched(FAR);
    site.append("incoming/b.csv", &export(900, 100.0, false));
    let program = site.caught_up();
    eventually("some of the history", || {
        site.events().contains("\"refit\"")
    });
    replaced(&site, &export(900, 180.0, false), 900);
    let is_judged = || {
        site.log()
            .contains("before the first start has been judged")
    };
    eventually("the history", is_judged);
    program.stop();
    assert_eq!(site.notified("b/red/", ""), 0, "{}", site.events());
    let events = site.events();
    let refits = events
        .lines()
        .filter(|line| line.contains("\"event\":\"refit\""));
    let time = |line: &str| {
        let event: serde_json::Value = serde_json::from_str(line).unwrap();
        event["time"].as_str().unwrap().to_owned()
    };
    let mut times: Vec<String> = refits.map(time).collect();
    times.sort();
    // The newest reading was judged before and after it was corrected.
    let newest = times.last().cloned();
    times.retain(|time| Some(time) != newest.as_ref());
    assert!(
        times.windows(2).all(|two| two[0] != two[1]),
        "twice: {times:?}"
    );
    assert!(times.len() > 100, "{events}");
    site.proven_events();
}

#[test]
fn an_upload_with_its_newest_row_on_top_calls_what_is_due_in_its_middle() {
    let site = Site::new(&format!(
        "{}[alert]\nevacuation_time = \"24h\"\n{THRESHOLD}",
        benchmark("b", "")
    ));
    // Each ten minutes; fast for five hours, and slow again for less than an evacuation time: in order of time it is red at the end.
    let now = clock::now();
    let mut moved = 0.0;
    let rows: Vec<String> = (0..544)
        .map(|row| {
            moved += if (460..490).contains(&row) { 60.0 } else { 1.0 } / 144.0;
            let time = now - SignedDuration::from_mins(10 * (543 - row));
            format!("{time},{:.3}", moved + (row * 37 % 11) as f64 / 1000.0)
        })
        .collect();
    let newest_first = |rows: &[String]| {
        let rows: Vec<&str> = rows.iter().rev().map(String::as_str).collect();
        format!("{HEADER}{}\n", rows.join("\n"))
    };
    site.append("incoming/b.csv", &newest_first(&rows[..400]));
    let program = site.caught_up();
    eventually("that the past is judged", || {
        site.log()
            .contains("before the first start has been judged")
    });
    replaced(&site, &newest_first(&rows), 144);
    eventually("the red", || site.notified("b/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn a_critical_velocity_that_is_lowered_is_judged_at_once() {
    let limit = |text: &str| format!("critical_velocity = \"{text}\"\n");
    let site = Site::new(&format!("{POLICY}{}", limit("5 m/day")));
    let rows = rows_of(200, |row| {
        8.0 * f64::from(row) + f64::from(row * 37 % 11) / 10.0
    });
    site.append("incoming/5.csv", &format!("time,displacement_mm\n{rows}"));
    let program = site.caught_up();
    eventually("that the past is judged", || {
        site.log()
            .contains("before the first start has been judged")
    });
    assert_eq!(site.values().len(), 200);
    assert_eq!(site.notified("5/red/", ""), 0, "{}", site.events());
    reload(&site, &program, &format!("{POLICY}{}", limit("0.1 m/day")));
    eventually("the red", || site.notified("5/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

/// A red of readings within maintenance that is withdrawn is dated by these, and not by the one before it.
#[test]
fn a_red_that_withdrawn_maintenance_had_hidden_has_the_time_of_its_reading() {
    let hours = |count: i64| clock::now() + SignedDuration::from_hours(count);
    let maintenance = format!(
        "[[event]]\nkind = \"maintenance\"\ntime = \"{}\"\nuntil = \"{}\"\n",
        hours(-20),
        hours(1)
    );
    let site = watched(&format!("{FAR}{maintenance}"));
    let rows = rows_of(60, |row| {
        0.01 * f64::from(row) + if row > 50 { 100.0 } else { 0.0 }
    });
    site.append("incoming/b.csv", &format!("{HEADER}{rows}"));
    let program = site.caught_up();
    eventually("the readings", || site.values().len() >= 60);
    assert_eq!(site.notified("b/red/", ""), 0);
    let without = format!("{}{POLICY}{FAR}", benchmark("b", ""));
    reload(&site, &program, &without);
    let newest = failing(113..114);
    let (newest, _) = newest.split_once(',').unwrap();
    eventually("the red", || {
        site.notified(&format!("b/red/{newest}"), "firing") == 1
    });
    program.stop();
    site.proven_events();
}
