//! What a reload changes of the meaning of readings, and which benchmarks it takes from files that have been read already.

use crate::notified::failing;
use crate::site::{Program, Site, eventually};
use jiff::SignedDuration;
use nix::sys::signal::Signal;
use slipwatch::runtime::clock;
use std::fs;

pub(crate) const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";
pub(crate) const HEADER: &str = "time,b_displacement_mm\n";
pub(crate) const THRESHOLD: &str =
    "[[alert.threshold]]\nlevel = \"red\"\nvelocity = \"50 mm/day\"\n";

pub(crate) fn benchmark(id: &str, keys: &str) -> String {
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

/// A site whose only benchmark, `b`, is red; two more of its hourly readings are due.
fn red() -> (Site, Program) {
    let site = Site::new(&format!("{}{POLICY}", benchmark("b", "")));
    site.append("incoming/x.csv", &format!("{HEADER}{}", failing(0..112)));
    let program = site.caught_up();
    eventually("b's red", || site.notified("b/red/", "firing") == 1);
    (site, program)
}

pub(crate) fn reload(site: &Site, program: &Program, more: &str) {
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
        let (site, program) = red();
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
        site.append("incoming/y.csv", &format!("{HEADER}{}", failing(112..114)));
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
fn a_benchmark_that_loses_its_name_goes_on_where_its_source_is_open() {
    let (site, program) = red();
    let taken = site.values().len();
    reload(&site, &program, POLICY);
    site.append("incoming/x.csv", &failing(112..114));
    eventually("the newest", || site.values().len() == taken + 2);
    assert_eq!(site.level("b"), "red");
    program.stop();
    assert_eq!(site.notified("b/red/", "resolved"), 0);
    site.proven_events();
}

#[test]
fn another_source_is_another_instrument_and_its_zero_is_no_motion() {
    let second = "[[source]]\nid = \"second\"\nkind = \"csv\"\npath = \"second/*.csv\"\n";
    let of = |source: &str| {
        format!("[[benchmark]]\nid = \"b\"\nsource = \"{source}\"\n{second}{POLICY}{THRESHOLD}")
    };
    let site = Site::new(&of("logger"));
    fs::create_dir(site.path("second")).unwrap();
    let rows = failing(0..114);
    let rows = rows.lines().zip(0_u32..).map(|(line, hour)| {
        let (time, _) = line.split_once(',').unwrap();
        (time.to_owned(), 0.08 * f64::from(hour))
    });
    let rows: Vec<(String, f64)> = rows.collect();
    let text = |rows: &[(String, f64)], zero: f64| {
        let rows = rows
            .iter()
            .map(|(time, value)| format!("{time},{:.3}\n", zero + value));
        "time,b_displacement_mm\n".to_owned() + &rows.collect::<String>()
    };
    site.append("incoming/x.csv", &text(&rows[..100], 0.0));
    let program = site.caught_up();
    eventually("its readings", || site.values().len() == 100);
    site.append("second/y.csv", &text(&rows[100..], 400.0));
    reload(&site, &program, &of("second"));
    eventually("the other's", || site.values().len() == 114);
    program.stop();
    let events = site.proven_events();
    assert_eq!(site.notified("b/red/", ""), 0, "{events}");
    assert_eq!(events.matches("\"read-anew\"").count(), 1, "{events}");
}

#[test]
fn a_reload_that_leaves_the_hooks_as_they_are_does_not_wait_for_one_that_runs() {
    let slow = "[[hook]]\nrun = [\"/bin/sh\", \"slow.sh\"]\nlevels = [\"red\"]\n\
                timeout = \"60s\"\nbenchmarks = [\"b\"]\n";
    // Nobody listens there; what it takes when it is set up stays as it is.
    let webhook = "[[webhook]]\nurl = \"http://127.0.0.1:9/x\"\nsecret_file = \"webhook.secret\"\nbenchmarks = [\"b\"]\n";
    let slow = format!("{slow}{webhook}");
    let each = format!("{}{}", benchmark("b", ""), benchmark("c", ""));
    let site = Site::new(&format!("{each}{slow}{POLICY}"));
    let script = "touch begun; sleep 15; touch ended\n";
    fs::write(site.path("slow.sh"), script).unwrap();
    fs::write(
        site.path("webhook.secret"),
        "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
    )
    .unwrap();
    let program = site.caught_up();
    let text = |name: &str| format!("time,{name}_displacement_mm\n{}", failing(0..114));
    site.append("incoming/x.csv", &text("b"));
    eventually("its run", || site.path("begun").exists());
    reload(&site, &program, &format!("{each}{slow}{POLICY}"));
    site.append("incoming/y.csv", &text("c"));
    eventually("c's red", || site.notified("c/red/", "firing") == 1);
    assert!(!site.path("ended").exists(), "it waited for the hook");
    eventually("the end of the run", || site.path("ended").exists());
    program.stop();
    site.proven_events();
}

/// The hook of a benchmark's red runs for longer than anybody waits; meanwhile the config loses that hook, gets another one, asks for more of
/// a third, and has the first one back.
#[test]
fn a_reload_that_changes_hooks_does_not_wait_for_one_that_runs_nor_runs_it_twice() {
    let hook = |script: &str, more: &str| {
        format!("[[hook]]\nrun = [\"/bin/sh\", \"{script}\"]\ntimeout = \"60s\"\n{more}\n")
    };
    let each = format!("{}{}", benchmark("b", ""), benchmark("c", ""));
    let slow = hook("slow.sh", "levels = [\"red\"]\nbenchmarks = [\"b\"]");
    let third = |levels: &str| hook("third.sh", &format!("levels = [{levels}]"));
    let site = Site::new(&format!("{each}{slow}{}{POLICY}", third("\"unknown\"")));
    let script = "echo begun >> runs; sleep 12; touch ended\n";
    fs::write(site.path("slow.sh"), script).unwrap();
    for name in ["third", "added"] {
        let script =
            format!("echo $SLIPWATCH_BENCHMARK $SLIPWATCH_LEVEL $SLIPWATCH_STATE >> {name}.runs\n");
        fs::write(site.path(&format!("{name}.sh")), script).unwrap();
    }
    let program = site.caught_up();
    let text = |name: &str| format!("time,{name}_displacement_mm\n{}", failing(0..114));
    let read = |name: &str| fs::read_to_string(site.path(name)).unwrap_or_default();
    site.append("incoming/x.csv", &text("b"));
    eventually("its run", || site.path("runs").exists());
    let changed = format!(
        "{}{}",
        hook("added.sh", "levels = [\"red\"]"),
        third("\"red\"")
    );
    reload(&site, &program, &format!("{each}{changed}{POLICY}"));
    site.append("incoming/y.csv", &text("c"));
    for name in ["added.runs", "third.runs"] {
        eventually(name, || {
            read(name).contains("c red firing") && read(name).contains("b red firing")
        });
    }
    eventually("c's red", || site.notified("c/red/", "firing") == 1);
    reload(&site, &program, &format!("{each}{slow}{changed}{POLICY}"));
    assert!(!site.path("ended").exists(), "it waited for the hook");
    eventually("the end of the run", || site.path("ended").exists());
    program.stop();
    for name in ["added.runs", "third.runs"] {
        assert_eq!(
            read(name).matches("b red firing").count(),
            1,
            "{}",
            read(name)
        );
        assert_eq!(
            read(name).matches("c red firing").count(),
            1,
            "{}",
            read(name)
        );
    }
    assert_eq!(read("runs"), "begun\n", "it was run for one red again");
    site.proven_events();
}

#[test]
fn maintenance_shows_as_it_is_declared_now_whether_a_reading_comes_or_not() {
    let site = Site::new(POLICY);
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..20)),
    );
    let program = site.caught_up();
    eventually("the readings", || site.values().len() == 20);
    let now = clock::now();
    let (from, until) = (
        now - SignedDuration::from_hours(1),
        now + SignedDuration::from_hours(1),
    );
    let event =
        format!("[[event]]\nkind = \"maintenance\"\ntime = \"{from}\"\nuntil = \"{until}\"\n");
    let is_out = || {
        let status = site.printed(&["status", "--config", "site.toml", "--format", "json"]);
        status.contains("out-of-service")
    };
    assert!(!is_out());
    reload(&site, &program, &format!("{POLICY}{event}"));
    assert!(is_out(), "declared");
    reload(&site, &program, POLICY);
    assert!(!is_out(), "withdrawn");
    program.stop();
    site.proven_events();
}

