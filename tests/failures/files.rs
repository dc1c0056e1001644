//! What happens to files while they are followed.

use crate::site::{Program, Site, eventually};
use jiff::SignedDuration;
use nix::sys::signal::Signal;
use slipwatch::runtime::clock;
use std::fs::{self, OpenOptions};
use std::io::Write;

fn row(day: u32) -> String {
    format!("2020-01-{day:02}T00:00:00Z,{day}\n")
}

fn rows(days: std::ops::Range<u32>) -> String {
    days.map(row).collect()
}

const HEADER: &str = "time,displacement_mm\n";

fn gaps(site: &Site) -> usize {
    site.events().matches("\"kind\":\"possible-gap\"").count()
}

/// A site of which five rows have been read, each of which the next one ended.
fn ended_by_the_next() -> (Site, Program) {
    let site = Site::new("");
    site.append("incoming/5.csv", HEADER.trim_end());
    let program = site.caught_up();
    for day in 1..6 {
        site.append("incoming/5.csv", &format!("\n{}", row(day).trim_end()));
        let before = day as usize - 1;
        eventually("the row before it", || site.values().len() >= before);
    }
    eventually("the last one", || site.values().len() == 5);
    (site, program)
}

#[test]
fn a_row_that_is_ended_only_by_the_next_one_is_read_where_three_before_it_were_and_comes_again_with_its_rest()
 {
    let (site, program) = ended_by_the_next();
    // Its writer was not done with this one.
    site.append("incoming/5.csv", "\n2020-01-06T00:00:00Z,6");
    eventually("what is there of it", || site.values().len() == 6);
    site.append("incoming/5.csv", ".25\n2020-01-07T00:00:00Z,7\n");
    eventually("its rest, and another one", || site.values().len() == 8);
    program.stop();
    let values: Vec<String> = site.values().iter().map(|one| format!("{one:?}")).collect();
    assert!(values.iter().any(|one| one.contains("6.25")), "{values:?}");
    assert!(!site.events().contains("quarantined"), "{}", site.events());
}

/// As at a daily rotation.
#[test]
fn the_first_rows_of_a_new_file_are_not_waited_for_where_the_one_before_it_was_written_so() {
    let (site, program) = ended_by_the_next();
    fs::rename(site.path("incoming/5.csv"), site.path("5.old")).unwrap();
    let first = format!("{}\n{}", HEADER.trim_end(), row(6).trim_end());
    site.append("incoming/5.csv", &first);
    eventually("the first of the next file", || site.values().len() == 6);
    program.stop();
}

/// 1. While it runs, and while it does not.
#[test]
fn a_file_copied_and_truncated_is_read_again_and_a_possible_gap_is_said_once_each() {
    let site = Site::new("");
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(1..6)));
    let program = site.caught_up();
    let cut = |text: &str| {
        fs::copy(site.path("incoming/5.csv"), site.path("incoming/5.csv.1")).unwrap();
        let file = OpenOptions::new()
            .write(true)
            .open(site.path("incoming/5.csv"))
            .unwrap();
        file.set_len(0).unwrap();
        drop(file);
        site.append("incoming/5.csv", text);
    };
    cut(&format!("{HEADER}{}", rows(6..8)));
    eventually("what came after", || site.values().len() == 7);
    program.stop();
    assert_eq!(gaps(&site), 1);
    // Grown beyond the place where it was left, and with what is known already.
    cut(&format!("{HEADER}{}", rows(3..20)));
    site.caught_up().stop();
    assert_eq!((gaps(&site), site.values().len()), (2, 19));
    site.caught_up().stop();
    assert_eq!((gaps(&site), site.values().len()), (2, 19), "said again");
    let events = site.proven_events();
    assert!(events.contains("5.csv: cut off at"), "{events}");
}

/// As a logger that keeps its file open while logrotate renames it, or an archive takes it away; over a restart too.
#[test]
fn rows_that_are_written_to_a_file_after_it_was_renamed_or_moved_are_read() {
    let site = Site::new("");
    fs::create_dir(site.path("archive")).unwrap();
    for name in ["5.csv", "6.csv"] {
        let text = format!("{HEADER}{}", rows(1..4));
        site.append(&format!("incoming/{name}"), &text);
    }
    let mut program = site.caught_up();
    let open = |name: &str| {
        let mut options = OpenOptions::new();
        options.append(true).open(site.path(name)).unwrap()
    };
    let mut writers = [open("incoming/5.csv"), open("incoming/6.csv")];
    fs::rename(site.path("incoming/5.csv"), site.path("incoming/5.csv.1")).unwrap();
    fs::rename(site.path("incoming/6.csv"), site.path("archive/6.csv")).unwrap();
    eventually("both have gone", || {
        site.log().matches("read on").count() == 2
    });
    for (day, count) in [(4, 8), (5, 10), (6, 12)] {
        // Longer than between two looks.
        std::thread::sleep(std::time::Duration::from_millis(2500));
        for writer in &mut writers {
            writer.write_all(row(day).as_bytes()).unwrap();
        }
        eventually("what was added", || site.values().len() == count);
        if day == 4 {
            program.stop();
            program = site.caught_up();
        }
    }
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(7..8)));
    eventually("the new file", || site.values().len() == 13);
    program.stop();
    assert_eq!(gaps(&site), 0);
    let events = site.proven_events();
    assert!(
        events.contains("\"6\"") && !events.contains("csv"),
        "{events}"
    );
}

