//! Files that are renamed, moved or removed, while they are followed and while nobody follows them.

use super::{Bench, HEADER, row, row_at};
use jiff::SignedDuration;
use slipwatch::runtime::clock;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::os::unix::fs::symlink;

const SOURCE: &str = "[[source]]\nid = \"s\"\nkind = \"csv\"\npath = \"in/*.csv\"\n";

fn bench(more: &str) -> Bench {
    Bench::of(&["in", "out"], &format!("{SOURCE}{more}"))
}

impl Bench {
    fn rename(&self, from: &str, to: &str) {
        fs::rename(self.path(from), self.path(to)).unwrap();
    }

    fn writer(&self, name: &str) -> File {
        let mut options = OpenOptions::new();
        options.append(true).open(self.path(name)).unwrap()
    }

    /// Files of one row each, all read; the last was written to last, and the first so many hours ago.
    fn many(&mut self, count: u32, hours: u32) {
        for number in 0..count {
            let name = format!("in/{number:03}.csv");
            self.write(&name, &format!("{HEADER}{}", row(1, 1.0)));
            self.date(&name, hours * 3600 - number);
        }
        assert_eq!(self.news().len(), count as usize);
    }

    /// When it was written to last, seconds ago.
    fn date(&self, name: &str, age: u32) {
        let then = clock::now() - SignedDuration::from_secs(age.into());
        self.writer(name).set_modified(then.into()).unwrap();
    }
}

fn count(news: &[String], what: &str) -> usize {
    news.iter().filter(|one| one.ends_with(what)).count()
}