/// As one that is read while it is being written.
#[test]
fn a_config_without_the_hooks_of_the_one_before_is_reported_and_another_site_name_is_refused() {
    let site = Site::new(POLICY);
    let program = site.caught_up();
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let (before, _) = text.split_once("[[hook]]").unwrap();
    fs::write(site.path("site.toml"), before).unwrap();
    program.signal(Signal::SIGHUP);
    eventually("the fault", || site.events().contains("\"no-hooks\""));
    let other = text.replace("name = \"Toc\"", "name = \"Vajont\"");
    fs::write(site.path("site.toml"), other).unwrap();
    program.signal(Signal::SIGHUP);
    eventually("that it is refused", || {
        site.log().contains("needs a restart")
    });
    fs::write(site.path("site.toml"), &text).unwrap();
    program.stop();
    site.proven_events();
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

/// A source beside the usual ones, with a benchmark `b` of its own.
fn east(keys: &str) -> String {
    format!(
        "[[source]]\nid = \"east\"\nkind = \"csv\"\npath = \"east/*.csv\"\n{keys}\n\
         [[benchmark]]\nid = \"b\"\nsource = \"east\"\n"
    )
}

/// Rows each hour up to now, of which the value is that of the row's number.
pub(crate) fn rows_of(count: i32, value: impl Fn(i32) -> f64) -> String {
    let rows = failing(114 - count..114);
    let rows = rows.lines().zip(0..).map(|(line, row)| {
        let (time, _) = line.split_once(',').unwrap();
        format!("{time},{:.3}\n", value(row))
    });
    rows.collect()
}

pub(crate) const FAR: &str = "[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"50 mm\"\n";

#[test]
fn a_source_that_is_taken_out_and_put_back_is_read_from_its_start() {
    for restarts in [false, true] {
        let without = format!("{}{POLICY}", benchmark("a", ""));
        let with = format!("{}{}{POLICY}", benchmark("a", ""), east(""));
        let site = Site::new(&with);
        fs::create_dir(site.path("east")).unwrap();
        site.append("east/b.csv", &format!("{HEADER}{}", failing(0..114)));
        let mut program = Some(site.caught_up());
        eventually("b's red", || site.notified("b/red/", "firing") == 1);
        let mut change = |more: &str| {
            if restarts {
                program.take().unwrap().stop();
                site.configure(more);
                program = Some(site.caught_up());
            } else {
                reload(&site, program.as_ref().unwrap(), more);
            }
        };
        change(&without);
        eventually("the end", || site.notified("b/red/", "resolved") == 1);
        change(&with);
        eventually("red again", || site.notified("b/red/2/", "firing") == 1);
        program.unwrap().stop();
        site.proven_events();
    }
}

#[test]
fn rows_that_were_set_aside_are_read_when_the_config_says_how_they_are_written() {
    let site = Site::new(&format!("{}{POLICY}", east("")));
    fs::create_dir(site.path("east")).unwrap();
    let rows = failing(0..114);
    let rows = rows.lines().map(|line| {
        let (time, value) = line.split_once(',').unwrap();
        format!("{time};{}\n", value.replace('.', ","))
    });
    let header = HEADER.replace(',', ";");
    site.append("east/b.csv", &(header + &rows.collect::<String>()));
    let program = site.caught_up();
    eventually("that they are set aside", || {
        site.log().contains("for a decimal comma")
    });
    assert!(site.values().is_empty());
    reload(
        &site,
        &program,
        &format!("{}{POLICY}", east("decimal = \",\"")),
    );
    eventually("b's red", || site.notified("b/red/", "firing") == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn codes_that_the_config_names_later_are_no_readings_any_more() {
    let site = Site::new(&format!("{}{POLICY}{FAR}", east("")));
    fs::create_dir(site.path("east")).unwrap();
    let creep = rows_of(100, |row| {
        if row == 0 {
            -9999.0
        } else {
            0.04 * f64::from(row)
        }
    });
    site.append("east/b.csv", &format!("{HEADER}{creep}"));
    let program = site.caught_up();
    eventually("the false red", || site.notified("b/red/", "firing") == 1);
    reload(
        &site,
        &program,
        &format!("{}{POLICY}{FAR}", east("missing = [-9999]")),
    );
    eventually("them anew", || site.values().len() >= 199);
    let why = ["--by", "q", "--why", "a code", "--config", "site.toml"];
    site.printed(&[&["alerts", "resolve", "--benchmark", "b"], &why[..]].concat());
    eventually("the end", || site.notified("b/red/", "resolved") == 1);
    site.append("east/b.csv", &format!("{},4.1\n", clock::now()));
    eventually("the next reading", || site.values().len() >= 200);
    program.stop();
    assert_eq!(site.notified("b/red/", "firing"), 1, "{}", site.events());
    site.proven_events();
}

#[test]
fn a_hook_that_asks_for_less_than_before_receives_the_end_of_what_it_was_notified_of() {
    let second = |keys: &str| {
        format!(
            "{}{POLICY}[[hook]]\nrun = [\"/bin/sh\", \"second.sh\"]\n{keys}\n",
            benchmark("b", "")
        )
    };
    let site = Site::new(&second("levels = [\"red\"]"));
    let script = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> second\n";
    fs::write(site.path("second.sh"), script).unwrap();
    site.append("incoming/b.csv", &format!("{HEADER}{}", failing(0..114)));
    let program = site.caught_up();
    let has = |state: &str| {
        site.lines("second")
            .iter()
            .any(|line| line.ends_with(state))
    };
    eventually("its red", || has("firing"));
    reload(
        &site,
        &program,
        &second("levels = [\"orange\"]\nbenchmarks = [\"a\"]"),
    );
    let why = ["--by", "q", "--why", "a test", "--config", "site.toml"];
    site.printed(&[&["alerts", "resolve", "--all"], &why[..]].concat());
    eventually("its end", || has("resolved"));
    program.stop();
    site.proven_events();
}

#[test]
fn a_reload_that_is_asked_for_while_the_daemon_starts_does_not_end_it() {
    let site = Site::new(&format!("{}{POLICY}", benchmark("b", "")));
    site.append("incoming/b.csv", &format!("{HEADER}{}", failing(0..114)));
    let program = site.start(&[]);
    eventually("the state", || site.path("state").exists());
    program.signal(Signal::SIGHUP);
    eventually("b's red", || site.notified("b/red/", "firing") == 1);
    eventually("the config", || site.log().contains("the config is taken"));
    program.stop();
}
