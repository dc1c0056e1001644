//! The demo as somebody reads it who has never seen it.

use std::process::Command;

#[test]
fn the_demo_says_what_will_be_seen_fits_eighty_columns_and_gives_a_reason_for_each_level() {
    let output = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .args(["demo", "--pace", "0s"])
        .output()
        .unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for line in readme_example() {
        let is_printed = text.lines().any(|printed| printed == line);
        assert!(
            is_printed,
            "the README shows a line that is not printed: {line}"
        );
    }
    let (legend, rest) = text.split_once("=== ").unwrap();
    for level in ["green", "yellow", "orange", "red", "unknown"] {
        assert!(
            legend.contains(&format!("\n  {level}")),
            "{level} is not explained"
        );
    }
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let (crises, card) = rest.split_once("=== What was called when").unwrap();
    for crisis in crises.split("=== ") {
        let is_level = |line: &&str| line.get(4..5) == Some("-") && line.get(7..8) == Some("-");
        let levels: Vec<&str> = crisis.lines().filter(is_level).collect();
        assert!(!levels.is_empty() && levels.len() <= 12, "{crisis}");
        for line in levels {
            assert!(line.split_whitespace().count() > 4, "no reason: {line}");
        }
        assert!(
            crisis.contains("velocity  ") && crisis.contains("forecast  "),
            "{crisis}"
        );
    }
    let silences = crises.matches("  unknown ").count();
    let ends = crises.matches("there are readings again").count();
    assert_eq!(
        (silences, ends),
        (1, 1),
        "a silence without its end: {crises}"
    );
    for point in ["E3", "E5", "63", "40-1938"] {
        assert!(
            card.contains(&format!(" {point} ")),
            "{point} is not in {card}"
        );
    }
}

/// What the README shows of it.
fn readme_example() -> impl Iterator<Item = &'static str> {
    let readme = include_str!("../../README.md");
    let (_, after) = readme
        .split_once("ends by itself within a minute:\n")
        .unwrap();
    let (example, _) = after.split_once("\nVaiont and La Clapi").unwrap();
    let lines: Vec<&str> = example.lines().filter(|line| !line.is_empty()).collect();
    assert!(lines.len() > 15, "{example}");
    lines
        .into_iter()
        .map(|line| line.strip_prefix("    ").unwrap())
}