/// Files that have gone when another config is taken, of one of which values wait for earlier ones.
#[test]
fn a_reload_goes_on_with_a_file_that_was_moved_and_says_that_a_removed_one_is_read_no_more() {
    let late = "[[source]]\nid = \"late\"\nkind = \"csv\"\npath = \"late/*.csv\"\n";
    let site = Site::new(&format!("{late}reorder = \"2h\"\n"));
    for folder in ["late", "archive"] {
        fs::create_dir(site.path(folder)).unwrap();
    }
    let now = clock::now();
    let recent: String = (0..9)
        .map(|number| {
            format!(
                "{},{number}\n",
                now - SignedDuration::from_mins(90 - 10 * number)
            )
        })
        .collect();
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(1..6)));
    site.append("late/6.csv", &format!("{HEADER}{}", rows(1..6)));
    site.append("late/6.csv", &recent);
    let program = site.caught_up();
    eventually("what need not wait", || site.values().len() == 10);
    let mut writer = OpenOptions::new();
    let mut writer = writer
        .append(true)
        .open(site.path("incoming/5.csv"))
        .unwrap();
    fs::rename(site.path("late/6.csv"), site.path("archive/6.csv")).unwrap();
    fs::remove_file(site.path("incoming/5.csv")).unwrap();
    eventually("both have gone", || {
        site.log().matches("read on").count() == 2
    });
    writer.write_all(row(6).as_bytes()).unwrap();
    eventually("a row without a name", || site.values().len() == 11);
    site.configure(late);
    program.signal(Signal::SIGHUP);
    eventually("what has waited", || site.values().len() == 20);
    eventually("that readings may be missing", || gaps(&site) == 1);
    program.stop();
    site.caught_up().stop();
    assert_eq!((gaps(&site), site.values().len()), (1, 20));
    let events = site.proven_events();
    assert!(events.contains("5.csv (gone, "), "{events}");
}

/// 4.
#[test]
fn a_link_that_turns_and_a_folder_that_goes_and_comes_back_are_followed() {
    let site = Site::new("");
    site.append("one", &format!("{HEADER}{}", rows(1..4)));
    site.append("two", &format!("{HEADER}{}", rows(4..7)));
    let link = site.path("incoming/5.csv");
    std::os::unix::fs::symlink(site.path("one"), &link).unwrap();
    let program = site.caught_up();
    std::os::unix::fs::symlink(site.path("two"), site.path("new")).unwrap();
    fs::rename(site.path("new"), &link).unwrap();
    eventually("the other file", || site.values().len() == 6);
    fs::remove_dir_all(site.path("incoming")).unwrap();
    eventually("that it is gone", || site.log().contains("cannot list"));
    fs::create_dir(site.path("incoming")).unwrap();
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(6..9)));
    eventually("the new folder", || site.values().len() == 8);
    program.stop();
    assert_eq!(gaps(&site), 0);
    site.proven_events();
}

/// 10.
#[test]
fn readings_of_the_first_day_of_1970_are_set_aside_and_time_does_not_go_by_them() {
    let site = Site::new("");
    let first = "1970-01-01T00:00:00Z,9\n1970-01-01T23:59:59Z,9\n";
    site.append(
        "incoming/5.csv",
        &format!("{HEADER}{first}{}{first}", rows(1..6)),
    );
    site.caught_up().stop();
    let times: Vec<String> = (site.values().iter().map(|(_, time, _)| time.to_string())).collect();
    assert_eq!(times.len(), 5, "{times:?}");
    assert!(
        times.iter().all(|time| time.starts_with("2020")),
        "{times:?}"
    );
    let log = site.log();
    assert_eq!(
        log.matches("a logger whose clock is not set").count(),
        4,
        "{log}"
    );
    assert!(log.contains("without_clock=4"), "{log}");
}

/// 13. Root may read everything, so a folder stands in the place of a file, and a link that leads nowhere.
#[test]
fn what_cannot_be_read_stops_no_other_source() {
    let site = Site::new("");
    fs::create_dir(site.path("incoming/4.csv")).unwrap();
    std::os::unix::fs::symlink("nowhere", site.path("incoming/3.csv")).unwrap();
    std::os::unix::fs::symlink("6.csv", site.path("incoming/6.csv")).unwrap();
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(1..4)));
    let program = site.caught_up();
    site.append("incoming/5.csv", &rows(4..5));
    eventually("the others", || site.values().len() == 4);
    // What could not be read is, once it can.
    fs::remove_dir(site.path("incoming/4.csv")).unwrap();
    site.append("incoming/4.csv", &format!("{HEADER}{}", rows(1..3)));
    eventually("the file in its place", || site.values().len() == 6);
    program.stop();
}

/// 12. The kernel refuses every watch, as when the user has none left.
#[test]
#[cfg_attr(not(has_strace), ignore = "strace was not found by build.rs")]
fn without_any_watch_files_are_looked_at_in_turn() {
    let site = Site::new("");
    site.append("incoming/5.csv", &format!("{HEADER}{}", rows(1..4)));
    let program = site.start_traced("inotify_add_watch", "error=ENOSPC");
    eventually("caught up", || site.log().contains("caught up"));
    site.append("incoming/5.csv", &rows(4..9));
    eventually("what was added", || site.values().len() == 8);
    eventually("a warning", || site.log().contains("read in turn"));
    program.stop();
}
