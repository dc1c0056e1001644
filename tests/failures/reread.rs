//! What a reload changes of the meaning of readings, and which benchmarks it takes from files that have been read already.

use crate::site::{Program, Site, eventually};
use crate::telling::failing;
use nix::sys::signal::Signal;
use std::fs;

const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";
const THRESHOLD: &str = "[[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";

fn benchmark(id: &str, keys: &str) -> String {
    format!("[[benchmark]]\nid = \"{id}\"\nsource = \"logger\"\n{keys}\n")
}

/// Two benchmarks in one file: `a` creeps, and `b` fails.
fn both() -> String {
    let rows = failing(0..114);
    let each = rows.lines().zip(0_u32..).map(|(line, hour)| {
        let (time, value) = line.split_once(',').unwrap();
        format!("{time},{:.2},{value}\n", 0.07 * f64::from(hour))
    });
    "time,a_displacement_mm,b_displacement_mm\n".to_owned() + &each.collect::<String>()
}

fn reload(site: &Site, program: &Program, more: &str) {
    let taken = site.log().matches("the config is taken").count();
    site.configure(more);
    program.signal(Signal::SIGHUP);
    eventually("the config", || {
        site.log().matches("the config is taken").count() > taken
    });
}

#[test]
fn a_benchmark_that_the_config_adds_has_the_past_that_its_file_holds() {
    for restarts in [false, true] {
        let a = benchmark("a", "");
        let site = Site::new(&format!("{a}{POLICY}"));
        site.append("incoming/x.csv", &both());
        let mut program = site.caught_up();
        eventually("a's readings", || site.values().len() >= 114);
        let with_b = format!("{a}{}{POLICY}", benchmark("b", ""));
        if restarts {
            program.stop();
            site.configure(&with_b);
            program = site.start(&[]);
        } else {
            reload(&site, &program, &with_b);
        }
        eventually("b's red", || site.notified("b/red/", "firing") == 1);
        program.stop();
        site.proven_events();
    }
}