#[test]
fn a_file_moved_to_another_sources_folder_is_read_there_and_nowhere_else() {
    let source = |id: &str, benchmark: &str| {
        format!(
            "[[source]]\nid = \"{id}\"\nkind = \"csv\"\npath = \"{id}/*.csv\"\n\
             [[benchmark]]\nid = \"{benchmark}\"\nsource = \"{id}\"\ncolumn = \"d\"\nunit = \"mm\"\n"
        )
    };
    let sources = source("a", "P1") + &source("b", "P2");
    let mut bench = Bench::of(&["a", "b"], &sources);
    bench.write("a/p2.csv", &format!("time,d\n{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["P1:1"]);
    bench.rename("a/p2.csv", "b/p2.csv");
    assert_eq!(bench.news(), ["P2:1"]);
    bench.append("b/p2.csv", &row(2, 777.0));
    assert_eq!(bench.news(), ["P2:777"]);
    bench.restart();
    bench.append("b/p2.csv", &row(3, 888.0));
    assert_eq!(bench.news(), ["P2:888"]);
}

#[test]
fn a_file_that_was_read_on_elsewhere_is_not_when_another_source_asks_for_it_there() {
    let other = "[[source]]\nid = \"o\"\nkind = \"csv\"\npath = \"other/*.csv\"\n";
    let mut bench = Bench::of(&["in", "out", "other"], &format!("{SOURCE}{other}"));
    bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    bench.rename("in/5.csv", "out/5.csv");
    assert!(bench.news().is_empty());
    bench.rename("out/5.csv", "other/6.csv");
    assert_eq!(bench.news(), ["6:1"]);
    bench.append("other/6.csv", &row(2, 2.0));
    assert_eq!(bench.news(), ["6:2"]);
}

#[test]
fn a_file_that_comes_back_under_its_name_is_read_on_and_once() {
    for way_back in ["running", "stopped"] {
        let mut bench = bench("");
        // The system knows the folder by another name than the config.
        bench.rename("in", "real");
        symlink("real", bench.path("in")).unwrap();
        bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
        assert_eq!(bench.news(), ["5:1"]);
        bench.rename("real/5.csv", "out/5.csv");
        assert!(bench.news().is_empty());
        bench.append("out/5.csv", &row(2, 2.0));
        assert_eq!(bench.news(), ["5:2"]);
        if way_back == "stopped" {
            bench.restart();
        }
        bench.rename("out/5.csv", "in/5.csv");
        let bad = "2017-06-03T00:00:00Z,NaN\nnonsense,row,here\n";
        bench.append("in/5.csv", &format!("{bad}{}", row(4, 4.0)));
        assert_eq!(bench.news(), ["5 gives NaN", "5:4"], "{way_back}");
        assert_eq!(bench.follower.quarantined(), 1, "{way_back}");
        let names: Vec<&String> = bench.saved.keys().collect();
        let [name] = &names[..] else {
            panic!("{names:?}");
        };
        assert!(name.ends_with("in/5.csv"), "{name}");
        bench.restart();
        assert!(bench.news().is_empty(), "{way_back}");
    }
}

#[test]
fn what_waits_of_a_file_that_was_moved_is_read_again_after_a_restart() {
    for looks in [1, 2] {
        let mut bench = bench("reorder = \"2h\"\n");
        let minute = |minute: i64| bench_row(&bench, minute);
        let rows: Vec<String> = (0..9).map(|number| minute(10 * number - 90)).collect();
        bench.write("in/5.csv", HEADER);
        if looks == 2 {
            assert!(bench.news().is_empty());
        }
        bench.append("in/5.csv", &rows.concat());
        assert!(bench.news().is_empty());
        bench.rename("in/5.csv", "out/5.csv");
        assert!(bench.news().is_empty());
        for _again in 0..2 {
            bench.restart();
            assert!(bench.news().is_empty());
        }
        bench.wall += SignedDuration::from_hours(3);
        let expected: Vec<String> = (0..9)
            .map(|number| format!("5:{}", 10 * number - 90))
            .collect();
        assert_eq!(bench.news(), expected, "{looks}");
        bench.restart();
        assert!(bench.news().is_empty());
        bench.wall += SignedDuration::from_hours(3);
        assert!(bench.news().is_empty());
    }
}

/// A row so many minutes after the wall clock's time, and that number.
fn bench_row(bench: &Bench, minute: i64) -> String {
    row_at(bench.wall + SignedDuration::from_mins(minute), minute)
}

#[test]
fn what_waits_of_a_file_that_was_removed_goes_out_as_nothing_could_read_it_again() {
    let mut bench = bench("reorder = \"2h\"\n");
    let rows = [-9, -7, -8].map(|minute| bench_row(&bench, minute));
    bench.write("in/5.csv", &format!("{HEADER}{}", rows.concat()));
    assert!(bench.news().is_empty());
    let mut writer = bench.writer("in/5.csv");
    fs::remove_file(bench.path("in/5.csv")).unwrap();
    assert_eq!(bench.news(), ["5:-9", "5:-8", "5:-7"]);
    writer.write_all(bench_row(&bench, -6).as_bytes()).unwrap();
    assert_eq!(bench.news(), ["5:-6"]);
    bench.restart();
    assert_eq!(bench.news(), ["possible-gap"]);
}

#[test]
fn of_a_removed_file_that_is_written_on_a_restart_says_that_readings_may_be_missing() {
    let mut bench = bench("");
    bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    let mut writer = bench.writer("in/5.csv");
    fs::remove_file(bench.path("in/5.csv")).unwrap();
    writer.write_all(row(2, 2.0).as_bytes()).unwrap();
    assert_eq!(bench.news(), ["5:2"]);
    // Another file under its name is none of its business.
    bench.write("in/5.csv", &format!("{HEADER}{}", row(3, 3.0)));
    assert_eq!(bench.news(), ["5:3"]);
    bench.restart();
    writer.write_all(row(4, 4.0).as_bytes()).unwrap();
    assert_eq!(bench.news(), ["possible-gap"]);
    let [fault] = &bench.faults[..] else {
        panic!("{:?}", bench.faults);
    };
    assert!(fault.starts_with("5.csv (gone, "), "{fault}");
    bench.restart();
    assert!(bench.news().is_empty(), "said again");
}

/// As where the number of a file that was removed is that of another one by now.
#[test]
fn another_file_of_the_same_number_is_not_read_in_the_place_of_one_that_has_gone() {
    for is_running in [true, false] {
        let mut bench = bench("");
        bench.write("in/5.csv", &format!("{HEADER}{}", row(1, 1.0)));
        assert_eq!(bench.news(), ["5:1"]);
        bench.rename("in/5.csv", "in/notes.txt");
        if is_running {
            assert!(bench.news().is_empty());
        } else {
            bench.restart();
        }
        let rows: String = (2..9).map(|day| row(day, 9.0)).collect();
        bench.write("in/notes.txt", &format!("{HEADER}{rows}"));
        assert_eq!(bench.news(), ["possible-gap"], "{is_running}");
        bench.append("in/notes.txt", &row(9, 9.0));
        assert!(bench.news().is_empty(), "{is_running}");
        assert!(bench.saved.is_empty(), "{:?}", bench.saved.keys());
    }
}

#[test]
fn a_file_that_is_renamed_within_its_pattern_while_nobody_follows_it_is_no_gap() {
    let benchmark = "[[benchmark]]\nid = \"5\"\ncolumn = \"displacement_mm\"\nunit = \"mm\"\n";
    let mut bench = bench(benchmark);
    bench.write("in/f.csv", &format!("{HEADER}{}", row(1, 1.0)));
    assert_eq!(bench.news(), ["5:1"]);
    bench.append("in/f.csv", &row(2, 2.0));
    bench.rename("in/f.csv", "in/g.csv");
    bench.restart();
    assert_eq!(bench.news(), ["5:1", "5:2"]);
}

#[test]
fn of_more_files_that_have_gone_than_are_read_on_the_oldest_are_named_in_faults() {
    let mut bench = bench("");
    bench.many(100, 10);
    bench.rename("in", "out/in");
    fs::create_dir(bench.path("in")).unwrap();
    let append = |bench: &Bench, day: u32| {
        for number in 0..100 {
            let name = format!("out/in/{number:03}.csv");
            bench.append(&name, &row(day, f64::from(day)));
            bench.date(&name, 3600 - number);
        }
    };
    append(&bench, 2);
    // What was written before the files were looked for is read of all of them.
    let news = bench.news();
    assert_eq!((news.len(), count(&news, ":2")), (100, 100));
    append(&bench, 3);
    let news = bench.news();
    assert_eq!((count(&news, ":3"), count(&news, "possible-gap")), (64, 36));
    assert_eq!(news.len(), 100);
    for (number, fault) in bench.faults.iter().enumerate() {
        assert!(fault.starts_with(&format!("{number:03}.csv: ")), "{fault}");
    }
}

#[test]
fn the_number_of_files_that_have_gone_is_bounded_whatever_they_are_called() {
    for to in ["out", "archive"] {
        let mut bench = bench("");
        fs::create_dir(bench.path("archive")).unwrap();
        bench.many(70, 10);
        let mut news = Vec::new();
        for number in 0..70 {
            let name = format!("{number:03}.csv");
            bench.rename(&format!("in/{name}"), &format!("{to}/{name}"));
            news.extend(bench.news());
        }
        for number in 0..70 {
            bench.append(&format!("{to}/{number:03}.csv"), &row(2, 2.0));
        }
        news.extend(bench.news());
        assert_eq!(count(&news, ":2"), 64, "{to}");
        assert_eq!(count(&news, "possible-gap"), 6, "{to}");
    }
}

#[test]
fn a_file_that_nobody_finds_again_is_a_possible_gap_unless_it_is_old() {
    for (hours, gaps) in [(10, 72), (100, 0)] {
        let mut bench = bench("");
        // Of these, 128 are held open.
        bench.many(200, hours);
        for number in 0..200 {
            let name = format!("{number:03}.csv");
            fs::remove_file(bench.path("in").join(name)).unwrap();
        }
        let news = bench.news();
        assert_eq!(news.len(), gaps);
        assert_eq!(count(&news, "possible-gap"), gaps);
    }
}

#[test]
fn of_two_names_of_one_file_that_has_gone_one_is_read_on_and_the_other_is_a_possible_gap() {
    let mut bench = bench("");
    bench.write("out/x.csv", &format!("{HEADER}{}", row(1, 1.0)));
    for name in ["5", "6"] {
        symlink(
            bench.path("out/x.csv"),
            bench.path(&format!("in/{name}.csv")),
        )
        .unwrap();
    }
    assert_eq!(bench.news(), ["5:1", "6:1"]);
    bench.rename("out/x.csv", "out/y.csv");
    bench.append("out/y.csv", &row(2, 2.0));
    assert_eq!(bench.news(), ["possible-gap", "5:2"]);
}

#[test]
fn a_folder_that_cannot_be_listed_for_a_while_costs_no_file_its_place() {
    let mut bench = bench("");
    bench.many(70, 10);
    bench.rename("in", "aside");
    symlink("in", bench.path("in")).unwrap();
    assert!(bench.news().is_empty(), "a link to itself");
    fs::remove_file(bench.path("in")).unwrap();
    bench.rename("aside", "in");
    bench.rename("in/069.csv", "out/069.csv");
    assert!(bench.news().is_empty());
    for number in 0..69 {
        bench.append(&format!("in/{number:03}.csv"), &row(2, 2.0));
    }
    bench.append("out/069.csv", &row(2, 2.0));
    let news = bench.news();
    assert_eq!((news.len(), count(&news, ":2")), (70, 70));
}
