//! `plot` from outside: what is drawn, and what it answers to a wrong call.

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use std::fs;

const PREONZO: [&str; 3] = ["recordings/preonzo-2012.mcap", "--benchmark", "E3"];
const COLLAPSE: [&str; 2] = ["--failure-time", "2012-05-15T01:30:00Z"];
const INVERSE: [&str; 2] = ["--kind", "inverse-velocity"];
const FORECAST: [&str; 2] = ["--kind", "forecast"];
const REGIME: [&str; 2] = ["--kind", "regime"];

fn plot(arguments: &[&[&str]]) -> Assert {
    Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("plot")
        .args(arguments.concat())
        .assert()
}

fn drawn(arguments: &[&[&str]]) -> String {
    let done = plot(arguments).success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

/// The code, and what stderr says.
fn refused(arguments: &[&[&str]]) -> (i32, String) {
    let failed = plot(arguments).failure();
    let output = failed.get_output();
    assert!(output.stdout.is_empty());
    let said = String::from_utf8(output.stderr.clone()).unwrap();
    (output.status.code().unwrap(), said)
}

/// Panics where `xml` is not well-formed: tags that close in their order, attributes in quotes and once each, one
/// root, known entities only.
fn check_xml(xml: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut roots = 0;
    let mut rest = xml.trim();
    while !rest.is_empty() {
        let Some(inner) = rest.strip_prefix('<') else {
            let end = rest.find('<').unwrap();
            assert!(!open.is_empty(), "text outside the root: {rest:.60}");
            check_text(&rest[..end]);
            rest = &rest[end..];
            continue;
        };
        let end = inner.find('>').unwrap();
        let tag = &inner[..end];
        rest = &inner[end + 1..];
        if open.is_empty() {
            rest = rest.trim_start();
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed out of order");
            continue;
        }
        let body = tag.trim_end_matches('/');
        let (name, attributes) = body.split_once(' ').unwrap_or((body, ""));
        check_attributes(attributes);
        roots += usize::from(open.is_empty());
        if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    assert_eq!(roots, 1);
}

fn check_text(text: &str) {
    assert!(!text.contains(|letter: char| letter.is_control() && letter != '\n'));
    for part in text.split('&').skip(1) {
        let known = ["amp;", "lt;", "gt;", "quot;"];
        assert!(known.iter().any(|one| part.starts_with(one)), "&{part:.20}");
    }
}

fn check_attributes(text: &str) {
    let mut names: Vec<&str> = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let (name, after) = rest.split_once("=\"").unwrap();
        let (value, after) = after.split_once('"').unwrap();
        assert!(!name.contains(' ') && !names.contains(&name), "{name}");
        assert!(!value.contains('<'), "{value}");
        check_text(value);
        names.push(name);
        rest = after.trim_start();
    }
}

#[test]
fn a_crisis_is_drawn_as_well_formed_xml_with_its_levels_and_its_collapse_in_words() {
    for kind in [&INVERSE, &FORECAST, &REGIME] {
        let svg = drawn(&[&PREONZO, &COLLAPSE, kind]);
        check_xml(&svg);
        for word in ["green", "red", ">collapse<", "2012-05-15 01:30Z", "E3"] {
            assert!(svg.contains(word), "{word}");
        }
        // One file alone: nothing is fetched.
        for reference in ["href", "url(http", "<script", "@import", "NaN", "inf\""] {
            assert!(!svg.contains(reference), "{reference}");
        }
    }
}

#[test]
fn the_residual_is_that_of_the_readings_asked_for() {
    let residual = ["--kind", "residual"];
    let svg = drawn(&[&PREONZO, &residual]);
    check_xml(&svg);
    let earlier = drawn(&[&PREONZO, &residual, &["--until", "2012-05-08"]]);
    check_xml(&earlier);
    assert_ne!(svg, earlier);
    let few = refused(&[&PREONZO, &residual, &["--until", "2012-04-11"]]);
    assert!(few.1.contains("too few readings"), "{few:?}");
    let dated = refused(&[&PREONZO, &residual, &["--at", "2012-05-07"]]);
    assert_eq!(dated.0, 2);
}

#[test]
fn two_runs_draw_the_same_bytes_to_stdout_or_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    for kind in [&INVERSE, &FORECAST] {
        let svg = drawn(&[&PREONZO, &COLLAPSE, kind]);
        assert_eq!(svg, drawn(&[&PREONZO, &COLLAPSE, kind]));
        let file = folder.path().join("out.svg");
        let written = drawn(&[&PREONZO, &COLLAPSE, kind, &["-o", file.to_str().unwrap()]]);
        assert!(written.is_empty());
        assert_eq!(fs::read_to_string(file).unwrap(), svg);
    }
}