#[test]
fn a_benchmark_that_is_taken_out_and_put_back_is_as_red_as_before() {
    let with_b = format!("{}{}{POLICY}", benchmark("a", ""), benchmark("b", ""));
    let site = Site::new(&with_b);
    site.append("incoming/x.csv", &both());
    let program = site.caught_up();
    eventually("b's red", || site.notified("b/red/", "firing") == 1);
    reload(&site, &program, &format!("{}{POLICY}", benchmark("a", "")));
    eventually("its end", || site.notified("b/red/", "resolved") == 1);
    reload(&site, &program, &with_b);
    eventually("its red again", || site.notified("b/red/2/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn readings_that_mean_something_else_are_taken_anew_and_call_no_false_red() {
    for (before, now) in [
        (
            "column = \"p1_mm\"\nunit = \"mm\"",
            "column = \"p2_mm\"\nunit = \"mm\"",
        ),
        (
            "components = [\"p1_mm\"]\ndirection = [1.0]",
            "components = [\"p1_mm\"]\ndirection = [-1.0]",
        ),
        (
            "column = \"p1\"\nunit = \"mm\"",
            "column = \"p1\"\nunit = \"cm\"",
        ),
    ] {
        let site = Site::new(&format!("{}{POLICY}{THRESHOLD}", benchmark("5", before)));
        let names = if before.contains("\"p1\"") {
            "p1,p2"
        } else {
            "p1_mm,p2_mm"
        };
        let rows = failing(0..114);
        let rows = rows.lines().zip(0_u32..).map(|(line, hour)| {
            let (time, _) = line.split_once(',').unwrap();
            let creep = 0.083 * f64::from(hour);
            format!("{time},{:.3},{:.3}\n", creep - 1000.0, creep - 800.0)
        });
        let rows: Vec<String> = rows.collect();
        site.append(
            "incoming/x.csv",
            &format!("time,{names}\n{}", rows[..112].concat()),
        );
        let program = site.caught_up();
        eventually("the readings", || site.values().len() >= 112);
        reload(
            &site,
            &program,
            &format!("{}{POLICY}{THRESHOLD}", benchmark("5", now)),
        );
        site.append("incoming/x.csv", &rows[112..].concat());
        eventually("all of them anew", || site.values().len() >= 112 + 114);
        program.stop();
        let events = site.proven_events();
        assert_eq!(site.notified("5/red/", ""), 0, "{now}: {events}");
        assert_eq!(
            events.matches("\"read-anew\"").count(),
            1,
            "{now}: {events}"
        );
        assert!(!events.contains("its unit was"), "{now}: {events}");
    }
}

/// A reload says in other words what is read, with the same numbers: where the file is there its rows come again, and where it is not
/// nothing comes that could call the red again.
#[test]
fn a_red_stands_through_a_reload_that_reads_its_readings_otherwise() {
    for stays in [true, false] {
        let site = Site::new(&format!("{}{POLICY}", benchmark("b", "")));
        let header = "time,b_displacement_mm\n";
        site.append("incoming/x.csv", &format!("{header}{}", failing(0..112)));
        let program = site.caught_up();
        eventually("b's red", || site.notified("b/red/", "firing") == 1);
        let taken = site.values().len();
        if !stays {
            fs::remove_file(site.path("incoming/x.csv")).unwrap();
        }
        let other = benchmark("b", "column = \"b_displacement_mm\"\nunit = \"mm\"");
        reload(&site, &program, &format!("{other}{POLICY}"));
        let anew = if stays { 112 } else { 0 };
        eventually("its rows", || site.values().len() == taken + anew);
        assert_eq!(site.level("b"), "red", "stays: {stays}");
        // One more reading, the first of the new meaning where the file is gone.
        site.append("incoming/y.csv", &format!("{header}{}", failing(112..114)));
        eventually("the newest", || site.values().len() == taken + anew + 2);
        assert_eq!(site.level("b"), "red", "stays: {stays}");
        program.stop();
        let events = site.proven_events();
        assert_eq!(site.notified("b/red/", "firing"), 1, "{stays}: {events}");
        assert_eq!(site.notified("b/red/", "resolved"), 0, "{stays}: {events}");
        assert_eq!(events.matches("\"read-anew\"").count(), 1, "{events}");
    }
}

#[test]
fn a_threshold_that_is_lowered_is_called_by_the_newest_reading() {
    let high = THRESHOLD.replace("50", "5000");
    let site = Site::new(&format!("{POLICY}{high}"));
    let slow = |hour: i32| {
        let time = failing(hour..hour + 1);
        let (time, _) = time.trim().split_once(',').unwrap();
        format!("{time},80\n")
    };
    let rows: String = (100..114).map(slow).collect();
    site.append(
        "incoming/5.csv",
        &format!("time,velocity_mm_per_day\n{rows}"),
    );
    let program = site.caught_up();
    eventually("the readings", || site.values().len() == 14);
    assert_eq!(site.notified("5/red/", ""), 0);
    reload(&site, &program, &format!("{POLICY}{THRESHOLD}"));
    eventually("the red", || site.notified("5/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn rows_out_of_order_come_anew_with_the_others_also_after_a_restart() {
    let with_b = format!("{}{}{POLICY}", benchmark("a", ""), benchmark("b", ""));
    let site = Site::new(&with_b);
    let text = both();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.swap(50, 51);
    lines.swap(80, 84);
    site.append("incoming/x.csv", &(lines.join("\n") + "\n"));
    let program = site.caught_up();
    let of = |name: &str| {
        let values = site.values().into_iter();
        values.filter(|(id, ..)| id == name).count()
    };
    eventually("all readings", || (of("a"), of("b")) == (114, 114));
    reload(&site, &program, &format!("{}{POLICY}", benchmark("a", "")));
    program.stop();
    site.caught_up().stop();
    site.configure(&with_b);
    let program = site.caught_up();
    eventually("b's anew", || of("b") == 228);
    program.stop();
    // What was known before counts no second time.
    site.caught_up().stop();
    assert_eq!((of("a"), of("b")), (114, 228));
    site.proven_events();
}
