//! Rotations by which the old file keeps a name that its source asks for.

use super::{Bench, HEADER, row};
use std::fs;
use std::process::Command;

fn bench(more: &str) -> Bench {
    let source = "[[source]]\nid = \"s\"\nkind = \"csv\"\npath = \"in/*.csv\"\n";
    Bench::of(&["in"], &format!("{source}{more}"))
}

fn rename(bench: &Bench, from: &str, to: &str) {
    fs::rename(bench.path(from), bench.path(to)).unwrap();
}

/// As deploy/logrotate.conf has it: the name says the date, and still ends in .csv.
#[test]
fn a_rotated_file_that_the_pattern_still_asks_for_goes_on_as_the_benchmark_that_it_was() {
    for (config, is_down) in [
        ("", false),
        ("", true),
        ("[[benchmark]]\nid = \"5\"\n", false),
        ("[[benchmark]]\nid = \"5\"\n", true),
    ] {
        let mut bench = bench(config);
        bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
        assert_eq!(bench.news(), ["5:1"]);
        // Before the rename, after it, and in the new file.
        bench.append("in/5.csv", &row(2, 2.0));
        rename(&bench, "in/5.csv", "in/5-20170603.csv");
        bench.append("in/5-20170603.csv", &row(3, 3.0));
        bench.write("in/5.csv", &format!("{HEADER}{}", row(4, 4.0)));
        if is_down {
            bench.restart();
        }
        assert_eq!(bench.news(), ["5:2", "5:3", "5:4"], "{config} {is_down}");
        // Also after a further rotation, and a restart.
        rename(&bench, "in/5.csv", "in/5-20170604.csv");
        bench.write("in/5.csv", HEADER);
        assert!(bench.news().is_empty());
        bench.restart();
        bench.append("in/5-20170604.csv", &row(5, 5.0));
        bench.append("in/5.csv", &row(6, 6.0));
        assert_eq!(bench.news(), ["5:5", "5:6"]);
        assert!(bench.faults.is_empty(), "{:?}", bench.faults);
    }
}

#[test]
fn before_the_new_file_is_there_the_name_says_that_it_is_a_rotation() {
    let mut bench = bench("");
    bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    bench.append("in/5.csv", &row(2, 2.0));
    rename(&bench, "in/5.csv", "in/5-20170603.csv");
    assert_eq!(bench.news(), ["5:2"]);
    bench.write("in/5.csv", &format!("{HEADER}{}", row(3, 3.0)));
    assert_eq!(bench.news(), ["5:3"]);
}

#[test]
fn a_rotated_file_that_is_packed_is_no_other_benchmark() {
    let mut bench = bench("");
    bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    rename(&bench, "in/5.csv", "in/5-20170603.csv");
    bench.write("in/5.csv", &format!("{HEADER}{}", row(2, 2.0)));
    assert_eq!(bench.news(), ["5:2"]);
    let packed = Command::new("gzip")
        .arg(bench.path("in/5-20170603.csv"))
        .status();
    assert!(packed.unwrap().success());
    // Known: whoever takes it drops it.
    assert_eq!(bench.news(), ["5:1"]);
    assert!(bench.news().is_empty());
}

/// A name that was wrong is put right.
#[test]
fn a_file_that_gets_another_name_altogether_is_the_benchmark_of_that_name() {
    let mut bench = bench("");
    bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    bench.write("in/6.csv", &format!("{HEADER}{}", row(1, 2.0)));
    assert_eq!(bench.news(), ["5:1", "6:2"]);
    rename(&bench, "in/5.csv", "in/7.csv");
    assert_eq!(bench.news(), ["7:1"]);
    // Two that were mixed up.
    rename(&bench, "in/6.csv", "in/other");
    rename(&bench, "in/7.csv", "in/6.csv");
    rename(&bench, "in/other", "in/7.csv");
    assert_eq!(bench.news(), ["6:1", "7:2"]);
}

/// A logger that writes its header only into a file that it creates itself.
#[test]
fn a_file_without_a_header_is_read_by_that_of_the_file_that_had_its_name_before() {
    for way in ["create", "copytruncate", "down"] {
        let mut bench = bench("");
        bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
        assert_eq!(bench.news(), ["5:1"]);
        if way == "copytruncate" {
            bench.write("in/5.csv", "");
        } else {
            rename(&bench, "in/5.csv", "in/5-20170603.csv");
            bench.write("in/5.csv", "");
        }
        if way == "down" {
            bench.restart();
        }
        bench.append("in/5.csv", &row(2, 2.0));
        let news = bench.news();
        assert_eq!(news.last().map(String::as_str), Some("5:2"), "{way}");
        bench.append("in/5.csv", &format!("{}{}", row(3, 3.0), row(4, 4.0)));
        assert_eq!(bench.news(), ["5:3", "5:4"], "{way}");
        bench.restart();
        bench.append("in/5.csv", &row(5, 5.0));
        assert_eq!(bench.news(), ["5:5"], "{way}");
        assert_eq!(bench.follower.quarantined(), 0);
    }
    // What is no row of that header is refused as before.
    let mut bench = bench("");
    bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    rename(&bench, "in/5.csv", "in/5-20170603.csv");
    bench.write("in/5.csv", "a;b\n1;2\n");
    assert!(bench.news().is_empty());
    assert_eq!(bench.follower.quarantined(), 1);
}

/// An export that writes its file anew each time.
#[test]
fn a_file_that_is_replaced_by_one_that_holds_what_was_read_is_no_gap_at_a_restart() {
    let mut bench = bench("");
    let mut rows = row(1, 1.0);
    bench.write("in/5.csv", &format!("{HEADER}{rows}"));
    assert_eq!(bench.news(), ["5:1"]);
    for day in 2..5 {
        rows += &row(day, f64::from(day));
        bench.write("in/new", &format!("{HEADER}{rows}"));
        rename(&bench, "in/new", "in/5.csv");
        assert_eq!(bench.news().len(), day as usize);
    }
    bench.restart();
    assert!(bench.news().is_empty());
}