#[test]
fn levels_and_forecasts_are_those_of_a_replay_with_the_same_flags() {
    let until = ["--until", "2012-05-08"];
    let evacuation = ["--evacuation-time", "72h"];
    let svg = drawn(&[
        &PREONZO,
        &INVERSE,
        &until,
        &evacuation,
        &["--at", "2012-05-07"],
    ]);
    let replayed = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("replay")
        .args(PREONZO)
        .args(evacuation)
        .args(["--until", "2012-05-08T00:00:00Z", "--format", "json"])
        .assert()
        .success();
    let mut chance = None;
    let mut levels = vec!["green".to_owned()];
    for line in String::from_utf8_lossy(&replayed.get_output().stdout).lines() {
        let event: serde_json::Value = serde_json::from_str(line).unwrap();
        if event["event"] == "refit" && event["time"].as_str().unwrap() <= "2012-05-07" {
            chance = event["failure_time"]["probability"].as_f64();
        }
        if event["event"] == "alert" && event["state"] == "firing" {
            levels.push(event["level"].as_str().unwrap().to_owned());
        }
    }
    let chance = slipwatch::alert::chance_in_words(chance.unwrap());
    let chance = format!("chance {}", chance.replace('>', "&gt;"));
    assert!(svg.contains(&chance), "{chance}");
    for level in ["green", "yellow", "orange", "red"] {
        let is_drawn = svg.contains(&format!(">{level}<"));
        assert_eq!(is_drawn, levels.contains(&level.to_owned()), "{level}");
    }
}

#[test]
fn velocities_and_a_slope_that_stood_are_drawn_too() {
    let vaiont = [
        "recordings/vaiont-1963-reconstruction.mcap",
        "--benchmark",
        "5",
    ];
    let svg = drawn(&[&vaiont, &INVERSE]);
    check_xml(&svg);
    assert!(svg.contains("velocity, mm/day") && !svg.contains(">collapse<"));
    let century = [
        "recordings/century-mine-2013.mcap",
        "--benchmark",
        "40-1938",
    ];
    for kind in [&INVERSE, &FORECAST] {
        check_xml(&drawn(&[&century, kind]));
    }
}

#[test]
fn a_name_with_marks_of_xml_in_it_is_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("<script>&.csv");
    let rows = (1..=9).map(|day| format!("2020-03-0{day}T00:00:00Z,{day}\n"));
    let text = format!("time,displacement_mm\n{}", rows.collect::<String>());
    fs::write(&file, text).unwrap();
    let svg = drawn(&[&[file.to_str().unwrap()], &INVERSE]);
    check_xml(&svg);
    assert!(svg.contains("&lt;script&gt;&amp;"));
    assert!(svg.contains("no forecast yet"));
}

#[test]
fn a_benchmark_that_is_not_there_is_answered_with_those_that_are() {
    let file = PREONZO[0];
    let (code, said) = refused(&[&[file, "--benchmark", "E9"], &INVERSE]);
    assert_eq!(code, 65);
    for text in ["E9", "E1", "E5"] {
        assert!(said.contains(text), "{said}");
    }
    let (code, said) = refused(&[&[file], &INVERSE]);
    assert_eq!(code, 65);
    assert!(
        said.contains("--benchmark") && said.contains("E4"),
        "{said}"
    );
}

#[test]
fn a_file_without_readings_is_said_to_have_none() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rain.csv");
    fs::write(&file, "time,rain_mm\n2020-01-01T00:00:00Z,1\n").unwrap();
    let (code, said) = refused(&[&[file.to_str().unwrap()], &INVERSE]);
    assert_eq!(code, 65);
    assert!(
        said.contains("no benchmark readings") && said.contains("rain_mm"),
        "{said}"
    );
}

#[test]
fn a_date_outside_the_record_is_answered_with_its_span() {
    let late = ["--at", "2012-05-07,2013-01-01"];
    let (code, said) = refused(&[&PREONZO, &INVERSE, &late]);
    assert_eq!(code, 2);
    for text in [
        "2013-01-01T00:00:00Z",
        "2012-04-09T22:00:00Z",
        "2012-05-14T22:00:00Z",
    ] {
        assert!(said.contains(text), "{said}");
    }
    // The record ends where the replay does.
    let until = ["--until", "2012-05-01", "--at", "2012-05-07"];
    let (_, said) = refused(&[&PREONZO, &INVERSE, &until]);
    assert!(said.contains("2012-04-30T22:00:00Z"), "{said}");
    let (_, said) = refused(&[&PREONZO, &INVERSE, &["--until", "2012-01-01"]]);
    assert!(said.contains("2012-04-09T22:00:00Z"), "{said}");
    let (code, said) = refused(&[&PREONZO, &INVERSE, &["--failure-time", "2011-01-01"]]);
    assert_eq!(code, 65);
    assert!(said.contains("2012-04-09T22:00:00Z"), "{said}");
}

#[test]
fn what_is_no_time_and_what_does_not_belong_together_is_said() {
    let (code, said) = refused(&[&PREONZO, &INVERSE, &["--at", "soon"]]);
    assert_eq!(code, 2);
    assert!(
        said.contains("soon") && said.contains("or a date"),
        "{said}"
    );
    let (code, said) = refused(&[&PREONZO, &FORECAST, &["--at", "2012-05-07"]]);
    assert_eq!(code, 2);
    assert!(said.contains("inverse-velocity"), "{said}");
}

#[test]
fn the_picture_that_is_shown_is_well_formed() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/preonzo-2012.svg");
    let svg = fs::read_to_string(file).unwrap();
    check_xml(&svg);
    assert!(svg.contains("collapse 2012-05-15 01:30Z"));
}

#[test]
fn a_file_whose_name_ends_in_png_is_a_picture_with_lines_and_letters() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("e3.PNG");
    plot(&[
        &PREONZO,
        &INVERSE,
        &COLLAPSE,
        &["-o", file.to_str().unwrap()],
    ])
    .success();
    let bytes = fs::read(&file).unwrap();
    let picture = resvg::tiny_skia::Pixmap::decode_png(&bytes).unwrap();
    let svg = drawn(&[&PREONZO, &INVERSE, &COLLAPSE]);
    let tree = roxmltree::Document::parse(&svg).unwrap();
    let size = |name: &str| {
        tree.root_element()
            .attribute(name)
            .unwrap()
            .parse::<u32>()
            .unwrap()
    };
    assert_eq!(picture.width(), 2 * size("width"));
    assert_eq!(picture.height(), 2 * size("height"));
    let has = |red: u8, green: u8, blue: u8| {
        let is_it = |one: &resvg::tiny_skia::PremultipliedColorU8| {
            (one.red(), one.green(), one.blue()) == (red, green, blue)
        };
        picture.pixels().iter().any(is_it)
    };
    assert!(has(255, 255, 255), "the ground");
    assert!(has(0, 0x72, 0xb2), "the readings");
    assert!(has(0x11, 0x11, 0x11), "letters");
}
